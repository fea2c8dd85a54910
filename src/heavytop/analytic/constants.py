"""What the closed form of one motion is made of, in balls: roots, period, phase, turns, rates.

With g ≥ 0 (a top with g < 0 is looked at from below) the axis nutates, u = u₁ + (u₂ − u₁) sn² x,
or tends to the top, 1 − u = (1 − u₁) sech² x, which is m = 1, or has one tilt; x = w t + x₀.
The angles are φ = φ₀ + Φ₊ + Φ₋ and ψ = ψ₀ + κ t + Φ₊ − Φ₋, Φ± = ½ P± ∫ dt/(1 ± u).
Reference: Whittaker, *Analytical Dynamics*, sections 71 to 73.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from flint import arb

from heavytop.analytic.roots import Roots, TooFewBits, first_kind, root_of, sign_of, third_kind
from heavytop.analytic.theta import Series, Theta
from heavytop.classification.reduced import Reduced, Regime

Pair = tuple[arb, arb]
ZERO_BALL: Final = arb(0)


@dataclass(frozen=True)
class PoleAngle:
    """Φ₊ or Φ₋: where P± ≠ 0 a sweep about a pole, at an exact pass a jump, and what is linear.

    In the complex plane 1/(1 ± u) has its poles at the distance i v from the turning point beside
    that pole of the sphere, with residues ∓ ½i whatever the motion. So Φ± is a multiple of time and
    the argument of a theta function, which sweeps by π from one pass of the pole to the next.
    """

    v: arb | None = None
    sign: int = 1
    jumps: bool = False
    step: arb = ZERO_BALL  # from one turning point to the next, but for
    rate: arb = ZERO_BALL  # what is proportional to time [rad/s]


class Constants:
    """The constants of one motion, in balls of the working precision.

    `upright` is the motion seen with g ≥ 0, `lower` and `upper` are its 1 ∓ u at u₁ and at u₂,
    `period` is T, None where nothing nutates, and `first` the turning point nearest the start, even
    where it is one of u₁. What takes an elliptic integral is computed when it is first read.
    """

    period: Any = None
    growth = u3 = None
    first, phase = 0, arb(0)

    def __init__(self, given: Reduced, angles: Pair, regime: Regime, bits: int) -> None:
        # a g that only counts as 0 would be a ball around it, which no precision makes small enough
        self.start = start = given._replace(g=arb(0)) if regime.weightless else given
        self.regime, self.angles, self.bits = regime, angles, bits
        self.side = -1 if regime.mirrored else 1
        self.upright = upright = start.mirrored() if regime.mirrored else start
        plus = upright.P_plus if regime.misses_bottom else arb(0)
        self.P = plus, upright.P_minus if regime.misses_top else arb(0)
        regimes = {"steady": self._steady, "asymptotic": self._tend, "nutating": self._nutate}
        regimes[regime.name](upright)

    def _steady(self, upright: Reduced) -> None:
        self.w = self.m = self.delta = arb(0)
        self.mc = arb(1)
        self.lower = self.upper = upright.one_minus_u0, upright.one_plus_u0
        if not self.regime.weightless:  # from the sum of the roots
            self.u3 = (2 * upright.kinetic0 + upright.b * upright.b) / (2 * upright.g) - upright.u0

    def _tend(self, upright: Reduced) -> None:
        low = upright.b * upright.b / (2 * upright.g) if self.regime.misses_bottom else arb(0)
        self.u3, self.m, self.mc, self.delta = arb(1), arb(1), arb(0), 2 - low
        self.lower, self.upper = (self.delta, low), (arb(0), arb(2))
        self.w = self.growth = (upright.g * self.delta / 2).sqrt()

    def _nutate(self, upright: Reduced) -> None:
        roots = Roots.of(upright, self.regime)
        self.w, self.m, self.mc, self.delta = roots.w, roots.m, roots.mc, roots.delta
        self.lower, self.upper, self.u3 = roots.lower, roots.upper, roots.u3
        self.K = arb.pi() / (2 * arb(1).agm(self.mc.sqrt()))
        self.period = 2 * self.K / self.w
        if self.regime.resting:
            self.phase = arb(0) if roots.down.is_zero() else arb(-0.5)
        else:
            rising = sign_of(upright.udot0, "d cos(theta)/dt at the start and 0")
            self.phase = rising * self._since_lower(roots.down, roots.up)
        if not self.phase.is_finite():
            raise TooFewBits("the start and a turning point", self.phase)
        self.first = round(2 * float(self.phase))

    @property
    def modulus(self) -> Pair | None:
        """The parameter m = k² and 1 − m; None where nothing nutates."""
        return None if self.period is None else (self.m, self.mc)

    @cached_property
    def theta(self) -> Theta:
        """The theta functions."""
        return Theta(self.m, self.mc, self.bits)

    @property
    def half(self) -> arb:
        """Their argument from one turning point to the next."""
        return self.theta.half

    @cached_property
    def rate(self) -> arb:
        """The rate of their argument [rad/s]."""
        return self.w * self.theta.scale

    @cached_property
    def x0(self) -> arb:
        """Their argument at the start, since the turning point nearest it."""
        if self.growth is None:
            return (2 * self.phase - self.first) * self.half
        cosine = (self.upright.one_minus_u0 / self.delta).sqrt()
        slope: arb = self.upright.udot0 / (2 * self.w * self.delta * cosine * cosine * cosine)
        return slope.asinh()

    @cached_property
    def turns(self) -> Pair:
        """What Φ₊ and Φ₋ of a nutation grow by over a period [rad], jumps included."""
        ends = zip(self.P, self.lower[::-1], self.upper[::-1], strict=True)
        plus, minus = (self._turn(P, at_u1, at_u2) for P, at_u1, at_u2 in ends)
        return plus, minus

    def _turn(self, P: arb, at_u1: arb, at_u2: arb) -> arb:
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
            # an axis on the vertical keeps its φ, and ψ takes the whole spin
            off = not (high1.is_zero() or low1.is_zero())
            b = self.upright.b
            rates = (plus / (2 * low1), minus / (2 * high1)) if off else (b / 2, -b / 2)
            return PoleAngle(rate=rates[0]), PoleAngle(rate=rates[1])
        beyond = self.delta * minus * minus / (high1 * high2) if self.regime.misses_top else arb(0)
        return (
            self._half(plus, self.turns[0], (low1, self.delta)),
            self._half(minus, self.turns[1], (4 * self.w * self.w * high2, beyond)),
        )

    def _half(self, P: arb, turn: arb, pole: Pair) -> PoleAngle:
        """Φ₊ or Φ₋ of a nutation; `pole` are in ratio the squares of sine and cosine of am v."""
        if P.is_zero():
            return PoleAngle(jumps=not turn.is_zero(), step=turn / 2)
        v, sign = first_kind(*pole, self.m), sign_of(P, "p_phi and that of a pass through a pole")
        step = self.theta.step(v, sign)
        return PoleAngle(v, sign, False, step, (turn - 2 * step) / self.period)

    def sweep(self, N: Any, upper: bool, which: int) -> Series | None:
        """The sweep of Φ₊ (0) or Φ₋ (1) beside u₁, or beside u₂; None where there is none."""
        half, beside = self.halves[which], upper == bool(which)
        if half.jumps and beside:
            turn = N.number(arb.pi() / 2)
            return lambda S, C, square: N.sign(S, 1) * turn
        if half.v is None:
            return None
        return self.theta.sweep(N, half.v, half.sign, beside)

    @property
    def precession(self) -> Any:
        """Δφ in one period [rad]; None where nothing nutates."""
        return None if self.period is None else self.turns[0] + self.turns[1]

    @property
    def relative_spin(self) -> Any:
        """Δψ − κT in one period [rad]."""
        return None if self.period is None else self.side * (self.turns[0] - self.turns[1])

    @property
    def spin(self) -> Any:
        """Δψ in one period [rad]."""
        if self.period is None:
            return None
        return self.start.kappa * self.period + self.relative_spin

    @property
    def mean_rates(self) -> Pair:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        if self.period is None:
            rates = [half.rate for half in self.halves]
        else:
            ends = zip(self.P, self.turns, strict=True)
            rates = [arb(0) if P.is_zero() else turn / self.period for P, turn in ends]
        plus, minus = rates[:: self.side]
        return 2 * plus, 2 * minus

    @property
    def roots(self) -> tuple[arb, ...]:
        """The roots u₁ ≤ u₂ ≤ u₃ of the cubic as cos θ; the infinite one is missing if g = 0."""
        ends = (end[:: self.side] for end in (self.lower, self.upper))
        found = [(1 - high).intersection(low - 1) for high, low in ends]
        found += [] if self.u3 is None else [self.side * self.u3]
        return tuple(sorted(found, key=lambda u: u.mid()))

    @property
    def tilts(self) -> Pair:
        """θ [rad] at u₁ and at u₂; the same twice where it is steady."""
        ends = (end[:: self.side] for end in (self.lower, self.upper))
        lower, upper = (2 * arb.atan2(root_of(high), root_of(low)) for high, low in ends)
        return lower, upper

    @property
    def theta_min(self) -> arb:
        """The least θ [rad]."""
        return self.tilts[self.side > 0]

    @property
    def theta_max(self) -> arb:
        """The greatest θ [rad]."""
        return self.tilts[self.side < 0]

    @property
    def amplitude(self) -> Any:
        """θ_max − θ_min [rad]; None where nothing nutates."""
        return None if self.period is None else self.theta_max - self.theta_min

    @property
    def nearest(self) -> Pair:
        """How near the axis comes to θ = 0 and to θ = π [rad], each to its own digits."""
        ends = (self.upper, self.lower[::-1])[:: self.side]
        top, bottom = (2 * arb.atan2(root_of(near), root_of(far)) for near, far in ends)
        return top, bottom

    @property
    def lower_turning(self) -> Any:
        """The time [s] of one passage through u₁; others are T apart, if there are any."""
        if self.period is not None:
            return -self.phase * self.period
        return None if self.growth is None else -self.x0 / self.w

    @cached_property
    def reversal(self) -> Any:
        """How long before and after each `lower_turning` φ̇ changes its sign [s]; None if never.

        That is where u = a/b; in a cusp it is u₂ itself.
        """
        b, passes = self.upright.b, self.P[0].is_zero() or self.P[1].is_zero()
        if self.period is None or passes or not (b > 0 or b < 0):
            return None
        down = self.upright.P_plus / b - self.lower[1]
        up = -self.upright.P_minus / b - self.upper[0]
        least = down.min(up)
        if least <= 0 or sign_of(least, "the tilts of a turning point and of phidot = 0") < 0:
            return None
        return self._since_lower(down, up) * self.period

    def _since_lower(self, down: arb, up: arb) -> arb:
        """x/2K, in [0, ½], of the tilt u₁ + down = u₂ − up on the way up."""
        return first_kind(down, up, self.mc) / (2 * self.K)
