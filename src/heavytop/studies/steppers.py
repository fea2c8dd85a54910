"""The runs of all studies: any method set up for one start, with its reference solution.

The reference is the closed form of the run's own binary start, at 40 digits. States are compared
with it as exact numbers, so that the comparison adds no error. A number of more than 53 bits is
stored as a decimal text from which every bit can be read back.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.analytic.motion import ClosedForm
from heavytop.comparison.methods import MethodEntry, make_stepper
from heavytop.comparison.steppers import (
    InitialValueProblem,
    IntegrationFailed,
    Stepper,
    StepperState,
    TopConstants,
)
from heavytop.comparison.user_steps import OBSERVED, BodyForm
from heavytop.equations.formulation import Formulation, observables
from heavytop.errors import BadScene, Fault, HeavyTopError
from heavytop.exact.decimals import DOUBLE, Context, context, digits_of, named, precision
from heavytop.exact.pairs import EPSILON, Array, DoubleDouble
from heavytop.integration.engine import NEVER, text
from heavytop.integration.orbit import Block, Checkpoint, Integrator
from heavytop.results.drift import order_of
from heavytop.run.binary_motion import binary_start, integrator_of, motion_of
from heavytop.run.plan import Plan
from heavytop.run.planning import plan
from heavytop.scene.scene import Scene

REFERENCE_DIGITS: Final = 40  # of the reference solution
REFERENCE_SPARE_DIGITS: Final = 12  # of the reference, beyond those of the run's numbers
CLOSE_ROTATION: Final = 1e-12  # a momentum below this part of the largest rate counts as zero
FARTHEST_PERIODS: Final = 1e6  # nutation periods: no step is that long
ORDER_STEPS: Final = tuple(12.5 * 2**k for k in range(9))  # in a period, to measure an order
ORDER_PERIODS: Final = 0.0618  # over which it is measured: so short that few steps suffice
clock: Callable[[], float] = time.perf_counter  # [s]

# --- one method from one start ---------------------------------------------------------------


class MethodRun(NamedTuple):
    """One method set up for one start.

    Attributes
    ----------
    stepper : Stepper
    reference : ReferenceSolution
    period : float
        Of the nutation of this run's own start [s].
    """

    stepper: Stepper
    reference: ReferenceSolution
    period: float


def set_up(scene: Scene, method: MethodEntry) -> MethodRun:
    """Return a method set up for the start of a scene.

    Raises
    ------
    BadScene
        The method's formulation cannot start there; nothing nutates.
    MissingPackage
        A method whose package is not installed.
    """
    wants = Scene(scene.top, scene.start, periods=1, quantities=("theta",), events=(), samples=2,
                  digits=10, name=scene.name)  # fmt: skip
    chosen = plan(wants, method.formulation, projected=method.projected)
    tolerance = EPSILON if method.is_rival or method.bits > DOUBLE else method.setting
    chosen = replace(chosen, precision=named(method.bits), tolerance=tolerance)
    parameters, start = binary_start(scene, chosen)
    digits = max(REFERENCE_DIGITS, digits_of(method.bits) + REFERENCE_SPARE_DIGITS)
    ctx = context(digits)
    state, values = (map(ctx.mpf, as_stored(x)) for x in (start.state, parameters.values()))
    constants = dict(zip(parameters, values, strict=True))
    exact = ClosedForm(motion_of(chosen, digits, [*state], constants))
    if exact.period is None:  # the scene's own start nutates, but its rounded one does not
        rounded = f"as it is rounded here, nothing nutates ({REFERENCE_DIGITS} digits)"
        rule = f"so close to a pole that, {rounded}"
        raise BadScene((Fault(scene.name, None, "start.theta", str(scene.start.theta), rule),))
    if method.is_rival:
        stepper = make_stepper(method, problem_of(scene, chosen, exact.period))
    else:
        taylor, far = integrator_of(chosen, parameters, start), FARTHEST_PERIODS * exact.period
        stepper = TaylorStepper(
            start=as_stored(start.state), compile_s=taylor.engine.compile_s, taylor=taylor, far=far
        )
    first, body = stepper.start, stepper.form
    reference = ReferenceSolution(chosen.equations, constants, exact, ctx, first, body)
    return MethodRun(stepper, reference, exact.period)


def measured_order(scene: Scene, method: MethodEntry) -> float | None:
    """Return the order of a method of fixed steps, by how its error falls with their number.

    The start of a scene is followed for a sixteenth of a nutation period.
    """
    errors = {}
    for steps in ORDER_STEPS:
        with suppress(IntegrationFailed, HeavyTopError):
            short = replace(method, setting=steps, block=math.ceil(steps * ORDER_PERIODS))
            [off], _, _ = advance(set_up(scene, short), [ORDER_PERIODS])
            errors[steps] = off.axis or abs(off.theta)
    return order_of(errors)


class TooSlow(IntegrationFailed):
    """A run that was stopped between two blocks."""


def advance(
    run: MethodRun, periods: Sequence[float], limit: float = math.inf
) -> tuple[list[StateError], StepperState, float]:
    """Return errors at times [nutation periods], the state after the last block, and seconds."""
    times, errors = [run.stepper.output_time(n * run.period) for n in periods], list[StateError]()
    for before, last, seconds in walk(run, periods[-1], limit):  # noqa: B007
        here = [t for t in times[len(errors) :] if t <= last.time]
        rows = run.stepper.states_at(before, here).tolist() if here else ()
        errors += map(run.reference, here, rows)
    return errors, last, seconds


def walk(
    run: MethodRun, periods: float, limit: float = math.inf
) -> Iterator[tuple[StepperState, StepperState, float]]:
    """Take a run to a time [nutation periods]; yield start and end of each block, seconds so far.

    Raises
    ------
    TooSlow
        It is not there after `limit` seconds.
    IntegrationFailed
        It cannot go on.
    """
    end, after = run.stepper.output_time(periods * run.period), run.stepper.begin()
    seconds = 0.0
    while after.time < end:  # double-doubles compare as their words do
        if seconds > limit:
            raise TooSlow(f"stopped at t = {after.time[0]:.3g} s after {seconds:.3g} s")
        before, began = after, clock()
        after = run.stepper.block(before)
        seconds += clock() - began
        yield before, after, seconds


def problem_of(scene: Scene, chosen: Plan, span: float) -> InitialValueProblem:
    """Return the problem of a scene's binary start; `span` gives direction and period."""
    parameters, start = binary_start(scene, chosen)
    state, direction = tuple(start.state.tolist()), 1 if span >= 0 else -1
    top = TopConstants(*(float(x) for x in (scene.top.A, scene.top.C, scene.top.gMR)))
    return InitialValueProblem(chosen.equations, parameters, state, direction, abs(span), top)


# --- the Taylor integrator as a stepper ------------------------------------------------------


@dataclass(frozen=True, eq=False, kw_only=True)
class TaylorStepper(Stepper):
    """The Taylor integrator, with the very blocks of steps of a trajectory.

    Attributes
    ----------
    taylor : Integrator
    far : float
        A time that no step reaches [s].
    """

    taylor: Integrator
    far: float
    carried: int = 2

    def block(self, at: StepperState) -> StepperState:
        """Take a block of natural steps, as `Stepper` says."""
        block = self._block(at)
        if block.singular:
            raise IntegrationFailed(f"singular, or overflow, after {block.end.steps} steps")
        end = block.end
        (high, low), first = end.time, float(end.time[0])
        time = first, float(high - self.taylor.engine.number(first) + low)
        return StepperState(time, as_stored(end.state), as_stored(end.time), end.steps, end.steps)

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times in the block after a state, as `as_stored` has them."""
        number = self.taylor.engine.number
        wanted = np.array([number(high) + number(low) for high, low in times])
        return np.array([as_stored(row) for row in self._block(at, wanted).samples.states])

    def _block(self, at: StepperState, samples: Array = NEVER) -> Block:
        """Return the block of steps from a state."""
        number = self.taylor.engine.number
        high, low = map(number, at.carry)
        start = Checkpoint((high, low), np.array([number(x) for x in at.state]), at.steps)
        return self.taylor.block(start, start.block_steps, self.far, samples)


def as_stored(numbers: Iterable[Any]) -> tuple[Any, ...]:
    """Return numbers for JSON, without loss: doubles as they are, others as texts."""
    return tuple(float(x) if precision(x) == DOUBLE else text(x) for x in numbers)


# --- the reference solution ------------------------------------------------------------------


class StateError(NamedTuple):
    """The error of a state, with its sign; None where the formulation does not determine it.

    Attributes
    ----------
    energy : float
        Of E', relative to max(|E'|, gMR).
    invariants : dict from str to float
        Of the formulation's other invariants, relative to their start: p_phi, p_psi, length.
    phase_s : float
        How far the nutation runs ahead [s].
    theta : float
        Of the tilt [rad].
    axis : float or None
        Distance of the axis, a unit vector, from the exact one.
    """

    energy: float
    invariants: dict[str, float]
    phase_s: float
    theta: float
    axis: float | None


def time_shift(du: Any, dudot: Any, exact: Any, frequency: Any) -> Any:
    """Return the shift in time that best explains errors du and dudot of a state [s]."""
    weight = exact.udot**2 + (exact.uddot / frequency) ** 2
    return (du * exact.udot + dudot * exact.uddot / frequency**2) / weight


@dataclass(frozen=True)
class ReferenceSolution:
    """The exact motion with which the states of one run are compared.

    Parameters
    ----------
    formulation : Formulation
    parameters : mapping from str to number
        The run's own constants, by symbol name.
    exact : ClosedForm
        Of the run's own start.
    ctx : Context
        The numbers it computes in, of more digits than the run's have.
    start : sequence of float or str
        The state at the start.
    body : BodyForm or None
        The form whose states the rows are, where they are not those of the formulation.
    """

    formulation: Formulation
    parameters: Mapping[str, Any]
    exact: ClosedForm
    ctx: Context
    start: Sequence[Any]
    body: BodyForm | None = None

    def __call__(self, t: DoubleDouble, row: Sequence[Any]) -> StateError:
        """Return the error of a state at a time [s]; the row is laid out as the start."""
        u, udot, values, axis = self._observed(row)
        exact, (first, size) = self.exact.at(sum(map(self.ctx.mpf, t)), self.ctx.dps), self._first
        off = {name: float((x - first[name]) / size[name]) for name, x in values.items()}
        frequency = 2 * self.ctx.pi / self.exact.mpf("period", self.ctx.dps)
        phase = float(time_shift(u - exact.u, udot - exact.udot, exact, frequency))
        offset = [x - y for x, y in zip(axis, exact.axis if axis else (), strict=True)]
        distance = float(self.ctx.norm(offset)) if axis else None
        tilt = self.ctx.acos(min(max(u, -self.ctx.one), self.ctx.one)) - exact.theta
        return StateError(off.pop("energy"), off, phase, float(tilt), distance)

    @cached_property
    def _first(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """The invariants at the start, and what their errors are relative to."""
        first = self._observed(self.start)[2]
        energy = max(abs(first["energy"]), abs(self.exact.reduced.g))
        momenta = {name: abs(x) for name, x in first.items() if name.startswith("p_")}
        rate = max(self.ctx.sqrt(energy), 0, *momenta.values())
        sizes = {n: x if x > CLOSE_ROTATION * rate else rate for n, x in momenta.items()}
        return first, dict.fromkeys(first, self.ctx.one) | sizes | {"energy": energy}

    def _observed(self, row: Sequence[Any]) -> tuple[Any, Any, dict[str, Any], list[Any]]:
        """Return u, udot, the invariants, and the unit vector of the axis where states give it."""
        names: Sequence[str] = OBSERVED if self.body else [*self.formulation.invariants]
        u, udot, *others = self._observe([self.ctx.mpf(x) for x in row])
        values, axis = dict(zip(names, others, strict=False)), others[len(names) :]
        if axis:
            size = self.ctx.norm(axis)  # 1 within the error of the method, which `length` measures
            _, _, u = axis = [component / size for component in axis]
            udot /= size
        return u, udot, values, axis

    @cached_property
    def _observe(self) -> Callable[[Sequence[Any]], Sequence[Any]]:
        """The function from a row to u, udot, the invariants, and the axis if the row has it."""
        form, ctx, body = self.formulation, self.ctx, self.body
        if body:
            return lambda row: body.observe(row, ctx.sqrt)
        given = [p for p in (*form.parameters, *form.given) if p.name in self.parameters]
        functions = {name: getattr(ctx, name) for name in ("sin", "cos", "sqrt", "atan2")}
        function = observables(form, given, ctx.mpf, functions)
        constants = [self.parameters[p.name] for p in given]
        return lambda row: function(*row, *constants)
