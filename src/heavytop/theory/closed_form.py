"""The closed form at any number of digits: θ, φ, ψ at a time, the period and what turns in it.

Over a quarter period from the lower turning point u₁, with x = w t and s, c, d = sn, cn, dn
of (x|m), 1 − u = (1 − u₂) + (u₂ − u₁) c² and 1 + u = (1 + u₁) + (u₂ − u₁) s². The two halves of φ,

    Φ₊ = ½ P₊ ∫ dt/(1 + u) = ± arctan(β s / c d) + P₊ s³ R_J(c², d², 1, q) / 6w (u₃ − u₁),
        β² = (1 + u₂)(1 + u₃) / (1 + u₁)(u₃ − u₁),   q = 1 + s² (1 + u₁)/(u₃ − u₁),
    Φ₋ = ½ P₋ ∫ dt/(1 − u) = P₋/2w(1 − u₁) · (x + n s³ R_J(c², d², 1, (1 − u)/(1 − u₁)) / 3),
        n = (u₂ − u₁)/(1 − u₁),

are sums of terms of one sign, so that nothing cancels however close to a pole the axis passes;
the first is Legendre's Π with negative characteristic, turned over by Carlson's relation between
R_J at p and at q, (p − 1)(q − 1) = m s⁴ (DLMF 19.21.12).

An exact pass through a pole makes φ jump by +π (as time goes forward); ψ then jumps by −π at
θ = 0, where φ + ψ is continuous, and by +π at θ = π, where φ − ψ is. An axis that stays on the
vertical keeps its φ, and ψ takes the whole spin.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from heavytop.errors import NoClosedForm
from heavytop.theory.nutation import (
    Course,
    Nutation,
    course,
    nutation,
    upright,
)
from heavytop.theory.precision import Context, Number, context, number, vanishes
from heavytop.theory.reduced import Reduced


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
    u, one_minus_u, one_plus_u, udot : Number
        cos θ, 1 ∓ cos θ to their own digits, and d cos θ/dt [s⁻¹].
    axis : tuple of 3 Number
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    n : int
        The period of the nutation, counted from the one whose u₁ is nearest the start.
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
    axis: tuple[Number, Number, Number]
    n: int


class Place(NamedTuple):
    """Where the axis is at one time, seen upright: 1 ∓ u, −θ̇, Φ± since the start, the period."""

    one_minus_u: Number
    one_plus_u: Number
    rise: Number
    plus: Number
    minus: Number
    n: int


HARDLY = 1e-14  # unsteadiness that the rounding of a start in doubles brings about


def jacobi(ctx: Context, x: Number, mc: Number) -> tuple[Number, Number, Number]:
    """sn, cn, dn of (x|1 − mc) for |x| ≤ K/2, by descending Landen steps.

    Parameters
    ----------
    ctx : Context
        The precision.
    x : Number
        The argument.
    mc : Number
        The complementary parameter 1 − m, in (0, 1].
    """
    a, b, ratios = ctx.one, ctx.sqrt(mc), []
    c = ctx.sqrt(1 - mc)
    while abs(c) > ctx.eps * a:
        a, b, c = (a + b) / 2, ctx.sqrt(a * b), (a - b) / 2
        ratios.append(c / a)
    angle = ctx.ldexp(a * x, len(ratios))
    for ratio in reversed(ratios):
        angle = (angle + ctx.asin(ratio * ctx.sin(angle))) / 2
    sn, cn = ctx.sin(angle), ctx.cos(angle)
    return sn, cn, ctx.sqrt(cn**2 + mc * sn**2)


class Nodding:
    """An axis that nods between two turning points: elliptic functions of time.

    Parameters
    ----------
    roots : Nutation
        The turning points and the constants P±, m, w.
    """

    def __init__(self, roots: Nutation) -> None:
        ctx, over = roots.ctx, roots.upright
        self.ctx, self.roots = ctx, roots
        self.P_plus, self.P_minus, self.w = roots.P_plus, roots.P_minus, roots.w
        self.q_plus = 2 * over.g * roots.one_plus_u1 / (2 * self.w) ** 2  # (1+u1)/(u3-u1)
        self.k_plus = self.P_plus * over.g / (12 * self.w**3)
        self.k_minus = self.P_minus / (2 * self.w * roots.one_minus_u1)
        self.n_minus = roots.delta / roots.one_minus_u1
        self.beta = self._beta()
        self.K = ctx.elliprf(0, roots.mc, 1)
        self.T = 2 * self.K / self.w
        self._passes_top = not roots.one_minus_u2

    def _beta(self) -> Number:
        roots, ctx = self.roots, self.ctx
        if not roots.one_plus_u1:
            return ctx.inf
        return ctx.sqrt(roots.one_plus_u2 / roots.one_plus_u1 * (1 + self.q_plus))

    @cached_property
    def _turns(self) -> tuple[Number, Number]:
        """Φ± over one period; a period alone does not need them."""
        ctx, quarter = self.ctx, (self.ctx.one, self.ctx.zero, self.ctx.sqrt(self.roots.mc))
        plus = 2 * self.plus(*quarter)
        return plus, +ctx.pi if self._passes_top else 2 * self.minus(self.K, *quarter)

    @property
    def turn_plus(self) -> Number:
        """Φ₊ over one period."""
        return self._turns[0]

    @property
    def turn_minus(self) -> Number:
        """Φ₋ over one period."""
        return self._turns[1]

    @cached_property
    def _start(self) -> tuple[Number, Number, Number, Number]:
        """sn, cn, dn and x₀ in [−K, K) at the start.

        sn or cn comes from u̇₀ where its square would lose digits.
        """
        roots, over, ctx = self.roots, self.roots.upright, self.ctx
        s2, c2 = roots.down / roots.delta, roots.up / roots.delta
        d = ctx.sqrt(roots.mc + roots.m * c2)
        speed = over.udot0 / (2 * roots.delta * self.w * d)  # = sn cn
        if s2 <= c2:
            c = ctx.sqrt(c2)
            s = speed / c
        else:
            s = ctx.sqrt(s2) * (1 if speed > 0 else -1)
            c = speed / s
        return s, c, d, s * ctx.elliprf(c * c, d * d, 1)

    @property
    def x0(self) -> Number:
        """The argument of the elliptic functions at the start."""
        return self._start[3]

    @property
    def t0(self) -> Number:
        """Time since the lower turning point, at the start [s]."""
        return self.x0 / self.w

    @cached_property
    def plus0(self) -> Number:
        """Φ₊ at the start."""
        return self.plus(*self._start[:3])

    @cached_property
    def minus0(self) -> Number:
        """Φ₋ at the start."""
        return self.minus(self.x0, *self._start[:3])

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

    def plus(self, s: Number, c: Number, d: Number) -> Number:
        """Φ₊ since the lower turning point; half a turn across the bottom when it is passed."""
        ctx = self.ctx
        if not self.P_plus:
            return ctx.pi / 2 if s >= 0 else -ctx.pi / 2
        sweep = ctx.atan2(self.beta * s, c * d) * ctx.sign(self.P_plus)
        rest = ctx.elliprj(c * c, d * d, 1, 1 + self.q_plus * s * s)
        return sweep + self.k_plus * s**3 * rest

    def minus(self, x: Number, s: Number, c: Number, d: Number) -> Number:
        """Φ₋ since the lower turning point."""
        ctx, roots = self.ctx, self.roots
        if not self.P_minus:
            return ctx.zero
        p = (roots.one_minus_u2 + roots.delta * c * c) / roots.one_minus_u1
        return self.k_minus * (x + self.n_minus * s**3 * ctx.elliprj(c * c, d * d, 1, p) / 3)

    def reduced_time(self, t: Number) -> tuple[int, Number]:
        """The period n and the time in it since its lower turning point, in [−T/2, T/2)."""
        ctx, since = self.ctx, t + self.t0
        n = int(ctx.floor(since / self.T + ctx.mpf("0.5")))
        tau = since - n * self.T
        if 2 * tau >= self.T * (1 - 1024 * ctx.eps):  # a pass belongs to the period it opens
            return n + 1, tau - self.T
        return n, tau

    def functions(self, tau: Number) -> tuple[Number, Number, Number]:
        """sn, cn, dn at a time in [−T/2, T/2], measured from the nearer turning point."""
        ctx, mc = self.ctx, self.roots.mc
        side = -1 if tau < 0 else 1
        if 4 * abs(tau) <= self.T:
            s, c, d = jacobi(ctx, self.w * abs(tau), mc)
            return side * s, c, d
        s, c, d = jacobi(ctx, self.K - self.w * abs(tau), mc)
        kc = ctx.sqrt(mc)
        return side * c / d, kc * s / d, kc / d

    def place(self, t: Number) -> Place:
        """The place at time t."""
        ctx, roots = self.ctx, self.roots
        n, tau = self.reduced_time(t)
        s, c, d = self.functions(tau)
        above = roots.one_minus_u2 + roots.delta * c * c
        below = roots.one_plus_u1 + roots.delta * s * s
        # c/√(1 − u) and s/√(1 + u) stay finite at an exact pass through a pole
        over_top = c / ctx.sqrt(above) if roots.one_minus_u2 else 1 / ctx.sqrt(roots.delta)
        under = (
            s / ctx.sqrt(below)
            if roots.one_plus_u1
            else (1 if s >= 0 else -1) / ctx.sqrt(roots.delta)
        )
        rise = 2 * roots.delta * self.w * d * over_top * under
        plus = n * self.turn_plus + self.plus(s, c, d) - self.plus0
        minus = n * self.turn_minus + self.minus(self.w * tau, s, c, d) - self.minus0
        return Place(above, below, rise, plus, minus, n)


class Asymptotic:
    """An axis that comes from the vertical and returns to it: m = 1, 1 − u = (1 − u₁) sech² x.

    Here P₋ = 0 and Φ₊ = (P₊/4w) (x + r arctan(r tanh x)), r² = (1 − u₁)/(1 + u₁).
    """

    def __init__(self, over: Reduced) -> None:
        ctx, self.P_minus = over.ctx, over.ctx.zero
        self.ctx = ctx
        scale = over.g + over.kinetic0 + over.b**2
        planar = vanishes(ctx, over.b**2, scale) and vanishes(ctx, over.drift0**2, scale)
        self.P_plus = ctx.zero if planar else over.P_plus
        self.one_plus_u1 = self.P_plus**2 / (8 * over.g)  # b²/2g, from f'' = 0 at u₁
        self.one_minus_u1 = 2 - self.one_plus_u1
        self.w = ctx.sqrt(over.g * self.one_minus_u1 / 2)
        c0 = ctx.sqrt(over.one_minus_u0 / self.one_minus_u1)
        self.x0 = ctx.asinh(over.udot0 / (2 * self.w * self.one_minus_u1 * c0**3))
        self.plus0 = self.plus(self.x0)

    @property
    def mean_rates(self) -> tuple[Number, Number]:
        """Means of ½ P±/(1 ± u) [rad/s] over all time: those on the vertical."""
        return self.P_plus / 4, self.ctx.zero

    @property
    def turnings(self) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """1 ∓ u at u₁ and at the vertical."""
        return (self.one_minus_u1, self.one_plus_u1), (self.ctx.zero, 2 * self.ctx.one)

    def plus(self, x: Number) -> Number:
        """Φ₊ since the lowest point."""
        ctx = self.ctx
        if not self.P_plus:
            return ctx.pi / 2 if x >= 0 else -ctx.pi / 2
        r = ctx.sqrt(self.one_minus_u1 / self.one_plus_u1)
        return self.P_plus / (4 * self.w) * (x + r * ctx.atan(r * ctx.tanh(x)))

    def place(self, t: Number) -> Place:
        """The place at time t."""
        ctx = self.ctx
        x = self.w * t + self.x0
        c, s = ctx.sech(x), ctx.tanh(x)
        above = self.one_minus_u1 * c * c
        below = self.one_plus_u1 + self.one_minus_u1 * s * s
        under = s / ctx.sqrt(below) if below else 1 / ctx.sqrt(self.one_minus_u1)
        rise = 2 * self.w * c * under * ctx.sqrt(self.one_minus_u1)
        return Place(above, below, rise, self.plus(x) - self.plus0, ctx.zero, 0)


class Steady:
    """An axis of constant tilt: φ̇ = (a − b u₀)/sin²θ₀, or nothing when it is on the vertical."""

    def __init__(self, over: Reduced) -> None:
        self.ctx, self.over = over.ctx, over
        self.P_plus, self.P_minus = over.P_plus, over.P_minus
        if over.sin2:
            self.plus_rate = over.P_plus / (2 * over.one_plus_u0)
            self.minus_rate = over.P_minus / (2 * over.one_minus_u0)
        else:
            self.plus_rate, self.minus_rate = over.b / 2, -over.b / 2

    @property
    def mean_rates(self) -> tuple[Number, Number]:
        """The rates of Φ± [rad/s]."""
        return self.plus_rate, self.minus_rate

    @property
    def turnings(self) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """1 ∓ u, which stay what they are."""
        here = self.over.one_minus_u0, self.over.one_plus_u0
        return here, here

    def place(self, t: Number) -> Place:
        """The place at time t."""
        over, zero = self.over, self.ctx.zero
        plus, minus = self.plus_rate * t, self.minus_rate * t
        return Place(over.one_minus_u0, over.one_plus_u0, zero, plus, minus, 0)


def orbit(reduced: Reduced, digits: int) -> Nodding | Asymptotic | Steady:
    """The course of the axis, at a precision that leaves `digits` digits."""
    dps = max(60, digits + 50)
    seen = reduced.refined(context(dps))
    kind = course(seen)
    if kind is Course.STEADY:
        return Steady(upright(seen))
    if kind is Course.ASYMPTOTIC:
        return Asymptotic(upright(seen))
    try:
        return Nodding(nutation(reduced, digits))
    except NoClosedForm:  # at more digits still it turns out to be steady
        if not _hardly_moves(seen):
            raise
        return Steady(upright(seen))


def _hardly_moves(reduced: Reduced) -> bool:
    """Whether θ̇, φ̇ and θ̈ are no more than what rounding a start at rest brings about."""
    speeds = (reduced.udot0, reduced.drift0, reduced.kinetic0, reduced.taylor[1])
    return bool(sum(map(abs, speeds)) <= HARDLY * (abs(reduced.b) + reduced.b**2 + abs(reduced.g)))


class MPForm:
    """The closed form of one motion at `digits` decimal digits; call it with a time.

    Parameters
    ----------
    reduced : Reduced
        The motion. It is computed again at the precision the digits need.
    digits : int
        Decimal digits wanted; relative to max(1, |x|), for up to 1e20 periods.
    """

    def __init__(self, reduced: Reduced, digits: int = 50) -> None:
        self.digits = digits
        self.orbit = orbit(reduced, digits)
        self.ctx = self.orbit.ctx
        self._reduced = reduced.refined(self.ctx)
        self._side = -1 if reduced.g < 0 else 1

    @property
    def period(self) -> Number | None:
        """T [s], the period of θ; None where nothing nutates."""
        return self.orbit.T if isinstance(self.orbit, Nodding) else None

    @property
    def precession(self) -> Number | None:
        """Δφ [rad] in one period; None where nothing nutates."""
        if not isinstance(self.orbit, Nodding):
            return None
        return self.orbit.turn_plus + self.orbit.turn_minus

    @property
    def spin(self) -> Number | None:
        """Δψ [rad] in one period; None where nothing nutates."""
        if not isinstance(self.orbit, Nodding):
            return None
        turned = self._side * (self.orbit.turn_plus - self.orbit.turn_minus)
        return self._reduced.kappa * self.orbit.T + turned

    @property
    def tilts(self) -> tuple[Number, Number]:
        """θ [rad] between which it moves: at u₁ and at u₂, the same twice when it is steady."""
        one, other = self.orbit.turnings
        return self._tilt(*one), self._tilt(*other)

    @property
    def mean_rates(self) -> tuple[Number, Number]:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        plus, minus = self.orbit.mean_rates
        return (2 * plus, 2 * minus) if self._side > 0 else (2 * minus, 2 * plus)

    @property
    def lower_turning(self) -> Number | None:
        """The time [s] of one passage of θ through u₁ (θ_max if gMR ≥ 0); others are T apart."""
        return -self.orbit.t0 if isinstance(self.orbit, Nodding) else None

    def _tilt(self, above: Number, below: Number) -> Number:
        """θ [rad] from the upright 1 ∓ u."""
        if self._side < 0:
            above, below = below, above
        return 2 * self.ctx.atan2(self.ctx.sqrt(above), self.ctx.sqrt(below))

    def __call__(self, t: Any) -> ExactRecord:
        """Where the top is at time `t` [s], a number of any kind."""
        ctx, start, side = self.ctx, self._reduced, self._side
        time = number(ctx, t)
        place = self.orbit.place(time)
        above, below, rise, plus, minus, n = place
        theta = self._tilt(above, below)
        if side < 0:
            above, below = below, above
        phi = start.phi0 + plus + minus
        phidot, psidot = self._rates(place)
        sine = ctx.sqrt(above * below)
        u = 1 - above if above < below else below - 1
        return ExactRecord(
            time, theta, phi, start.psi0 + start.kappa * time + side * (plus - minus),
            -side * rise, phidot, psidot, u, above, below, side * rise * sine,
            (sine * ctx.sin(phi), -sine * ctx.cos(phi), u), n,
        )  # fmt: skip

    def _rates(self, place: Place) -> tuple[Number, Number]:
        """φ̇ and ψ̇."""
        start, path = self._reduced, self.orbit
        if isinstance(path, Steady):
            plus, minus = path.plus_rate, path.minus_rate
        else:
            plus = path.P_plus / (2 * place.one_plus_u) if path.P_plus else self.ctx.zero
            minus = path.P_minus / (2 * place.one_minus_u) if path.P_minus else self.ctx.zero
        return plus + minus, start.kappa + self._side * (plus - minus)
