"""Monodromy: T, Δφ and Δψ followed continuously around a closed loop of the diagram.

Δφ and Δψ are defined up to whole turns: where a motion passes through a pole they jump by 2π, as
(p_φ = p_ψ, E' > gMR) or (p_φ = −p_ψ, E' > −gMR) is crossed. Without the jumps they are continuous,
and come back from a circuit with a whole number of turns more: none, where the loop can be drawn
together to a point, and one for each time that it goes around the focus–focus value of the upright
equilibrium. So no choice of Δφ is continuous everywhere: that is the monodromy.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin
from typing import TypeAlias

import numpy as np

from heavytop.analytic.critical_set import Array
from heavytop.errors import ImpossibleStart

Loop: TypeAlias = "Callable[[float], tuple[float, float]]"
Lattice: TypeAlias = "Callable[[float, float], tuple[float, ...]]"
"""T, Δφ, Δψ and Δψ − κT at a place; whether p_φ ≥ p_ψ and p_φ ≥ −p_ψ, E' > gMR and E' > −gMR."""

LONGEST = pi / 2  # step: half of what would leave its turns in doubt
MOST = 4096  # points
CLOSED = 1e-9  # of its size, that a loop may end from where it began
JUMPS = [[1, -1], [1, 1]]  # of Δφ and Δψ [turns], across the line of the top and of the bottom


@dataclass(frozen=True)
class Circuit:
    """The period lattice around a loop; arrays of shape (k,), the last place being the first.

    Made by `EnergyMomentum.circuit`.

    Parameters
    ----------
    s : ndarray
        From 0 to 1 along the loop.
    p_phi, E_prime : ndarray
        Places [kg m² s⁻¹, J].
    period : ndarray
        T [s].
    precession, spin : ndarray
        Δφ and Δψ [rad], continuous from where the loop begins.
    principal_precession, principal_spin : ndarray
        The same [rad] as `Motion` has them: with jumps.
    winding, spin_winding : int
        By how many turns Δφ and Δψ have grown; Δψ by −1 for each turn of Δφ, or where gMR < 0 by 1.
    largest_step : float
        The largest |step| of Δφ or of Δψ − κT, less than a quarter turn [rad].

    References
    ----------
    Duistermaat, "On global action-angle coordinates", *Communications on Pure and Applied
    Mathematics* 33 (1980); Cushman & Bates, *Global Aspects of Classical Integrable Systems*.
    """

    s: Array
    p_phi: Array
    E_prime: Array
    period: Array
    precession: Array
    spin: Array
    principal_precession: Array
    principal_spin: Array
    winding: int
    spin_winding: int
    largest_step: float

    @property
    def monodromy(self) -> tuple[tuple[int, int, int], ...]:
        """What the lattice of periods has become, in terms of what it was, row by row.

        Its basis is a turn of the frame, a turn of the body, and a nutation with the turns by −Δφ
        and −Δψ that undo it: (0, 2π, 0), (0, 0, 2π), (T, −Δφ, −Δψ). Only the last changes.
        """
        return (1, 0, 0), (0, 1, 0), (-self.winding, -self.spin_winding, 1)


def ellipse(centre: tuple[float, float], radii: tuple[float, float]) -> Loop:
    """The loop around `centre`, counterclockwise where p_φ points to the right and E' upwards."""
    (x, y), (width, height) = centre, radii
    return lambda s: (x + width * cos(2 * pi * (s % 1)), y + height * sin(2 * pi * (s % 1)))


def followed(at: Lattice, loop: Loop, points: int) -> Circuit:
    """The circuit of a loop, (p_φ, E') at s from 0 to 1; `at` gives the period lattice at a place.

    Of the `points` steps to begin with each is halved until Δφ and Δψ − κT turn by less than a
    quarter in it, and until there is no doubt whether they jump.

    Raises
    ------
    ImpossibleStart
        The loop is not closed, `points` is less than 3, or 4096 steps or the shortest that there
        are do not do: the loop comes too near to a critical point, or goes through one.
    """
    around = np.array([loop(k / 4) for k in range(5)])
    if points < 3 or np.any(abs(around[4] - around[0]) > CLOSED * np.ptp(around, axis=0)):
        raise ImpossibleStart([("loop", "closed, and of 3 points at least")])
    places = {k / points: at(*loop(k / points)) for k in range(points)}
    places[1.0] = places[0.0]
    while True:
        s = np.array(sorted(places))
        rows = np.array([places[each] for each in s])
        numbers, beyond, high = np.split(rows, (4, 6), axis=1)
        crossed = np.diff(beyond, axis=0)  # the lines of the top and of the bottom
        jumps = (crossed * high[1:] * high[:-1]) @ JUMPS
        turned = np.diff(numbers[:, [1, 3]], axis=0) - 2 * pi * jumps
        steps = np.max(abs(turned), axis=1)
        doubt = np.any((crossed != 0) & (high[1:] != high[:-1]), axis=1)
        long = ((s[1:] + s[:-1]) / 2)[(steps >= LONGEST) | doubt].tolist()
        if not long:
            break
        if len(places) + len(long) > MOST or not places.keys().isdisjoint(long):
            rule = f"farther from critical points: {MOST} steps, or the shortest, are too long"
            raise ImpossibleStart([("loop", rule)])
        places |= {each: at(*loop(each)) for each in long}
    period, precession, spin, _ = numbers.T
    turns = -np.vstack(([0, 0], np.cumsum(jumps, axis=0)))
    phi, psi = numbers[:, 1:3].T + 2 * pi * turns.T
    winding, spin_winding = map(int, turns[-1])
    p_phi, E_prime = np.array([loop(each % 1) for each in s]).T
    return Circuit(
        s, p_phi, E_prime, period, phi, psi, precession, spin, winding, spin_winding, max(steps)
    )
