"""Compiled methods of fixed step in the axis form: splittings and Gauss collocation.

A splitting alternates kicks (l by the torque) and turns (e about l). Methods for q'' = f(q)
(Runge-Kutta-Nystroem) apply: the kick depends on e alone and the free motion is quadratic in l, so
that the bracket of three kicks and a turn is 0. Collocation is iterated until two sweeps agree or
rounding keeps them apart (Hairer, Lubich & Wanner, chapter VIII); its sums are compensated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from functools import cache, partial
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from flint import arb, arb_mat

from heavytop.comparison.steppers import FixedStep, InitialValueProblem, Kernel, compiled, summation
from heavytop.exact.balls import working
from heavytop.exact.pairs import Array, two_product

Turn = Literal["exact", "cayley"]

_COEFFICIENT_BITS = 256  # of the coefficients of collocation
_SWEEPS = 200  # most in a step
_CONVERGED = 1e-11  # an iteration that stops with a larger change has not converged


def splitting(
    lengths: tuple[Array, Array],
    problem: InitialValueProblem,
    setting: float,
    steps: int,
    *,
    turn: Turn = "exact",
    compensated: bool = False,
) -> FixedStep:
    """Return the stepper of a splitting with so many steps a period.

    Parameters
    ----------
    lengths : pair of ndarray, shapes (s + 1,) and (s,)
        Lengths, in steps, of the kicks (l by the torque at fixed e) and of the drifts between them
        (e about fixed l).
    problem, setting, steps
        As of `heavytop.comparison.methods.MethodEntry.build`.
    turn : str
        ``exact``, the rotation by |l| h, or ``cayley``, by 2 atan(|l| h / 2).
    compensated : bool
        Whether sums are compensated: what each loses is carried along.
    """
    g, l_z = (problem.constants[name] for name in ("g", "l_z"))
    h, (kicks, drifts) = problem.span / setting, lengths
    table = h * np.vstack([g * kicks, np.append(drifts, 0.0)])
    kernel, seconds = _steps(turn, compensated=compensated)
    advance, carried = partial(kernel, g, l_z, table), 5 if compensated else 0
    return FixedStep(start=problem.start, h=h, advance=advance, steps=steps, carried=carried,
                     scratch=5 - carried, compile_s=seconds)  # fmt: skip


# The first half of symmetric compositions of Strang's step, and the middle one.

# Sofroniou & Spaletta (2005): order 10, 35 stages.
SOFRONIOU_SPALETTA_10 = (
    "0.078795722521686419263907679337684", "0.31309610341510852776481247192647",
    "0.027918383235078066109520273275299", "-0.22959284159390709415121339679655",
    "0.13096206107716486317465685927961", "-0.26973340565451071434460973222411",
    "0.074973343155891435666137105641410", "0.11199342399981020488957508073640",
    "0.36613344954622675119314812353150", "-0.39910563013603589787862981058340",
    "0.10308739852747107731580277001372", "0.41143087395589023782070411897608",
    "-0.0048663605831352617621956593099771", "-0.39203335370863990644808193642610",
    "0.051942502962449647037182904015976", "0.050665090759924496335874344156866",
    "0.049674370639729879054568800279461", "0.049317735759594537917680008339338",
)  # fmt: skip

# Blanes & Moan (2002), Table 3, the scheme of order 6 with 14 stages that begins with a drift; the
# middle drift and the two middle kicks follow from the sums being 1.
BLANES_MOAN_DRIFTS = (
    "0.0378593198406116", "0.102635633102435", "-0.0258678882665587", "0.314241403071447",
    "-0.130144459517415", "0.106417700369543", "-0.00879424312851058",
)  # fmt: skip
BLANES_MOAN_KICKS = (
    "0.09171915262446165", "0.183983170005006", "-0.05653436583288827",
    "0.004914688774712854", "0.143761127168358", "0.328567693746804",
)  # fmt: skip


def composition(half: Sequence[str]) -> tuple[Array, Array]:
    """Return kicks and drifts of a symmetric composition of Strang's steps, given its first half.

    The last of the lengths is the middle one.
    """
    drifts = [Fraction(x) for x in half]
    kicks = [(a + b) / 2 for a, b in pairwise([Fraction(0), *drifts])]
    return _mirror(kicks, drifts)


def blanes_moan() -> tuple[Array, Array]:
    """Return Blanes and Moan's 16 kicks, the first and the last 0, and 15 drifts."""
    drifts = [Fraction(x) for x in BLANES_MOAN_DRIFTS]
    kicks = [Fraction(x) for x in ("0", *BLANES_MOAN_KICKS)]
    kicks.append(Fraction(1, 2) - sum(kicks, Fraction(0)))
    drifts.append(1 - 2 * sum(drifts, Fraction(0)))
    return _mirror(kicks, drifts)


def _mirror(kicks: Sequence[Fraction], drifts: Sequence[Fraction]) -> tuple[Array, Array]:
    """Return all kicks and drifts, given the first halves; the last drift is the middle one."""
    return np.array([*kicks, *kicks[::-1]], float), np.array([*drifts, *drifts[-2::-1]], float)


STRANG = partial(splitting, composition(["1"]))
BLANES_MOAN = partial(splitting, blanes_moan())
SOFRONIOU_SPALETTA = partial(splitting, composition(SOFRONIOU_SPALETTA_10), compensated=True)
BOBENKO_SURIS = partial(splitting, composition(["1"]), turn="cayley")
"""The integrable discrete Lagrange top, with the momentum half a kick later."""


@cache
def _steps(turn: Turn, *, compensated: bool) -> tuple[Kernel, float]:
    """Return compiled steps of a splitting, and the compile time [s]; `work` holds five lost words.

    The number of forces leaves out the last kick, which is the next step's first.
    """
    added, turned = summation(compensated=compensated), _turns(turn)

    def advance(g: float, l_z: float, table: Any, y: Any, work: Any, steps: int) -> int:
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
        forces: int = last - 1 if kicks[0] == 0 else last
        return forces * steps

    return compiled(advance)


def _turns(turn: Turn) -> Any:
    """Return the compiled function for the change of e that is turned about l (Rodrigues).

    With t = tan(angle/2)/|l| it is 2t/(1 + t^2 l^2) (l x e + t l x (l x e)): orthogonal for any t,
    so that rounding of t changes the angle and no length.
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


def _tangent(terms: int) -> tuple[float, ...]:
    """Return the coefficients of the series of tan(a)/a in a^2, from tan' = 1 + tan^2."""
    found = [Fraction(1)]
    for n in range(1, terms):
        square = (a * b for a, b in zip(found, found[::-1], strict=True))
        found.append(sum(square, Fraction(0)) / (2 * n + 1))
    return tuple(float(x) for x in found)


_T = _tangent(11)


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
    """Return tan(a)/|l| of a turn by 2a = 2 atan(|l| h/2)."""
    return h / 2


# --- collocation ---------------------------------------------------------------------------------


def gauss(s: int, problem: InitialValueProblem, setting: float, steps: int) -> FixedStep:
    """Return the stepper of Gauss' collocation with s nodes; with one, the implicit midpoint rule.

    `setting` is the number of steps a period, `steps` that in a block.
    """
    g, l_z = (problem.constants[name] for name in ("g", "l_z"))
    h, (high, rest, beyond) = problem.span / setting, coefficients(s)
    product, error = two_product(np.full_like(high, h), high)
    table = np.ascontiguousarray(np.vstack([product, h * beyond, error + h * rest]))
    kernel, seconds = _gauss_steps(s)
    advance = partial(kernel, g, l_z, table)
    return FixedStep(start=problem.start, h=h, advance=advance, steps=steps, carried=5,
                     scratch=1 + 5 * s, compile_s=seconds)  # fmt: skip


@cache
def coefficients(s: int) -> tuple[Array, Array, Array]:
    """Return A transposed above b, shape (s + 1, s), as doubles and the rest, and an extrapolation.

    In doubles alone A and b are not quite symplectic, and the energy drifts (Hairer, McLachlan &
    Razakarivony 2008). The third matrix, shape (s, s), predicts the next step: along the polynomial
    through the derivatives at the nodes its transpose takes these to the increments up to the nodes
    of the next step.
    """
    with working(_COEFFICIENT_BITS):
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


@cache
def _gauss_steps(s: int) -> tuple[Kernel, float]:
    """Return compiled steps of collocation, and the compile time [s].

    `table` has h times A transposed, b, the extrapolation, and the rests of A and of b. A step
    starts from increments z at the nodes, extrapolated from the step before, and iterates until
    they change no more. `work` holds five lost words, whether there is a step before, and its
    derivatives (5, s). The rests of A and b, of the size of rounding, are applied once a step.
    """
    added, (rates, weighed) = summation(compensated=True), _sweep(s)

    def advance(g: float, l_z: float, table: Any, y: Any, work: Any, steps: int) -> int:
        A, b, beyond = table[:s], table[s], table[s + 1 : 2 * s + 1]
        rest_of_A, rest_of_b = table[2 * s + 1 : 3 * s + 1], table[3 * s + 1]
        z, rest, none = np.zeros((5, s)), np.zeros((5, s)), np.zeros((5, s))
        f = work[6:].reshape((5, s))
        near = _CONVERGED * (1 + abs(b.sum() * g))
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
    """Return compiled functions for the derivatives at s nodes, and for their weighted sums."""
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
