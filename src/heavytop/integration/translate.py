"""From sympy to heyoka, with every constant exact at the working precision.

heyoka's own converter refuses thirds and rounds sympy's Floats to double, silently. Here every
subtree without symbols is evaluated once, at more than the working precision, and rounded once.
Common subexpressions are translated once: sympy shares equal nodes, and heyoka shares equal
expressions in its decomposition.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from functools import reduce
from typing import Any

import heyoka as hy
import sympy as sp

from heavytop.errors import UntranslatableExpression

DOUBLE = 53
MOST_CACHED = 256 * 2**20  # bytes of compiled code that heyoka keeps on disk: some hundred programs
_HEYOKAS_OWN = 20 * 2**30  # its limit where nobody has set one

hy.set_logger_level_critical()  # heyoka logs to stdout, which belongs to the results
if hy.llvm_state.get_diskcache_limit() == _HEYOKAS_OWN:
    hy.llvm_state.set_diskcache_limit(MOST_CACHED)

_FUNCTIONS = {sp.sin: hy.sin, sp.cos: hy.cos, sp.exp: hy.exp, sp.log: hy.log}


def translate(
    expressions: Sequence[Any], names: Mapping[Any, Any], precision: int = DOUBLE
) -> list[Any]:
    """Return the heyoka counterparts of sympy expressions.

    Parameters
    ----------
    expressions : sequence of sympy expressions
    names : mapping from sympy symbol to heyoka expression
        States as variables, constants of a run as ``par[i]``.
    precision : int
        Working precision [bits] at which constants are rounded, once; 53 is double.

    Raises
    ------
    UntranslatableExpression
        A symbol without a name or a function without a counterpart; the message names the
        subexpression and the expression it stands in.

    Examples
    --------
    >>> x = sp.Symbol("x")
    >>> translate([x / 3 + sp.sqrt(2)], {x: hy.expression("x")})
    [(1.4142135623730951 + (0.33333333333333331 * x))]
    """
    known: dict[Any, Any] = dict(names)
    translated = []
    for expression in expressions:
        try:
            translated.append(_translated(sp.sympify(expression), known, precision))
        except _NoCounterpart as fault:
            raise UntranslatableExpression(
                f"{fault.args[0]} in {expression} has no counterpart in heyoka"
            ) from None
    return translated


class _NoCounterpart(Exception):
    pass


def _translated(node: Any, known: dict[Any, Any], precision: int) -> Any:
    if node not in known:
        known[node] = _fresh(node, known, precision)
    return known[node]


def _fresh(node: Any, known: dict[Any, Any], precision: int) -> Any:
    if not node.free_symbols:
        return constant(node, precision)
    arguments = node.args
    if node.is_Pow:
        return _power(node, known, precision)
    if node.is_Mul:
        return _product(node, known, precision)
    if node.is_Add:
        return _sum(node, known, precision)
    operands = [_translated(argument, known, precision) for argument in arguments]
    if node.func in _FUNCTIONS:
        return _FUNCTIONS[node.func](*operands)
    raise _NoCounterpart(str(node))


def _sum(node: Any, known: dict[Any, Any], precision: int) -> Any:
    # Differences, not sums with negated terms: each negation is one more series to propagate.
    terms = sorted(node.args, key=lambda term: term.could_extract_minus_sign())
    total = _translated(terms[0], known, precision)
    for term in terms[1:]:
        if term.could_extract_minus_sign():
            total = total - _translated(-term, known, precision)
        else:
            total = total + _translated(term, known, precision)
    return total


def _product(node: Any, known: dict[Any, Any], precision: int) -> Any:
    if node.could_extract_minus_sign():
        return -_translated(-node, known, precision)
    # Reciprocals are gathered into one true division: x * (1/y) would round twice.
    below = [f for f in node.args if f.free_symbols and _is_reciprocal(f)]
    above = [f for f in node.args if f not in below]
    product = reduce(
        operator.mul, (_translated(f, known, precision) for f in above), hy.expression(1.0)
    )
    if below:
        inverse = [_translated(1 / f, known, precision) for f in below]
        product = product / reduce(operator.mul, inverse)
    return product


def _is_reciprocal(factor: Any) -> bool:
    return bool(factor.is_Pow and factor.exp.is_Rational and factor.exp < 0)


def _power(node: Any, known: dict[Any, Any], precision: int) -> Any:
    base, exponent = node.args
    if exponent.is_Rational and exponent < 0:
        return hy.expression(1.0) / _translated(base**-exponent, known, precision)
    operand = _translated(base, known, precision)
    if exponent.is_Integer:
        return operand ** float(exponent)
    if exponent.is_Rational and exponent.q == 2:
        root = hy.sqrt(operand)
        return root if exponent.p == 1 else root ** float(exponent.p)
    raise _NoCounterpart(str(node))


def constant(node: Any, precision: int) -> Any:
    """Return a number as a heyoka expression, rounded once to the working precision [bits]."""
    if not node.is_real or not node.is_finite:
        raise _NoCounterpart(str(node))
    if precision == DOUBLE:
        return hy.expression(float(_digits(node, 40)))
    digits = int(precision * 0.30103) + 10
    return hy.expression(hy.real(str(_digits(node, digits)), precision))


def _digits(node: Any, digits: int) -> Any:
    if node.is_Rational:
        return sp.Rational(node).n(digits)
    value = node.evalf(digits, strict=True)  # refuses rather than returns fewer digits
    if not value.is_Float:
        raise _NoCounterpart(str(node))
    return value
