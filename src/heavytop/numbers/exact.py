"""Exact, the exact real number: its making, its arithmetic, its sign and its values."""

from __future__ import annotations

import numbers
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from math import inf, isinf
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, TypeAlias, TypeVar

from heavytop.errors import NotANumber
from heavytop.names import article
from heavytop.numbers import normal_form
from heavytop.numbers.normal_form import Form, fraction, rational, scaled

if TYPE_CHECKING:
    from flint import arb

T = TypeVar("T")
Sign: TypeAlias = Literal[-1, 0, 1]

MAX_DECIMAL_EXPONENT: Final = 400
_ABOUT_PI: Final = Fraction("3.14159265358979323846"), Fraction("3.14159265358979323847")
_LARGEST: Final = 10**300
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
        if isinstance(x, float) or type(x) is int:  # at once, as most are
            if x == 0:
                return NOTHING
            if 1e-300 < abs(x) < 1e300:
                return Exact(rational(Fraction(x)))
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
        if exponent.denominator == 2:
            return sqrt(self) ** exponent.numerator
        if exponent.denominator != 1:
            raise NotANumber("an exponent is a whole number or half of one")
        if exponent < 0 and not (known := self.sign()):
            what = "zero" if known == 0 else "a number that cannot be told from zero"
            raise NotANumber(f"division by {what}")
        return Exact(normal_form.power(self.terms, int(exponent)))

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

        A zero is proved where expanding products, r² = n for roots and sin² + cos² = 1 bring
        it to nothing without too much work (a second or so).

        Examples
        --------
        >>> ((1 + sqrt(2)) * (sqrt(2) - 1) - 1).sign(), (PI - Exact.of("3.1416")).sign()
        (0, -1)
        """
        if (q := self.fraction) is not None:
            return _sign(q)
        if side := _plain_side(self.terms) or self._side(_FEW_BITS):
            return side
        return 0 if normal_form.proved_zero(self.terms) else self._side(_MANY_BITS)

    def _side(self, precisions: tuple[int, ...]) -> Literal[-1, 1] | None:
        """The side of zero where a ball lies, at the first precision that tells."""
        for ball in map(self.ball, precisions):
            if ball > 0 or ball < 0:
                return 1 if ball > 0 else -1
        return None

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
        return self._nearest(ctx.prec, lambda end: +ctx.convert(end))

    def __float__(self) -> float:
        """The nearest double.

        Raises
        ------
        NotANumber
            The number is larger than any double.
        """
        value = inf
        with suppress(OverflowError):
            value = self._nearest(64, float) if (q := self.fraction) is None else float(q)
        if isinf(value):
            raise NotANumber("a number is larger than any double")
        return value

    def _nearest(self, precision: int, rounded: Callable[[arb], T]) -> T:
        """The value on which both ends of a ball agree once each is rounded."""
        from flint import arb

        from heavytop.numbers.intervals import ball_of, working

        for extra in _EXTRA_BITS:
            with working(precision + extra):
                ball = ball_of(self.terms)
                if ball.is_finite() and rounded(ball.lower()) == rounded(ball.upper()):
                    return rounded(ball.upper())  # not −0 where the ball holds 0
        told = ball.is_finite() and not ball.contains(0)
        return rounded(ball.mid() if told else arb(0))  # a tie, or zero that is not proved

    def __str__(self) -> str:
        """The text it was read from, or one that `Exact.of` reads back to the same number."""
        return self.text if self.text is not None else normal_form.written(self.terms)

    def __repr__(self) -> str:
        return f"Exact.of({str(self)!r})"


def sqrt(x: Number) -> Exact:
    """The square root of `x`; a negative `x` raises `NotANumber`."""
    square = Exact.of(x)
    if square.sign() == -1:
        raise NotANumber("a root of a negative number is not real")
    return Exact(normal_form.sqrt(square.terms))


def cos(x: Number) -> Exact:
    """The cosine of `x` [rad], in closed form at multiples of π/6 and π/4.

    Examples
    --------
    >>> print(cos(PI / 2), cos(-PI / 6), cos(0.5))
    0 0.5*sqrt(3) cos(0.5)
    """
    return Exact(normal_form.wave("cos", Exact.of(x).terms))


def sin(x: Number) -> Exact:
    """The sine of `x` [rad], in closed form at multiples of π/6 and π/4.

    Examples
    --------
    >>> print(sin(PI), sin("30 deg"), sin("pi/4"))
    0 0.5 0.5*sqrt(2)
    """
    return Exact(normal_form.wave("sin", Exact.of(x).terms))


def acos(x: Number) -> Exact:
    """The angle in [0, π] [rad] whose cosine is `x`; its cosine is `x` again.

    Examples
    --------
    >>> print(acos("1/2"), cos(acos("3/4")), sin(acos("3/5")))
    1/3*pi 0.75 0.8
    """
    cosine = Exact.of(x)
    beyond = (ONE - cosine).sign(), (ONE + cosine).sign()
    if -1 in beyond:
        raise NotANumber("a cosine lies within [-1, 1]")
    if 0 in beyond:
        return NOTHING if beyond[0] == 0 else PI
    return Exact(normal_form.acos(cosine.terms))


def asin(x: Number) -> Exact:
    """The angle in [−π/2, π/2] [rad] whose sine is `x`."""
    return PI / 2 - acos(x)


def atan(x: Number) -> Exact:
    """The angle in (−π/2, π/2) [rad] whose tangent is `x`."""
    tangent = Exact.of(x)
    angle = acos(1 / sqrt(1 + tangent**2))
    return -angle if tangent.sign() == -1 else angle


NOTHING: Final = Exact(normal_form.ZERO)
ONE: Final = Exact(normal_form.ONE)
PI: Final = Exact(normal_form.PI)


def _plain_side(x: Form) -> Literal[-1, 1] | None:
    """The side of zero of q + r π, and of one root or power of π: without balls, slow to import."""
    if len(x) == 1 and all(map(normal_form.positive, dict(x[0][0]))):
        return 1 if x[0][1] > 0 else -1
    if not {monomial for monomial, _ in x} <= {(), normal_form.PI_ALONE}:
        return None
    low, high = sorted(sum(c * pi if monomial else c for monomial, c in x) for pi in _ABOUT_PI)
    return 1 if low > 0 else -1 if high < 0 else None


def _sign(q: Fraction) -> Sign:
    """The sign of a rational number, by that of an integer."""
    return 1 if q.numerator > 0 else -1 if q.numerator < 0 else 0


def _operand(x: object) -> Exact | None:
    """An operand of the arithmetic; texts are refused here, they must be read on purpose."""
    return Exact.of(x) if isinstance(x, (Exact, int, float, numbers.Real, Decimal)) else None  # type: ignore[arg-type]


def rational_value(x: Any) -> Fraction:
    """The exact value of a number of Python, numpy or mpmath, finite and of any size."""
    if isinstance(x, bool) or not isinstance(x, (numbers.Real, Decimal)):
        kind = type(x).__name__
        what = {"bool": "true or false", "NoneType": "nothing"}.get(kind, article(kind))
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
    if q and not q.denominator <= abs(q.numerator) * _LARGEST <= q.denominator * _LARGEST**2:
        raise out_of_range()
    return Exact(rational(q))


def out_of_range() -> NotANumber:
    """The error of a number that is too large or too small."""
    return NotANumber("the magnitude of a number is 0 or within 1e-300 … 1e300")
