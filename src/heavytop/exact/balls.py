"""Balls: working precision, exact numbers as balls, and `Interval`, a ball in decimals.

Balls are those of python-flint (Arb): a middle and a radius that includes every rounding error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, ROUND_HALF_EVEN, Context, Decimal
from fractions import Fraction
from threading import RLock
from typing import Any, Final

from flint import arb, ctx, fmpq

from heavytop.errors import Impossible
from heavytop.exact.number import Exact, rational, rational_value

_LOCK: Final = RLock()  # flint keeps one working precision for the whole process
_TINY: Final = arb(2) ** -(1 << 16)  # smaller middles and radii are rounded up to it
_PLACES: Final = 60  # decimals of an exact number in a text


class working:
    """A working precision in bits for a ``with`` block, during which no other thread has one.

    Blocks may be nested; each restores the precision before it. All computing with balls belongs in
    such a block: outside, another thread may change the precision between two operations.

    Parameters
    ----------
    bits : int
        The precision, at least 2.

    Raises
    ------
    ValueError
        `bits` is less than 2.

    Examples
    --------
    >>> from flint import arb
    >>> with working(200):
    ...     print(arb.pi().rel_accuracy_bits() > 190)
    True
    """

    def __init__(self, bits: int) -> None:
        self._bits = bits

    def __enter__(self) -> None:
        with _LOCK:
            self._before, ctx.prec = ctx.prec, self._bits
            _LOCK.acquire()  # a second time, until the block ends

    def __exit__(self, *raised: object) -> None:
        ctx.prec = self._before
        _LOCK.release()


# --- exact numbers as balls, at the working precision -----------------------------------------


def rational_ball(q: Fraction | fmpq) -> arb:
    """Return a ball of a rational number, at the working precision."""
    return arb(fmpq(q.numerator, q.denominator))


def fmpq_of(value: Any) -> fmpq:
    """Return a rational number of any type and size; numbers of runs may be smaller than 1e-300."""
    if type(value) is fmpq:
        return value
    if type(value) is float and math.isfinite(value):
        return fmpq(*value.as_integer_ratio())  # the usual case, fast
    q = rational_value(value)
    return fmpq(q.numerator, q.denominator)


def exact_of(q: fmpq | Fraction) -> Exact:
    """Return a rational number of any size as an exact one."""
    return rational(q if isinstance(q, Fraction) else Fraction(int(q.p), int(q.q)))


def ball_of(x: Exact, known: dict[Exact, arb] | None = None) -> arb:
    """Return a ball of x, each part computed once; not finite where a divisor's ball contains 0."""
    if x.op == "rational":
        return rational_ball(x.args[0])
    known = {} if known is None else known
    if x not in known:
        if x.op == "^":
            known[x] = _power(ball_of(x.args[0], known), x.args[1])
        elif x.op in ("+", "*"):
            parts = [ball_of(each, known) for each in x.args]
            known[x] = sum(parts, arb(0)) if x.op == "+" else math.prod(parts, start=arb(1))
        else:
            known[x] = getattr(ball_of(x.args[0], known), x.op)() if x.args else arb.pi()
    return known[x]


def _power(base: arb, exponent: Fraction) -> arb:
    """A ball to an exponent; the number in it is not negative where a root is taken."""
    n, k = exponent.numerator, exponent.denominator
    if k > 1:  # the number is not in the negative part of the ball
        base = base.root(k) if base > 0 else arb(0).union(base.upper().nonnegative_part().root(k))
    if n > 0 and base.contains(0):  # flint's power of such a ball is not finite
        return math.prod([base] * n, start=arb(1))
    return base**n


# --- intervals --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, repr=False)
class Interval:
    """The numbers from middle − spread to middle + spread, which contain the true one.

    Parameters
    ----------
    middle, spread : Fraction
        Exact; `Interval.of` takes them from a ball of python-flint.

    Examples
    --------
    >>> third = Interval(Fraction(1, 3), Fraction(1, 10**12))
    >>> print(third, third.digits, Fraction(1, 3) in third, "0.333" in third)
    0.33333333333 ± 5e-12 12 True False
    >>> third.bounds(6), third.lower < 1 / 3 < third.upper
    (('0.333333', '0.333334'), True)
    """

    middle: Fraction
    spread: Fraction

    @classmethod
    def of(cls, ball: arb) -> Interval:
        """The interval of a finite ball of python-flint, exact but for digits below 2⁻⁶⁵⁵³⁶.

        Parameters
        ----------
        ball : flint.arb
            A ball such as one of `Exact.ball`.

        Raises
        ------
        ValueError
            The ball is not finite.
        """
        if not ball.is_finite():
            raise ValueError("an interval is finite")
        middle, radius = ball.mid(), ball.rad()
        if abs(middle) < _TINY:
            middle, radius = arb(0), radius + (0 if middle.is_zero() else _TINY)
        spread = radius if radius.is_zero() or radius > _TINY else _TINY
        return cls(*(Fraction(int(q.p), int(q.q)) for q in (middle.fmpq(), spread.upper().fmpq())))

    @property
    def mid(self) -> float:
        """The double nearest the middle."""
        return _double(self.middle)

    @property
    def lower(self) -> float:
        """The largest double that is not above any number of the interval."""
        return outward(self.middle - self.spread, -1)

    @property
    def upper(self) -> float:
        """The smallest double that is not below any number of the interval."""
        return outward(self.middle + self.spread, 1)

    @property
    def digits(self) -> float:
        """The largest n with spread ≤ 10⁻ⁿ max(1, |middle|); infinite where the spread is 0."""
        return _places(self.spread / max(Fraction(1), abs(self.middle)))

    def bounds(self, digits: int) -> tuple[str, str]:
        """Two decimal numbers of so many significant digits with the interval between them.

        Parameters
        ----------
        digits : int
            Their number, at least 1.
        """
        ends = (self.middle - self.spread, ROUND_FLOOR), (self.middle + self.spread, ROUND_CEILING)
        low, high = (str(_decimal(end, digits, way)).replace("E", "e") for end, way in ends)
        return low, high

    def rounded(self, digits: int) -> str:
        """A decimal number within one unit of its last digit of every number of the interval.

        Parameters
        ----------
        digits : int
            Digits before and after the decimal point; of a number below 1 those after it.

        Raises
        ------
        Impossible
            The interval is too wide for so many digits.

        Examples
        --------
        >>> third = Interval(Fraction(1, 3), Fraction(1, 10**12))
        >>> third.rounded(6), Interval(100 * third.middle, third.spread).rounded(6)
        ('0.333333', '33.3333')
        """
        integer = int(abs(self.middle))
        places = max(digits - len(str(integer)), 0) if integer else digits
        last = round(self.middle * 10**places)
        if abs(last - self.middle * 10**places) + self.spread * 10**places > 1:
            raise Impossible([("digits", f"{self}: not known to {digits} digits")])
        return f"{Decimal((last < 0, (*map(int, str(abs(last))),), -places)):f}"

    def __contains__(self, x: object) -> bool:
        """Whether the number `x`, or every number of the interval `x`, is in this one.

        Parameters
        ----------
        x : int, float, Fraction, Decimal, str, mpmath number, numpy number or Interval
            Floats and mpmath numbers mean their binary value, texts are decimal.

        Raises
        ------
        NotANumber
            `x` is none of these, or not finite.
        """
        if isinstance(x, Interval):
            return abs(x.middle - self.middle) + x.spread <= self.spread
        value: Any = Exact.of(x) if isinstance(x, str) else x
        return abs(rational_value(value) - self.middle) <= self.spread

    def __str__(self) -> str:
        """The known digits, without zeros at the end, and a radius, rounded outward."""
        unit = Fraction(10) ** -int(_places(2 * self.spread) if self.spread else _PLACES)
        shown = round(self.middle / unit) * unit
        digits = 1 + max(0, -int(_places(abs(shown / unit) or Fraction(1))))
        text = _decimal(shown, digits, ROUND_HALF_EVEN)
        error = self.spread + abs(self.middle - shown)
        if not error:
            return f"{text:f}"
        return f"{text} ± {_decimal(error, 1, ROUND_CEILING)}".replace("E", "e")

    def __repr__(self) -> str:
        return f"<Interval {self}>"


def bound_of(ball: arb) -> tuple[str, float]:
    """An upper bound of the size of the numbers of a ball, as a text of two digits and a double."""
    if not ball.is_finite():
        return "infinity", math.inf
    size = Interval.of(abs(ball))
    return size.bounds(2)[1], size.upper


def outward(q: Fraction, way: int) -> float:
    """Return the nearest double that is not below q (`way` 1), or not above it (−1)."""
    near = _double(q)
    wrong = near < q if way > 0 else near > q
    return math.nextafter(near, way * math.inf) if wrong else near


def _places(size: Fraction) -> float:
    """The largest n with size ≤ 10⁻ⁿ."""
    if not size:
        return math.inf
    top = _decimal(size, 1, ROUND_CEILING)
    return -top.adjusted() - (top.as_tuple().digits != (1,))


def _decimal(q: Fraction, digits: int, way: str) -> Decimal:
    """The number rounded to so many significant decimal digits."""
    rounding = Context(digits, way, Emin=-(10**8), Emax=10**8)
    return rounding.normalize(rounding.divide(Decimal(q.numerator), Decimal(q.denominator)))


def _double(q: Fraction) -> float:
    """The nearest double, ±∞ beyond the largest one."""
    try:
        return float(q)
    except OverflowError:
        return math.inf if q > 0 else -math.inf
