"""An axis that nods between two turning points: its tilt by elliptic functions, φ by Φ₊ and Φ₋.

With x = w t measured from a lower turning point and sn, cn of (x|m),

    1 − u = (1 − u₂) + (u₂ − u₁) cn² x,   1 + u = (1 + u₁) + (u₂ − u₁) sn² x,

sums of terms of one sign, so that nothing cancels however close to a pole the axis passes. Times
are measured from the nearer turning point, lower or upper, where each has its digits.
"""

from __future__ import annotations

from functools import cached_property

from heavytop.analytic.theory.elliptic import first
from heavytop.analytic.theory.halves import Half, minus_half, plus_half
from heavytop.analytic.theory.nutation import Nutation
from heavytop.analytic.theory.place import Place
from heavytop.analytic.theory.theta_functions import Functions, Lattice
from heavytop.numbers.decimals import Number


class Nodding:
    """An axis that nods between two turning points: elliptic functions of time.

    Parameters
    ----------
    roots : Nutation
        The turning points and the constants P±, m, w.
    """

    def __init__(self, roots: Nutation) -> None:
        ctx = self.ctx = roots.ctx
        self.roots, self.w = roots, roots.w
        self.P_plus, self.P_minus = roots.P_plus, roots.P_minus
        self.lattice = Lattice.of(ctx, roots.m, roots.mc)
        self.K = self.lattice.K
        self.T = 2 * self.K / self.w

    @cached_property
    def functions(self) -> Functions:
        """sn, cn and dn."""
        return Functions.of(self.lattice, self.ctx.eps)

    @cached_property
    def halves(self) -> tuple[Half, Half]:
        """Φ₊ and Φ₋; a period alone does not need them."""
        roots, lattice, tiny = self.roots, self.lattice, self.ctx.eps
        return plus_half(roots, lattice, tiny), minus_half(roots, lattice, tiny)

    @property
    def turn_plus(self) -> Number:
        """Φ₊ over one period."""
        return self.halves[0].turn

    @property
    def turn_minus(self) -> Number:
        """Φ₋ over one period."""
        return self.halves[1].turn

    @cached_property
    def start(self) -> tuple[int, Number]:
        """The turning point nearest the start, and the time since it [s].

        That of u₁ is 0; −1 and 1 are those of u₂ before and after it.
        """
        turning, tau = self._rise(self.roots.down, self.roots.up)
        return (turning, tau) if self.roots.upright.udot0 > 0 else (-turning, -tau)

    def _rise(self, down: Number, up: Number) -> tuple[int, Number]:
        """The nearer turning point, 0 or 1, and the time since it, on the way up from u₁ to u₂."""
        ctx, mc = self.ctx, self.roots.mc
        low, high = ctx.sqrt(down), ctx.sqrt(up)
        if low <= high:
            return 0, first(ctx, low / high, mc) / self.w
        return 1, -first(ctx, high / (ctx.sqrt(mc) * low), mc) / self.w

    @property
    def reversal(self) -> Number | None:
        """How long after u₁ the axis comes, rising, to u = a/b where φ̇ = 0 [s]; None if never."""
        roots, b = self.roots, self.roots.upright.b
        if not b:
            return None
        down, up = self.P_plus / b - roots.one_plus_u1, -self.P_minus / b - roots.one_minus_u2
        if min(down, up) <= 0:
            return None
        turning, tau = self._rise(down, up)
        return turning * self.T / 2 + tau

    @property
    def t0(self) -> Number:
        """Time since the lower turning point, at the start [s]."""
        turning, tau = self.start
        return turning * self.T / 2 + tau

    @cached_property
    def plus0(self) -> Number:
        """Φ₊ at the start, since the lower turning point."""
        turning, tau = self.start
        return self._phases(turning, tau, tau >= 0)[0]

    @cached_property
    def minus0(self) -> Number:
        """Φ₋ at the start, since the lower turning point."""
        turning, tau = self.start
        return self._phases(turning, tau, tau >= 0)[1]

    @property
    def mean_rates(self) -> tuple[Number, Number]:
        """Means of ½ P±/(1 ± u) [rad/s]; jumps at passes through a pole are no part of them."""
        plus = self.turn_plus / self.T if self.P_plus else self.ctx.zero
        minus = self.turn_minus / self.T if self.P_minus else self.ctx.zero
        return plus, minus

    @property
    def turnings(self) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """1 ∓ u at u₁ and at u₂."""
        roots = self.roots
        return (
            (roots.one_minus_u1, roots.one_plus_u1),
            (roots.one_minus_u2, roots.one_plus_u2),
        )

    def nearest(self, t: Number) -> tuple[int, Number]:
        """The turning point nearest the time t, even for those of u₁, and the time since it [s]."""
        ctx, half, (turning, tau) = self.ctx, self.T / 2, self.start
        steps = int(ctx.nint((t + tau) / half))
        return turning + steps, t + tau - steps * half

    def _passed(self, t: Number, tau: Number) -> bool:
        """Whether a turning point counts as passed: up to rounding, a pass opens what follows."""
        return bool(tau >= -1024 * self.ctx.eps * (abs(t) + abs(self.start[1])))

    def _phases(self, turning: int, tau: Number, passed: bool) -> tuple[Number, Number]:
        """Φ₊ and Φ₋ since the turning point 0."""
        ctx, argument, phases = self.ctx, self.lattice.argument(self.w * tau), []
        for half, beside in zip(self.halves, (turning % 2 == 0, turning % 2 == 1), strict=True):
            since = half.since(beside, tau, argument, ctx.atan2)
            if half.jumps and beside:
                since = ctx.pi / 2 if passed else -ctx.pi / 2
            phases.append(turning * half.turn / 2 + since)
        return phases[0], phases[1]

    def place(self, t: Number) -> Place:
        """The place at time t."""
        ctx, roots = self.ctx, self.roots
        turning, tau = self.nearest(t)
        upper, passed = turning % 2 == 1, self._passed(t, tau)
        s, c, d = self.functions(*self.lattice.argument(self.w * tau), upper)
        above = roots.one_minus_u2 + roots.delta * c * c
        below = roots.one_plus_u1 + roots.delta * s * s
        # c/√(1 − u) and s/√(1 + u) stay finite at an exact pass through a pole
        step = (1 if passed else -1) / ctx.sqrt(roots.delta)
        over_top = -step if upper and not roots.one_minus_u2 else c / ctx.sqrt(above)
        under = step if not upper and not roots.one_plus_u1 else s / ctx.sqrt(below)
        rise = 2 * roots.delta * self.w * d * over_top * under
        plus, minus = self._phases(turning, tau, passed)
        period = turning // 2 + (1 if upper and passed else 0)
        return Place(above, below, rise, plus - self.plus0, minus - self.minus0, period)
