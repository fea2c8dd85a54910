"""Exact real numbers: what a scene says, kept without rounding until a precision is asked for.

A number is a sum of terms, each a rational coefficient times powers of π, of rationals, of cosines
and sines, and of other sums. Rationals stay rationals, like terms are merged and roots are brought
to one form, so that many zeros are *proved* (√8 − 2√2, cos(π/3) − 1/2). Every other question is
answered by interval arithmetic at rising precision.

mpmath is imported only when an irrational number has to be evaluated.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import Any, ClassVar, Final, Literal, TypeAlias, TypeVar

from heavytop import grammar
from heavytop.errors import NotANumber
from heavytop.surds import surd

LARGEST: Final = Fraction(10) ** 300
SMALLEST: Final = 1 / LARGEST
_MAX_BITS: Final = 16384  # of any rational, and
_MAX_POWER: Final = 64  # of any exponent, that an expression in a text may build
_EXTRA_BITS: Final = (32, 128, 512, 2048)  # working precision beyond what is asked for

Number: TypeAlias = "int | float | str | Fraction | Decimal | Exact"
Interval: TypeAlias = Any  # a pair of mpmath's raw binary numbers, lower and upper
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Wave:
    """cos or sin of an exact number that has no simpler form."""

    name: Literal["cos", "sin"]
    argument: Exact


Atom: TypeAlias = "Fraction | str | Wave | Exact"  # a radicand, "pi", a wave, a sum
Monomial: TypeAlias = "tuple[tuple[Atom, Fraction], ...]"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Exact:
    """An exact real number, immutable and hashable; made by `Exact.of`, `sqrt`, `cos`, `sin`, `PI`.

    Two of them are equal when their forms are: equal numbers that are merely *different to look
    at* may compare unequal, so ask for the sign of the difference where that matters.

    Examples
    --------
    >>> third = Exact.of("1/3")
    >>> print(third + third + third, float(2 / sqrt(3)), cos(PI / 3).fraction)
    1 1.1547005383792515 1/2
    """

    terms: tuple[tuple[Monomial, Fraction], ...]
    text: str | None = None

    __array_ufunc__: ClassVar[None] = None  # numpy scalars leave the arithmetic to us

    @staticmethod
    def of(x: Number, units: Collection[str] = grammar.UNITS) -> Exact:
        """The exact number `x`: floats mean their binary value, texts what they say.

        Parameters
        ----------
        x : int, float, Fraction, Decimal, str, numpy number or Exact
            Texts are expressions such as ``"pi/3"``, ``"2/sqrt(3)"`` or ``"6 deg"``.
        units : collection of str
            The units a text may end in.

        Raises
        ------
        NotANumber
            `x` is not a finite real number, or lies outside 1e-300 … 1e300 and is not 0.

        Examples
        --------
        >>> Exact.of("6 deg") == PI / 30
        True
        >>> print(Exact.of(0.1))
        0.1000000000000000055511151231257827021181583404541015625
        """
        if isinstance(x, Exact):
            return x
        if isinstance(x, str):
            value = grammar.read(x, _TEXTS, units)
            return Exact(value.terms, x.strip())
        return _rational(_in_range(_finite(x)))

    @property
    def fraction(self) -> Fraction | None:
        """The number as a Fraction, or None where it is irrational or not proved rational."""
        if not self.terms:
            return Fraction(0)
        monomial, coefficient = self.terms[0]
        return coefficient if not monomial and len(self.terms) == 1 else None

    def __add__(self, other: Number) -> Exact:
        if (b := _operand(other)) is None:
            return NotImplemented
        if (p := self.fraction) is not None and (q := b.fraction) is not None:
            return _rational(p + q)
        total = dict(self.terms)
        for monomial, coefficient in b.terms:
            total[monomial] = total.get(monomial, Fraction(0)) + coefficient
        return _sum_of(total)

    def __mul__(self, other: Number) -> Exact:
        if (b := _operand(other)) is None:
            return NotImplemented
        p, q = self.fraction, b.fraction
        if p is not None and q is not None:
            return _rational(p * q)
        if p is not None:
            return _scaled(b, p)
        if q is not None:
            return _scaled(self, q)
        (m, a), (n, c) = _factored(self), _factored(b)
        return _product(a * c, (*m, *n))

    def __pow__(self, exponent: int | Fraction) -> Exact:
        if isinstance(exponent, bool) or not isinstance(exponent, (int, Fraction)):
            return NotImplemented
        e = Fraction(exponent)
        if e in (0, 1):
            return self if e else ONE
        _check_power(self, e)
        if (q := self.fraction) is not None:
            return _product(Fraction(1), ((q, e),))
        factors, coefficient = _factored(self, whole=e.denominator == 1)
        return _product(Fraction(1), ((coefficient, e), *((atom, k * e) for atom, k in factors)))

    def __neg__(self) -> Exact:
        return _scaled(self, Fraction(-1))

    def __sub__(self, other: Number) -> Exact:
        return NotImplemented if (b := _operand(other)) is None else self + -b

    def __truediv__(self, other: Number) -> Exact:
        return NotImplemented if (b := _operand(other)) is None else self * b**-1

    def __rsub__(self, other: Number) -> Exact:
        return -self + other

    def __rtruediv__(self, other: Number) -> Exact:
        return self**-1 * other

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Exact):
            return self.terms == other.terms
        if isinstance(other, (int, float, Fraction)):
            return self.fraction == other
        return NotImplemented

    def __hash__(self) -> int:
        return hash(self.terms if self.fraction is None else self.fraction)

    def sign(self) -> Literal[-1, 0, 1] | None:
        """−1, 0 or 1, or None where 2000 bits cannot tell the number from an unproved zero.

        Examples
        --------
        >>> (sqrt(8) - 2 * sqrt(2)).sign(), (PI - Exact.of("3.1416")).sign()
        (0, -1)
        """
        simple = _sign_at_sight(self)
        return simple if simple is not None else _decide(self, _interval_sign, 0)

    def mpf(self, ctx: Any) -> Any:
        """The number in the mpmath context `ctx`, correctly rounded to its precision.

        A number that 2000 bits beyond that precision cannot tell from zero comes out as zero.
        """
        from mpmath import libmp

        if (q := self.fraction) is not None:
            return ctx.make_mpf(libmp.from_rational(q.numerator, q.denominator, ctx.prec, "n"))

        def agreed(interval: Interval) -> Any:
            low, high = (libmp.mpf_pos(end, ctx.prec, "n") for end in interval)
            return low if low == high else None

        value = _decide(self, agreed, ctx.prec)
        return ctx.make_mpf(_middle(self, ctx.prec) if value is None else value)

    def __float__(self) -> float:
        """The nearest double.

        Raises
        ------
        NotANumber
            The number is larger than any double.
        """
        if (q := self.fraction) is not None:
            return _double(q)

        def agreed(interval: Interval) -> float | None:
            low, high = (_double(_ratio(end)) for end in interval)
            return low if low == high else None

        value = _decide(self, agreed, 64)
        return _double(_ratio(_middle(self, 64))) if value is None else value

    def __str__(self) -> str:
        """The text it was read from, or one that `Exact.of` reads back to the same number."""
        return self.text if self.text is not None else _written(self)

    def __repr__(self) -> str:
        return f"Exact.of({str(self)!r})"


def sqrt(x: Number) -> Exact:
    """The square root of `x`; a negative `x` raises `NotANumber`."""
    return Exact.of(x) ** Fraction(1, 2)


def cos(x: Number) -> Exact:
    """The cosine of `x` [rad], in closed form at multiples of π/6 and π/4.

    Examples
    --------
    >>> print(cos(PI / 2), cos(-PI / 6), cos(0.5))
    0 0.5*sqrt(3) cos(0.5)
    """
    angle = Exact.of(x)
    half_turns = _over_pi(angle)
    return _single(Wave("cos", angle)) if half_turns is None else _cos_pi(half_turns)


def sin(x: Number) -> Exact:
    """The sine of `x` [rad], in closed form at multiples of π/6 and π/4.

    Examples
    --------
    >>> print(sin(PI), sin("30 deg"), sin("pi/4"))
    0 0.5 0.5*sqrt(2)
    """
    angle = Exact.of(x)
    half_turns = _over_pi(angle)
    if half_turns is None:
        return _single(Wave("sin", angle))
    return _cos_pi(Fraction(1, 2) - half_turns)


# --- making numbers -------------------------------------------------------------------------


def _finite(x: object) -> Fraction:
    """The exact rational value of a Python or numpy number."""
    if not isinstance(x, bool):
        if isinstance(x, numbers.Rational):
            return Fraction(int(x.numerator), int(x.denominator))
        if isinstance(x, Decimal) and x.is_finite():
            # checked before the power of ten is built
            return Fraction(x if abs(x.adjusted()) <= grammar.MAX_DECIMAL_EXPONENT else "1e400")
        if isinstance(x, numbers.Real) and math.isfinite(x):
            return Fraction(*x.as_integer_ratio())  # type: ignore[attr-defined]
    if isinstance(x, (numbers.Real, Decimal)) and not isinstance(x, bool):
        raise NotANumber(f"a number is finite, not {x}")
    raise NotANumber(f"a number is not {_kind(x)}")


def _kind(x: object) -> str:
    return {"bool": "true or false", "NoneType": "nothing"}.get(
        type(x).__name__, f"a {type(x).__name__}"
    )


def _in_range(q: Fraction) -> Fraction:
    if q and not SMALLEST <= abs(q) <= LARGEST:
        raise NotANumber("the magnitude of a number is 0 or within 1e-300 … 1e300")
    return q


def _operand(x: object) -> Exact | None:
    """An operand of the arithmetic; texts are refused here, they must be read on purpose."""
    if isinstance(x, Exact):
        return x
    return Exact.of(x) if isinstance(x, (numbers.Real, Decimal)) else None  # type: ignore[arg-type]


def _rational(q: Fraction) -> Exact:
    return Exact((((), q),) if q else ())


def _single(atom: Atom) -> Exact:
    return Exact(((((atom, Fraction(1)),), Fraction(1)),))


ONE: Final = _rational(Fraction(1))
PI: Final = _single("pi")


def _sum_of(terms: dict[Monomial, Fraction]) -> Exact:
    kept = [(monomial, c) for monomial, c in terms.items() if c]
    return Exact(tuple(sorted(kept, key=lambda term: _term_text(term[0], Fraction(1)))))


def _scaled(x: Exact, q: Fraction) -> Exact:
    return Exact(tuple((monomial, c * q) for monomial, c in x.terms) if q else ())


def _factored(x: Exact, whole: bool = True) -> tuple[Monomial, Fraction]:
    """Write x ≠ 0 as a coefficient times a monomial, fit for a whole or a fractional power.

    For a fractional power the coefficient is positive and every factor is known not to be
    negative: √(x²) is |x|, so a square may not be taken apart there.
    """
    if len(x.terms) == 1:
        monomial, c = x.terms[0]
        if whole or (c > 0 and all(_never_negative(atom, e) for atom, e in monomial)):
            return monomial, c
    content = Fraction(
        math.gcd(*(c.numerator for _, c in x.terms)), math.lcm(*(c.denominator for _, c in x.terms))
    )
    if whole and x.terms[0][1] < 0:
        content = -content
    return ((_scaled(x, 1 / content), Fraction(1)),), content


def _never_negative(atom: Atom, e: Fraction) -> bool:
    return isinstance(atom, Fraction) or atom == "pi" or e.denominator > 1


def _product(coefficient: Fraction, factors: Iterable[tuple[Atom, Fraction]]) -> Exact:
    """The product of a coefficient and powers of atoms, brought to normal form."""
    coefficient, roots, powers = _gathered(coefficient, factors)
    for atom, e in powers.items():
        if isinstance(atom, Exact) and e.denominator == 1:
            if len(atom.terms) == 1:  # a wrapped single term: take it apart again
                inner, c = atom.terms[0]
                rest = [(other, k) for other, k in powers.items() if other != atom]
                opened = [(part, k * e) for part, k in inner]
                bases = [(base, k) for k, base in roots.items()]
                return _product(coefficient * c**e.numerator, [*rest, *opened, *bases])
            if e == 1 and len(powers) == 1 and not roots:
                return _scaled(atom, coefficient)
    monomial = [*((base, e) for e, base in roots.items()), *powers.items()]
    monomial.sort(key=lambda factor: _factor_text(*factor))
    return Exact(((tuple(monomial), coefficient),) if coefficient else ())


def _gathered(
    coefficient: Fraction, factors: Iterable[tuple[Atom, Fraction]]
) -> tuple[Fraction, dict[Fraction, Fraction], dict[Atom, Fraction]]:
    """Merge equal atoms and roots of equal index: a coefficient, {exponent: radicand}, powers."""
    roots: dict[Fraction, Fraction] = {}
    powers: dict[Atom, Fraction] = {}
    pending = list(factors)
    while pending:
        atom, e = pending.pop()
        if isinstance(atom, Fraction):
            outer, radicand, e = surd(atom, e)
            coefficient *= outer
            if e in roots:
                pending.append((radicand * roots.pop(e), e))
            elif e:
                roots[e] = radicand
        else:
            powers[atom] = powers.get(atom, Fraction(0)) + e
    return coefficient, roots, {atom: e for atom, e in powers.items() if e}


def _check_power(x: Exact, e: Fraction) -> None:
    sign = x.sign() if e < 0 or e.denominator > 1 else 1
    if e < 0 and not sign:
        what = "zero" if sign == 0 else "a number that cannot be told from zero"
        raise NotANumber(f"division by {what}")
    if e.denominator > 1 and sign == -1:
        raise NotANumber("a root of a negative number is not real")


def _over_pi(x: Exact) -> Fraction | None:
    """x/π where that is seen to be rational."""
    if not x.terms:
        return Fraction(0)
    monomial, c = x.terms[0]
    return c if len(x.terms) == 1 and monomial == (("pi", Fraction(1)),) else None


def _cos_pi(q: Fraction) -> Exact:
    """Return cos πq, the angle brought to the first quadrant."""
    q = abs((q + 1) % 2 - 1)
    if q > Fraction(1, 2):
        return -_cos_pi(1 - q)
    known = {Fraction(0): (1, 4), Fraction(1, 6): (1, 3), Fraction(1, 4): (1, 2)}
    known |= {Fraction(1, 3): (1, 1), Fraction(1, 2): (0, 1)}
    if q not in known:
        return _single(Wave("cos", _scaled(PI, q)))
    c, n = known[q]
    return sqrt(n) * Fraction(c, 2)


# --- the arithmetic of texts: the same, with every size bounded ------------------------------


class _Texts:
    """The arithmetic the grammar folds a text with; nothing is built that could blow up."""

    def number(self, value: Fraction) -> Exact:
        return _rational(_in_range(value))

    def pi(self) -> Exact:
        return PI

    def add(self, a: Exact, b: Exact) -> Exact:
        return _bounded(a + b)

    def multiply(self, a: Exact, b: Exact) -> Exact:
        return _bounded(a * b)

    def power(self, base: Exact, exponent: Exact) -> Exact:
        e = exponent.fraction
        if e is None or max(abs(e.numerator), e.denominator) > _MAX_POWER:
            raise NotANumber(f"an exponent is a rational p/q with |p|, q up to {_MAX_POWER}")
        if _bits(base) * abs(e.numerator) > _MAX_BITS:
            raise NotANumber("a power is too large to be held exactly")
        return _bounded(base**e)


_TEXTS: Final = _Texts()


def _bits(x: Exact) -> int:
    rationals = [c for _, c in x.terms]
    rationals += [atom for m, _ in x.terms for atom, _ in m if isinstance(atom, Fraction)]
    return max((max(abs(q.numerator), q.denominator).bit_length() for q in rationals), default=0)


def _bounded(x: Exact) -> Exact:
    exponents = [e for monomial, _ in x.terms for _, e in monomial]
    if _bits(x) > _MAX_BITS or any(max(abs(e.numerator), e.denominator) > 4096 for e in exponents):
        raise NotANumber("a number is too large to be held exactly")
    if x.fraction is not None:
        _in_range(x.fraction)
        return x
    interval = _decide(x, lambda interval: interval, 64) if _nests(x) else None
    # logarithms to base 2 of the terms, or of the interval where sums are nested
    sizes = [_log2(*term) for term in x.terms]
    if interval is not None:
        sizes = [float(end[2] + end[3]) for end in interval if end[1]]
    if sizes and not -997 <= max(sizes) <= 997:
        raise NotANumber("the magnitude of a number is 0 or within 1e-300 … 1e300")
    return x


def _nests(x: Exact) -> bool:
    return any(isinstance(atom, (Exact, Wave)) for monomial, _ in x.terms for atom, _ in monomial)


def _log2(monomial: Monomial, c: Fraction) -> float:
    sizes = ((math.pi if atom == "pi" else atom, e) for atom, e in monomial)
    total = math.log2(abs(c.numerator)) - math.log2(c.denominator)
    return total + sum(
        float(e) * math.log2(q) for q, e in sizes if isinstance(q, (Fraction, float))
    )


# --- text ------------------------------------------------------------------------------------


def _written(x: Exact) -> str:
    text = ""
    for monomial, c in x.terms:
        term = _term_text(monomial, abs(c) if text else c)
        text += term if not text else f" {'-' if c < 0 else '+'} {term}"
    return text or "0"


def _term_text(monomial: Monomial, c: Fraction) -> str:
    above = [_factor_text(atom, e) for atom, e in monomial if e > 0]
    below = "".join("/" + _factor_text(atom, -e) for atom, e in monomial if e < 0)
    if abs(c) != 1 or not above:
        above.insert(0, _rational_text(c))
        return "*".join(above) + below
    return ("-" if c < 0 else "") + "*".join(above) + below


def _factor_text(atom: Atom, e: Fraction) -> str:
    if isinstance(atom, Wave):
        body = f"{atom.name}({atom.argument})"
    elif isinstance(atom, str):
        body = atom
    else:
        body = f"({_rational_text(atom) if isinstance(atom, Fraction) else _written(atom)})"
        if e == Fraction(1, 2):
            return "sqrt" + body
    return body if e == 1 else f"{body}^{e}" if e.denominator == 1 else f"{body}^({e})"


def _rational_text(q: Fraction) -> str:
    """A decimal where the expansion ends, else p/q; through Decimal, which knows no longest int."""
    twos = (q.denominator & -q.denominator).bit_length() - 1
    fives, odd = 0, q.denominator >> twos
    while odd % 5 == 0:
        fives, odd = fives + 1, odd // 5
    if odd != 1:
        return f"{Decimal(q.numerator)}/{Decimal(q.denominator)}"
    places = max(twos, fives)
    scaled = Decimal(q.numerator * 10**places // q.denominator).as_tuple()
    return str(Decimal((scaled.sign, scaled.digits, -places)))


# --- values ----------------------------------------------------------------------------------


class _UnresolvedError(NotANumber):
    """An interval to divide by holds zero: more precision is needed."""


def _sign_at_sight(x: Exact) -> Literal[-1, 0, 1] | None:
    """The sign where no evaluation is needed."""
    if not x.terms:
        return 0
    positive = all(
        isinstance(atom, Fraction) or atom == "pi"
        for monomial, _ in x.terms
        for atom, _ in monomial
    )
    signs = {c > 0 for _, c in x.terms}
    if positive and len(signs) == 1:
        return 1 if signs == {True} else -1
    whole = x + _rational(-dict(x.terms).get((), Fraction(0)))
    slope = _over_pi(whole)
    if slope is None:
        return None
    # q + slope·π against the two doubles next to π
    below, above = Fraction(math.pi), Fraction(math.nextafter(math.pi, 4))
    root = -dict(x.terms).get((), Fraction(0)) / slope
    if below < root < above:
        return None
    return 1 if (root <= below) == (slope > 0) else -1


def _interval_sign(interval: Interval) -> Literal[-1, 1] | None:
    from mpmath import libmp

    low, high = (libmp.mpf_sign(end) for end in interval)
    return 1 if low > 0 else -1 if high < 0 else None


def _decide(x: Exact, judge: Callable[[Interval], T | None], precision: int) -> T | None:
    """The first verdict on an enclosure of x, at rising precision; None where there is none."""
    for extra in _EXTRA_BITS:
        try:
            verdict = judge(_enclosure(x, precision + extra))
        except _UnresolvedError:
            continue
        if verdict is not None:
            return verdict
    return None


def _middle(x: Exact, precision: int) -> Any:
    """The value where rounding is undecided to the last: a tie, or zero that is not proved."""
    from mpmath import libmp

    low, high = _enclosure(x, precision + _EXTRA_BITS[-1])
    if libmp.mpf_sign(low) * libmp.mpf_sign(high) <= 0:
        return libmp.fzero
    return libmp.mpf_pos(libmp.mpf_shift(libmp.mpf_add(low, high), -1), precision, "n")


def _ratio(end: Any) -> Fraction:
    from mpmath import libmp

    return Fraction(*libmp.to_rational(end))


def _double(q: Fraction) -> float:
    try:
        return float(q)
    except OverflowError:
        raise NotANumber("a number is larger than any double") from None


def _enclosure(x: Exact, precision: int) -> Interval:
    """An interval that holds x, with outward rounding throughout."""
    from mpmath import libmp

    total = (libmp.fzero, libmp.fzero)
    for monomial, c in x.terms:
        term = _rational_interval(c, precision)
        for atom, e in monomial:
            factor = _power_interval(_atom_interval(atom, precision), e, precision)
            term = libmp.mpi_mul(term, factor, precision)
        total = libmp.mpi_add(total, term, precision)
    return total


def _rational_interval(q: Fraction, precision: int) -> Interval:
    from mpmath import libmp

    return tuple(libmp.from_rational(q.numerator, q.denominator, precision, way) for way in "fc")


def _atom_interval(atom: Atom, precision: int) -> Interval:
    from mpmath import libmp

    if isinstance(atom, Fraction):
        return _rational_interval(atom, precision)
    if isinstance(atom, str):
        return libmp.mpf_pi(precision, "f"), libmp.mpf_pi(precision, "c")
    if isinstance(atom, Exact):
        return _enclosure(atom, precision)
    wave = libmp.mpi_cos if atom.name == "cos" else libmp.mpi_sin
    return wave(_enclosure(atom.argument, precision), precision)


def _power_interval(base: Interval, e: Fraction, precision: int) -> Interval:
    from mpmath import libmp

    if e.denominator > 1:
        base = _root_interval(base, e.denominator, precision)
    power = libmp.mpi_pow_int(base, abs(e.numerator), precision)
    if e > 0:
        return power
    if _interval_sign(power) is None:
        raise _UnresolvedError("division by a number that cannot be told from zero")
    return libmp.mpi_div((libmp.fone, libmp.fone), power, precision)


def _root_interval(base: Interval, index: int, precision: int) -> Interval:
    """The root of an interval known not to be negative; what lies below zero is only width."""
    from mpmath import libmp

    low, high = (end if libmp.mpf_sign(end) > 0 else libmp.fzero for end in base)
    slack = libmp.mpf_shift(libmp.fone, -precision)  # mpmath's roots may be off in the last bit
    near = [libmp.mpf_nthroot(end, index, precision + 8, "n") for end in (low, high)]
    return (
        libmp.mpf_mul(near[0], libmp.mpf_sub(libmp.fone, slack), precision, "f"),
        libmp.mpf_mul(near[1], libmp.mpf_add(libmp.fone, slack), precision, "c"),
    )
