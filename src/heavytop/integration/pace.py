"""The pace of a motion, from which its rates get a unit, where they need one.

It is the largest of the rates in a state and of what gravity and the energy can make of them: at
a turning point the rates of a form may vanish, and they do not stay so. The unit is a power of
two, and one for the pace of any ordinary top.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SLOW, FAST = 2.0**-8, 2.0**8  # rad/s, between which rates are as good as of the size of one
MOST = 500  # of the exponent: far beyond any top, and squares are still finite


def least_pace(parameters: Mapping[str, Any]) -> Any:
    """Return the pace of a motion whatever its state, by the constants of its run [rad/s].

    That of a fall, sqrt(2g) with g = gMR/A; with E'/A = h among the constants, of all its energy.
    Constants may be arrays.

    Examples
    --------
    >>> least_pace({"g": 2.0}), least_pace({"A": 1.0, "gMR": -2.0}), least_pace({"g": 1, "h": 7})
    (2.0, 2.0, 4.0)
    """
    g = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    return (2 * (abs(g) + abs(parameters.get("h", 0.0)))) ** 0.5


def unit_of(rates: Iterable[float], least: float) -> float:
    """Return the unit in which rates are of the size of one [rad/s], or one where they are nearly.

    Examples
    --------
    >>> unit_of([3.0, -200.0], 1.0), unit_of([3.0, -1000.0], 1.0), unit_of([0.0], 1e-3)
    (1.0, 1024.0, 0.001953125)
    """
    pace = max(map(abs, rates), default=0.0)
    pace = max(pace, least)
    if SLOW <= pace <= FAST or not 0 < pace < math.inf:
        return 1.0
    exponent = math.frexp(pace)[1]
    return math.ldexp(1.0, max(-MOST, min(exponent, MOST)))


def units_of(rates: Array, least: Array) -> Array:
    """Return the units of many motions, shape (k,), by their rates, shape (k, n).

    Examples
    --------
    >>> units_of(np.array([[3.0, -200.0], [3.0, -1000.0]]), np.array([1.0, 1.0]))
    array([1.000e+00, 1.024e+03])
    """
    pace = np.maximum(np.max(np.abs(rates), axis=1, initial=0.0), least)
    exponent = np.clip(np.frexp(pace)[1], -MOST, MOST)
    far = (pace > 0) & (pace < np.inf) & ~((pace >= SLOW) & (pace <= FAST))
    return np.where(far, np.ldexp(1.0, exponent), 1.0)
