"""Doing one run: a method at a case, as its user would do it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from heavytop.comparison.adaptive import textbook_right_hand_side, textbook_solve
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import lambdified
from heavytop.errors import (
    BadScene,
    DoubtfulWarning,
    EndedEarly,
    Outcome,
    UnboundedAngleWarning,
)
from heavytop.numbers.double_double import Array
from heavytop.run.planning import Plan, closed_form_of
from heavytop.run.propagation import binary_start, propagate
from heavytop.run.trajectory import Trajectory
from heavytop.run.verify import energy_error
from heavytop.scene.scene import Scene
from heavytop.studies.stresses.cases import Case
from heavytop.studies.stresses.compiled import compiled
from heavytop.studies.stresses.conditioning import Reference
from heavytop.studies.stresses.first_order import first_order
from heavytop.studies.stresses.landing import followed, landed, three
from heavytop.studies.stresses.methods import AUTO, Method
from heavytop.studies.stresses.raw import Raw

ENDINGS = {
    Outcome.FINISHED: "finished",
    Outcome.SINGULAR: "singular",
    Outcome.STEP_LIMIT: "step-limit",
}
OWN = (DoubtfulWarning, UnboundedAngleWarning)  # numpy's say nothing of the top
WATCHED = ("turning", "reversal")  # sign changes are all that scipy finds: a cusp is none


def run(case: Case, method: Method, truth: Reference, step_limit: int) -> Raw:
    """Do one run.

    Parameters
    ----------
    case : Case
    method : Method
    truth : Reference
        Of the case: the end, and nothing of what is found there.
    step_limit : int
    """
    return _within(_done(case, method, truth, step_limit), step_limit)


def _done(case: Case, method: Method, truth: Reference, step_limit: int) -> Raw:
    if method.rival:
        return compiled(case, method, truth, step_limit)
    end = truth.end
    if method.first_order:
        return first_order(closed_form_of(case.scene), method, end, step_limit)
    if method.solver:
        return _rival(case, method, end, step_limit)
    return _own(case, method, step_limit)


def _within(raw: Raw, step_limit: int) -> Raw:
    """Hold a run to its steps: what looks at them between blocks takes a whole block at least."""
    if raw.ending != "finished" or raw.steps <= step_limit:
        return raw
    return replace(raw, ending="step-limit", said=f"{raw.steps} steps, where it may take fewer")


def _own(case: Case, method: Method, step_limit: int) -> Raw:
    scene = case.scene
    if method.formulation == "cubic":
        scene = _wanting(scene, "theta")
    if method.angles:
        scene = _wanting(scene, "axis", "phi", "psi")
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            found = propagate(scene, formulation=method.formulation, step_limit=step_limit)
        except BadScene as refusal:
            return Raw("refused", "; ".join(fault.rule for fault in refusal.faults))
        except EndedEarly as early:
            found = early.trajectory
    said = "; ".join(str(each.message) for each in heard if issubclass(each.category, OWN))
    with np.errstate(all="ignore"):
        return _of_trajectory(found, said, auto=method.formulation == AUTO)


def _wanting(scene: Scene, *quantities: str) -> Scene:
    return Scene(
        scene.top, scene.start, time=scene.time, periods=scene.periods, quantities=quantities,
        events=scene.events, samples=scene.samples, digits=scene.digits, name=scene.name,
    )  # fmt: skip


def _of_trajectory(found: Trajectory, said: str, *, auto: bool) -> Raw:
    ending = ENDINGS[found.outcome]
    raw = Raw(ending, said, found.orbit.end, found.statistics.steps, _smallest(found))
    if auto:
        how = (found.plan.precision, "projected" if found.plan.projected else "")
        named = ", ".join(filter(None, (found.plan.formulation, *how)))
        raw = replace(raw, plan=named, more_bits=found.plan.precision != "double")
    if ending != "finished":
        return replace(raw, said=said or _where(found))
    start, at = found(0.0), found(found.orbit.end)
    counted = {name: found.events.count(name) or 0 for name in found.scene.events}
    axis = three(at.axis)
    known = not any(map(math.isnan, axis))
    moved = math.dist(at.axis, start.axis) if known else abs(float(at.theta - start.theta))
    return replace(
        raw,
        axis=axis if known else None,
        theta=float(at.theta),
        angles=followed(float(at.phi), float(at.psi)),
        energy=energy_error(found),
        moved=moved,
        counted=counted,
    )


def _where(found: Trajectory) -> str:
    return f"{found.outcome.sentence}, at t = {found.orbit.end:.6g} s"


def _smallest(found: Trajectory) -> float | None:
    points = found.orbit.checkpoints
    times = np.array([*(point.time[0] for point in points), found.orbit.end])
    steps = np.array([*(point.steps for point in points), found.statistics.steps])
    means = [abs(t) / n for t, n in zip(np.diff(times), np.diff(steps), strict=True) if n]
    return float(min(means)) if means else None


def _rival(case: Case, method: Method, end: float, step_limit: int) -> Raw:
    """Let one of scipy's solvers go, from any start: at a pole nothing warns its user either."""
    bare = Plan(method.formulation, None, False, (), (), 0)
    parameters, start = binary_start(case.scene, bare)
    form = bare.equations
    watched = [_zero(form, name, parameters) for name in WATCHED] if case.counted else []
    rates, tolerances = textbook_right_hand_side(form, parameters), (method.rtol, method.atol)
    told = textbook_solve(rates, start.state, end, method.solver, *tolerances, step_limit, watched)
    raw = Raw(told.status, told.message, told.t, told.steps, told.smallest)
    if told.status == "failed":
        return replace(raw, ending="failed" if told.finite else "singular")
    if told.status != "finished":
        return raw
    raw = replace(raw, counted=dict(zip(WATCHED, told.zeros, strict=False)))
    return landed(raw, form, np.array([start.state, told.state]), parameters)


def _zero(form: Formulation, name: str, parameters: dict[str, float]) -> Callable[[Array], float]:
    symbols = (*form.parameters, *form.given)
    known = [parameters[p.name] for p in symbols]
    function = lambdified([form.events[name]], (*form.states, *symbols))
    return lambda y: float(function(*y, *known)[0])
