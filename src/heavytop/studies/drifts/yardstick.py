"""The yardstick of a run: the closed form of the run's own binary start, at forty digits.

States are held against it as the exact numbers they are, so that what is measured is the run's
error and not that of measuring it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.rising import Rising
from heavytop.classification.reduced import MotionSource
from heavytop.equations.formulation import Formulation
from heavytop.equations.gradients import observed
from heavytop.numbers.decimals import Context, context
from heavytop.numbers.double_double import DoubleDouble
from heavytop.run.verify import ahead

DIGITS = 40
EVEN = 0.7  # of |z|, above which x and y say more about it


@dataclass(frozen=True, slots=True)
class Off:
    """How far a state is off, with its sign; None where the formulation does not say.

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
class Yardstick:
    """What the states of one run are held against.

    Parameters
    ----------
    formulation : Formulation
    parameters : mapping from str to number
        The run's own constants, by symbol name: floats, or decimal texts.
    start : sequence of float
        The run's own start: its states, then the low words of each, if there are any.
    own : callable
        From a number of digits, the states and the parameters to the motion they define.
    digits : int
        More than the run's numbers have.
    """

    formulation: Formulation
    parameters: Mapping[str, Any]
    start: tuple[float, ...]
    own: Callable[[int, Sequence[Any], Mapping[str, Any]], MotionSource]
    digits: int = DIGITS

    @property
    def period(self) -> float | None:
        """T [s] of the run's own motion; None where nothing nutates."""
        period = self.truth.period
        return None if period is None else float(period)

    @cached_property
    def ctx(self) -> Context:
        """The numbers it computes in."""
        return context(self.digits)

    @cached_property
    def truth(self) -> ClosedForm:
        """The closed form of the run's own start."""
        values = {name: self.ctx.mpf(x) for name, x in self.parameters.items()}
        source = self.own(self.digits, self._states(self.start), values)
        return ClosedForm(Rising(source, proved=False), self.digits)

    def __call__(self, t: DoubleDouble, row: Sequence[float]) -> Off:
        """Return how far a state is off at a time [s]; the row is laid out as the start."""
        u, udot, values, axis = self._read(self._states(row))
        exact = self.truth(self.ctx.mpf(t[0]) + self.ctx.mpf(t[1]))
        first, frequency = self._first, 2 * self.ctx.pi / self.truth.period
        change = {name: values[name] - first[name] for name in values}
        energy = change.pop("energy") / self._energy_scale
        sizes = {name: abs(first[name]) or 1 for name in change}
        return Off(
            energy=float(energy),
            invariants={name: float(x / sizes[name]) for name, x in change.items()},
            phase_s=float(ahead(u - exact.u, udot - exact.udot, exact, frequency)),
            axis=None if axis is None else float(self._apart(axis, exact.axis)),
        )

    def tilt(self, t: DoubleDouble, row: Sequence[float]) -> float:
        """Return how far theta is off at a time [rad]; the row is laid out as the start."""
        u = min(max(self._read(self._states(row))[0], -self.ctx.one), self.ctx.one)
        exact = self.truth(self.ctx.mpf(t[0]) + self.ctx.mpf(t[1]))
        return float(self.ctx.acos(u) - exact.theta)

    def _apart(self, axis: Sequence[Any], exact: Sequence[Any]) -> Any:
        return self.ctx.norm([x - y for x, y in zip(axis, exact, strict=True)])

    @cached_property
    def _first(self) -> dict[str, Any]:
        return self._read(self._states(self.start))[2]

    @cached_property
    def _energy_scale(self) -> Any:
        return max(abs(self._first["energy"]), abs(self.truth.reduced.g)) or 1

    def _states(self, row: Sequence[float]) -> list[Any]:
        n = len(self.formulation.states)
        return [self.ctx.fsum(row[i::n]) for i in range(n)]

    def _read(self, states: Sequence[Any]) -> tuple[Any, Any, dict[str, Any], Any]:
        """Return u, udot, the invariants and the direction of the axis."""
        u, udot, values, axis = self._raw(states)
        if not axis:
            return u, udot, values, None
        size = self.ctx.norm(axis)  # 1 within the method's error, which stands under `length`
        x, y, z = (component / size for component in axis)
        return self._height(x, y, z), udot / size, values, (x, y, z)

    def _height(self, x: Any, y: Any, z: Any) -> Any:
        """Return z, near a pole from x and y: there it has lost the digits of 1 - |z|."""
        if abs(z) < EVEN:
            return z
        return self.ctx.sign(z) * self.ctx.sqrt(1 - x * x - y * y)

    def _raw(self, states: Sequence[Any]) -> tuple[Any, Any, dict[str, Any], list[Any]]:
        found = iter(self._function(*states, *self._constants))
        u, udot = next(found), next(found)
        return u, udot, {name: next(found) for name in self.formulation.invariants}, list(found)

    @cached_property
    def _constants(self) -> list[Any]:
        return [self.ctx.mpf(self.parameters[p.name]) for p in self._symbols]

    @property
    def _symbols(self) -> tuple[Any, ...]:
        form = self.formulation
        return tuple(p for p in (*form.parameters, *form.given) if p.name in self.parameters)

    @cached_property
    def _function(self) -> Callable[..., Sequence[Any]]:
        form, ctx = self.formulation, self.ctx
        functions = {"sin": ctx.sin, "cos": ctx.cos, "sqrt": ctx.sqrt, "atan2": ctx.atan2}
        return observed(form, self._symbols, ctx.mpf, functions)
