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

from functools import reduce
from math import pi
from typing import Final, NamedTuple, cast

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

    |v − x| ≤ n u m: n grows by 1 in a sum, where the larger n counts, to n₁ + n₂ + 1 in a product,
    to ⌊n/2⌋ + 2 in a root. One more is for what m itself was rounded, n u, for products of errors,
    and for the comparison. So `looping`, the longest criterion, has 82: sin²θ 49 (`cosines`), 2K
    53, p_ψ = C (ψ̇ + φ̇ cosθ) 27; the discriminant of the cubic has some 350.
    """

    __slots__ = ("_magnitude", "relative", "roundings", "value")

    def __init__(self, value: Array, roundings: int = 0, magnitude: Array | None = None) -> None:
        """`magnitude` is None, or the values themselves, where nothing can have cancelled."""
        self.value, self.roundings, self._magnitude = value, roundings, magnitude
        self.relative = magnitude is None or magnitude is value

    @staticmethod
    def of(value: Array, positive: bool = False) -> Sized:
        """Given numbers; those out of range, and nan, are left open, and negative ones if asked."""
        size = value if positive else np.abs(value)
        fits = (size >= 1 / LARGEST) & (size <= LARGEST)
        if not fits.all():
            fits |= size == 0
            value = np.where(fits, value, np.nan)
        return Sized(value, 0, value if positive else None)

    @property
    def magnitude(self) -> Array:
        """The sum of the magnitudes of the terms."""
        if self._magnitude is None:
            self._magnitude = np.abs(self.value)
        return self._magnitude

    @property
    def positive(self) -> bool:
        """Whether no number is known to be negative."""
        return self._magnitude is self.value

    @property
    def error(self) -> float:
        """What |v − x| is at most, beside the magnitude."""
        return (self.roundings + 1) * _U

    @property
    def least(self) -> Array:
        """What |x| is at least; 0 or less where its sign is not certain."""
        if self.relative:
            return self.magnitude * (1 - self.error)
        return np.abs(self.value) - self.error * self.magnitude

    @property
    def most(self) -> Array:
        """What |x| is at most; 0 just where x is 0."""
        if self.relative:
            return self.magnitude * (1 + self.error)
        return np.abs(self.value) + self.error * self.magnitude

    def __add__(self, other: Sized) -> Sized:
        value, roundings = self.value + other.value, max(self.roundings, other.roundings) + 1
        if self.positive and other.positive:
            return Sized(value, roundings, value)
        return Sized(value, roundings, self.magnitude + other.magnitude)

    def __sub__(self, other: Sized) -> Sized:
        return self + -other

    def __neg__(self) -> Sized:
        negative = Sized(-self.value, self.roundings, self._magnitude)
        negative.relative = self.relative
        return negative

    def __abs__(self) -> Sized:
        if self.relative:
            return Sized(self.magnitude, self.roundings, self.magnitude)
        return Sized(np.abs(self.value), self.roundings, self.magnitude)

    def __mul__(self, other: Sized) -> Sized:
        value, roundings = self.value * other.value, self.roundings + other.roundings + 1
        if not (self.relative and other.relative):
            return Sized(value, roundings, self.magnitude * other.magnitude)
        positive = other is self or (self.positive and other.positive)
        return Sized(value, roundings, value if positive else None)

    def __rmul__(self, factor: int) -> Sized:
        """An integer, which may be rounded too, times the numbers."""
        known = float(factor)
        value = known * self.value
        if self.relative:
            positive = self.positive and factor > 0
            return Sized(value, self.roundings + 2, value if positive else None)
        return Sized(value, self.roundings + 2, abs(known) * self.magnitude)

    def __truediv__(self, other: Sized) -> Sized:
        """A quotient of numbers in which nothing cancelled; open where the divisor is 0."""
        _refuse_sums(self, other)
        value = np.where(other.value == 0, np.nan, self.value / other.value)
        positive = self.positive and other.positive
        roundings = self.roundings + other.roundings + 1
        return Sized(value, roundings, value if positive else None)

    def sqrt(self) -> Sized:
        """The root of numbers in which nothing cancelled and that are not negative."""
        _refuse_sums(self)
        value = np.sqrt(self.value)
        return Sized(value, self.roundings // 2 + 2, value)


def _refuse_sums(*numbers: Sized) -> None:
    if not all(number.relative for number in numbers):
        raise ValueError("a sum that may cancel is neither divided nor put under a root")


def given(starts: Starts) -> Given:
    """What the criteria are made of."""
    cos, one_minus_cos, one_plus_cos = cosines(starts.theta)
    phidot, spin = Sized.of(starts.phidot), Sized.of(starts.spin)
    return Given(
        Sized.of(starts.A, positive=True),
        Sized.of(starts.C, positive=True),
        Sized.of(starts.gMR),
        cos,
        one_minus_cos,
        one_plus_cos,
        Sized.of(starts.thetadot),
        phidot,
        spin if starts.held == "omega3" else spin + phidot * cos,
    )


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


def filtered(starts: Starts, tagged: bool = False) -> Filtered:
    """The kinds of motion, as far as doubles tell them; of impossible starts nothing is meant."""
    shape = np.broadcast_shapes(*(each.shape for each in starts.arrays))
    kind, detail, tags, unknown = (np.zeros(shape, np.uint8) for _ in range(4))
    found = Filtered(kind, detail, np.empty(shape, np.float64), tags, unknown)
    with np.errstate(all="ignore"):  # nan is what is not known
        tree = _Tree(starts, found)
        tree.generic()
        tree.special()
        np.multiply(found.margin, _ROUNDED, out=found.margin)
        np.copyto(found.margin, 0, where=~(found.margin > 0))
        if tagged:
            _put_tags(starts, tree.x, tree.momentum, found)
    return found


class _Tree:
    """The tree of `classify` on arrays; sizes are from below, beside the root of the momenta."""

    def __init__(self, starts: Starts, found: Filtered) -> None:
        self.starts, self.found = starts, found
        self.x = x = given(starts)
        weight = x.A * abs(x.gMR)
        self.momentum = np.sqrt(x.unspun.most + x.p_psi.most**2)
        self.theta_rate = (x.A * abs(x.thetadot)).least / self.momentum
        sine = x.sin2.sqrt().least
        across = (x.A * abs(x.phidot)).least * sine / self.momentum
        spin = x.p_psi.least / self.momentum
        weight_size = weight.sqrt().least / self.momentum
        torque = np.minimum(weight_size, sine)
        self.rest = _largest(self.theta_rate, across, spin, torque)  # how far at-rest is
        self.moves = np.minimum(self.rest, weight_size)
        self.upright = np.maximum(self.theta_rate, sine)  # sleeping, hanging
        self.plane = np.maximum(spin, across)

    def generic(self) -> None:
        """Take every motion for a generic one: waves, cusps or loops."""
        x = self.x
        top, off_top = _judged(kinds.p_minus(x), kinds.pole_scale(x, 1))
        bottom, off_bottom = _judged(kinds.p_plus(x), kinds.pole_scale(x, -1))
        steady = np.maximum(self.theta_rate, _judged(kinds.steady_balance(x))[1])
        looping, off_cusp = _judged(kinds.looping(x), kinds.looping_scale(x))
        between = (top < 0) & (bottom > 0) | (top > 0) & (bottom < 0)  # |p_φ| < |p_ψ|
        cusps = between & self.starts.still & self.starts.level
        loops = between & ((looping < 0) == (bottom < 0))  # p_ψ is of the sign of P₊
        least = _least(self.moves, self.upright, self.plane, steady, off_top, off_bottom)
        self.found.margin[...] = least
        np.minimum(least, off_cusp, out=self.found.margin, where=between & ~cusps)
        self.found.kind[...] = _WAVES
        np.copyto(self.found.kind, _LOOPS, where=loops)
        np.copyto(self.found.kind, _CUSPS, where=cusps)

    def special(self) -> None:
        """Put the special kinds that doubles can be proved to have over it, the first last."""
        starts, spinless = self.starts, self.x.p_psi.most == 0
        pole, weightless = starts.pole, starts.gMR == 0
        planar = starts.level & spinless
        for where, put in (
            (pole, self._through_top),
            (planar, self._planar),
            (pole & starts.still, self._upright),
            (weightless, self._force_free),
            (planar & starts.still & (pole | weightless), self._rest),
        ):
            if where.any():
                put(where)

    def _through_top(self, where: Mask) -> None:
        """From the top; where V is highest below, the separatrix that leads there is missed."""
        x = self.x
        miss = _judged(kinds.p_plus(x), kinds.pole_scale(x, -1))[1]
        asymptote = np.maximum(miss, _judged(kinds.over_bottom(x))[1])
        asymptote = np.where(self.starts.gMR < 0, asymptote, 1.0)
        least = _least(self.moves, self.upright, self.plane, asymptote)
        self._put(where, Kind.THROUGH_TOP, least)

    def _planar(self, where: Mask) -> None:
        x, up = self.x, self.starts.gMR > 0
        (top, off_top), (bottom, off_bottom) = (
            _judged(over(x)) for over in (kinds.over_top, kinds.over_bottom)
        )
        over, off = np.where(up, top, bottom), np.where(up, off_top, off_bottom)
        self._put(where, Kind.PLANAR_PENDULUM, _least(self.moves, self.upright, off))
        self._tell(where, over, "rotating", "swinging")

    def _upright(self, where: Mask) -> None:
        up = self.starts.gMR > 0
        self._put(where & ~up, Kind.HANGING, self.moves)
        stiffness, off = _judged(kinds.sleeping_discriminant(self.x))
        self._put(where & up, Kind.SLEEPING, np.minimum(self.moves, off))
        self._tell(where & up, stiffness, "stable", "unstable")
        np.copyto(self.found.detail, 0, where=where & ~up)

    def _force_free(self, where: Mask) -> None:
        self._put(where, Kind.FORCE_FREE, self.rest)

    def _rest(self, where: Mask) -> None:
        known = self.momentum == self.momentum  # not nan: nothing was out of range
        self._put(where, Kind.AT_REST, known.astype(float))

    def _put(self, where: Mask, kind: Kind, margin: Array) -> None:
        np.copyto(self.found.kind, NAMES.index(kind), where=where)
        np.copyto(self.found.margin, margin, where=where)
        np.copyto(self.found.detail, 0, where=where)

    def _tell(self, where: Mask, over: Array, above: str, below: str) -> None:
        np.copyto(self.found.detail, DETAILS.index(above), where=where & (over > 0))
        np.copyto(self.found.detail, DETAILS.index(below), where=where & (over < 0))


def _least(*sizes: Array) -> Array:
    """The smallest of some sizes; nan where one of them is."""
    return reduce(np.minimum, sizes)


def _largest(*sizes: Array) -> Array:
    return reduce(np.maximum, sizes)


def _judged(terms: Sum, beside: Sized | None = None) -> tuple[Array, Array]:
    """A sum, and from below its size beside its terms: positive where its sign is certain."""
    whole = sum_of(terms)
    error = whole.error * whole.magnitude
    if all(term.relative for term in terms):
        scale = error + whole.magnitude
    else:
        scale = error + sum(np.abs(term.value) for term in terms)
    if beside is not None:
        scale = scale + beside.most
    return whole.value, (np.abs(whole.value) - error) / scale


_WAVES, _LOOPS, _CUSPS = (NAMES.index(kind) for kind in (Kind.WAVES, Kind.LOOPS, Kind.CUSPS))


# --- tags --------------------------------------------------------------------------------------

_NOT_NUTATING: Final = tuple(
    NAMES.index(kind)
    for kind in (
        Kind.AT_REST, Kind.FORCE_FREE, Kind.SLEEPING, Kind.HANGING, Kind.PLANAR_PENDULUM
    )
)  # fmt: skip
_NOWHERE: Final = np.zeros(1, np.bool_)
_STEEPEST: Final = 24.0
"""|f′(u)| ≤ |2 gMR (1 − u²)| + |2u| (2K + |2 gMR| (|cosθ| + |u|)) + 2 |p_φ − p_ψ u| |p_ψ|
≤ 2 + 2·5 + 2·3·1 for |u| ≤ 1, where 2K, |gMR|, |p_ψ| ≤ 1 and |p_φ| ≤ 2; and room for roundings."""


class Units(NamedTuple):
    """A motion in units in which A = 1 and √(2AK + p_ψ² + A |gMR|) is of order 1.

    It serves the criteria of tags in the place of `Given`; φ̇ is taken for 1, and sin²θ for
    φ̇ sin²θ.
    """

    A: Sized
    gMR: Sized
    cos: Sized
    kinetic: Sized
    p_psi: Sized
    phidot: Sized
    sin2: Sized

    @staticmethod
    def of(x: Given, momentum: Array) -> Units:
        """The motion `x` in units of its own; `momentum` is that root, about."""
        one = np.ldexp(1.0, -np.frexp(momentum)[1])
        square, unit = one * one, Sized(np.ones(1))
        return Units(
            A=unit,
            gMR=_scaled(x.A * x.gMR, square),
            cos=x.cos,
            kinetic=_scaled(x.A * x.kinetic, square),
            p_psi=_scaled(x.p_psi, one),
            phidot=unit,
            sin2=_scaled(x.A * x.phidot * x.sin2, one),
        )


def _scaled(x: Sized, factor: Array) -> Sized:
    """Numbers times powers of 2, to be added to others of order 1; none is taken for too small."""
    return Sized(x.value * factor, x.roundings, np.maximum(x.magnitude * factor, _SMALLEST))


def _put_tags(starts: Starts, x: Given, momentum: Array, found: Filtered) -> None:
    """Put the bits of the tags that hold, and of those that are left open, where they are kept."""
    at_rest, free, sleeping, hanging, planar = (found.kind == code for code in _NOT_NUTATING)
    still, flat = at_rest | sleeping | hanging, at_rest | planar
    resting = ~still & starts.level & starts.still
    units = Units.of(x, momentum)
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


def _far(units: Units) -> Mask:
    """Where 1 − m is surely not small; that it is, is beyond doubles: it is the square of 1e-6."""
    x = cast("Given", units)
    away = _sides(kinds.away_from_one(x))[1]
    return away | _sides(kinds.upper_roots_nearer(x))[0]


def _reverses(starts: Starts, x: Given, units: Units) -> tuple[Mask, Mask]:
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


def _zero_of_spin(x: Given, units: Units) -> tuple[Array, Array]:
    """The zero r = 2 p_ψ/(b ± √d) of h, b = C p_φ, d = b² + 4 p_ψ² (1 − C), and its error.

    |2 p_ψ − r̂ (b ± √d)| is the error but for |b| + √d, and √d is known to d's error over √d.
    """
    C, p = x.C / x.A, units.p_psi
    b = C * kinds.p_phi(cast("Given", units))
    d = b * b + 4 * p * p * (units.A - C)
    b_error, d_error, p_error = (each.error * each.magnitude for each in (b, d, p))
    root = np.sqrt(np.where(d.value > d_error, d.value, np.nan))
    spread = b_error + d_error / root
    size = np.abs(b.value) + root
    r = 2 * p.value / np.where(np.abs(b.value) > b_error, np.copysign(size, b.value), np.nan)
    error = (2 * p_error + np.abs(r) * (spread + 2.0**-50 * size)) / (size - spread)
    return r, np.where(error > 0, 2 * error, np.nan)


def _sides_of_f(units: Units, r: Array, error: Array) -> tuple[Mask, Mask]:
    """Where A² f is surely negative, or surely positive, at a place within `error` of r."""
    u = Sized(np.where(np.abs(r) < 1.01, r, np.nan))
    energy = units.kinetic + 2 * units.gMR * (units.cos - u)
    drop = kinds.p_phi(cast("Given", units)) - units.p_psi * u
    f = energy * (units.A - u * u) - drop * drop
    sure = f.least > _STEEPEST * error
    return sure & (f.value < 0), sure & (f.value > 0)


def _sides(terms: Sum) -> tuple[Mask, Mask]:
    """Where a sum is surely negative, and where surely positive."""
    whole = sum_of(terms)
    sure = whole.least > 0
    return sure & (whole.value < 0), sure & (whole.value > 0)
