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

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, NamedTuple, cast

from flint import acb, arb, fmpz

from heavytop.analytic.cubic import Roots, TooFewBits, root_of
from heavytop.classification.reduced import MotionSource, Reduced, Regime

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


@dataclass(frozen=True, slots=True)
class Record:
    """Where the top is and how it moves at one time; every number a ball, n the period."""

    theta: arb
    phi: arb
    psi: arb
    thetadot: arb
    phidot: arb
    psidot: arb
    u: arb
    one_minus_u: arb
    one_plus_u: arb
    udot: arb
    axis: tuple[arb, arb, arb]
    n: int
    omega3: arb

    @property
    def distances(self) -> tuple[arb, arb]:
        """1 − cos θ and 1 + cos θ."""
        return self.one_minus_u, self.one_plus_u

    @property
    def numbers(self) -> tuple[arb, ...]:
        """The angles θ, φ, ψ and their rates."""
        return self.theta, self.phi, self.psi, self.thetadot, self.phidot, self.psidot

    @property
    def quaternion(self) -> tuple[arb, arb, arb, arb]:
        """The attitude, body to space, scalar first."""
        cosine, sine = root_of(self.one_plus_u / 2), root_of(self.one_minus_u / 2)
        sin_plus, cos_plus = ((self.phi + self.psi) / 2).sin_cos()
        sin_minus, cos_minus = ((self.phi - self.psi) / 2).sin_cos()
        return cosine * cos_plus, sine * cos_minus, sine * sin_minus, cosine * sin_plus


class Nutating:
    """An axis between two turning points: elliptic functions of time."""

    def __init__(self, over: Reduced, regime: Regime) -> None:
        self.over, self.regime = over, regime
        self.roots = roots = Roots.of(over, regime)
        self.w = roots.w
        self.K = arb.pi() / (2 * arb(1).agm(roots.mc.sqrt()))
        self.period = 2 * self.K / roots.w

    @property
    def cosines(self) -> tuple[arb, ...]:
        """u₁, u₂ and, where g is not 0, u₃."""
        roots = self.roots
        return (roots.u1, roots.u2) if roots.u3 is None else (roots.u1, roots.u2, roots.u3)

    @property
    def turnings(self) -> tuple[Pair, Pair]:
        """√(1 ∓ u) at u₁ and at u₂."""
        roots = self.roots
        return (
            (root_of(roots.one_minus_u1), root_of(roots.one_plus_u1)),
            (root_of(roots.one_minus_u2), root_of(roots.one_plus_u2)),
        )

    @cached_property
    def turns(self) -> Pair:
        """Φ₊ and Φ₋ over a period; half a turn at an exact pass through a pole.

        These are P₊ Π(n₂|m)/w(1 + u₁) and P₋ Π(n₁|m)/w(1 − u₁), Legendre's integrals by Carlson's.
        """
        roots, over, regime = self.roots, self.over, self.regime
        plus = minus = arb.pi()
        if regime.misses_bottom:
            ratio = roots.one_plus_u2 / roots.one_plus_u1
            plus = over.P_plus / (roots.w * roots.one_plus_u1) * self.third_kind(ratio)
        if regime.misses_top:
            ratio = roots.one_minus_u2 / roots.one_minus_u1
            minus = over.P_minus / (roots.w * roots.one_minus_u1) * self.third_kind(ratio)
        elif not self.reaches_top:
            minus = arb(0)
        return plus, minus

    @property
    def reaches_top(self) -> bool:
        """Whether the axis passes exactly through the top."""
        return bool(self.roots.one_minus_u2.is_zero())

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, and the bottom."""
        return not self.reaches_top, self.regime.misses_bottom

    @property
    def mean_rates(self) -> Pair:
        """Means of ½ P±/(1 ± u) [rad/s]; jumps at passes through a pole are no part of them."""
        plus, minus = self.turns
        return (
            plus / self.period if self.regime.misses_bottom else arb(0),
            minus / self.period if self.regime.misses_top else arb(0),
        )

    @cached_property
    def phase(self) -> arb:
        """x₀/2K at the start, in [−½, ½]: 0 at u₁, ±½ at u₂."""
        roots, over = self.roots, self.over
        if self.regime.resting:
            return arb(0) if roots.down.is_zero() else arb(-1) / 2
        if not (over.udot0 > 0 or over.udot0 < 0):
            raise TooFewBits("d cos(theta)/dt at the start and 0", over.udot0)
        sign: arb = over.udot0.sgn()
        return sign * self._since_lower(roots.down, roots.up)

    def _since_lower(self, down: arb, up: arb) -> arb:
        """x/2K, in [0, ½], of the tilt u₁ + down = u₂ − up on the way up."""
        roots = self.roots
        s2, c2 = down / roots.delta, up / roots.delta
        x = s2.sqrt() * acb.elliptic_rf(acb(c2), acb(roots.mc + roots.m * c2), acb(1)).real
        return x / (2 * self.K)

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
    def halves(self) -> tuple[Callable[[arb], arb], Callable[[arb], arb]]:
        """Φ₊ and Φ₋ since the lower turning point, at a number of periods after it."""
        roots, over = self.roots, self.over
        turn_plus, turn_minus = self.turns
        plus: Callable[[arb], arb] = _Jumps(arb(0))
        minus: Callable[[arb], arb] = _Jumps(arb(1) / 2) if self.reaches_top else _nothing
        if self.regime.misses_bottom:
            v = first_kind((roots.one_plus_u1 / roots.delta).sqrt(), roots.m)
            plus = Sweeps(self, over.P_plus, turn_plus, v, arb(0))
        if self.regime.misses_top:
            lead = (
                over.P_minus * over.P_minus / (roots.one_minus_u1 * roots.one_minus_u2)
            )  # 2g (u₃ − 1)
            v = first_kind(
                2 * roots.w * (roots.one_minus_u2 / (roots.delta * lead)).sqrt(), roots.m
            )
            minus = Sweeps(self, over.P_minus, turn_minus, v, arb(1) / 2)
        return plus, minus

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

    def periods(self, t: arb) -> arb:
        """How many periods the time t is after the lower turning point nearest the start."""
        return t / self.period + self.phase

    def tilt(self, t: arb) -> Pair:
        """√(1 − u) and √(1 + u) at a time."""
        x = self.periods(t)
        sn, cn, _ = self._elliptic(x - _nearest(x))
        return self._distances(sn, cn)

    def place(self, t: arb) -> Position:
        """The place at a time."""
        roots, x = self.roots, self.periods(t)
        z = x - (floor(x + arb(1) / 2) if self.reaches_top else _nearest(x))
        sn, cn, dn = self._elliptic(z)
        from_top, from_bottom = self._distances(sn, cn)
        # cn/√(1 − u) and sn/√(1 + u) stay finite at an exact pass through a pole
        over_top = 1 / roots.delta.sqrt() if self.reaches_top else cn / from_top
        under = sn / from_bottom
        if not self.regime.misses_bottom:
            under = _side(z) / roots.delta.sqrt()
        (plus, minus), (plus0, minus0) = (half(x) for half in self.halves), self.at_start
        return Position(
            from_top, from_bottom, 2 * roots.delta * roots.w * dn * over_top * under,
            plus - plus0, minus - minus0, _whole((x + arb(1) / 2).mid().floor()),
        )  # fmt: skip

    def _distances(self, sn: arb, cn: arb) -> Pair:
        size = self.roots.delta.sqrt()
        return (
            _hypot(self.roots.one_minus_u2, cn * size), _hypot(self.roots.one_plus_u1, sn * size)
        )  # fmt: skip

    def _elliptic(self, z: arb) -> tuple[arb, arb, arb]:
        """The functions sn, cn and dn of 2K z."""
        m, mc = self.roots.m, self.roots.mc
        if self.tau is None:
            s, c = z.sin_cos_pi()
            return s, c, arb(1)
        one, two, three, four = (th.real for th in acb.modular_theta(acb(z), acb(0, self.tau)))
        m4, mc4 = m.sqrt().sqrt(), mc.sqrt().sqrt()
        return one / (four * m4), two * mc4 / (four * m4), mc4 * three / four

    def third_kind(self, p: arb) -> arb:
        """Π(1 − p|m), complete."""
        rest = acb.elliptic_rj(acb(0), acb(self.roots.mc), acb(1), acb(p)).real
        return self.K + (1 - p) * rest / 3


class Sweeps:
    """Φ₊ or Φ₋ of an axis that passes beside the pole: a multiple of time and an argument of θ₁."""

    def __init__(self, path: Nutating, P: arb, turn: arb, v: arb, own: arb) -> None:
        self.sign = 1 if P > 0 else -1
        self.tau, self.beta, self.own = path.tau, v / (2 * path.K), own
        self.rate = turn - self.sign * arb.pi()

    def __call__(self, periods: arb) -> arb:
        """Φ₊ or Φ₋, but for what it is at the lower turning point."""
        x = periods - self.own
        return self.rate * x + self.swept(x)

    def swept(self, x: arb) -> arb:
        """The argument, at a number of periods since a turning point beside the pole."""
        n = _nearest(x)
        z = acb(x - n, self.beta)
        if not abs(x - n) < 1:
            raise TooFewBits("the time and a number of periods", x - n)
        theta = z.sin_pi() if self.tau is None else acb.modular_theta(z, acb(0, self.tau))[0]
        return self.sign * (arb.pi() * n - (theta / acb(0, 1)).arg())


class _Jumps:
    """Φ₊ or Φ₋ of an axis that passes exactly through the pole: half a turn at each pass."""

    def __init__(self, own: arb) -> None:
        self.own = own

    def __call__(self, periods: arb) -> arb:
        return arb.pi() * (floor(periods - self.own) + arb(1) / 2)


class Asymptotic:
    """An axis that comes from the top and returns to it: 1 − u = (1 − u₁) sech² x, x = w t + x₀."""

    period = None

    def __init__(self, over: Reduced, regime: Regime) -> None:
        self.over, self.planar = over, not regime.misses_bottom
        self.one_plus_u1 = arb(0) if self.planar else over.b * over.b / (2 * over.g)
        self.one_minus_u1 = 2 - self.one_plus_u1
        self.w = (over.g * self.one_minus_u1 / 2).sqrt()
        self.x0 = arb(0)
        if not regime.resting:
            c0 = (over.one_minus_u0 / self.one_minus_u1).sqrt()
            self.x0 = (over.udot0 / (2 * self.w * self.one_minus_u1 * c0**3)).asinh()

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, which it tends to, and the bottom."""
        return True, not self.planar

    @property
    def cosines(self) -> tuple[arb, ...]:
        """u₁ and twice 1."""
        return self.one_plus_u1 - 1, arb(1), arb(1)

    @property
    def turnings(self) -> tuple[Pair, Pair]:
        """√(1 ∓ u) at u₁ and on the top, which is never reached."""
        lowest = self.one_minus_u1.sqrt(), root_of(self.one_plus_u1)
        return lowest, (arb(0), arb(2).sqrt())

    @property
    def mean_rates(self) -> Pair:
        """Means of ½ P±/(1 ± u) [rad/s] over all time: those on the vertical."""
        return arb(0) if self.planar else self.over.P_plus / 4, arb(0)

    def tilt(self, t: arb) -> Pair:
        """√(1 − u) and √(1 + u) at a time."""
        x, size = self.w * t + self.x0, self.one_minus_u1.sqrt()
        return size * x.sech(), _hypot(self.one_plus_u1, size * x.tanh())

    def place(self, t: arb) -> Position:
        """The place at a time."""
        x, size = self.w * t + self.x0, self.one_minus_u1.sqrt()
        from_top, from_bottom = self.tilt(t)
        under = _side(x) / size if self.planar else x.tanh() / from_bottom
        rise = 2 * self.w * x.sech() * under * size
        return Position(from_top, from_bottom, rise, self._plus(x) - self._plus(self.x0), arb(0), 0)

    def _plus(self, x: arb) -> arb:
        """Φ₊ since the lowest point."""
        along: arb = self.mean_rates[0] * x / self.w
        return along + self.swept(x)

    def swept(self, x: arb) -> arb:
        """Φ₊ but for what is proportional to time: r P₊/4w arctan(r tanh x).

        Here r² = (1 − u₁)/(1 + u₁), and r P₊/4w = ±1.
        """
        if self.planar:
            return _side(x) * arb.pi() / 2
        r = (self.one_minus_u1 / self.one_plus_u1).sqrt()
        angle: arb = r * self.mean_rates[0] / self.w * (r * x.tanh()).atan()
        return angle


class Steady:
    """An axis of constant tilt: u₀ is a double root of f, and no root is looked for."""

    period = None
    w = None

    def __init__(self, over: Reduced, regime: Regime) -> None:
        self.over, self.weightless = over, regime.weightless
        if over.one_minus_u0.is_zero() or over.one_plus_u0.is_zero():
            self.mean_rates = over.b / 2, -over.b / 2
        else:
            self.mean_rates = (
                over.P_plus / (2 * over.one_plus_u0), over.P_minus / (2 * over.one_minus_u0)
            )  # fmt: skip

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, and the bottom."""
        over = self.over
        return not over.one_minus_u0.is_zero(), not over.one_plus_u0.is_zero()

    @property
    def cosines(self) -> tuple[arb, ...]:
        """Twice u₀ and, where g is not 0, the root that is left, in order."""
        over, u0 = self.over, self.over.u0
        if self.weightless:
            return u0, u0
        single = (2 * over.kinetic0 + over.b * over.b) / (2 * over.g) - u0  # from their sum
        return u0.min(single), u0, u0.max(single)

    @property
    def turnings(self) -> tuple[Pair, Pair]:
        """√(1 ∓ u₀), twice."""
        here = root_of(self.over.one_minus_u0), root_of(self.over.one_plus_u0)
        return here, here

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

    @property
    def cosines(self) -> tuple[arb, ...]:
        """The roots u₁ ≤ u₂ ≤ u₃ of the cubic as cos θ; the infinite one is missing if g = 0."""
        found = self.path.cosines
        return found if self.side > 0 else tuple(-u for u in reversed(found))

    @property
    def tilts(self) -> Pair:
        """θ [rad] between which it moves: at u₁ and at u₂, the same twice when it is steady."""
        one, other = self.path.turnings
        return self._theta(*one), self._theta(*other)

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
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, θ = 0, and the bottom."""
        one, other = self.path.avoids
        return (one, other) if self.side > 0 else (other, one)

    @property
    def mean_rates(self) -> Pair:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        plus, minus = self.path.mean_rates
        return (2 * plus, 2 * minus) if self.side > 0 else (2 * minus, 2 * plus)

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

    def theta(self, t: arb) -> arb:
        """θ [rad] alone."""
        return self._theta(*self.path.tilt(t))

    def u(self, t: arb) -> arb:
        """The cosine of θ alone."""
        return self._cosine(*self.path.tilt(t))

    def at(self, t: arb) -> Record:
        """Where the top is at a time since the start [s]."""
        start, side = self.start, self.side
        place = self.path.place(t)
        high, low = place.from_top, place.from_bottom
        phi = self.phi0 + place.plus + place.minus
        psi = self.psi0 + start.kappa * t + side * (place.plus - place.minus)
        phidot, psidot = self._rates(place)
        sine, u = high * low, self._cosine(high, low)
        if side < 0:
            high, low = low, high
        sin_phi, cos_phi = phi.sin_cos()
        return Record(
            2 * arb.atan2(high, low), phi, psi, -side * place.rise, phidot, psidot,
            u, high * high, low * low, side * place.rise * sine,
            (sine * sin_phi, -sine * cos_phi, u), place.n,
            start.kappa + start.b,
        )  # fmt: skip

    def _rates(self, place: Position) -> Pair:
        """φ̇ and ψ̇; where P± = 0 nothing of that half is left, not even on the pole."""
        path, over = self.path, self.path.over
        if isinstance(path, Steady):
            plus, minus = path.mean_rates
        else:
            plus = minus = arb(0)
            if self.regime.misses_bottom:
                plus = over.P_plus / (2 * place.from_bottom**2)
            if self.regime.misses_top:
                minus = over.P_minus / (2 * place.from_top**2)
        return plus + minus, self.start.kappa + self.side * (plus - minus)

    def _theta(self, high: arb, low: arb) -> arb:
        return 2 * (arb.atan2(low, high) if self.side < 0 else arb.atan2(high, low))

    def _cosine(self, high: arb, low: arb) -> arb:
        u = (1 - high * high).intersection(low * low - 1)
        return -u if self.side < 0 else u


def first_kind(tangent: arb, mc: arb) -> arb:
    """F(arctan tangent | 1 − mc)."""
    t2 = tangent * tangent
    return tangent * acb.elliptic_rf(acb(1), acb(1 + mc * t2), acb(1 + t2)).real


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


def _whole(x: arb) -> int:
    return int(cast(fmpz, x.unique_fmpz()))


def _side(x: arb) -> int:
    """1 from the lowest point on, −1 before."""
    if x >= 0:
        return 1
    if x < 0:
        return -1
    raise TooFewBits(_AT_A_POLE, x)


def _nothing(_: arb) -> arb:
    return arb(0)
