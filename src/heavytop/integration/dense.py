"""Taylor polynomials of a precise run, cut to doubles: the motion at many times at once.

Each polynomial is in x, the fraction of its step, and is cut where doubles no longer feel it. A
polynomial that starts at a turning point keeps the relative digits of alpha and beta, however
close to a pole, because there each term is small by itself. Passes are turning points, where steps
begin and end: within one no argument turns by as much as pi (`turns`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CUT = 2.0**-60  # of the largest term
AFTER = 1e-200  # of a step: on a pole itself everything is what it is the moment after


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One step in doubles.

    Attributes
    ----------
    start, length : float
        When it starts, and how long it is [s].
    terms : ndarray, shape (order + 1, 6)
        Of q_0 ... q_3, l_x, l_y as polynomials in the fraction of the step.
    turned : tuple of float
        The arguments of alpha and beta at the start, with their turns [rad].
    """

    start: float
    length: float
    terms: Array
    turned: tuple[float, float]

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return states, shape (6, k), and arguments with their turns, shape (2, k) [rad]."""
        x = np.maximum((t - self.start) / self.length, AFTER)
        states = np.repeat(self.terms[-1][:, None], t.size, axis=1)
        for term in self.terms[-2::-1]:
            states *= x
            states += term[:, None]
        q_0, q_1, q_2, q_3 = states[:4]
        arms = zip(((q_0, q_3), (q_1, q_2)), self.turned, strict=True)
        return states, np.stack([_turned(*each) for each in arms])


def _turned(arm: tuple[Array, Array], turned: float) -> Array:
    """Return an argument that has changed, since the start of a step, by less than pi."""
    (x, y), c, s = arm, np.cos(turned), np.sin(turned)
    change: Array = np.arctan2(c * y - s * x, c * x + s * y)
    return turned + change


@dataclass(frozen=True, slots=True, eq=False)
class Dense:
    """Steps that follow upon each other."""

    pieces: tuple[Piece, ...]
    starts: Array

    @classmethod
    def of(cls, pieces: Sequence[Piece]) -> Dense:
        """Return the steps together."""
        return cls(tuple(pieces), np.array([piece.start for piece in pieces]))

    def piece(self, t: Array) -> NDArray[np.intp]:
        """Return which step holds each time; the last one holds what comes after it."""
        return np.searchsorted(self.starts, t, side="right") - 1

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return states, shape (6, k), and turned arguments, shape (2, k), at times of shape (k,).

        Times are at least zero, and not beyond the last step.
        """
        states, turned = np.empty((6, t.size)), np.empty((2, t.size))
        held = self.piece(t)
        for i in set(held.tolist()):
            here = np.flatnonzero(held == i)
            states[:, here], turned[:, here] = self.pieces[i].at(t[here])
        return states, turned


def cut(coefficients: Any, length: Any) -> Array:
    """Return polynomials in doubles, shape (order + 1, n), from coefficients of shape (n, ...).

    Each is cut, for all alike, where two terms in turn are too small to be felt.
    """
    power, rows = length / length, []
    count, orders = coefficients.shape
    for k in range(orders):
        rows.append([float(coefficients[i, k] * power) for i in range(count)])
        power = power * length
        last = np.abs(rows[-2:])
        if k and (last <= CUT * np.max(np.abs(rows), axis=0)).all():
            break
    return np.array(rows)


def followed(seen: Sequence[Sequence[float]]) -> Array:
    """Return arguments with their turns, shape (k, n) [rad], from what they are modulo a turn.

    From each row to the next they change by less than pi.
    """
    angles = np.array(seen)
    turns = np.cumsum(np.round(np.diff(angles, axis=0) / (2 * np.pi)), axis=0)
    angles[1:] -= 2 * np.pi * turns
    return angles
