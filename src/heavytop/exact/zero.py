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

from flint import Ordering, arb, fmpq, fmpq_mpoly, fmpq_mpoly_ctx, fmpz_poly

from heavytop.exact.balls import ball_of, working
from heavytop.exact.number import NOTHING, Exact, Sign, cos, rational, sin, split

Sizes: TypeAlias = tuple[float, float]
Quotient: TypeAlias = tuple[fmpq_mpoly, fmpq_mpoly]

_BITS: Final = (64, 256)  # which nearly always tell a sign
_MORE_BITS: Final = (1024, 4096)  # for what is not proved to be zero
_MAX_BITS: Final = 1 << 17  # of a separation bound
_MAX_COEFFICIENT_BITS: Final = 1 << 15  # of that of a coefficient, of which there may be many
_MAX_ORDER: Final = 360  # of the root of unity whose real part is a coefficient
_MAX_TIMES: Final = 256  # of an angle; where more is needed, angles count as unrelated
_MAX_GENERATORS: Final = 48
_MAX_PRODUCTS: Final = 100_000  # of terms, in a product of polynomials


def sign_of(x: Exact) -> Sign | None:
    """Return the sign of a number, or None where it is undecided."""
    if sign := _side(x, _BITS):
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
    """The side of zero where a ball lies, at the first precision that tells."""
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
    bound = _Bound()
    above, below = bound.sizes(x)
    degree = math.prod(bound.roots.values()) * max(1, bound.order // 2)
    if below == math.inf:
        return math.inf
    return below + max(above, 0) * (degree - 1) + 64  # more than the roundings of these doubles


class _Bound:
    """Sizes of algebraic integers that a number is the quotient of, and roots that are adjoined.

    A size is log2 of the largest conjugate. Roots are given by radicand with their degree, cosines
    of rational parts of π by the order of a root of unity.
    """

    def __init__(self) -> None:
        self.roots: dict[Exact, int] = {}
        self.order = 1
        self._known: dict[Exact, Sizes] = {}

    def sizes(self, x: Exact) -> Sizes:
        """The sizes of numerator and denominator; infinite where x is not algebraic."""
        if x not in self._known:
            self._known[x] = self._sizes(x)
        return self._known[x]

    def _sizes(self, x: Exact) -> Sizes:
        if x.op == "rational":
            return _log2(abs(x.args[0].numerator)), _log2(x.args[0].denominator)
        if x.op in ("+", "*"):
            return reduce(_add if x.op == "+" else _multiply, map(self.sizes, x.args))
        if x.op == "^":
            return self._power(*x.args)
        if (times := _half_turns(x)) is None:
            return math.inf, math.inf
        self.order = math.lcm(self.order, (times / 2).denominator)
        return 1, 1  # 2 cos is an integer, of size 2 like its conjugates

    def _power(self, base: Exact, exponent: Fraction) -> Sizes:
        (above, below), k, n = self.sizes(base), exponent.denominator, abs(exponent.numerator)
        if k > 1:
            self.roots[base] = math.lcm(self.roots.get(base, 1), k)
            mean = (max(above, below) + (k - 1) * min(above, below)) / k
            above, below = (mean, below) if above >= below else (above, mean)
        return (n * above, n * below) if exponent > 0 else (n * below, n * above)


def _add(x: Sizes, y: Sizes) -> Sizes:
    return max(x[0] + y[1], x[1] + y[0]) + 1, x[1] + y[1]


def _multiply(x: Sizes, y: Sizes) -> Sizes:
    return x[0] + y[0], x[1] + y[1]


def _log2(n: int) -> float:
    return math.log2(n) if n else 0


def _half_turns(x: Exact) -> Fraction | None:
    """The q of cos πq."""
    times, angle = split(x.args[0]) if x.op == "cos" else (Fraction(0), x)
    return times if angle.op == "pi" and times else None


# --- other numbers: identities -------------------------------------------------------------------


def is_identity(x: Exact) -> bool:
    """Return whether x is 0 by what holds whatever π, arcs and angles are."""
    try:
        return _Field(x).vanishes(x)
    except OverflowError:
        return False


class _Field:
    """Quotients of polynomials in generators, reduced by what holds among them.

    Generators are π, arcs, cosines c and sines s of angles, roots y of polynomials P, and algebraic
    numbers, of which little is assumed. The relations are s² = 1 − c² and yᵏ = P.
    """

    def __init__(self, x: Exact) -> None:
        ring = fmpq_mpoly_ctx.get([("x", _MAX_GENERATORS)], Ordering.lex)
        self._unused = [*enumerate(ring.gens())]  # the last is the least
        self._one = ring.constant(1)
        self._relations: list[fmpq_mpoly] = []  # each with a power of one generator in front
        self._constants: dict[int, Exact] = {}  # generators that are algebraic numbers
        self._circles: dict[tuple[Exact, Fraction], Quotient] = {}
        self._roots: list[tuple[fmpq_mpoly, int, fmpq_mpoly]] = []
        self._known: dict[Exact, Quotient] = {}
        self._units = _units(node.args[0] for node in _nodes(x) if node.op in ("cos", "sin"))

    def vanishes(self, x: Exact) -> bool:
        """Return whether every coefficient of the numerator of x is zero."""
        found: dict[tuple[int, ...], Exact] = {}
        for exponents, c in self._value(x)[0].terms():
            free = tuple(0 if i in self._constants else n for i, n in enumerate(exponents))
            powers = [value ** int(exponents[i]) for i, value in self._constants.items()]
            term = reduce(Exact.__mul__, powers, rational(Fraction(int(c.p), int(c.q))))
            found[free] = found.get(free, NOTHING) + term
        return all(separation(c) <= _MAX_COEFFICIENT_BITS and c.sign() == 0 for c in found.values())

    def _value(self, x: Exact) -> Quotient:
        if x not in self._known:
            self._known[x] = self._computed(x)
        return self._known[x]

    def _computed(self, x: Exact) -> Quotient:
        if x.op == "rational":
            return self._one * fmpq(x.args[0].numerator, x.args[0].denominator), self._one
        if x.op == "^":
            return self._power(*x.args)
        if x.op in ("+", "*"):
            return reduce(self._sum if x.op == "+" else self._product, map(self._value, x.args))
        if x.op in ("cos", "sin"):
            return self._wave(x.op, *split(x.args[0])), self._one
        return self._generator(), self._one

    # --- generators ---------------------------------------------------------------------------

    def _generator(self) -> fmpq_mpoly:
        if not self._unused:
            raise OverflowError
        return self._unused.pop()[1]

    def _constant(self, x: Exact) -> fmpq_mpoly:
        generator = self._generator()
        self._constants[len(self._unused)] = x
        return generator

    def _adjoined(self, radicand: fmpq_mpoly, k: int) -> fmpq_mpoly:
        """A root of a polynomial."""
        for other, degree, root in self._roots:
            if other == radicand and degree == k:
                return root
        root = self._generator()
        self._relations.append(root**k - radicand)
        self._roots.append((radicand, k, root))
        return root

    def _wave(self, name: str, times: Fraction, angle: Exact) -> fmpq_mpoly:
        """The cosine or sine of a multiple of an angle, by Chebyshev's polynomials."""
        unit = self._units[angle]
        n = times / unit
        if n.denominator > 1 or n > _MAX_TIMES:
            n, unit = Fraction(1), times
        if (key := (angle, unit)) not in self._circles:
            constant = _is_constant(cos(angle * unit))
            cosine = self._constant(cos(angle * unit)) if constant else self._generator()
            self._circles[key] = cosine, self._adjoined(1 - cosine**2, 2)
            if constant:
                self._constants[len(self._unused)] = sin(angle * unit)
        cosine, sine = self._circles[key]
        if name == "cos":
            return self._reduced(_at(fmpz_poly.chebyshev_t(int(n)), cosine))
        return self._reduced(sine * _at(fmpz_poly.chebyshev_u(int(n) - 1), cosine))

    # --- arithmetic -----------------------------------------------------------------------------

    def _power(self, base: Exact, exponent: Fraction) -> Quotient:
        n, k = abs(exponent.numerator), exponent.denominator
        if exponent == Fraction(1, k) and k > 1:
            return self._root(base, k)
        above, below = self._value(base if k == 1 else Exact("^", (base, Fraction(1, k))))
        above, below = self._product_of([above] * n), self._product_of([below] * n)
        return (above, below) if exponent > 0 else (below, above)

    def _root(self, base: Exact, k: int) -> Quotient:
        """The root of N/D as y/D, where yᵏ = N Dᵏ⁻¹ but for a rational factor."""
        if _is_constant(base):
            root = self._constant(Exact("^", (base, Fraction(1, k))))
            if base.op == "rational":
                self._relations.append(root**k - int(base.args[0]))
            return root, self._one
        above, below = self._value(base)
        radicand = self._product_of([above] + [below] * (k - 1))
        content = _measure(Fraction(int(c.p), int(c.q)) for c in radicand.coeffs())
        root = self._adjoined(radicand * fmpq(content.denominator, content.numerator), k)
        return self._product((root, below), self._value(rational(content) ** Fraction(1, k)))

    def _sum(self, a: Quotient, b: Quotient) -> Quotient:
        shared = a[1].gcd(b[1])
        left, right = b[1] / shared, a[1] / shared
        return self._times(a[0], left) + self._times(b[0], right), self._times(a[1], left)

    def _product(self, a: Quotient, b: Quotient) -> Quotient:
        return self._times(a[0], b[0]), self._times(a[1], b[1])

    def _product_of(self, factors: list[fmpq_mpoly]) -> fmpq_mpoly:
        return reduce(self._times, factors)

    def _times(self, a: fmpq_mpoly, b: fmpq_mpoly) -> fmpq_mpoly:
        if len(a) * len(b) > _MAX_PRODUCTS:
            raise OverflowError
        return self._reduced(a * b)

    def _reduced(self, value: fmpq_mpoly) -> fmpq_mpoly:
        for relation in reversed(self._relations):  # from the greatest generator down
            value %= relation
        return value


def _is_constant(x: Exact) -> bool:
    """Whether x is algebraic, of a degree that is not large."""
    if x.op in ("+", "*", "^"):
        return all(_is_constant(each) for each in x.args if isinstance(each, Exact))
    times = _half_turns(x)
    return x.op == "rational" or (times is not None and (times / 2).denominator <= _MAX_ORDER)


def _nodes(x: Exact) -> Iterator[Exact]:
    """Every number in the tree of x."""
    yield x
    for each in x.args:
        if isinstance(each, Exact):
            yield from _nodes(each)


def _units(angles: Iterable[Exact]) -> dict[Exact, Fraction]:
    """What each angle is a multiple of, but for a whole number."""
    sizes: dict[Exact, list[Fraction]] = {}
    for times, angle in map(split, angles):
        sizes.setdefault(angle, []).append(times)
    return {angle: _measure(every) for angle, every in sizes.items()}


def _measure(rationals: Iterable[Fraction]) -> Fraction:
    """The largest positive rational that each of them, not all 0, is a whole multiple of."""
    every = [*rationals]
    return Fraction(
        math.gcd(*(q.numerator for q in every)), math.lcm(*(q.denominator for q in every))
    )


def _at(polynomial: fmpz_poly, x: fmpq_mpoly) -> fmpq_mpoly:
    """The value of a polynomial, not yet reduced."""
    return sum((c * x**k for k, c in enumerate(polynomial)), 0 * x)
