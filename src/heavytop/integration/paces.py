"""The unit of time of a motion, in which steps are taken: powers of two, so nothing is rounded.

`heavytop.integration.engine` says what for.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.exact.pairs import Array

# rad/s, between which rates are as good as of the size of one
SLOWEST_PACE, FASTEST_PACE = 2.0**-8, 2.0**8
MOST_EXPONENT = 500  # of the exponent: far beyond any top, and squares are still finite


def paces_of(form: Formulation, states: Array, parameters: Mapping[str, Any]) -> Array:
    """Return the paces of motions through states, shape (..., n), with their constants [1/s].

    Each is of the size of the largest of the rates in the state, and of what gravity and the
    energy h can make of them: at a turning point rates may vanish, and they do not stay so.

    Examples
    --------
    >>> from heavytop.equations.euler_poisson import axis_form
    >>> states = np.array([[0, 0, 1, 3, -200.0], [0, 0, 1, 3, -1000.0], [0, 0, 1, 0, 0.0]])
    >>> paces_of(axis_form(), states, {"g": np.array([1.0, 1.0, 5e-7])})
    array([1.000000e+00, 1.024000e+03, 1.953125e-03])
    """
    g = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    falling = (2 * (abs(g) + abs(parameters.get("h", 0.0)))) ** 0.5
    turning = np.max(np.abs(states[..., form.is_rate]), axis=-1, initial=0.0)
    pace = np.maximum(turning, falling)
    exponent = np.clip(np.frexp(pace)[1], -MOST_EXPONENT, MOST_EXPONENT)
    far = (pace > 0) & (pace < np.inf) & ~((pace >= SLOWEST_PACE) & (pace <= FASTEST_PACE))
    return np.where(far, np.ldexp(1.0, exponent), 1.0)


def in_units(form: Formulation, pace: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return constants of a formulation in the unit of time of a pace, by their symbols' names.

    Examples
    --------
    >>> from heavytop.equations.euler_poisson import axis_form
    >>> in_units(axis_form(), 4.0, {"g": 32.0, "l_z": 8.0, "phi_0": 3.0})
    {'g': 2.0, 'l_z': 2.0, 'phi_0': 3.0}
    """
    return {name: x / pace ** form.powers[name] for name, x in values.items()}
