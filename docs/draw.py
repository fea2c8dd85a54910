"""Draw kicks.svg, steady.svg, kinds.svg and sicm-kicked.gif: .venv/bin/python docs/draw.py [DIR].

DIR is docs/images unless given.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.analytic import steady
from heavytop.plots.figures import View, save
from heavytop.plots.sphere import PUSH, axis_path, kind_panel, touched
from heavytop.plots.theory import steady_errors

IMAGES = Path(__file__).parent / "images"
BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")

# The kicks of docs/kicks.md, one or two on each rung [rad/s]
KICKS = {
    "psidot": (
        -15, 0, 3, 5.925768003799, 8, 9.260624653432,
        12, 15.695837998076, 20, 29.518481179484, 40,
    ),
    "omega3": (
        -15, 0, 3, 6.366839093883, 8, 9.870129870130,
        12, 14.120638040568, 17, 21.945335558617, 30,
    ),
}  # fmt: skip
WORDS = {"psidot": "ψ̇ = 140 rad/s held", "omega3": "ω₃ = 140 rad/s held"}
NAMES = (
    "loops", "cusps", "waves", "steady, slow", "waves", "cusps",
    "loops", "over the top", "waves", "steady, fast", "waves",
)  # fmt: skip

CALLED = {  # kicks are rounded, so that a rung's own motion is only near that of its kind
    "steady, slow": "uniform-precession", "steady, fast": "uniform-precession",
    "over the top": "through-top",
}  # fmt: skip

# The panels of docs/what-a-top-can-do.md: scene, kind, tag, seconds drawn, and how it is seen
ABOVE, BELOW = 1.0, -1.0
FRONT, SIDE, BACK, LOW = (0, -1, 0), (0.8, -0.6, 0), (0.8, 0.6, 0), (0.8, -0.6, -0.9)
KINDS = {
    "off the vertical": (
        ("sicm-forward", "waves", "", 2.0, (ABOVE, 0.105)),
        ("sicm-kicked", "loops", "", 2.15, (ABOVE, 0.54)),
        ("sicm-dropped", "cusps", "", 2.0, (ABOVE, 0.2)),
        ("steady-betsch", "precession", "slow", 0.25, SIDE),
        ("steady-fast", "precession", "fast", 0.25, SIDE),
        ("steady-single", "precession", "single", 4.6, SIDE),
    ),
    "on the vertical": (
        ("at-rest", "at rest", "", 0.64, SIDE),
        ("sleeping", "sleeping", "stable", 2.0, (ABOVE, 0.9)),
        ("sleeping-marginal", "sleeping", "marginal", 2.0, (ABOVE, 0.9)),
        ("sleeping-unstable", "sleeping", "unstable", 2.0, (ABOVE, 0.9)),
        ("hanging", "hanging", "", 2.0, (BELOW, 0.075)),
    ),
    "to the vertical and through it": (
        ("separatrix", "separatrix", "", 20.0, (ABOVE, 1.0)),
        ("near-separatrix", "waves", "near the separatrix", 80.0, (ABOVE, 1.0)),
        ("through-top", "through the top", "", 1.38, (ABOVE, 0.9)),
        ("through-bottom", "through the bottom", "", 1.87, (BELOW, 1.0)),
        ("planar-rotating", "planar pendulum", "rotating", 1.1, BACK),
        ("planar-asymptotic", "planar pendulum", "asymptotic", 3.0, BACK),
    ),
    "pendulums, and other tops": (
        ("planar-pendulum", "planar pendulum", "swinging", 1.1, LOW),
        ("spherical-pendulum", "waves", "spherical pendulum", 6.0, (BELOW, 0.95)),
        ("force-free", "force-free", "", 0.145, (ABOVE, 0.75)),
        ("spherical-top", "loops", "spherical top", 1.17, (ABOVE, 0.7)),
        ("spin-reversal", "waves", "spin reversal", 1.4, FRONT),
        ("inverted-gravity", "loops", "inverted gravity", 2.15, (BELOW, 0.54)),
    ),
}  # fmt: skip
READING = (
    "dot: start; cross: vertical",
    "pale: behind the sphere",
    "grey: circles of equal tilt",
    "ground: colour of the kind,",
    "as on every map",
    "",
    "In this row the top stays",
    "at the dot; the line is what",
    f"it does after {PUSH:g} rad/s.",
)


def ladder():
    """Return the picture of the ladder: a row for each thing held, a column for each rung."""
    figure = Figure(figsize=(13.2, 3.6), layout="constrained")
    rows = figure.subplots(len(KICKS), len(NAMES))
    for row, (held, kicks) in zip(rows, KICKS.items(), strict=True):
        for ax, kick, name in zip(row, kicks, NAMES, strict=True):
            start = ht.State(theta="0.1", phidot=kick, **{held: 140})
            path = axis_path(ht.Motion(BOOK, start), 1.5)
            reach = 1.1 * float(np.hypot(path[:, 0], path[:, 1]).max())
            kind_panel(ax, path, View.from_pole(1.0, reach), CALLED.get(name, name))
            ax.set_title(f"{name}\nφ̇ = {kick:.4g} rad/s", fontsize="small")
        row[0].text(-0.25, 0.5, WORDS[held], transform=row[0].transAxes, rotation=90, va="center")
    return figure


def sweep():
    """Return the errors of the formulas for steady precession against integration."""
    spins = np.array([118.0, 120, 130, 140, 160, 200, 300, 500, 1000, 2000])

    def measured(which):
        starts = (ht.State.steady(BOOK, "0.1", spin, which) for spin in spins)
        scenes = (ht.Scene(BOOK, start, time=1, events=(), samples=2) for start in starts)
        return np.array([ht.propagate(scene).phi[-1] for scene in scenes])

    slow, fast = measured("slow"), measured("fast")
    A, C, gMR = (float(x) for x in (BOOK.A, BOOK.C, BOOK.gMR))
    p_psi, u = C * spins, np.cos(0.1)
    exact = steady.rates(BOOK, p_psi, u)
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    errors = {
        "slow: gMR/p_ψ": gMR / p_psi / slow - 1,
        "fast: p_ψ/(A cosθ)": p_psi / (A * u) / fast - 1,
        "slow, exact formula": exact[0] / slow - 1,
        "fast, exact formula": exact[1] / fast - 1,
    }
    ax = figure.subplots()
    steady_errors(ax, spins, errors)
    ax.set_title("steady precession at θ = 0.1, off the integrated one", fontsize="medium")
    return figure


def kinds():
    """Return the picture of every kind of motion: the path of the axis of each shipped scene."""
    figure = Figure(figsize=(12.0, 10.4))
    rows = figure.subplots(4, 6)
    figure.subplots_adjust(left=0.035, right=0.995, top=0.955, bottom=0.05, hspace=0.42, wspace=0.1)
    for row, (name, panels) in zip(rows, KINDS.items(), strict=True):
        row[0].text(-0.13, 0.5, name, transform=row[0].transAxes, rotation=90, ha="center",
                    va="center", fontsize=9.5)  # fmt: skip
        for ax, panel in zip(row, panels, strict=False):
            kind(ax, *panel)
        for ax in row[len(panels) :]:
            ax.axis("off")
            ax.text(0.05, 0.5, "\n".join(READING), va="center", fontsize=8.5, linespacing=1.5)
    return figure


def kind(ax, name, title, tag, seconds, seen):
    """Draw one panel, with the scene and the view below it."""
    scene = ht.load_scene(name)
    still = ht.Motion(scene.top, scene.start)
    motion = touched(still) or still
    view = View.from_pole(*seen) if len(seen) == 2 else View.from_horizon(np.array(seen))
    kind_panel(ax, axis_path(motion, seconds), view, still.kind, pushed=motion is not still)
    at = {"transform": ax.transAxes, "ha": "center"}
    ax.text(0.5, 1.13, title, fontsize=11, fontweight="bold", **at)
    ax.text(0.5, 1.03, tag, fontsize=9, **at)
    ax.text(0.5, -0.09, name, fontsize=8, **at)
    ax.text(0.5, -0.175, view.words, fontsize=7.5, color="#6B7280", **at)


if __name__ == "__main__":
    where = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    save(sweep(), where / "steady.svg")
    with mpl.rc_context({"path.simplify_threshold": 0.5}):  # a smaller file, alike to the eye
        save(ladder(), where / "kicks.svg")
        save(kinds(), where / "kinds.svg")
    kicked = ht.load_scene("sicm-kicked")
    ht.film(kicked, where / "sicm-kicked.gif", seconds=8, fps=15, size=(480, 360))
