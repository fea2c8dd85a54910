"""Projection of the state onto the invariants of the start, every few steps.

Rounding lets invariants, and with them frequencies, wander: the phase error grows as the 3/2 power
of the time. With projection invariants only shake about their values, and it grows as the square
root. A block is made of legs of a fixed number of steps, each followed by a projection; samples and
events are read off the steps before it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from heavytop.equations.formulation import Formulation, invariants_of, why_not
from heavytop.exact.pairs import EPSILON, Array, long_epsilon
from heavytop.integration.engine import per_thread
from heavytop.integration.system import hy, translate

ROOM = 260  # steps times states in a leg: steps take longer the more states there are
LONG_DOUBLE = int(np.finfo(np.longdouble).nmant) + 1  # bits, on this machine
EVEN_STEPS = 0.12  # by which share the longest step of a leg is shorter than the mean of the first
GOLDEN = (math.sqrt(5) - 1) / 2  # its multiples, less the whole numbers, are never close again


class Projection:
    """The map from a state to the nearest one with the invariants of the start, to first order.

    Residuals are smaller than the last digit of a double. They are formed in long double, relative
    to the values at the run's own start: formed in double they would be rounded in the same way
    each time, and hold the invariants at values that are slightly wrong. States and constants are
    in the run's unit of time: in seconds l·e of a very fast top would be corrected by the axis
    alone, to the rounding of l.

    Parameters
    ----------
    formulation : Formulation
    fixed : ndarray
        The constants in the invariants; the invariants at the start; and for each invariant the
        square of a gradient, less its part along those before, below which it is left alone: the
        rounding of its residual would move the state by more than the state's own rounding.

    Attributes
    ----------
    stride : int
        Steps in a leg.
    inside, outside : ndarray of long double
        Input of the compiled function, a state and `fixed`, and its output, the projected state and
        its invariants before projection.
    """

    def __init__(self, formulation: Formulation, fixed: Any) -> None:
        width, count = len(formulation.states), len(formulation.invariants)
        self.stride, self._nearest = max(1, ROOM // width), _compile(formulation)
        self.inside: Any = np.concatenate((np.zeros(width), fixed)).astype(np.longdouble)
        self.outside: Any = np.zeros(width + count, np.longdouble)
        self.fixed, self._state = self.inside[width:], self.inside[:width]
        self._projected = self.outside[:width]

    @classmethod
    def of(cls, form: Formulation, parameters: Mapping[str, float], start: Array) -> Projection:
        """Return the projection for the run that starts from a state, shape (n,).

        Raises
        ------
        ValueError
            The formulation has no invariant; long double has no more digits than double.
        """
        if reason := why_not(form):
            raise ValueError(reason)
        found = invariants_of(form)
        constants = [parameters[p.name] for p in found.constants]
        scale = max(1.0, float(np.max(np.abs(start))))  # as the integrator's tolerance has it
        sizes = np.array(found.sizes(*start.tolist(), *constants), dtype=float)
        floors = (long_epsilon() / EPSILON * sizes / scale) ** 2
        made = cls(form, np.concatenate((constants, np.zeros(sizes.size), floors)))
        made(start)
        made.fixed[len(constants) : len(constants) + sizes.size] = made.outside[start.size :]
        return made

    def longest(self, mean: float, legs: int, longest: float | None) -> float:
        """Return the longest step of a leg, after so many legs; `mean` is the mean of the first.

        Natural steps may fall into a cycle, the same points period after period, rounded in the
        same way each time, and then a random walk becomes a drift. Steps that are no longer than
        the mean of the first leg, with another bound in every leg, do not.
        """
        bound = mean * (1 - EVEN_STEPS * (legs * GOLDEN % 1))
        return bound if longest is None else min(bound, longest)

    def __call__(self, state: Array) -> Array:
        """Return the projected state, shape (n,): one Gauss-Newton step of least norm."""
        self._state[:] = state
        self._nearest(self.inside, outputs=self.outside)
        return np.asarray(self._projected, float)


@per_thread
def _compile(formulation: Formulation) -> Any:
    """Compile x - J^+ (I(x) - target) and I(x), all of it in long double.

    `fixed` is handed over like the states: with parameters a call of heyoka takes twice as long.
    """
    found = invariants_of(formulation)
    names = {s.name: hy.expression(s.name) for s in (*found.states, *found.constants)}
    states = [names[s.name] for s in found.states]
    values = translate(found.values, names, LONG_DOUBLE)
    slopes = [translate(row, names, LONG_DOUBLE) for row in found.slopes]
    targets = [hy.expression(f"target_{i}") for i in range(len(values))]
    floors = [hy.expression(f"floor_{i}") for i in range(len(values))]
    off = [value - target for value, target in zip(values, targets, strict=True)]
    projected = [x - change for x, change in zip(states, _solve(slopes, off, floors), strict=True)]
    inputs = [*names.values(), *targets, *floors]
    return hy.cfunc([*projected, *values], inputs, fp_type=np.longdouble)


def _solve(rows: Sequence[Sequence[Any]], sides: Sequence[Any], floors: Sequence[Any]) -> list[Any]:
    """Return the least x with rows . x = sides, by Gram-Schmidt; dependent rows are left out."""
    zero, one = hy.expression(0.0), hy.expression(1.0)
    least = [zero] * len(rows[0])
    found: list[tuple[list[Any], Any, Any]] = []
    for row, side, floor in zip(map(list, rows), sides, floors, strict=True):
        for across, reciprocal, length in found:
            part = _dot(row, across) * reciprocal
            row = [a - part * b for a, b in zip(row, across, strict=True)]
            side = side - part * length
        square = _dot(row, row)
        reciprocal = hy.select(hy.gt(square, floor), one / square, zero)
        found.append((row, reciprocal, side))
        least = [a + side * reciprocal * b for a, b in zip(least, row, strict=True)]
    return least


def _dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return the scalar product of two vectors of expressions."""
    return sum((x * y for x, y in zip(a, b, strict=True)), hy.expression(0.0))
