"""Integrate a scene by its plan, continue a trajectory, finish an interrupted one.

Every run is compared with the closed form; where it misses its digits, it may be repeated by a
better plan, and what it still misses is warned of.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.errors import EndedEarly, Impossible, Outcome
from heavytop.exact import Number
from heavytop.integration.orbit import Orbit, integrate, start_orbit
from heavytop.run.binary_motion import binary_start, integrator_of, times_between
from heavytop.run.estimates import CostModel, most_steps
from heavytop.run.events import events_expected
from heavytop.run.plan import Plan, Statistics, closed_form_of, exact_span, refusal, span
from heavytop.run.planning import next_plan, plan_motion
from heavytop.run.trajectory import Trajectory
from heavytop.run.trajectory_file import Checkpoints
from heavytop.run.verify import misses, warn_of_misses, warn_of_plan
from heavytop.scene.arguments import check_callable, expect, integer, path_of, read_argument
from heavytop.scene.quantities import QUANTITY_READERS
from heavytop.scene.scene import Scene
from heavytop.scene.scene_file import MAX_SAMPLES

Progress = Callable[[float], None]
MOST_TRIED = 3  # plans before the last


class Course(NamedTuple):
    """Where to report and save a run on its way, and when to stop it, as for `propagate`."""

    progress: Progress | None = None
    checkpoint: Path | None = None
    step_limit: int | None = None


def propagate(
    scene: Scene,
    *,
    formulation: str = "auto",
    projected: bool = False,
    tolerance: float | None = None,
    progress: Progress | None = None,
    step_limit: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Trajectory:
    """Integrate a scene.

    Parameters
    ----------
    scene : Scene
        What is to be run.
    formulation : str
        ``auto`` (the least that gives what the scene wants) or the name of a formulation.
    projected : bool
        Whether to put the state back onto the invariants of the start every few steps: the phase
        error of a long run then grows only as the root of the time.
    tolerance : float, optional
        Relative error of a step in doubles, 1e-20 to 0.01; by default their rounding [1].
    progress : callable, optional
        Called with the fraction done, after each block of steps.
    step_limit : int, optional
        Steps after which to give up; checked between blocks. By default a million, and a thousand
        for each nutation, which only a form that is singular at a pole ever takes.
    checkpoint : path, optional
        A file in which the trajectory so far is saved every ten seconds, or at longer intervals
        where saving takes long; `extend` continues what `load_trajectory` reads from it.

    Returns
    -------
    Trajectory

    Raises
    ------
    BadScene
        The scene wants what the formulation cannot give; or auto integrates nothing, because the
        steps would take more than an hour: `heavytop.Motion` has the motion at any time.
    EndedEarly
        A singularity, the step limit or an interrupt; it carries the partial trajectory.
    OSError
        `checkpoint` cannot be written.

    Warns
    -----
    MissedDigitsWarning
        Wanted quantities are farther off the closed form than the scene's digits allow.
    DoubtfulWarning
        Events are miscounted, or something else is beyond the precision, as in the Lagrangian form
        where phi and psi grow in the state of a long run.

    Notes
    -----
    Accuracy: ``tests/analytic/test_published.py`` holds theta, phi, psi of the book's scenes at 2 s
    to 1e-12 of the exact solution.

    References
    ----------
    Jorba & Zou, "A software package for the numerical integration of ODEs by means of high-order
    Taylor methods", *Experimental Mathematics* 14 (2005), for order and step; Biscani & Izzo,
    "Revisiting high-order Taylor methods for astrodynamics and celestial mechanics", *Monthly
    Notices of the Royal Astronomical Society* 504 (2021), for heyoka.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> trajectory = propagate(load_scene("sicm-dropped"))
    >>> trajectory.events.count("cusp")
    5
    """
    step_limit = None if step_limit is None else integer("step_limit", step_limit, 1)
    check_callable("progress", progress)
    place = None if checkpoint is None else path_of("checkpoint", checkpoint)
    motion = closed_form_of(scene)
    chosen = plan_motion(scene, motion, formulation, projected, tolerance)
    if chosen.formulation == "none":
        known = "heavytop.Motion has the motion at any time, a formulation by name integrates it"
        raise refusal(scene, "formulation", formulation, f"{chosen.reasons[0]}; {known}")
    return integrate_plan(scene, motion, chosen, Course(progress, place, step_limit))


def integrate_plan(scene: Scene, motion: Motion, chosen: Plan, course: Course) -> Trajectory:
    """Integrate a scene by a plan that integrates something; else as `propagate`."""
    return _repeat_until_accurate(_integrate(scene, motion, chosen, course), course)


def _integrate(
    scene: Scene, motion: Motion, chosen: Plan, course: Course, spent: float = 0.0
) -> Trajectory:
    """Return the trajectory of a plan, whatever it misses; earlier plans took `spent` seconds."""
    warn_of_plan(chosen, stacklevel=5)
    began = time.perf_counter()
    _ = chosen.equations
    cost = Statistics(0, 0, time.perf_counter() - began, 0.0, spent)
    constants, start = binary_start(scene, chosen)
    orbit = start_orbit(integrator_of(chosen, constants, start), start)
    part = Trajectory(scene, motion, chosen, orbit, cost)
    return _continue(part, _even_times(part, 0, scene.samples - 1), course)


def _repeat_until_accurate(run: Trajectory, course: Course, stacklevel: int = 5) -> Trajectory:
    """Return a run, or where auto chose its plan and it misses digits or events, a better one.

    What the last one misses, if only at samples and in times of events, is warned of.
    """
    scene, motion = run.scene, run.motion
    while True:
        missed, chosen, better = misses(run), run.plan, None
        if chosen.auto and len(chosen.tried) < MOST_TRIED and not missed.factor <= 1:
            expected = CostModel(scene, motion, span(scene, motion))
            better = next_plan(expected, chosen, missed.factor, str(missed))
        if better is None:
            warn_of_misses(missed, scene.digits, stacklevel)
            return run
        run = _integrate(scene, motion, better, course, run.statistics.integrate_s)


def extend(
    trajectory: Trajectory,
    time_span: Number,
    *,
    samples: int | None = None,
    progress: Progress | None = None,
) -> Trajectory:
    """Continue a trajectory to a later end, as if it had been run in one piece.

    It keeps its plan, with tolerance and bits. For the whole span auto might have made another
    plan; a warning says what this one misses.

    Parameters
    ----------
    trajectory : Trajectory
        The trajectory to be continued.
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
    Impossible
        The new end is not beyond the old one; samples are no whole number, or too many.
    BadScene
        The new end is so far off that whole turns cannot be counted.
    EndedEarly
        As for `propagate`.
    WrongType, Impossible
        It is no Trajectory; `time_span` is no number.

    Warns
    -----
    MissedDigitsWarning, DoubtfulWarning
        As `propagate` does: the whole run is checked.

    Notes
    -----
    Accuracy: ``tests/run/test_propagation.py`` holds a run that was continued to one in a
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
    check_callable("progress", progress)
    span_wanted = read_argument("time_span", time_span, QUANTITY_READERS["time"])
    old, end = trajectory.orbit, float(span_wanted)
    if not abs(end) > abs(old.end) or end * old.end < 0:
        raise Impossible([("time_span", f"beyond {old.end}, where the trajectory ends")])
    more = _sample_count(trajectory, end) if samples is None else samples
    count = integer("samples", more, 1, MAX_SAMPLES)
    in_all = trajectory.t.size + count
    scene = replace(trajectory.scene, time=span_wanted, periods=None, samples=in_all)
    again = plan_motion(scene, trajectory.motion, trajectory.plan.formulation)
    chosen = replace(trajectory.plan, warnings=again.warnings, auto=False)
    warn_of_plan(chosen)
    longer = replace(trajectory, scene=scene, plan=chosen)
    times = _even_times(longer, old.samples.t[-1], count)[1:]
    run = _continue(longer, times, Course(progress, step_limit=sys.maxsize))
    warn_of_misses(misses(run), scene.digits)
    return run


def finish(trajectory: Trajectory, course: Course | None = None) -> Trajectory:
    """Continue an interrupted trajectory to the end of its scene, as if it had not been stopped.

    Parameters
    ----------
    trajectory : Trajectory
        An interrupted one; one that is finished is returned as it is.
    course : Course, optional

    Raises
    ------
    EndedEarly, OSError
        As for `propagate`; at once where the trajectory had ended for another reason.

    Warns
    -----
    MissedDigitsWarning, DoubtfulWarning
        As `propagate` does.
    """
    if trajectory.outcome is Outcome.FINISHED:
        return trajectory
    if trajectory.outcome is not Outcome.INTERRUPTED:
        raise EndedEarly(trajectory.outcome, trajectory, _explain_stop(trajectory))
    done = trajectory.orbit.samples.t.size
    warn_of_plan(trajectory.plan)
    times = _even_times(trajectory, 0, trajectory.scene.samples - 1)[done:]
    course = course or Course()
    return _repeat_until_accurate(_continue(trajectory, times, course), course, stacklevel=4)


def _continue(part: Trajectory, times: NDArray[np.float64], course: Course) -> Trajectory:
    """Return a trajectory continued to the last of some times, with samples at all of these.

    Raises
    ------
    EndedEarly
        A singularity, the step limit or an interrupt; it carries the trajectory.
    """
    saves = None if course.checkpoint is None else Checkpoints(course.checkpoint, part)
    began, orbit = time.perf_counter(), part.orbit
    limit = course.step_limit or most_steps(part.motion, span(part.scene, part.motion))
    if times.size:
        between = None if orbit.steps else _times_on_the_way(part, times[-1])
        how: dict[str, Any] = {"on_block": course.progress, "step_limit": limit, "keep": saves}
        orbit = integrate(orbit, times, between=between, **how)
    else:
        orbit = replace(orbit, outcome=Outcome.FINISHED)
    engine, cost = orbit.integrator.engine, part.statistics
    spent = cost.integrate_s + time.perf_counter() - began
    cost = Statistics(orbit.steps, engine.order, cost.derive_s, engine.compile_s, spent, cost.whole)
    if saves is not None:
        saves.save_end(orbit)
    if orbit.outcome is Outcome.FINISHED and _crossed_pole(orbit):
        orbit = replace(orbit, outcome=Outcome.SINGULAR)
    run = replace(part, orbit=orbit, statistics=cost)
    if run.outcome is not Outcome.FINISHED:
        raise EndedEarly(run.outcome, run, _explain_stop(run))
    return run


def _times_on_the_way(part: Trajectory, end: Any) -> NDArray[Any]:
    """Return times besides the samples at which a run is recorded.

    They are those of `times_between`, for the comparison, and in more digits than doubles have
    also the expected times of events, which are then refined by Newton's method.
    """
    numbers = part.orbit.integrator.numbers(times_between(float(end), part.motion.period))
    if part.in_doubles:
        return numbers
    whole = replace(part, orbit=replace(part.orbit, outcome=Outcome.FINISHED))  # as it is to be
    expected = [t for _, t in events_expected(whole)]
    return np.concatenate((numbers, np.array(expected, numbers.dtype)))


def _even_times(part: Trajectory, first: Any, count: int) -> NDArray[Any]:
    """Return count + 1 evenly spaced times from `first` to the end of the scene."""
    scene, motion, ctx = part.scene, part.motion, part.ctx
    if part.in_doubles:
        return np.linspace(float(first), span(scene, motion), count + 1)
    end, begun = exact_span(scene, motion, ctx), part.number(first)
    times = [part.nearest(begun + (end - begun) * k / count) for k in range(count + 1)]
    return np.array(times, part.orbit.samples.t.dtype)


def _crossed_pole(orbit: Orbit) -> bool:
    """Tell whether theta left [0, pi]: a form that is singular at a pole stepped over one."""
    form = orbit.integrator.formulation
    names = [symbol.name for symbol in form.states]
    if form.limits or "theta" not in names:
        return False
    theta = orbit.samples.states[:, names.index("theta")].astype(np.float64)
    return bool(np.any((theta < 0) | (theta > np.pi)))


def _explain_stop(trajectory: Trajectory) -> str:
    """Return why a form that is singular at the poles stopped, and which forms do not; or ''."""
    form, regular = trajectory.plan.formulation, trajectory.plan.equations.limits
    if trajectory.outcome is Outcome.INTERRUPTED or regular:
        return ""
    near = min(trajectory.motion.nearest)
    return (
        f"the {form} form is singular at the poles, and the axis comes {near:.1e} rad near one; "
        "the axis form and the attitude form are regular there"
    )


def _sample_count(trajectory: Trajectory, end: float) -> int:
    """Return how many samples at the present spacing lie between the old end and a new one [s]."""
    reached = abs(trajectory.orbit.end)
    spacing = reached / max(trajectory.t.size - 1, 1)
    count = (abs(end) - reached) / spacing if spacing else math.inf
    if not count <= MAX_SAMPLES - trajectory.t.size:
        rule = f"{count:.3g} more samples at the present spacing, of {MAX_SAMPLES} at most"
        raise Impossible([("time_span", f"{rule}; samples= sets their number")])
    return max(1, round(count))
