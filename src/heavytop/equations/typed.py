"""Sympy expressions as functions of any type of number, every constant exact in that type."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import sympy as sp
from sympy.printing.pycode import PythonCodePrinter


def typed_function(
    expressions: Sequence[Any],
    arguments: Sequence[Any],
    number: Callable[[int], Any],
    functions: Mapping[str, Callable[..., Any]],
) -> Callable[..., Any]:
    """Return a function of numbers of one type, which computes in that type alone.

    What it returns is a list or a tuple as the expressions are: compiled, a list costs more.

    Parameters
    ----------
    expressions : sequence of sympy expressions, or of sequences of them
    arguments : sequence of symbols
    number : callable
        From an integer to a number of the type; p/q is the quotient of two of them.
    functions : mapping from str to callable
        What ``sin``, ``cos``, ``sqrt``, ``atan2`` mean there, of those that occur.

    Examples
    --------
    >>> from fractions import Fraction
    >>> x = sp.Symbol("x")
    >>> typed_function([x / 3 + x**2], [x], Fraction, {})(Fraction(1, 2))
    [Fraction(5, 12)]
    >>> typed_function((x / 3, -x), [x], Fraction, {})(Fraction(1, 2))
    (Fraction(1, 6), Fraction(-1, 2))
    """
    ratios = set().union(*(sp.sympify(x).atoms(sp.Rational) for x in sp.flatten(expressions)))
    signed = [r for ratio in ratios if ratio.q != 1 for r in (ratio, -ratio)]
    names = {_name(r): number(int(r.p)) / number(int(r.q)) for r in signed}
    printer = _Printer({"fully_qualified_modules": False, "inline": True})
    return sp.lambdify(  # type: ignore[no-any-return]
        list(arguments),
        expressions,
        modules=[{**names, **functions}],
        printer=printer,
        cse=True,
    )


def _name(ratio: Any) -> str:
    sign = "minus_" if ratio.p < 0 else ""
    return f"ratio_{sign}{abs(ratio.p)}_{ratio.q}"


class _Printer(PythonCodePrinter):  # type: ignore[misc]
    """Writes 1/3 as the name of a number: Python's own would be a double."""

    def _print_Rational(self, ratio: Any) -> str:
        return _name(ratio)

    _print_Half = _print_Rational
