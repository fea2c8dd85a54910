"""Projection onto the invariants: what the exact flow conserves is put back every few steps.

Rounding lets the invariants wander, and with them the frequencies; phase, their integral, is lost
as the 3/2 power of the time. Put back again and again the invariants only shake about their
values, and phase is left with its own rounding: it is lost as the square root of the time.

The residuals are smaller than the last digit of a double. They are therefore formed in long
double, against targets from the run's own start. Formed in double they would be rounded the same
way each time, and hold the invariants as firmly to values that are slightly wrong.

States and constants are those of the unit of time in which steps are taken: l.e of a very fast top
would else be put right by the axis alone, to the rounding of l.

A block of steps is made of legs, each followed by a projection. Every leg measures time from its
own start and takes a fixed number of natural steps, so the same start gives the same bits however
a block is sampled; samples and events are read off the polynomials of the steps, before the
projection that follows. Natural steps depend on where they begin, and so they may fall into a
cycle: the same points period after period, rounded the same way each time, and what should be a
random walk is a drift. Steps that are no longer than the mean of those of the first leg, and in no
two legs of the same length, do not.
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

ROOM = 260  # states in a leg: steps take longer the more they have
LONG_DOUBLE = int(np.finfo(np.longdouble).nmant) + 1  # bits, on this machine
# how much shorter than the mean of the first leg the longest steps of a leg may be
EVEN_STEPS = 0.12
GOLDEN = (math.sqrt(5) - 1) / 2  # its multiples, less the whole numbers, are never close again


class Projection:
    """The nearest state with the invariants of the start, to first order.

    Parameters
    ----------
    formulation : Formulation
    fixed : ndarray
        The constants that occur in the invariants; their values at the start; the squares of the
        slopes, beyond those of the invariants before, below which an invariant is left alone:
        the rounding of its residual would move the state by more than the state's own.

    Attributes
    ----------
    stride : int
        Steps in a leg.
    inside, outside : ndarray of long double
        Room for what goes in, a state and what is fixed, and for what comes out: the projected
        state and the invariants.
    """

    def __init__(self, formulation: Formulation, fixed: Any) -> None:
        width, count = len(formulation.states), len(formulation.invariants)
        self.stride, self._nearest = max(1, ROOM // width), _compile(formulation)
        self.inside: Any = np.concatenate((np.zeros(width), fixed)).astype(np.longdouble)
        self.outside: Any = np.zeros(width + count, np.longdouble)
        self.fixed, self._given = self.inside[width:], self.inside[:width]
        self._found = self.outside[:width]

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
        """Return the longest step of a leg, after so many legs; `mean` is that of the first."""
        bound = mean * (1 - EVEN_STEPS * (legs * GOLDEN % 1))
        return bound if longest is None else min(bound, longest)

    def __call__(self, state: Array) -> Array:
        """Return the projected state, shape (n,): one Gauss-Newton step of least norm."""
        self._given[:] = state
        self._nearest(self.inside, outputs=self.outside)
        return np.asarray(self._found, float)


@per_thread
def _compile(formulation: Formulation) -> Any:
    """Compile x - J^+ (I(x) - target) and I(x), all of it in long double.

    What is fixed is handed over like the states: heyoka takes as long again for parameters.
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
    return sum((x * y for x, y in zip(a, b, strict=True)), hy.expression(0.0))
