"""Splittings in the axis form: kicks of l by the torque, and turns of e about l.

Coefficients of methods for q'' = f(q) (Runge-Kutta-Nystroem) serve here: the kick depends on e
alone and the free motion is quadratic in l, so that the bracket of three kicks and a turn is 0.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from heavytop.comparison.kernel import Kernel, added_up, compiled

_T = (  # of tan(a)/a in a^2
    1.0,
    1 / 3,
    2 / 15,
    17 / 315,
    62 / 2835,
    1382 / 155925,
    21844 / 6081075,
    929569 / 638512875,
    6404582 / 10854718875,
    443861162 / 1856156927625,
    18888466084 / 194896477400625,
)


@cache
def splitting(turn: str, *, compensated: bool) -> Kernel:
    """Return the kernel of kicks and drifts: l by the torque at fixed e, e turned about fixed l.

    Its table holds the lengths of the kicks, times g, and those of the drifts.

    Parameters
    ----------
    turn : str
        ``exact``, the rotation by |l| h, or ``cayley``, by 2 atan(|l| h / 2).
    compensated : bool
        Whether what each sum loses is carried along, in five words of `work`.
    """
    added, turned = added_up(compensated=compensated), _turns(turn)

    def advance(y: Any, work: Any, g: float, l_z: float, table: Any, steps: int) -> int:
        kicks, drifts = table[0], table[1]
        last = kicks.size - 1
        e_x, e_y, e_z, l_x, l_y = y[0], y[1], y[2], y[3], y[4]
        w_x, w_y, w_z, w_4, w_5 = work[0], work[1], work[2], work[3], work[4]
        for _ in range(steps):
            for i in range(last):
                l_x, w_4 = added(l_x, w_4, -kicks[i] * e_y)
                l_y, w_5 = added(l_y, w_5, kicks[i] * e_x)
                d_x, d_y, d_z = turned(e_x, e_y, e_z, l_x, l_y, l_z, drifts[i])
                e_x, w_x = added(e_x, w_x, d_x)
                e_y, w_y = added(e_y, w_y, d_y)
                e_z, w_z = added(e_z, w_z, d_z)
            l_x, w_4 = added(l_x, w_4, -kicks[last] * e_y)
            l_y, w_5 = added(l_y, w_5, kicks[last] * e_x)
        y[0], y[1], y[2], y[3], y[4] = e_x, e_y, e_z, l_x, l_y
        work[0], work[1], work[2], work[3], work[4] = w_x, w_y, w_z, w_4, w_5
        return 0

    return compiled(advance)


def _turns(turn: str) -> Any:
    """Return the change of e turned about l, with t = tan(angle/2)/|l| by Rodrigues.

    That is 2t/(1 + t^2 l^2) (l x e + t l x (l x e)): orthogonal for any t, so that what rounds t
    changes an angle and no length.
    """
    from numba import njit

    share = njit(inline="always")({"exact": _exact, "cayley": _cayley}[turn])

    def turned(
        e_x: float, e_y: float, e_z: float, l_x: float, l_y: float, l_z: float, h: float
    ) -> tuple[float, float, float]:
        square = l_x * l_x + l_y * l_y + l_z * l_z
        t = share(square, h)
        s = 2 * t / (1 + t * t * square)
        u_x, u_y, u_z = l_y * e_z - l_z * e_y, l_z * e_x - l_x * e_z, l_x * e_y - l_y * e_x
        d_x = s * (u_x + t * (l_y * u_z - l_z * u_y))
        d_y = s * (u_y + t * (l_z * u_x - l_x * u_z))
        d_z = s * (u_z + t * (l_x * u_y - l_y * u_x))
        return d_x, d_y, d_z

    return njit(inline="always")(turned)


def _exact(square: float, h: float) -> float:
    """Return tan(a)/|l|, a = |l| h/2."""
    half = h / 2
    x = square * half * half
    if x < 0.0625:  # the series, whose first term left out is below 1e-17 of the whole
        y = x * x
        z = y * y
        t = (_T[1] + _T[2] * x) + (_T[3] + _T[4] * x) * y
        t = t + ((_T[5] + _T[6] * x) + (_T[7] + _T[8] * x) * y) * z
        t = t + ((_T[9] + _T[10] * x) * z) * z
        return half + half * (x * t)
    length = math.sqrt(square)
    return math.tan(length * half) / length


def _cayley(square: float, h: float) -> float:
    return h / 2
