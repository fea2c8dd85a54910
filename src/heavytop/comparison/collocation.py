"""Gauss' collocation in the axis form, iterated to rounding.

The iteration of a step ends where two sweeps agree, or where rounding keeps them from coming
closer (Hairer, Lubich & Wanner, chapter VIII). Sums are compensated.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from heavytop.comparison.kernel import Kernel, added_up, compiled

_SWEEPS = 200
_NEAR = 1e-11  # two sweeps no nearer than this, and not coming nearer, do not converge


@cache
def midpoint() -> Kernel:
    """Return the kernel of the implicit midpoint rule, by fixed-point iteration to rounding.

    Its table holds half the step. `work` holds five lost words and the half increments before.
    """
    added = added_up(compensated=True)

    def advance(y: Any, work: Any, g: float, l_z: float, table: Any, steps: int) -> int:
        half, sweeps = table[0, 0], 0
        near = _NEAR * (1 + abs(half * g))
        z_1, z_2, z_3, z_4, z_5 = work[5], work[6], work[7], work[8], work[9]
        for _ in range(steps):
            before, here = np.inf, np.inf
            for _ in range(_SWEEPS):
                e_x, e_y, e_z, l_x, l_y = y[0] + z_1, y[1] + z_2, y[2] + z_3, y[3] + z_4, y[4] + z_5
                n_1, n_2 = half * (l_y * e_z - l_z * e_y), half * (l_z * e_x - l_x * e_z)
                n_3, n_4, n_5 = half * (l_x * e_y - l_y * e_x), -half * g * e_y, half * g * e_x
                here = max(max(abs(n_1 - z_1), abs(n_2 - z_2)), abs(n_3 - z_3))
                here = max(max(here, abs(n_4 - z_4)), abs(n_5 - z_5))
                z_1, z_2, z_3, z_4, z_5 = n_1, n_2, n_3, n_4, n_5
                sweeps += 1
                if here == 0 or (here >= before and here < near):
                    break
                before = here
            if not here < near:
                return -1
            y[0], work[0] = added(y[0], work[0], 2 * z_1)
            y[1], work[1] = added(y[1], work[1], 2 * z_2)
            y[2], work[2] = added(y[2], work[2], 2 * z_3)
            y[3], work[3] = added(y[3], work[3], 2 * z_4)
            y[4], work[4] = added(y[4], work[4], 2 * z_5)
        work[5], work[6], work[7], work[8], work[9] = z_1, z_2, z_3, z_4, z_5
        return sweeps

    return compiled(advance)


@cache
def collocation(s: int) -> Kernel:
    """Return the kernel of Gauss' collocation with s nodes, by fixed-point iteration to rounding.

    Its table holds h times A transposed, b and the matrix that foresees the next step, transposed,
    and what A and b lost in rounding, which once a step is enough for.
    `work` holds five lost words, whether the step before is known, and its derivatives (5, s).
    """
    foreseen, converged, moved = _foreseen(s), _converged(s), _moved(s)

    def advance(y: Any, work: Any, g: float, l_z: float, table: Any, steps: int) -> int:
        z, new, rest, none = np.zeros((5, s)), np.zeros((5, s)), np.zeros((5, s)), np.zeros((5, s))
        f = work[6:].reshape((5, s))
        sweeps = 0
        for _ in range(steps):
            foreseen(y, work[5], g, l_z, table, f, z, rest, none)
            taken = converged(y, g, l_z, table, f, z, new, rest)
            if taken < 0:
                return -1
            moved(y, work, table, f)
            work[5] = 1.0
            sweeps += 1 + taken
        return sweeps * s

    return compiled(advance)


def _foreseen(s: int) -> Any:
    """Return what guesses the increments z, and weighs by what A lost their rates, into rest."""
    from numba import njit

    rates, weighed = _rates(s), _weighed(s)

    def foreseen(
        y: Any, known: float, g: float, l_z: float, table: Any, f: Any, z: Any, rest: Any, none: Any
    ) -> None:
        if known == 0:
            rates(y, none, f, g, l_z)
            weighed(table, 0, f, z, none)
        else:
            weighed(table, s + 1, f, z, none)
        rates(y, z, f, g, l_z)
        weighed(table, 2 * s + 1, f, rest, none)

    return njit(foreseen)


def _converged(s: int) -> Any:
    """Return what sweeps until two sweeps agree to rounding, and how often: -1 if they do not."""
    from numba import njit

    rates, weighed, apart = _rates(s), _weighed(s), _apart(s)

    def converged(
        y: Any, g: float, l_z: float, table: Any, f: Any, z: Any, new: Any, rest: Any
    ) -> int:
        near = _NEAR * (1 + abs(table[s].sum() * g))
        before = np.inf
        for sweep in range(_SWEEPS):
            rates(y, z, f, g, l_z)
            weighed(table, 0, f, new, rest)
            here = apart(new, z)
            if here == 0 or (here >= before and here < near):
                return sweep + 1
            z, new, before = new, z, here
        return _SWEEPS if before < near else -1

    return njit(converged)


def _rates(s: int) -> Any:
    """Return what puts the rates at the nodes, y and their increments z, into f."""
    from numba import njit

    def rates(y: Any, z: Any, f: Any, g: float, l_z: float) -> None:
        for i in range(s):
            e_x, e_y, e_z = y[0] + z[0, i], y[1] + z[1, i], y[2] + z[2, i]
            l_x, l_y = y[3] + z[3, i], y[4] + z[4, i]
            f[0, i] = l_y * e_z - l_z * e_y
            f[1, i] = l_z * e_x - l_x * e_z
            f[2, i] = l_x * e_y - l_y * e_x
            f[3, i] = -g * e_y
            f[4, i] = g * e_x

    return njit(rates)


def _weighed(s: int) -> Any:
    """Return what puts into z the rates f, weighed by s rows of the table, and a rest."""
    from numba import njit

    def weighed(table: Any, first: int, f: Any, z: Any, rest: Any) -> None:
        for k in range(5):
            for i in range(s):
                z[k, i] = rest[k, i]
            for j in range(s):
                for i in range(s):
                    z[k, i] += table[first + j, i] * f[k, j]

    return njit(weighed)


def _apart(s: int) -> Any:
    """Return what tells how far two sweeps are apart."""
    from numba import njit

    def apart(a: Any, b: Any) -> float:
        most = 0.0
        for k in range(5):
            for i in range(s):
                distance = abs(a[k, i] - b[k, i])
                if not distance <= most:  # and so a NaN comes through
                    most = distance
        return most

    return njit(apart)


def _moved(s: int) -> Any:
    """Return what takes y to the end of the step, by b and by what b lost."""
    from numba import njit

    added = added_up(compensated=True)

    def moved(y: Any, work: Any, table: Any, f: Any) -> None:
        for k in range(5):
            term = 0.0
            for i in range(s):
                term += table[3 * s + 1, i] * f[k, i]
            for i in range(s):
                term += table[s, i] * f[k, i]
            y[k], work[k] = added(y[k], work[k], term)

    return njit(moved)
