"""The value of a form: balls that hold it, at a precision that rises until they decide."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any, Final, Literal, TypeVar

from flint import arb, fmpq

from heavytop.numbers import dyadic
from heavytop.numbers.forms import Atom, Form, Wave
from heavytop.numbers.intervals import working

_EXTRA_BITS: Final = (32, 128, 512, 2048)  # working precision beyond what is asked for

T = TypeVar("T")


def ball(x: Form, bits: int) -> arb:
    """A ball that holds x, evaluated at `bits`; not finite where a divisor's ball holds zero."""
    with working(bits):
        return _sum(x)


def decide(x: Form, judge: Callable[[arb], T | None], precisions: Iterable[int]) -> T | None:
    """The first verdict on a finite ball of x; None where no precision brings one."""
    for bits in precisions:
        with working(bits):
            value = _sum(x)
            if value.is_finite() and (verdict := judge(value)) is not None:
                return verdict
    return None


def sign(value: arb) -> Literal[-1, 1] | None:
    """The sign of every number in a ball, if they share one."""
    return 1 if value > 0 else -1 if value < 0 else None


def size(x: Form) -> int:
    """The exponent of 2 just above |x|, up to rounding; 0 where no precision tells."""
    return decide(x, _size, _beyond(64)) or 0


def mpf(x: Form, ctx: Any) -> Any:
    """The nearest number of the mpmath context `ctx`."""
    return _rounded(x, ctx.prec, lambda man, exponent: ctx.mpf((man, exponent)))


def double(x: Form) -> float:
    """The nearest double.

    Raises
    ------
    OverflowError
        x is larger than any double.
    """
    return _rounded(x, 64, dyadic.double)


def _beyond(precision: int) -> Iterable[int]:
    return (precision + extra for extra in _EXTRA_BITS)


def _size(value: arb) -> int:
    man, exponent = _parts(value.abs_upper())
    return man.bit_length() + exponent


def _rounded(x: Form, precision: int, nearest: Callable[[int, int], T]) -> T:
    """The value on which both ends of a ball agree once they are rounded to `nearest`."""

    def agreed(value: arb) -> T | None:
        low, high = nearest(*_parts(value.lower())), nearest(*_parts(value.upper()))
        return high if low == high else None  # not −0 where the ball holds 0

    found = decide(x, agreed, _beyond(precision))
    return nearest(*_middle(x, precision)) if found is None else found


def _middle(x: Form, precision: int) -> tuple[int, int]:
    """The value where rounding is undecided to the last: a tie, or zero that is not proved."""
    value = ball(x, precision + _EXTRA_BITS[-1])
    return (0, 0) if sign(value) is None else _parts(value.mid())


def _parts(value: arb) -> tuple[int, int]:
    """Mantissa m and exponent e of an exact m 2ᵉ."""
    man, exponent = value.man_exp()
    return int(man), int(exponent)


# --- balls, at the working precision ----------------------------------------------------------


def _sum(x: Form) -> arb:
    total = arb(0)
    for monomial, c in x:
        term = _rational(c)
        for atom, e in monomial:
            term *= _power(_atom(atom), e)
        total += term
    return total


def _rational(q: Fraction) -> arb:
    return arb(fmpq(q.numerator, q.denominator))


def _atom(atom: Atom) -> arb:
    if isinstance(atom, Fraction):
        return _rational(atom)
    if isinstance(atom, str):
        return arb.pi()
    if isinstance(atom, Wave):
        argument = _sum(atom.argument)
        return argument.cos() if atom.name == "cos" else argument.sin()
    return _sum(atom)


def _power(base: arb, e: Fraction) -> arb:
    if e.denominator > 1:
        base = _root(base, e.denominator)
    return base if e.numerator == 1 else base**e.numerator


def _root(base: arb, index: int) -> arb:
    """The root of a number known not to be negative; what lies below zero is only width."""
    if base > 0:
        return base.sqrt() if index == 2 else base.root(index)
    top = base.upper().nonnegative_part()
    return top if top.is_zero() else arb(0).union(top.root(index))
