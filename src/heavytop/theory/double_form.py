"""The closed form in doubles, for whole arrays of times: good to the last digits at any time.

The formulas are those of `closed_form`, which also supplies every constant, at forty digits or
more. What is different is how the digits are kept:

- times are reduced by n periods, with T cut into parts so short that n times a part is exact
  (Cody & Waite), and what is left is carried as a sum of two doubles, so that it has all its
  digits even close to a turning point;
- sn, cn, dn come from Jacobi's theta series in the nome of m or, for m > ½, of 1 − m, measured
  from the nearer turning point, where each has its digits too;
- φ and ψ are counted in turns when they are wanted modulo 2π.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.errors import NoClosedForm, NotANumber
from heavytop.theory.carlson import elliprj
from heavytop.theory.closed_form import Asymptotic, Nodding, Steady, orbit
from heavytop.theory.nutation import Nutation
from heavytop.theory.precision import Context, Number
from heavytop.theory.reduced import Reduced

Array: TypeAlias = npt.NDArray[np.float64]
"""Doubles, one for each time."""

MOST_PERIODS = 2**31
"""Periods up to which n times a part of T is exact: 22 bits of the part and 31 of n."""

_PART_BITS = 22
_DIGITS = 18
_EDGE = 1e-30  # of a period: a time this close before a pass counts as the pass


@dataclass(frozen=True, slots=True)
class DoubleRecord:
    """Where the top is and how it moves at given times.

    Parameters
    ----------
    t : array
        Times since the start [s]; every other field has the same shape, `axis` one more.
    theta, phi, psi : array
        Euler angles [rad]; φ and ψ continuous from the start, never reduced.
    phi_mod, psi_mod : array
        φ and ψ modulo 2π, in [0, 2π), to the digits they have even after 1e9 periods [rad].
    thetadot, phidot, psidot : array
        Their rates [rad/s].
    u, one_minus_u, one_plus_u, udot, uddot : array
        cos θ, 1 ∓ cos θ to their own digits, d cos θ/dt [s⁻¹] and d² cos θ/dt² [s⁻²].
    axis : array (…, 3)
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    n : array of int
        The period of the nutation, counted from the one whose u₁ is nearest the start.
    """

    t: Array
    theta: Array
    phi: Array
    psi: Array
    phi_mod: Array
    psi_mod: Array
    thetadot: Array
    phidot: Array
    psidot: Array
    u: Array
    one_minus_u: Array
    one_plus_u: Array
    udot: Array
    uddot: Array
    axis: Array
    n: npt.NDArray[np.int64]


class Double2(NamedTuple):
    """A number as the unevaluated sum of two doubles."""

    hi: float
    lo: float


class _Place(NamedTuple):
    """1 ∓ u, −θ̇ and ü seen upright, Φ± in the period, the period."""

    one_minus_u: Array
    one_plus_u: Array
    rise: Array
    uddot: Array
    plus: Array
    minus: Array
    n: Array


def two_sum(a: Array, b: Array | float) -> tuple[Array, Array]:
    """The sum a + b, and the rounding error of that sum, exactly (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def two_product(a: Array, b: float) -> tuple[Array, Array]:
    """The product a × b, and the rounding error of that product, exactly (Dekker)."""
    product = a * b
    a1 = a * 134217729.0
    a1 = a1 - (a1 - a)
    b1 = b * 134217729.0
    b1 = b1 - (b1 - b)
    a2, b2 = a - a1, b - b1
    return product, a2 * b2 - (((product - a1 * b1) - a2 * b1) - a1 * b2)


def _double2(value: Number) -> Double2:
    hi = float(value)
    return Double2(hi, float(value - hi))


def _parts(ctx: Context, value: Number) -> tuple[float, ...]:
    """`value` cut into three parts of 22 bits and a rest."""
    parts = []
    for _ in range(3):
        shift = _PART_BITS - ctx.mag(value) if value else 0
        part = ctx.ldexp(ctx.nint(ctx.ldexp(value, shift)), -shift)
        parts.append(float(part))
        value = value - part
    return (*parts, float(value))


class _Angle:
    """An angle start + n turn + rate t + local, whole or modulo 2π."""

    def __init__(self, ctx: Context, start: Number, turn: Number, rate: Number) -> None:
        circle = 2 * ctx.pi
        self._whole = _double2(start), _parts(ctx, turn), _double2(rate)
        turns = turn / circle
        self._turns = (
            _double2(start / circle - ctx.nint(start / circle)),
            _parts(ctx, turns - ctx.nint(turns)),
            _double2(rate / circle),
        )

    def whole(self, n: Array, t: Array, t_lo: Array | float, local: Array) -> Array:
        """The angle [rad], continuous."""
        start, turn, rate = self._whole
        total, rest = two_product(t, rate.hi)
        rest = rest + (rate.lo * t + rate.hi * t_lo + start.lo + n * turn[3])
        for term in (n * turn[0], n * turn[1], n * turn[2], np.full_like(t, start.hi), local):
            total, error = two_sum(total, term)
            rest = rest + error
        return total + rest

    def modulo(self, n: Array, t: Array, t_lo: Array | float, local: Array) -> Array:
        """The angle [rad] in [0, 2π): whole turns are dropped before anything is rounded."""
        start, turn, rate = self._turns
        total, rest = two_product(t, rate.hi)
        total = total - np.rint(total)
        rest = rest + (rate.lo * t + rate.hi * t_lo + start.lo + n * turn[3])
        for part in turn[:3]:
            total, error = two_sum(total, n * part - np.rint(n * part))
            rest = rest + error
        total = total + start.hi + rest
        circle = 2 * np.pi
        angle = np.mod(circle * (total - np.rint(total)) + local, circle)
        return np.where(angle >= circle, 0.0, angle)


class _Theta:
    """sn, cn, dn by theta series, at times no further than T/4 from the lower turning point.

    With S, C and C₂ = sin z, cos z, cos 2z (m ≤ ½), or their hyperbolic counterparts (m > ½,
    nome of 1 − m, by Jacobi's imaginary transformation), the series are the same; twelve
    is the highest power of the nome (≤ 0.0433) that reaches the last digit.
    """

    def __init__(self, roots: Nutation, K: Number, w: Number) -> None:
        ctx = roots.ctx
        K_other = ctx.elliprf(0, roots.m, 1)
        self._hyperbolic = roots.m > roots.mc
        here, there = (K_other, K) if self._hyperbolic else (K, K_other)
        q = ctx.exp(-ctx.pi * there / here)
        theta2 = 1 + q**2 + q**6 + q**12 + q**20
        theta3, theta4 = (
            1 + 2 * sum((sign * q) ** (k * k) for k in range(1, 9)) for sign in (1, -1)
        )
        one, other = (theta4, theta2) if self._hyperbolic else (theta2, theta4)
        self._scale = tuple(map(float, (theta3 / one, other / one, other / theta3)))
        self._rate = float(ctx.pi * w / (2 * here))
        self._q = tuple(float(q**k) for k in (1, 2, 4, 6, 9, 12))

    def __call__(self, t: Array) -> tuple[Array, Array, Array]:
        """sn, cn, dn at the times t ≥ 0."""
        z = self._rate * t
        q1, q2, q4, q6, q9, q12 = self._q
        if self._hyperbolic:
            S, C = np.sinh(z), np.cosh(z)
        else:
            S, C = np.sin(z), np.cos(z)
        C2 = 2 * C * C - 1
        C4 = 2 * C2 * C2 - 1
        C6 = C2 * (2 * C4 - 1)
        odd1, odd2, odd3 = 1 + 2 * C2, 1 + 2 * (C2 + C4), 1 + 2 * (C2 + C4 + C6)
        one = S * (1 - q2 * odd1 + q6 * odd2 - q12 * odd3)
        two = C * (
            1 + q2 * (2 * C2 - 1) + q6 * (1 - 2 * C2 + 2 * C4) + q12 * (2 * (C6 - C4 + C2) - 1)
        )
        even, odd = 2 * q4 * C4, 2 * (q1 * C2 + q9 * C6)
        three, four = 1 + even + odd, 1 + even - odd
        below, beside = (two, four) if self._hyperbolic else (four, two)
        sn, cn, dn = self._scale
        return sn * one / below, cn * beside / below, dn * three / below


class _NoddingDouble:
    """`closed_form.Nodding` in doubles."""

    def __init__(self, path: Nodding) -> None:
        ctx, roots = path.ctx, path.roots
        self.P_plus, self.P_minus = float(path.P_plus), float(path.P_minus)
        self.turn_plus, self.turn_minus = path.turn_plus, path.turn_minus
        self.plus0, self.minus0 = path.plus0, path.minus0
        self._T, self._half = float(path.T), _double2(path.T / 2)
        self._T_parts, self._t0 = _parts(ctx, path.T), _double2(path.t0)
        self._w, self._kc, self._m, self._delta = (
            float(value) for value in (path.w, ctx.sqrt(roots.mc), roots.m, roots.delta)
        )
        self._one_plus_u1, self._one_minus_u1, self._one_minus_u2 = (
            float(value) for value in (roots.one_plus_u1, roots.one_minus_u1, roots.one_minus_u2)
        )
        self._q_plus, self._k_plus, self._k_minus, self._n_minus, self._beta = (
            float(value)
            for value in (path.q_plus, path.k_plus, path.k_minus, path.n_minus, path.beta)
        )
        self._p_minus = float(roots.one_minus_u2 / roots.one_minus_u1)
        self._sign_plus = float(ctx.sign(path.P_plus))
        self._theta = _Theta(roots, path.K, path.w)

    def _since(self, n: Array, t: Array, t_lo: Array | float) -> tuple[Array, Array]:
        """Time t − n T since the lower turning point, as a sum of two doubles."""
        total, rest = two_sum(t, t_lo)
        rest = rest + (self._t0.lo - n * self._T_parts[3])
        for term in (*(-n * part for part in self._T_parts[:3]), np.full_like(t, self._t0.hi)):
            total, error = two_sum(total, term)
            rest = rest + error
        return two_sum(total, rest)

    def _reduced_time(self, t: Array, t_lo: Array | float) -> tuple[Array, Array, Array]:
        """The period n, and the time in it, in [−T/2, T/2), as a sum of two doubles."""
        n = np.rint((t + self._t0.hi) / self._T)
        if np.any(abs(n) >= MOST_PERIODS):
            raise NoClosedForm(
                f"more than {MOST_PERIODS} periods in doubles: ask for digits instead"
            )
        tau, lo = self._since(n, t, t_lo)
        edge, half = -_EDGE * self._T, self._half
        late = (tau - half.hi) + (lo - half.lo) >= edge
        early = (tau + half.hi) + (lo + half.lo) < edge
        if np.any(late | early):
            n = n + late - early
            tau, lo = self._since(n, t, t_lo)
        return n, tau, lo

    def _functions(self, tau: Array, lo: Array) -> tuple[Array, Array, Array]:
        """sn, cn, dn at the time tau + lo in [−T/2, T/2]."""
        side = np.where(tau < 0, -1.0, 1.0)
        lo = lo * side
        age = abs(tau) + lo
        far = 4 * age > self._T
        left = (self._half.hi - abs(tau)) + (self._half.lo - lo)
        s, c, d = self._theta(np.where(far, np.maximum(left, 0.0), age))
        kc = self._kc
        far_s, far_c, far_d = c / d, kc * s / d, kc / d
        return side * np.where(far, far_s, s), np.where(far, far_c, c), np.where(far, far_d, d)

    def _plus(self, s: Array, c: Array, d: Array) -> Array:
        if not self.P_plus:
            return np.where(s >= 0, np.pi / 2, -np.pi / 2)
        sweep = self._sign_plus * np.arctan2(self._beta * s, c * d)
        rest = elliprj(c * c, d * d, 1.0, 1 + self._q_plus * s * s)
        return sweep + self._k_plus * s**3 * rest

    def _minus(self, x: Array, s: Array, c: Array, d: Array) -> Array:
        if not self.P_minus:
            return np.zeros_like(x)
        p = self._p_minus + self._n_minus * c * c
        rest = elliprj(c * c, d * d, 1.0, p)
        return self._k_minus * (x + self._n_minus * s**3 * rest / 3)

    def place(self, t: Array, t_lo: Array | float) -> _Place:
        """The place at the times t + t_lo."""
        n, tau, lo = self._reduced_time(t, t_lo)
        s, c, d = self._functions(tau, lo)
        above = self._one_minus_u2 + self._delta * c * c
        below = self._one_plus_u1 + self._delta * s * s
        root = self._delta**-0.5  # of c/√(1 − u) and s/√(1 + u) at an exact pass through a pole
        over_top = c / np.sqrt(above) if self._one_minus_u2 else np.full_like(c, root)
        under = s / np.sqrt(below) if self._one_plus_u1 else np.where(s >= 0, root, -root)
        rise = 2 * self._delta * self._w * d * over_top * under
        c2, s2, d2 = c * c, s * s, d * d
        uddot = 2 * self._delta * self._w**2 * (d2 * (c2 - s2) - self._m * s2 * c2)
        minus = self._minus(self._w * tau, s, c, d)
        return _Place(above, below, rise, uddot, self._plus(s, c, d), minus, n)


class _AsymptoticDouble:
    """`closed_form.Asymptotic` in doubles."""

    P_minus = 0.0

    def __init__(self, path: Asymptotic) -> None:
        zero = path.ctx.zero
        self.turn_plus, self.turn_minus, self.plus0, self.minus0 = zero, zero, path.plus0, zero
        self.P_plus, self._w, self._x0 = (float(value) for value in (path.P_plus, path.w, path.x0))
        self._one_plus_u1, self._one_minus_u1 = float(path.one_plus_u1), float(path.one_minus_u1)

    def _plus(self, x: Array, s: Array) -> Array:
        if not self.P_plus:
            return np.where(x >= 0, np.pi / 2, -np.pi / 2)
        r = float(np.sqrt(self._one_minus_u1 / self._one_plus_u1))
        return self.P_plus / (4 * self._w) * (x + r * np.arctan(r * s))

    def place(self, t: Array, t_lo: Array | float) -> _Place:
        """The place at the times t + t_lo."""
        x = self._w * t + (self._x0 + self._w * t_lo)
        decay = np.exp(-abs(x))  # sech without the overflow of cosh
        c, s = 2 * decay / (1 + decay * decay), np.tanh(x)
        above = self._one_minus_u1 * c * c
        below = self._one_plus_u1 + self._one_minus_u1 * s * s
        root = self._one_minus_u1**-0.5
        under = s / np.sqrt(below) if self._one_plus_u1 else np.where(x >= 0, root, -root)
        rise = 2 * self._w * c * under / root
        uddot = 2 * self._one_minus_u1 * (self._w * c) ** 2 * (c * c - 2 * s * s)
        zero = np.zeros_like(t)
        return _Place(above, below, rise, uddot, self._plus(x, s), zero, zero)


class _SteadyDouble:
    """`closed_form.Steady` in doubles: what turns, turns at constant rates."""

    def __init__(self, path: Steady) -> None:
        zero = path.ctx.zero
        self.turn_plus = self.turn_minus = self.plus0 = self.minus0 = zero
        self.plus_rate, self.minus_rate = float(path.plus_rate), float(path.minus_rate)
        self._above, self._below = float(path.over.one_minus_u0), float(path.over.one_plus_u0)

    def place(self, t: Array, t_lo: Array | float) -> _Place:
        """The place at the times t: the same at all of them."""
        zero = np.zeros_like(t)
        return _Place(zero + self._above, zero + self._below, zero, zero, zero, zero, zero)


_DoubleOrbit: TypeAlias = _NoddingDouble | _AsymptoticDouble | _SteadyDouble


def _double_orbit(path: Nodding | Asymptotic | Steady) -> _DoubleOrbit:
    if isinstance(path, Nodding):
        return _NoddingDouble(path)
    return _AsymptoticDouble(path) if isinstance(path, Asymptotic) else _SteadyDouble(path)


class DoubleForm:
    """The closed form of one motion in doubles; call it with an array of times.

    Parameters
    ----------
    reduced : Reduced
        The motion. Its constants are computed at the precision that doubles need.
    """

    def __init__(self, reduced: Reduced) -> None:
        path = orbit(reduced, _DIGITS)
        ctx, start = path.ctx, reduced.refined(path.ctx)
        self.exact = path
        self._side = side = -1 if reduced.g < 0 else 1
        self._path = here = _double_orbit(path)
        self._kappa = float(start.kappa)
        self._reversal = start.a / start.b if start.b else ctx.inf
        phi_rate, psi_rate = ctx.zero, start.kappa
        if isinstance(path, Steady):
            phi_rate = path.plus_rate + path.minus_rate
            psi_rate = psi_rate + side * (path.plus_rate - path.minus_rate)
        self._phi = _Angle(
            ctx, start.phi0 - here.plus0 - here.minus0, here.turn_plus + here.turn_minus, phi_rate
        )
        self._psi = _Angle(
            ctx,
            start.psi0 - side * (here.plus0 - here.minus0),
            side * (here.turn_plus - here.turn_minus),
            psi_rate,
        )

    @property
    def period(self) -> float | None:
        """T [s], the period of θ; None where nothing nutates."""
        return float(self.exact.T) if isinstance(self.exact, Nodding) else None

    @property
    def frequency(self) -> float:
        """2π/T [rad/s]; 0 where nothing nutates."""
        period = self.period
        return 0.0 if period is None else 2 * np.pi / period

    @property
    def reversal_u(self) -> float:
        """Cos θ at which φ̇ changes sign, a/b; infinite when p_ψ = 0, and reached only in loops."""
        return float(self._reversal)

    def __call__(self, t: npt.ArrayLike, t_lo: npt.ArrayLike = 0.0) -> DoubleRecord:
        """Where the top is at the times t + t_lo.

        Parameters
        ----------
        t : array_like
            Times since the start [s].
        t_lo : array_like
            What the times have beyond the digits of a double [s].

        Raises
        ------
        NoClosedForm
            Beyond 2³¹ periods.
        """
        time, low = np.asarray(t, dtype=np.float64), np.asarray(t_lo, dtype=np.float64)
        if not np.isfinite(time).all():
            raise NotANumber("t: finite times")
        place = self._path.place(time, low)
        above, below, rise, uddot, plus, minus, n = place
        if self._side < 0:
            above, below = below, above
        over = self._side * (plus - minus)
        phi_mod = self._phi.modulo(n, time, low, plus + minus)
        phidot, psidot = self._rates(place)
        sine, u = np.sqrt(above * below), np.where(above < below, 1 - above, below - 1)
        axis = np.stack((sine * np.sin(phi_mod), -sine * np.cos(phi_mod), u), axis=-1)
        return DoubleRecord(
            time, 2 * np.arctan2(np.sqrt(above), np.sqrt(below)),
            self._phi.whole(n, time, low, plus + minus), self._psi.whole(n, time, low, over),
            phi_mod, self._psi.modulo(n, time, low, over),
            -self._side * rise, phidot, psidot, u, above, below, self._side * rise * sine,
            self._side * uddot, axis, np.asarray(n).astype(np.int64),
        )  # fmt: skip

    def _rates(self, place: _Place) -> tuple[Array, Array]:
        """φ̇ and ψ̇."""
        path, zero = self._path, np.zeros_like(place.rise)
        if isinstance(path, _SteadyDouble):
            plus, minus = zero + path.plus_rate, zero + path.minus_rate
        else:
            plus = path.P_plus / (2 * place.one_plus_u) if path.P_plus else zero
            minus = path.P_minus / (2 * place.one_minus_u) if path.P_minus else zero
        return plus + minus, self._kappa + self._side * (plus - minus)
