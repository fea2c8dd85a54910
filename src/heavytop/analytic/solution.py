"""The closed form of every motion in balls: θ, φ, ψ and their rates at a time, T, Δφ and Δψ.

With g ≥ 0 (a top with g < 0 is looked at from below) the axis has one of three regimes. It nutates
between two turning points, u = u₁ + (u₂ − u₁) sn² x with x = w t + x₀; it tends to the top,
1 − u = (1 − u₁) sech² x; or its tilt is constant. The angles are

    φ = φ₀ + Φ₊ + Φ₋,   ψ = ψ₀ + κ t + Φ₊ − Φ₋,   Φ± = ½ P± ∫ dt/(1 ± u).

In the complex plane 1/(1 ± u) has its poles at the distance i v± from the turning point nearest
that pole of the sphere, with residues ∓ ½i whatever the motion: so Φ± is a multiple of time and
the argument of a theta function, which sweeps by π each time the axis passes that pole of the
sphere. Where P± = 0 the pass is exact and the sweep a jump: φ jumps by +π (as time goes forward),
ψ by −π at θ = 0, where φ + ψ is continuous, and by +π at θ = π, where φ − ψ is. Axis and attitude
stay smooth. An axis that stays on the vertical keeps its φ, and ψ takes the whole spin.

Everything is computed at flint's working precision (`numbers.intervals.working`), in balls that
contain the true value.

References: Whittaker, *Analytical Dynamics*, sections 71 to 73; *NIST Digital Library of
Mathematical Functions*, chapters 19, 20 and 22.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple, TypeVar, cast

from flint import arb, fmpz

from heavytop.analytic.cubic import Roots, TooFewBits, root_of, sign_of
from heavytop.analytic.elliptic import Jacobi, first_kind, third_kind
from heavytop.analytic.record import ExactRecord
from heavytop.classification.reduced import MotionSource, Reduced, Regime

T = TypeVar("T")
Pair = tuple[arb, arb]

_AT_A_POLE: Final = "the time and that of a pass through a pole"


class Position(NamedTuple):
    """Where the axis is at one time, seen with g ≥ 0: √(1 ∓ u), −θ̇, Φ± since the start, n."""

    from_top: arb
    from_bottom: arb
    rise: arb
    plus: arb
    minus: arb
    n: int


class Path:
    """The motion of the axis, seen with g ≥ 0, in any of the three regimes.

    `cosines` are u₁, u₂ and, where g is not 0, u₃; `turnings` are √(1 ∓ u) at u₁ and at u₂.
    """

    period: arb | None = None
    cosines: tuple[arb, ...]
    turnings: tuple[Pair, Pair]

    def __init__(self, over: Reduced, regime: Regime) -> None:
        self.over, self.regime = over, regime

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, and the bottom."""
        (_, low), (high, _) = self.turnings
        return not high.is_zero(), not low.is_zero()

    def rates(self, from_top: arb, from_bottom: arb) -> Pair:
        """Rates ½ P±/(1 ± u) of Φ±; where P± = 0 nothing is left of one, not even on the pole."""
        plus = minus = arb(0)
        if self.regime.misses_bottom:
            plus = self.over.P_plus / (2 * from_bottom * from_bottom)
        if self.regime.misses_top:
            minus = self.over.P_minus / (2 * from_top * from_top)
        return plus, minus

    @property
    def mean_rates(self) -> Pair:
        """Means of the rates of Φ± [rad/s], without jumps: where the tilt settles, those there."""
        return self.rates(*self.turnings[1])


class Nutating(Path):
    """An axis between two turning points: elliptic functions of time."""

    def __init__(self, over: Reduced, regime: Regime) -> None:
        super().__init__(over, regime)
        self.roots = roots = Roots.of(over, regime)
        self.K = arb.pi() / (2 * arb(1).agm(roots.mc.sqrt()))
        self.period: arb = 2 * self.K / roots.w
        self.cosines = (roots.u1, roots.u2, *([] if roots.u3 is None else [roots.u3]))
        self.turnings = (
            (root_of(roots.one_minus_u1), root_of(roots.one_plus_u1)),
            (root_of(roots.one_minus_u2), root_of(roots.one_plus_u2)),
        )

    @property
    def reaches_top(self) -> bool:
        """Whether the axis passes exactly through the top."""
        return not self.avoids[0]

    @cached_property
    def halves(self) -> tuple[Sweeps | Jumps, Sweeps | Jumps]:
        """Φ₊ and Φ₋ since the lower turning point, at a number of periods after it."""
        roots, over, regime = self.roots, self.over, self.regime
        plus: Sweeps | Jumps = Jumps(arb.pi(), arb(0))
        minus: Sweeps | Jumps = Jumps(arb.pi() if self.reaches_top else arb(0), arb(0.5))
        if regime.misses_bottom:
            pole = roots.one_plus_u1, roots.delta
            plus = Sweeps(self, over.P_plus, roots.one_plus_u1, roots.one_plus_u2, pole, arb(0))
        if regime.misses_top:
            beyond = over.P_minus * over.P_minus / (roots.one_minus_u1 * roots.one_minus_u2)
            pole = 4 * roots.w * roots.w * roots.one_minus_u2, roots.delta * beyond  # 2g (u₃ − 1)
            minus = Sweeps(
                self, over.P_minus, roots.one_minus_u1, roots.one_minus_u2, pole, arb(0.5)
            )
        return plus, minus

    @property
    def turns(self) -> Pair:
        """Φ₊ and Φ₋ over a period; half a turn at an exact pass through a pole."""
        plus, minus = self.halves
        return plus.turn, minus.turn

    @property
    def mean_rates(self) -> Pair:
        """Means of the rates of Φ± [rad/s]; jumps at passes through a pole are no part of them."""
        plus, minus = (
            half.turn / self.period if isinstance(half, Sweeps) else arb(0) for half in self.halves
        )
        return plus, minus

    @cached_property
    def phase(self) -> arb:
        """x₀/2K at the start, in [−½, ½]: 0 at u₁, ±½ at u₂."""
        roots, udot0 = self.roots, self.over.udot0
        if self.regime.resting:
            return arb(0) if roots.down.is_zero() else arb(-0.5)
        rising = sign_of(udot0, "d cos(theta)/dt at the start and 0")
        return rising * self._since_lower(roots.down, roots.up)

    def _since_lower(self, down: arb, up: arb) -> arb:
        """x/2K, in [0, ½], of the tilt u₁ + down = u₂ − up on the way up."""
        return first_kind(down, up, self.roots.mc) / (2 * self.K)

    @property
    def reversal(self) -> arb | None:
        """The part of a period after u₁ in which the axis rises to u = a/b, where φ̇ = 0.

        None where φ̇ keeps its sign; in a cusp that is u₂ itself.
        """
        roots, b = self.roots, self.over.b
        if not (self.regime.misses_top and self.regime.misses_bottom and (b > 0 or b < 0)):
            return None
        down = self.over.P_plus / b - roots.one_plus_u1
        up = -self.over.P_minus / b - roots.one_minus_u2
        if down <= 0 or up <= 0:
            return None
        if not (down > 0 and up > 0):
            raise TooFewBits("the tilts of a turning point and of phidot = 0", down.min(up))
        return self._since_lower(down, up)

    @cached_property
    def at_start(self) -> Pair:
        """Φ₊ and Φ₋ at the start, since the lower turning point."""
        plus, minus = self.halves
        return plus(self.phase), minus(self.phase)

    @cached_property
    def tau(self) -> arb | None:
        """K'/K; None where m = 0 and it is infinite."""
        roots = self.roots
        if roots.m.is_zero():
            return None
        return arb(1).agm(roots.mc.sqrt()) / arb(1).agm(roots.m.sqrt())

    @cached_property
    def jacobi(self) -> Jacobi:
        """The elliptic functions of modulus m."""
        return Jacobi(self.tau)

    def periods(self, t: arb) -> arb:
        """How many periods the time t is after the lower turning point nearest the start."""
        return t / self.period + self.phase

    def tilt(self, t: arb) -> Pair:
        """√(1 − u) and √(1 + u) at a time."""
        x = self.periods(t)
        sn, cn, _ = self.jacobi.functions(x - _nearest(x))
        return self._distances(sn, cn)

    def place(self, t: arb) -> Position:
        """The place at a time."""
        x, size = self.periods(t), self.roots.delta.sqrt()
        z = x - (floor(x + arb(0.5)) if self.reaches_top else _nearest(x))
        sn, cn, dn = self.jacobi.functions(z)
        from_top, from_bottom = self._distances(sn, cn)
        # cn/√(1 − u) and sn/√(1 + u) stay finite at an exact pass through a pole
        across = 1 / size if self.reaches_top else cn / from_top
        along = sn / from_bottom if self.regime.misses_bottom else _side(z) / size
        plus, minus = (half(x) - at0 for half, at0 in zip(self.halves, self.at_start, strict=True))
        n = int(cast(fmpz, (x + arb(0.5)).mid().floor().unique_fmpz()))
        rise = 2 * self.roots.delta * self.roots.w * dn * across * along
        return Position(from_top, from_bottom, rise, plus, minus, n)

    def _distances(self, sn: arb, cn: arb) -> Pair:
        roots, size = self.roots, self.roots.delta.sqrt()
        return _hypot(roots.one_minus_u2, cn * size), _hypot(roots.one_plus_u1, sn * size)


class Sweeps:
    """Φ₊ or Φ₋ of an axis that passes beside the pole: a multiple of time and an argument of θ₁.

    Over a period it is P±/w(1 ± u₁) Π(1 − p|m) with p = (1 ± u₂)/(1 ± u₁); `pole` are in ratio
    the squares of sine and cosine of the amplitude whose F(m') is v±, and `own` is the turning
    point beside the pole, in periods.
    """

    def __init__(
        self, path: Nutating, P: arb, at_u1: arb, at_u2: arb, pole: Pair, own: arb
    ) -> None:
        self.path, self.own, self._pole = path, own, pole
        self.sign = sign_of(P, "p_phi and that of a pass through a pole")
        self.turn = P / (path.roots.w * at_u1) * third_kind(path.K, path.roots.mc, at_u2 / at_u1)
        self.rate = self.turn - self.sign * arb.pi()

    @cached_property
    def beta(self) -> arb:
        """The imaginary part v±/2K of the argument of θ₁."""
        return first_kind(*self._pole, self.path.roots.m) / (2 * self.path.K)

    def __call__(self, periods: arb) -> arb:
        """Φ₊ or Φ₋, but for what it is at the lower turning point."""
        x = periods - self.own
        return self.rate * x + self.swept(x)

    def swept(self, x: arb) -> arb:
        """The argument, at a number of periods since a turning point beside the pole."""
        n = _nearest(x)
        return self.sign * (arb.pi() * n - self.path.jacobi.argument(x - n, self.beta))


@dataclass(frozen=True, slots=True)
class Jumps:
    """Φ₊ or Φ₋ where P± = 0: half a turn at each exact pass through the pole, if it is reached."""

    turn: arb
    own: arb

    def __call__(self, periods: arb) -> arb:
        """Φ₊ or Φ₋, at a number of periods after the lower turning point."""
        if self.turn.is_zero():
            return self.turn
        return self.turn * (floor(periods - self.own) + arb(0.5))


class Asymptotic(Path):
    """An axis that comes from the top and returns to it: 1 − u = (1 − u₁) sech² x, x = w t + x₀."""

    def __init__(self, over: Reduced, regime: Regime) -> None:
        super().__init__(over, regime)
        self.planar = not regime.misses_bottom
        self.one_plus_u1 = arb(0) if self.planar else over.b * over.b / (2 * over.g)
        self.one_minus_u1 = 2 - self.one_plus_u1
        self.cosines = self.one_plus_u1 - 1, arb(1), arb(1)
        lowest = self.one_minus_u1.sqrt(), root_of(self.one_plus_u1)
        self.turnings = lowest, (arb(0), arb(2).sqrt())
        self.w = (over.g * self.one_minus_u1 / 2).sqrt()
        self.x0 = arb(0)
        if not regime.resting:
            c0 = (over.one_minus_u0 / self.one_minus_u1).sqrt()
            self.x0 = (over.udot0 / (2 * self.w * self.one_minus_u1 * c0**3)).asinh()

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, which it tends to, and the bottom."""
        return True, not self.planar

    def tilt(self, t: arb) -> Pair:
        """√(1 − u) and √(1 + u) at a time."""
        x, size = self.w * t + self.x0, self.turnings[0][0]
        return size * x.sech(), _hypot(self.one_plus_u1, size * x.tanh())

    def place(self, t: arb) -> Position:
        """The place at a time."""
        x, size = self.w * t + self.x0, self.turnings[0][0]
        from_top, from_bottom = self.tilt(t)
        along = _side(x) / size if self.planar else x.tanh() / from_bottom
        plus = self.mean_rates[0] * t + self.swept(x) - self.swept(self.x0)
        return Position(from_top, from_bottom, 2 * self.w * from_top * along, plus, arb(0), 0)

    def swept(self, x: arb) -> arb:
        """Φ₊ but for what is proportional to time: ± arctan(r tanh x), r² = (1 − u₁)/(1 + u₁).

        The sign is that of P₊ = ± 4w/r.
        """
        if self.planar:
            return _side(x) * arb.pi() / 2
        size, floor = self.turnings[0]
        return sign_of(self.over.P_plus, "P+ and 0") * (size / floor * x.tanh()).atan()


class Steady(Path):
    """An axis of constant tilt: u₀ is a double root of f, and no root is looked for."""

    def __init__(self, over: Reduced, regime: Regime) -> None:
        super().__init__(over, regime)
        here, u0 = (root_of(over.one_minus_u0), root_of(over.one_plus_u0)), over.u0
        self.turnings, self.cosines = (here, here), (u0, u0)
        if not regime.weightless:  # the single root, from the sum of all
            single = (2 * over.kinetic0 + over.b * over.b) / (2 * over.g) - u0
            self.cosines = u0.min(single), u0, u0.max(single)

    def rates(self, from_top: arb, from_bottom: arb) -> Pair:
        """Rates of Φ±; an axis on the vertical keeps its φ, and ψ takes the whole spin."""
        if all(self.avoids):
            return super().rates(from_top, from_bottom)
        return self.over.b / 2, -self.over.b / 2

    def tilt(self, t: arb) -> Pair:
        """√(1 − u₀) and √(1 + u₀)."""
        return self.turnings[0]

    def place(self, t: arb) -> Position:
        """The place at a time."""
        plus, minus = self.mean_rates
        return Position(*self.turnings[0], arb(0), plus * t, minus * t, 0)


class Solution:
    """The closed form of one motion at one precision; use it inside ``working(bits)``."""

    def __init__(self, source: MotionSource, regime: Regime, bits: int) -> None:
        given = source.reduced(bits)
        # a g that only counts as 0 would be a ball around it, which no precision makes small enough
        self.start = replace(given, g=arb(0)) if regime.weightless else given
        self.phi0, self.psi0 = source.angles(bits)
        self.regime, self.side = regime, -1 if regime.mirrored else 1
        over = self.start.mirrored() if regime.mirrored else self.start
        kind = Steady if regime.steady else Asymptotic if regime.asymptotic else Nutating
        self.path: Nutating | Asymptotic | Steady = kind(over, regime)

    def _facing(self, both: tuple[T, T]) -> tuple[T, T]:
        """What belongs to the top and the bottom as seen with g ≥ 0, for θ = 0 and θ = π."""
        one, other = both
        return (one, other) if self.side > 0 else (other, one)

    @property
    def cosines(self) -> tuple[arb, ...]:
        """The roots u₁ ≤ u₂ ≤ u₃ of the cubic as cos θ; the infinite one is missing if g = 0."""
        found = self.path.cosines
        return found if self.side > 0 else tuple(-u for u in reversed(found))

    @property
    def tilts(self) -> Pair:
        """θ [rad] between which it moves: at u₁ and at u₂, the same twice when it is steady."""
        one, other = self.path.turnings
        return self._theta(one), self._theta(other)

    @property
    def nearest(self) -> Pair:
        """How near the axis comes to the top and to the bottom [rad], each to its own digits."""
        (high, low), (above, below) = self.path.turnings
        return self._facing((2 * arb.atan2(above, below), 2 * arb.atan2(low, high)))

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, θ = 0, and the bottom."""
        return self._facing(self.path.avoids)

    @property
    def period(self) -> arb | None:
        """T [s]; None where nothing nutates."""
        return self.path.period

    @property
    def precession(self) -> arb | None:
        """Δφ [rad] in one period; None where nothing nutates."""
        return sum(self.path.turns, arb(0)) if isinstance(self.path, Nutating) else None

    @property
    def spin(self) -> arb | None:
        """Δψ [rad] in one period; None where nothing nutates."""
        over, period = self.relative_spin, self.path.period
        return None if over is None or period is None else self.start.kappa * period + over

    @property
    def relative_spin(self) -> arb | None:
        """Δψ − κT [rad], without what a fast spin brings by itself; None where nothing nutates."""
        if not isinstance(self.path, Nutating):
            return None
        plus, minus = self.path.turns
        return self.side * (plus - minus)

    @property
    def mean_rates(self) -> Pair:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        plus, minus = self._facing(self.path.mean_rates)
        return 2 * plus, 2 * minus

    @property
    def lower_turning(self) -> arb | None:
        """The time [s] of one passage through u₁ (θ_max if gMR ≥ 0); others are T apart.

        Of an axis that tends to the vertical it is the only one; None where θ is constant.
        """
        if isinstance(self.path, Nutating):
            return -self.path.phase * self.path.period
        return -self.path.x0 / self.path.w if isinstance(self.path, Asymptotic) else None

    @property
    def reversal(self) -> arb | None:
        """How long before and after each `lower_turning` φ̇ changes its sign [s]; None if never."""
        if not isinstance(self.path, Nutating) or (part := self.path.reversal) is None:
            return None
        return part * self.path.period

    @property
    def modulus(self) -> tuple[arb, ...]:
        """The parameter m = k² of the elliptic functions and 1 − m; none where nothing nutates."""
        path = self.path
        return (path.roots.m, path.roots.mc) if isinstance(path, Nutating) else ()

    @property
    def growth(self) -> arb | None:
        """The rate w [1/s] at which an axis tends to the vertical; None where it does not."""
        return self.path.w if isinstance(self.path, Asymptotic) else None

    def theta(self, t: arb) -> arb:
        """θ [rad] alone."""
        return self._theta(self.path.tilt(t))

    def u(self, t: arb) -> arb:
        """The cosine of θ alone."""
        return self._cosine(self.path.tilt(t))

    def at(self, t: arb) -> ExactRecord:
        """Where the top is at a time since the start [s], every number a ball."""
        start, side, place = self.start, self.side, self.path.place(t)
        plus, minus = self.path.rates(place.from_top, place.from_bottom)
        tilt = place.from_top, place.from_bottom
        high, low = self._facing(tilt)
        sine, u, phi = high * low, self._cosine(tilt), self.phi0 + place.plus + place.minus
        sin_phi, cos_phi = phi.sin_cos()
        psi = self.psi0 + start.kappa * t + side * (place.plus - place.minus)
        return ExactRecord(
            t, self._theta(tilt), phi, psi,
            -side * place.rise, plus + minus, start.kappa + side * (plus - minus),
            u, high * high, low * low, side * place.rise * sine,
            (sine * sin_phi, -sine * cos_phi, u), place.n, start.kappa + start.b,
        )  # fmt: skip

    def _theta(self, tilt: Pair) -> arb:
        return 2 * arb.atan2(*self._facing(tilt))

    def _cosine(self, tilt: Pair) -> arb:
        high, low = self._facing(tilt)
        return (1 - high * high).intersection(low * low - 1)


def _hypot(least: arb, leg: arb) -> arb:
    """√(least + leg²), which is |leg| where `least` is exactly 0."""
    return abs(leg) if least.is_zero() else root_of(least + leg * leg)


def _nearest(x: arb) -> arb:
    """A whole number near x; either one will do where x is half way."""
    return (x.mid() + arb(0.5)).floor()


def floor(x: arb, names: str = _AT_A_POLE) -> arb:
    """The largest whole number not above x: what begins at a whole number has begun there."""
    low, high = x.lower().floor(), x.upper().floor()
    if low != high:
        raise TooFewBits(names, x - high)
    return low


def _side(x: arb) -> int:
    """1 from the lowest point on, −1 before."""
    return sign_of(x, _AT_A_POLE)
