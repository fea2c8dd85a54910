"""A run as data of a page: the top that turns."""

from __future__ import annotations

from base64 import b64encode
from typing import Any, Final

import numpy as np

from heavytop.plots.drawn_run import PERIODS, Clip, DrawnRun
from heavytop.plots.sphere import PUSH, momentum_path
from heavytop.plots.style import EVENT_STYLES, PATH
from heavytop.scene.quantities import QUANTITIES

FRAMES: Final = 1001
LONGEST_S: Final = 40.0  # that are played, as much spin as can be followed in these
MOST_MARKS: Final = 200


def tops(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """What a player takes: runs, how events and paths are drawn in every figure, and units."""
    marks = {kind: mark._asdict() for kind, mark in EVENT_STYLES.items()}
    units = {name: QUANTITIES[name].shown for name in ("t", "theta")}
    return {"runs": runs, "marks": marks, "path": PATH, "units": units}


def frames(
    thing: Any, rounds: float | None = None, time: float | None = None, speed: float | None = None
) -> dict[str, Any]:
    """The frames of a run, or of a motion, at even steps from its start to ``end`` [s].

    ``quaternion``, body to space and scalar first, and ``momentum``, the angular momentum over its
    largest size, are float32 in base64; ``spin`` is by how much ψ changes [rad], ``precession`` by
    how much φ does on average, ``theta`` the tilts between which the axis stays, ``shape`` C/A and
    on which side of the pivot the centre of mass is (1, −1 or 0), ``seconds`` how long it is
    played, if that was asked, and ``notes`` says what is played where it is not the run.
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
    return b64encode(np.asarray(rows, "<f4").tobytes()).decode("ascii")
