"""Expressions as a book would write them: gathered by moments and factored, value unchanged."""

from __future__ import annotations

from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations import reduction
from heavytop.equations.lagrangian import A, C, gMR
from heavytop.equations.reduction import E_prime, p_phi, p_psi, u


def by_moments(expression: Any) -> Any:
    """Return a fraction that is linear in A, C and gMR above the bar, gathered by each of them.

    Raises
    ------
    ArithmeticError
        The expression is not of that kind.

    Examples
    --------
    >>> print(by_moments(sp.expand(lag.kinetic_energy())))
    A*(phidot**2*sin(theta)**2 + thetadot**2)/2 + C*(phidot*cos(theta) + psidot)**2/2
    """
    above, below = sp.fraction(sp.cancel(sp.together(expression)))
    content, factors = sp.factor_list(above)
    sums = sp.Mul(*(factor**power for factor, power in factors if factor.is_Add))
    outside = content / below
    outside *= sp.Mul(*(factor**power for factor, power in factors if not factor.is_Add))
    return _same(expression, _spread(outside, sp.expand(sums)))


def _spread(outside: Any, inside: Any) -> Any:
    """Return outside times the gathered sum; a bare number goes to each of its terms."""
    if not inside.free_symbols & {A, C, gMR}:
        return outside * _shortest(inside)
    number = outside if outside.is_Number else sp.Integer(1)
    parts = ((p, _shortest(number * inside.coeff(p))) for p in (A, C, gMR))
    terms = (_sign_inside(parameter * coefficient) for parameter, coefficient in parts)
    return outside / number * sum(terms, sp.Integer(0))


def _shortest(coefficient: Any) -> Any:
    """Return the coefficient in sines or in cosines, whichever factors into less."""
    sines = lag.normal_form(coefficient)
    cosines = sp.expand(sines.subs(sp.sin(lag.theta) ** 2, 1 - sp.cos(lag.theta) ** 2))
    return min((sp.factor(form) for form in (sines, cosines)), key=sp.count_ops)


def _sign_inside(product: Any) -> Any:
    """Return -(a - b) as (b - a), and (-a - b) as -(a + b)."""
    number, rest = product.as_coeff_Mul()
    sums = [factor for factor in sp.Mul.make_args(rest) if factor.is_Add]
    if len(sums) != 1:
        return product
    negative = {_leading(term) < 0 for term in sums[0].args}
    if negative == {True} or (number < 0 and negative == {True, False}):
        return -number * (rest / sums[0]) * sp.expand(-sums[0])
    return product


def _leading(term: Any) -> Any:
    return term.as_coeff_Mul()[0]


def cubic() -> Any:
    """Return f(u) as energy, weight and the square of the momenta's difference.

    Examples
    --------
    >>> print(cubic())
    2*(1 - u**2)*(E_prime - gMR*u)/A - (p_phi - p_psi*u)**2/A**2
    """
    book = sp.Mul(2, E_prime - gMR * u, 1 - u**2, 1 / A) - (p_phi - p_psi * u) ** 2 / A**2
    return _same(reduction.cubic(), book)


def _same(derived: Any, written: Any) -> Any:
    """Return what is written, when it equals what was derived."""
    above, _ = sp.fraction(sp.together(derived - written))
    if lag.normal_form(above) != 0:
        raise ArithmeticError(f"{written} is not {derived}")
    return written
