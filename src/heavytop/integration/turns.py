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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.integration.winding import CLOSE, GRAIN, in_sense, principal, turns_behind

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]

CAUTION = 0.9  # of Sturm's time: K is known to rounding and drift, not better
Real = Any  # of heyoka, or any type that has arithmetic and numpy's functions
Pair = tuple[Real, Real]  # phi and psi, or a real and an imaginary part


@dataclass(frozen=True, slots=True)
class Turns:
    """What directs and bounds the turning, for one motion.

    Attributes
    ----------
    g, l_z, P_plus, P_minus : float
        gMR/A, p_phi/A, (p_phi + p_psi)/A and (p_phi - p_psi)/A.
    grain, close : float
        How well a state is known, and how near to a pole it may have drifted to the other side.
    """

    g: float
    l_z: float
    P_plus: float
    P_minus: float
    grain: float = GRAIN
    close: float = CLOSE

    @classmethod
    def of(
        cls, parameters: Mapping[str, float], grain: float = GRAIN, close: float = CLOSE
    ) -> Turns:
        """Return the turns of the motions that have these constants."""
        g, l_z, *P = (parameters[name] for name in ("g", "l_z", "P_plus", "P_minus"))
        return cls(g, l_z, P[0], P[1], grain, close)

    def stiffness(self, state: Array) -> float:
        """Return a bound K of l^2/4 + g |beta|^2 and l^2/4 - g |alpha|^2 over the motion."""
        q_0, q_1, q_2, q_3, l_x, l_y = state[:6].tolist()
        upper, lower = q_0 * q_0 + q_3 * q_3, q_1 * q_1 + q_2 * q_2
        energy = l_x * l_x + l_y * l_y + self.l_z * self.l_z + 2 * self.g * (upper - lower)
        return float(energy / 4 + 1.5 * abs(self.g) * (upper + lower))

    def decided(self, state: Array) -> float:
        """Return over how long a time a change is decided [s]; inf where nothing moves."""
        K, (alpha, beta) = self.stiffness(state), self._arms(state[None])
        moves = alpha.rate[0] or beta.rate[0] or self.g * alpha.z[0] * beta.z[0]
        return CAUTION * math.pi / math.sqrt(K) if moves and 0 < K < math.inf else math.inf

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
        da, db = alpha.changes(forward), beta.changes(forward)
        a, b = alpha.argument(self.grain), beta.argument(self.grain)
        lean = alpha.lean(a[0]), beta.lean(b[0])
        first = first[0] + lean[0] + lean[1], first[1] + lean[0] - lean[1]
        if not (alpha.aside and beta.aside):
            a, b, da, db = _upright((alpha.resting, beta.resting), a, b, da, db, first[0])
        phi, psi = (_summed(*x) for x in zip(first, (da + db, da - db), strict=True))
        return np.stack((_nearest(a + b, phi), _nearest(a - b, psi)), axis=-1)

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
        fastest = math.sqrt(self.stiffness(rows[0]))
        return (
            _Arm(alpha, -w * beta.conj(), self.l_z, self.P_plus, fastest, self.close),
            _Arm(beta, w * alpha.conj(), self.l_z, self.P_minus, fastest, self.close),
        )


class _Arm:
    """alpha or beta at some times; P is four times its angular momentum.

    Its rate is half of i l_z z + push, and changes at `fastest` [rad/s].
    """

    def __init__(
        self, z: Complex, push: Complex, l_z: float, P: float, fastest: float, close: float
    ) -> None:
        self.z, self.P, self.fastest, self.close = z, P, fastest, close
        self.size = np.abs(z)
        self.aside = bool(self.size.min() > close)
        self._push, self._l_z = push, l_z

    @property
    def rate(self) -> Complex:
        return (1j * self._l_z * self.z + self._push) / 2

    def changes(self, forward: float) -> Array:
        """Return by how much the argument changes from each time to the next."""
        change = principal(np.diff(self.argument(self.close)))
        return in_sense(-forward if self.P < 0 else forward, change)

    def lean(self, first: float) -> float:
        """Return by how much what `changes` begin with is ahead of the first argument."""
        return float(principal(self.argument(self.close)[0] - first))

    def argument(self, close: float) -> Array:
        """Return the argument; so close to the pole as that, what it was before or will be after.

        A pass at a distance of |P|/4|rate| is not told by a state that has drifted, whose angular
        momentum is another one, but by the constants of the motion: up to the pole the argument
        stays, and there it jumps.
        """
        if self.aside:
            return np.angle(self.z)
        rate, speed = self.rate, np.abs(self.rate)
        drifted = np.abs(4 * (self.z.conj() * rate).imag - self.P) >= abs(self.P) / 2
        passing = drifted & (self.size < close) & (self.size * self.fastest < speed)
        passing &= abs(self.P) < 2 * self.close * speed
        before = (self.z.conj() * rate).real < 0
        return np.angle(np.where(passing, np.where(before, -rate, rate), self.z))

    @property
    def resting(self) -> Mask:
        """Tell where it vanishes and stays: the axis is on the vertical."""
        vanishing: Mask = (self.z == 0) & (self.rate == 0)
        return vanishing

    def behind(self, half: float) -> float:
        """Return what to add to the argument at a start, for it to be that in which it leaves."""
        rate = self.rate[0]
        if self.z[0] != 0 or rate == 0:
            return 0.0
        off = float(np.angle(rate)) - half
        return off + turns_behind(off)


def _upright(
    rests: tuple[Mask, Mask], a: Array, b: Array, da: Array, db: Array, phi: float
) -> tuple[Array, Array, Array, Array]:
    """Return arguments and their changes; on the vertical those with which phi stays."""
    for_alpha, for_beta = (x[1:] | x[:-1] for x in rests)
    da, db = np.where(for_alpha, -db, da), np.where(for_beta, -da, db)
    stays = _summed(phi, da + db)
    return np.where(rests[0], stays - b, a), np.where(rests[1], stays - a, b), da, db


def _summed(first: float, changes: Array) -> Array:
    return first + np.concatenate(([0.0], np.cumsum(changes)))


def _nearest(principal: Array, angle: Array) -> Array:
    """Return the value nearest to an angle among those a number of turns from a principal one."""
    nearest: Array = principal + 2 * np.pi * np.round((angle - principal) / (2 * np.pi))
    return nearest


def arm_rates(state: Sequence[Real], l_z: Real) -> tuple[Pair, Pair]:
    """Return the rates of alpha and beta."""
    q_0, q_1, q_2, q_3, l_x, l_y = state
    alpha = (-l_z * q_3 - l_x * q_1 - l_y * q_2, l_z * q_0 - l_y * q_1 + l_x * q_2)
    beta = (-l_z * q_2 + l_x * q_0 + l_y * q_3, l_z * q_1 + l_y * q_0 - l_x * q_3)
    return (alpha[0] / 2, alpha[1] / 2), (beta[0] / 2, beta[1] / 2)
