"""What one motion has at any time: its period, its turns, its turning points, its mean rates.

The numbers are balls of `solution` at rising precision, handed out as mpmath numbers by
`closed_form` and as intervals by `enclosure`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Generic, TypeVar

from flint import arb

from heavytop.analytic.record import each
from heavytop.analytic.rising import Rising, itself, one
from heavytop.analytic.solution import Solution

N = TypeVar("N")


class MotionNumbers(Generic[N]):
    """The numbers of one motion, each computed when it is first asked for.

    Parameters
    ----------
    rising : Rising
        The motion at any precision.
    digits : int
        Decimal digits of the balls.
    kind : callable
        What makes a number of a ball.
    """

    def __init__(self, rising: Rising, digits: int, kind: Callable[[arb], N]) -> None:
        self.rising, self._digits, self._kind = rising, digits, kind

    @cached_property
    def period(self) -> N | None:
        """T [s], the period of θ; None where nothing nutates."""
        return self._known("the period", "period")[0]

    @cached_property
    def precession(self) -> N | None:
        """Δφ [rad] in one period, +π for each exact pass through a pole; None without nutation."""
        return self._known("the precession", "precession")[0]

    @cached_property
    def spin(self) -> N | None:
        """Δψ [rad] in one period, −π for a pass of the top, +π of the bottom; or None."""
        return self._known("the spin", "spin")[0]

    @cached_property
    def relative_spin(self) -> N | None:
        """Δψ − κT [rad] in one period, without what a fast spin brings by itself; or None."""
        return self._known("the spin", "relative_spin")[0]

    @cached_property
    def roots(self) -> tuple[N, ...]:
        """u₁ ≤ u₂ ≤ u₃, the roots of the cubic as cos θ; without the infinite one if gMR = 0.

        A double root is one by proof: its two numbers are then the same.
        """
        return self._known("a root", "cosines", one)

    @cached_property
    def tilts(self) -> tuple[N, ...]:
        """θ [rad] between which it moves: at u₁ and at u₂, the same twice when it is steady."""
        return self._known("a tilt", "tilts", one)

    @cached_property
    def nearest(self) -> tuple[N, ...]:
        """How near the axis comes to the top and to the bottom [rad], each to its own digits."""
        return self._known("how near it comes to a pole", "nearest", itself)

    @cached_property
    def mean_rates(self) -> tuple[N, ...]:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        return self._known("a rate", "mean_rates", one)

    @cached_property
    def lower_turning(self) -> N | None:
        """The time [s] of one passage of θ through u₁ (θ_max if gMR ≥ 0); others are T apart.

        Of an axis that tends to the vertical it is the only one; None where θ is constant.
        """
        return self._known("a turning point", "lower_turning")[0]

    @cached_property
    def reversal(self) -> N | None:
        """How long before and after each `lower_turning` φ̇ changes its sign [s]; None if never."""
        return None if self.rising.cusps else self._known("a reversal", "reversal")[0]

    @cached_property
    def modulus(self) -> tuple[N, ...] | None:
        """The parameter m = k² of the elliptic functions and 1 − m; None where nothing nutates."""
        return self._known("the modulus", "modulus", itself) or None

    @cached_property
    def growth(self) -> N | None:
        """The rate w [1/s] at which an axis tends to the vertical; None where it does not."""
        return self._known("a rate", "growth")[0]

    def _known(
        self, what: str, name: str, size: Callable[[arb], arb] | None = None
    ) -> tuple[N, ...]:  # fmt: skip
        """The number or the numbers that a `Solution` has by this name."""
        return self._told(
            self.rising.settled(
                what, lambda found, _: getattr(found, name), self._digits, size=size
            )
        )

    def _at(
        self, what: str, t: Any, value: Callable[[Solution, arb], Any],
        size: Callable[[arb], arb] | None = None, digits: int = 0,
        of: Callable[[Any], tuple[arb, ...]] | None = None,
    ) -> tuple[N, ...]:  # fmt: skip
        """The number or the numbers that a solution has at a time."""
        return self._told(self.rising.settled_at(what, t, value, digits or self._digits, size, of))

    def _told(self, found: Any) -> tuple[N, ...]:
        numbers: tuple[N, ...] = each(self._kind, found if isinstance(found, tuple) else (found,))
        return numbers
