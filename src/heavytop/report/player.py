"""The data of the player: the frames of a run, for a top that moves on a page."""

from __future__ import annotations

from base64 import b64encode
from typing import Any, Final

import numpy as np

from heavytop.plots.drawn_run import PERIODS, Clip, DrawnRun
from heavytop.plots.sphere import PUSH, momentum_path
from heavytop.plots.style import EVENT_STYLES, PATH
from heavytop.scene.quantities import QUANTITIES

FRAMES: Final = 1001
LONGEST_S: Final = 40.0  # of playing, unless it is asked otherwise
MOST_MARKS: Final = 200  # marks of events


def tops(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The data of a player: runs, the styles of events and paths, and units."""
    marks = {kind: mark._asdict() for kind, mark in EVENT_STYLES.items()}
    units = {name: QUANTITIES[name].shown for name in ("t", "theta")}
    return {"runs": runs, "marks": marks, "path": PATH, "units": units}


def frames(
    thing: Any, rounds: float | None = None, time: float | None = None, speed: float | None = None
) -> dict[str, Any]:
    """The frames of a run, or of a motion, at even steps from its start to ``end`` [s].

    ``quaternion``, body to space and scalar first, and ``momentum``, the angular momentum over its
    largest size, are float32 in base64; ``spin`` is the change of ψ [rad], ``precession`` the mean
    rate of φ times the time [rad], ``theta`` the least and the greatest tilt, ``shape`` C/A and the
    side of the pivot where the centre of mass is (1, −1 or 0), ``seconds`` the time of playing, if
    `speed` is given, and ``notes`` say where the motion differs from the run.
    """
    run = DrawnRun.of(thing, PERIODS)
    top, end = run.motion.top, run.end
    clip = Clip.of(run.motion, end, LONGEST_S, rounds=rounds, time=time, speed=speed)
    motion, last = clip.motion, clip.end
    times, notes = np.linspace(0.0, last, FRAMES), []
    record: Any = motion.at(times) if clip.pushed or abs(last) > abs(end) else run.at(times)
    if clip.pushed:
        notes.append(f"Without a push it stays as it is; here it was pushed at {PUSH:g} rad/s.")
    elif not (np.isfinite(record.quaternion).all() and np.isfinite(record.omega).all()):
        record = motion.at(times)
        notes.append("The attitude is from the closed form: the run does not follow all angles.")
    if abs(last) < 0.999 * abs(end):
        part = QUANTITIES["t"].with_unit(abs(last), abs(end), between=" of ", form=".3g")
        notes.append(f"The first {part} are shown.")
    spin = float(record.psi[-1] - record.psi[0])
    notes += [f"{words.capitalize()}." for words in clip.blur(FRAMES, FRAMES)]
    found = run.events
    events = [
        {"kind": str(kind), "t": float(t), "axis": axis.round(5).tolist()}
        for kind, t, axis in zip(found.kind, found.t, found.axis, strict=True)
        if not clip.pushed and abs(t) <= abs(last) and np.isfinite(axis).all()
    ]
    return {
        "title": run.title, "end": last, "spin": spin, "notes": notes,
        "seconds": clip.seconds if speed else None,
        "precession": motion.mean_angle_rates[0] * last,
        "theta": [float(motion.theta_min), float(motion.theta_max)], "events": events[:MOST_MARKS],
        "shape": [float(top.C / top.A), float(np.sign(float(top.gMR)))],
        "quaternion": _pack(record.quaternion),
        "momentum": _pack(momentum_path(top, record)),
    }  # fmt: skip


def _pack(rows: Any) -> str:
    """Numbers as float32 in base64."""
    return b64encode(np.asarray(rows, "<f4").tobytes()).decode("ascii")
