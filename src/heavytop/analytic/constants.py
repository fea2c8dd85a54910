"""The constants of the closed form of one motion, in balls: roots, period, phase, turns, rates.

With g ≥ 0 (a top with g < 0 is seen upside down) the axis nutates, u = u₁ + (u₂ − u₁) sn² x, or
tends to the top, 1 − u = (1 − u₁) sech² x, which is m = 1, or keeps one tilt; x = w t + x₀.
The angles are φ = φ₀ + Φ₊ + Φ₋ and ψ = ψ₀ + κ t + Φ₊ − Φ₋, Φ± = ½ P± ∫ dt/(1 ± u).
Reference: Whittaker, *Analytical Dynamics*, sections 71 to 73.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from flint import arb

from heavytop.analytic.roots import (
    TooFewBits,
    distances,
    first_kind,
    pair,
    root_of,
    sign_of,
    third_kind,
)
from heavytop.analytic.theta import Series, Theta
from heavytop.classification.reduced import Reduced, Regime

Pair = tuple[arb, ...]
ZERO_BALL: Final = arb(0)


@dataclass(frozen=True)
class PoleAngle:
    """Φ₊ or Φ₋: a part linear in time, and where P± ≠ 0 a sweep about a pole, else a jump.

    In the complex plane of x, dΦ±/dx has its poles at the distance i v from the turning point
    beside that pole of the sphere, with residues ±½i whatever the motion. So Φ± is the sum of a
    multiple of time and of the argument of a theta function, which grows by π (times `sign`) from
    one passage near the pole to the next.
    """

    v: arb | None = None
    sign: int = 1
    jumps: bool = False
    step: arb = ZERO_BALL  # growth from one turning point to the next, without the linear part
    rate: arb = ZERO_BALL  # of the linear part [rad/s]


def of_nutation(number: Callable[[Any], Any]) -> Any:
    """Return a property: a number of constants that have a period, None where nothing nutates."""
    return property(lambda c: None if c.period is None else number(c))


class Constants:
    """The constants of one motion, in balls of the working precision.

    `upright` is the motion seen with g ≥ 0, `lower` and `upper` are its (1 − u, 1 + u) at u₁ and at
    u₂, `period` is T, None where nothing nutates, and `first` numbers the turning point nearest the
    start, even for u₁, odd for u₂. Elliptic integrals are computed when they are first read.
    """

    period: Any = None
    growth = u3 = None
    first, phase = 0, arb(0)

    def __init__(self, given: Reduced, angles: Pair, regime: Regime, bits: int) -> None:
        # a g taken for 0 is replaced by 0: its ball would hold 0 at every precision
        self.start = start = given._replace(g=arb(0)) if regime.weightless else given
        self.regime, self.angles, self.bits = regime, angles, bits
        self.side = -1 if regime.mirrored else 1
        self.upright = upright = start.mirrored() if regime.mirrored else start
        plus = upright.P_plus if regime.misses_bottom else arb(0)
        self.P = plus, upright.P_minus if regime.misses_top else arb(0)
        {
            "steady": self._set_steady,
            "asymptotic": self._set_asymptotic,
            "nutating": self._set_nutating,
        }[regime.name](upright)

    def _set_steady(self, upright: Reduced) -> None:
        self.w = self.m = self.delta = arb(0)
        self.mc = arb(1)
        self.lower = self.upper = upright.one_minus_u0, upright.one_plus_u0
        if not self.regime.weightless:  # from the sum of the roots
            self.u3 = (2 * upright.kinetic0 + upright.b * upright.b) / (2 * upright.g) - upright.u0

    def _set_asymptotic(self, upright: Reduced) -> None:
        low = upright.b * upright.b / (2 * upright.g) if self.regime.misses_bottom else arb(0)
        self.u3, self.m, self.mc, self.delta = arb(1), arb(1), arb(0), 2 - low
        self.lower, self.upper = (self.delta, low), (arb(0), arb(2))
        self.w = self.growth = (upright.g * self.delta / 2).sqrt()

    def _set_nutating(self, upright: Reduced) -> None:
        down, up = self._separate_roots(upright)
        self.K = arb.pi() / (2 * arb(1).agm(self.mc.sqrt()))
        self.period = 2 * self.K / self.w
        if self.regime.resting:
            self.phase = arb(0) if down.is_zero() else arb(-0.5)
        else:
            rising = sign_of(upright.udot0, "d cos(theta)/dt at the start and 0")
            self.phase = rising * self._phase_at(down, up)
        if not self.phase.is_finite():
            raise TooFewBits("the start and a turning point", self.phase)
        self.first = round(2 * float(self.phase))

    def _separate_roots(self, upright: Reduced) -> Pair:
        """Set what follows from the roots; return u₀ − u₁ and u₂ − u₀.

        Raise `TooFewBits` where two roots are not separated.
        """
        f3, f2, _, f0 = cubic = upright.cubic
        d1, d2, *d3 = distances(cubic, upright, self.regime)
        lead = f3 * d3[0] if d3 else -f2  # 2g (u₃ − u₀)
        down, up = pair(-d1, d2, f0 / lead)
        plus2, minus1 = upright.one_plus_u0 + up, upright.one_minus_u0 + down
        minus2, beyond = upright.one_minus_u0 - up, lead - f3 * upright.one_minus_u0  # 2g (u₃ − 1)
        if not self.regime.misses_top:
            rises = sign_of(upright.over_top, "E' and gMR")
            minus2, beyond = (arb(0), beyond) if rises > 0 else (minus2, arb(0))
        minus2, beyond = pair(minus2, beyond, upright.P_minus * upright.P_minus / minus1)
        plus1 = upright.one_plus_u0 - down if self.regime.misses_bottom else arb(0)
        plus1, _ = pair(
            plus1, lead + f3 * upright.one_plus_u0, upright.P_plus * upright.P_plus / plus2
        )
        self.delta, reach = up + down, lead + f3 * down  # 2g (u₃ − u₁)
        self.lower, self.upper = (minus1, plus1), (minus2, plus2)
        self.u3 = 1 + beyond / f3 if d3 else None
        self.m, self.mc = f3 * self.delta / reach, (beyond + f3 * minus2) / reach
        self.w = reach.sqrt() / 2
        return down, up

    modulus = of_nutation(lambda c: (c.m, c.mc))  # the parameter m = k² and 1 − m

    @cached_property
    def theta(self) -> Theta:
        """The theta functions, whose argument is z."""
        return Theta(self.m, self.mc, self.bits)

    @property
    def half(self) -> arb:
        """The growth of z from one turning point to the next."""
        return self.theta.half

    @cached_property
    def rate(self) -> arb:
        """The rate of z [rad/s]."""
        return self.w * self.theta.scale

    @cached_property
    def x0(self) -> arb:
        """The z of the start, counted from the turning point nearest it."""
        if self.growth is None:
            return (2 * self.phase - self.first) * self.half
        cosine = (self.upright.one_minus_u0 / self.delta).sqrt()
        slope: arb = self.upright.udot0 / (2 * self.w * self.delta * cosine * cosine * cosine)
        return slope.asinh()

    @cached_property
    def turns(self) -> Pair:
        """The growth of Φ₊ and Φ₋ in a period of nutation [rad], jumps included."""
        ends = zip(self.P, self.lower[::-1], self.upper[::-1], strict=True)
        return tuple(self._turn(*end) for end in ends)

    def _turn(self, P: arb, at_u1: arb, at_u2: arb) -> arb:
        """The growth of Φ₊ or Φ₋ in a period, by its P and its 1 ± u at the turning points."""
        if P.is_zero():
            return arb.pi() if at_u1.is_zero() or at_u2.is_zero() else arb(0)
        return P / (self.w * at_u1) * third_kind(self.mc, at_u2 / at_u1)

    @cached_property
    def halves(self) -> tuple[PoleAngle, PoleAngle]:
        """Φ₊ and Φ₋."""
        (high1, low1), high2, (plus, minus) = self.lower, self.upper[0], self.P
        if self.growth is not None:
            rate, sign = plus / 4, sign_of(plus, "P+ and 0")
            v = None if low1.is_zero() else (low1 / high1).sqrt().atan()
            return PoleAngle(v, sign, v is None, rate=rate), PoleAngle()
        if self.period is None:
            # of an axis on the vertical φ is constant, and ψ has the whole spin
            off = not (high1.is_zero() or low1.is_zero())
            b = self.upright.b
            rates = (plus / (2 * low1), minus / (2 * high1)) if off else (b / 2, -b / 2)
            return PoleAngle(rate=rates[0]), PoleAngle(rate=rates[1])
        beyond = self.delta * minus * minus / (high1 * high2) if self.regime.misses_top else arb(0)
        return (
            self._half(plus, self.turns[0], (low1, self.delta)),
            self._half(minus, self.turns[1], (4 * self.w * self.w * high2, beyond)),
        )

    def _half(self, P: arb, turn: arb, pole: tuple[arb, arb]) -> PoleAngle:
        """Φ₊ or Φ₋ of a nutation; `pole` is proportional to (sin² am v, cos² am v)."""
        if P.is_zero():
            return PoleAngle(jumps=not turn.is_zero(), step=turn / 2)
        v, sign = first_kind(*pole, self.m), sign_of(P, "p_phi and that of a pass through a pole")
        step = self.theta.step(v, sign)
        return PoleAngle(v, sign, False, step, (turn - 2 * step) / self.period)

    def sweep(self, N: Any, upper: bool, which: int) -> Series | None:
        """The series of the sweep of Φ₊ (0) or Φ₋ (1) beside u₁, or `upper`: u₂; None without one.

        The jump at an exact pass is one too.
        """
        half, beside = self.halves[which], upper == bool(which)
        if half.jumps and beside:
            turn = N.number(arb.pi() / 2)
            return lambda S, C, square: N.sign(S, 1) * turn
        if half.v is None:
            return None
        return self.theta.sweep(N, half.v, half.sign, beside)

    # Δφ, Δψ − κT and Δψ in one period [rad]
    precession = of_nutation(lambda c: c.turns[0] + c.turns[1])
    relative_spin = of_nutation(lambda c: c.side * (c.turns[0] - c.turns[1]))
    spin = of_nutation(lambda c: c.start.kappa * c.period + c.relative_spin)

    @property
    def mean_rates(self) -> Pair:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        if self.period is None:
            rates = [half.rate for half in self.halves]
        else:
            ends = zip(self.P, self.turns, strict=True)
            rates = [arb(0) if P.is_zero() else turn / self.period for P, turn in ends]
        return tuple(2 * rate for rate in rates[:: self.side])

    @property
    def roots(self) -> tuple[arb, ...]:
        """The roots u₁ ≤ u₂ ≤ u₃ of the cubic in cos θ; without u₃, which is infinite, if g = 0."""
        ends = (end[:: self.side] for end in (self.lower, self.upper))
        found = [(1 - high).intersection(low - 1) for high, low in ends]
        found += [] if self.u3 is None else [self.side * self.u3]
        return tuple(sorted(found, key=lambda u: u.mid()))

    @property
    def tilts(self) -> Pair:
        """θ [rad] at u₁ and at u₂; the same twice where it is steady."""
        ends = (end[:: self.side] for end in (self.lower, self.upper))
        return tuple(2 * arb.atan2(root_of(high), root_of(low)) for high, low in ends)

    # the least and the greatest θ [rad], and how far it nods
    theta_min = property(lambda c: c.tilts[c.side > 0])
    theta_max = property(lambda c: c.tilts[c.side < 0])
    amplitude = of_nutation(lambda c: c.theta_max - c.theta_min)

    @property
    def nearest(self) -> Pair:
        """The least distances of the axis from θ = 0 and from θ = π [rad], to their own digits."""
        ends = (self.upper, self.lower[::-1])[:: self.side]
        return tuple(2 * arb.atan2(root_of(near), root_of(far)) for near, far in ends)

    @property
    def lower_turning(self) -> Any:
        """The time [s] of a passage through u₁, others being T apart; None where there is none."""
        if self.period is not None:
            return -self.phase * self.period
        return None if self.growth is None else -self.x0 / self.w

    @cached_property
    def reversal(self) -> Any:
        """The time [s] from `lower_turning` to a change of sign of φ̇, after and before it; or None.

        There u = a/b; in a cusp that is u₂ itself.
        """
        b, passes = self.upright.b, self.P[0].is_zero() or self.P[1].is_zero()
        if self.period is None or passes or not (b > 0 or b < 0):
            return None
        down = self.upright.P_plus / b - self.lower[1]
        up = -self.upright.P_minus / b - self.upper[0]
        least = down.min(up)
        if least <= 0 or sign_of(least, "the tilts of a turning point and of phidot = 0") < 0:
            return None
        return self._phase_at(down, up) * self.period

    def _phase_at(self, down: arb, up: arb) -> arb:
        """x/2K, in [0, ½], of the tilt u₁ + down = u₂ − up on the way up."""
        return first_kind(down, up, self.mc) / (2 * self.K)
