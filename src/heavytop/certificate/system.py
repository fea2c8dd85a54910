"""Equations of motion with quadratic right-hand sides, in balls and in floats, and bounds of balls.

    y_i' = sum over terms of  coefficient * y_j * y_k,

where a factor may be 1: the axis and the attitude form are of this shape. The mean of the Jacobian
between two states is its value half way between them, exactly: this is what makes the bounds of
this package sharp.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

import numpy as np
import sympy as sp
from flint import arb, arb_mat, arb_poly

from heavytop.equations.formulation import Formulation
from heavytop.exact.pairs import UNIT, Array, double_double

UP: Final = 1 + 1e-12  # factor that covers the rounding of a sum of positive terms
_POWER: Final = 4  # squarings: a norm is bounded by tr((S^T S)^16)^(1/32), at most 1.06 times it
UNIT_FACTOR: Final = -1  # the place of a factor that is 1, behind all states


class CertifiedForm(NamedTuple):
    """The properties of a formulation that certificates need.

    Attributes
    ----------
    read : int
        The number of states, the first ones, from which outputs are computed.
    pairs : mapping
        Pairs of states that rotate: the multiples, 0 or 1, of the angles of alpha and of beta.
    angles : tuple of str
        The angles that follow, with all turns, from the arguments of pairs.
    rest : float
        A bound of the rounding error of an angle beyond half a unit in the last place of its turns
        [rad]: of an argument, or a sum of two, that is added to whole turns, and of the angles of
        the rounded start against those that the run begins with.
    """

    read: int
    pairs: Mapping[tuple[int, int], tuple[int, int]]
    angles: tuple[str, ...]
    rest: float


CERTIFIED: Final[Mapping[str, CertifiedForm]] = {
    "axis": CertifiedForm(3, {(0, 1): (1, 1), (3, 4): (1, 1)}, ("phi",), 9 * UNIT),
    "attitude": CertifiedForm(
        4, {(0, 3): (1, 0), (1, 2): (0, 1), (4, 5): (1, 1)}, ("phi", "psi"), 20 * UNIT
    ),
}
"""The formulations that can be certified; `heavytop.certificate.bounds` has their outputs."""


class Term(NamedTuple):
    """coefficient * y[first] * y[second]; `UNIT_FACTOR` stands for a factor 1."""

    coefficient: float
    first: int
    second: int


class QuadraticSystem(NamedTuple):
    """The terms of each right-hand side, and the weight of each state in the norm of errors.

    Attributes
    ----------
    terms : tuple of tuple of Term
        The terms of each right-hand side; the coefficients are exact.
    weights : tuple of float
        Powers of two: the norm of an error is the Euclidean norm of weight times error.
    """

    terms: tuple[tuple[Term, ...], ...]
    weights: tuple[float, ...]

    @classmethod
    def of(cls, form: Formulation, constants: Mapping[str, float], rate: float) -> QuadraticSystem:
        """Return the equations of a form with the constants of a run.

        Parameters
        ----------
        form : Formulation
        constants : mapping from str to float
            By the names of their symbols; each is exactly the double.
        rate : float
            By which states that are rates are divided in the norm [1/s].

        Raises
        ------
        ValueError
            A right-hand side is not quadratic, or a coefficient is no double.
        """
        exact = {sp.Symbol(name, real=True): sp.Rational(x) for name, x in constants.items()}
        terms = tuple(tuple(_terms(x.subs(exact), form.states)) for x in form.derivatives)
        return cls(terms, tuple(1 / rate if each else 1.0 for each in form.is_rate))

    def rates(self, y: Sequence[Any], one: Any) -> list[Any]:
        """Return the right-hand sides at a state: balls, polynomials of time, or arrays."""
        y = [*y, one]  # the last is `UNIT_FACTOR`
        return [sum((c * y[j] * y[k] for c, j, k in row), 0 * one) for row in self.terms]

    def taylor(self, start: Sequence[arb], order: int) -> list[list[arb]]:
        """Return the Taylor coefficients of the solution through a state, as balls."""
        rows = [[x] for x in start]
        y = [*rows, [arb(1)]]
        for n in range(order):
            for known, row in zip(rows, self.terms, strict=True):
                rate = arb(0)
                for c, j, k in row:  # of a 1, `y` has the coefficient of order 0 alone
                    rate += c * sum(map(arb.__mul__, y[j], y[k][n::-1]), arb(0))
                known.append(rate / (n + 1))
        return rows

    def jacobian(self, y: Sequence[arb]) -> arb_mat:
        """Return the Jacobian at a state, in the weighted norm."""
        n, y, weights = len(self.terms), [*y, arb(1)], [*self.weights, 1.0]
        entries = [[arb(0)] * (n + 1) for _ in range(n)]
        for i, row in enumerate(self.terms):
            for c, j, k in row:
                for own, other in ((j, k), (k, j)):
                    entries[i][own] += c * y[other] * (weights[i] / weights[own])
        return arb_mat([row[:n] for row in entries])

    def norm(self, y: Sequence[arb]) -> arb:
        """Return an upper bound of the norm of a vector of balls."""
        squares = ((w * upper(abs(x))) ** 2 for w, x in zip(self.weights, y, strict=True))
        return upper(upper(sum(squares, arb(0))).sqrt())

    def norms(self, y: Array) -> Array:
        """Return upper bounds of the norms of vectors of shape (n, k), in doubles."""
        squares = (np.array(self.weights)[:, None] * y) ** 2
        return np.asarray(UP * np.sqrt(squares.sum(axis=0)))


def _terms(expression: Any, states: Sequence[Any]) -> Iterator[Term]:
    """Yield the terms of a quadratic function of states, which has no constant one."""
    found = sp.Poly(expression, *states)
    for powers, coefficient in () if found.is_zero else found.terms():
        factors = [i for i, power in enumerate(powers) for _ in range(power)]
        if len(factors) not in (1, 2) or sp.Rational(float(coefficient)) != coefficient:
            raise ValueError(f"{expression}: not quadratic, or a coefficient is no double")
        yield Term(float(coefficient), *[UNIT_FACTOR] * (2 - len(factors)), *factors)


# --- balls, matrices and polynomials of balls ----------------------------------------------------


class TooCoarse(ArithmeticError):
    """More bits, or a higher order, are needed."""


def upper(x: arb) -> arb:
    """Return the upper end of a ball, as a ball without radius."""
    return arb(x.upper())


def operator_norm(matrix: arb_mat) -> arb:
    """Return an upper bound of the Euclidean norm of a matrix: at most 1.06 times it."""
    power = matrix.transpose() * matrix
    for _ in range(_POWER):
        power = power * power
    return upper(upper(power.trace()).root(2 ** (_POWER + 1)))


def hull(q: arb_poly, reach: arb) -> arb:
    """Return a ball that contains the values of a polynomial from 0 to `reach`."""
    return q[0] + arb(0, sup(q, reach, 1))


def sup(q: arb_poly, reach: arb, first: int = 0, last: int | None = None) -> arb:
    """Return an upper bound of a polynomial from 0 to `reach`, of some of its terms."""
    terms = [abs(c) * reach**k for k, c in enumerate(q.coeffs())]
    return upper(sum(terms[first:last], arb(0)))


def upper_double(x: arb) -> float:
    """Return a double that is not below a ball; inf where the ball is not finite."""
    high = float(x.upper())
    return math.inf if math.isnan(high) else math.nextafter(high, math.inf)


def pair(x: arb) -> tuple[float, float]:
    """Return a ball as a double-double.

    Raises
    ------
    TooCoarse
        It is too wide for one.
    """
    if not float(x.rad()) <= 1e-30 * (1 + abs(float(x.mid()))):
        raise TooCoarse("a number that is not known well enough")
    return double_double(x)
