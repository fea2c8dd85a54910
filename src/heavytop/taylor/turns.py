"""How often the attitude has turned: phi and psi, continuous, from the quaternion.

The quaternion of the attitude form gives two complex numbers, with psi less its uniform part,

    alpha = q_0 + i q_3 = cos(theta/2) exp(i (phi + psi)/2),
    beta  = q_1 + i q_2 = sin(theta/2) exp(i (phi - psi)/2),

whose arguments are known modulo 2 pi. Each obeys Hill's equation, a central force in its plane,

    alpha'' = -(l^2/4 + g |beta|^2) alpha,     beta'' = -(l^2/4 - g |alpha|^2) beta,

whose angular momenta are P_plus/4 and P_minus/4: their signs are the senses in which the arguments
turn, without ever turning back. An argument that turned by pi would make the real part of alpha
or beta, seen from a suitable direction, vanish twice; by Sturm's comparison theorem that takes at
least pi/sqrt(K), where K bounds the factor in the brackets. Over a shorter time an argument
changes by less than pi in a known sense, and its value modulo 2 pi tells by how much. No pole is
an exception: a pass close to it, or through it, is half a turn in the sense of P, forward in time
where P is exactly zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heavytop.taylor.winding import CLOSE, GRAIN, SLACK

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]

CAUTION = 0.9  # of Sturm's time: K is known to rounding and drift, not better


@dataclass(frozen=True, slots=True)
class Turns:
    """What directs and bounds the turning, for one motion.

    Attributes
    ----------
    g, l_z, P_plus, P_minus : float
        gMR/A, p_phi/A, (p_phi + p_psi)/A and (p_phi - p_psi)/A.
    """

    g: float
    l_z: float
    P_plus: float
    P_minus: float

    @classmethod
    def of(cls, parameters: Mapping[str, float]) -> Turns:
        """Return the turns of the motions that have these constants."""
        return cls(*(parameters[name] for name in ("g", "l_z", "P_plus", "P_minus")))

    def stiffness(self, state: Array) -> float:
        """Return a bound K of l^2/4 + g |beta|^2 and l^2/4 - g |alpha|^2 over the motion."""
        q_0, q_1, q_2, q_3, l_x, l_y = state[:6].tolist()
        upper, lower = q_0 * q_0 + q_3 * q_3, q_1 * q_1 + q_2 * q_2
        energy = l_x * l_x + l_y * l_y + self.l_z * self.l_z + 2 * self.g * (upper - lower)
        return float(energy / 4 + 1.5 * abs(self.g) * (upper + lower))

    def decided(self, state: Array) -> float:
        """Return over how long a time a change is decided [s]; inf where nothing moves."""
        K = self.stiffness(state)
        alpha, beta = self._arms(state[None])
        moving = np.any(alpha.rate) or np.any(beta.rate) or np.any(self.g * alpha.z * beta.z)
        return float(CAUTION * np.pi / np.sqrt(K)) if moving and 0 < K < np.inf else np.inf

    def followed(self, t: Array, rows: Array, first: tuple[float, float]) -> Array:
        """Return phi and psi, shape (k, 2) [rad].

        Parameters
        ----------
        t : ndarray, shape (k,)
            Times, monotonic, no two neighbours farther apart than is `decided` [s].
        rows : ndarray, shape (k, n)
            States there.
        first : tuple of float
            phi and psi at the first of them [rad].
        """
        alpha, beta = self._arms(rows)
        forward = 1.0 if t[-1] >= t[0] else -1.0
        slow = GRAIN * np.sqrt(self.stiffness(rows[0]))
        rests = alpha.resting(slow), beta.resting(slow)
        da, db = _at_rest(alpha.changes(forward), beta.changes(forward), rests)
        phi, psi = (_summed(*x) for x in zip(first, (da + db, da - db), strict=True))
        u, v, turned = alpha.direction(), beta.direction(), np.exp(1j * phi)
        u, v = np.where(rests[0], turned * v.conj(), u), np.where(rests[1], turned * u.conj(), v)
        seen = np.where(rests[0] | rests[1], phi, _nearest(u * v, phi))
        return np.stack((seen, _nearest(u * v.conj(), psi)), axis=-1)

    def started(self, state: Array, phi: float, psi: float) -> tuple[float, float]:
        """Return phi and psi at the start.

        On a pole phi is that in which the axis leaves, phi or phi + pi, and psi compensates.
        """
        halves = (phi + psi) / 2, (phi - psi) / 2
        more = [arm.behind(x) for arm, x in zip(self._arms(state[None]), halves, strict=True)]
        return phi + more[0] + more[1], psi + more[0] - more[1]

    def _arms(self, rows: Array) -> tuple[_Arm, _Arm]:
        q_0, q_1, q_2, q_3, l_x, l_y = rows[:, :6].T
        alpha, beta, w = q_0 + 1j * q_3, q_1 + 1j * q_2, l_x + 1j * l_y
        alpha_dot = (1j * self.l_z * alpha - w * beta.conj()) / 2
        beta_dot = (1j * self.l_z * beta + w * alpha.conj()) / 2
        return _Arm(alpha, alpha_dot, self.P_plus), _Arm(beta, beta_dot, self.P_minus)


@dataclass(frozen=True, slots=True)
class _Arm:
    """alpha or beta at some times, its rate, and four times its angular momentum."""

    z: Complex
    rate: Complex
    P: float

    def changes(self, forward: float) -> Array:
        """Return by how much the argument changes from each time to the next."""
        told = np.where(self._passing(CLOSE), self._leaving(), self.z)
        change = np.diff(np.angle(told))
        change -= 2 * np.pi * np.round(change / (2 * np.pi))
        sense = -forward if self.P < 0 else forward
        return np.where(sense * change < -np.pi / 2, change + sense * 2 * np.pi, change)

    def _passing(self, distance: float) -> Mask:
        """Tell where it is so close to the pole that the constants must say on which side.

        A pass at a distance of |P|/4|rate| is not told by a state that has drifted.
        """
        return (np.abs(self.z) < distance) & (abs(self.P) < 2 * CLOSE * np.abs(self.rate))

    def _leaving(self) -> Complex:
        """Return what points where it comes from before a pass, and where it goes to after it."""
        before = (self.z.conj() * self.rate).real < 0
        return np.where(before, -self.rate, self.rate)

    def resting(self, slow: float) -> Mask:
        """Tell where it vanishes and stays: the axis is on the vertical."""
        return (np.abs(self.z) < GRAIN) & (np.abs(self.rate) < slow)

    def direction(self) -> Complex:
        """Return a number of its argument; on the pole itself, of that in which it leaves."""
        return np.where(self._passing(GRAIN), self._leaving(), self.z)

    def behind(self, half: float) -> float:
        """Return what to add to the argument at a start, for it to be that in which it leaves."""
        if self.z[0] != 0 or self.rate[0] == 0:
            return 0.0
        off = float(np.angle(self.rate[0])) - half
        return off - 2 * np.pi * math.floor(off / (2 * np.pi) + SLACK)


def _at_rest(da: Array, db: Array, rests: tuple[Mask, Mask]) -> tuple[Array, Array]:
    """Return the changes, where the axis rests on the vertical such that phi stays."""
    for_alpha, for_beta = (x[1:] | x[:-1] for x in rests)
    return np.where(for_alpha, -db, da), np.where(for_beta, -da, db)


def _summed(first: float, changes: Array) -> Array:
    return first + np.concatenate(([0.0], np.cumsum(changes)))


def _nearest(z: Complex, angle: Array) -> Array:
    """Return the argument of z on the branch nearest to an angle."""
    principal = np.angle(z)
    nearest: Array = principal + 2 * np.pi * np.round((angle - principal) / (2 * np.pi))
    return nearest
