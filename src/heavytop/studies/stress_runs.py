"""One run of a stress test: a method at a case as its user would run it, and its judgement.

Compiled published methods integrate the axis form. Methods of fixed step divide the span by a whole
number of steps, about the usual part of the nutation period, or of a pendulum's where nothing
nutates. scipy's solvers are called once, from the start to the end.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop import errors
from heavytop.comparison.methods import MethodEntry, make_stepper
from heavytop.comparison.steppers import InitialValueProblem, IntegrationFailed
from heavytop.equations.registry import FORMULATIONS
from heavytop.exact.pairs import DoubleDouble, two_product
from heavytop.integration.outputs import form_values, invariants, sample
from heavytop.results.stress import AUTO, NO_RUN, WRONG_AXIS, StressOutcome
from heavytop.results.table import Row
from heavytop.run.counts import Counts
from heavytop.run.plan import Plan
from heavytop.run.propagation import propagate
from heavytop.run.verify import invariant_drift
from heavytop.scene.quantities import Need
from heavytop.scene.scene import Scene
from heavytop.studies.methods import AUTO_ANGLES
from heavytop.studies.steppers import measured_order, problem_of
from heavytop.studies.stress_cases import CaseReference, cases

EASY: Final = "ten-periods"  # the case at which the order of a method of one's own is measured
KEPT_SHARE: Final = 0.5  # of the digits that conditioning leaves
# scipy finds events by changes of sign: at a cusp there is none
WATCHED_EVENTS: Final = ("turning", "reversal")


class CaseRun(NamedTuple):
    """The result of one run, before it is judged.

    Attributes
    ----------
    stopped : StressOutcome or None
        What stopped it before its end.
    message : str
        Its own message about that, or a warning.
    steps : int
    axis : tuple of 3 float
        At the end; empty where the formulation gives the tilt alone.
    theta : float
        The tilt at the end [rad].
    angles : tuple of float
        phi and psi at the end, where the run follows them [rad].
    energy_error : float or None
        How far E' is off its start, relative to max(|E'|, gMR).
    counted : dict from str to int
        Numbers of events.
    plan : str
        The plan that auto chose.
    more_bits : bool
        Whether it computed in more bits than doubles have.
    step_error : float
        The relative error that the order and the length of a fixed step allow.
    """

    stopped: StressOutcome | None = None
    message: str = ""
    steps: int = 0
    axis: tuple[float, ...] = ()
    theta: float = math.nan
    angles: tuple[float, ...] = ()
    energy_error: float | None = None
    counted: Mapping[str, int] = {}
    plan: str = ""
    more_bits: bool = False
    step_error: float = 0.0


def prepare(
    case: Scene, method: MethodEntry, truth: CaseReference, step_limit: int
) -> Callable[[], CaseRun]:
    """Return the function that does a run; published methods are compiled here.

    Parameters
    ----------
    case : Scene
    method : MethodEntry
        One of `heavytop.studies.methods.stress_methods`.
    truth : CaseReference
        Of the case; only its end and its period are used.
    step_limit : int
        Steps after which it is given up; some methods check only after a whole block.
    """
    if not method.is_rival:
        return partial(_run_taylor, case, method, step_limit)
    problem = problem_of(case, Plan(method.formulation), truth.end)
    trail, about = list[Any](), dict[str, Any]()
    stepper: Any
    if method.fixed:
        period = truth.period or math.tau / math.sqrt(abs(problem.parameters["g"]))
        steps = math.ceil(abs(truth.end) / period * method.setting)
        if steps > step_limit:
            return partial(CaseRun, StressOutcome.STEP_LIMIT, f"it would take {steps} steps", steps)
        order = method.published_order or measured_order(cases()[EASY], method)
        allowed = (math.tau / method.setting) ** order if order else 0.0
        about, block = {"steps": steps, "step_error": allowed}, min(steps, method.block)
        stepper = make_stepper(replace(method, setting=float(steps)), problem, block)
        last = two_product(stepper.h, float(steps))
    else:
        stepper, last = make_stepper(method, problem), (truth.end, 0.0)
        if method.block == 0:  # called once: events are counted in the steps of that call
            stepper = replace(stepper, steps=step_limit, on_steps=trail.append)
    return partial(_run_stepper, case, problem, stepper, last, step_limit, trail, about)


def _run_stepper(
    case: Scene, problem: InitialValueProblem, stepper: Any, last: DoubleDouble, step_limit: int,
    trail: list[Any], about: Mapping[str, Any],
) -> CaseRun:  # fmt: skip
    """Run a published or a user's method to the end."""
    before = after = stepper.begin()
    try:
        while abs(after.time[0]) < abs(last[0]):
            if after.steps >= step_limit:
                return CaseRun(StressOutcome.STEP_LIMIT, steps=after.steps)
            before, after = after, stepper.block(after)
        row = after.state if after.time == last else stepper.states_at(before, [last])[0]
    except IntegrationFailed as failure:
        return CaseRun(StressOutcome(failure.outcome), str(failure))
    form, constants = problem.equations, problem.parameters
    axis = row if stepper.form is None else stepper.form.axis_states(row)
    rows, ends, counted = np.array([problem.start, axis]), np.array([0.0, problem.span]), {}
    with np.errstate(all="ignore"):
        sampled = sample(form, rows, constants, ends)
        off = invariant_drift(invariants(form, rows, constants, ends), constants)["energy"]
    for taken in trail if case.events else ():
        for name in WATCHED_EVENTS:
            signs = np.sign(form_values(form, name, taken.states, constants, taken.times)[0])
            counted[name] = int(np.sum(signs[:-1] * signs[1:] <= 0))
    message = "; ".join(f"{count}× {text}" for text, count in stepper.warned.items())
    energy = {"energy_error": off if math.isfinite(off) else None}
    found = {"message": message, "steps": after.steps, "counted": counted, **energy, **about}
    return _arrive(sampled, step_limit, **found)


def _run_taylor(case: Scene, method: MethodEntry, step_limit: int) -> CaseRun:
    """Run the Taylor integrator, in one formulation or as auto chooses, to the end."""
    auto = method.formulation == AUTO
    wanted: tuple[str, ...] = ("axis", "phi", "psi") if method.name == AUTO_ANGLES else ("axis",)
    if not auto and FORMULATIONS[method.formulation].gives is Need.TILT:
        wanted = ("theta",)
    scene = replace(case, quantities=wanted)
    with warnings.catch_warnings(record=True, action="always") as caught:
        try:
            found = propagate(scene, formulation=method.formulation, step_limit=step_limit)
        except errors.BadScene as refusal:
            return CaseRun(StressOutcome.REFUSED, "; ".join(fault.rule for fault in refusal.faults))
        except errors.EndedEarly as early:
            found = early.trajectory
    doubts = [w.message for w in caught if issubclass(w.category, errors.DoubtfulWarning)]
    message, end, chosen = "; ".join(map(str, doubts)), found.orbit.end, found.plan
    about: dict[str, Any] = {"steps": found.statistics.steps}
    if auto:
        parts = (chosen.formulation, chosen.precision, "projected" * chosen.projected)
        about |= {"plan": ", ".join(filter(None, parts)), "more_bits": chosen.precision != "double"}
    if found.outcome is not errors.Outcome.FINISHED:
        why = message or f"{found.outcome} at t = {end:.6g} s"
        return CaseRun(StressOutcome(found.outcome), why, **about)
    with np.errstate(all="ignore"):
        about["counted"] = {name: found.events.count(name) or 0 for name in scene.events}
        about["energy_error"] = invariant_drift(found.invariants, found.orbit.parameters)["energy"]
        return _arrive(found([end]), step_limit, message=message, **about)


def _arrive(seen: Any, step_limit: int, **about: Any) -> CaseRun:
    """Return the result of a run that reached the end, with axis and angles there."""
    if (steps := about["steps"]) > step_limit:
        about["message"] = f"{steps} steps, more than its limit"
        return CaseRun(StressOutcome.STEP_LIMIT, **about)
    axis, angles = tuple(seen.axis[-1].tolist()), (float(seen.phi[-1]), float(seen.psi[-1]))
    about["angles"] = angles if math.isfinite(sum(angles)) else ()
    return CaseRun(axis=() if math.isnan(sum(axis)) else axis, theta=float(seen.theta[-1]), **about)


# --- how a run is judged ---------------------------------------------------------------------


def judge(found: CaseRun, truth: CaseReference, case: str, method: MethodEntry) -> Row:
    """Return the row of a run in the result; where its method follows φ and ψ, these are judged.

    Parameters
    ----------
    found : CaseRun
    truth : CaseReference
    case : str
    method : MethodEntry
    """
    row_of = partial(
        Row, NO_RUN, case=case, method=method.name, formulation=method.formulation,
        plan=found.plan, steps=found.steps, energy_error=found.energy_error,
        condition=min(truth.condition, 1e300),
    )  # fmt: skip
    if found.stopped:
        return row_of(outcome=found.stopped, note=found.message, named=True)
    off = [a - b for a, b in zip(found.angles, truth.angles, strict=False)]
    error = math.dist(found.axis, truth.axis) if found.axis else abs(found.theta - truth.theta)
    if method.name == AUTO_ANGLES:
        truth, error = truth.of_angles(), max(map(abs, off), default=math.nan)
    if not math.isfinite(error):
        return row_of(outcome=StressOutcome.DIVERGED, note="the final state is not finite")
    outcome, why = _outcome(found, truth, error)
    chance = truth.digits == 0 and not found.more_bits
    turns = [round(angle / math.tau) for angle in off]  # which the axis does not see
    pairs = zip("φψ", turns, strict=False)
    wrong = [f"{name} is off by {n:+d} turn{'s'[: abs(n) > 1]}" for name, n in pairs if n]
    notes = ["undetermined: no digits are left" * chance, why, ", ".join(wrong), found.message]
    return row_of(
        outcome=outcome, error=error, digits_lost=truth.digits_lost(error),
        named=bool(found.message), untold=chance, turns=tuple(turns) or None,
        note="; ".join(filter(None, notes)),
    )  # fmt: skip


def _outcome(found: CaseRun, truth: CaseReference, error: float) -> tuple[StressOutcome, str]:
    """Return the outcome of a run that reached the end, and what is wrong with it."""
    off, step_error = found.energy_error, found.step_error
    granted = replace(truth, rounding=max(truth.rounding, step_error))
    poor = granted.digits_lost(error) > (1 - KEPT_SHARE) * granted.digits
    if poor or error >= WRONG_AXIS:
        message = "" if off is None else f"energy error {off:.0e}"
        return StressOutcome.DIVERGED if error >= WRONG_AXIS else StressOutcome.INACCURATE, message
    if missed := miscounted_events(found.counted, truth.counts):
        return StressOutcome.MISSED_EVENTS, "" if "events: " in found.message else missed
    return StressOutcome.OK, ""


def miscounted_events(counted: Mapping[str, int], counts: Counts | None) -> str:
    """Return in words which counts of events are wrong.

    A method that does not count cusps may find a zero of phidot at each of them, at none, or only
    at the start, if that is one.

    Examples
    --------
    >>> miscounted_events({"turning": 5}, {"turning": (6, 6)})
    '5 turning, not 6'
    """
    if counts is None or not counted:
        return ""
    cusps = counts.get("cusp", (0, 0)) if "cusp" not in counted else (0, 0)
    wrong = []
    for name, found in counted.items():
        least, most = counts[name]
        touched = name == "reversal" and cusps[0] > 0 and found in (1, *cusps)
        if not (least <= found <= most or touched):
            wrong.append(f"{found} {name}, not {least}")
    return "; ".join(wrong)
