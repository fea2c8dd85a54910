"""Tilts, period, precession and spin of whole arrays of tops and starts, by the closed form.

Each motion is reduced in long doubles, because there digits cancel; its turning points and elliptic
integrals follow in doubles, by sums and products that lose none. An error estimate tells which rows
are reliable. The others are computed one by one, with the digits that they need.

The symbols are those of `heavytop.classification.reduced`.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import reduce
from math import pi
from operator import add
from typing import Any, ClassVar, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
from heavytop.classification.many import Verdicts, classify_many
from heavytop.errors import NoClosedForm
from heavytop.numbers.double_double import two_product, two_sum

LongArray: TypeAlias = NDArray[np.longdouble]

CHUNK: Final = 8192  # motions at a time: the arrays in use stay in the cache, the calls are few
PROMISED: Final = 1e-14  # relative error of T; of angles relative to max(1, |x|)

EXTENDED: Final = np.finfo(np.longdouble).nmant >= 63
"""Whether long doubles have 64 bits or more. Where they have not, no row is reliable."""

LONG_ERROR: Final = 2.0**-60
"""Bound on the error of a sum of a few products, relative to the sizes of its terms."""

_PAIR = 2.0**-40  # LONG_ERROR times this is what sums of exact products leave
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
    found, left = np.full((len(Motions.columns), columns.size), np.nan), []
    for at in range(0, columns.size, CHUNK):
        span = slice(at, at + CHUNK)
        starts, kind = columns.starts(span), verdicts.kind.reshape(-1)[span]
        *numbers, reliable = rows(starts)
        steady, possible = _steady(starts, kind), kind != _IMPOSSIBLE
        np.copyto(found[:, span], numbers, where=reliable & ~steady & possible)
        np.copyto(found[:2, span], starts.theta, where=steady)
        left += (at + np.flatnonzero(~(reliable | steady) & possible)).tolist()
    for at in left:
        motion = Motion(*columns.one(at))
        with suppress(NoClosedForm):
            found[:, at] = np.array([getattr(motion, name) for name in Motions.columns], float)
    found.setflags(write=False)
    low, high, period, precession, spin = (each.reshape(columns.shape) for each in found)
    return Motions(verdicts, low, high, period, precession, spin, len(left))


_IMPOSSIBLE = Verdicts.names.index("impossible")
_FORCE_FREE = Verdicts.names.index(Kind.FORCE_FREE)
_STEADY = np.isin(
    Verdicts.names, (Kind.AT_REST, Kind.SLEEPING, Kind.HANGING, Kind.UNIFORM_PRECESSION)
)


def _steady(starts: Starts, kind: Codes) -> Mask:
    """Where θ is constant. Where it tends to the vertical no row is reliable: E′ − gMR is 0."""
    stays = starts.level
    if starts.held == "psidot":  # A φ̇ cosθ = C ω3; but for θ = 0, cosθ is transcendental
        stays = stays | np.equal(starts.A, starts.C) & np.equal(starts.spin, 0)
    steady: Mask = _STEADY[kind] | (kind == _FORCE_FREE) & starts.still & stays
    return steady


# --- the reduced start, in long doubles -----------------------------------------------------------


class _ReducedStart(NamedTuple):
    """Reduced motions in units A = 1, seen so that g ≥ 0; rounded, with bounds on the errors.

    About the start f(u₀ + d) = f₀ + f₁ d + f₂ d² + 2g d³; the surplus is −f'(1). The errors of P±
    are relative, and P± are exactly 0 where all their terms are.
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
    error_f2: Array
    error_surplus: Array
    error_plus: Array
    error_minus: Array


def _reduced(starts: Starts) -> _ReducedStart:
    """The motions as they start; errors are bounded by the sizes of the terms, in doubles.

    Where ψ̇ is given ω₃ is ω̂ = ψ̇ ± φ̇ on the nearer pole, and a rest that is small there. With
    n± = ψ̇ ± φ̇ and D = A − C, or n± = ω₃ and D = A where ω₃ is given,

        A P± = (1 ± u₀) (D φ̇ (1 ∓ u₀) ± C n±).

    As the cosine of a double other than 0 is transcendental (Lindemann), that vanishes only where
    both terms do.
    """
    sign, by_rate = np.where(starts.gMR < 0, -1.0, 1.0), starts.held == "psidot"
    A, C, phidot, thetadot, spin, carried = (
        each.astype(np.longdouble)
        for each in (
            starts.A, starts.C, starts.phidot, starts.thetadot,
            sign * starts.spin, starts.phidot * by_rate,
        )
    )  # fmt: skip
    above, below = _heights(starts.theta, sign)  # 1 ∓ u₀
    pole = np.where(above < below, 1.0, -1.0)  # the cosine of the nearer one
    near, u0, sin2 = np.minimum(above, below), 1 - above, above * below
    unit = 1 / A
    g, c, D = abs(starts.gMR) * unit, C * unit, (A - C if by_rate else A) * unit
    omega, upright = _on_the_pole(starts, sign * starts.spin, pole * starts.phidot * by_rate, pole)
    b_pole, rest = c * omega, -pole * carried * near * c
    b, drift = b_pole + rest, phidot * sin2  # the drift is a − b u₀
    speed2 = thetadot * thetadot + phidot * drift  # 2 (h − g u₀)
    f0, f1 = sin2 * thetadot * thetadot, 2 * (b * drift - g * sin2 - speed2 * u0)
    f2, size_f2 = _sum(
        upright * unit * unit, -4 * pole * g * near, -speed2, -rest * b_pole, -rest * b
    )
    across = D * drift
    P_plus, size_plus = _sum(below * c * (spin + carried), across)
    P_minus, size_minus = _sum(-above * c * (spin - carried), across)
    surplus = 2 * (speed2 - 2 * g * above - b * P_minus)  # 4 (h − g) − 2 b P₋
    size_g, size_b = 4 * _size(g), _size(b_pole) + _size(rest)
    size_surplus = 2 * (_size(speed2) + size_g * _size(above) + size_b * size_minus)
    kappa = b * ((A - C) / C)  # p_ψ (1/C − 1/A)
    values = g, above, below, f0, f1, f2, surplus, kappa, P_plus, P_minus
    relative = (
        np.where(size == 0, 0, size / _size(P))
        for size, P in ((size_plus, P_plus), (size_minus, P_minus))
    )
    errors = size_f2 + _PAIR * (size_g + size_b * size_b), size_surplus, *relative
    return _ReducedStart(
        sign, *(each.astype(np.float64) for each in values), *(LONG_ERROR * each for each in errors)
    )


def _on_the_pole(starts: Starts, spin: Array, carried: Array, pole: Array) -> tuple[Any, LongArray]:
    """ω̂ = spin + carried, and 4 A gMR cos θ₀ − C² ω̂² on the pole, by exact products of doubles."""
    omega, omega_rest = two_sum(spin, carried)
    momentum, rest = two_product(starts.C, omega)
    square, square_rest = two_product(momentum, momentum)
    square_rest = square_rest + 2 * momentum * (rest + starts.C * omega_rest)
    weight, weight_rest = two_product(4 * starts.A, pole * abs(starts.gMR))
    upright: Any = weight.astype(np.longdouble) - square + (weight_rest - square_rest)
    return omega.astype(np.longdouble) + omega_rest, upright


def _sum(*terms: LongArray) -> tuple[LongArray, Array]:
    """A sum, and the sizes of its terms."""
    return reduce(add, terms), reduce(add, map(_size, terms))


def _size(value: LongArray) -> Array:
    return np.asarray(abs(value.astype(np.float64)))


def _heights(theta: Array, sign: Array) -> tuple[LongArray, LongArray]:
    """1 ∓ u₀, each with its own digits: the lesser is twice sin² of half the angle to a pole."""
    half, late = theta.astype(np.longdouble) / 2, theta > pi / 2
    sine = np.sin(np.where(late, (_QUARTER_TURN - half) + _QUARTER_REST, half))
    nearer = 2 * sine * sine
    farther, lower = 2 - nearer, late ^ (sign < 0)
    return np.where(lower, farther, nearer), np.where(lower, nearer, farther)


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
    signs_known = np.maximum(start.error_plus, start.error_minus) < 0.25
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
        step = -3 * value / np.where(under == 0, 1.0, under)
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
        K, (over_bottom, over_top) = complete(mc, np.stack((plus2 / plus1, minus2 / minus1)))
        period = 2 * K / w
        plus = start.P_plus / (w * plus1) * over_bottom
        minus = start.P_minus / (w * minus1) * over_top
        plus = np.where(start.P_plus == 0, pi, plus)  # only a jump is left, where a pole is passed
        jump = np.where(minus2 == 0, pi, 0.0)
        minus = np.where(start.P_minus == 0, jump, minus)
        carried, turned = start.kappa * period, abs(plus) + abs(minus)
        precession, spin = plus + minus, start.sign * (carried + (plus - minus))
        tilts = _tilt(start.sign, minus1, plus1), _tilt(start.sign, minus2, plus2)
        error = error + _ROUNDING
        reliable = EXTENDED & _in_range(starts) & (error <= PROMISED)
        for angle, size in ((precession, turned), (spin, turned + abs(carried))):
            reliable = reliable & (error * size <= PROMISED * np.maximum(1.0, abs(angle)))
    return np.minimum(*tilts), np.maximum(*tilts), period, precession, spin, reliable


def _in_range(starts: Starts) -> Mask:
    fits: Mask = np.ones(1, np.bool_)
    for each in starts.arrays:
        size = abs(each)
        fits = fits & ((size >= 1 / _RANGE) & (size <= _RANGE) | np.equal(size, 0))
    return fits


def complete(mc: Array, p: Array) -> tuple[Array, Array]:
    """K(1 − mc), and Π(1 − p | 1 − mc) for p > 0, by one arithmetic–geometric mean.

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
    for _ in range(_MEAN_STEPS):
        inverse = 1 / p
        ratio = product * inverse
        p, a, b = p + ratio, a + b * inverse, 2 * (b + a * ratio)
        mean, k = mean + k, 2 * np.sqrt(product)
        product = k * mean
    return pi / 2 * 2.0**_MEAN_STEPS / mean, pi / 2 * (b + a * mean) / (mean * (mean + p))


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
