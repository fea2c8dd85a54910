"""Symbolic expressions as functions in any arithmetic: heyoka, numpy, MPFR, floats, exact numbers.

Expressions are written as Python code. An arithmetic is a function from integers to its numbers,
p/q being the quotient of two of these, and its functions such as cos. So 1/3 has all the digits of
the arithmetic.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from operator import methodcaller
from typing import Any, Final

import numpy as np
import sympy as sp
from flint import arb

from heavytop import exact
from heavytop.errors import WrongType
from heavytop.exact import Exact
from heavytop.exact.balls import ball_of, working

Functions = Mapping[str, Callable[..., Any]]
OfInteger = Callable[[int], Any]

NUMPY: Functions = {"sin": np.sin, "cos": np.cos, "sqrt": np.sqrt, "atan2": np.arctan2, "Abs": abs}


def lambdify(
    expressions: Sequence[Any],
    arguments: Sequence[Any],
    number: OfInteger = float,
    functions: Functions = NUMPY,
    *,
    ordered: bool = True,
) -> Callable[..., Any]:
    """Return a function of numbers of one type, which computes in that type alone.

    It returns a list or a tuple, as the expressions are. (In sympy's `lambdify` 1/3 is a double.)

    Parameters
    ----------
    expressions : sequence of sympy expressions, or of sequences of them
    arguments : sequence of symbols, or of their names
    number : callable
        From an integer to a number of the type.
    functions : mapping from str to callable
        The functions ``sin``, ``cos``, ``sqrt``, ``atan2``, ``Abs`` of the arithmetic, of those
        that occur; `number` and `functions` are by default those of arrays of doubles.
    ordered : bool
        Whether sums and products are evaluated in the order in which sympy prints them, on which
        the bounds of rounded outputs rely; if not, subtractions come last.

    Raises
    ------
    WrongType
        An expression has a symbol that is no argument, or a function or number that is not in the
        arithmetic.

    Examples
    --------
    >>> from fractions import Fraction
    >>> x = sp.Symbol("x")
    >>> lambdify([x / 3 + x**2], [x], Fraction, {})(Fraction(1, 2))
    [Fraction(5, 12)]
    >>> lambdify((x / 3, -x), [x], Fraction, {})(Fraction(1, 2))
    (Fraction(1, 6), Fraction(-1, 2))
    """
    names = [str(x) for x in arguments]
    writer = _Writer(names, number, {**functions}, ordered)
    for expression in sp.flatten(expressions):
        writer.count(sp.sympify(expression))
    returned = writer.write(expressions)
    lines = [f"def function({', '.join(names)}):", *writer.lines, f"return {returned}"]
    exec(compile("\n ".join(lines), "<expressions>", "exec"), writer.known)  # own code alone
    function: Callable[..., Any] = writer.known["function"]
    return function


def evaluate(
    expressions: Sequence[Any], named: Mapping[str, Any], number: OfInteger, functions: Functions
) -> list[Any]:
    """Return the values of expressions, where symbols are replaced by numbers or expressions.

    `named` has these by the names of the symbols; `number` and `functions` are as in `lambdify`.

    Raises
    ------
    WrongType
        As `lambdify` does.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> evaluate([sp.cos(x) ** 2 / 3 - y], {"x": 0, "y": 1}, float, {"cos": np.cos})
    [np.float64(-0.6666666666666667)]
    """
    function = lambdify([*expressions], [*named], number, functions, ordered=False)
    return [*function(*named.values())]


@dataclass
class _Writer:
    """Python code of expressions, with a line for each part that is used more than once."""

    names: Sequence[str]
    number: OfInteger
    known: dict[str, Any]
    ordered: bool
    uses: Counter[Any] = field(default_factory=Counter)
    operations: dict[Any, tuple[str, Sequence[Any]]] = field(default_factory=dict)
    lines: list[str] = field(default_factory=list)

    def count(self, node: Any) -> None:
        """Count one more use of an expression, and those of its parts the first time."""
        self.uses[node] += 1
        if self.uses[node] == 1:
            self.operations[node] = self._operation(node)
            for part in self.operations[node][1]:
                self.count(part)

    def write(self, node: Any) -> str:
        """Return the code of an expression, or of a list or tuple of them."""
        if isinstance(node, (list, tuple)):
            parts = "".join(f"{self.write(each)}, " for each in node)
            return f"[{parts}]" if isinstance(node, list) else f"({parts})"
        node = sp.sympify(node)
        form, operands = self.operations[node]
        code = form.format(*map(self.write, operands))
        if operands and self.uses[node] > 1:
            name = f"part_{len(self.lines)}"
            self.lines.append(f"{name} = {code}")
            self.operations[node] = (code := name), ()
        return code

    def _operation(self, node: Any) -> tuple[str, Sequence[Any]]:
        """Return the code of an operation, with places for its operands."""
        if node.is_Symbol and node.name in self.names:
            return node.name, ()
        if node.is_Rational:
            value = self.number(int(node.p))
            name = f"number_{len(self.known)}"
            self.known[name] = value if node.is_Integer else value / self.number(int(node.q))
            return name, ()
        if node.is_Add:
            return self._sum(node)
        if node.is_Mul:
            return self._product(node)
        if _is_power(node):
            return _power(node)
        if node.func.__name__ in self.known:
            return f"{node.func.__name__}({', '.join(['{}'] * len(node.args))})", node.args
        raise WrongType(f"{node} is not what can be computed here")

    def _sum(self, node: Any) -> tuple[str, Sequence[Any]]:
        """Return the code of a sum."""
        # Differences, not sums of negated terms: each negation is one more Taylor series
        negative = {term: term.could_extract_minus_sign() for term in node.args}
        last = sorted(node.args, key=negative.__getitem__)
        first, *others = node.as_ordered_terms() if self.ordered else last
        signs = "".join(" - {}" if negative[term] else " + {}" for term in others)
        return f"({{}}{signs})", [first, *(-x if negative[x] else x for x in others)]

    def _product(self, node: Any) -> tuple[str, Sequence[Any]]:
        """Return the code of a product or a quotient."""
        if node.could_extract_minus_sign():
            return "(-{})", [-node]
        # Reciprocals are collected into one division: x * (1/y) would round twice.
        factors = node.as_ordered_factors() if self.ordered else node.args
        below = [x for x in factors if _is_power(x) and x.exp.p < 0]
        above = [x for x in factors if x not in below] or [sp.Integer(1)]
        whole = " * ".join(["{}"] * len(above))
        divided = f" / ({' * '.join(['{}'] * len(below))})" if below else ""
        return f"({whole}{divided})", [*above, *(1 / x for x in below)]


def _power(node: Any) -> tuple[str, Sequence[Any]]:
    """Return the code of a power by a whole or half number."""
    p, q = node.exp.p, node.exp.q
    if p < 0:
        return "({} / {})", [sp.Integer(1), 1 / node]
    root = "{}" if q == 1 else "sqrt({})"
    return (root if p == 1 else f"({root} ** {p})"), [node.base]


def _is_power(node: Any) -> bool:
    """Tell whether it is a power by a whole or half number."""
    return bool(node.is_Pow and node.exp.is_Rational and node.exp.q <= 2)


def exact_values(expressions: Sequence[Any], named: Mapping[str, Exact]) -> list[Exact]:
    """Return the exact values of expressions, given those of their symbols by name.

    >>> float(exact_values([sp.cos(sp.Symbol("x")) ** 2], {"x": Exact.of("pi/3")})[0])
    0.25
    """
    return evaluate(expressions, named, Exact.of, {"sin": exact.sin, "cos": exact.cos})


class Rounded:
    """Expressions as functions of exact numbers, each value rounded once to the nearest double.

    They are evaluated in balls of 128 bits. Where the two ends of a ball are not rounded to the
    same double, for example where a value is zero by an identity, exact numbers decide.

    Parameters
    ----------
    expressions : sequence of sympy expressions

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> Rounded([sp.cos(x), x / 3])({"x": Exact.of("pi/2")})
    [0.0, 0.5235987755982989]
    """

    def __init__(self, expressions: Sequence[Any]) -> None:
        self.expressions = tuple(map(sp.sympify, expressions))
        self.names = sorted({x.name for e in self.expressions for x in e.free_symbols})
        with working(_ROUNDED_BITS):
            self._function = lambdify(self.expressions, self.names, arb, _BALLS)

    def __call__(self, named: Mapping[str, Exact]) -> list[float]:
        """Return the values at exact numbers, given by the names of the symbols."""
        with working(_ROUNDED_BITS):
            balls = self._function(*[ball_of(named[name]) for name in self.names])
            values = [_double(x) for x in balls]
        pairs = zip(self.expressions, values, strict=True)
        return [float(exact_values([e], named)[0]) if x is None else x for e, x in pairs]


_ROUNDED_BITS: Final = 128
# methods of python-flint
_BALLS: Functions = {name: methodcaller(name) for name in ("sin", "cos", "sqrt")}


def _double(ball: Any) -> float | None:
    """Return the one double to which all of a ball is rounded, or None."""
    low, high = float(ball.lower()), float(ball.upper())
    return high + 0.0 if low == high and isfinite(low) else None
