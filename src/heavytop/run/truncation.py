"""What the steps of a run leave out: forecast from the series that they truncate.

The tolerance of a step sets the order p of its series, and that with the coefficients of the orders
p and p − 1 its length, h = ρ exp(−2 − 0.7/(p − 1)). What it leaves out are the terms beyond. At
places of one nutation, from the closed form, they tell what steps do to the axis, and what to the
constants: the energy, l·e and |e|². That has a sign: constants are off by t, with them the
frequencies, whose derivatives the closed form knows too, and phase is off by t².
"""

from __future__ import annotations

import math
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.many_motions import motions_many
from heavytop.analytic.motion import Motion
from heavytop.integration.paces import units_of

PLACES: Final = 32  # of a nutation, evenly spread in time
MOST: Final = 20  # orders of the coefficients: those of the loosest steps count no more than these
SHIFT: Final = 1e-6  # of the constants by which frequencies are differentiated, relative,
SHARE: Final = 1e-3  # or less: so much of the kinetic energy that it may take
SURE: Final = 0.01  # of the drift of the constants that has no sign to cancel

Array = NDArray[Any]


class TruncationLoss(NamedTuple):
    """What N periods lose by truncation: N × `aside`, and N × `bent` + N² × `late`.

    Attributes
    ----------
    steps : float
        In a period.
    aside : float
        Of the states, each relative to the size of its kind.
    bent, late : ndarray, shape (3,)
        Of phase [s], φ and ψ [rad]: by constants that shake within a period, and that drift.
    """

    steps: float
    aside: float
    bent: Array
    late: Array


def order_of(tolerance: float) -> int:
    """The order of the series that heyoka takes for a tolerance.

    >>> [order_of(x) for x in (1e-6, 1e-11, 2.0**-52)]
    [8, 14, 20]
    """
    return math.ceil(1 - math.log(tolerance) / 2)


class Truncation:
    """The series of the axis form along a motion that nutates."""

    def __init__(self, motion: Motion, variant: str | None) -> None:
        r, period = motion.reduced, motion.period
        assert period is not None
        at = motion.double((np.arange(PLACES) + 0.5) * period / PLACES)
        turned, sine = np.exp(1j * at.phi), np.sqrt(at.one_minus_u * at.one_plus_u)
        L = (at.thetadot - 1j * (float(r.b) - at.phidot * at.u) * sine) * turned
        fastest = np.hypot(abs(L[0]), math.sqrt(2 * abs(float(r.g))))
        self.pace = pace = float(units_of(fastest))
        self.g, self.l_z, n = float(r.g) / pace**2, float(r.a) / pace, float(r.b) / pace
        self.period = period * pace
        self.axis = _axis_series(-1j * sine * turned, at.u, L / pace, self.g, self.l_z)
        self.slopes = _slopes(at, self.g, n, self.l_z, pace)
        self.own = self.axis
        if variant in ("sigma", "delta"):
            side = 1 if variant == "sigma" else -1
            self.own = (*self.axis, _quadrature_series(self.axis[1], self.l_z + side * n, side))
        self.sizes = np.max([np.maximum(abs(x.real), abs(x.imag)) for x in self.own], axis=0)

    def __call__(self, order: int) -> TruncationLoss:
        """What steps of so many orders lose."""
        p, T, (E, z, L) = order, self.period, self.axis
        within = np.maximum(1.0, self.sizes[0]) / self.sizes[[p, p - 1]]
        h = np.min(within ** (1 / np.array([[p], [p - 1]])), axis=0) * math.exp(-2 - 0.7 / (p - 1))
        powers = h ** np.arange(MOST + 1)[:, None]
        off = [np.sum((x * powers)[p + 1 :], axis=0) / h for x in self.own]
        e, u, m = (np.sum(x * powers, axis=0) for x in (E, z, L))  # where a step ends
        dE, dz, dL = off[:3]
        drifts = self.slopes @ (
            np.real(m.conj() * dL) + self.g * dz,
            np.real(m.conj() * dE + e.conj() * dL) + self.l_z * dz,
            2 * np.real(e.conj() * dE) + 2 * u * dz,
        )
        mean = drifts.mean(axis=1)
        shaken = np.cumsum(drifts - mean[:, None], axis=1) * T / PLACES
        drift = np.maximum(abs(mean), SURE * abs(drifts).mean(axis=1))
        unit = np.array([self.pace, 1.0, 1.0])
        rates = max(1.0, abs(L[0]).max())
        aside = np.max([abs(dE), abs(dz), abs(dL) / rates, *map(abs, off[3:])], axis=0).mean() * T
        late, bent = T * T / 2 * drift / unit, T * abs(shaken).max(axis=1) / unit
        return TruncationLoss(float(np.mean(T / h)), float(aside), bent, late)


def _axis_series(E0: Array, z0: Array, L0: Array, g: float, l_z: float) -> tuple[Array, ...]:
    """Coefficients of e_x + i e_y, e_z and l_x + i l_y, shape (orders, places)."""
    E, z, L = (np.zeros((MOST + 1, PLACES), x.dtype) for x in (E0, z0, L0))
    E[0], z[0], L[0] = E0, z0, L0
    for k in range(MOST):
        back = L[k::-1]
        E[k + 1] = 1j * (l_z * E[k] - np.sum(z[: k + 1] * back, axis=0)) / (k + 1)
        z[k + 1] = np.sum(E[: k + 1] * back.conj(), axis=0).imag / (k + 1)
        L[k + 1] = 1j * g * E[k] / (k + 1)
    return E, z, L


def _quadrature_series(z: Array, P: float, side: int) -> Array:
    """Coefficients of the integral of P/(1 ± e_z), but for a uniform rotation."""
    quotient, found = np.zeros_like(z), np.zeros_like(z)
    quotient[0] = 1 / (1 + side * z[0])
    for k in range(MOST):
        found[k + 1] = P * quotient[k] / (k + 1)
        known = np.sum(z[1 : k + 2] * quotient[k::-1], axis=0)
        quotient[k + 1] = -side * quotient[0] * known
    return found


def _slopes(at: Any, g: float, n: float, l_z: float, pace: float) -> Array:
    """Derivatives of T, Δφ and Δψ − κT by the constants, all of it divided by T.

    Who is late by δT and turned by δΔφ is off by ẋ δT and ∂x/∂φ δΔφ. The derivatives are those of
    a top of A = C = 1 whose weight is |e| times as large, and its p_psi 1/|e| times.
    """
    k = int(np.argmax(abs(at.udot)))
    u, sine2, speed2 = at.u[k], at.one_minus_u[k] * at.one_plus_u[k], (at.thetadot[k] / pace) ** 2
    across = l_z - n * u
    kinetic = (speed2 + across**2 / sine2) / 2
    sizes = np.array([kinetic, abs(n) + math.sqrt(kinetic), 1.0])
    turning = abs(across) / sine2
    taken = np.array([1.0, abs(n) + turning, abs(g) + n * n + turning * abs(n)])
    shifts = np.minimum(SHIFT * sizes, SHARE * speed2 / taken)
    energy, along, square = np.concatenate((np.diag(shifts), -np.diag(shifts))).T
    length = np.sqrt(1 + square)
    spin, weight = (n + along) / length, g * length
    phidot = (l_z - spin * u) / sine2
    kinetic = kinetic + energy + (n**2 - spin**2) / 2 + (g - weight) * u
    left = np.maximum(2 * kinetic - phidot**2 * sine2, 0.0)
    moved = motions_many(
        A=1.0, C=1.0, gMR=weight, theta=at.theta[k], omega3=spin, phidot=phidot,
        thetadot=np.copysign(np.sqrt(left), at.thetadot[k]),
    )  # fmt: skip
    rows = np.array([moved.period, moved.precession, moved.spin]) / moved.period.mean()
    slopes: Array = (rows[:, :3] - rows[:, 3:]) / (2 * shifts)
    return slopes
