"""The sign of an exact number that is no rational: by balls, and where it may be zero by proof.

An algebraic number other than 0 is not smaller than a bound that its expression gives (Burnikel,
Funke, Mehlhorn, Schirra & Schmitt 2009, *Algorithmica* 55, 14-28). With π, arcs and cosines of
numbers, zero is proved as an identity of polynomials in these, whose coefficients are algebraic.
All limits are on the size of an expression; beyond them a sign is undecided.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from fractions import Fraction
from functools import reduce
from typing import Final, TypeAlias

from flint import Ordering, arb, fmpq, fmpq_mpoly, fmpq_mpoly_ctx

from heavytop.exact.balls import ball_of, working
from heavytop.exact.functions import sin
from heavytop.exact.number import ZERO, Exact, Sign, rational, split

Sizes: TypeAlias = tuple[float, float]
Quotient: TypeAlias = tuple[fmpq_mpoly, fmpq_mpoly]

_SIGN_BITS: Final = (64, 256)  # which nearly always decide
_MORE_BITS: Final = (1024, 4096)  # for what is not proved to be zero
_MAX_BITS: Final = 1 << 17  # of a separation bound
_MAX_COEFFICIENT_BITS: Final = 1 << 15  # of that of a coefficient, of which there may be many
_MAX_MULTIPLE: Final = 256  # of an angle
_MAX_GENERATORS: Final = 48
_MAX_PRODUCTS: Final = 100_000  # of terms, in a product of polynomials


def sign_of(x: Exact) -> Sign | None:
    """Return the sign of a number, or None where it is undecided."""
    if sign := _side(x, _SIGN_BITS):
        return sign
    bits = separation(x)
    if bits > _MAX_BITS:
        return 0 if is_identity(x) else _side(x, _MORE_BITS)
    for precision in (512 << k for k in range(int(4 * bits).bit_length())):
        with working(precision):
            if abs(ball_of(x)) < arb(2) ** -math.ceil(bits):
                return 0
        if sign := _side(x, (precision,)):
            return sign
    return None


def _side(x: Exact, precisions: Iterable[int]) -> Sign | None:
    """The side of zero where a ball lies, at the first precision that decides."""
    for ball in map(x.ball, precisions):
        if ball > 0 or ball < 0:
            return 1 if ball > 0 else -1
    return None


# --- algebraic numbers: a bound on how near to zero they can come --------------------------------


def separation(x: Exact) -> float:
    """Return bits b with |x| > 2⁻ᵇ or x = 0; infinite where x is not algebraic.

    >>> from heavytop.exact import sqrt
    >>> separation(sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3)) < 150
    True
    """
    bounds = _Bounds()
    above, below = bounds[x]
    degree = math.prod(bounds.roots.values()) * max(1, bounds.order // 2)
    if below == math.inf:
        return math.inf
    return below + max(above, 0) * (degree - 1) + 64  # more than the roundings of these doubles


class _Bounds(dict[Exact, Sizes]):
    """By number log2 of the largest conjugates of two algebraic integers that it is a quotient of.

    Both are infinite where it is not algebraic. The field is that of roots, by radicand with their
    degree, and of a root of unity of an order, for cosines of rational parts of π.
    """

    def __init__(self) -> None:
        self.roots: dict[Exact, int] = {}
        self.order = 1

    def __missing__(self, x: Exact) -> Sizes:
        if x.op == "rational":
            above, below = x.args[0].as_integer_ratio()
            found = math.log2(abs(above) or 1), math.log2(below)
        elif x.op in ("+", "*"):
            found = reduce(_add if x.op == "+" else _multiply, map(self.__getitem__, x.args))
        elif x.op == "^":
            found = self._power(*x.args)
        else:
            times, angle = split(x.args[0]) if x.op == "cos" else (Fraction(0), x)
            algebraic = angle.op == "pi" and times
            self.order = math.lcm(self.order, (times / 2).denominator)
            found = (1, 1) if algebraic else (math.inf, math.inf)  # 2 cos is an integer of size 2
        self[x] = found
        return found

    def _power(self, base: Exact, exponent: Fraction) -> Sizes:
        (above, below), k, n = self[base], exponent.denominator, abs(exponent.numerator)
        if k > 1:
            self.roots[base] = math.lcm(self.roots.get(base, 1), k)
            mean = (max(above, below) + (k - 1) * min(above, below)) / k
            above, below = (mean, below) if above >= below else (above, mean)
        return (n * above, n * below) if exponent > 0 else (n * below, n * above)


def _add(x: Sizes, y: Sizes) -> Sizes:
    return max(x[0] + y[1], x[1] + y[0]) + 1, x[1] + y[1]


def _multiply(x: Sizes, y: Sizes) -> Sizes:
    return x[0] + y[0], x[1] + y[1]


# --- other numbers: identities -------------------------------------------------------------------


def is_identity(x: Exact) -> bool:
    """Return whether x is 0 by what holds whatever π, arcs and angles are."""
    try:
        return _Quotients(x).vanishes(x)
    except (OverflowError, IndexError):  # too many terms, or generators
        return False


class _Quotients(dict[Exact, Quotient]):
    """Numbers as quotients of polynomials in generators, reduced by what holds among them.

    Generators are π, arcs, cosines c and sines s of angles, roots, and algebraic numbers, of which
    nothing is assumed. The relations are s² = 1 − c², and yᵏ = N Dᵏ⁻¹ of y = D (N/D)^(1/k). One
    generator stands for one number: a square root is a sine or less it, by the sign of that.
    """

    def __init__(self, x: Exact) -> None:
        ring = fmpq_mpoly_ctx.get([("x", _MAX_GENERATORS)], Ordering.lex)
        self._unused = [*ring.gens()]  # the last is the least
        self._one = ring.constant(1)
        self._relations: list[fmpq_mpoly] = []  # each with a power of one generator in front
        self._algebraic: dict[int, Exact] = {}  # generators that are algebraic numbers
        self._circles: dict[Exact, tuple[fmpq_mpoly, fmpq_mpoly]] = {}
        self._roots: list[tuple[tuple[Quotient, int], fmpq_mpoly]] = []
        self._bounds = _Bounds()
        self._units: dict[Exact, fmpq] = {}  # of which the multiples of an angle are whole ones
        for wave in (each for each in _nodes(x) if each.op in ("cos", "sin")):
            times, angle = split(wave.args[0])
            self._units[angle] = _quotient(times).gcd(self._units.get(angle, fmpq(0)))

    def vanishes(self, x: Exact) -> bool:
        """Return whether every coefficient of the numerator of x is zero."""
        found: dict[tuple[int, ...], Exact] = {}
        for exponents, c in self[x][0].terms():
            free = tuple(n for i, n in enumerate(exponents) if i not in self._algebraic)
            powers = [value ** int(exponents[i]) for i, value in self._algebraic.items()]
            term = reduce(Exact.__mul__, powers, rational(Fraction(int(c.p), int(c.q))))
            found[free] = found.get(free, ZERO) + term
        return all(separation(c) <= _MAX_COEFFICIENT_BITS and c.sign() == 0 for c in found.values())

    def __missing__(self, x: Exact) -> Quotient:
        algebraic = self._bounds[x][1] < math.inf
        if x.op == "rational":
            found = self._one * _quotient(x.args[0]), self._one
        elif x.op in ("+", "*"):
            combine = self._add if x.op == "+" else self._multiply
            found = reduce(combine, map(self.__getitem__, x.args))
        elif x.op == "^" and not (algebraic and x.args[1].denominator > 1):
            found = self._power(*x.args)
        elif x.op in ("cos", "sin") and not algebraic:
            found = self._wave(x), self._one
        else:
            found = self._unused.pop(), self._one
            if algebraic:
                self._algebraic[len(self._unused)] = x
        self[x] = found
        return found

    def _wave(self, x: Exact) -> fmpq_mpoly:
        """The cosine or sine of a multiple of an angle, by the sums of angles."""
        times, angle = split(x.args[0])
        if (n := _quotient(times) / self._units[angle]) > _MAX_MULTIPLE:
            raise OverflowError
        if angle not in self._circles:
            c, s = self._circles[angle] = self._unused.pop(), self._unused.pop()
            self._relations.append(s**2 + c**2 - 1)
            ball = sin(x.args[0] / int(n.p)).ball(_SIGN_BITS[0])
            if ball > 0 or ball < 0:
                positive = s if ball > 0 else -s
                self._roots.append((((1 - c**2, self._one), 2), positive))
        (c, s), cosine, sine = self._circles[angle], self._one, 0 * self._one
        for _ in range(int(n.p)):
            cosine, sine = self._reduce(cosine * c - sine * s), self._reduce(sine * c + cosine * s)
        return cosine if x.op == "cos" else sine

    def _power(self, base: Exact, exponent: Fraction) -> Quotient:
        n, k = abs(exponent.numerator), exponent.denominator
        root = self[base] if k == 1 else self._root(*self[base], k)
        above, below = reduce(self._multiply, [root] * n)
        return (above, below) if exponent > 0 else (below, above)

    def _root(self, above: fmpq_mpoly, below: fmpq_mpoly, k: int) -> Quotient:
        """The k-th root of a quotient: that of a rational factor, and a generator by the rest."""
        lead = below.leading_coefficient()
        content = abs(reduce(fmpq.gcd, above.coeffs()) / lead)
        above, below = above / (lead * content), below / lead
        key = (above, below), k
        root = next((root for known, root in self._roots if known == key), None)
        if root is None:
            root = self._unused.pop()
            self._relations.append(root**k - reduce(self._times, [above] + [below] * (k - 1)))
            self._roots.append((key, root))
        factor = rational(Fraction(int(content.p), int(content.q))) ** Fraction(1, k)
        return self._multiply((root, below), self[factor])

    def _add(self, a: Quotient, b: Quotient) -> Quotient:
        shared = a[1].gcd(b[1])
        left, right = b[1] / shared, a[1] / shared
        return self._times(a[0], left) + self._times(b[0], right), self._times(a[1], left)

    def _multiply(self, a: Quotient, b: Quotient) -> Quotient:
        return self._times(a[0], b[0]), self._times(a[1], b[1])

    def _times(self, a: fmpq_mpoly, b: fmpq_mpoly) -> fmpq_mpoly:
        if len(a) * len(b) > _MAX_PRODUCTS:
            raise OverflowError
        return self._reduce(a * b)

    def _reduce(self, value: fmpq_mpoly) -> fmpq_mpoly:
        for relation in reversed(self._relations):  # from the greatest generator down
            value %= relation
        return value


def _nodes(x: Exact) -> Iterator[Exact]:
    """Every number in the tree of x."""
    yield x
    for each in x.args:
        if isinstance(each, Exact):
            yield from _nodes(each)


def _quotient(q: Fraction) -> fmpq:
    return fmpq(q.numerator, q.denominator)
