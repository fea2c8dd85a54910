"""From symbols to anything that computes: heyoka, numpy, MPFR, Python's floats, exact numbers.

An arithmetic is given by how it makes a number of an integer, p/q being the quotient of two of
them, and by its functions. So 1/3 has all the digits of whatever computes with it. `evaluated`
walks through expressions once; `lambdified` writes them as Python code, for what is called often.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, reduce
from math import isfinite
from typing import Any, Final

import numpy as np
import sympy as sp

from heavytop import exact
from heavytop.errors import WrongType
from heavytop.exact import Exact
from heavytop.exact.balls import ball_of, working
from heavytop.exact.decimals import Context

Functions = Mapping[str, Callable[..., Any]]

NUMPY: Functions = {"sin": np.sin, "cos": np.cos, "sqrt": np.sqrt, "atan2": np.arctan2}


def lambdified(
    expressions: Sequence[Any],
    arguments: Sequence[Any],
    number: Callable[[int], Any] = float,
    functions: Functions = NUMPY,
) -> Callable[..., Any]:
    """Return a function of numbers of one type, which computes in that type alone.

    What it returns is a list or a tuple as the expressions are. In sympy's own `lambdify` 1/3 is a
    double.

    Parameters
    ----------
    expressions : sequence of sympy expressions, or of sequences of them
    arguments : sequence of symbols, or of their names
    number : callable
        From an integer to a number of the type.
    functions : mapping from str to callable
        What ``sin``, ``cos``, ``sqrt``, ``atan2`` mean there, of those that occur. Together with
        `number`, those of arrays of doubles unless others are given.

    Raises
    ------
    WrongType
        As `evaluated` does.

    Examples
    --------
    >>> from fractions import Fraction
    >>> x = sp.Symbol("x")
    >>> lambdified([x / 3 + x**2], [x], Fraction, {})(Fraction(1, 2))
    [Fraction(5, 12)]
    >>> lambdified((x / 3, -x), [x], Fraction, {})(Fraction(1, 2))
    (Fraction(1, 6), Fraction(-1, 2))
    """
    names = [str(x) for x in arguments]
    of_terms = {name: _of_terms(name, f) for name, f in {"Abs": abs, **functions}.items()}
    terms = dict(zip(names, map(_Term, names), strict=True))
    values = evaluated(sp.flatten(expressions), terms, number, of_terms, ordered=True)
    for value in values:
        if isinstance(value, _Term):
            value.uses += 1
    lines, known = list[str](), {"Abs": abs, **functions}
    text = _written(expressions, iter([_code(value, lines, known) for value in values]))
    source = "\n ".join([f"def function({', '.join(names)}):", *lines, f"return {text}"])
    exec(compile(source, "<expressions>", "exec"), known)  # of our own expressions, no texts
    function: Callable[..., Any] = known["function"]
    function.__doc__ = source
    return function


def _operators(sign: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """An operator of terms and the same reflected."""
    form = f"({{}} {sign} {{}})"
    return lambda x, y: _Term(form, x, y), lambda x, y: _Term(form, y, x)


class _Term:
    """A term of the code that is written: a name, or an operation on other terms and numbers."""

    __array_ufunc__ = None  # numpy's numbers leave the arithmetic to it

    def __init__(self, form: str, *args: Any) -> None:
        self.form, self.args, self.uses = form, args, 0
        for each in args:
            if isinstance(each, _Term):
                each.uses += 1

    __add__, __radd__ = _operators("+")
    __sub__, __rsub__ = _operators("-")
    __mul__, __rmul__ = _operators("*")
    __truediv__, __rtruediv__ = _operators("/")

    def __pow__(self, exponent: int) -> _Term:
        return _Term(f"({{}} ** {exponent})", self)

    def __neg__(self) -> _Term:
        return _Term("(-{})", self)


def _of_terms(name: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """A function that also takes terms, of which it makes another one."""

    def applied(*args: Any) -> Any:
        if any(isinstance(x, _Term) for x in args):
            return _Term(f"{name}({', '.join(['{}'] * len(args))})", *args)
        return function(*args)

    return applied


def _code(value: Any, lines: list[str], known: dict[str, Any]) -> str:
    """The text of a term or a number; what occurs twice is a line of its own, before it."""
    if not isinstance(value, _Term):
        name = f"number_{len(known)}"
        known[name] = value
        return name
    if value.args:
        text = value.form.format(*[_code(x, lines, known) for x in value.args])
        if value.uses < 2:
            return text
        value.form, value.args = f"part_{len(lines)}", ()
        lines.append(f"{value.form} = {text}")
    return value.form


def _written(expressions: Any, values: Iterator[str]) -> str:
    """The text of values in lists and tuples as those of expressions."""
    if not isinstance(expressions, (list, tuple)):
        return next(values)
    parts = "".join(f"{_written(each, values)}, " for each in expressions)
    return f"[{parts}]" if isinstance(expressions, list) else f"({parts})"


def evaluated(
    expressions: Sequence[Any],
    named: Mapping[str, Any],
    number: Callable[[int], Any],
    functions: Functions,
    *,
    ordered: bool = False,
) -> list[Any]:
    """Return what expressions become when numbers, or expressions of others, stand for symbols.

    `named` has those by the names of the symbols; `number` and `functions` are as in `lambdified`.
    Equal subexpressions are evaluated once. Sums are taken with what is subtracted last; `ordered`
    takes sums and products as sympy prints them, which the bounds of rounded outputs rely on.

    Raises
    ------
    WrongType
        It has a symbol without a value, or a function or number that the arithmetic has not.

    Examples
    --------
    >>> x, y = sp.symbols("x y")
    >>> evaluated([sp.cos(x) ** 2 / 3 - y], {"x": 0, "y": 1}, float, {"cos": np.cos})
    [np.float64(-0.6666666666666667)]
    """

    @cache
    def value(node: Any) -> Any:
        if node.is_Symbol and node.name in named:
            return named[node.name]
        if node.is_Integer:
            return number(int(node))
        if node.is_Rational:
            return number(int(node.p)) / number(int(node.q))
        if node.is_Add:
            # Differences, not sums of negated terms: each negation is one more series to propagate
            negative = {term: term.could_extract_minus_sign() for term in node.args}
            last = sorted(node.args, key=negative.__getitem__)
            first, *others = node.as_ordered_terms() if ordered else last
            total = value(first)
            for term in others:
                total = total - value(-term) if negative[term] else total + value(term)
            return total
        if node.is_Mul:
            return product(node)
        if _is_power(node):
            return power(node.base, node.exp)
        if node.func.__name__ in functions:
            return functions[node.func.__name__](*map(value, node.args))
        raise WrongType(f"{node} is not what can be computed here")

    def product(node: Any) -> Any:
        if node.could_extract_minus_sign():
            return -value(-node)
        # Reciprocals are gathered into one true division: x * (1/y) would round twice.
        above, below = [], []
        for factor in node.as_ordered_factors() if ordered else node.args:
            if _is_power(factor) and factor.exp.p < 0:
                below.append(power(factor.base, -factor.exp))
            else:
                above.append(value(factor))
        whole = reduce(operator.mul, above) if above else number(1)
        return whole / reduce(operator.mul, below) if below else whole

    def power(base: Any, exponent: Any) -> Any:
        if exponent.p < 0:
            return number(1) / power(base, -exponent)
        root = value(base) if exponent.q == 1 else functions["sqrt"](value(base))
        return root if exponent.p == 1 else root ** int(exponent.p)

    return [value(sp.sympify(expression)) for expression in expressions]


def exact_values(expressions: Sequence[Any], named: Mapping[str, Exact]) -> list[Exact]:
    """Return the exact values of expressions, given those of their symbols by name.

    >>> float(exact_values([sp.cos(sp.Symbol("x")) ** 2], {"x": Exact.of("pi/3")})[0])
    0.25
    """
    return evaluated(expressions, named, Exact.of, {"sin": exact.sin, "cos": exact.cos})


def exact_texts(expressions: Sequence[Any], named: Mapping[str, Exact], ctx: Context) -> list[str]:
    """Return the exact values of expressions, each rounded once to a text of `ctx`'s digits."""
    return [ctx.nstr(x.mpf(ctx), ctx.dps) for x in exact_values(expressions, named)]


class Rounded:
    """Expressions as functions of exact numbers, each value rounded once to the nearest double.

    They are evaluated in balls of 128 bits. Where the two ends of a ball are not rounded to the
    same double, as where a value is zero by an identity, exact numbers decide.

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
        with working(_BITS):
            self._function = lambdified(self.expressions, self.names, _ball, _BALLS)

    def __call__(self, named: Mapping[str, Exact]) -> list[float]:
        """Return the values at exact numbers, given by the names of the symbols."""
        with working(_BITS):
            values = self._function(*[ball_of(named[name]) for name in self.names])
            zero = _ball(0)
            balls = [x + zero for x in values]  # a plain 0 may be among them
            ends = [(float(x.lower()), float(x.upper())) for x in balls]
        told = [low == high and isfinite(low) for low, high in ends]
        rest = [e for e, known in zip(self.expressions, told, strict=True) if not known]
        exactly = map(float, exact_values(rest, named))
        pairs = zip(ends, told, strict=True)
        return [high + 0.0 if known else next(exactly) for (_, high), known in pairs]


_BITS: Final = 128
_BALLS: Functions = {
    name: operator.methodcaller(name) for name in ("sin", "cos", "sqrt")
}  # those of python-flint


def _ball(integer: int) -> Any:
    return Exact.of(integer).ball(_BITS)


def _is_power(node: Any) -> bool:
    """Tell whether it is a power by a whole or half number."""
    return bool(node.is_Pow and node.exp.is_Rational and node.exp.q <= 2)
