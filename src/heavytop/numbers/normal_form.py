"""Normal form of exact numbers: like terms and equal roots merged; and proof that a form is zero.

A form is a sum of terms, a term a rational coefficient times a monomial, a monomial a product of
powers of atoms; and an atom is a positive rational under a root, π, a cosine or sine, or a form
again. All of it is plain tuples, ordered by how they are written, so that equal forms compare and
hash alike. No term is zero: the form of 0 is empty.

Many zeros are seen in the form. For others the form is written as a quotient of polynomials in
generators, and the numerator is reduced by what holds among these: r^q = n for the root of an
integer, sin² = 1 − cos², the minimal polynomial for the cosine of a rational part of π, y^q = P for
the root of a sum P. A numerator that reduces to nothing proves zero; one that does not proves
nothing.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from decimal import MAX_EMAX, MIN_EMIN, Context, Decimal
from fractions import Fraction
from functools import reduce
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, TypeAlias

if TYPE_CHECKING:  # slow to import, and needed for proofs only
    from flint import fmpq_mpoly


@dataclass(frozen=True, slots=True)
class Trig:
    """cos or sin of a form that has no simpler one."""

    name: Literal["cos", "sin"]
    argument: Form


Atom: TypeAlias = "Fraction | Literal['pi'] | Trig | Form"
Monomial: TypeAlias = "tuple[tuple[Atom, Fraction], ...]"
Form: TypeAlias = "tuple[tuple[Monomial, Fraction], ...]"

HALF: Final = Fraction(1, 2)
_COSINES: Final = {  # q: n where cos πq = √n / 2
    Fraction(0): 4,
    Fraction(1, 6): 3,
    Fraction(1, 4): 2,
    Fraction(1, 3): 1,
    Fraction(1, 2): 0,
}
_SMALL_PRIMES: Final = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47)
_MAX_BITS: Final = 8192  # above this a root is kept as written: correct still, only less merged

_MAX_MULTIPLE: Final = 8  # of an angle; where more is needed, arguments count as unrelated
_MAX_WORK: Final = 5_000_000  # of a proof: products of one word by another
_MAX_POWER: Final = 64
_MAX_GENERATORS: Final = 32
_MAX_ORDER: Final = 360  # of the root of unity whose real part is adjoined


def rational(q: Fraction | int) -> Form:
    """The form of a rational number."""
    return (((), q if isinstance(q, Fraction) else Fraction(q)),) if q else ()


def _single(atom: Atom) -> Form:
    return ((((atom, Fraction(1)),), Fraction(1)),)


ZERO: Final = rational(0)
ONE: Final = rational(1)
PI: Final = _single("pi")
PI_ALONE: Final = PI[0][0]  # the monomial


def fraction(x: Form) -> Fraction | None:
    """The value of a form without atoms."""
    return _multiple(x, ())


def _multiple(x: Form, monomial: Monomial) -> Fraction | None:
    """The coefficient q where x is q times `monomial`, and nothing else."""
    if not x:
        return Fraction(0)
    return x[0][1] if len(x) == 1 and x[0][0] == monomial else None


# --- arithmetic ------------------------------------------------------------------------------


def scaled(x: Form, q: Fraction | int) -> Form:
    """Return q x."""
    return tuple((monomial, c * q) for monomial, c in x) if q else ZERO


def add(a: Form, b: Form) -> Form:
    """Return a + b."""
    total = dict(a)
    for monomial, c in b:
        total[monomial] = total[monomial] + c if monomial in total else c
    kept = [(monomial, c) for monomial, c in total.items() if c]
    if len(kept) > 1:
        kept.sort(key=lambda term: _term_text(term[0], Fraction(1)))
    return tuple(kept)


def multiply(a: Form, b: Form) -> Form:
    """Return a b."""
    for x, y in ((a, b), (b, a)):
        if (c := fraction(x)) is not None:
            return scaled(y, c)
    (p, factors), (q, more) = _factored(a), _factored(b)
    return _product(p * q, (*factors, *more))


def power(x: Form, e: Fraction) -> Form:
    """Return xᵉ; x is not zero where e < 0, and not negative where e is not whole."""
    root = e.denominator > 1
    if not root and (q := fraction(x)) is not None:
        return rational(q**e.numerator)
    if not x:
        return ZERO
    c, factors = _factored(x, root)
    return _product(Fraction(1), [(c, e), *((atom, k * e) for atom, k in factors)])


def cos(x: Form) -> Form:
    """Return cos x."""
    half_turns = _multiple(x, PI_ALONE)
    return _single(Trig("cos", x)) if half_turns is None else _cos_pi(half_turns)


def sin(x: Form) -> Form:
    """Return sin x."""
    half_turns = _multiple(x, PI_ALONE)
    return _single(Trig("sin", x)) if half_turns is None else _cos_pi(HALF - half_turns)


def _cos_pi(q: Fraction) -> Form:
    """Return cos πq, the angle brought to the first quadrant."""
    q = abs((q + 1) % 2 - 1)
    if q > HALF:
        return scaled(_cos_pi(1 - q), -1)
    if q in _COSINES:
        return power(rational(Fraction(_COSINES[q], 4)), HALF)
    return _single(Trig("cos", scaled(PI, q)))


def _factored(x: Form, for_root: bool = False) -> tuple[Fraction, Monomial]:
    """Write x ≠ 0 as a coefficient times a monomial; a sum becomes one with a positive first term.

    For a root nothing may be negative: √(y²) is |y|, so a power of a y of unknown sign is not taken
    apart, and x as a whole keeps its sign.
    """
    if len(x) == 1:
        monomial, c = x[0]
        if not for_root or (c > 0 and all(_never_negative(atom, e) for atom, e in monomial)):
            return c, monomial
    c = _measure([c for _, c in x])
    if x[0][1] < 0 and not for_root:
        c = -c
    return c, ((scaled(x, 1 / c), Fraction(1)),)


def _never_negative(atom: Atom, e: Fraction) -> bool:
    return isinstance(atom, (Fraction, str)) or e.denominator > 1


def _measure(rationals: Collection[Fraction]) -> Fraction:
    """The largest positive rational that each of them, not all 0, is a whole multiple of."""
    return Fraction(
        math.gcd(*(q.numerator for q in rationals)),
        math.lcm(*(q.denominator for q in rationals)),
    )


def _product(coefficient: Fraction, factors: Iterable[tuple[Atom, Fraction]]) -> Form:
    """The product of a coefficient and powers of atoms, like atoms and like roots merged."""
    roots: dict[Fraction, Fraction] = {}  # by exponent
    powers: dict[Atom, Fraction] = {}
    pending = list(factors)
    while pending:
        atom, e = pending.pop()
        if isinstance(atom, Fraction):
            outer, radicand, e = _surd(atom, e)
            coefficient *= outer
            if e in roots:
                pending.append((radicand * roots.pop(e), e))
            elif e:
                roots[e] = radicand
            continue
        e += powers.pop(atom, Fraction(0))
        if isinstance(atom, tuple) and len(atom) == 1 and e.denominator == 1:
            inner, c = atom[0]  # one term, kept whole as long as there was a root of it
            pending += [(c, e), *((part, k * e) for part, k in inner)]
        elif e:
            powers[atom] = e
    if not coefficient:
        return ZERO
    monomial = [*((base, e) for e, base in roots.items()), *powers.items()]
    if len(monomial) == 1 and isinstance(atom := monomial[0][0], tuple) and monomial[0][1] == 1:
        return scaled(atom, coefficient)
    return ((tuple(sorted(monomial, key=lambda factor: _factor_text(*factor))), coefficient),)


# --- roots of rational numbers ---------------------------------------------------------------


def _surd(base: Fraction, exponent: Fraction) -> tuple[Fraction, Fraction, Fraction]:
    """Write baseᵉ as c nᶠ with 0 ≤ f < 1 and an n as small as is cheap to find; base > 0.

    >>> _surd(Fraction(8, 3), Fraction(1, 2))
    (Fraction(2, 3), Fraction(6, 1), Fraction(1, 2))
    """
    whole = math.floor(exponent)
    outer, part = base**whole, exponent - whole
    if part == 0:
        return outer, Fraction(1), part
    p, q = part.numerator, part.denominator
    a, b = base.numerator, base.denominator
    if a.bit_length() * p + b.bit_length() * (q - p) > _MAX_BITS:
        return outer, base, part
    n = a**p * b ** (q - p)  # (a/b)^(p/q) = n^(1/q) / b
    for prime in _SMALL_PRIMES:
        while n % prime**q == 0:
            n, outer = n // prime**q, outer * prime
    n, order = _perfect_power(n, q)
    if order == q:
        return outer * n / b, Fraction(1), Fraction(0)
    return outer / b, Fraction(n), Fraction(order, q)


def _perfect_power(n: int, index: int) -> tuple[int, int]:
    """The largest k that divides `index` and is the order of a whole root of n; the root first."""
    for k in range(index, 1, -1):
        if index % k == 0 and (r := _integer_root(n, k)) ** k == n:
            return r, k
    return n, 1


def _integer_root(n: int, k: int) -> int:
    """The largest integer r with rᵏ ≤ n, by Newton's iteration from above."""
    if n < 2:
        return n
    r = 1 << -(-n.bit_length() // k)
    while (lower := ((k - 1) * r + n // r ** (k - 1)) // k) < r:
        r = lower
    return r


def _coprime_base(numbers: Iterable[int], index: int) -> tuple[int, ...]:
    """Coprime integers of whose powers the positive `numbers` are products.

    None of them is itself a power of an order that divides `index`, so that products of their
    roots of that order are linearly independent over the rationals.

    >>> _coprime_base([12, 18, 49], 2)
    (2, 3, 7)
    """
    base: list[int] = []
    pending = list(numbers)
    while pending:
        n = pending.pop()
        shared = next((b for b in base if math.gcd(b, n) > 1), None)
        if shared is not None:
            base.remove(shared)
            common = math.gcd(shared, n)
            pending += [common, shared // common, n // common]
        elif n > 1:
            order = index
            while order > 1:
                n, order = _perfect_power(n, index)
            base.append(n)
    return tuple(sorted(base))


# --- text ------------------------------------------------------------------------------------


def written(x: Form) -> str:
    """A text that says x in the grammar of scenes, with cos( ) and sin( ) added."""
    return " + ".join(_term_text(*term) for term in x).replace("+ -", "- ") or "0"


def _term_text(monomial: Monomial, c: Fraction) -> str:
    above = [_factor_text(atom, e) for atom, e in monomial if e > 0]
    below = ["/" + _factor_text(atom, -e) for atom, e in monomial if e < 0]
    if abs(c) != 1 or not above:
        above.insert(0, _decimal(c))
    elif c < 0:
        above[0] = "-" + above[0]
    return "*".join(above) + "".join(below)


def _factor_text(atom: Atom, e: Fraction) -> str:
    if isinstance(atom, str):
        body: str = atom
    elif isinstance(atom, Trig):
        body = f"{atom.name}({written(atom.argument)})"
    else:
        body = f"({_decimal(atom) if isinstance(atom, Fraction) else written(atom)})"
        if e == HALF:
            return "sqrt" + body
    return body if e == 1 else f"{body}^{e}" if e.denominator == 1 else f"{body}^({e})"


def _decimal(q: Fraction) -> str:
    """A decimal where the expansion ends, else p/q; through Decimal, which knows no longest int."""
    p, d = Decimal(q.numerator), Decimal(q.denominator)
    places = q.denominator.bit_length()
    if pow(10, places, q.denominator):
        return f"{p}/{d}"
    digits = q.numerator.bit_length() + places
    return str(Context(digits, Emin=MIN_EMIN, Emax=MAX_EMAX).divide(p, d))


# --- proof of zero ---------------------------------------------------------------------------


class _TooLargeError(Exception):
    """The proof would take too much work."""


class _Quotient(NamedTuple):
    above: fmpq_mpoly
    below: fmpq_mpoly  # not zero as a number


def proved_zero(x: Form) -> bool:
    """Whether x is proved to be zero."""
    try:
        return bool(_Expansion(x).quotient(x).above.is_zero())
    except _TooLargeError:
        return False


class _Expansion:
    """Quotients of polynomials in the generators of a form, reduced.

    The generators are π or a root of it, roots of coprime integers, cosines and sines of angles
    that the others are small multiples of, and roots of sums.
    """

    def __init__(self, x: Form) -> None:
        from flint import Ordering, fmpq_mpoly_ctx

        orders: dict[Atom, int] = {}  # of the root of each atom; what a sum holds stands before it
        for atom, e in _atoms(x):
            orders[atom] = math.lcm(orders.get(atom, 1), e.denominator)
        rationals = [atom for atom in orders if isinstance(atom, Fraction)]
        waves = [atom for atom in orders if isinstance(atom, Trig)]
        sums = [atom for atom in orders if isinstance(atom, tuple)]
        index = math.lcm(*(orders[q] for q in rationals))
        integers = _coprime_base({n for q in rationals for n in q.as_integer_ratio()}, index)
        multiples = _multiples(dict.fromkeys(wave.argument for wave in waves))
        angles = dict.fromkeys(angle for angle, _ in multiples.values())
        count = 1 + len(integers) + 2 * len(angles) + len(sums)
        if count > _MAX_GENERATORS or max([index, *orders.values()]) > _MAX_POWER:
            raise _TooLargeError
        ring = fmpq_mpoly_ctx.get([("x", count)], Ordering.lex)
        self.unused = iter(reversed(ring.gens()))  # the last is the least
        self.one = ring.constant(1)
        self.work = 0
        self.relations: list[fmpq_mpoly] = []  # each with a power of one generator in front
        pi = _Quotient(next(self.unused), self.one), orders.get("pi", 1)
        self.roots: dict[Atom, tuple[_Quotient, int]] = {"pi": pi}  # each with its order
        self.integers = [(n, self._root(index, n)) for n in integers]
        for q in rationals:
            self.roots[q] = _Quotient(*map(self._integer_root, q.as_integer_ratio())), index
        circles = {angle: self._circle(angle) for angle in angles}
        for wave in waves:
            angle, n = multiples[wave.argument]
            self.roots[wave] = _Quotient(self._wave(wave, n, *circles[angle]), self.one), 1
        for form in sums:
            self.roots[form] = self._sum_root(form, orders[form]), orders[form]

    def quotient(self, x: Form) -> _Quotient:
        """The value of x."""
        from flint import fmpq

        total = _Quotient(self.one * 0, self.one)
        for monomial, c in x:
            term = _Quotient(self.one * fmpq(c.numerator, c.denominator), self.one)
            for atom, e in monomial:
                root, order = self.roots[atom]
                above, below = root if e > 0 else reversed(root)
                n = abs(int(e * order))
                term = self._product(term, _Quotient(self._power(above, n), self._power(below, n)))
            total = self._sum(total, term)
        return total

    # --- generators, and what holds among them ------------------------------------------------

    def _root(self, order: int, of: fmpq_mpoly | int) -> fmpq_mpoly:
        """The next generator, a root."""
        generator = next(self.unused)
        self.relations.append(generator**order - of)
        return generator

    def _integer_root(self, n: int) -> fmpq_mpoly:
        """The root of a product of the coprime integers."""
        product = self.one
        for base, root in self.integers:
            while n % base == 0:
                n, product = n // base, product * root
        return self._reduced(product)

    def _circle(self, angle: Form) -> tuple[fmpq_mpoly, fmpq_mpoly]:
        """The cosine and sine of an angle."""
        from flint import fmpz_poly

        cosine = next(self.unused)
        turns = _multiple(angle, PI_ALONE)
        if turns is not None and (order := (turns / 2).denominator) <= _MAX_ORDER:
            minimal = enumerate(fmpz_poly.cos_minpoly(order))
            self.relations.append(sum((c * (2 * cosine) ** k for k, c in minimal), 0 * self.one))
        return cosine, self._root(2, 1 - cosine**2)

    def _wave(self, wave: Trig, n: int, cosine: fmpq_mpoly, sine: fmpq_mpoly) -> fmpq_mpoly:
        """The wave f at nα, by f((k+1)α) + f((k−1)α) = 2 cos α f(kα)."""
        before, here = (self.one, cosine) if wave.name == "cos" else (0 * self.one, sine)
        for _ in range(abs(n) - 1):
            before, here = here, self._reduced(2 * cosine * here) - before
        return -here if n < 0 and wave.name == "sin" else here

    def _sum_root(self, form: Form, order: int) -> _Quotient:
        """(N/D)^(1/q) as y/D, where y^q = N D^(q−1)."""
        inner = self.quotient(form)
        if order == 1:
            return inner
        for other, (root, its_order) in self.roots.items():
            if isinstance(other, tuple) and its_order == order and self.quotient(other) == inner:
                return root
        radicand = self._times(inner.above, self._power(inner.below, order - 1))
        return _Quotient(self._root(order, radicand), inner.below)

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
            raise _TooLargeError
        return reduce(self._times, [a] * n, self.one)

    def _times(self, a: fmpq_mpoly, b: fmpq_mpoly) -> fmpq_mpoly:
        if a.is_one() or b.is_one():
            return b if a.is_one() else a
        self.work += _words(a) * _words(b)
        if self.work > _MAX_WORK:
            raise _TooLargeError
        return self._reduced(a * b)

    def _reduced(self, value: fmpq_mpoly) -> fmpq_mpoly:
        for relation in reversed(self.relations):  # from the greatest generator down
            value %= relation
        return value


def _words(a: fmpq_mpoly) -> int:
    """The number of words in the coefficients."""
    return sum(1 + c.height_bits() // 64 for c in a.coeffs())


def _atoms(x: Form) -> Iterator[tuple[Atom, Fraction]]:
    """The atoms in x and their exponents, the inner ones first; not those within an angle."""
    for monomial, _ in x:
        for atom, e in monomial:
            if isinstance(atom, tuple):
                yield from _atoms(atom)
            yield atom, e


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
