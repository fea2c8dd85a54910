"""`nodding` in doubles.

Times are measured from the nearest turning point as sums of two doubles, so that they have all
their digits however near it is, and 1 ∓ u are sums of squares.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any

import numpy as np

from heavytop.analytic.theory.double_place import DoublePlace
from heavytop.analytic.theory.half_periods import HalfPeriods
from heavytop.analytic.theory.halves import Half, minus_half, plus_half
from heavytop.analytic.theory.nodding import Nodding
from heavytop.analytic.theory.pole_distance import PoleDistance
from heavytop.analytic.theory.theta_functions import Functions, Value
from heavytop.numbers.angle import Double2
from heavytop.numbers.decimals import Number
from heavytop.numbers.pairs import (
    QUARTER_TURN,
    Array,
    Doubles,
    Pairs,
    arctangent,
    sin_cos,
    sinh_cosh,
    two_product,
)

_BIG = 1e150  # whose square is a double; the nome has made nothing of it long before
_FAR = 300.0  # where the sweeps have come to rest


class NoddingDouble:
    """An axis that nods, at arrays of times.

    Parameters
    ----------
    path : Nodding
        Its constants.
    """

    size = np.pi

    def __init__(self, path: Nodding) -> None:
        ctx, roots = path.ctx, path.roots
        self.turns = path.turn_plus / 2, path.turn_minus / 2
        self.offsets, self.rates = (path.plus0, path.minus0), (ctx.zero, ctx.zero)
        self._path, self._times = path, HalfPeriods(path)
        self._unit = Double2.of(path.lattice.unit * path.w)
        self._hyperbolic = path.lattice.hyperbolic
        self._functions = Functions.of(path.lattice, ctx.mpf("1e-19")).map(float)
        self._w, self._m, self._delta = float(path.w), float(roots.m), float(roots.delta)
        self._top, self._bottom = PoleDistance.top(roots), PoleDistance.bottom(roots)
        most = 2 * roots.one_minus_u1 * roots.one_plus_u2
        self._swings = tuple(
            float((path.P_plus * above + path.P_minus * below) / most)
            for above, below in path.turnings
        )  # (a − b u)/(1 − u₁)(1 + u₂) at u₁ and at u₂

    @cached_property
    def _halves(self) -> tuple[Half, Half]:
        return self._rounded(1e-19, float)

    @cached_property
    def _long_halves(self) -> tuple[Half, Half]:
        return self._rounded(1e-36, Pairs.of)

    def _rounded(self, tiny: float, kind: Callable[[Number], Value]) -> tuple[Half, Half]:
        roots, lattice = self._path.roots, self._path.lattice
        plus, minus = plus_half(roots, lattice, tiny), minus_half(roots, lattice, tiny)
        return plus.map(kind), minus.map(kind)

    def chords(self, t: Array, t_lo: Doubles) -> tuple[Array, Array]:
        """√(1 − u) and √(1 + u) at the times t + t_lo."""
        turning, tau, lo = self._times.nearest(t, t_lo)
        from_top, from_bottom = np.empty_like(t), np.empty_like(t)
        for upper, here in _sides(turning):
            s, c, _ = self._functions(*self._argument(tau[here], lo[here]), upper)
            from_top[here] = self._top.scale * self._top.share(c)
            from_bottom[here] = self._bottom.scale * self._bottom.share(s)
        return from_top, from_bottom

    def place(self, t: Array, t_lo: Doubles) -> DoublePlace:
        """The place at the times t + t_lo."""
        turning, tau, lo = self._times.nearest(t, t_lo)
        after, columns = self._times.after(t, tau), tuple(np.empty_like(t) for _ in range(10))
        for upper, here in _sides(turning):
            beside = self._beside(upper, tau[here], lo[here], after[here])
            for column, values in zip(columns, beside, strict=True):
                column[here] = values
        opened = (turning % 2 == 1) & (after > 0)
        return DoublePlace._make((*columns, turning, np.floor(turning / 2) + opened))

    def phases(self, t: Array, t_lo: Doubles) -> tuple[Pairs, Pairs]:
        """Φ± since the turning point, with twice the digits."""
        turning, tau, lo = self._times.nearest(t, t_lo)
        after, words = self._times.after(t, tau), np.empty((4, *t.shape))
        for upper, here in _sides(turning):
            time = Pairs(tau[here], lo[here])
            argument = self._long_argument(time)
            for k, half in enumerate(self._long_halves):
                since = half.since(upper == bool(k), time, argument, arctangent)
                if half.jumps and upper == bool(k):
                    since = Pairs(after[here], 0 * after[here]) * QUARTER_TURN
                words[2 * k][here], words[2 * k + 1][here] = since.hi, since.lo
        return Pairs(words[0], words[1]), Pairs(words[2], words[3])

    def _argument(self, tau: Array, lo: Array) -> tuple[Array, Array, Array]:
        """S, C and C₂ at a time since a turning point."""
        z, error = two_product(tau, self._unit.hi)
        error = error + (lo * self._unit.hi + tau * self._unit.lo)
        if self._hyperbolic:
            S, C = np.sinh(z), np.cosh(z)
            S, C = S + C * error, C + S * error
            near = np.clip(S, -_BIG, _BIG)
            return S, C, 1 + 2 * near * near
        S, C = np.sin(z), np.cos(z)
        S, C = S + C * error, C - S * error
        return S, C, 1 - 2 * S * S

    def _long_argument(self, tau: Pairs) -> tuple[Pairs, Pairs, Pairs]:
        """The same with twice the digits."""
        z = tau * Pairs(*self._unit)
        if self._hyperbolic:
            S, C = sinh_cosh(Pairs(np.clip(z.hi, -_FAR, _FAR), z.lo))
            return S, C, Pairs(1.0, 0.0) + Pairs(2.0, 0.0) * S * S
        S, C = sin_cos(z)
        return S, C, Pairs(1.0, 0.0) - Pairs(2.0, 0.0) * S * S

    def _beside(self, upper: bool, tau: Array, lo: Array, after: Array) -> tuple[Array, ...]:
        """√(1 ∓ u), 1 ∓ u, −θ̇, ü, φ̇, ψ̇ − κ and Φ± beside one kind of turning point."""
        argument = self._argument(tau, lo)
        s, c, d = self._functions(*argument, upper)
        top, bottom = self._top, self._bottom
        above, below = top.share(c), bottom.share(s)
        c2, s2, d2 = c * c, s * s, d * d
        # c/√(1 − u) and s/√(1 + u) stay finite at an exact pass through a pole
        across = -after if upper and top.passed else top.swing * c / above
        along = after if not upper and bottom.passed else bottom.swing * s / below
        uddot = 2 * self._delta * self._w**2 * (d2 * (c2 - s2) - self._m * s2 * c2)
        return (
            top.scale * above, bottom.scale * below,
            top.square + self._delta * c2, bottom.square + self._delta * s2,
            2 * self._w * d * across * along, uddot,
            *self._rates(above, below, s2, c2), *self._phases(upper, tau, argument, after),
        )  # fmt: skip

    def _phases(
        self, upper: bool, tau: Array, argument: tuple[Array, Array, Array], after: Array
    ) -> Iterator[Array]:
        for half, beside in zip(self._halves, (not upper, upper), strict=True):
            if half.jumps and beside:
                yield after * QUARTER_TURN.hi
            else:
                yield half.since(beside, tau, argument, np.arctan2)

    def _rates(self, above: Array, below: Array, s2: Array, c2: Array) -> tuple[Array, Array]:
        """φ̇ and ψ̇ − κ; where P₊ and P₋ are of two signs φ̇ from a − b u, which does not cancel."""
        plus, minus = self._bottom.winding(below), self._top.winding(above)
        if not self._top.rate * self._bottom.rate < 0:
            return plus + minus, plus - minus
        both, (low, high) = above * below, self._swings
        return (low * c2 + high * s2) / both / both, plus - minus


def _sides(turning: Array) -> Iterator[tuple[bool, Any]]:
    """The times nearest to turning points of one kind, as an index: first those nearest to u₁."""
    upper = turning % 2 == 1
    if not upper.any():
        yield False, slice(None)
    elif upper.all():
        yield True, slice(None)
    else:
        yield False, ~upper
        yield True, upper
