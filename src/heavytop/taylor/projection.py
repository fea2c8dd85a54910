"""Projection onto the invariants: what the exact flow conserves is put back every few steps.

Rounding lets the invariants wander, and with them the frequencies; phase, their integral, is lost
as the 3/2 power of the time. Put back again and again the invariants only shake about their
values, and phase is left with its own rounding: it is lost as the square root of the time.

The residuals are smaller than the last digit of a double. They are therefore formed in long
double, against targets from the run's own start. Formed in double they would be rounded the same
way each time, and hold the invariants as firmly to values that are slightly wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from operator import mul
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.models.formulation import Formulation
from heavytop.models.invariants import Invariants, invariants_of

Array = NDArray[np.float64]

DOUBLE = float(np.finfo(float).eps)


def extended() -> float:
    """Return the relative spacing of long doubles on this machine."""
    return float(np.finfo(np.longdouble).eps)


def why_not(formulation: Formulation) -> str:
    """Return why runs of a formulation cannot be projected, or nothing."""
    if not formulation.invariants:
        return f"the {formulation.name} form has no invariant to project onto"
    if extended() > DOUBLE / 256:
        return "long double has no more digits than double on this machine"
    return ""


@dataclass(frozen=True, slots=True, eq=False)
class Projection:
    """The nearest state with the invariants of the start, to first order.

    Attributes
    ----------
    invariants : Invariants
    constants : tuple of float
        The parameters that occur in them; `exactly` has them as long doubles.
    targets : tuple of long double
        Their values at the start.
    floors : tuple of float
        Slopes, beyond those of the invariants before, below which an invariant is left alone:
        the rounding of its residual would move the state by more than the state's own.
    """

    invariants: Invariants
    constants: tuple[float, ...]
    exactly: tuple[Any, ...]
    targets: tuple[Any, ...]
    floors: tuple[float, ...]

    @classmethod
    def of(
        cls, formulation: Formulation, parameters: Mapping[str, float], start: Array
    ) -> Projection:
        """Return the projection for the run that starts from a state, shape (n,).

        Raises
        ------
        ValueError
            The formulation has no invariant; long double has no more digits than double.
        """
        if reason := why_not(formulation):
            raise ValueError(reason)
        found, finer = invariants_of(formulation), extended() / DOUBLE
        constants = tuple(parameters[name] for name in found.constants)
        exactly = tuple(map(np.longdouble, constants))
        state = start.tolist()
        scale = max(1.0, *map(abs, state))  # as the integrator's tolerance has it
        return cls(
            invariants=found,
            constants=constants,
            exactly=exactly,
            targets=tuple(found.values(*map(np.longdouble, state), *exactly)),
            floors=tuple(finer * float(size) / scale for size in found.sizes(*state, *constants)),
        )

    def __call__(self, state: Array) -> Array:
        """Return the projected state, shape (n,): one Gauss-Newton step of least norm."""
        values = self.invariants.values(*state.astype(np.longdouble), *self.exactly)
        off = [float(value - target) for value, target in zip(values, self.targets, strict=True)]
        slopes = self.invariants.slopes(*state.tolist(), *self.constants)
        projected: Array = state - _least(slopes, off, self.floors)
        return projected


def _least(
    rows: Sequence[Sequence[float]], sides: Sequence[float], floors: Sequence[float]
) -> list[float]:
    """Return the least x with rows . x = sides, by Gram-Schmidt; dependent rows are left out."""
    found: list[tuple[list[float], float]] = []
    for row, side, floor in zip(map(list, rows), sides, floors, strict=True):
        for unit, along in found:
            part = sum(map(mul, row, unit))
            row = [a - part * b for a, b in zip(row, unit, strict=True)]
            side -= part * along
        length = sqrt(sum(map(mul, row, row)))
        if length > floor:
            found.append(([a / length for a in row], side / length))
    least = [0.0] * len(rows[0])
    for unit, along in found:
        least = [a + along * b for a, b in zip(least, unit, strict=True)]
    return least
