"""From symbols to anything that computes: heyoka, numpy, MPFR, Python's floats, exact numbers.

An arithmetic is given by how it makes a number of an integer, p/q being the quotient of two of
them, and by its functions. So 1/3 has all the digits of whatever computes with it. `evaluated`
walks through expressions once; `lambdified` writes them as Python code, for what is called often.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
import sympy as sp
from sympy.printing.pycode import PythonCodePrinter

from heavytop import numbers as exact
from heavytop.errors import UntranslatableExpression
from heavytop.numbers import Exact

Functions = Mapping[str, Callable[..., Any]]

NUMPY: Functions = {"sin": np.sin, "cos": np.cos, "sqrt": np.sqrt, "atan2": np.arctan2}


def lambdified(
    expressions: Sequence[Any],
    arguments: Sequence[Any],
    number: Callable[[int], Any] = float,
    functions: Functions = NUMPY,
) -> Callable[..., list[Any]]:
    """Return a function of numbers of one type, which computes in that type alone.

    Parameters
    ----------
    expressions : sequence of sympy expressions, or of sequences of them
    arguments : sequence of symbols
    number : callable
        From an integer to a number of the type.
    functions : mapping from str to callable
        What ``sin``, ``cos``, ``sqrt``, ``atan2`` mean there, of those that occur. Together with
        `number`, those of arrays of doubles unless others are given.

    Examples
    --------
    >>> from fractions import Fraction
    >>> x = sp.Symbol("x")
    >>> lambdified([x / 3 + x**2], [x], Fraction, {})(Fraction(1, 2))
    [Fraction(5, 12)]
    """
    ratios = set().union(*(sp.sympify(x).atoms(sp.Rational) for x in sp.flatten(expressions)))
    signed = [r for ratio in ratios if ratio.q != 1 for r in (ratio, -ratio)]
    names = {_name(r): number(int(r.p)) / number(int(r.q)) for r in signed}
    return sp.lambdify(  # type: ignore[no-any-return]
        list(arguments),
        list(expressions),
        modules=[{**names, **functions}],  # modules="numpy" would import all of numpy, f2py too
        printer=_Printer({"fully_qualified_modules": False, "inline": True}),
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


def evaluated(
    expressions: Sequence[Any],
    values: Mapping[Any, Any],
    number: Callable[[int], Any],
    functions: Functions,
) -> list[Any]:
    """Return what expressions become when numbers, or expressions of others, stand for symbols.

    Equal subexpressions are evaluated once. `number` and `functions` are as in `lambdified`.

    Raises
    ------
    UntranslatableExpression
        It has a symbol without a value, or a function or number that the arithmetic has not.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> evaluated([sp.cos(x) ** 2 / 3 - y], {x: 0, y: 1}, float, {"cos": np.cos})
    [np.float64(-0.6666666666666667)]
    """
    return list(map(_Walk(dict(values), number, functions), map(sp.sympify, expressions)))


def exact_values(expressions: Sequence[Any], named: Mapping[str, Exact]) -> list[Exact]:
    """Return the exact values of expressions, given those of their symbols by name.

    >>> float(exact_values([sp.cos(sp.Symbol("x")) ** 2], {"x": Exact.of("pi/3")})[0])
    0.25
    """
    symbols = set().union(*(sp.sympify(x).free_symbols for x in expressions))
    values = {symbol: named[symbol.name] for symbol in symbols}
    return evaluated(expressions, values, Exact.of, {"sin": exact.sin, "cos": exact.cos})


@dataclass(frozen=True, slots=True)
class _Walk:
    """The way through an expression, in one arithmetic; `known` are the values met before."""

    known: dict[Any, Any]
    number: Callable[[int], Any]
    functions: Functions

    def __call__(self, node: Any) -> Any:
        if node not in self.known:
            self.known[node] = self._value(node)
        return self.known[node]

    def _value(self, node: Any) -> Any:
        if node.is_Rational:
            return self.number(int(node.p)) / self.number(int(node.q))
        if node.is_Add:
            return self._sum(node)
        if node.is_Mul:
            return self._product(node)
        if node.is_Pow and node.exp.is_Rational and node.exp.q <= 2:
            return self._power(node)
        if node.func.__name__ in self.functions:
            return self.functions[node.func.__name__](*map(self, node.args))
        raise UntranslatableExpression(f"{node} is not what can be computed here")

    def _sum(self, node: Any) -> Any:
        # Differences, not sums with negated terms: each negation is one more series to propagate.
        terms = sorted(node.args, key=_is_negative)
        total = self(terms[0])
        for term in terms[1:]:
            total = total - self(-term) if _is_negative(term) else total + self(term)
        return total

    def _product(self, node: Any) -> Any:
        if _is_negative(node):
            return -self(-node)
        # Reciprocals are gathered into one true division: x * (1/y) would round twice.
        below = [f for f in node.args if f.is_Pow and f.exp.is_Rational and f.exp < 0]
        above = [self(f) for f in node.args if f not in below]
        product = reduce(operator.mul, above) if above else self.number(1)
        return product / reduce(operator.mul, [self(1 / f) for f in below]) if below else product

    def _power(self, node: Any) -> Any:
        base, exponent = node.args
        if exponent < 0:
            return self.number(1) / self(base**-exponent)
        root = self(base) if exponent.q == 1 else self.functions["sqrt"](self(base))
        return root if exponent.p == 1 else root ** int(exponent.p)


def _is_negative(term: Any) -> bool:
    return bool(term.could_extract_minus_sign())
