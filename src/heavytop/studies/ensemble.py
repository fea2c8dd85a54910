"""An ensemble: neighbouring starts, and the times at which their runs are sampled."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from heavytop.scene.state import State

SPREAD: Final = 1e-2  # relative; of tilt, the smaller of its distances from the poles
PHASE: Final = 0.6180339887498949  # of a period: no turning point, where a time error is not seen


def neighbour(start: State, seed: int, number: int) -> State:
    """Return a start beside the given one; number 0 is that itself.

    Tilt and rates are changed by one per cent at most, and the spin omega3 stays. A start depends
    on seed and number alone, so a larger ensemble contains a smaller one.

    Parameters
    ----------
    start : State
    seed, number : int

    Examples
    --------
    >>> start = State(theta=0.1, phidot=-15, psidot=140)
    >>> neighbour(start, 1, 0) is start
    True
    >>> beside = neighbour(start, 1, 3)
    >>> beside == neighbour(start, 1, 3), abs(float(beside.theta) / 0.1 - 1) < 0.01
    (True, True)
    """
    if number == 0:
        return start
    drawn = np.random.default_rng([seed, number]).uniform(-SPREAD, SPREAD, 3).tolist()
    theta = float(start.theta)
    return State(
        theta=theta + drawn[0] * min(theta, math.pi - theta),
        thetadot=float(start.thetadot) * (1 + drawn[1]),
        phi=start.phi,
        phidot=float(start.phidot) * (1 + drawn[2]),
        psi=start.psi,
        omega3=float(start.omega3),
    )


def sample_times(periods: float, samples: int) -> tuple[float, ...]:
    """Return numbers of nutation periods, increasing, the last within one of `periods`.

    They are spread evenly over the decades, all at the same phase of the nutation, away from its
    turning points.

    Parameters
    ----------
    periods : float
        At least 1.
    samples : int
        How many; where they would fall into the same period, fewer.

    Examples
    --------
    >>> [round(n, 3) for n in sample_times(1000, 4)]
    [0.618, 9.618, 99.618, 999.618]
    """
    whole = np.unique(np.rint(np.geomspace(1, max(1, int(periods)), max(1, samples))))
    return tuple(float(n - 1 + PHASE) for n in whole)
