"""Taylor polynomials of a precise run, cut to doubles: the motion at many times at once.

Each polynomial is in x, the fraction of its step, and is cut where doubles no longer feel it. A
polynomial that starts at a turning point keeps the relative digits of alpha and beta, however
close to a pole, because there each term is small by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
CUT = 2.0**-60  # of the largest term


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """One step in doubles.

    Attributes
    ----------
    start, length : float
        When it starts, and how long it is [s].
    terms : ndarray, shape (order + 1, 6)
        Of q_0 ... q_3, l_x, l_y as polynomials in the fraction of the step.
    senses : tuple of float
        In which the arguments of alpha and beta turn, 1 or -1.
    turned : tuple of float
        By how much they have turned at the start [rad], since the run did.
    """

    start: float
    length: float
    terms: Array
    senses: tuple[float, float]
    turned: tuple[float, float]

    def at(self, t: Array) -> tuple[Array, Array]:
        """Return states, shape (6, k), and turned arguments, shape (2, k) [rad]."""
        x = (t - self.start) / self.length
        states = np.repeat(self.terms[-1][:, None], t.size, axis=1)
        for term in self.terms[-2::-1]:
            states *= x
            states += term[:, None]
        q_0, q_1, q_2, q_3 = states[:4]
        arms = zip(((q_0, q_3), (q_1, q_2)), self.senses, self.turned, strict=True)
        return states, np.stack([_turned(*each) for each in arms])


def _turned(arm: tuple[Array, Array], sense: float, turned: float) -> Array:
    """Return an argument that has turned, since the start of a step, by less than pi."""
    x, y = arm
    c, s = np.cos(turned), np.sin(turned)
    change = np.arctan2(c * y - s * x, c * x + s * y)
    change += sense * 2 * np.pi * (sense * change < -np.pi / 2)
    # On the pole itself: what it will be.
    return turned + np.where((x == 0) & (y == 0), sense * np.pi / 2, change)


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


def followed(seen: Sequence[Sequence[float]], senses: tuple[float, float]) -> Array:
    """Return the arguments of alpha and beta with their turns, shape (k, 2) [rad].

    From each to the next they change by less than pi, in the given senses.
    """
    angles, sense = np.array(seen), np.array(senses)
    change = np.diff(angles, axis=0)
    change -= 2 * np.pi * np.round(change / (2 * np.pi))
    change += sense * 2 * np.pi * (sense * change < -np.pi / 2)
    counted = np.concatenate((angles[:1], angles[0] + np.cumsum(change, axis=0)))
    turned: Array = angles + 2 * np.pi * np.round((counted - angles) / (2 * np.pi))
    return turned
