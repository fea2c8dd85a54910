"""A static filter: the kinds and tags of many motions at once, where doubles tell every sign.

The criteria are evaluated on doubles, and on the magnitudes of their terms, where each − is a +.
A sum is of the sign that is found where it is larger than its magnitude times u = 2⁻⁵³ times the
number of roundings in it (Shewchuk, "Adaptive precision floating-point arithmetic", 1997). What
is not certain is left open. The kinds, their order and the margins are those of `classify`; each
margin is a lower bound, positive exactly where every sign on the way is certain.

Of the doubles only θ = 0 is a pole, so that what needs an exact cancellation, or θ = π, is left
open here: separatrix, through-bottom, uniform precession, and the kinds between two others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import partial, reduce
from math import pi
from typing import Final, NamedTuple

import numpy as np

from heavytop.classification import kinds
from heavytop.classification.arrays import DETAILS, NAMES, Array, Codes, Mask, Starts, bits
from heavytop.classification.kinds import Given, Kind, Sum
from heavytop.classification.signs import sum_of

LIBRARY: Final = 8  # u: the sine of the library is trusted to 4 ulps

LARGEST: Final = 2.0**100
"""What is given is 0 or within 2⁻¹⁰⁰ … 2¹⁰⁰ (8e-31 … 1e30), or is left open: then no product in
a criterion leaves 2⁻⁹⁶⁰ … 2⁹⁶⁰, the range in which a rounding is relative."""

_U: Final = 2.0**-53
_ROUNDED: Final = 1 - 2.0**-46  # for at most 60 roundings on the way to a margin
_SMALLEST: Final = 2.0**-40  # beside 1; its 12th power is far above the least double

_REST: Final = 6.123233995736766e-17  # π/2 − its double


class Sized:
    """Doubles v of numbers x, the magnitudes m of the terms in them, and a count n of roundings.

    |v − x| ≤ n u m: n grows by 1 in a sum, where the larger n counts, and to n₁ + n₂ + 1 in a
    product. One more is for what m itself was rounded, n u, for products of errors, and for the
    comparison. So `looping`, the longest criterion, has 82: sin²θ 49 (`cosines`), 2K 53,
    p_ψ = C (ψ̇ + φ̇ cosθ) 27; the discriminant of the cubic has some 350.
    """

    __slots__ = ("magnitude", "roundings", "value")

    def __init__(self, value: Array, roundings: int = 0, magnitude: Array | None = None) -> None:
        """`magnitude` is by default that of the values; given as these, none is negative."""
        self.value, self.roundings = value, roundings
        self.magnitude = np.abs(value) if magnitude is None else magnitude

    @staticmethod
    def of(value: Array, positive: bool = False) -> Sized:
        """Given numbers; those out of range, and nan, are left open, and negative ones if asked."""
        size = value if positive else np.abs(value)
        fits = (size >= 1 / LARGEST) & (size <= LARGEST)
        if not fits.all():
            value = np.where(fits | (size == 0), value, np.nan)
            size = value if positive else np.abs(value)
        return Sized(value, 0, size)

    @property
    def error(self) -> float:
        """What |v − x| is at most, beside the magnitude."""
        return (self.roundings + 1) * _U

    @property
    def least(self) -> Array:
        """What |x| is at least; 0 or less where its sign is not certain."""
        return np.abs(self.value) - self.error * self.magnitude

    @property
    def most(self) -> Array:
        """What |x| is at most; 0 just where x is 0."""
        return np.abs(self.value) + self.error * self.magnitude

    def __add__(self, other: Sized) -> Sized:
        return self._with(other, np.add, max(self.roundings, other.roundings) + 1)

    def __sub__(self, other: Sized) -> Sized:
        return self + -other

    def __mul__(self, other: Sized) -> Sized:
        if self is other and not self.roundings:  # a square of given numbers
            square = self.value * self.value
            return Sized(square, 1, square)
        return self._with(other, np.multiply, self.roundings + other.roundings + 1)

    def _with(self, other: Sized, operation: np.ufunc, roundings: int) -> Sized:
        value = operation(self.value, other.value)
        if self.magnitude is self.value and other.magnitude is other.value:
            return Sized(value, roundings, value)
        return Sized(value, roundings, operation(self.magnitude, other.magnitude))

    def __neg__(self) -> Sized:
        return Sized(-self.value, self.roundings, self.magnitude)

    def __abs__(self) -> Sized:
        return Sized(np.abs(self.value), self.roundings, self.magnitude)

    def __rmul__(self, factor: int) -> Sized:
        """An integer, which may be rounded too, times the numbers."""
        known = float(factor)
        return Sized(known * self.value, self.roundings + 2, abs(known) * self.magnitude)


def given(starts: Starts) -> Given:
    """What the criteria are made of."""
    heights = cosines(starts.theta)
    A, C = (Sized.of(moment, positive=True) for moment in (starts.A, starts.C))
    rates = (starts.gMR, starts.thetadot, starts.phidot, starts.spin)
    gMR, thetadot, phidot, spin = map(Sized.of, rates)
    omega3 = spin if starts.held == "omega3" else spin + phidot * heights[0]
    return Given(A, C, gMR, *heights, thetadot, phidot, omega3)


def sizes(x: Given) -> Given:
    """The magnitudes of what is given, as plain arrays; of ω3, where terms cancel, a bound.

    They are for what a criterion is large or small beside, in which nothing cancels: it comes out
    to 60 u.
    """
    magnitudes = Given(*(getattr(x, field.name).magnitude for field in fields(x)))
    found = replace(magnitudes, omega3=x.omega3.most)
    vars(found).update(sin2=x.sin2.magnitude, kinetic=x.kinetic.magnitude)  # known already
    return found


def cosines(theta: Array) -> tuple[Sized, Sized, Sized]:
    """cosθ and 1 ∓ cosθ, nothing in which cancels, from one sine.

    Within π/3 of a pole it is that of half the angle to the pole, elsewhere that of π/2 − θ. Either
    angle is exact in its first part (Sterbenz), and has 3 u with the rest of π: the sine LIBRARY
    + 3, its square twice that and 1, and 1 ∓ that, where it is ½ at most, 1 more. Of the doubles
    in [0, π] only 0 is a pole.

    Examples
    --------
    >>> cos, one_minus_cos, one_plus_cos = cosines(np.array([0.0, 1e-8, np.pi]))
    >>> print(cos.value, one_minus_cos.value, one_plus_cos.value)
    [ 1.  1. -1.] [0.e+00 5.e-17 2.e+00] [2.00000000e+00 2.00000000e+00 7.49879891e-33]
    """
    theta = np.where(theta <= pi, Sized.of(theta, positive=True).value, np.nan)
    late = theta > pi / 2
    tilt = np.where(late, (pi - theta) + 2 * _REST, theta)  # from the nearer pole
    polar = tilt < pi / 3
    sine = np.sin(np.where(polar, 0.5 * tilt, (pi / 2 - theta) + _REST))
    near = 2 * sine * sine
    cos = np.where(polar, np.where(late, near - 1, 1 - near), sine)
    one_minus_cos = np.where(polar > late, near, 1 - cos)
    one_plus_cos = np.where(polar & late, near, 1 + cos)
    roundings = 2 * (LIBRARY + 3) + 2
    return (
        Sized(cos, roundings),
        Sized(one_minus_cos, roundings, one_minus_cos),
        Sized(one_plus_cos, roundings, one_plus_cos),
    )


# --- the decision tree ---------------------------------------------------------------------------


class Filtered(NamedTuple):
    """Codes of kinds and details, margins, and the bits of tags that hold and that are open.

    Where a margin is 0 nothing is known. Tags that were not asked for are all 0.
    """

    kind: Codes
    detail: Codes
    margin: Array
    tags: Codes
    open_tags: Codes

    @staticmethod
    def empty(shape: tuple[int, ...]) -> Filtered:
        """Arrays to be filled in."""
        kind, detail, tags, unknown = (np.zeros(shape, np.uint8) for _ in range(4))
        return Filtered(kind, detail, np.empty(shape), tags, unknown)


def filtered(starts: Starts, tagged: bool = False) -> Filtered:
    """The kinds of motion, as far as doubles tell them; of impossible starts nothing is meant."""
    found = Filtered.empty(np.broadcast_shapes(*(each.shape for each in starts.arrays)))
    with np.errstate(all="ignore"):  # nan is what is not known
        tree = _Tree(starts, found)
        tree.generic()
        tree.special()
        np.multiply(found.margin, _ROUNDED, out=found.margin)
        np.copyto(found.margin, 0, where=~(found.margin > 0))
        if tagged:
            _put_tags(starts, tree.x, tree.sizes.momentum, found)
    return found


class _Tree:
    """The tree of `classify` on arrays; sizes are from below, beside the root of the momenta."""

    def __init__(self, starts: Starts, found: Filtered) -> None:
        self.starts, self.found = starts, found
        self.x = x = given(starts)
        self.sizes = each = sizes(x)
        weight, sine = kinds.weight(each), each.sin2**0.5
        self.theta_rate, across = kinds.theta_rate(each), kinds.across(each)
        spin = x.p_psi.least / each.momentum
        # how far at-rest and force-free are; sleeping and hanging; the plane
        self.rest = _largest(self.theta_rate, across, spin, np.minimum(weight, sine))
        self.moves = np.minimum(self.rest, weight)
        self.upright = np.maximum(self.theta_rate, sine)
        self.plane = np.maximum(spin, across)

    def generic(self) -> None:
        """Take every motion for a generic one: waves, cusps or loops."""
        top, off_top = self._judged(kinds.p_minus, partial(kinds.pole_scale, pole=1))
        bottom, off_bottom = self._judged(kinds.p_plus, partial(kinds.pole_scale, pole=-1))
        steady = np.maximum(self.theta_rate, self._judged(kinds.steady_balance)[1])
        looping, off_cusp = self._judged(kinds.looping, kinds.looping_scale)
        between = (top < 0) & (bottom > 0) | (top > 0) & (bottom < 0)  # |p_φ| < |p_ψ|
        cusps = between & self.starts.still & self.starts.level
        loops = between & ((looping < 0) == (bottom < 0))  # p_ψ is of the sign of P₊
        least = _least(self.moves, self.upright, self.plane, steady, off_top, off_bottom)
        self.found.margin[...] = least
        np.minimum(least, off_cusp, out=self.found.margin, where=between & ~cusps)
        self.found.kind[...] = NAMES.index(Kind.WAVES)
        np.copyto(self.found.kind, NAMES.index(Kind.LOOPS), where=loops)
        np.copyto(self.found.kind, NAMES.index(Kind.CUSPS), where=cusps)

    def special(self) -> None:
        """Put the special kinds that doubles can be proved to have over it, the first last."""
        starts, x = self.starts, self.x
        pole, up, still = starts.pole, starts.gMR > 0, starts.still
        planar, weightless = starts.level & (x.p_psi.most == 0), starts.gMR == 0
        if pole.any():
            # where V is highest below, the separatrix that leads there is missed
            miss = self._judged(kinds.p_plus, partial(kinds.pole_scale, pole=-1))[1]
            asymptote = np.maximum(miss, self._judged(kinds.over_bottom)[1])
            asymptote = np.where(starts.gMR < 0, asymptote, 1.0)
            self._put(
                pole, Kind.THROUGH_TOP, _least(self.moves, self.upright, self.plane, asymptote)
            )
        if planar.any():
            for where, over in ((planar & up, kinds.over_top), (planar & ~up, kinds.over_bottom)):
                side, off = self._judged(over)
                least = _least(self.moves, self.upright, off)
                self._put(where, Kind.PLANAR_PENDULUM, least, side)
        if (pole & still).any():
            self._put(pole & still & ~up, Kind.HANGING, self.moves)
            side, off = self._judged(kinds.sleeping_discriminant)
            least = np.minimum(self.moves, off)
            self._put(pole & still & up, Kind.SLEEPING, least, side)
        self._put(weightless, Kind.FORCE_FREE, self.rest)
        known = 1 + 0 * self.sizes.momentum  # nan where something was out of range
        self._put(planar & still & (pole | weightless), Kind.AT_REST, known)

    def _put(self, where: Mask, kind: Kind, margin: Array, side: Array | None = None) -> None:
        if not where.any():
            return
        np.copyto(self.found.kind, NAMES.index(kind), where=where)
        np.copyto(self.found.margin, margin, where=where)
        np.copyto(self.found.detail, 0, where=where)
        if side is not None:
            _, above, below = map(DETAILS.index, kinds.DETAILS[kind])
            np.copyto(self.found.detail, above, where=where & (side > 0))
            np.copyto(self.found.detail, below, where=where & (side < 0))

    def _judged(
        self, criterion: Callable[[Given], Sum], scale: Callable[[Given], Array] | None = None
    ) -> tuple[Array, Array]:
        """A sum, and from below its size beside its terms: positive where its sign is certain."""
        terms = criterion(self.x)
        whole = sum_of(terms)
        if self.starts.held == "omega3":  # nothing cancels within a term
            beside = whole.magnitude
        else:
            beside = sum(np.abs(term.value) for term in terms)
        if scale is not None:
            beside = beside + scale(self.sizes)
        error = whole.error * whole.magnitude
        return whole.value, (np.abs(whole.value) - error) / (beside + error)


def _least(*sizes: Array) -> Array:
    """The smallest of some sizes; nan where one of them is."""
    return reduce(np.minimum, sizes)


def _largest(*sizes: Array) -> Array:
    return reduce(np.maximum, sizes)


# --- tags --------------------------------------------------------------------------------------

_NOWHERE: Final = np.zeros(1, np.bool_)
_STEEPEST: Final = 24.0
"""|f′(u)| ≤ |2 gMR (1 − u²)| + |2u| (2K + |2 gMR| (|cosθ| + |u|)) + 2 |p_φ − p_ψ u| |p_ψ|
≤ 2 + 2·5 + 2·3·1 for |u| ≤ 1, where 2K, |gMR|, |p_ψ| ≤ 1 and |p_φ| ≤ 2; and room for roundings."""


def in_units(x: Given, momentum: Array) -> Given:
    """The motion `x` in units in which A = 1 and `momentum`, that of `Given`, is of order 1.

    They serve the criteria of tags; C is taken for 1, and so ω3 for p_ψ.
    """
    one = np.ldexp(1.0, -np.frexp(momentum)[1])
    unit, rates = Sized(np.ones(1)), (x.A * x.thetadot, x.A * x.phidot, x.p_psi)
    found = Given(
        unit, unit, _scaled(x.A * x.gMR, one * one), x.cos, x.one_minus_cos, x.one_plus_cos,
        *(_scaled(rate, one) for rate in rates),
    )  # fmt: skip
    vars(found).update(kinetic=_scaled(x.A * x.kinetic, one * one))  # known already
    return found


def _scaled(x: Sized, factor: Array) -> Sized:
    """Numbers times powers of 2, to be added to others of order 1; none is taken for too small."""
    return Sized(x.value * factor, x.roundings, np.maximum(x.magnitude * factor, _SMALLEST))


def _put_tags(starts: Starts, x: Given, momentum: Array, found: Filtered) -> None:
    """Put the bits of the tags that hold, and of those that are left open, where they are kept."""
    # the first kinds, in their order
    at_rest, free, sleeping, hanging, planar = (found.kind == code for code in range(5))
    still, flat = at_rest | sleeping | hanging, at_rest | planar
    resting = ~still & starts.level & starts.still
    units = in_units(x, momentum)
    told = {
        "spherical-pendulum": _within(~flat, x.p_psi.most == 0, x.p_psi.least > 0),
        "spherical-top": _sure(starts.A == starts.C),
        "spin-reversal": _within(~(still | planar), *_reverses(starts, x, units)),
        "closed-orbit": _sure(planar | (free & ~resting)),
        "near-separatrix": _within(~(still | free), _NOWHERE, _far(units)),
        "inverted-gravity": _sure(starts.gMR < 0),
        "start-at-rest": _sure(resting),
    }
    for name, masks in told.items():
        for array, mask in zip((found.tags, found.open_tags), masks, strict=True):
            array |= mask * np.uint8(bits((name,)))


def _sure(holds: Mask) -> tuple[Mask, Mask]:
    return holds, _NOWHERE


def _within(eligible: Mask, yes: Mask, no: Mask) -> tuple[Mask, Mask]:
    return eligible & yes, eligible & ~yes & ~no


def _far(units: Given) -> Mask:
    """Where 1 − m is surely not small; that it is, is beyond doubles: it is the square of 1e-6."""
    away = _sides(kinds.away_from_one(units))[1]
    return away | _sides(kinds.upper_roots_nearer(units))[0]


def _reverses(starts: Starts, x: Given, units: Given) -> tuple[Mask, Mask]:
    """Whether ψ̇ changes sign in the nutation: only where |p_φ| > |p_ψ|, and f(r) > 0 at its zero r.

    In units A = 1 it has the sign of −h(u), with one zero between the poles where |p_φ| > |p_ψ|,

        h(u) = p_ψ (1 − C) u² + C p_φ u − p_ψ,   h(±1) = ±C (p_φ ∓ p_ψ),   h(0) = −p_ψ;

    elsewhere h has one sign at −1, 0 and 1, and as C ≤ 2 its extremum is of another sign only
    beyond them. A turning point, and a pole, are known zeros of no such kind.
    """
    (top_below, top_above), (bottom_below, bottom_above) = (
        _sides(criterion(x)) for criterion in (kinds.p_minus, kinds.p_plus)
    )
    outside = (top_below & bottom_below) | (top_above & bottom_above)
    inside = (top_below & bottom_above) | (top_above & bottom_below)
    none = starts.pole
    if starts.held == "psidot":
        none = none | ((starts.spin == 0) & starts.still)
    falls, rises = _sides_of_f(units, *_zero_of_spin(x, units))
    return outside & rises & ~none, inside | falls | none


def _zero_of_spin(x: Given, units: Given) -> tuple[Array, Array]:
    """The zero r = 2 p_ψ/(b ± √d) of h, b = C p_φ, d = b² + 4 p_ψ² (1 − C), and its error.

    |2 p_ψ − r̂ (b ± √d)| is the error but for |b| + √d, and √d is known to d's error over √d.
    """
    C, p = Sized(x.C.value / x.A.value, 1), units.p_psi
    b = C * kinds.p_phi(units)
    d = b * b + 4 * p * p * (units.A - C)
    b_error, d_error, p_error = (each.error * each.magnitude for each in (b, d, p))
    root = np.sqrt(np.where(d.value > d_error, d.value, np.nan))
    spread = b_error + d_error / root
    size = np.abs(b.value) + root
    r = 2 * p.value / np.where(np.abs(b.value) > b_error, np.copysign(size, b.value), np.nan)
    error = (2 * p_error + np.abs(r) * (spread + 2.0**-50 * size)) / (size - spread)
    return r, np.where(error > 0, 2 * error, np.nan)


def _sides_of_f(units: Given, r: Array, error: Array) -> tuple[Mask, Mask]:
    """Where A² f is surely negative, or surely positive, at a place within `error` of r."""
    u = Sized(np.where(np.abs(r) < 1.01, r, np.nan))
    energy = units.kinetic + 2 * units.gMR * (units.cos - u)
    drop = kinds.p_phi(units) - units.p_psi * u
    f = energy * (units.A - u * u) - drop * drop
    sure = f.least > _STEEPEST * error
    return sure & (f.value < 0), sure & (f.value > 0)


def _sides(terms: Sum) -> tuple[Mask, Mask]:
    """Where a sum is surely negative, and where surely positive."""
    whole = sum_of(terms)
    sure = whole.least > 0
    return sure & (whole.value < 0), sure & (whole.value > 0)
