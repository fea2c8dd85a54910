"""Going on with a trajectory: to a later end, or to the one it had not reached."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from heavytop.errors import Outcome
from heavytop.exact import Exact, Number
from heavytop.finishing import Progress, finished, in_decimals
from heavytop.planning import closed_form_of, plan, span
from heavytop.taylor.orbit import continued
from heavytop.trajectory import Trajectory


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
        The new end is not beyond the old one.
    """
    old, end = trajectory.orbit, float(Exact.of(time_span))
    if not abs(end) > abs(old.end) or end * old.end < 0:
        raise ValueError(f"time_span: beyond {old.end}, where the trajectory ends")
    spacing = abs(old.end) / max(trajectory.t.size - 1, 1)
    count = max(1, round((abs(end) - abs(old.end)) / spacing)) if samples is None else samples
    times = np.linspace(old.end, end, count + 1)[1:]
    began = time.perf_counter()
    orbit = continued(old, times, on_block=progress)
    span_wanted = Exact.of(time_span)
    scene = replace(
        trajectory.scene, time=span_wanted, periods=None, samples=trajectory.t.size + count
    )
    spent = trajectory.statistics.integrate_s + time.perf_counter() - began
    longer = finished(scene, trajectory.plan, orbit, trajectory.statistics.derive_s, spent)
    if trajectory.decimals is None:
        return longer
    again = plan(scene, trajectory.plan.formulation)  # a longer run may take more bits
    chosen = replace(trajectory.plan, precision=again.precision, tolerance=again.tolerance)
    return in_decimals(replace(longer, plan=chosen), progress, trajectory.decimals)


def completed(trajectory: Trajectory, *, progress: Progress | None = None) -> Trajectory:
    """Go on with an interrupted trajectory to the end of its scene, as if nothing had happened.

    Parameters
    ----------
    trajectory : Trajectory
        One that ended early by an interrupt or the step limit; of another, it is returned.
    progress : callable, optional

    Raises
    ------
    EndedEarly
        As for `propagate`.
    """
    if trajectory.outcome not in (Outcome.INTERRUPTED, Outcome.STEP_LIMIT):
        return trajectory
    scene, old = trajectory.scene, trajectory.orbit
    end = span(scene, closed_form_of(scene))
    times = np.linspace(0.0, end, scene.samples)[old.samples.t.size :]
    began = time.perf_counter()
    orbit = continued(old, times, on_block=progress) if times.size else old
    spent = trajectory.statistics.integrate_s + time.perf_counter() - began
    derive_s = trajectory.statistics.derive_s
    orbit = orbit if times.size else replace(orbit, ending="reached")
    found = finished(scene, trajectory.plan, orbit, derive_s, spent)
    return found if found.plan.precision == "double" else in_decimals(found, progress)
