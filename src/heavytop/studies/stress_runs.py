"""One run of a stress test: a method at a case, as its user would do it.

Compiled methods of others are stepped in the axis form; those of fixed step take so many steps
that the last one ends with the span, their step being a part of the nutation period, or of the
pendulum's where nothing nutates. scipy's solvers are called once, from the start to the end.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from heavytop import errors
from heavytop.comparison.adaptive import (
    Rates,
    TextbookRun,
    textbook_right_hand_side,
    textbook_solve,
)
from heavytop.comparison.methods import make_stepper
from heavytop.comparison.steppers import FixedStep, IntegrationFailed, Stepper
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import lambdified
from heavytop.integration.outputs import invariants, sample
from heavytop.numbers.double_double import Array, two_product
from heavytop.run.planning import Plan, closed_form_of
from heavytop.run.propagation import binary_start, propagate
from heavytop.run.trajectory import Trajectory
from heavytop.run.verify import energy_error
from heavytop.scene.scene import Scene
from heavytop.studies.conditioning import CaseReference
from heavytop.studies.methods import AUTO, FIRST_ORDER, TOLERANCE, Method
from heavytop.studies.stress_cases import Case

BLOCK: Final = 1000  # steps of a fixed step between two looks,
CALL: Final = 50  # and of CyRK, whose steps are known by whole blocks only
AXIS: Final = Plan("axis")
ENDINGS: Final = {
    errors.Outcome.FINISHED: "finished",
    errors.Outcome.SINGULAR: "singular",
    errors.Outcome.STEP_LIMIT: "step-limit",
}
OWN_WARNINGS: Final = (errors.DoubtfulWarning, errors.UnboundedAngleWarning)
WATCHED: Final = ("turning", "reversal")  # sign changes are all that scipy finds: a cusp is none
RESTING: Final = 1e-2  # of the greatest rate


@dataclass(frozen=True, slots=True)
class RunResult:
    """What one run gave, before it is judged.

    Attributes
    ----------
    ending : str
        ``finished``, or what stopped it: ``refused``, ``singular``, ``failed``, ``step-limit``.
    said : str
        What it said of that, or of a doubt.
    t : float
        The time reached [s].
    steps : int
    smallest_step : float or None
        Its shortest step; of the Taylor integrator, the shortest mean of a block of them [s].
    axis : tuple of 3 float, or None
        At the end; None where the formulation gives the tilt alone.
    theta : float or None
    angles : (float, float), or None
        phi and psi at the end, where the run follows them [rad].
    energy_error : float or None
        How far E' is off its start, relative to max(|E'|, gMR).
    moved : float
        How far from its start the axis, or the tilt, has gone.
    counted : dict from str to int
        Events.
    plan : str
        What auto chose.
    more_bits : bool
        Whether it had more than doubles have.
    resting : bool
        Whether its rate has vanished, and it stays where it is.
    """

    ending: str
    said: str = ""
    t: float = 0.0
    steps: int = 0
    smallest_step: float | None = None
    axis: tuple[float, float, float] | None = None
    theta: float | None = None
    angles: tuple[float, float] | None = None
    energy_error: float | None = None
    moved: float = 0.0
    counted: dict[str, int] = field(default_factory=dict)
    plan: str = ""
    more_bits: bool = False
    resting: bool = False


def run(case: Case, method: Method, truth: CaseReference, step_limit: int) -> RunResult:
    """Do one run.

    Parameters
    ----------
    case : Case
    method : Method
        One of `heavytop.studies.methods.stress_methods`.
    truth : CaseReference
        Of the case: the end and the period, and nothing of what is found there.
    step_limit : int
        Steps after which it is given up. What looks at them between blocks takes a whole block.
    """
    if not method.is_rival:
        way = _taylor
    elif method.formulation == FIRST_ORDER:
        way = first_order
    else:
        way = _textbook if method.solver else _stepped
    found = way(case, method, truth, step_limit)
    if found.ending == "finished" and found.steps > step_limit:
        said = f"{found.steps} steps, where it may take fewer"
        return replace(found, ending="step-limit", said=said)
    return found


# --- the Taylor integrator -------------------------------------------------------------------


def _taylor(case: Case, method: Method, truth: CaseReference, step_limit: int) -> RunResult:
    wants = {"cubic": ("theta",), "auto-angles": ("axis", "phi", "psi")}
    wanted = wants.get(method.name.removeprefix("taylor-"), ("axis",))
    scene = replace(case.scene, quantities=wanted)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            found = propagate(scene, formulation=method.formulation, step_limit=step_limit)
        except errors.BadScene as refusal:
            return RunResult("refused", "; ".join(fault.rule for fault in refusal.faults))
        except errors.EndedEarly as early:
            found = early.trajectory
    said = "; ".join(str(w.message) for w in heard if issubclass(w.category, OWN_WARNINGS))
    with np.errstate(all="ignore"):
        return _of_trajectory(found, said, auto=method.formulation == AUTO)


def _of_trajectory(found: Trajectory, said: str, *, auto: bool) -> RunResult:
    ending, end, chosen = ENDINGS[found.outcome], found.orbit.end, found.plan
    result = RunResult(ending, said, end, found.statistics.steps, _smallest_step(found))
    if auto:
        parts = (chosen.formulation, chosen.precision, "projected" if chosen.projected else "")
        plan, more_bits = ", ".join(filter(None, parts)), chosen.precision != "double"
        result = replace(result, plan=plan, more_bits=more_bits)
    if ending != "finished":
        return replace(result, said=said or f"{found.outcome.sentence}, at t = {end:.6g} s")
    counted = {name: found.events.count(name) or 0 for name in found.scene.events}
    result = replace(result, energy_error=energy_error(found), counted=counted)
    return _with_motion(result, found([0.0, end]))


def _smallest_step(found: Trajectory) -> float | None:
    places = [(point.time[0], point.steps) for point in found.orbit.checkpoints]
    places.append((found.orbit.end, found.statistics.steps))
    blocks = np.diff(places, axis=0)
    return min((abs(t) / n for t, n in blocks.tolist() if n), default=None)


def _with_motion(result: RunResult, seen: Any) -> RunResult:
    """Return a result with axis and angles, which were seen at the start and at the end."""
    has_axis = not np.isnan(seen.axis).any()
    x, y, z = seen.axis[1].tolist()
    phi, psi = float(seen.phi[1]), float(seen.psi[1])
    return replace(
        result,
        axis=(x, y, z) if has_axis else None,
        theta=float(seen.theta[1]),
        angles=(phi, psi) if math.isfinite(phi + psi) else None,
        moved=math.dist(*seen.axis) if has_axis else abs(float(np.diff(seen.theta)[0])),
    )


# --- methods of others -----------------------------------------------------------------------


def stepper_of(case: Case, method: Method, truth: CaseReference) -> tuple[Stepper, int]:
    """Return a method set up for a case, and how many its steps are if they have one length.

    What it compiles is compiled here.
    """
    parameters, start = binary_start(case.scene, AXIS)
    ahead, span = (1 if truth.end >= 0 else -1), abs(truth.end)
    if method.set_by == TOLERANCE:
        setting, steps, block = method.setting, 0, CALL
    else:
        period = truth.period or math.tau / math.sqrt(abs(parameters["g"]))
        steps = math.ceil(span / period * method.setting)
        setting, block = float(steps), min(steps, BLOCK)
    name = method.name
    return make_stepper(name, start.state, parameters, setting, span, ahead, steps=block), steps


def _stepped(case: Case, method: Method, truth: CaseReference, step_limit: int) -> RunResult:
    """Let a compiled method go block by block until one holds the end."""
    stepper, steps = stepper_of(case, method, truth)
    if steps > step_limit:
        return RunResult("step-limit", f"its steps would be {steps}", steps=steps)
    end, smallest = stepper.output_time(truth.end), None
    if isinstance(stepper, FixedStep):
        end, smallest = two_product(stepper.h, float(steps)), abs(stepper.h)
    before = after = stepper.begin()
    try:
        while abs(after.time[0]) < abs(end[0]):
            if after.steps >= step_limit:
                return RunResult("step-limit", t=after.time[0], steps=after.steps)
            before, after = after, stepper.block(after)
        state = stepper.states_at(before, [end])[0]
    except IntegrationFailed as failure:
        return RunResult("failed", str(failure))
    result = RunResult("finished", t=truth.end, steps=steps or after.steps, smallest_step=smallest)
    return _landed(result, AXIS, case.scene, state)


def _textbook(case: Case, method: Method, truth: CaseReference, step_limit: int) -> RunResult:
    """Let one of scipy's solvers go, from any start: at a pole nothing warns its user either."""
    bare = Plan(method.formulation)
    parameters, start = binary_start(case.scene, bare)
    form = bare.equations
    watched = [_zero(form, name, parameters) for name in WATCHED] if case.counted else []
    rates = textbook_right_hand_side(form, parameters)
    told = _called(method, rates, start.state, truth.end, step_limit, watched)
    result = _of_textbook(told)
    if told.status == "failed":
        return result if told.finite else replace(result, ending="singular")
    if told.status != "finished":
        return result
    result = replace(result, counted=dict(zip(WATCHED, told.zeros, strict=False)))
    return _landed(result, bare, case.scene, told.state)


def _zero(form: Formulation, name: str, parameters: dict[str, float]) -> Callable[[Array], float]:
    symbols = (*form.parameters, *form.given)
    known = [parameters[p.name] for p in symbols]
    function = lambdified([form.events[name]], (*form.states, *symbols))
    return lambda y: float(function(*y, *known)[0])


def _landed(result: RunResult, chosen: Plan, scene: Scene, state: Array) -> RunResult:
    """Return a result with what the last state says."""
    form, (parameters, start) = chosen.equations, binary_start(scene, chosen)
    rows, times = np.array([start.state, state]), np.array([0.0, result.t])
    if not np.isfinite(rows).all():
        return result
    with np.errstate(all="ignore"):
        seen = sample(form, rows, parameters, times)
        energy = invariants(form, rows, parameters, times)["energy"]
    weight = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    off = abs(float(energy[1] - energy[0])) / max(abs(float(energy[0])), abs(weight))
    return _with_motion(replace(result, energy_error=off), seen)


def first_order(case: Case, method: Method, truth: CaseReference, step_limit: int) -> RunResult:
    """Solve u' = ±sqrt(f(u)) for u = cos(theta), with the sign that it starts with.

    Where f vanishes its root is not Lipschitz: u = const solves the equation too, and once there
    a solver has no reason to leave. A textbook that tells one to flip the sign there does not say
    when.
    """
    reduced = closed_form_of(case.scene).reduced
    g, a, b, h = (float(x) for x in (reduced.g, reduced.a, reduced.b, reduced.h))
    sign, start = math.copysign(1.0, float(reduced.udot0)), float(reduced.u0)

    def rate(u: float) -> float:
        return sign * math.sqrt(max(2 * (h - g * u) * (1 - u * u) - (a - b * u) ** 2, 0.0))

    def rates(_: float, y: Array) -> list[float]:
        return [rate(float(y[0]))]

    told = _called(method, rates, np.array([start]), truth.end, step_limit)
    if told.status != "finished":
        return _of_textbook(told)
    u = float(told.state[0])
    theta = math.acos(max(-1.0, min(1.0, u)))
    fastest = max(abs(rate(x)) for x in np.linspace(u, start, 65))
    return replace(
        _of_textbook(told),
        theta=theta,
        moved=abs(theta - math.acos(start)),
        resting=abs(rate(u)) < RESTING * fastest,
    )


def _called(
    method: Method,
    rates: Rates,
    start: Array,
    end: float,
    step_limit: int,
    watched: Sequence[Callable[[Array], float]] = (),
) -> TextbookRun:
    """Call one of scipy's solvers."""
    tolerances = method.setting, method.atol or method.setting
    return textbook_solve(rates, start, end, method.solver, *tolerances, step_limit, watched)


def _of_textbook(told: TextbookRun) -> RunResult:
    return RunResult(told.status, told.message, told.t, told.steps, told.smallest)
