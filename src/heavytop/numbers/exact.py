"""Exact, the exact real number: its making, its arithmetic, its values."""

from __future__ import annotations

import numbers
from collections.abc import Collection
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal, TypeAlias

from heavytop.errors import NotANumber
from heavytop.numbers import algebra, bounded, dyadic, forms, parse, signs
from heavytop.numbers.forms import Form
from heavytop.numbers.parse import MAX_DECIMAL_EXPONENT

if TYPE_CHECKING:
    from flint import arb

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
    def of(x: Number, units: Collection[str] = parse.UNITS) -> Exact:
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
            return Exact(parse.read(x, units), " ".join(x.split()))
        return Exact(bounded.number(_finite(x)))

    @property
    def fraction(self) -> Fraction | None:
        """The number as a Fraction, or None where it is irrational or not proved rational."""
        return forms.fraction(self.terms)

    def __add__(self, other: Number) -> Exact:
        if (b := _operand(other)) is None:
            return NotImplemented
        return Exact(algebra.add(self.terms, b.terms))

    def __mul__(self, other: Number) -> Exact:
        if (b := _operand(other)) is None:
            return NotImplemented
        return Exact(algebra.multiply(self.terms, b.terms))

    def __pow__(self, exponent: int | Fraction) -> Exact:
        if isinstance(exponent, bool) or not isinstance(exponent, (int, Fraction)):
            return NotImplemented
        return Exact(algebra.power(self.terms, Fraction(exponent)))

    def __neg__(self) -> Exact:
        return Exact(forms.scaled(self.terms, -1))

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
        """−1, 0 or 1, or None where 4096 bits cannot tell the number from an unproved zero.

        A zero is proved where expanding products, r^q = n for roots and sin² + cos² = 1 bring
        it to nothing without too much work (a second or so).

        Examples
        --------
        >>> ((1 + sqrt(2)) * (sqrt(2) - 1) - 1).sign(), (PI - Exact.of("3.1416")).sign()
        (0, -1)
        """
        return signs.sign(self.terms)

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
        from heavytop.numbers import enclosure

        return enclosure.ball(self.terms, bits)

    def mpf(self, ctx: Any) -> Any:
        """The number in the mpmath context `ctx`, correctly rounded to its precision.

        A number that 2000 bits beyond that precision cannot tell from zero comes out as zero.

        Parameters
        ----------
        ctx : mpmath context
            Such as ``mpmath.mp``; its precision is that of the result.
        """
        if (q := self.fraction) is not None:
            return ctx.mpf(dyadic.cut(q, ctx.prec + 2))
        from heavytop.numbers import enclosure

        return enclosure.mpf(self.terms, ctx)

    def __float__(self) -> float:
        """The nearest double.

        Raises
        ------
        NotANumber
            The number is larger than any double.
        """
        try:
            return self._double()
        except OverflowError:
            raise NotANumber("a number is larger than any double") from None

    def _double(self) -> float:
        if (q := self.fraction) is not None:
            return float(q)
        from heavytop.numbers import enclosure

        return enclosure.double(self.terms)

    def __str__(self) -> str:
        """The text it was read from, or one that `Exact.of` reads back to the same number."""
        return self.text if self.text is not None else forms.written(self.terms)

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
    return Exact(algebra.cos(Exact.of(x).terms))


def sin(x: Number) -> Exact:
    """The sine of `x` [rad], in closed form at multiples of π/6 and π/4.

    Examples
    --------
    >>> print(sin(PI), sin("30 deg"), sin("pi/4"))
    0 0.5 0.5*sqrt(2)
    """
    return Exact(algebra.sin(Exact.of(x).terms))


ONE: Final = Exact(forms.ONE)
PI: Final = Exact(forms.PI)


def _operand(x: object) -> Exact | None:
    """An operand of the arithmetic; texts are refused here, they must be read on purpose."""
    return Exact.of(x) if isinstance(x, (Exact, int, float, numbers.Real, Decimal)) else None  # type: ignore[arg-type]


def _finite(x: object) -> Fraction:
    """The exact rational value of a Python or numpy number."""
    if isinstance(x, float):  # the most common, and the checks below are slow
        return _ratio(x)
    if isinstance(x, bool) or not isinstance(x, (numbers.Real, Decimal)):
        kind = type(x).__name__
        article = "an" if kind[:1] in "aeiou" else "a"
        what = {"bool": "true or false", "NoneType": "nothing"}.get(kind, f"{article} {kind}")
        raise NotANumber(f"a number is not {what}")
    if isinstance(x, numbers.Rational):
        return Fraction(int(x.numerator), int(x.denominator))
    if isinstance(x, Decimal) and x.is_finite() and abs(x.adjusted()) > MAX_DECIMAL_EXPONENT:
        raise bounded.out_of_range()  # before the power of ten is built
    return _ratio(x)


def _ratio(x: Any) -> Fraction:
    try:
        return Fraction(*x.as_integer_ratio())
    except (AttributeError, OverflowError, ValueError):  # infinite, or of another library
        raise NotANumber(f"a number is finite, not {x}") from None
