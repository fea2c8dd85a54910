"""Proof that a form is exactly zero.

The form is written as a quotient of polynomials in its generators, and the numerator is reduced by
what holds among them: r^q = n for the root of an integer, sin² = 1 − cos², the minimal polynomial
for the cosine of a rational part of π, y^q = P for the root of a sum P. A numerator that reduces to
nothing proves zero; one that does not proves nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Final, NamedTuple

from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx, fmpz_poly

from heavytop.numbers.forms import PI, Atom, Form, Wave, multiple
from heavytop.numbers.generators import Generators, generators

_MAX_WORK: Final = 5_000_000  # products of one word by another
_MAX_POWER: Final = 64
_MAX_GENERATORS: Final = 32
_MAX_ORDER: Final = 360  # of the root of unity whose real part is adjoined


class _TooLargeError(Exception):
    """The proof would take too much work."""


class _Quotient(NamedTuple):
    above: fmpq_mpoly
    below: fmpq_mpoly  # not zero as a number


def proved_zero(x: Form) -> bool:
    """Whether x is proved to be zero."""
    try:
        return bool(_Expansion(generators(x)).quotient(x).above.is_zero())
    except _TooLargeError:
        return False


class _Expansion:
    """Forms as quotients of polynomials in given generators, reduced."""

    def __init__(self, base: Generators) -> None:
        angles = dict.fromkeys(unit for unit, _ in base.multiples.values())
        count = len(base.integers) + 1 + 2 * len(angles) + len(base.roots)
        if count > _MAX_GENERATORS or max(base.index, base.pi) > _MAX_POWER:
            raise _TooLargeError
        self.ring = fmpq_mpoly_ctx.get([("x", count)], Ordering.lex)
        self.one = self.ring.constant(1)
        self.work = 0
        self.relations: list[fmpq_mpoly] = []  # each with a power of one generator in front
        unused = iter(reversed(self.ring.gens()))  # the last is the least
        self.base = base
        self.pi = next(unused)
        self.integers = [(n, self._root(next(unused), base.index, n)) for n in base.integers]
        self.angles = {angle: self._angle(angle, unused) for angle in angles}
        self.sums: dict[Form, _Quotient] = {}  # the root of each, of its order
        for form, order in base.roots.items():
            self.sums[form] = self._sum_root(form, order, unused)

    def quotient(self, x: Form) -> _Quotient:
        """The value of x."""
        total = _Quotient(self.one * 0, self.one)
        for monomial, c in x:
            term = _Quotient(self.one * _rational(c), self.one)
            for atom, e in monomial:
                term = self._product(term, self._atom(atom, e))
            total = self._sum(total, term)
        return total

    # --- generators, and what holds among them ------------------------------------------------

    def _root(self, generator: fmpq_mpoly, order: int, of: fmpq_mpoly | int) -> fmpq_mpoly:
        self.relations.append(generator**order - of)
        return generator

    def _angle(self, angle: Form, unused: Iterator[fmpq_mpoly]) -> tuple[fmpq_mpoly, fmpq_mpoly]:
        """The cosine and sine of an angle."""
        cosine, sine = next(unused), next(unused)
        turns = multiple(angle, PI[0][0])
        if turns is not None and (order := (turns / 2).denominator) <= _MAX_ORDER:
            minimal = fmpz_poly.cos_minpoly(order)  # of twice the cosine
            self.relations.append(
                sum((c * (2 * cosine) ** k for k, c in enumerate(minimal)), self.one * 0)
            )
        return cosine, self._root(sine, 2, 1 - cosine**2)

    def _sum_root(self, form: Form, order: int, unused: Iterator[fmpq_mpoly]) -> _Quotient:
        """(N/D)^(1/q) as y/D, where y^q = N D^(q−1)."""
        if order > _MAX_POWER:
            raise _TooLargeError
        inner = self.quotient(form)
        if order == 1:
            return inner
        for other, root in self.sums.items():
            if self.base.roots[other] == order and self.quotient(other) == inner:
                return root
        radicand = self._times(inner.above, self._power(inner.below, order - 1))
        return _Quotient(self._root(next(unused), order, radicand), inner.below)

    # --- powers of atoms ------------------------------------------------------------------------

    def _atom(self, atom: Atom, e: Fraction) -> _Quotient:
        if isinstance(atom, Fraction):
            return self._product(
                self._integer(atom.numerator, e), self._integer(atom.denominator, -e)
            )
        if isinstance(atom, str):
            return self._whole_power(_Quotient(self.pi, self.one), e * self.base.pi)
        if isinstance(atom, Wave):
            return self._whole_power(_Quotient(self._wave(atom), self.one), e)
        return self._whole_power(self.sums[atom], e * self.base.roots[atom])

    def _integer(self, n: int, e: Fraction) -> _Quotient:
        value = _Quotient(self.one, self.one)
        for base, root in self.integers:
            count = 0
            while n % base == 0:
                n, count = n // base, count + 1
            power = _Quotient(root, self.one)
            value = self._product(value, self._whole_power(power, e * count * self.base.index))
        return value

    def _wave(self, wave: Wave) -> fmpq_mpoly:
        angle, count = self.base.multiples[wave.argument]
        cosine, sine = self.angles[angle]
        c, s = self.one, self.one * 0
        for _ in range(abs(count)):
            c, s = (
                self._times(c, cosine) - self._times(s, sine),
                self._times(s, cosine) + self._times(c, sine),
            )
        return c if wave.name == "cos" else s if count > 0 else -s

    # --- arithmetic -----------------------------------------------------------------------------

    def _sum(self, a: _Quotient, b: _Quotient) -> _Quotient:
        shared = a.below.gcd(b.below)
        left, right = b.below / shared, a.below / shared
        return _Quotient(
            self._times(a.above, left) + self._times(b.above, right), self._times(a.below, left)
        )

    def _product(self, a: _Quotient, b: _Quotient) -> _Quotient:
        return _Quotient(self._times(a.above, b.above), self._times(a.below, b.below))

    def _whole_power(self, a: _Quotient, e: Fraction) -> _Quotient:
        above, below = a if e > 0 else (a.below, a.above)
        n = abs(e.numerator)
        return _Quotient(self._power(above, n), self._power(below, n))

    def _power(self, a: fmpq_mpoly, n: int) -> fmpq_mpoly:
        if n > _MAX_POWER and not a.is_one():
            raise _TooLargeError
        value = self.one
        for _ in range(0 if a.is_one() else n):
            value = self._times(value, a)
        return value

    def _times(self, a: fmpq_mpoly, b: fmpq_mpoly) -> fmpq_mpoly:
        if a.is_one() or b.is_one():
            return b if a.is_one() else a
        self.work += _size(a) * _size(b)
        if self.work > _MAX_WORK:
            raise _TooLargeError
        value = a * b
        for relation in reversed(self.relations):  # from the greatest generator down
            value %= relation
        return value


def _rational(q: Fraction) -> fmpq:
    return fmpq(q.numerator, q.denominator)


def _size(a: fmpq_mpoly) -> int:
    """The number of words in the coefficients."""
    return sum(1 + c.height_bits() // 64 for c in a.coeffs())
