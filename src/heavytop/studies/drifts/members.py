"""Members of an ensemble: the scene's own start, and neighbouring ones."""

from __future__ import annotations

import math

import numpy as np

from heavytop.scene.state import State

SPREAD = 1e-2  # relative; of tilt, the smaller of its distances from the poles
STARTS = {
    name: {"long_name": f"initial {name}", "units": unit}
    for names, unit in (
        (("theta", "phi", "psi"), "rad"),
        (("thetadot", "phidot", "psidot", "omega3"), "rad s-1"),
    )
    for name in names
}
"""The initial conditions that are told of each start."""


def member(start: State, seed: int, number: int) -> State:
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
    >>> member(start, 1, 0) is start
    True
    >>> beside = member(start, 1, 3)
    >>> beside == member(start, 1, 3), abs(float(beside.theta) / 0.1 - 1) < 0.01
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
