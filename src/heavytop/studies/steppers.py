"""The runs of all studies: any method set up for one start, with its reference solution.

That is the closed form of the run's own binary start, at 40 digits. States are compared with it as
the exact numbers they are, so that the difference is the error of the run and not of the
comparison. A number of more than 53 bits is stored as the decimal text by which every bit of it
comes back.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Final

import numpy as np

from heavytop.analytic.motion import ClosedForm
from heavytop.classification.reduced import ReducedMotion
from heavytop.comparison.methods import MethodEntry, make_stepper
from heavytop.comparison.own_steps import OBSERVED, BodyForm
from heavytop.comparison.steppers import (
    InitialValueProblem,
    IntegrationFailed,
    Stepper,
    StepperState,
    TopConstants,
)
from heavytop.equations.formulation import Formulation
from heavytop.equations.gradients import observed
from heavytop.errors import BadScene, Fault, HeavyTopError
from heavytop.exact.decimals import Context, context
from heavytop.exact.pairs import EPSILON, Array, DoubleDouble
from heavytop.integration.bits import DOUBLE, digits_of, named, precision
from heavytop.integration.blocks import Block, Checkpoint, Integrator
from heavytop.integration.engine import NEVER, text
from heavytop.results.drift import order_of
from heavytop.run.own_motion import motion_of
from heavytop.run.planning import plan
from heavytop.run.start import binary_start, integrator_of
from heavytop.run.verify import ahead
from heavytop.scene.scene import Scene
from heavytop.scene.top import Top

REFERENCE_DIGITS: Final = 40  # of the reference solution
EVEN_AXIS: Final = 0.7  # of |z|, above which x and y determine it better
# of texts and of the reference, beyond those of the run's numbers
REFERENCE_SPARE_DIGITS: Final = 12
CLOSE_ROTATION: Final = 1e-12  # as the distance of a rotation from one, at the start
FARTHEST_PERIODS: Final = 1e6  # periods: no step is that long
ORDER_STEPS: Final = tuple(12.5 * 2**k for k in range(13))  # a period
ORDER_PERIODS: Final = 0.0618  # so that spinning tops need no more

# --- one method from one start ---------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class MethodRun:
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
    known, digits = parameters, REFERENCE_DIGITS
    if method.bits > DOUBLE:
        known = {name: text(x) for name, x in parameters.items()}
        digits = max(REFERENCE_DIGITS, digits_of(method.bits) + REFERENCE_SPARE_DIGITS)
    numbers, own = as_stored(start.state), partial(motion_of, chosen)
    reference = ReferenceSolution(chosen.equations, known, numbers, own, digits)
    period = reference.period
    if period is None:  # the scene's own start nutates, but its rounded one does not
        rounded = f"as it is rounded here, nothing nutates ({REFERENCE_DIGITS} digits)"
        rule = f"so close to a pole that, {rounded}"
        theta = str(scene.start.theta)
        raise BadScene((Fault(scene.name, None, "start.theta", theta, rule),))
    if not method.is_rival:
        taylor = integrator_of(chosen, parameters, start)
        stepper = TaylorStepper(taylor, start, FARTHEST_PERIODS * period)
        return MethodRun(stepper, reference, period)
    state, top = tuple(start.state.tolist()), top_constants(scene.top)
    problem = InitialValueProblem(chosen.equations, parameters, state, period=period, top=top)
    taken = make_stepper(method, problem)
    body = getattr(taken, "form", None)
    if body is not None:
        reference = replace(reference, body=body, first_row=taken.begin().state)
    return MethodRun(taken, reference, period)


def measured_order(scene: Scene, method: MethodEntry) -> float | None:
    """Return the order of a method of fixed steps, by how its error falls with their number.

    The start of a scene is followed for a sixteenth of a nutation period.
    """
    errors = {}
    for steps in ORDER_STEPS:
        with suppress(IntegrationFailed, HeavyTopError):
            found = set_up(scene, replace(method, setting=steps))
            end = found.stepper.output_time(ORDER_PERIODS * found.period)
            before, _, _ = walk(found.stepper, end)
            row = found.stepper.states_at(before, [end])[0].tolist()
            errors[steps] = found.reference(end, row).axis or abs(found.reference.tilt(end, row))
    return order_of(errors)


class TooSlow(IntegrationFailed):
    """A run that was stopped between two blocks."""


def walk(
    stepper: Stepper,
    end: DoubleDouble,
    limit: float = math.inf,
    clock: Callable[[], float] = time.perf_counter,
) -> tuple[StepperState, StepperState, float]:
    """Go from the start past a time: where the last block began and ended, seconds in blocks.

    Raises
    ------
    TooSlow
        It is not there yet after so many seconds.
    IntegrationFailed
        It cannot go on.
    """
    after, seconds = stepper.begin(), 0.0
    while True:
        before, began = after, clock()
        after = stepper.block(before)
        seconds += clock() - began
        if after.time >= end:  # double-doubles compare as their words do
            return before, after, seconds
        if seconds > limit:
            raise TooSlow(f"stopped at t = {after.time[0]:.3g} s after {seconds:.3g} s")


def top_constants(top: Top) -> TopConstants:
    """Return what a method of one's own may read of a top."""
    return TopConstants(float(top.A), float(top.C), float(top.gMR))


# --- the Taylor integrator as a stepper ------------------------------------------------------


@dataclass(frozen=True, eq=False)
class TaylorStepper:
    """The Taylor integrator, with the very blocks of steps of a trajectory.

    Attributes
    ----------
    engine : Integrator
    start : Checkpoint
    far : float
        A time that no step reaches [s].
    """

    engine: Integrator
    start: Checkpoint
    far: float

    def begin(self) -> StepperState:
        """Return the start."""
        return self._state(self.start)

    def block(self, at: StepperState) -> StepperState:
        """Take a block of natural steps, as `Stepper` says."""
        done = self._block(at)
        if done.singular or done.end.steps == at.steps:
            raise IntegrationFailed(f"singular, or overflow, after {done.end.steps} steps")
        return self._state(done.end)

    def states_at(self, at: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times in the block after a state, as `as_stored` has them."""
        number = self.engine.engine.number
        wanted = np.array([number(high) + number(low) for high, low in times])
        return np.array([as_stored(row) for row in self._block(at, wanted).samples.states])

    def output_time(self, t: float) -> DoubleDouble:
        """Return the time itself."""
        return (t, 0.0)

    def _block(self, at: StepperState, samples: Array = NEVER) -> Block:
        number = self.engine.engine.number
        high, low = map(number, at.carry)
        start = Checkpoint((high, low), np.array([number(x) for x in at.state]), at.steps)
        return self.engine.block(start, start.block_steps, self.far, samples)

    def _state(self, at: Checkpoint) -> StepperState:
        (high, low), first = at.time, float(at.time[0])
        time = first, float(high - self.engine.engine.number(first) + low)
        return StepperState(time, as_stored(at.state), as_stored(at.time), at.steps, at.steps)


def as_stored(numbers: Iterable[Any]) -> tuple[Any, ...]:
    """Return numbers for JSON, without loss: doubles, and texts of more bits than those have."""
    return tuple(float(x) if precision(x) == DOUBLE else text(x) for x in numbers)


# --- the reference solution ------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class StateError:
    """The error of a state, with its sign; None where the formulation does not determine it.

    Attributes
    ----------
    energy : float
        Of E', relative to max(|E'|, gMR).
    invariants : dict from str to float
        Of the formulation's other invariants, relative to their start: p_phi, p_psi, length.
    phase_s : float
        How far the nutation runs ahead [s].
    axis : float or None
        Distance of the axis, a unit vector, from the exact one.
    """

    energy: float
    invariants: dict[str, float]
    phase_s: float
    axis: float | None


@dataclass(frozen=True)
class ReferenceSolution:
    """What the states of one run are compared with.

    Parameters
    ----------
    formulation : Formulation
    parameters : mapping from str to number
        The run's own constants, by symbol name: floats, or decimal texts.
    start : sequence of float or str
        The run's own states at the start.
    own : callable
        From a number of digits, the states and the parameters to the motion they define.
    body : BodyForm or None
        What observes rows that are not states of the formulation.
    first_row : tuple of float
        The first of such rows.
    digits : int
        More than the run's numbers have.
    """

    formulation: Formulation
    parameters: Mapping[str, Any]
    start: tuple[Any, ...]
    own: Callable[[int, Sequence[Any], Mapping[str, Any]], ReducedMotion]
    digits: int = REFERENCE_DIGITS
    body: BodyForm | None = None
    first_row: tuple[float, ...] = ()

    @property
    def period(self) -> float | None:
        """T [s] of the run's own motion; None where nothing nutates."""
        period: float | None = self.exact.period
        return period

    @cached_property
    def ctx(self) -> Context:
        """The numbers it computes in."""
        return context(self.digits)

    @cached_property
    def exact(self) -> ClosedForm:
        """The closed form of the run's own start."""
        values = {name: self.ctx.mpf(x) for name, x in self.parameters.items()}
        source = self.own(self.digits, [*map(self.ctx.mpf, self.start)], values)
        return ClosedForm(source)

    def __call__(self, t: DoubleDouble, row: Sequence[Any]) -> StateError:
        """Return the error of a state at a time [s]; the row is laid out as the start."""
        u, udot, values, axis = self._observed(row)
        exact, first = self._exact(t), self._first
        change = {name: values[name] - first[name] for name in values}
        scale = max(abs(first["energy"]), abs(self.exact.reduced.g)) or 1
        energy = change.pop("energy") / scale
        frequency = 2 * self.ctx.pi / self.exact.mpf("period", self.digits)
        return StateError(
            energy=float(energy),
            invariants={name: float(x / self._size(name)) for name, x in change.items()},
            phase_s=float(ahead(u - exact.u, udot - exact.udot, exact, frequency)),
            axis=float(self.ctx.norm([x - y for x, y in zip(axis, exact.axis, strict=True)]))
            if axis
            else None,
        )

    def tilt(self, t: DoubleDouble, row: Sequence[Any]) -> float:
        """Return the error of theta at a time [rad]; the row is laid out as the start."""
        u = min(max(self._observed(row)[0], -self.ctx.one), self.ctx.one)
        return float(self.ctx.acos(u) - self._exact(t).theta)

    def _exact(self, t: DoubleDouble) -> Any:
        return self.exact.at(self.ctx.mpf(t[0]) + self.ctx.mpf(t[1]), self.digits)

    def _size(self, name: str) -> Any:
        """What an invariant is measured by: its start, unless that is rounding alone."""
        return first if (first := abs(self._first[name])) > CLOSE_ROTATION else 1

    @cached_property
    def _first(self) -> dict[str, Any]:
        """The invariants at the start."""
        return self._observed(self.first_row or self.start)[2]

    def _observed(self, row: Sequence[Any]) -> tuple[Any, Any, dict[str, Any], list[Any]]:
        """u, udot, the invariants, and the direction of the axis where the states give it."""
        states = [self.ctx.mpf(x) for x in row]
        if self.body is not None:
            names: tuple[str, ...] = OBSERVED
            u, udot, *others = self.body.observe(states, self.ctx.sqrt)
        else:
            names = (*self.formulation.invariants,)
            u, udot, *others = self._function(*states)
        values, axis = dict(zip(names, others, strict=False)), others[len(names) :]
        if not axis:
            return u, udot, values, axis
        size = self.ctx.norm(axis)  # 1 within the error of the method, which `length` measures
        x, y, z = axis = [component / size for component in axis]
        if abs(z) >= EVEN_AXIS:  # z has lost the digits of 1 - |z|
            z = self.ctx.sign(z) * self.ctx.sqrt(1 - x * x - y * y)
        return z, udot / size, values, axis

    @cached_property
    def _function(self) -> Callable[..., Sequence[Any]]:
        """What is observed, as a function of the states alone."""
        form, ctx = self.formulation, self.ctx
        given = [p for p in (*form.parameters, *form.given) if p.name in self.parameters]
        names = ("sin", "cos", "sqrt", "atan2")
        function = observed(form, given, ctx.mpf, {name: getattr(ctx, name) for name in names})
        constants = [ctx.mpf(self.parameters[p.name]) for p in given]
        return lambda *states: function(*states, *constants)
