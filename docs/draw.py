"""Draw kicks.svg, kinds.svg, layers.svg, sicm-kicked.gif and the notebooks' covers.

    .venv/bin/python docs/draw.py [DIR]

DIR is docs/images unless given.
"""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.transforms import Affine2D

import heavytop as ht
from heavytop.plots.sphere import PUSH, View, axis_path, kind_panel, push
from heavytop.plots.style import BLUE, FAINT, GREEN, ORANGE, PURPLE, SKY, YELLOW, save
from heavytop.plots.style import KIND_STYLES as LOOKS

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
    motion = push(still) or still
    view = View.from_pole(*seen) if len(seen) == 2 else View.from_horizon(np.array(seen))
    kind_panel(ax, axis_path(motion, seconds), view, still.kind, pushed=motion is not still)
    at = {"transform": ax.transAxes, "ha": "center"}
    ax.text(0.5, 1.13, title, fontsize=11, fontweight="bold", **at)
    ax.text(0.5, 1.03, tag, fontsize=9, **at)
    ax.text(0.5, -0.09, name, fontsize=8, **at)
    ax.text(0.5, -0.175, view.words, fontsize=7.5, color="#6B7280", **at)


# --- the layers of the package, for docs/architecture.md -----------------------------------------

LAYERS = (  # from the top: a folder imports only from those in the rows below it
    (("cli", "the command line", FAINT),),
    (("report", "tables, pages, notebooks", FAINT),),
    (("plots", "figures and films", FAINT), ("claims", "what is validated", FAINT)),
    (("studies", "many runs: drift, work–precision, stress, atlas", YELLOW),),
    (("certificate", "proved error bounds of a run", YELLOW),
     ("checking", "trajectories of others", YELLOW)),
    (("results", "what commands return, and its JSON", YELLOW),),
    (("run", "plan, trajectory, events, errors", YELLOW),),
    (("analytic", "closed form", GREEN), ("integration", "Taylor series, heyoka", SKY),
     ("comparison", "other integrators", SKY)),
    (("classification", "kinds of motion, proved", GREEN),
     ("equations", "Lagrangian to formulations, sympy", SKY)),
    (("scene", "top, start, scene file", FAINT),),
    (("exact", "exact numbers and intervals", FAINT),),
)  # fmt: skip


def layers():
    """Return the picture of the folders: rows in the order in which they may import."""
    figure = Figure(figsize=(8.4, 6.6))
    ax = figure.subplots()
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.99)
    for level, row in enumerate(LAYERS):
        width = 10.0 / len(row)
        for place, (folder, what, colour) in enumerate(row):
            box = (place * width + 0.06, -level + 0.09), width - 0.12, 0.82
            ax.add_patch(Rectangle(*box, fc=colour, ec=colour, alpha=0.3))
            middle = (place + 0.5) * width
            ax.text(middle, 0.65 - level, f"{folder}/", ha="center", va="center", weight="bold")
            ax.text(middle, 0.3 - level, what, ha="center", va="center", fontsize="small")
    arrow = {"arrowstyle": "->", "color": "#444444"}
    ax.annotate("", (10.35, 1.5 - len(LAYERS)), (10.35, 0.5), arrowprops=arrow)
    ax.text(10.6, 0.5 - len(LAYERS) / 2 + 0.5, "imports", rotation=270, ha="center", va="center")
    ax.set(xlim=(0, 10.9), ylim=(1 - len(LAYERS), 1))
    ax.axis("off")
    return figure


# --- the covers of the notebooks, on the first page ----------------------------------------------

COVER = (2.4, 1.6)
TOY = (  # of examples/7-a-toy-top.ipynb: from, to along the stem, radius [m], colour
    (0.0, 0.060, 0.002, "#8A8F98"),
    (0.021, 0.029, 0.030, "#B9BEC7"),
)


def cover(draw, panels=1):
    """Return a small picture without ticks."""
    figure = Figure(figsize=COVER)
    figure.subplots_adjust(0.02, 0.03, 0.98, 0.97, wspace=0.05)
    axes = figure.subplots(1, panels)
    for ax in np.ravel(axes):
        ax.set(xticks=[], yticks=[])
    draw(axes)
    return figure


def three_kicks(axes):
    """Loops, cusps and waves."""
    for ax, kick in zip(axes, (-3, 0, 3), strict=True):
        motion = ht.Motion(BOOK, ht.State("0.1", phidot=kick, omega3=140))
        path = axis_path(motion, 1.2)
        reach = 1.1 * float(np.hypot(path[:, 0], path[:, 1]).max())
        kind_panel(ax, path, View.from_pole(1.0, reach), motion.kind)


def depths(ax):
    """How deep a top dives that was upright, over its spin."""
    A, C, gMR = (float(x) for x in (BOOK.A, BOOK.C, BOOK.gMR))
    spin = np.linspace(0.0, 150.0, 401)
    depth = 2 * np.arccos(np.minimum(spin * C / (2 * np.sqrt(A * gMR)), 1.0))
    for sign in (1, -1):
        ax.plot(spin, sign * depth, color=BLUE, lw=1.8)
    ax.plot(spin, 0 * spin, ":", color=FAINT, lw=1.2, zorder=0)


def energies(ax):
    """Energy errors of four methods over 300 nutations."""
    methods = ["taylor-axis=1e-9", "strang", "implicit-midpoint", "taylor-axis"]
    found = ht.drift(ht.load_scene("sicm-kicked"), methods=methods, periods=300, samples=25)
    for each, colour in zip(found.methods, (ORANGE, GREEN, PURPLE, BLUE), strict=True):
        ax.loglog(each.periods, np.abs(each.energy), color=colour, lw=1.5)
    ax.set(xticks=[], yticks=[])
    ax.minorticks_off()


def late(ax):
    """The tilt, and the same a tenth of a nutation late."""
    scene = ht.load_scene("sicm-kicked")
    motion = ht.Motion(scene.top, scene.start)
    t = np.linspace(0.0, 2.6 * motion.period, 401)
    ax.plot(t, -motion.at(t).theta, color=BLUE, lw=1.8)
    ax.plot(t, -motion.at(t - motion.period / 10).theta, "--", color=ORANGE, lw=1.4)


def small_map(ax):
    """The kinds of a plane of starts."""
    theta, phidot = np.meshgrid(np.linspace(0.02, 3.12, 240), np.linspace(-40.0, 40.0, 160))
    A, C, gMR = (float(x) for x in (BOOK.A, BOOK.C, BOOK.gMR))
    found = ht.classify_many(A=A, C=C, gMR=gMR, theta=theta, phidot=phidot, omega3=100.0)
    colours = ListedColormap([LOOKS[str(name)].colour for name in found.names])
    edges = (-0.5, len(found.names) - 0.5)
    ax.imshow(found.kind, cmap=colours, vmin=edges[0], vmax=edges[1], origin="lower", aspect="auto",
              interpolation="nearest")  # fmt: skip


def toy(ax):
    """A disc on a stem, leaning."""
    lean = Affine2D().rotate_deg(-15.0) + ax.transData
    for low, high, radius, colour in TOY:
        size = (2 * radius, high - low)
        ax.add_patch(Rectangle((-radius, low), *size, fc=colour, ec="#444444", transform=lean))
    ax.plot([0, 0], [0, 0.07], ":", color=FAINT, lw=1.2, zorder=0)
    ax.axhline(0.0, color="#444444", lw=1.0)
    ax.set(xlim=(-0.055, 0.055), ylim=(-0.004, 0.0693), aspect="equal")


COVERS = {
    "2": (three_kicks, 3), "3": (depths,), "4": (energies,), "5": (late,), "6": (small_map,),
    "7": (toy,),
}  # fmt: skip


if __name__ == "__main__":
    where = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    save(layers(), where / "layers.svg")
    with mpl.rc_context({"path.simplify_threshold": 0.5}):  # a smaller file, alike to the eye
        save(ladder(), where / "kicks.svg")
        save(kinds(), where / "kinds.svg")
        for number, drawing in COVERS.items():
            save(cover(*drawing), where / f"notebook-{number}.svg")
    kicked = ht.load_scene("sicm-kicked")
    ht.film(kicked, where / "sicm-kicked.gif", seconds=8, fps=15, size=(480, 360))
