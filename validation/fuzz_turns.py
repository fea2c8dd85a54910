"""Random scenes whose phi and psi turn fast, close to the poles and through them.

Each is run by auto, and by the attitude and the axis form by name, and held against the closed
form of the run's own binary start at 40 digits. A run is wrong where something in it is nan, where
phi or psi is off by more than the error of the axis explains at its tilt, where `run_errors` says
less than it is off, and by auto where digits are missed without a warning.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator
from dataclasses import replace

import fuzz
import numpy as np
from digits import Digits

import heavytop as ht
from heavytop.run.own_motion import own_motion

FAMILIES = ("pole-start", "close-pass", "planar", "sleeper", "any")
FORMULATIONS = ("auto", "attitude", "axis")
DIGITS = 40
PATIENCE_S = 2.0  # of a run, as it is estimated
TURNED = 0.1  # rad; a lost turn is 6.28
EXPLAINED = 50.0  # how many times as far as the axis at its tilt an angle may be off
WITNESSED = 1e-13  # relative: what the witness in doubles may itself be off
ANGLES = ("theta", "phi", "psi")


def misses(seed: int, count: int) -> list[str]:
    """Return a line for each run of the scenes that is wrong beyond what it says of itself."""
    return [
        f"{scene.name} {formulation}: {wrong}"
        for scene in fuzz.scenes(seed, count, FAMILIES)
        for formulation in FORMULATIONS
        for wrong in _wrongs(replace(scene, quantities=ANGLES, samples=12), formulation)
    ]


def _wrongs(scene: ht.Scene, formulation: str) -> Iterator[str]:
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            if ht.plan(scene, formulation).estimate.seconds > PATIENCE_S:
                return
            run = ht.propagate(scene, formulation=formulation, step_limit=200_000)
        except (ht.BadScene, ht.EndedEarly):
            return  # and says so
    told = [str(each.message) for each in said if issubclass(each.category, ht.DoubtfulWarning)]
    try:
        truth = _truth(run)
    except ht.NoClosedForm:
        return
    yield from _not_numbers(run)
    exact = {x: np.array([float(getattr(e, x)) for e in truth]) for x in ANGLES}
    axis = np.array([[float(x) for x in e.axis] for e in truth])
    off = {x: np.abs(getattr(run.samples, x) - exact[x]) for x in ANGLES}
    strayed = np.linalg.norm(run.axis - axis, axis=1)
    sine = np.sin(exact["theta"])
    known = EXPLAINED * (strayed.max() + 1e-15 * sine.max()) / np.maximum(sine, 1e-300)
    for name in ("phi", "psi"):
        if (lost := off[name][(known < 1) & (off[name] > known + TURNED)]).size:
            turns, astray = lost.max() / (2 * np.pi), strayed.max()
            yield f"{name} off by {turns:.3g} turns, the axis by {astray:.1e}"
    claimed = ht.run_errors(run)
    for name in ANGLES:
        size = max(1.0, np.abs(exact[name]).max())
        says, most = getattr(claimed, name), np.nanmax(off[name])
        if says is not None and not most <= 1.5 * says + WITNESSED * size:
            yield f"{name} off by {most:.1e}, run_errors says {says:.1e}"
        if formulation == "auto" and not told and most > 2 * 10.0**-scene.digits * size:
            yield f"{name} off by {most:.1e}, without a warning"


def _not_numbers(run: ht.Trajectory) -> Iterator[str]:
    s = run.samples
    parts = {x: getattr(s, x) for x in (*ANGLES, "thetadot", "phidot", "psidot", "quaternion")}
    for name, part in (parts | {"phi of an event": run.events.phi}).items():
        if not np.isfinite(part).all():
            yield f"{name} is nan {np.count_nonzero(~np.isfinite(part))} times"


def _truth(run: ht.Trajectory) -> list:
    times = [float(t) for t in run.t]
    if run.decimals is not None:
        times = [sample.t for sample in run.decimals.samples]
    form = Digits(own_motion(run), DIGITS)
    return [form(form.ctx.mpf(t)) for t in times]


if __name__ == "__main__":
    seed, count = map(int, sys.argv[1:] or (1, 100))
    found = misses(seed, count)
    print(*found, f"{len(found)} misses", sep="\n")
