"""The value of a form: intervals that hold it, at a precision that rises until they decide.

Numbers here are mpmath's raw binary ones, and an interval is a pair of them, lower and upper.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, Final, Literal, TypeAlias, TypeVar

from mpmath import libmp

from heavytop.errors import NotANumber
from heavytop.exact.forms import Atom, Form, Wave, fraction

_EXTRA_BITS: Final = (32, 128, 512, 2048)  # working precision beyond what is asked for
_ONE: Final = (libmp.fone, libmp.fone)

Raw: TypeAlias = Any
Interval: TypeAlias = "tuple[Raw, Raw]"
T = TypeVar("T")


class _UnresolvedError(NotANumber):
    """An interval to divide by holds zero: more precision is needed."""


def decide(x: Form, judge: Callable[[Interval], T | None], precision: int) -> T | None:
    """The first verdict on an enclosure of x, at rising precision; None where there is none."""
    for extra in _EXTRA_BITS:
        try:
            verdict = judge(_sum(x, precision + extra))
        except _UnresolvedError:
            continue
        if verdict is not None:
            return verdict
    return None


def sign(interval: Interval) -> Literal[-1, 1] | None:
    """The sign of every number in an interval, if they share one."""
    low, high = (libmp.mpf_sign(end) for end in interval)
    return 1 if low > 0 else -1 if high < 0 else None


def size(interval: Interval) -> int:
    """The exponent of 2 just above every magnitude in an interval."""
    return max((exponent + bits for _, man, exponent, bits in interval if man), default=0)


def mpf(x: Form, ctx: Any) -> Any:
    """The nearest number of the mpmath context `ctx`."""
    if (q := fraction(x)) is not None:
        return ctx.make_mpf(libmp.from_rational(q.numerator, q.denominator, ctx.prec, "n"))
    nearest = _rounded(x, ctx.prec, lambda value: libmp.mpf_pos(value, ctx.prec, "n"))
    return ctx.make_mpf(nearest)


def double(x: Form) -> float:
    """The nearest double.

    Raises
    ------
    OverflowError
        x is larger than any double.
    """
    return _rounded(x, 64, lambda value: float(Fraction(*libmp.to_rational(value))))


def _rounded(x: Form, precision: int, nearest: Callable[[Raw], T]) -> T:
    """The value on which both ends of an enclosure agree once they are rounded to `nearest`."""

    def agreed(interval: Interval) -> T | None:
        low, high = map(nearest, interval)
        return low if low == high else None

    value = decide(x, agreed, precision)
    return nearest(_middle(x, precision)) if value is None else value


def _middle(x: Form, precision: int) -> Raw:
    """The value where rounding is undecided to the last: a tie, or zero that is not proved."""
    low, high = interval = _sum(x, precision + _EXTRA_BITS[-1])
    if sign(interval) is None:
        return libmp.fzero
    return libmp.mpf_shift(libmp.mpf_add(low, high), -1)


# --- intervals, with outward rounding throughout ----------------------------------------------


def _sum(x: Form, precision: int) -> Interval:
    total = (libmp.fzero, libmp.fzero)
    for monomial, c in x:
        term = _rational(c, precision)
        for atom, e in monomial:
            factor = _power(_atom(atom, precision), e, precision)
            term = libmp.mpi_mul(term, factor, precision)
        total = libmp.mpi_add(total, term, precision)
    return total


def _rational(q: Fraction, precision: int) -> Interval:
    low, high = (libmp.from_rational(q.numerator, q.denominator, precision, way) for way in "fc")
    return low, high


def _atom(atom: Atom, precision: int) -> Interval:
    if isinstance(atom, Fraction):
        return _rational(atom, precision)
    if isinstance(atom, str):
        return libmp.mpf_pi(precision, "f"), libmp.mpf_pi(precision, "c")
    if isinstance(atom, Wave):
        wave = libmp.mpi_cos if atom.name == "cos" else libmp.mpi_sin
        interval: Interval = wave(_sum(atom.argument, precision), precision)
        return interval
    return _sum(atom, precision)


def _power(base: Interval, e: Fraction, precision: int) -> Interval:
    if e.denominator > 1:
        base = _root(base, e.denominator, precision)
    power: Interval = libmp.mpi_pow_int(base, abs(e.numerator), precision)
    if e > 0:
        return power
    if sign(power) is None:
        raise _UnresolvedError("division by a number that cannot be told from zero")
    inverse: Interval = libmp.mpi_div(_ONE, power, precision)
    return inverse


def _root(base: Interval, index: int, precision: int) -> Interval:
    """The root of an interval known not to be negative; what lies below zero is only width."""
    low, high = (end if libmp.mpf_sign(end) > 0 else libmp.fzero for end in base)
    slack = libmp.mpf_shift(libmp.fone, -precision)  # mpmath's roots may be off in the last bit
    near = [libmp.mpf_nthroot(end, index, precision + 8, "n") for end in (low, high)]
    return (
        libmp.mpf_mul(near[0], libmp.mpf_sub(libmp.fone, slack), precision, "f"),
        libmp.mpf_mul(near[1], libmp.mpf_add(libmp.fone, slack), precision, "c"),
    )
