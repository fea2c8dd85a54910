"""From a scene to a trajectory."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import (
    BadScene,
    DoubtfulWarning,
    EndedEarly,
    Fault,
    Outcome,
    UnboundedAngleWarning,
)
from heavytop.events import Candidates, Events, judged, within
from heavytop.exact import Exact, Number
from heavytop.models.formulation import Formulation
from heavytop.models.ladder import LADDER
from heavytop.models.numeric import exact_values
from heavytop.planning import EPSILON, Plan, closed_form_of, plan, span
from heavytop.quantities import Sample, event_function, sample, spin_momentum
from heavytop.scene import Scene
from heavytop.tally import differences, tally
from heavytop.taylor.counting import Counting
from heavytop.taylor.engine import Engine
from heavytop.taylor.integrator import Integrator, integrator
from heavytop.taylor.legs import Projected
from heavytop.taylor.orbit import Checkpoint, Orbit, Seen, continued, integrate
from heavytop.taylor.projection import Projection
from heavytop.taylor.turns import Turns
from heavytop.taylor.winding import Winding
from heavytop.trajectory import Statistics, Trajectory

if TYPE_CHECKING:
    from heavytop.decimals.result import Decimals

Array = NDArray[np.float64]
Progress = Callable[[float], None]

_OUTCOMES = {
    "reached": Outcome.FINISHED,
    "singular": Outcome.SINGULAR,
    "interrupted": Outcome.INTERRUPTED,
    "step-limit": Outcome.STEP_LIMIT,
}


def propagate(
    scene: Scene,
    *,
    formulation: str = "auto",
    projected: bool = False,
    progress: Progress | None = None,
    step_limit: int | None = None,
) -> Trajectory:
    """Integrate a scene.

    Parameters
    ----------
    scene : Scene
    formulation : str
        ``auto`` (the least that gives what the scene wants) or the name of a formulation.
    projected : bool
        Whether to put the state back onto the invariants of the start, between blocks of steps:
        for long runs, whose phase is then lost as the square root of the time.
    progress : callable, optional
        Called with the fraction done, after each block of steps.
    step_limit : int, optional
        Steps after which to give up; checked between blocks.

    Returns
    -------
    Trajectory

    Raises
    ------
    BadScene
        The scene wants what the formulation cannot give.
    EndedEarly
        A singularity, the step limit or an interrupt; it carries the partial trajectory.

    Notes
    -----
    Accuracy: ``tests/analytic/test_book.py`` holds theta, phi, psi of the book's scenes at 2 s
    to 1e-12 of the exact solution.

    Examples
    --------
    >>> from heavytop.scene import load_scene
    >>> trajectory = propagate(load_scene("sicm-dropped"))
    >>> trajectory.events.count("cusp")
    5
    """
    chosen = plan(scene, formulation, projected=projected)
    if chosen.formulation == "none":
        raise _nothing_to_integrate(scene)
    if chosen.folded:
        raise _better_folded(scene, chosen)
    about = UnboundedAngleWarning if chosen.formulation == "lagrange" else DoubtfulWarning
    for warning in chosen.warnings:
        warnings.warn(warning, about, stacklevel=2)
    end = span(scene, closed_form_of(scene))
    compiled, derive_s = _compiled(chosen)
    parameters, start = binary_start(scene, chosen)
    samples = np.linspace(0.0, end, scene.samples)
    winding = Winding.of(parameters, start.state) if chosen.follows_phi else None
    began = time.perf_counter()
    orbit = integrate(
        engine_of(chosen, compiled, parameters, start),
        parameters,
        start,
        samples,
        winding=winding,
        on_block=progress if chosen.precision == "double" else None,
        step_limit=step_limit,
    )
    trajectory = _finished(scene, chosen, orbit, derive_s, time.perf_counter() - began)
    if chosen.precision != "double":
        trajectory = _in_decimals(trajectory, progress)
    if formulation == "auto" and (doubt := doubtful_events(trajectory)):
        warnings.warn(doubt, DoubtfulWarning, stacklevel=2)
    return trajectory


def doubtful_events(trajectory: Trajectory) -> str:
    """Return what was counted otherwise than the exact numbers have it; or nothing."""
    motion, asked = closed_form_of(trajectory.scene), trajectory.scene.events
    expected = tally(motion, trajectory.orbit.end, asked) if asked else None
    counted = {name: trajectory.events.count(name) for name in asked}
    wrong = "; ".join(differences(expected or {}, counted))
    return f"events: {wrong} by the exact numbers, which this run does not resolve" if wrong else ""


def _nothing_to_integrate(scene: Scene) -> BadScene:
    rule = "class and period need no integration: heavytop.classify and heavytop.Motion have them"
    wants = ", ".join(scene.quantities)
    return BadScene((Fault(scene.name, None, "want.quantities", wants, rule),))


def _better_folded(scene: Scene, chosen: Plan) -> BadScene:
    rule = "a span to be folded: heavytop.fold answers; a formulation by name integrates it"
    key = "span.time" if scene.periods is None else "span.periods"
    value = str(scene.time if scene.periods is None else scene.periods)
    return BadScene((Fault(scene.name, None, key, value, rule, chosen.reasons[-1]),))


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
    longer = _finished(scene, trajectory.plan, orbit, trajectory.statistics.derive_s, spent)
    if trajectory.decimals is None:
        return longer
    again = plan(scene, trajectory.plan.formulation)  # a longer run may take more bits
    chosen = replace(trajectory.plan, precision=again.precision, tolerance=again.tolerance)
    return _in_decimals(replace(longer, plan=chosen), progress, trajectory.decimals)


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
    found = _finished(scene, trajectory.plan, orbit, derive_s, spent)
    return found if found.plan.precision == "double" else _in_decimals(found, progress)


def _in_decimals(
    trajectory: Trajectory, progress: Progress | None, before: Decimals | None = None
) -> Trajectory:
    """Return a trajectory in the precision of its plan, which its run in doubles has prepared."""
    from heavytop.decimals.result import in_decimals

    scene, spent = trajectory.scene, trajectory.statistics
    parts = (trajectory.plan, start_values(scene), trajectory.orbit, trajectory.events)
    try:
        decimals, events = in_decimals(scene, *parts, before, progress)
    except KeyboardInterrupt:
        doubles = replace(trajectory, outcome=Outcome.INTERRUPTED)
        raise EndedEarly(Outcome.INTERRUPTED, doubles) from None
    engine = decimals.run.engine
    cost = Statistics(
        decimals.steps,
        engine.order,
        spent.derive_s,
        engine.compile_s,
        spent.integrate_s + decimals.integrate_s,
    )
    return replace(trajectory, events=events, statistics=cost, decimals=decimals)


def _finished(
    scene: Scene, chosen: Plan, orbit: Orbit, derive_s: float, integrate_s: float
) -> Trajectory:
    compiled = orbit.integrator
    if orbit.ending == "reached" and _left_the_chart(orbit):
        orbit = replace(orbit, ending="singular")
    trajectory = Trajectory(
        scene=scene,
        plan=chosen,
        orbit=orbit,
        events=_events(scene, chosen, orbit),
        outcome=_OUTCOMES[orbit.ending],
        statistics=Statistics(
            orbit.steps, compiled.order, derive_s, compiled.compile_s, integrate_s
        ),
    )
    if trajectory.outcome is not Outcome.FINISHED:
        raise EndedEarly(trajectory.outcome, trajectory)
    return trajectory


def _left_the_chart(orbit: Orbit) -> bool:
    """Tell whether a form that is singular at the poles stepped over one, theta leaving 0 to pi."""
    if orbit.integrator.formulation.starts_at_pole:
        return False
    theta = orbit.samples.rows[:, 0]  # of these forms it is the first state
    return bool(np.any((theta < 0) | (theta > np.pi)))


def compiled_for(chosen: Plan) -> Integrator:
    """Return the compiled integrator of a plan."""
    form = formulation_of(chosen)
    tolerance = max(chosen.tolerance, EPSILON)  # more digits are the matter of `decimals`
    return integrator(form.integrated or form, chosen.watched, tolerance)


def formulation_of(chosen: Plan) -> Formulation:
    """Return the formulation of a plan, with the angles it counts."""
    return LADDER[chosen.formulation].build(chosen.variant)


def engine_of(
    chosen: Plan, compiled: Integrator, parameters: dict[str, float], start: Checkpoint
) -> Engine:
    """Return what takes the steps of a plan: the integrator, as it projects and counts turns."""
    form = formulation_of(chosen)
    engine: Engine = compiled
    if chosen.projected:
        state = start.state[: len(compiled.formulation.states)]
        engine = Projected(compiled, Projection.of(compiled.formulation, parameters, state))
    return engine if form.integrated is None else Counting(engine, form, Turns.of(parameters))


def _compiled(chosen: Plan) -> tuple[Integrator, float]:
    began = time.perf_counter()
    formulation_of(chosen)
    derive_s = time.perf_counter() - began
    return compiled_for(chosen), derive_s


def start_values(scene: Scene) -> dict[str, Exact]:
    """Return the exact numbers of a scene by the symbols of the Lagrangian."""
    top, start = scene.top, scene.start
    return {
        "A": top.A,
        "C": top.C,
        "gMR": top.gMR,
        "theta": start.theta,
        "phi": start.phi,
        "psi": start.psi,
        "thetadot": start.thetadot,
        "phidot": start.phidot,
        "psidot": start.psidot,
    }


def binary_start(scene: Scene, chosen: Plan) -> tuple[dict[str, float], Checkpoint]:
    """Return a run's own numbers: every constant and state rounded once from the exact one."""
    form = formulation_of(chosen)
    named = start_values(scene)
    expressions = (*form.parameters.values(), *form.start)
    symbols = {s: named[s.name] for x in expressions for s in getattr(x, "free_symbols", ())}
    values = [float(v) for v in exact_values(expressions, symbols)]
    count = len(form.parameters)
    parameters = {p.name: v for p, v in zip(form.parameters, values[:count], strict=True)}
    parameters |= dict(chosen.frame)
    state = np.array(values[count:])
    if form.integrated is not None:
        state[-2:] = Turns.of(parameters).started(state, *state[-2:].tolist())
    phi = float(scene.start.phi) if chosen.follows_phi else np.nan
    return parameters, Checkpoint((0.0, 0.0), state, phi, 0)


def _events(scene: Scene, chosen: Plan, orbit: Orbit) -> Events:
    zeros = dict(zip(chosen.watched, orbit.hits, strict=True))
    none = Seen(np.empty(0), np.empty(0), orbit.samples.rows[:0], np.empty(0))
    found = {
        event: within(
            _candidates(orbit, event, zeros.get(event, none)),
            _starting(scene, orbit, event) if event in zeros else None,
            orbit.end,
            abs(orbit.end) / max(orbit.steps, 1),
        )
        for event in ("turning", "reversal")
    }
    return judged(found["turning"], found["reversal"], scene.events, orbit.steps)


def _candidates(orbit: Orbit, event: str, seen: Seen) -> Candidates:
    form, parameters = orbit.integrator.formulation, orbit.parameters
    zero, slope = event_function(form, event, seen.rows, parameters, seen.t)
    at = sample(form, seen.rows, parameters, seen.t, seen.phi)
    return Candidates(
        t=seen.t,
        t_low=seen.t_low,
        states=seen.rows,
        phi=at.phi,
        theta=at.theta,
        phidot=at.phidot,
        axis=at.axis,
        residual=zero,
        slope=slope,
        noise=_phidot_rounding(orbit, at),
    )


def _phidot_rounding(orbit: Orbit, at: Sample) -> Array:
    """Return the rounding of phidot = (a - b u)/sin^2, whose terms cancel at a cusp [rad/s].

    Where it is not small against b itself, near a pole, it decides nothing: nan.
    """
    form, first = orbit.integrator.formulation, orbit.checkpoints[0].state[None]
    b = abs(float(spin_momentum(form, first, orbit.parameters, np.zeros(1))[0]))
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = EPSILON * (np.abs(at.phidot) + 2 * b / np.abs(np.sin(at.theta)))
    return np.where(noise < 1e-6 * b, noise, np.nan)


def _starting(scene: Scene, orbit: Orbit, event: str) -> Candidates | None:
    start = scene.start
    at_pole = float(start.theta) == 0.0 or start.theta.sign() == 0
    exactly = {
        "turning": start.thetadot.sign() == 0 or at_pole,
        "reversal": start.phidot.sign() == 0,
    }
    if not exactly[event]:
        return None
    first = orbit.checkpoints[0]
    seen = Seen(np.zeros(1), np.zeros(1), first.state[None], np.array([first.phi]))
    return _candidates(orbit, event, seen)
