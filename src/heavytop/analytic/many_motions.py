"""Tilts, period, precession and spin of whole arrays of tops and starts, by the closed form.

Each motion is reduced in long doubles, because there digits cancel; its turning points and elliptic
integrals follow in doubles, by sums and products that lose none. An error estimate tells which rows
are reliable. The others are computed one by one, with the digits that they need.

The symbols are those of `heavytop.classification.reduced`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar, Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.analytic.motion import Motion
from heavytop.classification.arrays import (
    Array,
    InputArrays,
    Mask,
    Starts,
    with_spin,
)
from heavytop.classification.kinds import Kind
from heavytop.classification.many import Verdicts, classify_many
from heavytop.errors import NoClosedForm

LongArray: TypeAlias = NDArray[np.longdouble]

CHUNK: Final = 8192  # motions at a time: the arrays in use stay in the cache, the calls are few
PROMISED: Final = 1e-14  # relative error of T; of angles relative to max(1, |x|)

EXTENDED: Final = np.finfo(np.longdouble).nmant >= 63
"""Whether long doubles have 64 bits or more. Where they have not, no row is reliable."""

LONG_ERROR: Final = 2.0**-60
"""Bound on the error of a sum of a few products, relative to the sizes of its terms."""

_ROUNDING = 7e-16  # what doubles leave in T, and in sums of turns relative to their sizes
_RANGE = 2.0**100  # numbers within 1/_RANGE … _RANGE have products in the normal range
_LAGUERRE_STEPS = 5  # each triples the digits once a root is isolated
_CONVERGED = 1e-13  # bound on the last of these steps, relative to the root
_QUARTER_TURN = np.arctan2(np.longdouble(1), np.longdouble(0))
_QUARTER_REST = np.cos(_QUARTER_TURN)  # of ½π, beyond a long double
_MEAN_STEPS = 9  # of the arithmetic–geometric mean: enough for all 1 − m ≥ 1e-32
_ARCTAN_TERMS = 12  # of the arctangent of an eighth of the tilt, to 1e-18


@dataclass(frozen=True, slots=True)
class Motions:
    """What motions they are; arrays have the common shape of what was given.

    Parameters
    ----------
    verdicts : Verdicts
        Their kinds.
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

    verdicts: Verdicts
    theta_min: Array
    theta_max: Array
    period: Array
    precession: Array
    spin: Array
    sent: int

    columns: ClassVar[tuple[str, ...]] = ("theta_min", "theta_max", "period", "precession", "spin")


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
        Whether tags are found too.

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
    in the array. Where long doubles are doubles, every motion that nutates is computed one by one.

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
    tops = {"A": A, "C": C, "gMR": gMR, "theta": theta, "thetadot": thetadot, "phidot": phidot}
    given: dict[str, Any] = with_spin(tops, psidot, omega3)
    columns, verdicts = InputArrays(given), classify_many(**given, tags=tags)
    found = tuple(np.full(columns.size, np.nan) for _ in Motions.columns)
    unreliable = _fill(found, columns, verdicts)
    for at in unreliable:
        motion = Motion(*columns.one(at))
        try:
            row = [getattr(motion, name) for name in Motions.columns]
        except NoClosedForm:
            continue
        for array, number in zip(found, row, strict=True):
            array[at] = np.nan if number is None else number
    for array in found:
        array.setflags(write=False)
    low, high, period, precession, spin = (array.reshape(columns.shape) for array in found)
    return Motions(verdicts, low, high, period, precession, spin, len(unreliable))


def _fill(found: tuple[Array, ...], columns: InputArrays, verdicts: Verdicts) -> list[int]:
    """Fill in the reliable rows and those of steady motions; return the places of the others."""
    kinds, details = verdicts.kind.reshape(-1), verdicts.detail.reshape(-1)
    left = np.zeros(columns.size, np.bool_)
    for at in range(0, columns.size, CHUNK):
        span = slice(at, at + CHUNK)
        starts, kind = columns.starts(span), kinds[span]
        nutates, steady = _nutating_and_steady(starts, kind, details[span])
        *numbers, reliable = rows(starts)
        known = nutates & reliable
        for array, part in zip(found, numbers, strict=True):
            np.copyto(array[span], part, where=known)
        for array in found[:2]:
            np.copyto(array[span], starts.theta, where=steady)
        left[span] = ~(known | steady | (kind == _IMPOSSIBLE))
    places: list[int] = np.flatnonzero(left).tolist()
    return places


# --- which motions nutate -------------------------------------------------------------------------


def _codes(*kinds: Kind) -> Mask:
    return np.isin(Verdicts.names, kinds)


_NUTATING = _codes(Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM, Kind.LOOPS, Kind.CUSPS, Kind.WAVES)
_STEADY = _codes(Kind.AT_REST, Kind.SLEEPING, Kind.HANGING, Kind.UNIFORM_PRECESSION)
_IMPOSSIBLE = Verdicts.names.index("impossible")
_FREE, _PLANAR = (Verdicts.names.index(kind) for kind in (Kind.FORCE_FREE, Kind.PLANAR_PENDULUM))
_SWINGING, _ROTATING = (Verdicts.details.index(name) for name in ("swinging", "rotating"))


def _nutating_and_steady(starts: Starts, kind: Any, detail: Any) -> tuple[Mask, Mask]:
    """Where θ goes to and fro, and where it is constant; elsewhere it tends to the vertical."""
    free, stays = kind == _FREE, starts.level
    if starts.held == "psidot":  # A φ̇ cosθ = C ω3; but for θ = 0, cosθ is transcendental
        stays = stays | np.equal(starts.A, starts.C) & np.equal(starts.spin, 0)
    constant = free & starts.still & stays
    nutates = _NUTATING[kind] | (kind == _PLANAR) & ((detail == _SWINGING) | (detail == _ROTATING))
    return nutates | free & ~constant, _STEADY[kind] | constant


# --- the reduced start, in long doubles -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _ReducedStart:
    """Reduced motions in units A = 1, seen so that g ≥ 0; rounded, with bounds on the errors.

    About the start f(u₀ + d) = f₀ + f₁ d + f₂ d² + 2g d³; the surplus is −f'(1). The errors of P±
    are relative, and P± are exactly 0 where that is proved.
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
    error_f1: Array
    error_f2: Array
    error_surplus: Array
    error_plus: Array
    error_minus: Array


def _reduced(starts: Starts) -> _ReducedStart:
    """The motions as they start; errors are bounded by the sizes of the terms, in doubles."""
    sign = np.where(starts.gMR < 0, -1.0, 1.0)
    A, phidot, spin = (x.astype(np.longdouble) for x in (starts.A, starts.phidot, starts.spin))
    above, below = _heights(starts.theta, sign)  # 1 ∓ u₀
    omega3 = sign * spin
    size_omega3 = _size(omega3)
    if starts.held == "psidot":  # ψ̇ + φ̇ cosθ: beside a pole ψ̇ ± φ̇ may nearly vanish
        side = np.where(above > below, -phidot, phidot)
        together, rest = omega3 + side, side * np.minimum(above, below)
        omega3, size_omega3 = together - rest, _size(together) + _size(rest)
    g, b = abs(starts.gMR) / A, omega3 * starts.C / A
    u0, sin2 = 1 - above, above * below
    falling, drift = starts.thetadot * starts.thetadot.astype(np.longdouble), phidot * sin2
    speed2 = falling + phidot * drift  # 2 (h − g u₀); the drift is a − b u₀
    P_plus, P_minus = below * (phidot * above + b), above * (phidot * below - b)
    f0, f2 = sin2 * falling, 4 * g * u0 - speed2 - b * b
    f1 = 2 * (b * drift - g * sin2 - speed2 * u0)
    surplus = 2 * (speed2 - 2 * g * above - b * P_minus)  # 4 (h − g) − 2 b P₋
    kappa = omega3 * ((A - starts.C) / A)  # p_ψ (1/C − 1/A)
    zero_plus, zero_minus = _zero_momenta(starts, sign)
    P_plus, P_minus = np.where(zero_plus, 0, P_plus), np.where(zero_minus, 0, P_minus)
    size_b = size_omega3 * starts.C / starts.A
    size_g, size_above, size_below, size_speed2 = map(_size, (g, above, below, speed2))
    size_P_plus = size_below * (_size(phidot) * size_above + size_b)
    size_P_minus = size_above * (_size(phidot) * size_below + size_b)
    size_f1 = 2 * (size_b * _size(drift) + size_g * _size(sin2) + size_speed2)
    size_f2 = 4 * size_g + size_speed2 + size_b * size_b
    size_surplus = 2 * (size_speed2 + 2 * size_g * size_above + size_b * size_P_minus)
    relative_plus = size_P_plus / np.where(zero_plus, np.inf, _size(P_plus))
    relative_minus = size_P_minus / np.where(zero_minus, np.inf, _size(P_minus))
    exact = g, above, below, f0, f1, f2, surplus, kappa, P_plus, P_minus
    sizes = size_f1, size_f2, size_surplus, relative_plus, relative_minus
    return _ReducedStart(
        sign, *(each.astype(np.float64) for each in exact), *(LONG_ERROR * each for each in sizes)
    )


def _size(value: LongArray) -> Array:
    return np.asarray(abs(value.astype(np.float64)))


def _heights(theta: Array, sign: Array) -> tuple[LongArray, LongArray]:
    """1 ∓ u₀, each with its own digits: the lesser is twice sin² of half the angle to a pole."""
    half, late = theta.astype(np.longdouble) / 2, theta > pi / 2
    sine = np.sin(np.where(late, (_QUARTER_TURN - half) + _QUARTER_REST, half))
    nearer = 2 * sine * sine
    farther, lower = 2 - nearer, late ^ (sign < 0)
    return np.where(lower, farther, nearer), np.where(lower, nearer, farther)


def _zero_momenta(starts: Starts, sign: Array) -> tuple[Mask, Mask]:
    """Where P₊ and P₋ are exactly zero.

    The cosine of a double other than 0 is transcendental (Lindemann), and P± are linear in it: so
    both its coefficient and the rest must vanish.
    """
    phidot, spin = starts.phidot, sign * starts.spin
    top, bottom = starts.pole & (sign > 0), starts.pole & (sign < 0)
    idle = np.equal(phidot, 0) & np.equal(spin, 0)
    ball, opposite = np.equal(starts.A, starts.C), np.equal(spin, -phidot)
    alike = np.equal(spin, phidot)
    if starts.held == "omega3":
        ball, opposite, alike = np.zeros(1, np.bool_), np.equal(spin, 0), np.equal(spin, 0)
    return bottom | idle | (top | ball) & opposite, top | idle | (bottom | ball) & alike


def _in_range(starts: Starts) -> Mask:
    fits: Mask = np.ones(1, np.bool_)
    for each in starts.arrays:
        size = abs(each)
        fits = fits & ((size >= 1 / _RANGE) & (size <= _RANGE) | np.equal(size, 0))
    return fits


# --- turning points -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Roots:
    """Distances of u₁ and u₂ from ±1, 1 − m, w, and the relative error that the start leaves."""

    one_plus_u1: Array
    one_minus_u1: Array
    one_plus_u2: Array
    one_minus_u2: Array
    mc: Array
    w: Array
    error: Array  # an estimate; nan where the roots were not found


def _roots(start: _ReducedStart) -> _Roots:
    """The roots of f, where θ nutates; elsewhere they mean nothing.

    f(u₀ + d) has the roots d₁ ≤ 0 ≤ d₂ ≤ d₃. As d₁ is no neighbour of d₃, its relative error is a
    few times that of the coefficients; with it 1 − u₁ is known, and the rest follows from

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
    w = np.sqrt(reach) / 2
    # Φ± is ±π but for a term like P±, which feels an error of a small P± so much the less; θ at u₁
    # feels that of P₊, and where P₋ alone sets θ at u₂, that angle feels it
    felt_plus = np.minimum(abs(start.P_plus) / (w * plus2), 1.0) + np.sqrt(plus1)
    felt_minus = np.minimum(abs(start.P_minus) / (w * minus1), 1.0) + smaller / larger
    felt_minus += np.where(gap >= 0, np.sqrt(minus2), 0.0)
    error = (
        start.error_f1 / (reach * np.minimum(minus1, plus2))
        + start.error_f2 / reach
        + start.error_surplus / (minus1 * larger)
        + start.error_plus * felt_plus
        + start.error_minus * felt_minus
    )
    signs_known = np.maximum(start.error_plus, start.error_minus) < 0.25
    mc = (lead + g2 * minus2) / reach
    error = np.where(converged & signs_known, error, np.nan)
    return _Roots(plus1, minus1, plus2, minus2, mc, w, error)


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
        step = -3 * value / np.where(under == 0, 1.0, under)
        d = np.minimum(d + step, 0.0)
    return d, (abs(step) <= _CONVERGED * abs(d)) & (slope > 0)


def _below(start: _ReducedStart) -> Array:
    """A number below d₁, the nearer the farther d₃ is.

    The negative root of f₀ + f₁ d + (f₂ + 2g e) d² is d₁ for e = d₁. For a lower e it is higher
    than d₁, and for a higher one lower.
    """
    g2, floor = 2 * start.g, _floor(start)
    over = _negative_root(start.f0, start.f1, start.f2 + g2 * floor)
    under = _negative_root(start.f0, start.f1, start.f2 + g2 * over)
    return np.where(under >= floor, under, floor)


def _floor(start: _ReducedStart) -> Array:
    """A bound below all roots: −1 − u₀, or Fujiwara's where all of them are beside the start."""
    f0, f1, f2 = (abs(each / (2 * start.g)) for each in (start.f0, start.f1, start.f2))
    cube_root = np.where(f0 == 0, 0.0, np.ldexp(1.0, -(-np.frexp(f0)[1] // 3)))  # at least
    reach = 2 * np.maximum(np.maximum(f2, np.sqrt(f1)), cube_root)
    floor: Array = -np.fmin(start.one_plus_u0, reach)  # reach is infinite or nan without gravity
    return floor


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
        roots = _roots(start)
        K, over_bottom, over_top = complete(
            roots.mc, roots.one_plus_u2 / roots.one_plus_u1, roots.one_minus_u2 / roots.one_minus_u1
        )
        period = 2 * K / roots.w
        plus = start.P_plus / (roots.w * roots.one_plus_u1) * over_bottom
        minus = start.P_minus / (roots.w * roots.one_minus_u1) * over_top
        plus = np.where(start.P_plus == 0, pi, plus)  # only a jump is left, where a pole is passed
        jump = np.where(roots.one_minus_u2 == 0, pi, 0.0)
        minus = np.where(start.P_minus == 0, jump, minus)
        carried, turned = start.kappa * period, abs(plus) + abs(minus)
        precession, spin = plus + minus, start.sign * (carried + (plus - minus))
        at_u1 = _tilt(start.sign, roots.one_minus_u1, roots.one_plus_u1)
        at_u2 = _tilt(start.sign, roots.one_minus_u2, roots.one_plus_u2)
        low, high = np.minimum(at_u1, at_u2), np.maximum(at_u1, at_u2)
        error = roots.error + _ROUNDING
        reliable = (
            EXTENDED
            & _in_range(starts)
            & (error <= PROMISED)
            & (error * turned <= PROMISED * np.maximum(1.0, abs(precession)))
            & (error * (turned + abs(carried)) <= PROMISED * np.maximum(1.0, abs(spin)))
        )
    return low, high, period, precession, spin, reliable


def complete(mc: Array, *ps: Array) -> tuple[Array, ...]:
    """K(1 − mc), and Π(1 − p | 1 − mc) for each p > 0, by one arithmetic–geometric mean.

    Bulirsch's sequences, whose terms are all positive; that of the mean is the same for every p.

    Examples
    --------
    >>> K, third = complete(np.array([0.5]), np.array([3.0]))
    >>> print(K, third)
    [1.85407468] [1.02269751]
    """
    k, mean = np.sqrt(mc), np.ones_like(mc)
    product = k
    thirds = [(root := np.sqrt(p), np.ones_like(p), 1 / root) for p in ps]
    for _ in range(_MEAN_STEPS):
        thirds = [_third_kind_step(*third, product) for third in thirds]
        mean, k = mean + k, 2 * np.sqrt(product)
        product = k * mean
    K = pi / 2 * 2.0**_MEAN_STEPS / mean
    return K, *(pi / 2 * (b + a * mean) / (mean * (mean + p)) for p, a, b in thirds)


def _third_kind_step(p: Array, a: Array, b: Array, product: Array) -> tuple[Array, Array, Array]:
    inverse = 1 / p
    ratio = product * inverse
    return p + ratio, a + b * inverse, 2 * (b + a * ratio)


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
