"""Turns of phi and psi in a run of more than doubles: counted in doubles along its own steps.

A run in doubles that comes near a separatrix has lost its phase there, and would pass a pole a
turn too often or too seldom. So turns are counted on the steps whose digits they belong to. Near
a pole a rounded state keeps its relative digits, and the constants of the motion say the rest.
What is less than a turn is read off the states themselves, to all their digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from heavytop.integration.turns import Pair, Turns, arm_rates
from heavytop.integration.winding import MOST_POINTS, More, Winding, distinct

Array = NDArray[np.float64]
Reals: TypeAlias = Any  # an array of heyoka's reals
Told = tuple[float, float]
Row = Sequence[Any]

NOT_TOLD: Final = (math.nan, math.nan)
GRAIN_BITS: Final = 24  # of a state that rounding may have spoilt
FITTING: Final = 5.7  # radians between the bounds of a change, so that one value fits
MOST_PARTS: Final = 8  # of a step, before its turns are told by where it goes


@dataclass(frozen=True, slots=True)
class FollowingAxis:
    """Phi of the axis; psi is not told."""

    winding: Winding

    def parts(self, length: float, most: int | None = None) -> int:
        """Return into how many parts a time is divided [s], for turns to be told in each.

        Where bounds would take more parts than `most`, they are as many; 0 without `most`.
        """
        parts = (self.winding.fastest - self.winding.slowest) * abs(length) / FITTING
        return max(1, math.ceil(parts)) if parts < (most or MOST_PARTS) else most or 0

    def followed(self, t: Array, rows: Array, first: Told, more: More | None) -> Array:
        """Return phi and nan at some times, shape (k, 2), from phi at the first [rad]."""
        started = self.winding.started(rows[0], first[0])
        phi = self.winding.on_branch(rows, started + self.winding.turned(t, rows, more))
        return np.stack((phi, np.full(t.size, math.nan)), axis=-1)

    def read(self, rows: Reals, told: Array, known: Mapping[str, Any], grain: Any) -> list[Reals]:
        """Return phi, to the digits of the states; where the axis stays on a pole, the start's."""
        x, y, z, p, q = rows.T[:5]
        l_z, own = known["l_z"], np.where(z > 0, known["P_minus"], known["P_plus"])
        rate, fastest = (p * z - l_z * x, q * z - l_z * y), _fastest(p, q, known)
        phi, rests, passing = _argument((-y, x), rate, own, fastest, grain)
        return [_nearest(np.where(rests, known["phi_0"], phi), told[:, 0], passing, grain)]


@dataclass(frozen=True, slots=True)
class FollowingAttitude:
    """Phi and psi, less its uniform part, of the quaternion; `apart` is decided at once [s]."""

    turns: Turns
    apart: float

    def parts(self, length: float, most: int | None = None) -> int:
        """Return into how many parts a time is divided [s]."""
        return max(1, math.ceil(min(abs(length) / self.apart, MOST_POINTS)))

    def followed(self, t: Array, rows: Array, first: Told, more: More | None) -> Array:
        """Return phi and psi at some times, shape (k, 2), from those at the first [rad]."""
        return self.turns.followed(t, rows, first)

    def read(self, rows: Reals, told: Array, known: Mapping[str, Any], grain: Any) -> list[Reals]:
        """Return phi and psi, less its uniform part, to the digits of the states."""
        q_0, q_1, q_2, q_3, p, q = state = rows.T[:6]
        for_alpha, for_beta = arm_rates(state, known["l_z"])
        fastest = _fastest(p, q, known)
        a, a_rests, a_passing = _argument(
            (q_0, q_3), for_alpha, known["P_plus"] / 4, fastest, grain
        )
        b, b_rests, b_passing = _argument(
            (q_1, q_2), for_beta, known["P_minus"] / 4, fastest, grain
        )
        a = np.where(a_rests, known["phi_0"] - b, a)  # on the vertical phi is that of the start
        b = np.where(b_rests, known["phi_0"] - a, b)
        passing = a_passing | b_passing
        return [
            _nearest(x, near, passing, grain)
            for x, near in ((a + b, told[:, 0]), (a - b, told[:, 1]))
        ]


Following: TypeAlias = FollowingAxis | FollowingAttitude


def _fastest(l_x: Reals, l_y: Reals, known: Mapping[str, Any]) -> Reals:
    return np.sqrt(l_x * l_x + l_y * l_y + known["l_z"] ** 2 + 8 * abs(known["g"]))


def _argument(z: Pair, rate: Pair, momentum: Any, fastest: Reals, grain: Any) -> tuple[Any, ...]:
    """Return the argument of z, where it vanishes and stays, and where it is that of a pass.

    In a pass that the state does not tell, having another angular momentum than it should, it
    is what it was before or will be after, which are half a turn apart.
    """
    (x, y), (p, q) = z, rate
    size, speed = np.sqrt(x * x + y * y), np.sqrt(p * p + q * q)
    drifted = abs(x * q - y * p - momentum) >= abs(momentum) / 2
    passing = drifted & (size < grain) & (size * fastest <= speed)
    passing &= 2 * abs(momentum) < grain * speed
    side = np.where(x * p + y * q < 0, -1.0, 1.0)
    argument = np.arctan2(np.where(passing, side * q, y), np.where(passing, side * p, x))
    return argument, (size == 0) & (speed == 0), passing


def _nearest(principal: Reals, near: Array, passing: Any, grain: Any) -> Reals:
    """Return the angle nearest to another one, in doubles, of those whole turns apart.

    In a pass they are half turns apart: which side of it, the other angle says.
    """
    turn, step = 2 * np.arctan2(grain - grain, -grain), np.where(passing, 0.5, 1.0)
    turns = np.round((near - principal.astype(np.float64)) / (2 * np.pi * step))
    return principal + turn * (step * turns)


class Trail:
    """The states of some steps, in doubles, and phi and psi there.

    Times are since the first of them [s]; `told` has the angles that were asked for, `last` those
    at the end of the last step, and `dense` returns the state at a time since that end.
    """

    def __init__(
        self, following: Following, row: Row, first: Told, dense: Callable[[float], Row]
    ) -> None:
        self.following, self.last, self._dense = following, first, dense
        self.told: dict[int, Told] = {}
        self._t, self._rows = [0.0], [_rounded(row)]
        self._seen: list[tuple[int, float]] = []

    def step(
        self, end: float, length: float, row: Row, inside: Sequence[tuple[int, float, Row]]
    ) -> None:
        """Add a step: its end, its length, its last state and what is asked for inside it."""
        parts = self.following.parts(length)
        if parts == 0:  # close to a pole, perhaps: told while it can be divided
            self.tell()
        for key, t, seen in inside:
            self._add(t, seen)
            self._seen.append((key, t))
        for k in range(1, parts):
            before = -length * (1 - k / parts)
            self._add(end + before, self._dense(before))
        self._add(end, row)
        if parts == 0:
            self.tell(lambda t: np.array([_rounded(self._dense(x - end)) for x in t.tolist()]))

    def tell(self, more: More | None = None) -> None:
        """Tell the angles at everything added."""
        if len(self._t) == 1:
            return
        forward = math.copysign(1.0, self._t[-1])
        unique, where = distinct(forward * np.array(self._t))
        rows = np.array(self._rows)[where]
        angles = self.following.followed(forward * unique, rows, self.last, more)
        for key, t in self._seen:
            phi, psi = angles[np.searchsorted(unique, forward * t)].tolist()
            self.told[key] = (phi, psi)
        phi, psi = angles[-1].tolist()
        self.last, self._seen = (phi, psi), []
        self._t, self._rows = [forward * float(unique[-1])], [rows[-1].tolist()]

    def _add(self, t: float, row: Row) -> None:
        self._t.append(t)
        self._rows.append(_rounded(row))


def _rounded(row: Row) -> list[float]:
    return [float(x) for x in row]
