"""Exact, the exact real number: a rational, or a tree of operations on other exact numbers.

Rationals are combined, and a product has one rational factor, in front; little else is simplified.
The sign is decided in `heavytop.exact.zero`, the value in `heavytop.exact.balls`.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, TypeAlias, TypeVar

from heavytop.errors import NotANumber
from heavytop.text import with_article

if TYPE_CHECKING:  # flint is slow to import, and irrational numbers alone need it
    from flint import arb

T = TypeVar("T")
Sign: TypeAlias = Literal[-1, 0, 1]
Number: TypeAlias = "int | float | str | Fraction | Decimal | Exact"

MAX_DECIMAL_EXPONENT: Final = 400
_LARGEST: Final = 10**300
_EXTRA_BITS: Final = (32, 128, 512, 2048)  # of working precision beyond that of the result
_SMALL_PRIMES: Final = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Exact:
    """An exact real number, immutable and hashable; made by `Exact.of`, `PI` and functions.

    ``==`` compares trees: equal numbers with different trees compare unequal. Where that matters,
    take the sign of the difference.

    Parameters
    ----------
    op : str
        "rational", "pi", "+", "*", "^", or the name of a function: "cos", "sin", "acos", "atan".
    args : tuple
        A Fraction; nothing; two numbers; a base and its exponent, a Fraction; or the argument.
    text : str, optional
        The text it was read from.

    Examples
    --------
    >>> from heavytop.exact import cos, sqrt
    >>> third = Exact.of("1/3")
    >>> print(third + third + third, float(2 / sqrt(3)), cos(PI / 3).fraction)
    1 1.1547005383792515 1/2
    """

    op: str
    args: tuple[Any, ...]
    text: str | None = None
    _hash: int | None = field(default=None, init=False)

    __array_ufunc__: ClassVar[None] = None  # so that numpy scalars leave arithmetic to this class

    @staticmethod
    def of(x: Number, units: Collection[str] | None = None) -> Exact:
        """The exact number of `x`: floats mean their binary value, texts are expressions.

        Parameters
        ----------
        x : int, float, Fraction, Decimal, str, numpy number, mpmath number or Exact
            Texts are expressions such as ``"pi/3"``, ``"acos(3/4)"`` or ``"6 deg"``.
        units : collection of str
            The units a text may end in; by default those of angles and rates.

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
        if (isinstance(x, float) or type(x) is int) and (x == 0 or 1e-300 < abs(x) < 1e300):
            return rational(Fraction(x))  # most numbers, without the checks below
        if isinstance(x, str):
            from heavytop.exact import parse  # imports this module

            value = parse.read(x, parse.UNITS if units is None else units)
            return Exact(value.op, value.args, " ".join(x.split()))
        if isinstance(x, Decimal) and x.is_finite() and abs(x.adjusted()) > MAX_DECIMAL_EXPONENT:
            raise out_of_range()  # before the power of ten is built
        return in_range(rational_value(x))

    @property
    def fraction(self) -> Fraction | None:
        """The number as a Fraction, or None where it is irrational or not folded to a rational."""
        return self.args[0] if self.op == "rational" else None

    def __add__(self, other: Number) -> Exact:
        b, total = _operand(other), dict[Exact, Fraction]()
        if self.op == b.op == "rational":
            return rational(self.args[0] + b.args[0])
        for term in (*_parts("+", self), *_parts("+", b)):
            q, rest = split(term)
            total[rest] = total[rest] + q if rest in total else q
        terms = tuple(_multiply(rest, q) for rest, q in total.items() if q)
        return Exact("+", terms) if len(terms) > 1 else terms[0] if terms else ZERO

    def __mul__(self, other: Number) -> Exact:
        b, q, factors = _operand(other), _ONE, dict[Exact, Exact]()
        if self.op == b.op == "rational":
            return rational(self.args[0] * b.args[0])
        for factor in (*_parts("*", self), *_parts("*", b)):
            if factor.op == "rational":
                q *= factor.args[0]
                continue
            base, exponent = _base_of(factor)
            known = factors.get(base)
            factors[base] = factor if known is None else base ** (exponent + _base_of(known)[1])
        found = [part for factor in factors.values() for part in _parts("*", factor)]
        q *= math.prod(part.args[0] for part in found if part.op == "rational")
        rest = tuple(part for part in found if part.op != "rational")
        if len({*rest}) < len(rest):  # a simplified power equals another factor: multiply again
            return math.prod(rest, start=rational(q))
        return _multiply(Exact("*", rest) if len(rest) > 1 else rest[0] if rest else ONE, q)

    def __pow__(self, exponent: int | Fraction) -> Exact:
        if isinstance(exponent, bool) or not isinstance(exponent, (int, Fraction)):
            return NotImplemented
        return _power(self, Fraction(exponent))

    def __neg__(self) -> Exact:
        return self * -1

    def __sub__(self, other: Number) -> Exact:
        return self + -_operand(other)

    def __truediv__(self, other: Number) -> Exact:
        return self * _operand(other) ** -1

    def __rsub__(self, other: Number) -> Exact:
        return -self + other

    def __rtruediv__(self, other: Number) -> Exact:
        return self**-1 * other

    __radd__ = __add__
    __rmul__ = __mul__

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if isinstance(other, Exact):
            alike = self.op == other.op and hash(self) == hash(other)
            return alike and {*self.args} == {*other.args}
        if isinstance(other, (int, float, Fraction)):
            return self.fraction == other
        return NotImplemented

    def __hash__(self) -> int:
        if self._hash is None:
            q = self.fraction
            found = hash((self.op, frozenset(self.args)) if q is None else q)
            object.__setattr__(self, "_hash", found)
        return self._hash  # type: ignore[return-value]

    def __reduce__(self) -> tuple[Any, ...]:
        return Exact, (self.op, self.args, self.text)  # hashes of texts differ between processes

    def sign(self) -> Sign | None:
        """The sign, −1, 0 or 1, or None where it is undecided.

        The sign of an algebraic number is decided by a separation bound, that of others by 4096
        bits or by an identity, within limits on the size of the expression.

        Examples
        --------
        >>> from heavytop.exact import sqrt
        >>> (sqrt(3 + 2 * sqrt(2)) - 1 - sqrt(2)).sign(), (PI - Exact.of("3.1416")).sign()
        (0, -1)
        """
        if (q := self.fraction) is not None:
            return 1 if q.numerator > 0 else -1 if q.numerator < 0 else 0
        from heavytop.exact.zero import sign_of

        return sign_of(self)

    def ball(self, bits: int) -> arb:
        """A ball that contains the number, evaluated once at `bits` of working precision.

        The ball of a rational has the width of an ulp of that precision. Other balls may be wider:
        the width grows with every operation and where terms cancel, and where the ball of a divisor
        contains 0 the result is not finite (``is_finite()`` is false), and takes more bits. Compute
        with balls inside `heavytop.exact.balls.working`.

        Parameters
        ----------
        bits : int
            At least 2.

        Returns
        -------
        flint.arb

        Raises
        ------
        ValueError
            `bits` is less than 2.

        Examples
        --------
        >>> from heavytop.exact import sqrt
        >>> root = sqrt(2).ball(100)
        >>> print(root.contains(float(sqrt(2))), root.rel_accuracy_bits() >= 97)
        False True
        """
        from heavytop.exact.balls import ball_of, working

        with working(bits):
            return ball_of(self)

    def mpf(self, ctx: Any) -> Any:
        """The number in the mpmath context `ctx`, correctly rounded to its precision.

        A number that 2048 bits beyond that precision do not separate from 0 becomes 0.

        Parameters
        ----------
        ctx : mpmath context
            A context such as ``mpmath.mp``; its precision is that of the result.
        """
        if (q := self.fraction) is not None:
            return ctx.fdiv(q.numerator, q.denominator)
        return self._nearest(ctx.prec, lambda end: +ctx.convert(end))

    def __float__(self) -> float:
        """The nearest double.

        Raises
        ------
        NotANumber
            The number is larger than any double.
        """
        try:
            q = self.fraction
            value = self._nearest(64, float) if q is None else q.numerator / q.denominator
        except OverflowError:
            value = math.inf
        if math.isinf(value):
            raise NotANumber("a number is larger than any double")
        return value

    def _nearest(self, precision: int, rounded: Callable[[arb], T]) -> T:
        """The number rounded: both ends of a ball have to be rounded to the same value."""
        from flint import arb

        from heavytop.exact.balls import ball_of, working

        for extra in _EXTRA_BITS:
            with working(precision + extra):
                ball = ball_of(self)
                if ball.is_finite() and rounded(ball.lower()) == rounded(ball.upper()):
                    return rounded(ball.upper())  # not −0 where the ball contains 0
        separated = ball.is_finite() and not ball.contains(0)
        return rounded(ball.mid() if separated else arb(0))  # a tie, or an unproved 0

    def __str__(self) -> str:
        """The text it was read from, or one that `Exact.of` reads back to the same number."""
        if self.text is not None:
            return self.text
        from heavytop.exact import parse  # imports this module

        return parse.text_of(self)

    def __repr__(self) -> str:
        return f"Exact.of({str(self)!r})"


# --- the tree ----------------------------------------------------------------------------------


def rational(q: Fraction) -> Exact:
    """The rational number q, of any size."""
    return Exact("rational", (q,))


_ONE: Final = Fraction(1)
ZERO: Final = rational(Fraction(0))
ONE: Final = rational(_ONE)
PI: Final = Exact("pi", ())


def _parts(op: str, x: Exact) -> tuple[Exact, ...]:
    """The terms of a sum or the factors of a product; any other number is its only part."""
    return x.args if x.op == op else (x,)


def _base_of(factor: Exact) -> tuple[Exact, Fraction]:
    """The base and the exponent of a factor."""
    return factor.args if factor.op == "^" else (factor, _ONE)


def split(x: Exact) -> tuple[Fraction, Exact]:
    """Return q and y with x = q y, where y has no rational factor; y = 1 of a rational x."""
    if x.op == "rational":
        return x.args[0], ONE
    if x.op == "*" and x.args[0].op == "rational":
        return x.args[0].args[0], x.args[1] if len(x.args) == 2 else Exact("*", x.args[1:])
    return _ONE, x


def _multiply(x: Exact, q: Fraction) -> Exact:
    """Return q x, of an x that has no rational factor; a sum term by term."""
    if x == ONE or q == 0 or q == 1:
        return x if q == 1 else rational(q)
    if x.op == "+":
        return Exact("+", tuple(term * rational(q) for term in x.args))
    return Exact("*", (rational(q), *_parts("*", x)))


def _power(x: Exact, exponent: Fraction) -> Exact:
    """Return x to the exponent, with rational factors and powers of π outside of a root."""
    integer = exponent.denominator == 1
    if exponent < 0 or not integer:
        sign = x.sign()
        if sign == -1 and not integer:
            raise NotANumber("a root of a negative number is not real")
        if not sign and exponent < 0:
            what = "zero" if sign == 0 else "a number that cannot be told from zero"
            raise NotANumber(f"division by {what}")
        if sign == 0:
            return ZERO
    if exponent in (0, 1):
        return x if exponent else ONE
    if x.op == "rational":
        power, exponent = divmod(exponent, 1)
        factor = rational(x.args[0] ** power)
        return factor * _root(x.args[0], exponent) if exponent else factor
    if x.op == "^" and (integer or x.args[0] == PI or x.args[1].denominator > 1):
        return _power(x.args[0], x.args[1] * exponent)
    for factor in x.args if x.op == "*" else ():
        if integer or _positive(factor):
            return _power(factor, exponent) * _power(x / factor, exponent)
    return Exact("^", (x, exponent))


def _positive(factor: Exact) -> bool:
    """Whether a factor is a power of π, or a positive rational."""
    return factor.args[0] > 0 if factor.op == "rational" else _base_of(factor)[0] == PI


def _root(q: Fraction, exponent: Fraction) -> Exact:
    """Return q > 0 to an exponent between 0 and 1, as a root of an integer without small powers."""
    from flint import fmpz

    k = exponent.denominator
    radicand, outer = q.numerator * q.denominator ** (k - 1), Fraction(1, q.denominator)
    if (root := int(fmpz(radicand).root(k))) ** k == radicand:
        radicand, outer = 1, outer * root
    for prime in _SMALL_PRIMES:
        while radicand % prime**k == 0:
            radicand, outer = radicand // prime**k, outer * prime
    factor, rest = rational(outer**exponent.numerator), rational(Fraction(radicand))
    return factor if radicand == 1 else factor * Exact("^", (rest, exponent))


# --- from other numbers, and to text -----------------------------------------------------------


def _operand(x: Any) -> Exact:
    """An operand of the arithmetic as an exact number; texts are refused: `Exact.of` reads them."""
    if isinstance(x, Exact):
        return x
    if not isinstance(x, (numbers.Real, Decimal)):
        raise TypeError(f"exact numbers go with numbers, not with {with_article(type(x).__name__)}")
    return Exact.of(x)  # type: ignore[arg-type]


def rational_value(x: Any) -> Fraction:
    """The value of a rational number of any type, of any size; `NotANumber` of anything else."""
    if isinstance(x, Exact):
        x = x.fraction
    if type(x) is Fraction:
        return x
    if isinstance(x, bool) or not isinstance(x, (numbers.Real, Decimal)):
        kind = type(x).__name__
        what = {"bool": "true or false", "NoneType": "nothing", "dict": "a table"}
        raise NotANumber(f"a number is not {what.get(kind, with_article(kind))}")
    value: Any = x
    try:
        if isinstance(x, numbers.Rational):
            return Fraction(int(x.numerator), int(x.denominator))
        if hasattr(value, "_mpf_") and value.context.isfinite(value):
            sign, man, exponent, _ = value._mpf_
            value = Fraction(int(-man if sign else man)) * Fraction(2) ** int(exponent)
        return Fraction(*value.as_integer_ratio())
    except (ArithmeticError, AttributeError, TypeError, ValueError):  # infinite, or foreign
        raise NotANumber(f"a number is finite, not {x}") from None


def in_range(q: Fraction) -> Exact:
    """The number q; `NotANumber` where it is neither 0 nor within 1e-300 … 1e300."""
    if q and not q.denominator <= abs(q.numerator) * _LARGEST <= q.denominator * _LARGEST**2:
        raise out_of_range()
    return rational(q)


def out_of_range() -> NotANumber:
    """The error of a number that is too large or too small."""
    return NotANumber("the magnitude of a number is 0 or within 1e-300 … 1e300")
