"""Tilts, period, precession and spin of whole arrays of tops and starts, by the closed form.

Each motion is reduced in sums of two doubles, because there digits cancel; its turning points and
elliptic integrals follow in doubles, by sums and products that lose none. An error estimate tells
which rows are reliable. The others are computed one by one, with the digits that they need.

The symbols are those of `heavytop.classification.reduced`.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from heavytop.analytic.motion import Motion
from heavytop.classification.arrays import (
    Array,
    Codes,
    InputArrays,
    Mask,
    Starts,
    with_spin,
)
from heavytop.classification.kinds import Kind
from heavytop.classification.many import Verdicts, classify_many, impossible
from heavytop.errors import NoClosedForm
from heavytop.exact.pairs import LongArray, sine, two_sum
from heavytop.scene.arguments import expect

CHUNK: Final = 8192  # motions at a time: the arrays in use stay in the cache, the calls are few
PROMISED: Final = 1e-14  # relative error of T; of angles relative to max(1, |x|)

ERROR: Final = 2.0**-64
"""Bound on the error of a sum of products in double-doubles, relative to the sizes of its terms."""

_PRODUCT = 2.0**-10  # ERROR times this is what a product loses, but for the height of the start
_ROUNDING = 7e-16  # what doubles leave in T, and in sums of turns relative to their sizes
_RANGE = 2.0**100  # numbers within 1/_RANGE … _RANGE have products in the normal range
_LAGUERRE_STEPS = 4  # each triples the digits once a root is isolated
_CONVERGED = 1e-6  # bound on the last of these steps, relative to the root
_PI_REST = 1.2246467991473532e-16  # of π, beyond a double,
_PI_END = 2.9947698097183397e-33  # and what that is too large by
_ONE = LongArray(np.ones(1))
_TINY = 2.0**-1000  # that nothing is divided by 0
_STEPS = 6  # of the arithmetic–geometric mean: enough for 1 − m ≥ _LEAST_MC,
_LEAST_MC = 1e-4
_MORE_STEPS = 9  # and these for 1 − m ≥ 1e-32
_ARCTAN_TERMS = 12  # of the arctangent of an eighth of the tilt, to 1e-18


@dataclass(frozen=True)
class Motions:
    """What motions they are; arrays have the common shape of what was given.

    Parameters
    ----------
    given : dict of str to ndarray
        The tops and starts [kg m², rad, rad/s].
    tagged : bool
        Whether tags are among the verdicts.
    theta_min, theta_max : ndarray of float
        The least and the greatest θ [rad]; bounds, where the axis tends to the vertical. Nan
        where the motion is impossible.
    period : ndarray of float
        T [s], the period of θ. This and what follows is nan where nothing nutates.
    precession, spin : ndarray of float
        Δφ and Δψ in one period [rad]; an exact pass through a pole makes φ jump by π.
    sent : int
        How many were computed one by one, by `heavytop.Motion`.
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
        """Their kinds, told when they are first asked for."""
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
        What is impossible is marked and counted, not refused.

    Raises
    ------
    ImpossibleStart
        Both psidot and omega3 are given.
    NotANumber
        Something is not an array of integers or of doubles.
    Impossible
        The shapes do not broadcast.

    Notes
    -----
    On one machine every number is that of one motion alone, bit for bit: it depends on nothing else
    in the array.

    Accuracy: 1e-14 of `heavytop.Motion`'s, relative, and of angles relative to max(1, |x|); as near
    as 1e-15 to every special motion, by ``tests/analytic/test_many_motions.py``.
    ``validation/25_rows_per_second.py`` measures how fast this is.

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
    given: dict[str, Any] = with_spin(tops, psidot, omega3)
    columns = InputArrays(given)
    found = np.empty((len(Motions.columns), columns.size))
    reliable = np.empty(columns.size, np.bool_)
    for at in range(0, columns.size, CHUNK):
        span = slice(at, at + CHUNK)
        *numbers, reliable[span] = rows(columns.starts(span))
        for column, number in zip(found, numbers, strict=True):
            column[span] = number
    sent = _mend(columns, np.flatnonzero(~reliable), found) if not reliable.all() else 0
    found.setflags(write=False)
    given = {name: np.array(each) for name, each in given.items()}
    low, high, period, precession, spin = (each.reshape(columns.shape) for each in found)
    return Motions(given, tags, low, high, period, precession, spin, sent)


def _mend(columns: InputArrays, left: Any, found: Array) -> int:
    """Put in what is not reliable, and say how many were computed one by one."""
    kinds, starts = classify_many(**columns.part(left)), columns.starts(left)
    steady = _steady(starts, kinds.kind)
    found[:, left] = np.nan
    found[:2, left] = np.where(steady, starts.theta, np.nan)
    one_by_one = left[~(steady | kinds.impossible)].tolist()
    for at in one_by_one:
        motion = Motion(*columns.one(at))
        with suppress(NoClosedForm):
            found[:, at] = np.array([getattr(motion, name) for name in Motions.columns], float)
    return len(one_by_one)


_FORCE_FREE = Verdicts.names.index(Kind.FORCE_FREE)
_STEADY = np.isin(
    Verdicts.names, (Kind.AT_REST, Kind.SLEEPING, Kind.HANGING, Kind.UNIFORM_PRECESSION)
)


def _steady(starts: Starts, kind: Codes) -> Mask:
    """Where θ is constant."""
    stays = starts.level
    if starts.held == "psidot":  # A φ̇ cosθ = C ω3; but for θ = 0, cosθ is transcendental
        stays = stays | np.equal(starts.A, starts.C) & np.equal(starts.spin, 0)
    steady: Mask = _STEADY[kind] | (kind == _FORCE_FREE) & starts.still & stays
    return steady


# --- the reduced start, in sums of two doubles ----------------------------------------------------


class _ReducedStart(NamedTuple):
    """Reduced motions in units A = 1 s, seen so that g ≥ 0; rounded, with bounds on the errors.

    About the start f(u₀ + d) = f₀ + f₁ d + f₂ d² + 2g d³; the surplus is −f'(1). The error of P±
    is relative, the larger of both, and P± are exactly 0 where they are known to be.
    """

    sign: Array  # −1 where gMR < 0, so that the top is seen from below
    g: Array
    one_minus_u0: Array
    one_plus_u0: Array
    f0: Array
    f1: Array
    f2: Array
    surplus: Array
    kappa: Array
    P_plus: Array
    P_minus: Array
    moves: Mask  # where it does not certainly, θ may be constant
    error_f2: Array
    error_surplus: Array
    error_P: Array


def _reduced(starts: Starts) -> _ReducedStart:
    """The motions as they start; time is counted in units of A, so that nothing is divided.

    Errors are bounded by the sizes of the terms. As the cosine of a double other than 0 is
    transcendental (Lindemann), P± vanish only where everything in them does, or where A = C and
    ψ̇ = ∓φ̇.
    """
    sign, by_rate = np.where(starts.gMR < 0, -1.0, 1.0), starts.held == "psidot"
    A, C, weight, phidot, thetadot, spin = map(
        LongArray,
        (starts.A, starts.C, abs(starts.gMR), starts.phidot, starts.thetadot, sign * starts.spin),
    )
    above, below = _heights(starts.theta, sign)
    u0, sin2, turning, speed = _ONE - above, above * below, A * phidot, A * thetadot
    omega3 = spin + phidot * u0 if by_rate else spin
    drift, speed2, g, b = turning * sin2, speed * speed, A * weight, C * omega3
    kinetic2, lift = speed2 + turning * drift, g * above  # 2 (h − g u₀)
    total_plus, total_minus = drift + b * below, drift - b * above
    f1 = 2 * (b * drift - kinetic2 * u0 - g * sin2)
    f2 = 4 * (g - lift) - kinetic2 - b * b
    surplus = 2 * (kinetic2 - 2 * lift - b * total_minus)  # 4 (h − g) − 2 b P₋
    P_plus, P_minus = total_plus.rounded, total_minus.rounded
    weighs, minus_u0, plus_u0 = g.rounded, above.rounded, below.rounded
    size_b, size_drift, size_kinetic = abs(b.rounded), abs(drift.rounded), kinetic2.rounded
    carried = starts.C * abs(starts.phidot) if by_rate else np.zeros(1)
    size_b = size_b + carried
    size_plus, size_minus = size_drift + size_b * plus_u0, size_drift + size_b * minus_u0
    if by_rate:
        spherical = np.equal(starts.A, starts.C)
        for P, size, side in ((P_plus, size_plus, -1), (P_minus, size_minus, 1)):
            exactly = spherical & np.equal(spin.high, side * starts.phidot)
            np.copyto(P, 0.0, where=exactly)
            np.copyto(size, 0.0, where=exactly)
    size_f1 = 2 * (size_b * size_drift + size_kinetic + weighs * sin2.rounded)
    uncertain = (4 * weighs + size_b * carried) * np.minimum(minus_u0, plus_u0) + size_kinetic
    size_f2 = uncertain + _PRODUCT * (4 * weighs + size_b * size_b)
    size_surplus = 2 * (size_kinetic + 2 * weighs * minus_u0 + size_b * size_minus)
    missed = (size / (abs(P) + _TINY) for P, size in ((P_plus, size_plus), (P_minus, size_minus)))
    f0, slope = sin2.rounded * speed2.rounded, f1.rounded
    return _ReducedStart(
        sign, weighs, minus_u0, plus_u0, f0, slope, f2.rounded, surplus.rounded,
        omega3.rounded * (starts.A - starts.C), P_plus, P_minus,
        (f0 > 0) | (abs(slope) > ERROR * size_f1),
        ERROR * size_f2, ERROR * size_surplus, ERROR * np.maximum(*missed),
    )  # fmt: skip


def _heights(theta: Array, sign: Array) -> tuple[LongArray, LongArray]:
    """1 ∓ u₀, each with its own digits: the lesser is twice sin² of half the angle to a pole."""
    late = theta > pi / 2
    tilt, low = two_sum(np.where(late, pi - theta, theta), np.where(late, _PI_REST, 0.0))
    half = sine(0.5 * LongArray(tilt, low - late * _PI_END))
    nearer = 2 * (half * half)
    farther, lower = _ONE + _ONE - nearer, late ^ (sign < 0)
    (above, above_low), (below, below_low) = (
        (np.where(lower, one.high, other.high), np.where(lower, one.low, other.low))
        for one, other in ((farther, nearer), (nearer, farther))
    )
    return LongArray(above, above_low), LongArray(below, below_low)


# --- turning points -------------------------------------------------------------------------------


def _roots(start: _ReducedStart) -> tuple[Array, ...]:
    """1 − u and 1 + u at u₁ and at u₂; 1 − m, w, and the relative error that the start leaves.

    The last is an estimate, and nan where the roots were not found. Where θ does not nutate all
    this means nothing. f(u₀ + d) has the roots d₁ ≤ 0 ≤ d₂ ≤ d₃. As d₁ is no neighbour of d₃, its
    relative error is a few times that of the coefficients; with it 1 − u₁ is known, and the rest
    follows from

        2g (1 − u₁)(1 − u₂)(u₃ − 1) = P₋²,   2g (1 + u₁)(1 + u₂)(1 + u₃) = P₊²,
        2g [(u₃ − 1) − (1 − u₂)](1 − u₁) = −f'(1) − P₋²/(1 − u₁),   2g d₁ d₂ d₃ = −f₀.
    """
    g2 = 2 * start.g
    d1, converged = _lowest(start)
    minus1 = start.one_minus_u0 - d1
    share = start.P_minus**2 / minus1
    gap = (start.surplus - share) / minus1  # 2g [(u₃ − 1) − (1 − u₂)]
    larger = (abs(gap) + np.sqrt(gap**2 + 4 * g2 * share)) / 2
    smaller = g2 * share / larger
    lead = np.where(gap >= 0, larger, smaller)  # 2g (u₃ − 1)
    minus2 = np.where(gap >= 0, share / larger, larger / g2)
    climb = lead + g2 * start.one_minus_u0  # 2g d₃
    d2 = np.where(d1 < 0, start.f0 / -d1, start.f1) / climb
    plus2 = start.one_plus_u0 + d2
    plus1 = start.P_plus**2 / (plus2 * (2 * g2 + lead))
    reach = lead + g2 * minus1  # 2g (u₃ − u₁)
    # the slope f₁, and P± once their signs are known, add no more than a few times this
    error = start.error_f2 / reach + start.error_surplus / (minus1 * larger)
    signs_known = start.error_P < 0.25
    mc = (lead + g2 * minus2) / reach
    error = np.where(converged & signs_known, error, np.nan)
    return minus1, plus1, minus2, plus2, mc, np.sqrt(reach) / 2, error


def _lowest(start: _ReducedStart) -> tuple[Array, Mask]:
    """d₁, and whether the last step was small and f rises there, as it does not at d₂.

    From below all roots the steps of Laguerre's method never pass the first.
    """
    f0, f1, f2, f3 = start.f0, start.f1, start.f2, 2 * start.g
    d, step, slope = _below(start), np.zeros(1), np.zeros(1)
    for _ in range(_LAGUERRE_STEPS):
        value = f0 + d * (f1 + d * (f2 + d * f3))
        slope = f1 + d * (2 * f2 + d * (3 * f3))
        bend = 2 * f2 + 6 * f3 * d
        under = slope + np.sqrt(np.maximum(4 * slope**2 - 6 * value * bend, 0.0))
        step = -3 * value / (under + _TINY)
        d = np.minimum(d + step, 0.0)
    return d, (abs(step) <= _CONVERGED * abs(d)) & (slope > 0)


def _below(start: _ReducedStart) -> Array:
    """A number below d₁, at least −1 − u₀, and the nearer the farther d₃ is.

    The negative root of f₀ + f₁ d + (f₂ + 2g e) d² is d₁ for e = d₁. For a lower e it is higher
    than d₁, and for a higher one lower.
    """
    g2, floor = 2 * start.g, -start.one_plus_u0
    over = _negative_root(start.f0, start.f1, start.f2 + g2 * floor)
    under = _negative_root(start.f0, start.f1, start.f2 + g2 * over)
    return np.where(under >= floor, under, floor)


def _negative_root(f0: Array, f1: Array, f2: Array) -> Array:
    """The negative root of f₀ + f₁ d + f₂ d² with f₂ < 0 ≤ f₀; nan where f₂ > 0."""
    root = np.sqrt(f1**2 - 4 * f0 * f2)
    far = abs(f1) + root
    root = np.where(f1 > 0, -2 * f0 / np.where(far == 0, 1.0, far), far / (2 * f2))
    return np.where(f2 < 0, root, np.nan)


# --- elliptic integrals, and what turns in a period -----------------------------------------------


def rows(starts: Starts) -> tuple[Array, Array, Array, Array, Array, Mask]:
    """Least and greatest θ, period, precession and spin, and whether they are reliable.

    Where θ does not nutate they mean nothing.
    """
    with np.errstate(all="ignore"):  # unreliable numbers may be anything
        start = _reduced(starts)
        minus1, plus1, minus2, plus2, mc, w, error = _roots(start)
        p = np.stack((plus2 / plus1, minus2 / minus1))
        K, third = complete(mc, p, _STEPS)
        if (small := mc < _LEAST_MC).any():
            K[small], third[:, small] = complete(mc[small], p[:, small])
        over_bottom, over_top = third
        period = 2 * K / w  # in units of A
        plus = start.P_plus / (w * plus1) * over_bottom
        minus = start.P_minus / (w * minus1) * over_top
        np.copyto(plus, pi, where=start.P_plus == 0)  # only a jump is left, where a pole is passed
        np.copyto(minus, pi * (minus2 == 0), where=start.P_minus == 0)
        carried, turned = start.kappa * period, abs(plus) + abs(minus)
        precession, spin = plus + minus, start.sign * (carried + (plus - minus))
        tilts = _tilt(start.sign, minus1, plus1), _tilt(start.sign, minus2, plus2)
        error = error + _ROUNDING
        reliable = ~impossible(starts.A, starts.C, starts.theta) & _in_range(starts)
        reliable = reliable & start.moves & (error <= PROMISED)
        for angle, size in ((precession, turned), (spin, turned + abs(carried))):
            reliable = reliable & (error * size <= PROMISED * np.maximum(1.0, abs(angle)))
    return np.minimum(*tilts), np.maximum(*tilts), starts.A * period, precession, spin, reliable


def _in_range(starts: Starts) -> Mask:
    fits: Mask = np.ones(1, np.bool_)
    for each in starts.arrays:
        size = abs(each)
        fits = fits & ((size >= 1 / _RANGE) & (size <= _RANGE) | np.equal(size, 0))
    return fits


def complete(mc: Array, p: Array, steps: int = _MORE_STEPS) -> tuple[Array, Array]:
    """K(1 − mc), and Π(1 − p | 1 − mc) for p > 0, by so many steps of one mean.

    Bulirsch's sequences, whose terms are all positive; that of the mean is the same for every p,
    of which there may be a row more.

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


def _tilt(sign: Array, one_minus_u: Array, one_plus_u: Array) -> Array:
    """θ, seen from above, by its distance from the nearer pole, 2 arctan √(nearer/farther).

    That is found by the tangent of its eighth part, for which a series is short: sums, products and
    roots have the same bits whatever vectors the processor has.
    """
    nearer, farther = np.minimum(one_minus_u, one_plus_u), np.maximum(one_minus_u, one_plus_u)
    quarter = np.sqrt(nearer / 2) / (1 + np.sqrt(farther / 2))
    eighth = quarter / (1 + np.sqrt(1 + quarter * quarter))  # at most tan(π/16)
    square = -eighth * eighth
    series = 1 / (2 * _ARCTAN_TERMS + 1) * square
    for k in range(_ARCTAN_TERMS - 1, 0, -1):
        series = (series + 1 / (2 * k + 1)) * square
    angle: Array = 8 * (eighth + eighth * series)
    late = (sign < 0) ^ (one_minus_u > one_plus_u)
    return np.where(late, pi - angle, angle)
