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
from itertools import pairwise
from math import cos, pi, sin
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from heavytop.errors import ImpossibleStart

Array: TypeAlias = npt.NDArray[np.float64]
Whole: TypeAlias = npt.NDArray[np.int64]
Loop: TypeAlias = "Callable[[float], tuple[float, float]]"
Matrix: TypeAlias = "tuple[tuple[int, int, int], ...]"

LONGEST = pi / 2  # step: half of what would leave its turns in doubt
MOST = 4096  # points
CLOSED = 1e-9  # of its size, that a loop may end from where it began


class LoopSample(NamedTuple):
    """A place of a loop [kg m² s⁻¹, J], and the lattice there.

    `relative_spin` is Δψ − κT, κ = p_ψ (1/C − 1/A), which jumps as Δψ does. `beyond_top` and
    `beyond_bottom` say whether p_φ ≥ p_ψ, and p_φ ≥ −p_ψ; `over_top` and `over_bottom` whether
    E' > gMR, and E' > −gMR: only there do Δφ and Δψ jump between the two sides.
    """

    p_phi: float
    E_prime: float
    period: float
    precession: float
    spin: float
    relative_spin: float
    beyond_top: bool
    beyond_bottom: bool
    over_top: bool
    over_bottom: bool


Evaluate: TypeAlias = "Callable[[float, float], LoopSample]"


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
    principal_precession, principal_spin : ndarray
        Δφ and Δψ [rad] as `Motion` has them: with jumps.
    turns, spin_turns : ndarray of int
        What makes them continuous from where the loop begins, in turns.
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
    principal_precession: Array
    principal_spin: Array
    turns: Whole
    spin_turns: Whole
    largest_step: float

    @property
    def precession(self) -> Array:
        """Δφ [rad], continuous from where the loop begins."""
        return self.principal_precession + 2 * pi * self.turns

    @property
    def spin(self) -> Array:
        """Δψ [rad], continuous from where the loop begins."""
        return self.principal_spin + 2 * pi * self.spin_turns

    @property
    def winding(self) -> int:
        """By how many turns Δφ has grown."""
        return int(self.turns[-1])

    @property
    def spin_winding(self) -> int:
        """By how many turns Δψ has grown, −1 for each turn of Δφ, or where gMR < 0 1."""
        return int(self.spin_turns[-1])

    @property
    def monodromy(self) -> Matrix:
        """What the lattice of periods has become, in terms of what it was, row by row.

        Its basis is a turn of the frame, a turn of the body, and a nutation with the turns by −Δφ
        and −Δψ that undo it: (0, 2π, 0), (0, 0, 2π), (T, −Δφ, −Δψ). Only the last changes.
        """
        return (1, 0, 0), (0, 1, 0), (-self.winding, -self.spin_winding, 1)


def ellipse(centre: tuple[float, float], radii: tuple[float, float]) -> Loop:
    """The loop around `centre`, counterclockwise where p_φ points to the right and E' upwards."""

    def loop(s: float) -> tuple[float, float]:
        angle = 2 * pi * (s % 1.0)
        return centre[0] + radii[0] * cos(angle), centre[1] + radii[1] * sin(angle)

    return loop


def followed(evaluate: Evaluate, loop: Loop, points: int) -> Circuit:
    """The circuit of a loop, (p_φ, E') at s from 0 to 1.

    Of the `points` steps to begin with each is halved until Δφ and Δψ − κT turn by less than a
    quarter in it, and until there is no doubt whether they jump.

    Raises
    ------
    ImpossibleStart
        The loop is not closed, `points` is less than 3, or 4096 steps or the shortest that there
        are do not do: the loop comes too near to a critical point, or goes through one.
    """
    if points < 3 or not _closed(loop):
        raise ImpossibleStart([("loop", "closed, and of 3 points at least")])
    samples = {k / points: evaluate(*loop(k / points)) for k in range(points)}
    samples[1.0] = samples[0.0]
    while long := _long(samples):
        if len(samples) + len(long) > MOST or not samples.keys().isdisjoint(long):
            rule = f"farther from critical points: {MOST} steps, or the shortest, are too long"
            raise ImpossibleStart([("loop", rule)])
        samples |= {s: evaluate(*loop(s)) for s in long}
    order = sorted(samples)
    row = [samples[s] for s in order]
    jumps = np.array([_jumps(one, other) for one, other in pairwise(row)])
    turns, spin_turns = -np.cumsum(np.vstack(([0, 0], jumps)), axis=0).T
    p_phi, E_prime, period, precession, spin = np.array([sample[:5] for sample in row]).T
    return Circuit(
        np.array(order), p_phi, E_prime, period, precession, spin, turns, spin_turns,
        max(_step(one, other) for one, other in pairwise(row)),
    )  # fmt: skip


def _closed(loop: Loop) -> bool:
    """Whether it ends where it begins, up to rounding."""
    around = np.array([loop(k / 4) for k in range(5)])
    return bool(np.all(abs(around[4] - around[0]) <= CLOSED * np.ptp(around, axis=0)))


def _jumps(one: LoopSample, other: LoopSample) -> tuple[int, int]:
    """By how many turns Δφ and Δψ jump: Φ₋ where the top is passed, Φ₊ where the bottom is."""
    minus = (other.beyond_top - one.beyond_top) * (one.over_top and other.over_top)
    plus = (other.beyond_bottom - one.beyond_bottom) * (one.over_bottom and other.over_bottom)
    return plus + minus, plus - minus


def _in_doubt(one: LoopSample, other: LoopSample) -> bool:
    """Whether a line is crossed at an end of which there are jumps, and not at the other."""
    top = one.beyond_top != other.beyond_top and one.over_top != other.over_top
    bottom = one.beyond_bottom != other.beyond_bottom and one.over_bottom != other.over_bottom
    return top or bottom


def _step(one: LoopSample, other: LoopSample) -> float:
    """How far Δφ or Δψ − κT turns, jumps apart."""
    jumps = _jumps(one, other)
    steps = other.precession - one.precession, other.relative_spin - one.relative_spin
    return max(abs(step - 2 * pi * jump) for step, jump in zip(steps, jumps, strict=True))


def _long(samples: dict[float, LoopSample]) -> list[float]:
    """The middles of the steps that are too long."""
    return [
        (s + later) / 2
        for s, later in pairwise(sorted(samples))
        if _step(samples[s], samples[later]) >= LONGEST or _in_doubt(samples[s], samples[later])
    ]
