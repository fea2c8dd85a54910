"""Draw docs/images/kicks.svg and docs/images/steady.svg: .venv/bin/python docs/draw.py [DIR]."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.report.figures import save
from heavytop.report.kicks_figure import axis_trace
from heavytop.report.steady_figure import steady_errors
from heavytop.theory import steady

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
WORDS = {"psidot": "ψ̇ = 140 held", "omega3": "ω₃ = 140 held"}
NAMES = (
    "loops", "cusps", "waves", "steady, slow", "waves", "cusps",
    "loops", "over the top", "waves", "steady, fast", "waves",
)  # fmt: skip


def ladder():
    """Return the picture of the ladder: a row for each thing held, a column for each rung."""
    figure = Figure(figsize=(13.2, 3.6), layout="constrained")
    rows = figure.subplots(len(KICKS), len(NAMES))
    for row, (held, kicks) in zip(rows, KICKS.items(), strict=True):
        for ax, kick, name in zip(row, kicks, NAMES, strict=True):
            start = ht.State(theta="0.1", phidot=kick, **{held: 140})
            axis_trace(ax, ht.Motion(BOOK, start), 1.5)
            ax.set_title(f"{name}\n{kick:+.4g}" if kick else f"{name}\n0", fontsize="small")
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
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    errors = {
        "slow: gMR/p_ψ": steady.slow_limit(BOOK, spins) / slow - 1,
        "fast: p_ψ/(A cosθ)": steady.fast_limit(BOOK, "0.1", spins) / fast - 1,
        "slow, exact formula": steady.slow(BOOK, "0.1", spins) / slow - 1,
        "fast, exact formula": steady.fast(BOOK, "0.1", spins) / fast - 1,
    }
    ax = figure.subplots()
    steady_errors(ax, spins, errors)
    ax.set_title("steady precession at θ = 0.1, off the integrated one", fontsize="medium")
    return figure


if __name__ == "__main__":
    where = Path(sys.argv[1]) if len(sys.argv) > 1 else IMAGES
    save(ladder(), where / "kicks.svg")
    save(sweep(), where / "steady.svg")
