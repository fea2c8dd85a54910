"""A static filter: the kinds and tags of many motions at once, where doubles decide every sign.

The numbers of `kinds` are evaluated on doubles, and on the magnitudes of their terms, where each −
is a +. A sum is of the sign that is found where it is larger than its magnitude times u = 2⁻⁵³
times the number of roundings in it (Shewchuk, "Adaptive precision floating-point arithmetic",
1997). What is not certain is left open. Rules and tags are those that `classify` reads.

Of the doubles only θ = 0 is a pole, so that what needs an exact cancellation, or θ = π, is left
open here: separatrix, through-bottom, uniform precession, and the kinds between two others.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.classification import kinds
from heavytop.classification.arrays import (
    VERDICT_DETAILS,
    VERDICT_NAMES,
    Codes,
    Mask,
    Starts,
)
from heavytop.classification.kinds import Criterion, Kind, Rule, Sign, Signs, Tristate
from heavytop.classification.reduced import Reduced, reduced_numbers
from heavytop.exact.pairs import PI_REST, UNIT, Array

LIBRARY: Final = 8  # u: the sine of the library is trusted to 4 ulps

FILTER_ROUNDING: Final = 160 * UNIT
"""What a sum is off by at most, beside its magnitude.

The number of roundings grows by 1 in a sum, where the larger one counts, and to n₁ + n₂ + 1 in a
product: sin²θ has 49 (`cosines`), the kinetic energy 52, b = C (ψ̇ + φ̇ cosθ)/A 28, `slope0`, the
longest criterion of a kind, 83, f at a given height 112, and a detail 152, the most. One more is
for the rounding of the magnitude itself, for products of errors, and for the comparison.
"""


class Bounded:
    """Doubles v of numbers x, and the magnitudes m of the terms in them: |v − x| ≤ ERROR m."""

    __slots__ = ("magnitude", "value")

    def __init__(self, value: Array, magnitude: Array | None = None) -> None:
        """`magnitude` is by default that of the values; given as these, none is negative."""
        self.value, self.magnitude = value, np.abs(value) if magnitude is None else magnitude

    @property
    def least(self) -> Array:
        """A lower bound of |x|; 0 or less where its sign is not certain."""
        return np.abs(self.value) - FILTER_ROUNDING * self.magnitude

    def __add__(self, other: Bounded) -> Bounded:
        return self._with(np.add, other)

    def __sub__(self, other: Bounded) -> Bounded:
        return Bounded(self.value - other.value, self.magnitude + other.magnitude)

    def __rsub__(self, integer: int) -> Bounded:
        return Bounded(np.full(1, float(integer))) - self

    def __mul__(self, other: Bounded) -> Bounded:
        return self._with(np.multiply, other)

    def _with(self, operation: np.ufunc, other: Bounded) -> Bounded:
        value = operation(self.value, other.value)
        if self.magnitude is self.value and other.magnitude is other.value:
            return Bounded(value, value)
        return Bounded(value, operation(self.magnitude, other.magnitude))

    def __neg__(self) -> Bounded:
        return Bounded(-self.value, self.magnitude)

    def __abs__(self) -> Bounded:
        return Bounded(np.abs(self.value), self.magnitude)

    def __truediv__(self, divisor: Bounded | int) -> Bounded:
        """By given numbers, which are positive."""
        by = divisor if isinstance(divisor, int) else divisor.value
        value = self.value / by
        return Bounded(value, value if self.magnitude is self.value else self.magnitude / by)

    def __rmul__(self, factor: int) -> Bounded:
        """An integer, which may be rounded too, times the numbers."""
        known = float(factor)
        return Bounded(known * self.value, abs(known) * self.magnitude)


def reduced(starts: Starts) -> Reduced:
    """The constants of the motions; as u̇₀ something that has its zeros and its sign."""
    u, below, above = cosines(starts.theta)
    A, C = Bounded(starts.A, starts.A), Bounded(starts.C, starts.C)
    rates = (starts.gMR, starts.thetadot, starts.phidot, starts.spin)
    gMR, thetadot, phidot, spin = map(Bounded, rates)
    omega3 = spin if starts.held == "omega3" else spin + phidot * u
    udot = -(thetadot * (below * above))
    return reduced_numbers(A, C, gMR, (u, below, above), thetadot, phidot, omega3, udot)


def cosines(theta: Array) -> tuple[Bounded, Bounded, Bounded]:
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
    late = theta > pi / 2
    tilt = np.where(late, (pi - theta) + PI_REST, theta)  # from the nearer pole
    polar = tilt < pi / 3
    sine = np.sin(np.where(polar, 0.5 * tilt, (pi / 2 - theta) + PI_REST / 2))
    near = 2 * sine * sine
    cos = np.where(polar, np.where(late, near - 1, 1 - near), sine)
    one_minus_cos = np.where(polar > late, near, 1 - cos)
    one_plus_cos = np.where(polar & late, near, 1 + cos)
    below, above = (Bounded(x, x) for x in (one_minus_cos, one_plus_cos))
    return Bounded(cos), below, above


# --- signs of arrays -----------------------------------------------------------------------------


class ArraySigns(Signs):
    """The criteria of kinds, for arrays of tops and starts; 0 where all terms are."""

    always = Tristate(np.ones(1, np.bool_), np.zeros(1, np.bool_))
    everywhere = staticmethod(np.all)

    def __init__(self, starts: Starts) -> None:
        self.starts, self.reduced = starts, reduced(starts)
        self._found: dict[Criterion, Sign] = {}

    def sign(self, number: Criterion) -> Sign:
        """The sign of one number."""
        if number not in self._found:
            total = number.value(self.reduced)
            nothing = np.equal(total.magnitude, 0)
            self._found[number] = Sign(total, total.value > 0, total.least > 0, nothing)
        return self._found[number]


# --- the kinds -----------------------------------------------------------------------------------


class Filtered(NamedTuple):
    """Codes of kinds and details, where they are certain, and bits of tags that hold or are open.

    Tags are all 0 unless they are wanted.
    """

    kind: Codes
    detail: Codes
    certain: Codes
    tags: Codes
    open_tags: Codes


def filter_kinds(starts: Starts, tagged: bool = False) -> Codes:
    """The kinds of motion, as far as doubles decide them: the rows of `Filtered`.

    Of impossible starts nothing is meant.
    """
    rows = np.zeros((5, *np.broadcast_shapes(*(each.shape for each in starts.arrays))), np.uint8)
    found = Filtered(*rows)
    found.kind[:], found.certain[:] = VERDICT_NAMES.index(kinds.RULES[-1].kind), True
    with np.errstate(all="ignore"):  # nan is what is not known
        signs = ArraySigns(starts)
        for rule in reversed(kinds.RULES[:-1]):
            _put(signs, found, rule)
        np.logical_and(found.certain, starts.in_range, out=found.certain)
        if tagged:
            _put_tags(signs, found)
    return rows


def _put(signs: ArraySigns, found: Filtered, rule: Rule) -> None:
    """Put a kind over those after it, but where it certainly does not fit."""
    yes, no = signs.fit(rule)
    if no.all():
        return
    may = ~no & np.ones(found.kind.shape, np.bool_)
    np.putmask(found.kind, may, VERDICT_NAMES.index(rule.kind))
    if rule.kind in kinds.KIND_DETAILS:
        names, product, _ = kinds.KIND_DETAILS[rule.kind]
        positive, negative = signs.positive(product)
        codes = (np.uint8(VERDICT_DETAILS.index(name)) for name in names[1:])
        np.putmask(found.detail, may, np.where(positive, *codes))
        yes = yes & (positive | negative)
    elif found.detail.any():
        np.putmask(found.detail, may, 0)
    np.putmask(found.certain, may, yes)


# --- tags --------------------------------------------------------------------------------------

_MAY: Final = {name: np.isin(VERDICT_NAMES, list(tag.kinds)) for name, tag in kinds.TAGS.items()}


def _put_tags(signs: ArraySigns, found: Filtered) -> None:
    """Put the bits of the tags that hold, and of those that are left open, where they are kept."""
    for bit, (name, tag) in enumerate(kinds.TAGS.items()):
        further = _FURTHER.get(name)
        yes, no = signs.fit(tag) & further(signs, found) if further else signs.fit(tag)
        may = _MAY[name][found.kind]
        for array, mask in ((found.tags, may & yes), (found.open_tags, may & ~yes & ~no)):
            array |= mask * np.uint8(1 << bit)


def _spherical_top(signs: ArraySigns, _: Filtered) -> Tristate:
    return _decided(np.equal(signs.starts.A, signs.starts.C))


def _closed_orbit(signs: ArraySigns, found: Filtered) -> Tristate:
    """A pendulum swings or rotates where its kind is certain."""
    resting = signs.vanish(kinds.TAGS["start-at-rest"].zeros).yes
    return _decided(np.equal(found.kind, VERDICT_NAMES.index(Kind.PLANAR_PENDULUM)) | ~resting)


def _decided(holds: Mask) -> Tristate:
    return Tristate(holds, ~holds)


def _near_separatrix(signs: ArraySigns, _: Filtered) -> Tristate:
    """Only that it is not near is decided: how near it is, is beyond doubles."""
    up, weight = signs.reduced.g.value > 0, np.abs(signs.reduced.g.value)
    numbers = (kinds.OVER_TOP, kinds.OVER_BOTTOM, *_AT_POLES)
    *over, top, bottom = (signs.sign(number).number.least for number in numbers)
    missed = np.where(up, top, bottom)
    passes = (missed > 0) & ((kinds.FAR_RATIO * missed) ** 2 > 10 * weight)
    return Tristate(signs.always.no, (2 * kinds.FAR_RATIO * np.where(up, *over) > weight) | passes)


_AT_POLES: Final = (kinds.PASS_TOP, kinds.PASS_BOTTOM)


def _reverses(signs: ArraySigns, _: Filtered) -> Tristate:
    """Whether f is positive at the zero of ψ̇, which lies between two doubles close to it.

    A zero at a turning point is none of these. Where C > 2A there may be two: this is left open.
    """
    starts, x = signs.starts, signs.reduced
    one, none = signs.positive(_AT_POLES)
    flat = starts.C <= 2 * starts.A
    free, linear, square = kinds.spin_rate(x)
    root = np.sqrt(linear.value * linear.value - 4 * free.value * square.value)
    near = 2 * free.value / (np.copysign(root, -linear.value) - linear.value)

    def spin_at(u: Array) -> Any:
        return free + Bounded(u) * (linear + Bounded(u) * square)

    rough = spin_at(near)
    off = 4 * FILTER_ROUNDING * (1 + rough.magnitude / root)  # root is the slope
    ends = near - off, near + off
    below, above = map(spin_at, ends)
    speed_below, speed_above = (kinds.speed_at(x, Bounded(end)) for end in ends)
    known = (below.value < 0) != (above.value < 0)
    for each in (below, above, speed_below, speed_above):
        known = known & (each.least > 0)
    known = known & (np.maximum(np.abs(ends[0]), np.abs(ends[1])) < 1)
    rises = (speed_below.value > 0) & (speed_above.value > 0)
    here, off = x.u0.value, FILTER_ROUNDING
    higher = (ends[1] < here - off) & (speed_above.value < 0)
    lower = (ends[0] > here + off) & (speed_below.value < 0)
    turns = np.equal(starts.spin, 0) & starts.still & (starts.held == "psidot")
    never = (known & (higher | lower) | turns) & (flat | one) | none & flat
    return Tristate(known & rises & ~turns & one, never)


_FURTHER: Final[dict[str, Callable[[ArraySigns, Filtered], Tristate]]] = {
    "spherical-top": _spherical_top,
    "spin-reversal": _reverses,
    "closed-orbit": _closed_orbit,
    "near-separatrix": _near_separatrix,
}
