"""Tilts, period, precession and spin of arrays of tops and starts, by the closed form.

All is computed in plain doubles, by sums and products that lose few digits, with estimates of the
errors. Rows with too large an estimate are computed one by one. The symbols are those of
`heavytop.classification.reduced`.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from heavytop.analytic.motion import Motion
from heavytop.classification.arrays import InputArrays, Mask, Starts, with_spin
from heavytop.classification.kinds import Kind
from heavytop.classification.many import Verdicts, classify_many, is_impossible
from heavytop.errors import NoClosedForm
from heavytop.exact.pairs import PI_REST, Array
from heavytop.scene.arguments import expect

# motions computed at once: the arrays stay in the processor's cache, and calls are few
MOTIONS_AT_ONCE: Final = 8192
PROMISED: Final = 1e-12  # relative error of T; of angles relative to max(1, |x|)

SUM_ROUNDING: Final = 2.0**-51  # of a sum of products, relative to the sizes of its terms
# rounding error of T, relative, and of sums of turns relative to the sizes of their terms
PERIOD_ROUNDING: Final = 7e-16
LAGUERRE_STEPS: Final = 4  # each triples the digits once a root is isolated
CONVERGED: Final = 1e-6  # bound on the last of these steps, relative to the root
NOT_ZERO: Final = 2.0**-1000  # added to a divisor that may be 0
LEAST_MC: Final = 1e-2
MEAN_STEPS: Final = 5  # of the arithmetic–geometric mean, for 1 − m ≥ LEAST_MC
MORE_STEPS: Final = 9  # for 1 − m ≥ 1e-32
SINE_TERMS: Final = 8
ARCTAN_TERMS: Final = 10  # of the arctangent of an eighth of the tilt, to 2e-17


@dataclass(frozen=True, eq=False)
class Motions:
    """Periods, tilts and turns of many motions; arrays have the common shape of the numbers given.

    Parameters
    ----------
    given : dict of str to ndarray
        The tops and starts [kg m², rad, rad/s].
    tagged : bool
        Whether the verdicts have tags.
    theta_min, theta_max : ndarray of float
        The least and the greatest θ [rad]; bounds, where the axis tends to the vertical; nan where
        the motion is impossible.
    period : ndarray of float
        T [s], the period of θ; this, `precession` and `spin` are nan where nothing nutates.
    precession, spin : ndarray of float
        Δφ and Δψ in one period [rad]; an exact pass through a pole makes φ jump by π.
    sent : int
        The number of motions that were computed one by one, by `heavytop.Motion`.
    columns : tuple of str
        The names of the five arrays.
    """

    given: dict[str, Any] = field(repr=False)
    tagged: bool
    theta_min: Array
    theta_max: Array
    period: Array
    precession: Array
    spin: Array
    sent: int

    columns: ClassVar[tuple[str, ...]] = ("theta_min", "theta_max", "period", "precession", "spin")

    @cached_property
    def verdicts(self) -> Verdicts:
        """Their kinds, decided when they are first read."""
        return classify_many(**self.given, tags=self.tagged)


def motions_many(
    *,
    A: ArrayLike,
    C: ArrayLike,
    gMR: ArrayLike,
    theta: ArrayLike,
    thetadot: ArrayLike = 0.0,
    phidot: ArrayLike = 0.0,
    psidot: ArrayLike | None = None,
    omega3: ArrayLike | None = None,
    tags: bool = False,
) -> Motions:
    """The turning points, period, precession and spin of many tops and starts, and their kinds.

    Parameters
    ----------
    A, C, gMR : array_like
        Moments of inertia [kg m²] and weight times distance [kg m² s⁻²].
    theta, thetadot, phidot : array_like
        Tilt [rad] and rates [rad/s].
    psidot, omega3 : array_like, optional
        The spin, as ψ̇ or as ω3 [rad/s]; not both. All are broadcast; doubles mean their exact
        binary value.
    tags : bool
        Whether the verdicts have tags.

    Returns
    -------
    Motions
        Impossible motions are marked and counted; they raise no error.

    Raises
    ------
    ImpossibleStart
        Both psidot and omega3 are given.
    NotANumber
        An argument is not an array of integers or of doubles.
    Impossible
        The shapes do not broadcast.

    Notes
    -----
    On one machine every number has the same bits as that of one motion alone: it does not depend on
    the rest of the array.

    Accuracy: 1e-12 of `heavytop.Motion`'s, relative, and of angles relative to max(1, |x|); as near
    as 1e-15 to every special motion, by ``tests/analytic/test_many.py``.
    ``validation/03_benchmarks.py`` measures how fast this is.

    References
    ----------
    As of `heavytop.Motion`; elliptic integrals by arithmetic–geometric means, *NIST Digital Library
    of Mathematical Functions*, section 19.8.

    Examples
    --------
    The book's top, released at rest, kicked forwards and backwards, and asleep:

    >>> found = motions_many(A=3.28e-4, C=6.6e-5, gMR=0.0456, theta=[0.1, 0.1, 0.1, 0], omega3=140,
    ...                      phidot=[0, 5, -15, 0])
    >>> [found.verdicts.names[code] for code in found.verdicts.kind]
    ['cusps', 'waves', 'loops', 'sleeping']
    >>> print(found.period.round(8), found.sent)
    [0.40140587 0.4044716  0.38409494        nan] 0
    """
    expect("tags", tags, bool)
    tops = {"A": A, "C": C, "gMR": gMR, "theta": theta, "thetadot": thetadot, "phidot": phidot}
    given = with_spin(tops, psidot, omega3)
    columns = InputArrays(given)
    found = np.empty((len(Motions.columns), columns.size))
    reliable = np.empty(columns.size, np.bool_)
    for at in range(0, columns.size, MOTIONS_AT_ONCE):
        span = slice(at, at + MOTIONS_AT_ONCE)
        with np.errstate(all="ignore"):  # unreliable numbers may be anything
            *numbers, reliable[span] = rows(columns.starts(span))
        found[:, span] = np.broadcast_arrays(*numbers)
    sent = 0 if reliable.all() else _compute_alone(columns, np.flatnonzero(~reliable), found)
    found.setflags(write=False)
    kept = {name: np.array(each) for name, each in given.items()}
    low, high, period, precession, spin = (each.reshape(columns.shape) for each in found)
    return Motions(kept, tags, low, high, period, precession, spin, sent)


def _compute_alone(columns: InputArrays, rest: Any, found: Array) -> int:
    """Fill in the columns `rest`; return how many of them `heavytop.Motion` computed."""
    kinds, starts = classify_many(**columns.part(rest)), columns.starts(rest)
    steady_kinds = (Kind.AT_REST, Kind.SLEEPING, Kind.HANGING, Kind.UNIFORM_PRECESSION)
    names, stays = np.array(Verdicts.names), starts.level
    if starts.held == "psidot":  # A φ̇ cosθ = C ω3; but for θ = 0, cosθ is transcendental
        stays = stays | np.equal(starts.A, starts.C) & np.equal(starts.spin, 0)
    free = (names == Kind.FORCE_FREE)[kinds.kind] & starts.still & stays
    steady = np.isin(names, steady_kinds)[kinds.kind] | free
    found[:, rest] = np.nan
    found[:2, rest] = np.where(steady, starts.theta, np.nan)
    alone = rest[~(steady | kinds.impossible)].tolist()
    for at in alone:
        motion = Motion(*columns.one(at))
        with suppress(NoClosedForm):
            found[:, at] = np.array([getattr(motion, name) for name in Motions.columns], float)
    return len(alone)


def rows(starts: Starts) -> tuple[Any, ...]:
    """Least and greatest θ, period, precession and spin, and whether they are reliable.

    Where θ does not nutate the numbers are meaningless.
    """
    n = Nutations(starts)
    K, (at_bottom, at_top) = n.period_growth()
    period = 2 * K / n.w  # in units of A
    uniform, turned = n.kappa * period, abs(at_bottom) + abs(at_top)
    precession, spin = at_bottom + at_top, n.sign * (uniform + (at_bottom - at_top))
    reliable = n.known & (n.error <= PROMISED)
    for angle, size in ((precession, turned), (spin, turned + abs(uniform))):
        reliable = reliable & (n.error * size <= PROMISED * np.maximum(1.0, abs(angle)))
    tilts = [tilt(n.sign, minus, plus) for plus, minus in (n.at_u1, n.at_u2)]
    return np.minimum(*tilts), np.maximum(*tilts), starts.A * period, precession, spin, reliable


class Nutations:
    """The nutations of some starts, scaled to A = 1 and seen with g ≥ 0.

    Time is counted in units of A, so that nothing is divided by it. As the cosine of a double other
    than 0 is transcendental (Lindemann), P± vanish only where all their terms do, or where A = C
    and ψ̇ = ∓φ̇.

    Attributes
    ----------
    sign : ndarray
        −1 where g < 0: seen from below.
    b : ndarray
        p_ψ.
    P, at_u1, at_u2 : pairs of ndarrays
        P±, and 1 ± u at the turning points.
    down, up, swing : ndarray
        u₀ − u₁, u₂ − u₀ and u₂ − u₁.
    mc, w, kappa, speed : ndarray
        1 − m; the rate of x; the uniform part of ψ̇; a bound of the speed of the axis.
    error : ndarray
        An estimate of the error of the period, relative to it,
    known : ndarray of bool
        where the estimate holds.
    """

    def __init__(self, starts: Starts) -> None:
        A, C, by_rate = starts.A, starts.C, starts.held == "psidot"
        self.sign = sign = np.where(starts.gMR < 0, -1.0, 1.0)
        high, low = _heights(starts.theta, sign)  # 1 ∓ u₀
        u0, sin2, turning, speed = 1 - high, high * low, A * starts.phidot, A * starts.thetadot
        spin = sign * starts.spin
        omega3 = spin + starts.phidot * u0 if by_rate else spin
        drift, g = turning * sin2, A * abs(starts.gMR)
        self.b = b = C * omega3
        kinetic2 = speed * speed + turning * drift  # 2 (h − g u₀)
        size_b = abs(b) + (C * abs(starts.phidot) if by_rate else 0.0)
        exact = [by_rate & np.equal(A, C) & np.equal(spin, way * starts.phidot) for way in (-1, 1)]
        plus, minus = self.P = np.stack([
            np.where(zero, 0.0, drift + way * b * height)
            for way, height, zero in ((1, low, exact[0]), (-1, high, exact[1]))
        ])  # fmt: skip
        # f(u₀ + d) = f₀ + f₁ d + f₂ d² + 2g d³, and the surplus −f'(1)
        f0, f1 = sin2 * speed * speed, 2 * (b * drift - kinetic2 * u0 - g * sin2)
        f2 = 4 * (g - g * high) - kinetic2 - b * b
        surplus = 2 * (kinetic2 - 2 * g * high - b * minus)
        size_f1 = 2 * (size_b * abs(drift) + kinetic2 + g * sin2)
        size_surplus = kinetic2 + 2 * g * high + size_b * (abs(drift) + size_b * high)
        # the lowest root d₁, which is never close to d₃, gives 1 − u₁; the rest follows from
        # 2g (1 ± u₁)(1 ± u₂)(u₃ ± 1) = P±²,
        # 2g [(u₃ − 1) − (1 − u₂)](1 − u₁) = −f'(1) − P₋²/(1 − u₁)
        d1, converged = _least_distance(f0, f1, f2, 2 * g, low)
        minus1 = high - d1
        share = minus * minus / minus1
        gap = (surplus - share) / minus1
        larger = (abs(gap) + np.sqrt(gap * gap + 8 * g * share)) / 2
        lead = np.where(gap >= 0, larger, 2 * g * share / larger)  # 2g (u₃ − 1)
        minus2 = np.where(gap >= 0, share / larger, larger / (2 * g))
        self.down = -d1
        self.up = np.where(d1 < 0, f0 / -d1, f1) / (lead + 2 * g * high)  # over 2g d₃
        self.swing, plus2 = self.down + self.up, low + self.up
        plus1 = plus * plus / (plus2 * (4 * g + lead))
        reach = lead + 2 * g * minus1  # 2g (u₃ − u₁)
        self.mc, self.w = (lead + 2 * g * minus2) / reach, np.sqrt(reach) / 2
        self.at_u1, self.at_u2 = np.stack((plus1, minus1)), np.stack((plus2, minus2))
        self.kappa, self.speed = omega3 * (A - C), np.sqrt(kinetic2 + 4 * g)
        # where their signs are known, P± and f₁ add a few times this at most
        error = SUM_ROUNDING * (4 * g + kinetic2 + size_b * size_b) / reach
        self.error = error + 2 * SUM_ROUNDING * size_surplus / (minus1 * larger) + PERIOD_ROUNDING
        self.known: Mask = converged & starts.in_range & ~is_impossible(A, C, starts.theta)
        self.known &= (f0 > 0) | (abs(f1) > SUM_ROUNDING * size_f1)
        for one, height, zero in ((plus, low, exact[0]), (minus, high, exact[1])):
            self.known &= zero | (abs(one) >= 4 * SUM_ROUNDING * (abs(drift) + size_b * height))

    def period_growth(self) -> tuple[Array, Array]:
        """K, and the growth of Φ₊ and Φ₋ in a period [rad]; at an exact pass it is a jump."""
        mc, p = self.mc, self.at_u2 / self.at_u1
        K, third = complete(mc, p)
        if (small := mc < LEAST_MC).any():
            K[small], third[:, small] = complete(mc[small], p[:, small], MORE_STEPS)
        jumps = pi * np.equal((self.at_u1[0], self.at_u2[1]), 0)
        return K, np.where(self.P == 0, jumps, self.P / (self.w * self.at_u1) * third)


def _heights(theta: Array, sign: Array) -> tuple[Array, Array]:
    """1 ∓ u₀, each to its own digits: the smaller is 2 sin² of half the angle to a pole.

    The sine is summed as a series, so that its bits do not depend on the processor's vectors.
    """
    low = theta > pi / 2
    half = np.where(low, (pi - theta) + PI_REST, theta) / 2
    square, sine = half * half, np.ones(1)
    for k in range(SINE_TERMS, 0, -1):
        sine = 1 - square * sine / (2 * k * (2 * k + 1))
    nearer, below = 2 * square * sine * sine, low ^ (sign < 0)
    return np.where(below, 2 - nearer, nearer), np.where(below, nearer, 2 - nearer)


def _least_distance(f0: Array, f1: Array, f2: Array, f3: Array, low: Array) -> tuple[Array, Mask]:
    """The lowest root d₁, and whether the last step was small and f rises there (at d₂ it falls).

    The negative root of f₀ + f₁ d + (f₂ + f₃ e) d² is d₁ for e = d₁, above it for a lower e, below
    it for a higher one. Started below all roots, Laguerre's method never passes the first.
    """
    over = _negative_root(f0, f1, f2 - f3 * low)
    under = _negative_root(f0, f1, f2 + f3 * over)
    d, step, slope = np.where(under >= -low, under, -low), np.zeros(1), np.zeros(1)
    f33 = 3 * f3
    for _ in range(LAGUERRE_STEPS):
        value = -3 * (f0 + d * (f1 + d * (f2 + d * f3)))
        half_bend = f2 + f33 * d
        slope = f1 + d * (f2 + half_bend)
        root = np.sqrt(np.maximum(slope * slope + value * half_bend, 0.0))
        step = value / (slope + 2 * root + NOT_ZERO)
        d = np.minimum(d + step, 0.0)
    return d, (abs(step) <= CONVERGED * abs(d)) & (slope > 0)


def _negative_root(f0: Array, f1: Array, f2: Array) -> Array:
    """The negative root of f₀ + f₁ d + f₂ d² with f₂ < 0 ≤ f₀; nan where f₂ > 0."""
    far = abs(f1) + np.sqrt(f1**2 - 4 * f0 * f2)
    root = np.where(f1 > 0, -2 * f0 / np.where(far == 0, 1.0, far), far / (2 * f2))
    return np.where(f2 < 0, root, np.nan)


def complete(mc: Array, p: Array, steps: int = MEAN_STEPS) -> tuple[Array, Array]:
    """K(1 − mc), and Π(1 − p | 1 − mc) for p > 0, mc ≥ 1e-32, by steps of one mean.

    By Bulirsch's sequences, whose terms are all positive; the mean is the same for every p, which
    may have more rows than mc.

    Examples
    --------
    >>> K, third = complete(np.array([0.5]), np.array([3.0]))
    >>> print(K, third)
    [1.85407468] [1.02269751]
    """
    product, mean, p = np.sqrt(mc), np.ones_like(mc), np.sqrt(p)
    a, b = np.ones_like(p), 1 / p
    k = product
    for _ in range(steps):
        inverse = 1 / p
        ratio = product * inverse
        p, a, b = p + ratio, a + b * inverse, 2 * (b + a * ratio)
        mean, k = mean + k, 2 * np.sqrt(product)
        product = k * mean
    return pi / 2 * 2.0**steps / mean, pi / 2 * (b + a * mean) / (mean * (mean + p))


def tilt(sign: Array, one_minus_u: Array, one_plus_u: Array) -> Array:
    """θ, seen from above, by the angle to the nearer pole, 2 arctan √(nearer/farther).

    It is 8 times the arctangent of a small number, which a short series gives: the bits of sums,
    products and roots do not depend on the processor's vectors.
    """
    nearer, farther = np.minimum(one_minus_u, one_plus_u), np.maximum(one_minus_u, one_plus_u)
    quarter = np.sqrt(nearer / 2) / (1 + np.sqrt(farther / 2))
    eighth = quarter / (1 + np.sqrt(1 + quarter * quarter))  # at most tan(π/16)
    square, series = -eighth * eighth, np.zeros(1)
    for k in range(ARCTAN_TERMS, 0, -1):
        series = (series + 1 / (2 * k + 1)) * square
    angle: Array = 8 * (eighth + eighth * series)
    low = (sign < 0) ^ (one_minus_u > one_plus_u)
    return np.where(low, pi - angle, angle)
