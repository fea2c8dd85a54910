"""Multiples of a constant, as many as a double can say, to the last digit of a double.

The constant is the sum of three doubles, 159 bits; products are exact as pairs of doubles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heavytop.numbers.doubledouble import add, two_product, two_sum

Array = NDArray[np.float64]
Words = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Multiples:
    """Of the constant that is the sum of three words, each below the last digit of the one before.

    Examples
    --------
    >>> third = Multiples((1 / 3, 2.0**-54 / 3, 2.0**-108 / 3))
    >>> third.rest(np.array([1e9]), np.array([3e9 + 1]))[0]
    array([-0.33333333])
    >>> third.turns(np.array([1.0, 3e9 + 1]))
    (array([         0, 1000000000]), array([0.33333333, 0.33333333]))
    """

    words: Words

    def rest(self, t: Array, n: Array, since: Words = (0.0, 0.0, 0.0)) -> tuple[Array, Array]:
        """Return t - since - n x, as pairs of doubles."""
        rest = two_sum(t, np.full_like(t, -since[0]))
        for part in self._parts(n):
            rest = add(rest, (-part, np.zeros_like(t)))
        for word in since[1:]:
            rest = add(rest, (np.full_like(t, -word), np.zeros_like(t)))
        return rest

    def turns(self, n: Array) -> tuple[NDArray[np.int64], Array]:
        """Return n x as a whole number and a rest of at most a few halves."""
        parts = self._parts(n)
        whole = [np.rint(part) for part in parts]
        rest = sum((part - w for part, w in zip(parts, whole, strict=True)), np.zeros_like(n))
        return sum((w.astype(np.int64) for w in whole), np.zeros(n.shape, np.int64)), rest

    def _parts(self, n: Array) -> tuple[Array, ...]:
        """Return numbers that add up to n x, the largest first."""
        first, second, third = (np.full_like(n, word) for word in self.words)
        return *two_product(n, first), *two_product(n, second), n * third
