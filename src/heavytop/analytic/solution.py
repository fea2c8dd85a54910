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
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Final, NamedTuple, TypeVar, cast

from flint import arb, fmpz

from heavytop.analytic.cubic import Roots, TooFewBits, root_of, sign_of
from heavytop.analytic.elliptic import Jacobi, first_kind, third_kind
from heavytop.classification.reduced import Reduced, Regime
from heavytop.exact.decimals import Number

T = TypeVar("T")
Pair = tuple[arb, arb]

_AT_A_POLE: Final = "the time and that of a pass through a pole"


@dataclass(frozen=True, slots=True)
class ExactRecord:
    """Where the top is and how it moves at one time, in mpmath numbers.

    Parameters
    ----------
    t : Number
        Time since the start [s].
    theta, phi, psi : Number
        Euler angles [rad]; φ and ψ continuous from the start, never reduced.
    thetadot, phidot, psidot : Number
        Their rates [rad/s].
    u, one_minus_u, one_plus_u, udot, uddot : Number
        cos θ, 1 ∓ cos θ to their own digits, d cos θ/dt [s⁻¹] and d² cos θ/dt² [s⁻²].
    axis : tuple of 3 Number
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    n : int
        The period of the nutation, counted from the one whose u₁ is nearest the start.
    omega3, energy : Number
        What is constant: the angular velocity about the symmetry axis [rad/s], and E [J], which
        `Motion.at` knows; None where the moments are not known.
    """

    t: Number
    theta: Number
    phi: Number
    psi: Number
    thetadot: Number
    phidot: Number
    psidot: Number
    u: Number
    one_minus_u: Number
    one_plus_u: Number
    udot: Number
    uddot: Number
    axis: tuple[Number, Number, Number]
    n: int
    omega3: Number = None
    energy: Number = None

    @property
    def quaternion(self) -> tuple[Number, Number, Number, Number]:
        """The attitude, body to space, scalar first."""
        cosine, sine = _root(self.one_plus_u / 2), _root(self.one_minus_u / 2)
        sin_plus, cos_plus = _sin_cos((self.phi + self.psi) / 2)
        sin_minus, cos_minus = _sin_cos((self.phi - self.psi) / 2)
        return cosine * cos_plus, sine * cos_minus, sine * sin_minus, cosine * sin_plus

    @property
    def omega(self) -> tuple[Number, Number, Number]:
        """The angular velocity in space [rad/s]: ω₃ along the axis, and e × ė."""
        sine, (sin, cos) = _root(self.one_minus_u * self.one_plus_u), _sin_cos(self.phi)
        across = (self.omega3 - self.phidot * self.u) * sine
        upright = self.omega3 * self.u + self.phidot * sine * sine
        return self.thetadot * cos + across * sin, self.thetadot * sin - across * cos, upright


class Position(NamedTuple):
    """Where the axis is at one time, seen with g ≥ 0: √(1 ∓ u), −θ̇, Φ± since the start, n."""

    from_top: arb
    from_bottom: arb
    rise: arb
    plus: arb
    minus: arb
    n: int


class Path:
    """The motion of the axis, seen with g ≥ 0: u = u₁ + (u₂ − u₁) sn² (w t + x₀).

    `ends` are 1 ∓ u at u₁ and at u₂, `size` is √(u₂ − u₁), `third` the root of f that is left,
    `modulus` m and 1 − m, and `growth` the rate w at which the axis tends to the top.
    """

    w: arb
    size: arb
    ends: tuple[Pair, Pair]
    third: arb | None
    period: arb | None = None
    growth: arb | None = None
    modulus: tuple[arb, ...] = ()

    def __init__(self, over: Reduced, regime: Regime) -> None:
        self.over, self.regime = over, regime

    @cached_property
    def turnings(self) -> tuple[Pair, Pair]:
        """√(1 ∓ u) at u₁ and at u₂."""
        (high, low), (above, below) = self.ends
        return (root_of(high), root_of(low)), (root_of(above), root_of(below))

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, and the bottom."""
        (_, low), (high, _) = self.ends
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

    def _tilt(self, sn: arb, cn: arb) -> Pair:
        """√(1 − u) and √(1 + u), which is a leg alone where the other is exactly 0."""
        (_, low), (high, _) = self.ends
        across, along = self.size * cn, self.size * sn
        return (
            abs(across) if high.is_zero() else root_of(high + across * across),
            abs(along) if low.is_zero() else root_of(low + along * along),
        )

    def _place(self, sn: arb, cn: arb, dn: arb, plus: arb, minus: arb, n: int) -> Position:
        """The place; at an exact pass through a pole √(1 ∓ u) is all of one leg, cn ≥ 0 or sn."""
        (_, low), (high, _) = self.ends
        from_top, from_bottom = self._tilt(sn, cn)
        across = arb(1) if high.is_zero() else self.size * cn / from_top
        along = arb(sign_of(sn, _AT_A_POLE)) if low.is_zero() else self.size * sn / from_bottom
        return Position(from_top, from_bottom, 2 * self.w * dn * across * along, plus, minus, n)


class Nutating(Path):
    """An axis between two turning points: elliptic functions of time."""

    def __init__(self, over: Reduced, regime: Regime) -> None:
        super().__init__(over, regime)
        self.roots = roots = Roots.of(over, regime)
        self.K = arb.pi() / (2 * arb(1).agm(roots.mc.sqrt()))
        self.period: arb = 2 * self.K / roots.w
        self.modulus = roots.m, roots.mc
        self.w, self.size, self.third = roots.w, roots.delta.sqrt(), roots.u3
        lowest = roots.one_minus_u1, roots.one_plus_u1
        self.ends = lowest, (roots.one_minus_u2, roots.one_plus_u2)

    @property
    def reaches_top(self) -> bool:
        """Whether the axis passes exactly through the top."""
        return not self.avoids[0]

    @cached_property
    def halves(self) -> tuple[Sweeps | Jumps, Sweeps | Jumps]:
        """Φ₊ and Φ₋ since the lower turning point, at a number of periods after it."""
        roots, over, regime = self.roots, self.over, self.regime
        plus: Sweeps | Jumps
        minus: Sweeps | Jumps
        if regime.misses_bottom:
            pole = roots.one_plus_u1, roots.delta
            plus = Sweeps(self, over.P_plus, roots.one_plus_u1, roots.one_plus_u2, pole, arb(0))
        else:
            plus = Jumps(arb.pi(), arb(0))
        if regime.misses_top:
            beyond = over.P_minus * over.P_minus / (roots.one_minus_u1 * roots.one_minus_u2)
            pole = 4 * roots.w * roots.w * roots.one_minus_u2, roots.delta * beyond  # 2g (u₃ − 1)
            minus = Sweeps(
                self, over.P_minus, roots.one_minus_u1, roots.one_minus_u2, pole, arb(0.5)
            )
        else:
            minus = Jumps(arb.pi() if self.reaches_top else arb(0), arb(0.5))
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
        least = down.min(up)
        if least <= 0 or sign_of(least, "the tilts of a turning point and of phidot = 0") < 0:
            return None
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
        x = t / self.period + self.phase
        if not x.is_finite():
            raise TooFewBits("the time and that of a turning point", x)
        return x

    def tilt(self, t: arb) -> Pair:
        """√(1 − u) and √(1 + u) at a time."""
        x = self.periods(t)
        sn, cn, _ = self.jacobi.functions(x - _nearest(x))
        return self._tilt(sn, cn)

    def place(self, t: arb) -> Position:
        """The place at a time."""
        x = self.periods(t)
        nearest = floor(x + arb(0.5)) if self.reaches_top else _nearest(x)
        n = int(cast(fmpz, nearest.mid().unique_fmpz()))
        plus, minus = (half(x) - at0 for half, at0 in zip(self.halves, self.at_start, strict=True))
        return self._place(*self.jacobi.functions(x - nearest), plus, minus, n)


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
        self.turn = P / (path.roots.w * at_u1) * third_kind(path.roots.mc, at_u2 / at_u1)
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
        return self.sign * (arb.pi() * n + self.path.jacobi.argument(x - n, self.beta))


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
        self.size, self.third = self.one_minus_u1.sqrt(), arb(1)
        self.ends = (self.one_minus_u1, self.one_plus_u1), (arb(0), arb(2))
        self.w = self.growth = (over.g * self.one_minus_u1 / 2).sqrt()
        c0 = (over.one_minus_u0 / self.one_minus_u1).sqrt()
        self.x0 = (over.udot0 / (2 * self.w * self.one_minus_u1 * c0**3)).asinh()

    @property
    def avoids(self) -> tuple[bool, bool]:
        """Whether the axis never meets the top, which it tends to, and the bottom."""
        return True, not self.planar

    def tilt(self, t: arb) -> Pair:
        """√(1 − u) and √(1 + u) at a time."""
        x = self.w * t + self.x0
        return self._tilt(x.tanh(), x.sech())

    def place(self, t: arb) -> Position:
        """The place at a time."""
        x = self.w * t + self.x0
        plus = self.mean_rates[0] * t + self.swept(x) - self.swept(self.x0)
        return self._place(x.tanh(), x.sech(), x.sech(), plus, arb(0), 0)

    def swept(self, x: arb) -> arb:
        """Φ₊ but for what is proportional to time: ± arctan(r tanh x), r² = (1 − u₁)/(1 + u₁).

        The sign is that of P₊ = ± 4w/r.
        """
        if self.planar:
            return sign_of(x, _AT_A_POLE) * arb.pi() / 2
        size, floor = self.turnings[0]
        return sign_of(self.over.P_plus, "P+ and 0") * (size / floor * x.tanh()).atan()


class SteadyPath(Path):
    """An axis of constant tilt: u₀ is a double root of f, and no root is looked for."""

    def __init__(self, over: Reduced, regime: Regime) -> None:
        super().__init__(over, regime)
        here = over.one_minus_u0, over.one_plus_u0
        self.ends, self.third = (here, here), None
        if not regime.weightless:  # from the sum of the roots
            self.third = (2 * over.kinetic0 + over.b * over.b) / (2 * over.g) - over.u0

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

    def __init__(self, given: Reduced, angles: Pair, regime: Regime) -> None:
        # a g that only counts as 0 would be a ball around it, which no precision makes small enough
        self.start = replace(given, g=arb(0)) if regime.weightless else given
        self.phi0, self.psi0 = angles
        self.regime, self.side = regime, -1 if regime.mirrored else 1
        over = self.start.mirrored() if regime.mirrored else self.start
        kind = SteadyPath if regime.steady else Asymptotic if regime.asymptotic else Nutating
        self.path: Nutating | Asymptotic | SteadyPath = kind(over, regime)

    def _facing(self, both: tuple[T, T]) -> tuple[T, T]:
        """What belongs to the top and the bottom as seen with g ≥ 0, for θ = 0 and θ = π."""
        one, other = both
        return (one, other) if self.side > 0 else (other, one)

    @property
    def cosines(self) -> tuple[arb, ...]:
        """The roots u₁ ≤ u₂ ≤ u₃ of the cubic as cos θ; the infinite one is missing if g = 0."""
        found = [_cosine(*self._facing(end)) for end in self.path.ends]
        if self.path.third is not None:
            found.append(self.side * self.path.third)
        return tuple(sorted(found, key=lambda u: u.mid()))

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
    def turned(self) -> tuple[arb, ...]:
        """Δφ, Δψ and Δψ − κT [rad] in one period; none of them where nothing nutates."""
        if not isinstance(self.path, Nutating):
            return ()
        plus, minus = self.path.turns
        spin = self.side * (plus - minus)
        return plus + minus, self.start.kappa * self.path.period + spin, spin

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

    def theta(self, t: arb) -> arb:
        """θ [rad] alone."""
        return self._theta(self.path.tilt(t))

    def u(self, t: arb) -> arb:
        """The cosine of θ alone."""
        high, low = self._facing(self.path.tilt(t))
        return _cosine(high * high, low * low)

    def at(self, t: arb) -> ExactRecord:
        """Where the top is at a time since the start [s], every number a ball."""
        start, side, place = self.start, self.side, self.path.place(t)
        plus, minus = self.path.rates(place.from_top, place.from_bottom)
        tilt = place.from_top, place.from_bottom
        high, low = self._facing(tilt)
        one_minus_u, one_plus_u, sine = high * high, low * low, high * low
        phi = self.phi0 + place.plus + place.minus
        sin_phi, cos_phi = phi.sin_cos()
        u = _cosine(one_minus_u, one_plus_u)
        psi = self.psi0 + start.kappa * t + side * (place.plus - place.minus)
        uddot = (
            start.b * (start.a - start.b * u) - start.g * sine**2 - 2 * (start.h - start.g * u) * u
        )
        return ExactRecord(
            t, self._theta(tilt), phi, psi,
            -side * place.rise, plus + minus, start.kappa + side * (plus - minus),
            u, one_minus_u, one_plus_u, side * place.rise * sine, uddot,
            (sine * sin_phi, -sine * cos_phi, u), place.n, start.kappa + start.b,
        )  # fmt: skip

    def _theta(self, tilt: Pair) -> arb:
        return 2 * arb.atan2(*self._facing(tilt))


def _cosine(one_minus_u: arb, one_plus_u: arb) -> arb:
    return (1 - one_minus_u).intersection(one_plus_u - 1)


def _nearest(x: arb) -> arb:
    """A whole number near x; either one will do where x is half way."""
    return (x.mid() + arb(0.5)).mid().floor()


def floor(x: arb, names: str = _AT_A_POLE) -> arb:
    """The largest whole number not above x: what begins at a whole number has begun there."""
    low, high = x.lower().floor(), x.upper().floor()
    if low != high:
        raise TooFewBits(names, x - high)
    return low


def each(kind: Callable[[arb], Any], found: Any) -> Any:
    """What was found, a ball, a tuple, a record or None, with every ball turned into `kind`."""
    if isinstance(found, arb):
        return kind(found)
    if isinstance(found, tuple):
        return tuple(each(kind, part) for part in found)
    if isinstance(found, ExactRecord):
        return ExactRecord(*(each(kind, getattr(found, field.name)) for field in fields(found)))
    return found


def _root(x: Any) -> Any:
    return root_of(x) if isinstance(x, arb) else x.sqrt()


def _sin_cos(x: Any) -> tuple[Any, Any]:
    return x.sin_cos() if isinstance(x, arb) else (x.context.sin(x), x.context.cos(x))
