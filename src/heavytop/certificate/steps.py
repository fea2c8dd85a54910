"""The Taylor polynomials of the steps of a run: their values, and bounds of their defects.

All is computed in doubles, and every rounding is bounded: the error of a sum of n products is at
most (n + 1) u / (1 - (n + 1) u) times the sum of their sizes, in any order (Higham, *Accuracy and
Stability of Numerical Algorithms*, 3.1); u = 2^-53. Only sums and products are used, which IEEE 754
rounds correctly. The bounds are sums of positive terms, with errors below 1e-12: the factor `UP`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.certificate.system import UNIT_FACTOR, UP, QuadraticSystem
from heavytop.exact.pairs import UNIT, Array, Words, add, two_product

MORE = 3  # degrees of a defect that are computed beyond the order of a step
# Coefficients of a step that are summed with twice the digits; the others are small. The order of a
# step is at least 8 (`heavytop.run.planning`).
LEADING_TERMS = 6
# factor for the length over which a polynomial is bounded: times of steps are rounded
STEP_MARGIN = 1 + 2.0**-48
STEPS_AT_ONCE = 1000  # steps whose coefficients stay in the processor's cache


class Steps(NamedTuple):
    """Some steps of a run, in its own unit of time.

    Attributes
    ----------
    coefficients : ndarray, shape (order + 1, n, k)
        Of the polynomials of n states over k steps, in the time since the beginning of each.
    begun, begun_low : ndarray, shape (k,)
        The time at which each begins: high and low words.
    length : ndarray, shape (k,)
        The length of each; negative back in time.
    clock : ndarray, shape (k,)
        Bounds of the error of the time at which a polynomial is evaluated.
    tail : ndarray, shape (n, k)
        Bounds, in units of its rounding, of the sum by Horner's scheme of the coefficients from
        order `LEADING_TERMS` on, over the power of that order.
    speed, bend : ndarray, shape (k,)
        Bounds over each step of the first and second derivative of those states from which the
        outputs are computed, as vectors.
    """

    coefficients: Array
    begun: Array
    begun_low: Array
    length: Array
    clock: Array
    tail: Array
    speed: Array
    bend: Array

    @classmethod
    def of(cls, coefficients: Array, label: Words, length: Array, clock: Array, read: int) -> Steps:
        """Return steps with their bounds; outputs read the first `read` states."""
        k, sizes = np.arange(len(coefficients)), np.abs(coefficients)
        powers = _powers(np.abs(length) * STEP_MARGIN, k.size)

        def weighted_sum(factors: NDArray[np.int_], order: int, states: int | None) -> Array:
            """Return the sum of factor |coefficient| reach^(k - order) over k >= order."""
            kept = sizes[order:, :states], powers[: k.size - order]
            return np.asarray(np.einsum("k,knm,km->nm", factors[order:].astype(float), *kept))

        derivatives = (weighted_sum(k, 1, read), weighted_sum(k * (k - 1), 2, read))
        speed, bend = (UP * np.sqrt((each**2).sum(axis=0)) for each in derivatives)
        tail = weighted_sum(2 * k + 2, LEADING_TERMS, None)
        return cls(coefficients, *label, length, clock, tail, speed, bend)

    def times(self, step: NDArray[np.intp], since: Array) -> Words:
        """Return times since the beginning of steps as double-doubles."""
        return add((self.begun[step], self.begun_low[step]), (since, np.zeros_like(since)))

    def where(self, index: slice) -> Steps:
        """Return some of the steps."""
        return Steps(*(each[..., index] for each in self))

    def at(self, step: NDArray[np.intp], since: Array) -> tuple[Words, Array, Array]:
        """Return states (n, m) on polynomials, as sums of two doubles, with two bounds of each.

        The first is of the arithmetic here, far below a double's; the second of Horner's scheme in
        doubles, by which the integrator evaluates them, compensated or not.
        """
        if not since.any():  # the states from which steps begin are doubles
            x = self.coefficients[0][:, step]
            return (x, np.zeros_like(x)), np.zeros_like(x), np.zeros_like(x)
        c = self.coefficients
        place: NDArray[np.intp] | slice = step
        if step.size and step[-1] - step[0] == step.size - 1 and (np.diff(step) == 1).all():
            place = slice(step[0], step[-1] + 1)  # nothing is copied
        rest, tail = c[-1][:, place], self.tail[:, place]
        for k in range(len(c) - 2, LEADING_TERMS - 1, -1):
            rest = rest * since + c[k][:, place]
        x, time = (rest, np.zeros_like(rest)), np.abs(since)
        size, plain, lost = tail, tail, UNIT * tail
        for k in range(LEADING_TERMS - 1, -1, -1):
            here = c[k][:, place]
            large = np.abs(here)
            high, low = two_product(x[0], since)
            x = add((here, np.zeros_like(here)), (high, low + x[1] * since))
            size = size * time + large
            plain = plain * time + (2 * k + 2) * large
            lost = lost * time
        twice = lost + 16 * (LEADING_TERMS + 1) * UNIT**2 * size
        return x, twice * UP, UNIT * plain * UP


def defects(system: QuadraticSystem, steps: Steps) -> Array:
    """Return bounds of |p' - f(p)| over each step, shape (k,), in the norm of the system."""
    parts = (slice(i, i + STEPS_AT_ONCE) for i in range(0, steps.length.size, STEPS_AT_ONCE))
    return np.concatenate([np.empty(0), *(_defects(system, steps.where(part)) for part in parts)])


def _defects(system: QuadraticSystem, steps: Steps) -> Array:
    """Return the bounds of `defects` for steps whose coefficients fit in the cache."""
    c = steps.coefficients
    order, reach = len(c) - 1, np.abs(steps.length) * STEP_MARGIN
    powers = _powers(reach, 2 * order + 1)
    index = np.arange(order + 1)[:, None, None]
    scaled = np.abs(c) * powers[: order + 1, None]
    S, weighted = scaled.sum(axis=0), (index * scaled).sum(axis=0)  # sums of |c|, of k |c|
    most = order + MORE  # terms of higher degrees are bounded by their sizes
    sums = np.cumsum(scaled[::-1], axis=0)[::-1]  # of each and all that follow
    room = np.empty((order + 1, reach.size))
    sizes = []
    for i, row in enumerate(system.terms):
        d = np.zeros((most, reach.size))
        rounding = np.zeros_like(reach)
        products = [term for term in row if term.first != UNIT_FACTOR]
        others = [term for term in row if term.first == UNIT_FACTOR]
        count, later = len(products), len(others) + 1
        own = [a * c[:, j] for a, j, _ in products]
        for m in range(order + 1):
            for x, (_, _, k) in zip(own, products, strict=True):
                part = d[m : m + order + 1]
                part -= np.multiply(x[m], c[: most - m, k], out=room[: len(part)])
        higher = np.zeros_like(reach)
        for a, j, k in products:  # rounded twice, and in all sums that follow
            higher += abs(a) * (scaled[MORE:, j] * sums[: MORE - 1 : -1, k]).sum(axis=0)
            rounding += abs(a) * S[j] * ((2 + count + later) * S[k] + count * weighted[k])
        for a, _, k in others:
            d[: order + 1] -= a * c[:, k]
            rounding += (2 + later) * abs(a) * S[k]
        d[:order] += index[1:, 0] * c[1:, i]
        rounding += 3 * (index[1:, 0] * np.abs(c[1:, i]) * powers[:order]).sum(axis=0)
        sizes.append((np.abs(d) * powers[:most]).sum(axis=0) + higher + UNIT * rounding)
    return system.norms(np.array(sizes))


def _powers(x: Array, count: int) -> Array:
    """Return the powers of numbers, shape (count, k), by multiplication alone."""
    return np.asarray(np.multiply.accumulate([np.ones_like(x), *[x] * (count - 1)]))
