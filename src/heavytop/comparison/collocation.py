"""Gauss' collocation in the axis form, iterated to rounding.

The iteration of a step ends where two sweeps agree, or where rounding keeps them from coming
closer (Hairer, Lubich & Wanner, chapter VIII). Sums are compensated.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np
from flint import arb, arb_mat

from heavytop.comparison.steppers import FixedStep, InitialValueProblem, Kernel, compiled, summation
from heavytop.exact.balls import working
from heavytop.exact.pairs import Array, two_product

_BITS = 256
_SWEEPS = 200
_NEAR = 1e-11  # two sweeps no nearer than this, and not coming nearer, do not converge


def gauss(s: int, problem: InitialValueProblem, setting: float, steps: int) -> FixedStep:
    """Return the stepper of Gauss' collocation with s nodes; with one, the implicit midpoint rule.

    `setting` is the number of steps a period, `steps` that in a block.
    """
    g, l_z = (problem.constants[name] for name in ("g", "l_z"))
    h = problem.span / setting
    kernel, seconds = _gauss_steps(s)
    advance = partial(kernel, g, l_z, _table(s, h))
    return FixedStep(start=problem.start, h=h, advance=advance, steps=steps, carried=5,
                     scratch=1 + 5 * s, compile_s=seconds)  # fmt: skip


@cache
def coefficients(s: int) -> tuple[Array, Array, Array]:
    """Return A transposed above b, shape (s + 1, s), as doubles and the rest, and a third matrix.

    In doubles alone A and b are not quite symplectic, and the energy drifts (Hairer, McLachlan &
    Razakarivony 2008). The third, shape (s, s), foresees a step: its transpose takes the
    derivatives at the nodes to the increments up to the nodes of the next step, along the
    polynomial through them.
    """
    with working(_BITS):
        nodes = [(1 + arb.legendre_p_root(s, k)) / 2 for k in reversed(range(s))]
        lagrange = arb_mat([[x**k for k in range(s)] for x in nodes]).inv()

        def integrals(*ends: arb) -> Any:
            """Return the integrals from 0 to ends of the Lagrange polynomials of the nodes."""
            powers = [[x**k / k for k in range(1, s + 1)] for x in ends]
            return np.array((arb_mat(powers) * lagrange).tolist())

        b = integrals(arb(1))
        exact = np.vstack([integrals(*nodes).T, b])
        beyond = (integrals(*(x + 1 for x in nodes)) - b).T
        high = exact.astype(np.float64)
        return high, (exact - high).astype(np.float64), beyond.astype(np.float64)


def _table(s: int, h: float) -> Array:
    """Return h times A transposed, b, what foresees a step, and the rests of A and of b."""
    high, rest, beyond = coefficients(s)
    product, error = two_product(np.full_like(high, h), high)
    return np.ascontiguousarray(np.vstack([product, h * beyond, error + h * rest]))


@cache
def _gauss_steps(s: int) -> tuple[Kernel, float]:
    """Return the compiled steps.

    A step starts from increments z at the nodes that the step before foresees, and improves them
    until they stand. `work` holds five lost words, whether there is a step before, and its
    derivatives (5, s). The rests of A and b, of the size of rounding, are enough once a step.
    """
    added, (rates, weighed) = summation(compensated=True), _sweep(s)

    def advance(g: float, l_z: float, table: Any, y: Any, work: Any, steps: int) -> int:
        A, b, beyond = table[:s], table[s], table[s + 1 : 2 * s + 1]
        rest_of_A, rest_of_b = table[2 * s + 1 : 3 * s + 1], table[3 * s + 1]
        z, rest, none = np.zeros((5, s)), np.zeros((5, s)), np.zeros((5, s))
        f = work[6:].reshape((5, s))
        near = _NEAR * (1 + abs(b.sum() * g))
        sweeps = 0
        for _ in range(steps):
            if work[5] == 0:
                rates(y, none, f, g, l_z)
                weighed(f, A, none, z)
            else:
                weighed(f, beyond, none, z)
            rates(y, z, f, g, l_z)
            weighed(f, rest_of_A, none, rest)
            sweeps += 1
            before, change = np.inf, np.inf
            for _ in range(_SWEEPS):
                rates(y, z, f, g, l_z)
                before, change = change, weighed(f, A, rest, z)
                sweeps += 1
                if change == 0 or (change >= before and change < near):
                    break
            if not change < near:
                return -1
            for k in range(5):
                term = 0.0
                for i in range(s):
                    term += rest_of_b[i] * f[k, i]
                for i in range(s):
                    term += b[i] * f[k, i]
                y[k], work[k] = added(y[k], work[k], term)
            work[5] = 1.0
        return sweeps * s

    return compiled(advance)


def _sweep(s: int) -> tuple[Any, Any]:
    """Return what computes the derivatives at s nodes, and what weighs them, compiled."""
    from numba import njit

    def rates(y: Any, z: Any, f: Any, g: float, l_z: float) -> None:
        """Put the derivatives at the nodes, y and their increments z, into f."""
        for i in range(s):
            e_x, e_y, e_z = y[0] + z[0, i], y[1] + z[1, i], y[2] + z[2, i]
            l_x, l_y = y[3] + z[3, i], y[4] + z[4, i]
            f[0, i] = l_y * e_z - l_z * e_y
            f[1, i] = l_z * e_x - l_x * e_z
            f[2, i] = l_x * e_y - l_y * e_x
            f[3, i] = -g * e_y
            f[4, i] = g * e_x

    def weighed(f: Any, weights: Any, first: Any, z: Any) -> float:
        """Put first + f . weights into z, and return the largest change."""
        most = 0.0
        for k in range(5):
            for i in range(s):
                total = first[k, i]
                for j in range(s):
                    total += weights[j, i] * f[k, j]
                change = abs(total - z[k, i])
                if not change <= most:  # and so a NaN comes through
                    most = change
                z[k, i] = total
        return most

    return njit(rates), njit(weighed)
