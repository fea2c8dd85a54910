"""The reference solution of a run: the closed form of the run's own binary start, at 40 digits.

States are compared with it as the exact numbers they are, so that the difference is the error of
the run and not of the comparison.
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
EVEN = 0.7  # of |z|, above which x and y determine it better


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

    def __call__(self, t: DoubleDouble, row: Sequence[float]) -> StateError:
        """Return the error of a state at a time [s]; the row is laid out as the start."""
        u, udot, values, axis = self._observed(row)
        exact, first = self._exact(t), self._first
        change = {name: values[name] - first[name] for name in values}
        scale = max(abs(first["energy"]), abs(self.truth.reduced.g)) or 1
        energy = change.pop("energy") / scale
        frequency = 2 * self.ctx.pi / self.truth.period
        return StateError(
            energy=float(energy),
            invariants={name: float(x / (abs(first[name]) or 1)) for name, x in change.items()},
            phase_s=float(ahead(u - exact.u, udot - exact.udot, exact, frequency)),
            axis=float(self.ctx.norm([x - y for x, y in zip(axis, exact.axis, strict=True)]))
            if axis
            else None,
        )

    def tilt(self, t: DoubleDouble, row: Sequence[float]) -> float:
        """Return the error of theta at a time [rad]; the row is laid out as the start."""
        u = min(max(self._observed(row)[0], -self.ctx.one), self.ctx.one)
        return float(self.ctx.acos(u) - self._exact(t).theta)

    def _exact(self, t: DoubleDouble) -> Any:
        return self.truth(self.ctx.mpf(t[0]) + self.ctx.mpf(t[1]))

    def _states(self, row: Sequence[float]) -> list[Any]:
        n = len(self.formulation.states)
        return [self.ctx.fsum(row[i::n]) for i in range(n)]

    @cached_property
    def _first(self) -> dict[str, Any]:
        """The invariants at the start."""
        return self._observed(self.start)[2]

    def _observed(self, row: Sequence[float]) -> tuple[Any, Any, dict[str, Any], list[Any]]:
        """u, udot, the invariants, and the direction of the axis where the states give it."""
        names = self.formulation.invariants
        u, udot, *others = self._function(*self._states(row))
        values, axis = dict(zip(names, others, strict=False)), others[len(names) :]
        if not axis:
            return u, udot, values, axis
        size = self.ctx.norm(axis)  # 1 within the error of the method, which `length` measures
        x, y, z = axis = [component / size for component in axis]
        if abs(z) >= EVEN:  # z has lost the digits of 1 - |z|
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
