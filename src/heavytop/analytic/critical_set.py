"""The critical set of the energy–momentum map: steady precession, and what stays on the vertical.

In units A = 1, with a = p_φ/A, b = p_ψ/A, P± = a ± b, h = E'/A, g = gMR/A and u = cosθ, a steady
precession of rate Ω has the constants

    b = Ω u + g/Ω,   a = Ω + g u/Ω,   h = g u + ½ Ω² (1 − u²):

two sheets without folds, one for each sign of Ω, whose edges u = ±1 lie on the lines a = ±b,
h = ±g of the upright and the hanging equilibrium. With u = (bΩ − g)/Ω² kept between −1 and 1,

    a = b u + Ω (1 − u²)

never falls as Ω grows, for dh/da = Ω along the sheets: h is a convex function of a, the least
energy there is at a, and Ω its slope. It has a corner at the hanging equilibrium, where Ω changes
its sign. At the upright one it has another if b² ≥ 4|g|; if not, that point lies above the least
energy, and is critical by itself.
"""

from __future__ import annotations

from math import sqrt
from typing import Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]

_HALVINGS: Final = 60  # of the logarithm of Ω


class Valley(NamedTuple):
    """Where the effective potential is lowest; arrays of one shape.

    Attributes
    ----------
    energy : ndarray
        The least h [s⁻²].
    rate : ndarray
        Ω [s⁻¹], its slope along a; nan at a corner, where the axis stays on the vertical, and 0
        where it rests in any direction without gravity.
    one_minus_u, one_plus_u : ndarray
        1 ∓ cosθ, each to its own digits.
    """

    energy: Array
    rate: Array
    one_minus_u: Array
    one_plus_u: Array


def valley(g: float, plus: npt.ArrayLike, minus: npt.ArrayLike) -> Valley:
    """The lowest point of the effective potential at given P₊ and P₋ [s⁻¹].

    Examples
    --------
    >>> found = valley(1.0, [2.0, 0.0], [0.0, -2.0])
    >>> found.energy, found.rate
    (array([ 0.5, -1. ]), array([ 1., nan]))
    """
    P, Q = np.asarray(plus, dtype=np.float64), np.asarray(minus, dtype=np.float64)
    a, b = (P + Q) / 2, (P - Q) / 2
    hanging, standing = (P, Q) if g >= 0 else (Q, P)  # 0 where the axis can be on that vertical
    corner = bool(g) & ((hanging == 0) | ((standing == 0) & (b * b >= 4 * abs(g))))
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = _rate(g, a, b, np.where(hanging < 0, -1, 1)) if g else np.where(P * Q > 0, a, 0.0)
        pull = np.where(rate == 0, b, g / rate)  # b − Ω u, so that P± = (1 ± u)(Ω ± pull)
        strong, weak = (rate + pull, rate - pull) if g >= 0 else (rate - pull, rate + pull)
        # 1 ± u from the hanging and from the standing vertical; as Ω pull = g, one sum is not small
        near = np.where(corner & (hanging != 0), 2.0, hanging / strong)
        far = np.where(corner | (abs(weak) < abs(strong) / 8), 2 - near, standing / weak)
    # without weight and momentum any tilt is lowest
    near, far = np.nan_to_num(np.clip((near, far), 0.0, 2.0), nan=1.0)
    above, below = (far, near) if g >= 0 else (near, far)
    # stationary in u and in Ω: what is left of their errors enters squared
    drift = (P * above + Q * below) / 2
    energy = g * (below - above) / 2 + rate * drift - rate**2 * above * below / 2
    return Valley(energy, np.where(corner, np.nan, rate), above, below)


def _rate(g: float, a: Array, b: Array, side: Array) -> Array:
    """The slope Ω at a, of the sign `side`, by halving between bounds of its size."""
    unit = sqrt(abs(g))
    inner, outer = side * abs(g) / (abs(b) + unit), side * (abs(a) + unit)
    for _ in range(_HALVINGS):
        middle = side * np.sqrt(inner * outer)
        u = np.maximum(np.minimum((b - g / middle) / middle, 1.0), -1.0)
        nearer = (b * u + middle * (1 - u) * (1 + u) < a) == (side > 0)
        inner, outer = np.where(nearer, middle, inner), np.where(nearer, outer, middle)
    return outer
