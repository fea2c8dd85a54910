"""cosθ, 1 − cosθ and 1 + cosθ of arrays of angles, each with a proved relative bound.

θ in [0, π] is r beside the nearest k π/2, k = 0, 1, 2, so that |r| < 0.7854 and z = r² < 0.6169.
π/2 is P₁ + P₂ within u P₂; θ − k P₁ is exact (Sterbenz) and, when small, a multiple of 2⁻⁵², so
that |r| ≥ k P₂, and its relative error is that of P₂ and of one subtraction: below 3 u. Then, with
relative errors throughout:

    1 − cos r = ½ z (1 − z/12 + z²/360 − …), 8 terms; alternating, so that the rest is below
        2 z⁸/18! < 0.1 u of it. By Horner each coefficient c_j meets 2j + 1 roundings and its own,
        1.3 u in all beside a sum above 0.948. ½z has 2·3 + 1 u, of which 1 − cos r keeps at
        most all, for r sin r ≤ 2 (1 − cos r); one product more. Below 11 u.
    sin r = r (1 − z/6 + z²/120 − …), 8 terms: the rest is below z⁸/17! < 0.7 u of it, Horner
        1.7 u beside a sum above 0.897, r 3 u, what z rounds 0.2 u, one product more. Below 7 u.
    cosθ = ±(1 − (1 − cos r)) for k = 0, 2: 11 u · 0.293/0.707 and a rounding, below 6 u;
           −sin r for k = 1.
    1 ∓ cosθ = 1 − cos r on the side of its pole; elsewhere cosθ is at most 0.7072 on the side
        where they cancel, and 7 u · 0.7072/0.2928 with a rounding is below 18 u.

Of the doubles in [0, π] only 0 is a pole: `below` is exactly 0 there, and `above` never.
"""

from __future__ import annotations

from math import factorial, pi
from typing import Final

import numpy as np

from heavytop.classification.bounded import GIVEN, Array, Bounded

COS_ULPS: Final = 8
HEIGHT_ULPS: Final = 20

_QUARTER: Final = pi / 2  # P₁
_QUARTER_REST: Final = 6.123233995736766e-17  # P₂
_HEIGHT = tuple((-1) ** j * 2 / factorial(2 * j + 2) for j in range(8))  # of (1 − cos r)/½z
_SINE = tuple((-1) ** j / factorial(2 * j + 1) for j in range(8))  # of sin r/r

_COS_LOW: Final = -54  # |cosθ| ≥ 2⁻⁵⁴ in doubles,
_BELOW_LOW: Final = -2 * GIVEN - 2  # 1 − cosθ ≥ 2⁻²⁰² for θ ≥ 2⁻¹⁰⁰, and
_ABOVE_LOW: Final = -108  # 1 + cosθ ≥ 2⁻¹⁰⁸


def cosines(theta: Array) -> tuple[Bounded, Bounded, Bounded]:
    """Return cosθ, 1 − cosθ and 1 + cosθ.

    Parameters
    ----------
    theta : ndarray of float
        Tilts θ [rad]; outside [0, π], and above 0 below 2⁻¹⁰⁰, they are left open.

    Returns
    -------
    tuple of 3 Bounded
        Relatively exact, within 8, 20 and 20 units 2⁻⁵³.

    Notes
    -----
    **Accuracy** (``tests/property/test_bounded.py``): the largest errors seen are below 2.5,
    6 and 6 units.

    Examples
    --------
    >>> cos, below, above = cosines(np.array([0.0, 1e-8, np.pi]))
    >>> print(cos.value, below.value, above.value)
    [ 1.  1. -1.] [0.e+00 5.e-17 2.e+00] [2.00000000e+00 2.00000000e+00 7.49879891e-33]
    """
    theta = np.where(theta <= pi, Bounded.of(theta, positive=True).value, np.nan)
    late, last = theta >= _QUARTER / 2, theta >= 1.5 * _QUARTER
    k = late.astype(float) + last
    r = (theta - k * _QUARTER) - k * _QUARTER_REST
    z = r * r
    height = 0.5 * z * _horner(_HEIGHT, z)  # 1 − cos r
    cos = np.where(late & ~last, -r * _horner(_SINE, z), (1 - k) * (1 - height))
    below = np.where(late, 1 - cos, height)
    above = np.where(last, height, 1 + cos)
    return (
        Bounded(cos, COS_ULPS, _COS_LOW, 0),
        Bounded(below, HEIGHT_ULPS, _BELOW_LOW, 1, positive=True),
        Bounded(above, HEIGHT_ULPS, _ABOVE_LOW, 1, positive=True),
    )


def _horner(coefficients: tuple[float, ...], z: Array) -> Array:
    value = coefficients[-1] * z
    for coefficient in coefficients[-2:0:-1]:
        value += coefficient
        value *= z
    value += coefficients[0]
    return value
