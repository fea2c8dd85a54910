"""Carlson's symmetric elliptic integral R_J in doubles, vectorised.

R_J(x, y, z, p) = (3/2) ∫₀^∞ dt / ((t + p) √((t + x)(t + y)(t + z))), by the duplication
theorem (Carlson 1995, *Numerical Algorithms* 10, 13–26; DLMF 19.36). scipy has it too; importing
scipy.special takes longer than a run.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

_CLOSE = 0.015  # relative distance of the arguments at which the series of degree 7 is exact


def elliprj(x: Array, y: Array, z: float, p: Array) -> Array:
    """R_J(x, y, z, p) for x, y ≥ 0, at most one of them 0, and z, p > 0.

    Parameters
    ----------
    x, y, p : ndarray, shape (k,)
        Arguments.
    z : float
        Argument.

    Notes
    -----
    Accuracy: 4e-15 relative against mpmath over 32 decades of p, by
    ``tests/analytic/test_carlson.py``.

    Examples
    --------
    >>> one = np.ones(1)
    >>> elliprj(one, one, 1.0, one)
    array([1.])
    """
    z_, total, scale = np.full_like(x, z), np.zeros_like(x), 1.0
    product = (p - x) * (p - y) * (p - z_)
    while True:
        mean = (x + y + z_ + 2 * p) / 5
        far = np.maximum.reduce([abs(mean - a) for a in (x, y, z_, p)])
        if np.all(far <= _CLOSE * mean):
            break
        sx, sy, sz, sp = np.sqrt(x), np.sqrt(y), np.sqrt(z_), np.sqrt(p)
        shift = sx * sy + sx * sz + sy * sz
        d = (sp + sx) * (sp + sy) * (sp + sz)
        # 1 + e = 1 + (p-x)(p-y)(p-z)/d² without cancellation where p is small
        total = total + scale / d * _ellipr_c1(scale**3 * product / d**2, 2 * sp * (p + shift) / d)
        x, y, z_, p = ((a + shift) / 4 for a in (x, y, z_, p))
        scale /= 4
    return 6 * total + scale * _series(x, y, z_, mean) / (mean * np.sqrt(mean))


def _ellipr_c1(e: Array, one_plus_e: Array) -> Array:
    """R_C(1, 1 + e), which is atan(√e)/√e, for e > −1."""
    root = np.sqrt(abs(e))
    with np.errstate(divide="ignore", invalid="ignore"):
        below = np.log((1 + root) / np.sqrt(one_plus_e))
        bent = np.where(e > 0, np.arctan(root), below) / root
    series = 1 + e * (-1 / 3 + e * (1 / 5 + e * (-1 / 7 + e / 9)))
    return np.where(abs(e) < 1e-3, series, bent)


def _series(x: Array, y: Array, z: Array, mean: Array) -> Array:
    """A^{3/2} R_J of nearly equal arguments of mean A (DLMF 19.36.2)."""
    X, Y, Z = ((mean - a) / mean for a in (x, y, z))
    P = -(X + Y + Z) / 2
    E2 = X * Y + X * Z + Y * Z - 3 * P**2
    E3 = X * Y * Z + 2 * E2 * P + 4 * P**3
    E4 = (2 * X * Y * Z + E2 * P + 3 * P**3) * P
    E5 = X * Y * Z * P**2
    low = 1 - 3 * E2 / 14 + E3 / 6 + 9 * E2**2 / 88 - 3 * E4 / 22 - 9 * E2 * E3 / 52
    high = 3 * E5 / 26 - E2**3 / 16 + 3 * E3**2 / 40 + 3 * E2 * E4 / 20
    return low + high + 45 * E2**2 * E3 / 272 - 9 * (E3 * E4 + E2 * E5) / 68
