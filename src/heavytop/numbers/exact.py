"""Exact, the exact real number: its making, its arithmetic, its sign and its values."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import log2, pi
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, TypeAlias, TypeVar

from heavytop.errors import NotANumber
from heavytop.numbers import normal_form
from heavytop.numbers.normal_form import HALF, Atom, Form, fraction, rational, scaled

if TYPE_CHECKING:
    from flint import arb

T = TypeVar("T")
Sign: TypeAlias = Literal[-1, 0, 1]

MAX_DECIMAL_EXPONENT: Final = 400
_LARGEST: Final = Fraction(10) ** 300
_NEAR: Final = 995  # less than log2 of that
_BEYOND_ROUNDING: Final = 1e-6  # of the largest term: what a sum of doubles surely tells from 0
_FEW_BITS: Final = (64, 256)  # which nearly always tell a sign
_MANY_BITS: Final = (1024, 4096)  # for what is not proved to be zero
_EXTRA_BITS: Final = (32, 128, 512, 2048)  # working precision beyond what is asked for

Number: TypeAlias = "int | float | str | Fraction | Decimal | Exact"


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

    terms: Form
    text: str | None = None

    __array_ufunc__: ClassVar[None] = None  # numpy scalars leave the arithmetic to us

    @staticmethod
    def of(x: Number, units: Collection[str] | None = None) -> Exact:
        """The exact number `x`: floats mean their binary value, texts what they say.

        Parameters
        ----------
        x : int, float, Fraction, Decimal, str, numpy number, mpmath number or Exact
            Texts are expressions such as ``"pi/3"``, ``"2/sqrt(3)"`` or ``"6 deg"``.
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
        if isinstance(x, str):
            from heavytop.numbers import parse  # which makes its numbers with what stands here

            value = parse.read(x, parse.UNITS if units is None else units)
            return Exact(value.terms, " ".join(x.split()))
        if isinstance(x, Decimal) and x.is_finite() and abs(x.adjusted()) > MAX_DECIMAL_EXPONENT:
            raise out_of_range()  # before the power of ten is built
        return in_range(rational_value(x))

    @property
    def fraction(self) -> Fraction | None:
        """The number as a Fraction, or None where it is irrational or not proved rational."""
        return fraction(self.terms)

    def __add__(self, other: Number) -> Exact:
        b = _operand(other)
        return NotImplemented if b is None else Exact(normal_form.add(self.terms, b.terms))

    def __mul__(self, other: Number) -> Exact:
        b = _operand(other)
        return NotImplemented if b is None else Exact(normal_form.multiply(self.terms, b.terms))

    def __pow__(self, exponent: int | Fraction) -> Exact:
        if isinstance(exponent, bool) or not isinstance(exponent, (int, Fraction)):
            return NotImplemented
        e = Fraction(exponent)
        known = self.sign() if e < 0 or e.denominator > 1 else 1
        if e < 0 and not known:
            what = "zero" if known == 0 else "a number that cannot be told from zero"
            raise NotANumber(f"division by {what}")
        if e.denominator > 1 and known == -1:
            raise NotANumber("a root of a negative number is not real")
        return Exact(normal_form.power(self.terms, e))

    def __neg__(self) -> Exact:
        return Exact(scaled(self.terms, -1))

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

    def sign(self) -> Sign | None:
        """−1, 0 or 1, or None where 4096 bits cannot tell the number from an unproved zero.

        A zero is proved where expanding products, r^q = n for roots and sin² + cos² = 1 bring
        it to nothing without too much work (a second or so).

        Examples
        --------
        >>> ((1 + sqrt(2)) * (sqrt(2) - 1) - 1).sign(), (PI - Exact.of("3.1416")).sign()
        (0, -1)
        """
        if (known := _quick_sign(self.terms)) is not None:
            return known
        if known := _decided(self.terms, _ball_sign, _FEW_BITS):
            return known
        if normal_form.proved_zero(self.terms):
            return 0
        return _decided(self.terms, _ball_sign, _MANY_BITS)

    def ball(self, bits: int) -> arb:
        """A ball that holds the number, evaluated once at `bits` of working precision.

        A rational comes out within an ulp of that precision. Otherwise no width is promised: it
        grows with every operation and where terms cancel, and where a divisor's own ball holds
        zero the result is indeterminate (``is_finite()`` is false): ask at more bits. Go on to
        compute inside `heavytop.numbers.intervals.working`.

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
        >>> root = sqrt(2).ball(100)
        >>> print(root.contains(float(sqrt(2))), root.rel_accuracy_bits() >= 97)
        False True
        """
        from heavytop.numbers.intervals import ball_of, working

        with working(bits):
            return ball_of(self.terms)

    def mpf(self, ctx: Any) -> Any:
        """The number in the mpmath context `ctx`, correctly rounded to its precision.

        A number that 2000 bits beyond that precision cannot tell from zero comes out as zero.

        Parameters
        ----------
        ctx : mpmath context
            Such as ``mpmath.mp``; its precision is that of the result.
        """
        if (q := self.fraction) is not None:
            return ctx.fdiv(q.numerator, q.denominator)
        return _nearest(self.terms, ctx.prec, lambda man, exponent: ctx.mpf((man, exponent)))

    def __float__(self) -> float:
        """The nearest double.

        Raises
        ------
        NotANumber
            The number is larger than any double.
        """
        try:
            q = self.fraction
            return float(q) if q is not None else _nearest(self.terms, 64, _double)
        except OverflowError:
            raise NotANumber("a number is larger than any double") from None

    def __str__(self) -> str:
        """The text it was read from, or one that `Exact.of` reads back to the same number."""
        return self.text if self.text is not None else normal_form.written(self.terms)

    def __repr__(self) -> str:
        return f"Exact.of({str(self)!r})"


def sqrt(x: Number) -> Exact:
    """The square root of `x`; a negative `x` raises `NotANumber`."""
    return Exact.of(x) ** HALF


def cos(x: Number) -> Exact:
    """The cosine of `x` [rad], in closed form at multiples of π/6 and π/4.

    Examples
    --------
    >>> print(cos(PI / 2), cos(-PI / 6), cos(0.5))
    0 0.5*sqrt(3) cos(0.5)
    """
    return Exact(normal_form.cos(Exact.of(x).terms))


def sin(x: Number) -> Exact:
    """The sine of `x` [rad], in closed form at multiples of π/6 and π/4.

    Examples
    --------
    >>> print(sin(PI), sin("30 deg"), sin("pi/4"))
    0 0.5 0.5*sqrt(2)
    """
    return Exact(normal_form.sin(Exact.of(x).terms))


ONE: Final = Exact(normal_form.ONE)
PI: Final = Exact(normal_form.PI)


def _operand(x: object) -> Exact | None:
    """An operand of the arithmetic; texts are refused here, they must be read on purpose."""
    return Exact.of(x) if isinstance(x, (Exact, int, float, numbers.Real, Decimal)) else None  # type: ignore[arg-type]


def rational_value(x: Any) -> Fraction:
    """The exact value of a number of Python, numpy or mpmath, finite and of any size."""
    if isinstance(x, bool) or not (type(x) is float or isinstance(x, (numbers.Real, Decimal))):
        kind = type(x).__name__
        article = "an" if kind[:1] in "aeiou" else "a"
        what = {"bool": "true or false", "NoneType": "nothing"}.get(kind, f"{article} {kind}")
        raise NotANumber(f"a number is not {what}")
    value: Any = x
    try:
        if isinstance(x, numbers.Rational):
            return Fraction(int(x.numerator), int(x.denominator))
        if hasattr(value, "_mpf_") and value.context.isfinite(value):
            sign, man, exponent, _ = value._mpf_
            value = Fraction(int(-man if sign else man)) * Fraction(2) ** int(exponent)
        return Fraction(*value.as_integer_ratio())
    except (AttributeError, OverflowError, ValueError):  # infinite, or of another library
        raise NotANumber(f"a number is finite, not {x}") from None


def in_range(q: Fraction) -> Exact:
    """The number q, which has to be 0 or within 1e-300 … 1e300."""
    near = abs(q.numerator.bit_length() - q.denominator.bit_length()) < _NEAR
    if q and not near and not 1 / _LARGEST <= abs(q) <= _LARGEST:
        raise out_of_range()
    return Exact(rational(q))


def out_of_range() -> NotANumber:
    """The error of a number that is too large or too small."""
    return NotANumber("the magnitude of a number is 0 or within 1e-300 … 1e300")


# --- signs and values ------------------------------------------------------------------------


def _logarithms(x: Form) -> list[float] | None:
    """log₂ of the size of every term, where these are roots and powers of π; else None."""
    logs = []
    for monomial, c in x:
        if not all(isinstance(atom, (Fraction, str)) for atom, _ in monomial):
            return None
        logs.append(_log2(abs(c)) + sum(float(e) * _log2(atom) for atom, e in monomial))
    return logs


def _log2(atom: Atom) -> float:
    if isinstance(atom, Fraction):
        return log2(atom.numerator) - log2(atom.denominator)
    return log2(pi)


def _quick_sign(x: Form) -> Sign | None:
    """The sign of a rational, or of a sum of roots and powers of π that doubles tell from 0."""
    total: Fraction | float | None = fraction(x)
    if total is None:
        if (logs := _logarithms(x)) is None:
            return None
        sizes = [2.0 ** (log - max(logs)) for log in logs]
        total = sum(size if c > 0 else -size for size, (_, c) in zip(sizes, x, strict=True))
        if abs(total) < _BEYOND_ROUNDING:
            return None
    return 1 if total > 0 else -1 if total < 0 else 0


def _decided(x: Form, judge: Callable[[arb], T | None], precisions: Iterable[int]) -> T | None:
    """The first verdict on a finite ball of x; None where no precision brings one."""
    from heavytop.numbers.intervals import at_rising_precision, ball_of  # which are slow to import

    def verdict(bits: int) -> T | None:
        ball = ball_of(x)
        return judge(ball) if ball.is_finite() else None

    return at_rising_precision(precisions, verdict)


def _ball_sign(ball: arb) -> Literal[-1, 1] | None:
    """The sign of every number in a ball, if they share one."""
    return 1 if ball > 0 else -1 if ball < 0 else None


def size(x: Exact) -> float:
    """log₂ |x| for x ≠ 0, of its largest term or to a bit or two; 0 where no precision tells."""
    if (logs := _logarithms(x.terms)) is not None:
        return max(logs)

    def judge(ball: arb) -> int:
        man, exponent = _parts(ball.abs_upper())
        return man.bit_length() + exponent

    return _decided(x.terms, judge, _beyond(64)) or 0


def _nearest(x: Form, precision: int, rounded: Callable[[int, int], T]) -> T:
    """The value on which both ends of a ball agree once each, m 2ᵉ, is rounded."""

    def agreed(ball: arb) -> T | None:
        low, high = rounded(*_parts(ball.lower())), rounded(*_parts(ball.upper()))
        return high if low == high else None  # not −0 where the ball holds 0

    def middle(ball: arb) -> T:
        return rounded(0, 0) if _ball_sign(ball) is None else rounded(*_parts(ball.mid()))

    found = _decided(x, agreed, _beyond(precision))
    if found is None:  # a tie, or zero that is not proved
        found = _decided(x, middle, [precision + _EXTRA_BITS[-1]])
    return rounded(0, 0) if found is None else found


def _beyond(precision: int) -> Iterable[int]:
    return (precision + extra for extra in _EXTRA_BITS)


def _parts(ball: arb) -> tuple[int, int]:
    """Mantissa m and exponent e of an exact m 2ᵉ."""
    man, exponent = ball.man_exp()
    return int(man), int(exponent)


def _double(man: int, exponent: int) -> float:
    """The double nearest man 2ᵉ; an OverflowError where none is."""
    return man / (1 << -exponent) if exponent < 0 else float(man << exponent)
