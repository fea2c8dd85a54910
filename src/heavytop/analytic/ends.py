"""Angles and counts of events of many motions, each at its own time, in arrays.

A motion is at x = w t + x₀, counted from a passage through u₁, and Φ± grow by Legendre's integrals
of the third kind. Numbers that are not shown to be reliable are nan; `heavytop.Motion` has them.
References: B. C. Carlson (1995), *Numer. Algorithms* 10, 13-26; R. Bulirsch (1965), *Numer. Math.*
7, 78-90; *NIST Digital Library of Mathematical Functions*, sections 19.7 and 19.25.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple

import numpy as np

from heavytop.analytic import many
from heavytop.analytic.events import COUNT_EDGE
from heavytop.analytic.many import Nutations
from heavytop.classification.arrays import Starts
from heavytop.exact.pairs import Array

DUPLICATIONS: Final = 16  # each leaves a quarter of a difference, and its square is dropped
# error of cos θ; over the range of cos θ it is an error of times, in periods
HEIGHT_ROUNDING: Final = 1e-12
LEAST_COUNTED: Final = 1e-6  # least range of cos θ, and least part of it, with counted events
NO_ZERO: Final = 2.0**-400  # added to what is divided by


class Ends(NamedTuple):
    """Angles and counts of events at the ends of spans; nan where they are not known.

    Attributes
    ----------
    theta, phi, psi : ndarray, shape (k,)
        Euler's angles, φ and ψ continuous from the start [rad].
    doubt : ndarray, shape (k,)
        A bound of the error of the axis [rad].
    counts : mapping from str to ndarray, shape (2, k)
        The least and the greatest number of turning points and of reversals.
    """

    theta: Array
    phi: Array
    psi: Array
    doubt: Array
    counts: Mapping[str, Array]


def ends_many(start: Mapping[str, Array], time: Array) -> Ends:
    """Return the angles of motions, and their counts of events, at one time for each.

    Parameters
    ----------
    start : mapping from str to ndarray, shape (k,)
        A, C, gMR, and Euler's angles and their rates.
    time : ndarray, shape (k,)
        Since the start [s], of either sign.

    Examples
    --------
    >>> book = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456, "theta": 0.1, "phi": 0, "psi": 0}
    >>> start = {**book, "thetadot": 0, "phidot": -15, "psidot": 140}
    >>> start = {name: np.array([float(x)]) for name, x in start.items()}
    >>> found = ends_many(start, np.array([2.0]))
    >>> print(found.theta, found.phi, found.counts["turning"].T)
    [0.42694371] [15.1169641] [[8. 8.]]
    """
    names = ("A", "C", "gMR", "theta", "thetadot", "phidot", "psidot")
    found = np.empty((8, time.size))
    for at in range(0, time.size, many.MOTIONS_AT_ONCE):
        span = slice(at, at + many.MOTIONS_AT_ONCE)
        numbers = [start[name][span] for name in names]
        with np.errstate(all="ignore"):  # unreliable numbers may be anything
            found[:, span] = _ends(Starts._make((*numbers, "psidot")), time[span])
    theta, phi, psi, doubt = found[:4]
    counts = {"turning": found[4:6], "reversal": found[6:]}
    return Ends(theta, start["phi"] + phi, start["psi"] + psi, doubt, counts)


def _ends(starts: Starts, time: Array) -> Array:
    """Rows of θ, the advances of φ and ψ, the doubt, and the counts."""
    n, tau = Nutations(starts), time / starts.A
    K, turns = n.period_growth()
    rising = np.where(n.sign * starts.thetadot < 0, 1.0, -1.0)
    passed, begun = _integrals_from_u1(n, n.down / n.swing, n.up / n.swing)
    x = rising * passed + n.w * tau
    periods = np.rint(x / (2 * K))
    rest = x - 2 * K * periods
    sn, cn = jacobi(abs(rest), n.mc)
    _, swept = _integrals_from_u1(n, sn * sn, cn * cn)
    passes = np.stack((np.floor(x / (2 * K)) + (rising < 0), periods))  # of an exact one φ jumps
    turned = periods * turns + np.sign(rest) * swept - rising * begun
    at_bottom, at_top = turned = np.where(n.P == 0, passes * turns, turned)
    theta = many.tilt(n.sign, n.at_u2[1] + n.swing * cn * cn, n.at_u1[0] + n.swing * sn * sn)
    psi = n.sign * (n.kappa * tau + at_bottom - at_top)
    late = (abs(x) + K) * (2 + n.speed / n.w) + (abs(turned) + abs(turns)).sum(axis=0)
    known = n.known & (n.error <= many.PROMISED) & (starts.theta > 0)
    counts = _counts(n, starts, passed / (2 * K), K, tau)
    found = np.vstack((theta, at_bottom + at_top, psi, n.error * late, counts))
    return np.where(known & np.isfinite(found[:4]).all(axis=0), found, np.nan)


def _integrals_from_u1(n: Nutations, sin2: Array, cos2: Array) -> tuple[Array, Array]:
    """The integrals from u₁ to a given phase: x, and the growth of Φ₊ and Φ₋ [rad].

    Near the bottom Π(n) is nearly all sweep: it is computed from Π(m/n), without cancellation.
    """
    swing, (plus1, minus1), dn2, sine = n.swing, n.at_u1, cos2 + n.mc * sin2, np.sqrt(sin2)
    steep, flat = swing / plus1, (1 - n.mc) * plus1 / swing  # −n and −m/n
    lesser = np.minimum(steep, flat)
    p = np.stack((1 + lesser * sin2, (n.at_u2[1] + swing * cos2) / minus1))
    first, third = carlson(cos2, dn2, p)
    first, third = sine * first, np.stack((-lesser, swing / minus1)) / 3 * sin2 * sine * third
    root = np.sqrt((1 + steep) * (1 + flat))
    sweep = np.arctan2(sine * root, np.sqrt(cos2 * dn2)) / root
    bottom = np.where(flat < steep, sweep - third[0], first + third[0])
    return first, n.P / (2 * n.w * n.at_u1) * np.stack((bottom, first + third[1]))


def carlson(x: Array, y: Array, p: Array) -> tuple[Array, Array]:
    """Return R_F(x, y, 1) and R_J(x, y, 1, p), where x ≤ p ≤ y ≤ 1 or x ≤ y ≤ 1 ≤ p ≤ 2.

    p may have more rows than x and y.

    Examples
    --------
    >>> print(*carlson(np.array([0.0]), np.array([0.5]), np.array([2.0])))
    [1.85407468] [1.74284193]
    """
    z, total, scale = np.ones_like(x), np.zeros_like(p), 1.0
    spread = np.sqrt(np.maximum((p - x) * (p - y) * (p - z), 0.0))
    for _ in range(DUPLICATIONS):
        a, b, c, q = map(np.sqrt, (x, y, z, p))
        under, mean = (q + a) * (q + b) * (q + c), a * b + b * c + c * a
        angle = scale**3 * spread / under + NO_ZERO
        total += 6 * scale * scale * np.arctan(angle) / angle / under
        x, y, z, p = ((each + mean) / 4 for each in (x, y, z, p))
        scale /= 2
    middle = (x + y + z + 2 * p) / 5
    return 1 / np.sqrt((x + y + z) / 3), total + scale * scale / (middle * np.sqrt(middle))


def jacobi(x: Array, mc: Array) -> tuple[Array, Array]:
    """Return sn and cn of 0 ≤ x ≤ K, by Landen's transformation.

    Examples
    --------
    >>> print(*jacobi(np.array([1.0]), np.array([0.5])))
    [0.80300182] [0.59597657]
    """
    a, b, means = np.ones_like(mc), np.sqrt(mc), []
    for _ in range(many.MORE_STEPS):
        means.append((a, b))
        a, b = (a + b) / 2, np.sqrt(a * b)
    angle, dn = np.maximum(a * x, NO_ZERO), np.ones_like(mc)
    ratio = np.cos(angle) / np.sin(angle)
    c = a * ratio
    for a, b in reversed(means):
        above = ratio * c
        c, dn = c * dn, (b + above) / (a + above)
        ratio = c / a
    sn = 1 / np.sqrt(c * c + 1)
    return sn, abs(c) * sn


def _counts(n: Nutations, starts: Starts, ahead: Array, K: Array, tau: Array) -> Array:
    """Rows of the least and the greatest number of turning points, and of reversals."""
    end = abs(tau) * n.w / (2 * K)
    onward = np.where(starts.still, n.up == 0, n.sign * starts.thetadot * tau < 0)  # to u₂
    ahead = np.where(n.up == 0, 0.5, np.clip(ahead, 0.0, 0.5))
    lower = np.where(onward, 1 - ahead, ahead)
    swing = np.where(n.swing < LEAST_COUNTED, np.nan, n.swing)
    slack = COUNT_EDGE * (1 + end) + HEIGHT_ROUNDING / swing
    ends = np.stack((np.maximum(end - slack, 0.0), end + slack))
    turning = _count_until(ends, lower, np.where(onward, 0.5 - ahead, 0.5 + ahead))
    # φ̇ changes its sign where u = a/b: heights from u₁ and u₂
    down, up = n.P[0] / n.b - n.at_u1[0], -n.P[1] / n.b - n.at_u2[1]
    R_F, _ = carlson(up / swing, (up + n.mc * down) / swing, np.ones_like(up))
    part = np.where(onward, 1, -1) * np.sqrt(down / swing) * R_F / (2 * K)
    one, other = np.mod(lower + part, 1.0), np.mod(lower - part, 1.0)
    one = np.where(starts.level, 0.0, one)
    least = np.minimum(down, up) / swing
    sure = least > LEAST_COUNTED
    sure &= starts.level | (abs(np.rint((one, other)) - (one, other)).min(axis=0) > slack)
    reversal = np.where(sure, _count_until(ends, one, other), np.nan)
    none = (n.P == 0).any(axis=0) | (n.b == 0) | (least < -LEAST_COUNTED)
    none |= starts.still & starts.level
    return np.vstack((turning, np.where(none, 0.0, reversal)))


def _count_until(end: Array, *fractions: Array) -> Array:
    """The number of events up to a time `end` [periods], at fixed fractions of each period."""
    return sum((np.floor(end - each) + 1 for each in fractions), np.zeros_like(end))
