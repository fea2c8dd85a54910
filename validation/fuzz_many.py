"""Random tops by `propagate_many`, against the closed form: axis, θ, and numbers of events.

A miss is an axis or a θ farther off than `Ensemble.error` says, or than is asked without a mark,
or a wrong number of events without a mark.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import heavytop as ht
from heavytop.errors import HeavyTopError
from heavytop.run.events import tally

sys.path.insert(0, str(Path(__file__).parent))
import fuzz

EVENTS = ("turning", "reversal")
NAMES = ("A", "C", "gMR", "theta", "thetadot", "phi", "phidot", "psi", "psidot", "time")
GROUP = 400
DIGITS = 12


def misses(seed: int, count: int, formulation: str = "axis", stretch: float = 1.0) -> list[str]:
    """One line for each top that is wrong beyond what the run says of it."""
    found: list[str] = []
    scenes = list(fuzz.scenes(seed, count))
    for at in range(0, count, GROUP):
        found += _group(scenes[at : at + GROUP], formulation, stretch)
    return found


def _group(scenes: list[ht.Scene], formulation: str, stretch: float) -> list[str]:
    tops = [_doubles(scene, stretch) for scene in scenes]
    columns = {name: np.array([top[name] for top in tops]) for name in NAMES}
    run = ht.propagate_many(**columns, formulation=formulation, events=EVENTS, digits=DIGITS)
    lines = []
    for i, (scene, top) in enumerate(zip(scenes, tops, strict=True)):
        if said := _wrong(run, i, top):
            lines.append(f"{scene.name} by {formulation}: {said}")
    return lines


def _doubles(scene: ht.Scene, stretch: float) -> dict[str, float]:
    parts = [
        *(getattr(scene.top, n) for n in NAMES[:3]),
        *(getattr(scene.start, n) for n in NAMES[3:9]),
    ]
    return dict(zip(NAMES, map(float, (*parts, scene.time)), strict=True)) | {
        "time": float(scene.time) * stretch
    }


def _wrong(run: ht.Ensemble, i: int, top: dict[str, float]) -> str:
    """What is wrong of one top, in words; or nothing."""
    given = {name: top[name] for name in NAMES[3:9]}
    motion = ht.Motion(ht.Top(*(top[name] for name in NAMES[:3])), ht.State(**given))
    try:
        exact = motion.at(top["time"], 40)
        counted = tally(motion, top["time"], EVENTS)
    except HeavyTopError:  # no closed form to hold it against
        return ""
    off = abs(run.final.theta[i] - float(exact.theta))
    across = np.linalg.norm(run.final.axis[i] - [float(x) for x in exact.axis])
    off = max(off, across) if np.isfinite(across) else off
    allowed = 10.0**-DIGITS * max(1.0, float(exact.theta))
    if off > run.error[i]:
        return f"off by {off:.1e}, and {run.error[i]:.1e} is said"
    if not run.missed[i] and not off <= allowed:
        return f"off by {off:.1e}, and not marked"
    for event in EVENTS:
        number = run.count(event)[i]
        least, most = (0, 0) if counted is None else counted[event]
        if motion.kind == "separatrix" and event == "turning":  # which has one, or none
            most = 1
        if not run.missed[i] and not least <= number <= most:
            return f"{number} {event} points, not {least}, and not marked"
    return ""


if __name__ == "__main__":
    lines = misses(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:4])
    print(*lines, f"{len(lines)} misses of {sys.argv[2]}", sep="\n")
    sys.exit(bool(lines))
