"""Balls, matrices and polynomials of balls: upper bounds, and numbers of two doubles."""

from __future__ import annotations

import math
from typing import Final

from flint import arb, arb_mat, arb_poly

_POWER: Final = 4  # squarings: a norm is bounded by tr((S^T S)^16)^(1/32), at most 1.06 times it


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
    """Return a ball that holds the values of a polynomial from 0 to `reach`."""
    return q[0] + arb(0, sup(q, reach, 1))


def sup(q: arb_poly, reach: arb, first: int = 0, last: int | None = None) -> arb:
    """Return an upper bound of a polynomial from 0 to `reach`, of some of its terms."""
    terms = [abs(c) * reach**k for k, c in enumerate(q.coeffs())]
    return upper(sum(terms[first:last], arb(0)))


def up(x: arb) -> float:
    """Return a double that is not below a ball: inf of one that says nothing."""
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
    high = float(x.mid())
    return high, float((x - high).mid())
