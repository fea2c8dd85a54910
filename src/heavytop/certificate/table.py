"""A solution as a table of polynomials, proved piece by piece, from a start up to some time.

On each piece the solution is known by a Taylor polynomial in balls, p, and by a bound of its
distance from p: with the defect D = sup |p' - f(p)| and the logarithmic norm m of the Jacobian, a
distance a at the start of a piece becomes at most

    a exp(m s) + D (exp(m s) - 1)/m        (Dahlquist 1958, Lozinskii 1958).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from flint import arb, arb_poly

from heavytop.certificate.system import (
    QuadraticSystem,
    TooCoarse,
    hull,
    operator_norm,
    pair,
    sup,
    upper,
    upper_double,
)
from heavytop.exact.pairs import UNIT, Words, add, multiply

KEPT_COEFFICIENTS: Final = 12  # of each piece, in doubles
LEADING_COEFFICIENTS: Final = 3  # of these, kept as double-doubles
MARGIN: Final = 1e-4  # distance from the solution within which the bounds hold
TABLE_ERROR: Final = 1e-27  # largest error of the table, relative to the size of the states,
LOST_IN_PAIRS: Final = 1e-18  # and of double-doubles read from it
WIDER: Final = 1 + 2.0**-20  # factor for the length of a piece over which bounds hold
BESIDE: Final = 1e-7  # of a piece: times may be so far outside of the table
MOST_PIECES: Final = 100_000


class Bounds(NamedTuple):
    """Bounds along the solution, and within `MARGIN` of it, in the norm of the system.

    Attributes
    ----------
    growth : float
        Of the logarithmic norm of the Jacobian: the rate at which an error can grow.
    jacobian : float
        Of the norm of the Jacobian: the rate at which an error can change.
    speed : float
        Of the right-hand side.
    size : float
        Of the state.
    """

    growth: float
    jacobian: float
    speed: float
    size: float


class Piece(NamedTuple):
    """A piece of the table: a polynomial for each state, a bound of their error, `Bounds`."""

    p: list[arb_poly]
    error: arb
    bounds: list[float]


class SolutionTable:
    """The solution through a start, at the working precision.

    Parameters
    ----------
    system : QuadraticSystem
    start : sequence of float
        The state at time 0: exactly these doubles.
    span : float
        The last time of the table, which reaches a little farther.
    order : int
        The order of the polynomials.
    fine : int
        The number of pieces per radian of the fastest rotation at the start; later rotations may
        be faster.

    Attributes
    ----------
    piece : float
        The length of a piece.
    reach : arb
        The length over which its polynomial holds, a little more.
    pieces : list of Piece
    bounds : Bounds
    lost : float
        A bound of the error of `at`, in the norm.

    Raises
    ------
    TooCoarse
        The solution is not known well enough.
    """

    def __init__(
        self, system: QuadraticSystem, start: Sequence[float], span: float, order: int, fine: int
    ) -> None:
        self.system, self.order = system, order
        x, error = [arb(v) for v in start], arb(0)
        fastest = float(operator_norm(system.jacobian(x))) or 1.0
        self.piece = 2.0 ** -math.ceil(math.log2(fine * fastest))
        self.reach = arb(self.piece) * WIDER
        count = math.ceil(span / self.piece) + 1
        if count > MOST_PIECES:
            raise TooCoarse(f"more than {MOST_PIECES} pieces in a period")
        self.pieces: list[Piece] = []
        for _ in range(count):
            piece = self._solve(x, error)
            self.pieces.append(piece)
            y = [q(arb(self.piece)) for q in piece.p]
            x = [arb(v.mid()) for v in y]
            error = upper(piece.error + system.norm([v - w for v, w in zip(y, x, strict=True)]))
        self.bounds = Bounds(*np.max([each.bounds for each in self.pieces], axis=0).tolist())
        self.lost = max(upper_double(each.error + self._truncation(each.p)) for each in self.pieces)
        worst = max(upper_double(each.error) for each in self.pieces) / TABLE_ERROR
        if not max(worst, self.lost / LOST_IN_PAIRS) <= self.bounds.size:
            raise TooCoarse("the table")
        self._store()

    def _solve(self, x: list[arb], error: arb) -> Piece:
        """Solve the equations in one piece."""
        system, reach = self.system, self.reach
        p = [arb_poly(row) for row in system.taylor(x, self.order)]
        margins = (arb(0, MARGIN / w) for w in system.weights)
        here = [hull(q, reach) + margin for q, margin in zip(p, margins, strict=True)]
        jacobian, field = system.jacobian(here), system.rates(here, arb(1))
        f = system.rates(p, arb_poly([1]))
        growth = operator_norm((jacobian + jacobian.transpose()) / 2)  # a logarithmic norm is less
        defect = system.norm([sup(q.derivative() - g, reach) for q, g in zip(p, f, strict=True)])
        grow = (growth * reach).exp()
        error = upper(error * grow + defect * ((grow - 1) / growth if growth > 0 else reach))
        if not error < MARGIN:
            raise TooCoarse("the error of the table grows too fast")
        largest = growth, operator_norm(jacobian), system.norm(field), system.norm(here)
        return Piece(p, error, [upper_double(x) for x in largest])

    def _truncation(self, p: Sequence[arb_poly]) -> arb:
        """Return a bound of the terms that `at` leaves out of polynomials, and of its rounding."""
        kept, lead, reach = KEPT_COEFFICIENTS, LEADING_COEFFICIENTS, self.reach
        rounding = 4 * kept * UNIT
        lost = (sup(q, reach, kept) + rounding * sup(q, reach, lead, kept) for q in p)
        return self.system.norm([*lost])

    def _store(self) -> None:
        """Keep the polynomials as doubles; axes: order, then word, then state and piece."""
        states = [*zip(*(piece.p for piece in self.pieces), strict=True)]
        orders = [[[q[k] for q in state] for state in states] for k in range(KEPT_COEFFICIENTS)]
        lead, rest = orders[:LEADING_COEFFICIENTS], orders[LEADING_COEFFICIENTS:]
        pairs = np.array([[[pair(c) for c in row] for row in order] for order in lead])
        self._lead = np.ascontiguousarray(np.moveaxis(pairs, 3, 1))
        self._rest = np.array(rest).astype(np.float64)

    def ball(self, t: arb) -> list[arb]:
        """Return the solution at a time within the table, in balls."""
        j = min(int(float((t / self.piece).mid())), len(self.pieces) - 1)
        since, piece = t - j * arb(self.piece), self.pieces[j]
        off = (arb(0, upper(piece.error / w)) for w in self.system.weights)
        return [q(since) + each for q, each in zip(piece.p, off, strict=True)]

    def at(self, t: Words) -> Words:
        """Return the solution at times, shape (k,), both in words: high and low, shape (n, k)."""
        j = np.clip(np.floor(t[0] / self.piece), 0, len(self.pieces) - 1).astype(np.intp)
        begun = np.asarray(-self.piece * j, dtype=np.float64)
        s = add(t, (begun, np.zeros_like(begun)))
        if not np.all((s[0] > -BESIDE * self.piece) & (s[0] < self.piece * (1 + BESIDE))):
            raise ArithmeticError("a time outside of the table")
        q = self._rest[-1][:, j]
        for c in self._rest[-2::-1]:
            q = q * s[0] + c[:, j]
        x = q, np.zeros_like(q)
        for c_high, c_low in self._lead[::-1]:
            x = add((c_high[:, j], c_low[:, j]), multiply(x, s))
        return x
