"""Complete elliptic integrals of arrays in doubles, by one arithmetic–geometric mean."""

from __future__ import annotations

from math import pi

import numpy as np

from heavytop.numbers.pairs import Array

STEPS = 9
"""Of the mean, the same for every row: enough for all mc ≥ 1e-32."""


def complete(mc: Array, *ps: Array) -> tuple[Array, ...]:
    """K(1 − mc), and Π(1 − p | 1 − mc) for each p.

    The recursion is that of `heavytop.analytic.theory.elliptic.complete_third`, whose terms are all
    positive; the sequence of its mean is the same for every p, and gives K.

    Parameters
    ----------
    mc : Array
        1 − m > 0.
    *ps : Array
        1 − n > 0.

    Examples
    --------
    >>> K, third = complete(np.array([0.5]), np.array([3.0]))
    >>> print(K, third)
    [1.85407468] [1.02269751]
    """
    k, mean = np.sqrt(mc), np.ones_like(mc)
    product = k
    thirds = [_Third(p) for p in ps]
    for _ in range(STEPS):
        for third in thirds:
            third.step(product)
        mean, k = mean + k, 2 * np.sqrt(product)
        product = k * mean
    return pi / 2 * 2.0**STEPS / mean, *(third.value(mean) for third in thirds)


class _Third:
    """Bulirsch's sequences for one characteristic."""

    def __init__(self, p: Array) -> None:
        self.p = np.sqrt(p)
        self.a, self.b = np.ones_like(p), 1 / self.p

    def step(self, product: Array) -> None:
        inverse = 1 / self.p
        ratio = product * inverse
        self.a, self.b = self.a + self.b * inverse, 2 * (self.b + self.a * ratio)
        self.p = self.p + ratio

    def value(self, mean: Array) -> Array:
        return pi / 2 * (self.b + self.a * mean) / (mean * (mean + self.p))
