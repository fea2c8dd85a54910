"""Going on with a trajectory: to a later end, or to the one it had not reached."""

from __future__ import annotations

import os
import time
from dataclasses import replace

import numpy as np

from heavytop.errors import Outcome
from heavytop.integration.bits import bits_of, named
from heavytop.integration.orbit import continued
from heavytop.numbers import Number
from heavytop.run.estimates import Forecast
from heavytop.run.finishing import Keeper, Progress, finished, in_decimals
from heavytop.run.planning import Plan, leaving, planned, settled, span
from heavytop.run.trajectory import Trajectory
from heavytop.run.verify import checked, forewarned
from heavytop.scene import arguments
from heavytop.scene.arguments import expect, heard, number_of
from heavytop.scene.scene import Scene
from heavytop.scene.scene_file import MAX_SAMPLES

_SAMPLES = arguments.Range(1, MAX_SAMPLES, whole=True)


def extend(
    trajectory: Trajectory,
    time_span: Number,
    *,
    samples: int | None = None,
    progress: Progress | None = None,
) -> Trajectory:
    """Continue a trajectory to a later end, as if it had been asked for in one piece.

    It goes on by the plan it has. Of a long span in one piece, auto may make another plan.

    Parameters
    ----------
    trajectory : Trajectory
        What goes on.
    time_span : number
        The new end, measured from the start [s], beyond the old one on the same side.
    samples : int, optional
        Samples between the old end and the new one; by default they go on at the old distance.
    progress : callable, optional
        Called with the fraction done, after each block of steps.

    Returns
    -------
    Trajectory
        From the old start to the new end, with the samples and events of both parts.

    Raises
    ------
    ValueError
        The new end is not beyond the old one; samples are no whole number, or too many.
    BadScene
        The new end is so far off that turns are not counted, or more bits would be needed than
        there are.
    EndedEarly
        As for `propagate`.
    WrongType, NotANumber
        It is no Trajectory; `time_span` is no number.

    Warns
    -----
    MissedDigitsWarning, DoubtfulWarning, UnboundedAngleWarning
        As `propagate` does: the whole run is checked.

    Notes
    -----
    Accuracy: ``tests/property/test_determinism.py`` holds a run that was continued to one in a
    piece, bit for bit.

    Examples
    --------
    >>> import heavytop as ht
    >>> scene = ht.load_scene("sicm-kicked")
    >>> longer = extend(ht.propagate(scene), 4)
    >>> float(longer.t[-1]), longer.events.count("turning")
    (4.0, 15)
    """
    expect("trajectory", trajectory, Trajectory, "propagate gives one")
    heard("progress", progress)
    span_wanted = number_of("time_span", time_span)
    old, end = trajectory.orbit, float(span_wanted)
    if not abs(end) > abs(old.end) or end * old.end < 0:
        raise ValueError(f"time_span: beyond {old.end}, where the trajectory ends")
    count = _as_before(trajectory, end) if samples is None else _whole(samples)
    times = np.linspace(old.end, end, count + 1)[1:]
    scene = replace(
        trajectory.scene, time=span_wanted, periods=None, samples=trajectory.t.size + count
    )
    chosen = _longer(trajectory, scene)
    forewarned(chosen)
    began = time.perf_counter()
    orbit = continued(old, times, on_block=progress)
    spent = trajectory.statistics.integrate_s + time.perf_counter() - began
    derive_s = trajectory.statistics.derive_s
    longer = finished(scene, trajectory.motion, chosen, orbit, derive_s, spent)
    if trajectory.decimals is not None:
        longer = in_decimals(longer, progress, trajectory.decimals)
    return checked(_timed(longer, trajectory))


def _longer(trajectory: Trajectory, scene: Scene) -> Plan:
    """Return a plan for a longer span: its warnings are new, and what has more bits may take more.

    Raises
    ------
    BadScene
        As for `plan`.
    """
    motion, chosen = trajectory.motion, trajectory.plan
    again = planned(scene, motion, chosen.formulation)
    if chosen.precision == "double":
        return replace(chosen, warnings=again.warnings)
    end = span(scene, motion)
    needed = settled(Forecast(scene, motion, end), chosen)
    bits = max(bits_of(needed.precision), bits_of(chosen.precision))
    told = tuple(leaving(motion, end, bits))
    return replace(chosen, precision=named(bits), tolerance=2.0 ** (1 - bits), warnings=told)


def _as_before(trajectory: Trajectory, end: float) -> int:
    """Return how many samples there are to an end at the distance that they have."""
    reached = abs(trajectory.orbit.end)
    spacing = reached / max(trajectory.t.size - 1, 1)
    count = (abs(end) - reached) / spacing
    if not count <= MAX_SAMPLES - trajectory.t.size:
        rule = f"{count:.3g} more samples at the distance that they have, of {MAX_SAMPLES} at most"
        raise ValueError(f"time_span: {rule}; samples= says how many there are to be")
    return max(1, round(count))


def _whole(samples: object) -> int:
    try:
        return int(_SAMPLES(samples))
    except arguments.Refused as wrong:
        raise ValueError(f"samples: {wrong}") from None


def completed(
    trajectory: Trajectory,
    *,
    progress: Progress | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Trajectory:
    """Go on with an interrupted trajectory to the end of its scene, as if nothing had happened.

    Parameters
    ----------
    trajectory : Trajectory
        One that ended early by an interrupt or the step limit; of another, it is returned.
    progress : callable, optional
    checkpoint : path, optional
        As for `propagate`.

    Raises
    ------
    EndedEarly, OSError
        As for `propagate`.

    Warns
    -----
    MissedDigitsWarning, DoubtfulWarning, UnboundedAngleWarning
        As `propagate` does.
    """
    if trajectory.outcome not in (Outcome.INTERRUPTED, Outcome.STEP_LIMIT):
        return trajectory
    scene, old = trajectory.scene, trajectory.orbit
    forewarned(trajectory.plan)
    end = span(scene, trajectory.motion)
    times = np.linspace(0.0, end, scene.samples)[old.samples.t.size :]
    keeper = Keeper.of(checkpoint, scene, trajectory.motion, trajectory.plan)
    began = time.perf_counter()
    orbit = continued(old, times, on_block=progress, keep=keeper) if times.size else old
    spent = trajectory.statistics.integrate_s + time.perf_counter() - began
    derive_s = trajectory.statistics.derive_s
    orbit = orbit if times.size else replace(orbit, ending="reached")
    if keeper is not None:
        keeper.at_last(orbit)
    found = finished(scene, trajectory.motion, trajectory.plan, orbit, derive_s, spent)
    if found.plan.precision != "double":
        found = in_decimals(found, progress)
    return checked(_timed(found, trajectory))


def _timed(longer: Trajectory, part: Trajectory) -> Trajectory:
    """Return a continued run, whose times are those of the whole if those of its part are known."""
    return replace(longer, statistics=replace(longer.statistics, whole=part.statistics.whole))
