"""Normal form of exact numbers: like terms and equal roots merged; and proof that a form is zero.

A form is a sum of terms, a term a rational coefficient times a monomial, a monomial a product of
whole powers of atoms; and an atom is π, a root, cosine, sine or acos of a form, or a sum again.
Roots stand above the line and to the first power, one of them at most of a rational number. All of
it is plain tuples, ordered by how they are written, so that equal forms compare and hash alike. No
term is zero: the form of 0 is empty.

Many zeros are seen in the form. For others the form is written as a quotient of polynomials in
generators, and the numerator is reduced by what holds among these: r² = n for the root of an
integer, sin² = 1 − cos², the minimal polynomial for the cosine of a rational part of π, y² = P for
the root of a sum P. A numerator that reduces to nothing proves zero; one that does not proves
nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from decimal import Context, Decimal
from fractions import Fraction
from functools import reduce
from itertools import combinations
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypeAlias

if TYPE_CHECKING:  # slow to import, and needed for proofs only
    from flint import fmpq_mpoly, fmpz_poly


@dataclass(frozen=True, slots=True)
class Function:
    """sqrt, cos, sin or acos of a form that has no simpler one."""

    name: Literal["sqrt", "cos", "sin", "acos"]
    argument: Form


Atom: TypeAlias = "Literal['pi'] | Function | Form"
Monomial: TypeAlias = "tuple[tuple[Atom, int], ...]"
Form: TypeAlias = "tuple[tuple[Monomial, Fraction], ...]"

_COSINES: Final = {  # q: n where cos πq = √n / 2
    Fraction(twelfths, 12): n for twelfths, n in ((0, 4), (2, 3), (3, 2), (4, 1), (6, 0))
}
_SMALL_PRIMES: Final = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47)

_MAX_MULTIPLE: Final = 8  # of an angle; where more is needed, arguments count as unrelated
_MAX_WORK: Final = 5_000_000  # of a proof: products of one word by another
_MAX_POWER: Final = 64
_MAX_GENERATORS: Final = 32
_MAX_ORDER: Final = 360  # of the root of unity whose real part is adjoined


def rational(q: Fraction | int) -> Form:
    """The form of a rational number."""
    return (((), q if isinstance(q, Fraction) else Fraction(q)),) if q else ()


def _single(atom: Atom) -> Form:
    return ((((atom, 1),), Fraction(1)),)


ZERO: Final = rational(0)
ONE: Final = rational(1)
PI: Final = _single("pi")
PI_ALONE: Final = PI[0][0]  # the monomial


def fraction(x: Form) -> Fraction | None:
    """The value of a form without atoms."""
    return _multiple(x, ())


def positive(atom: Atom) -> bool:
    """Whether an atom is seen to be positive: π, or the root of a rational number."""
    return atom == "pi" or (
        isinstance(atom, Function) and atom.name == "sqrt" and fraction(atom.argument) is not None
    )


def _multiple(x: Form, monomial: Monomial) -> Fraction | None:
    """The coefficient q where x is q times `monomial`, and nothing else."""
    if not x:
        return Fraction(0)
    return x[0][1] if len(x) == 1 and x[0][0] == monomial else None


def terms(x: Form) -> Iterator[tuple[Monomial, Fraction]]:
    """Every term in x, the inner ones first; not those within an angle."""
    for monomial, c in x:
        for atom, _ in monomial:
            if isinstance(atom, tuple):
                yield from terms(atom)
            elif isinstance(atom, Function) and atom.name == "sqrt":
                yield from terms(atom.argument)
        yield monomial, c


# --- arithmetic ------------------------------------------------------------------------------


def scaled(x: Form, q: Fraction | int) -> Form:
    """Return q x."""
    return tuple((monomial, c * q) for monomial, c in x) if q else ZERO


def add(a: Form, b: Form) -> Form:
    """Return a + b."""
    if (p := fraction(a)) is not None and (q := fraction(b)) is not None:
        return rational(p + q)
    total = dict(a)
    for monomial, c in b:
        total[monomial] = total[monomial] + c if monomial in total else c
    constant = rational(total.pop((), 0))  # which comes first
    kept = [(monomial, c) for monomial, c in total.items() if c]
    if len(kept) > 1:
        kept.sort(key=lambda term: _term_text(term[0], Fraction(1)))
    return (*constant, *kept)


def multiply(a: Form, b: Form) -> Form:
    """Return a b."""
    for x, y in ((a, b), (b, a)):
        if (c := fraction(x)) is not None:
            return scaled(y, c)
    (p, factors), (q, more) = _factored(a), _factored(b)
    return _product(p * q, (*factors, *more))


def power(x: Form, n: int) -> Form:
    """Return xⁿ; x is not zero where n < 0."""
    if (q := fraction(x)) is not None:
        return rational(q**n)
    c, factors = _factored(x)
    return _product(c**n, ((atom, k * n) for atom, k in factors))


def sqrt(x: Form) -> Form:
    """Return √x for x ≥ 0; of its factors a square and even powers of π are taken out."""
    if not x:
        return ZERO
    c = _measure([c for _, c in x])
    half = dict(x[0][0]).get("pi", 0) // 2 if len(x) == 1 else 0
    rest = multiply(scaled(x, 1 / c), power(PI, -2 * half))
    roots = [(Function("sqrt", each), 1) for each in (rational(c), rest) if each != ONE]
    return _product(Fraction(1), [("pi", half), *roots])


def wave(name: Literal["cos", "sin"], x: Form) -> Form:
    """Return cos x or sin x."""
    half_turns = _multiple(x, PI_ALONE)
    if half_turns is not None:
        return _cos_pi(half_turns if name == "cos" else Fraction(1, 2) - half_turns)
    return _wave_of_inverse(name, dict(x)) or _single(Function(name, x))


def _wave_of_inverse(name: Literal["cos", "sin"], x: dict[Monomial, Fraction]) -> Form:
    """Return cos or sin of ±acos y + nπ/2; an empty form for any other angle."""
    quarters = 2 * x.pop(PI_ALONE, Fraction(0)) - (name == "sin")
    if len(x) != 1 or quarters.denominator != 1 or (sign := _one_inverse(*x.items())) is None:
        return ()
    ((((inverse, _),), _),) = x.items()
    cosine = inverse.argument  # type: ignore[union-attr]
    sine = sqrt(add(ONE, scaled(multiply(cosine, cosine), -1)))
    way = int(quarters) % 4
    return scaled(sine if way % 2 else cosine, (1, -sign, -1, sign)[way])


def _one_inverse(term: tuple[Monomial, Fraction]) -> Fraction | None:
    """The factor ±1 of a term that is one acos and nothing else."""
    monomial, c = term
    alone = len(monomial) == 1 and monomial[0][1] == 1 and abs(c) == 1
    inverse = alone and isinstance(monomial[0][0], Function) and monomial[0][0].name == "acos"
    return c if inverse else None


def acos(x: Form) -> Form:
    """Return acos x, in closed form at the cosines of multiples of π/6 and π/4."""
    if x and x[0][1] < 0:
        return add(PI, scaled(acos(scaled(x, -1)), -1))
    for q, n in _COSINES.items():
        if sqrt(rational(Fraction(n, 4))) == x:
            return scaled(PI, q)
    return _single(Function("acos", x))


def _cos_pi(q: Fraction) -> Form:
    """Return cos πq, the angle brought to the first quadrant."""
    q = abs((q + 1) % 2 - 1)
    if 2 * q > 1:
        return scaled(_cos_pi(1 - q), -1)
    if q in _COSINES:
        return sqrt(rational(Fraction(_COSINES[q], 4)))
    return _single(Function("cos", scaled(PI, q)))


def _factored(x: Form) -> tuple[Fraction, Monomial]:
    """Write x ≠ 0 as a coefficient times a monomial, a sum as one with a positive first term."""
    if len(x) == 1:
        return x[0][1], x[0][0]
    c = _measure([c for _, c in x]) * (1 if x[0][1] > 0 else -1)
    return c, ((scaled(x, 1 / c), 1),)


def _measure(rationals: Collection[Fraction]) -> Fraction:
    """The largest positive rational that each of them, not all 0, is a whole multiple of."""
    return Fraction(
        math.gcd(*(q.numerator for q in rationals)),
        math.lcm(*(q.denominator for q in rationals)),
    )


def _product(coefficient: Fraction, factors: Iterable[tuple[Atom, int]]) -> Form:
    """The product of a coefficient and powers of atoms, like atoms and rational roots merged."""
    radicand = Fraction(1)
    powers: dict[Atom, int] = {}
    pending = [*factors]
    while pending:
        atom, n = pending.pop()
        if isinstance(atom, Function) and atom.name == "sqrt":
            if (q := fraction(atom.argument)) is not None:
                radicand *= q**n
                continue
            whole, n = divmod(n + powers.pop(atom, 0), 2)
            c, inner = _factored(atom.argument)
            coefficient *= c**whole
            pending += ((part, k * whole) for part, k in inner if whole)
        if total := n + powers.pop(atom, 0):
            powers[atom] = total
    outer, radicand = _surd(radicand)
    if not (coefficient := coefficient * outer):
        return ZERO
    if radicand != 1:
        powers[Function("sqrt", rational(radicand))] = 1
    monomial = sorted(powers.items(), key=lambda factor: _factor_text(*factor))
    if len(monomial) == 1 and isinstance(atom := monomial[0][0], tuple) and monomial[0][1] == 1:
        return scaled(atom, coefficient)
    return ((tuple(monomial), coefficient),)


def _surd(q: Fraction) -> tuple[Fraction, Fraction]:
    """Write √q as c √n with a whole n as small as is cheap to find; q > 0.

    >>> _surd(Fraction(8, 3))
    (Fraction(2, 3), Fraction(6, 1))
    """
    outer, n = Fraction(1, q.denominator), q.numerator * q.denominator
    for prime in _SMALL_PRIMES:
        while n % prime**2 == 0:
            n, outer = n // prime**2, outer * prime
    root = math.isqrt(n)
    return (outer * root, Fraction(1)) if root**2 == n else (outer, Fraction(n))


# --- text ------------------------------------------------------------------------------------


def written(x: Form) -> str:
    """A text that says x in the grammar of scenes."""
    return " + ".join(_term_text(*term) for term in x).replace("+ -", "- ") or "0"


def _term_text(monomial: Monomial, c: Fraction) -> str:
    above = [_factor_text(atom, n) for atom, n in monomial if n > 0]
    below = ["/" + _factor_text(atom, -n) for atom, n in monomial if n < 0]
    if abs(c) != 1 or not above:
        above.insert(0, _decimal(c))
    elif c < 0:
        above[0] = "-" + above[0]
    return "*".join(above) + "".join(below)


def _factor_text(atom: Atom, n: int) -> str:
    if isinstance(atom, str):
        body: str = atom
    elif isinstance(atom, Function):
        body = f"{atom.name}({written(atom.argument)})"
    else:
        body = f"({written(atom)})"
    return body if n == 1 else f"{body}^{n}"


def _decimal(q: Fraction) -> str:
    """A decimal where the expansion ends, else p/q; through Decimal, which knows no longest int."""
    p, d = Decimal(q.numerator), Decimal(q.denominator)
    places = q.denominator.bit_length()
    if pow(10, places, q.denominator):
        return f"{p}/{d}"
    digits = q.numerator.bit_length() + places
    return str(Context(digits).divide(p, d))


# --- proof of zero ---------------------------------------------------------------------------


class _Quotient(NamedTuple):
    above: fmpq_mpoly
    below: fmpq_mpoly  # not zero as a number


def proved_zero(x: Form) -> bool:
    """Whether x is proved to be zero."""
    try:
        return bool(_Expansion(x).quotient(x).above.is_zero())
    except OverflowError:  # it would take too much work
        return False


class _Expansion:
    """Quotients of polynomials in the generators of a form, reduced.

    The generators are π, roots of coprime integers, cosines and sines of angles that the others
    are small multiples of, and roots of sums.
    """

    def __init__(self, x: Form) -> None:
        from flint import Ordering, fmpq_mpoly_ctx

        atoms = dict.fromkeys(atom for monomial, _ in terms(x) for atom, _ in monomial)
        functions = [atom for atom in atoms if isinstance(atom, Function)]
        radicands = [fraction(each.argument) for each in functions if each.name == "sqrt"]
        integers = _coprime_base({int(n) for n in radicands if n is not None})
        waves = [each for each in functions if each.name in ("cos", "sin")]
        self.multiples = _multiples(each.argument for each in waves)
        count = len(integers) + len(atoms) + len(self.multiples)  # at most
        if count > _MAX_GENERATORS:
            raise OverflowError
        ring = fmpq_mpoly_ctx.get([("x", count)], Ordering.lex)
        self.unused = iter(reversed(ring.gens()))  # the last is the least
        self.one = ring.constant(1)
        self.work = 0
        self.relations: list[fmpq_mpoly] = []  # each with a power of one generator in front
        self.integers = [(n, self._root(self.one * n)) for n in integers]
        self.circles: dict[Form, tuple[fmpq_mpoly, fmpq_mpoly]] = {}
        self.sums: list[tuple[_Quotient, _Quotient]] = []  # each with its root
        self.values: dict[Atom, _Quotient] = {}

    def quotient(self, x: Form) -> _Quotient:
        """The value of x."""
        from flint import fmpq

        total = _Quotient(self.one * 0, self.one)
        for monomial, c in x:
            term = _Quotient(self.one * fmpq(c.numerator, c.denominator), self.one)
            for atom, n in monomial:
                if atom not in self.values:
                    self.values[atom] = self._value(atom)
                above, below = self.values[atom] if n > 0 else reversed(self.values[atom])
                factor = _Quotient(self._power(above, abs(n)), self._power(below, abs(n)))
                term = self._product(term, factor)
            total = self._sum(total, term)
        return total

    # --- generators, and what holds among them ------------------------------------------------

    def _value(self, atom: Atom) -> _Quotient:
        """The value of an atom that is met for the first time."""
        if isinstance(atom, tuple):
            return self.quotient(atom)
        if isinstance(atom, str) or atom.name == "acos":  # of which nothing is used
            return _Quotient(next(self.unused), self.one)
        if atom.name != "sqrt":
            return _Quotient(self._wave(atom), self.one)
        if (n := fraction(atom.argument)) is not None:
            return _Quotient(self._integer_root(int(n)), self.one)
        return self._sum_root(self.quotient(atom.argument))

    def _root(self, square: fmpq_mpoly) -> fmpq_mpoly:
        """The next generator, a square root."""
        generator = next(self.unused)
        self.relations.append(generator**2 - square)
        return generator

    def _integer_root(self, n: int) -> fmpq_mpoly:
        """The root of a product of the coprime integers."""
        product = self.one
        for base, root in self.integers:
            while n % base == 0:
                n, product = n // base, product * root
        return self._reduced(product)

    def _sum_root(self, square: _Quotient) -> _Quotient:
        """√(N/D) as y/D, where y² = N D."""
        for known, root in self.sums:
            if known == square:
                return root
        root = _Quotient(self._root(self._times(*square)), square.below)
        self.sums.append((square, root))
        return root

    def _wave(self, wave: Function) -> fmpq_mpoly:
        """The cosine or sine of nα, by Chebyshev's polynomials in cos α."""
        from flint import fmpz_poly

        angle, n = self.multiples[wave.argument]
        if angle not in self.circles:
            cosine = next(self.unused)
            turns = _multiple(angle, PI_ALONE)
            if turns is not None and (order := (turns / 2).denominator) <= _MAX_ORDER:
                self.relations.append(self._at(fmpz_poly.cos_minpoly(order), 2 * cosine))
            self.circles[angle] = cosine, self._root(1 - cosine**2)
        cosine, sine = self.circles[angle]
        if wave.name == "cos":
            return self._reduced(self._at(fmpz_poly.chebyshev_t(abs(n)), cosine))
        over_sine = self._at(fmpz_poly.chebyshev_u(abs(n) - 1), cosine)
        return self._reduced((sine if n > 0 else -sine) * over_sine)

    def _at(self, polynomial: fmpz_poly, x: fmpq_mpoly) -> fmpq_mpoly:
        """The value of a polynomial, not yet reduced."""
        return sum((c * x**k for k, c in enumerate(polynomial)), 0 * self.one)

    # --- arithmetic -----------------------------------------------------------------------------

    def _sum(self, a: _Quotient, b: _Quotient) -> _Quotient:
        shared = a.below.gcd(b.below)
        left, right = b.below / shared, a.below / shared
        return _Quotient(
            self._times(a.above, left) + self._times(b.above, right), self._times(a.below, left)
        )

    def _product(self, a: _Quotient, b: _Quotient) -> _Quotient:
        return _Quotient(self._times(a.above, b.above), self._times(a.below, b.below))

    def _power(self, a: fmpq_mpoly, n: int) -> fmpq_mpoly:
        if n > _MAX_POWER and not a.is_one():
            raise OverflowError
        return reduce(self._times, [a] * n, self.one)

    def _times(self, a: fmpq_mpoly, b: fmpq_mpoly) -> fmpq_mpoly:
        if a.is_one() or b.is_one():
            return b if a.is_one() else a
        self.work += _words(a) * _words(b)
        if self.work > _MAX_WORK:
            raise OverflowError
        return self._reduced(a * b)

    def _reduced(self, value: fmpq_mpoly) -> fmpq_mpoly:
        for relation in reversed(self.relations):  # from the greatest generator down
            value %= relation
        return value


def _words(a: fmpq_mpoly) -> int:
    """The number of words in the coefficients."""
    return sum(1 + c.height_bits() // 64 for c in a.coeffs())


def _coprime_base(numbers: Iterable[int]) -> list[int]:
    """Coprime integers, no squares, of whose powers the positive `numbers` are products.

    Products of their square roots are linearly independent over the rationals.

    >>> _coprime_base([12, 18, 49])
    [2, 3, 7]
    """
    base = {*numbers} - {1}
    while shared := next((two for two in combinations(base, 2) if math.gcd(*two) > 1), ()):
        common = math.gcd(*shared)
        base = base - {*shared} | {common, *(n // common for n in shared)} - {1}
    while squares := {n for n in base if math.isqrt(n) ** 2 == n}:
        base = base - squares | {math.isqrt(n) for n in squares}
    return sorted(base)


def _multiples(arguments: Iterable[Form]) -> dict[Form, tuple[Form, int]]:
    """Each argument as an angle and the whole number, which is small, that it is times this."""
    families: list[tuple[Form, list[Fraction]]] = []  # of small multiples of a common measure
    for argument in arguments:
        size = argument[0][1]
        direction = scaled(argument, 1 / size)
        for other, sizes in families:
            every = [*sizes, size]
            if other == direction and max(map(abs, every)) <= _MAX_MULTIPLE * _measure(every):
                sizes.append(size)
                break
        else:
            families.append((direction, [size]))
    return {
        scaled(direction, size): (scaled(direction, unit), int(size / unit))
        for direction, sizes in families
        for unit in [_measure(sizes)]
        for size in sizes
    }
