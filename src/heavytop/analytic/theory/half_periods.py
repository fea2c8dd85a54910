"""Times reduced by whole half periods, so that what is left has its digits after 1e9 of them."""

from __future__ import annotations

import numpy as np

from heavytop.analytic.theory.nodding import Nodding
from heavytop.errors import NoClosedForm
from heavytop.numbers.angle import Double2, parts
from heavytop.numbers.pairs import Array, Doubles, two_sum

MOST_PERIODS = 2**31
"""Periods up to which twice their number times a part of T/2 is exact."""

EDGE = 1e-30
"""What a time since a turning point is not known to, beside the times it comes from."""


class HalfPeriods:
    """The turning points of an axis that nods, T/2 apart.

    T/2 is cut into parts so short that a whole number times a part is exact (Cody & Waite).

    Parameters
    ----------
    path : Nodding
        The axis.
    """

    def __init__(self, path: Nodding) -> None:
        half = path.T / 2
        self.length = float(half)
        self._parts = parts(path.ctx, half)
        self._first, self._since = path.start[0], Double2.of(path.start[1])

    def nearest(self, t: Array, t_lo: Doubles) -> tuple[Array, Array, Array]:
        """The turning point nearest each time, and the time since it as a sum of two doubles [s].

        Parameters
        ----------
        t, t_lo : array, shape (k,)
            Times t + t_lo since the start [s].

        Returns
        -------
        turning : array
            Counted from 0, a passage of u₁; the odd ones are passages of u₂.
        tau, tau_lo : array
            The time since it [s].

        Raises
        ------
        NoClosedForm
            Beyond 2³¹ periods.
        """
        with np.errstate(over="ignore"):
            steps = np.rint((t + self._since.hi) / self.length)
        if np.any(abs(steps) >= 2 * MOST_PERIODS):
            raise NoClosedForm(
                f"more than {MOST_PERIODS} periods in doubles: ask for digits instead"
            )
        total, rest = two_sum(t, t_lo)
        rest = rest + (self._since.lo - steps * self._parts[3])
        for part in self._parts[:3]:
            total, error = two_sum(total, -steps * part)
            rest = rest + error
        total, error = two_sum(total, self._since.hi)
        tau, tau_lo = two_sum(total, rest + error)
        return steps + self._first, np.asarray(tau), np.asarray(tau_lo)

    def after(self, t: Array, tau: Array) -> Array:
        """1 where a turning point counts as passed, −1 before: at it what follows has begun.

        Parameters
        ----------
        t, tau : array
            Times since the start, and since the turning point [s].
        """
        return np.where(tau >= -EDGE * (abs(t) + abs(self._since.hi)), 1.0, -1.0)
