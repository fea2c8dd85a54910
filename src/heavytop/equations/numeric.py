"""From symbols to numbers: sympy expressions as numpy functions and as exact numbers."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np
import sympy as sp
from sympy.printing.numpy import NumPyPrinter

from heavytop import numbers as exact
from heavytop.numbers import Exact

_NUMPY = {name: getattr(np, name) for name in ("sin", "cos", "sqrt", "abs", "arctan2")}


def numpy_function(expressions: Sequence[Any], arguments: Sequence[Any]) -> Callable[..., Any]:
    """Return a vectorised function of the arguments, in double precision."""
    # named functions only: modules="numpy" would import all of numpy, f2py included
    printer = NumPyPrinter({"fully_qualified_modules": False, "inline": True})
    return sp.lambdify(  # type: ignore[no-any-return]
        list(arguments), list(expressions), modules=[_NUMPY], printer=printer, cse=True
    )


def exact_values(expressions: Sequence[Any], values: Mapping[Any, Exact]) -> tuple[Exact, ...]:
    """Return the exact values of expressions, to be rounded once to whatever precision.

    >>> x = sp.Symbol("x")
    >>> float(exact_values([sp.cos(x) ** 2], {x: Exact.of("pi/3")})[0])
    0.25
    """
    known = dict(values)
    return tuple(_value(expression, known) for expression in expressions)


def _value(node: Any, known: dict[Any, Exact]) -> Exact:
    if node not in known:
        known[node] = _fresh_value(node, known)
    return known[node]


def _fresh_value(node: Any, known: dict[Any, Exact]) -> Exact:
    if node.is_Rational:
        return Exact.of(int(node.p)) / Exact.of(int(node.q))
    arguments = [_value(argument, known) for argument in node.args]
    if node.is_Add:
        return reduce(operator.add, arguments)
    if node.is_Mul:
        return reduce(operator.mul, arguments)
    if node.is_Pow and node.exp.is_Integer:
        return arguments[0] ** int(node.exp)
    functions = {sp.sin: exact.sin, sp.cos: exact.cos}
    return functions[node.func](*arguments)
