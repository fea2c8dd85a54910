"""How often the top has turned: phi of the axis form, phi and psi of the attitude form.

Neither is a state of the equations: they are read off the states, which give them modulo 2 pi, and
their turns are counted along the way, in doubles. A run of more digits counts them on its own
steps: one in doubles that comes near a separatrix has lost its phase there, and would pass a pole
a turn too often or too seldom. What is less than a turn is read to all digits of the states.

Two complex numbers, with psi less its uniform part,

    alpha = q_0 + i q_3 = cos(theta/2) exp(i (phi + psi)/2),
    beta  = q_1 + i q_2 = sin(theta/2) exp(i (phi - psi)/2),

obey Hill's equation, each a central force in its plane,

    alpha'' = -(l^2/4 + g |beta|^2) alpha,     beta'' = -(l^2/4 - g |alpha|^2) beta,

with the angular momenta P_plus/4 and P_minus/4: their signs are the senses in which the arguments
turn, without ever turning back. Let K bound the factors in the brackets. By Sturm's comparison
theorem an argument that turns by pi takes at least pi/sqrt(K), and one that turns by pi/2 takes at
least half of that, unless the modulus has its least value meanwhile.

**The quaternion** gives both arguments modulo 2 pi. Over less than pi/sqrt(K) each changes by less
than pi in a known sense, and its values modulo 2 pi tell by how much.

**The axis** gives phi, which is their sum. Over less than pi/(2 sqrt(K)) at most one of them turns
by more than pi/2: alpha where u = e_z has its least value on the way, beta where its largest. So
phi changes by -pi/2 to 3 pi/2 in the sense of that one, and its values modulo 2 pi tell by how
much.

No pole is an exception: a pass close to it, or through it, is half a turn in the sense of P,
forward in time where P is exactly zero.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.exact.pairs import plus_turns
from heavytop.integration.outputs import hypot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Real = Any  # of heyoka, or any type that has arithmetic and numpy's functions
Reals: TypeAlias = Any  # an array of doubles, or of heyoka's reals
Pair = tuple[Reals, Reals]  # a real and an imaginary part, or phi and psi

WIDENING = 1e-7  # of the roots of a cubic in double precision, a double root included
SLACK = 1e-6  # radians: far above rounding, far below a turn
CLOSE = 1e-9  # of the axis to the pole: beyond any drift of the state
MOST_POINTS = 2**20  # in one block: bounds the memory, should a step be very long
GRAIN = 16 * np.finfo(float).eps  # how well a state is known: nothing closer is told apart
GRAIN_BITS: Final = 24  # of a state in more digits that rounding may have spoilt
LEAST_GRAIN = 1e-140  # whose square is a double
CAUTION = 0.9  # of Sturm's time: K is known to rounding and drift, not better


# --- angles modulo 2 pi --------------------------------------------------------------------------


def distinct(values: Array) -> tuple[Array, NDArray[np.intp]]:
    """Return the different values, increasing, and where each stands (np.unique, but at once)."""
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    first = np.ones(ordered.size, dtype=bool)
    first[1:] = ordered[1:] != ordered[:-1]
    return ordered[first], order[first]


def principal(angle: Any) -> Any:
    """Return an angle less the turns that are nearest to it."""
    return angle - 2 * np.pi * np.round(angle / (2 * np.pi))


def in_sense(sense: Any, change: Array) -> Array:
    """Return a change, known modulo 2 pi, where a pass is half a turn in a sense, 1 or -1."""
    return np.where(sense * change < -np.pi / 2, change + sense * 2 * np.pi, change)


def turns_behind(ahead: float) -> float:
    """Return the whole turns after which an angle so far ahead is what it was, or just beyond."""
    return 2 * np.pi * math.ceil(-ahead / (2 * np.pi) - SLACK)


def nearest(angle: Reals, near: Array, passing: Any = False, turn: Any = None) -> Reals:
    """Return the angle nearest to another one, in doubles, of those whole turns apart.

    In a pass they are half turns apart: which side of it, the other angle says. A `turn` has the
    digits of the angle; without it they are those of doubles.
    """
    step = np.where(passing, 0.5, 1.0)
    turns = step * np.round((near - angle.astype(np.float64)) / (2 * np.pi * step))
    return plus_turns(angle, turns) if turn is None else angle + turn * turns


def argument(
    z: Pair, rate: Pair, momentum: Any, fastest: Any, close: Any
) -> tuple[Reals, Mask, Mask]:
    """Return the argument of z, where z vanishes and stays, and where it is that of a pass.

    A pass at a distance of |momentum|/|rate|, closer to the pole than `close`, is not told by a
    state that has drifted, whose angular momentum is another one, but by the constants of the
    motion: up to the pole the argument stays, and there it jumps by half a turn. The rate changes
    at `fastest` [rad/s].
    """
    (x, y), (p, q) = z, rate
    size = hypot(x, y)
    beside = size < close
    if not beside.any():
        return np.arctan2(y, x), beside, beside
    speed = hypot(p, q)
    drifted = abs(x * q - y * p - momentum) >= abs(momentum) / 2
    passing = drifted & beside & (size * fastest < speed)
    passing &= 2 * abs(momentum) < close * speed
    side = np.where(x * p + y * q < 0, -1.0, 1.0)
    found = np.arctan2(np.where(passing, side * q, y), np.where(passing, side * p, x))
    return found, (size == 0) & (speed == 0), passing


# --- what tells the turns of one motion ----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Turns:
    """What directs and bounds the turning of phi and psi, less its uniform part, for one motion.

    Attributes
    ----------
    g, l_z, P_plus, P_minus : float
        gMR/A, p_phi/A, (p_phi + p_psi)/A and (p_phi - p_psi)/A.
    stiffness : float
        A bound K of l^2/4 + g |beta|^2 and l^2/4 - g |alpha|^2 over the motion.
    apart : float
        Over how long a time a change is decided [s]; inf where nothing moves.
    grain, close : float
        How well a state is known, and how near to a pole it may have drifted to the other side.
    """

    g: float
    l_z: float
    P_plus: float
    P_minus: float
    stiffness: float
    apart: float
    grain: float = GRAIN
    close: float = CLOSE

    @classmethod
    def of(cls, parameters: Mapping[str, float], state: Array) -> Self:
        """Return the turns of the motion through a state."""
        raise NotImplementedError

    def started(self, state: Array, *angles: float) -> tuple[float, ...]:
        """Return the angles at a start; on a pole phi is that in which the axis leaves."""
        raise NotImplementedError

    def followed(self, t: Array, rows: Array, first: Sequence[float]) -> Array:
        """Return the angles, shape (k, c), at times no farther apart than is decided [rad].

        Parameters
        ----------
        t : ndarray, shape (k,)
            Times, monotonic [s].
        rows : ndarray, shape (k, n)
            States there.
        first : sequence of float
            The angles at the first of them [rad].
        """
        raise NotImplementedError

    def read(self, rows: Reals, told: Array, known: Mapping[str, Any], grain: Any) -> list[Reals]:
        """Return the angles to the digits of the states, from those in doubles."""
        raise NotImplementedError

    def parts(self, length: float) -> int:
        """Return into how many parts a time is divided, for turns to be told in each [s]."""
        return max(1, math.ceil(min(abs(length) / self.apart, MOST_POINTS)))

    def told(self, t: Array, rows: Array, first: Sequence[float]) -> Callable[[Any], Array]:
        """Return the angles as a function of times among those of some states.

        The states, shape (k, n), are in any order; the first in time has the angles `first`.
        """
        forward = math.copysign(1.0, t[np.argmax(np.abs(t))])
        unique, where = distinct(forward * t)
        angles = self.followed(forward * unique, rows[where], first)
        return lambda at: angles[np.searchsorted(unique, forward * at)]


# --- phi from the axis ---------------------------------------------------------------------------


def azimuth(rows: Array) -> Array:
    """Return phi modulo 2 pi, shape (k,); exactly at a pole, that in which the axis leaves."""
    e_x, e_y, e_z, l_x, l_y = rows[:, :5].T
    at_pole = (e_x == 0) & (e_y == 0)
    x = np.where(at_pole, l_y * e_z, e_x)
    y = np.where(at_pole, -l_x * e_z, e_y)
    angles: Array = np.arctan2(x, -y)
    return angles


class AxisTurns(Turns):
    """The turns of phi, from states of the axis form."""

    __slots__ = ()

    @classmethod
    def of(cls, parameters: Mapping[str, float], state: Array) -> Self:
        """Return the turns of the motion through a state of the axis form."""
        g, l_z, *P = (parameters[name] for name in ("g", "l_z", "P_plus", "P_minus"))
        e_x, e_y, u, l_x, l_y = state[:5].tolist()
        energy = l_x * l_x + l_y * l_y + l_z * l_z + 2 * g * u
        n = e_x * l_x + e_y * l_y + u * l_z
        lowest = max(-g * end for end in _turning(g, l_z, energy, n))
        K = energy / 4 + abs(g) / 2 + lowest  # the brackets are (l^2 + 2 g u)/4 +- g/2 - g u
        moves = any((e_x, e_y, l_x, l_y)) and 0 < K < math.inf
        apart = CAUTION * math.pi / (2 * math.sqrt(K)) if moves else math.inf
        return cls(g, l_z, P[0], P[1], K, apart)

    def followed(self, t: Array, rows: Array, first: Sequence[float]) -> Array:
        """Return phi, shape (k, 1)."""
        x, y, _, p, q = rows.T[:5]
        forward = 1.0 if t[-1] >= t[0] else -1.0
        known = {name: getattr(self, name) for name in ("g", "l_z", "P_plus", "P_minus")}
        counted, rests, _ = _argument_of_axis(rows, known, self.close)
        lowest = forward * np.diff(p * y - q * x) > 0  # of u', which rises through a least u
        P = np.where(lowest, self.P_plus, self.P_minus)
        change = in_sense(np.where(P < 0, -forward, forward), principal(np.diff(counted)))
        change = np.where(rests[1:] | rests[:-1], 0.0, change)
        told = np.where(rests, counted, azimuth(rows))
        # what is counted may begin ahead of the first azimuth
        phi = _summed(first[0] + float(principal(counted[0] - told[0])), change)
        return np.where(rests, phi, nearest(told, phi))[:, None]

    def read(self, rows: Reals, told: Array, known: Mapping[str, Any], grain: Any) -> list[Reals]:
        """Return phi, to the digits of the states; where the axis stays on a pole, the start's."""
        phi, rests, passing = _argument_of_axis(rows, known, grain)
        return [nearest(np.where(rests, known["phi_0"], phi), told[:, 0], passing, _turn(grain))]

    def started(self, state: Array, *angles: float) -> tuple[float, ...]:
        """Return phi at a start; on a pole that in which the axis leaves, phi or phi + pi."""
        (phi,) = angles
        if state[0] != 0 or state[1] != 0 or not state[3:5].any():
            return (phi,)
        leaving = float(azimuth(state[None])[0])
        return (leaving + turns_behind(leaving - phi),)


def _argument_of_axis(
    rows: Reals, known: Mapping[str, Any], close: Any
) -> tuple[Reals, Mask, Mask]:
    """Return phi modulo 2 pi, where it rests, and where it is that of a pass; see `argument`."""
    x, y, z, p, q = rows.T[:5]
    l_z, own = known["l_z"], np.where(z > 0, known["P_minus"], known["P_plus"])
    rate = (p * z - l_z * x, q * z - l_z * y)
    return argument((-y, x), rate, own, _fastest(p, q, known), close)


def _turning(g: float, l_z: float, energy: float, n: float) -> tuple[float, float]:
    """Return bounds of u, from the roots of the cubic u'^2, widened by their rounding."""
    if not np.isfinite(energy):
        return -1.0, 1.0  # beyond the range of doubles: the integration will say so
    k = energy - l_z**2  # u'^2 = (k - 2 g u)(1 - u^2) - (n - l_z u)^2
    cubic = [2 * g, -k - l_z**2, 2 * (n * l_z - g), k - n**2]
    if not any(cubic[:3]):
        return -1.0, 1.0  # at rest, without gravity
    roots = np.sort(np.roots(cubic).real)  # the third lies beyond the pole where V is high
    u1, u2 = roots[:2] if g >= 0 else roots[-2:]
    return max(-1.0, u1 - WIDENING), min(1.0, u2 + WIDENING)


# --- phi and psi from the quaternion -------------------------------------------------------------


Arm = tuple[Pair, Pair, Any]  # alpha or beta, its rate, its angular momentum


class AttitudeTurns(Turns):
    """The turns of phi and psi, from states of the attitude form."""

    __slots__ = ()

    @classmethod
    def of(cls, parameters: Mapping[str, float], state: Array) -> Self:
        """Return the turns of the motion through a state of the attitude form."""
        g, l_z, *P = (parameters[name] for name in ("g", "l_z", "P_plus", "P_minus"))
        q_0, q_1, q_2, q_3, l_x, l_y = numbers = state[:6].tolist()
        upper, lower = q_0 * q_0 + q_3 * q_3, q_1 * q_1 + q_2 * q_2
        energy = l_x * l_x + l_y * l_y + l_z * l_z + 2 * g * (upper - lower)
        K = energy / 4 + 1.5 * abs(g) * (upper + lower)
        moves = any(map(any, arm_rates(numbers, l_z))) or (
            g and any(numbers[:4:3]) and any(numbers[1:3])
        )
        apart = CAUTION * math.pi / math.sqrt(K) if moves and 0 < K < math.inf else math.inf
        return cls(g, l_z, P[0], P[1], K, apart)

    def followed(self, t: Array, rows: Array, first: Sequence[float]) -> Array:
        """Return phi and psi, less its uniform part, shape (k, 2)."""
        forward = 1.0 if t[-1] >= t[0] else -1.0
        fastest, arms = math.sqrt(self.stiffness), self._arms(rows.T)
        counted = [argument(*arm, fastest, self.close)[0] for arm in arms]
        (a, a_rests, _), (b, b_rests, _) = (argument(*arm, fastest, self.grain) for arm in arms)
        da, db = (
            in_sense(-forward if momentum < 0 else forward, principal(np.diff(each)))
            for each, (_, _, momentum) in zip(counted, arms, strict=True)
        )
        # what is counted may begin ahead of the first argument
        ahead = [float(principal(each[0] - x[0])) for each, x in zip(counted, (a, b), strict=True)]
        first = first[0] + ahead[0] + ahead[1], first[1] + ahead[0] - ahead[1]
        # on the vertical phi stays
        da = np.where(a_rests[1:] | a_rests[:-1], -db, da)
        db = np.where(b_rests[1:] | b_rests[:-1], -da, db)
        phi, psi = (_summed(*x) for x in zip(first, (da + db, da - db), strict=True))
        a, b = np.where(a_rests, phi - b, a), np.where(b_rests, phi - a, b)
        return np.stack((nearest(a + b, phi), nearest(a - b, psi)), axis=-1)

    def started(self, state: Array, *angles: float) -> tuple[float, ...]:
        """Return phi and psi at the start; on a pole psi compensates for what phi jumps."""
        (phi, psi), more = angles, [0.0, 0.0]
        for i, (z, rate, _) in enumerate(self._arms(state)):
            if not any(z) and any(rate):
                off = float(np.arctan2(rate[1], rate[0])) - (phi - psi if i else phi + psi) / 2
                more[i] = off + turns_behind(off)
        return phi + more[0] + more[1], psi + more[0] - more[1]

    def read(self, rows: Reals, told: Array, known: Mapping[str, Any], grain: Any) -> list[Reals]:
        """Return phi and psi, less its uniform part, to the digits of the states."""
        fastest = _fastest(rows.T[4], rows.T[5], known)
        arms = _arms(rows.T, *(known[name] for name in ("l_z", "P_plus", "P_minus")))
        (a, a_rests, a_passing), (b, b_rests, b_passing) = (
            argument(*arm, fastest, grain) for arm in arms
        )
        a = np.where(a_rests, known["phi_0"] - b, a)  # on the vertical phi is that of the start
        b = np.where(b_rests, known["phi_0"] - a, b)
        passing, turn = a_passing | b_passing, _turn(grain)
        both = zip((a + b, a - b), told.T, strict=True)
        return [nearest(x, near, passing, turn) for x, near in both]

    def _arms(self, columns: Any) -> tuple[Arm, Arm]:
        return _arms(columns, self.l_z, self.P_plus, self.P_minus)


def turns_of(
    formulation: Formulation, parameters: Mapping[str, float], state: Array
) -> Turns | None:
    """Return what counts the angles that a formulation reads off its states, if it does."""
    if formulation.integrated is None:
        return None
    return (AxisTurns if formulation.name == "axis" else AttitudeTurns).of(parameters, state)


def in_bits(turns: Turns, bits: int) -> Turns:
    """Return what counts the turns of states of so many bits."""
    grain, close = 2.0 ** (GRAIN_BITS - bits), 2.0 ** (-bits // 2)
    return replace(turns, grain=max(grain, LEAST_GRAIN), close=max(close, LEAST_GRAIN))


def _arms(columns: Any, l_z: Real, P_plus: Real, P_minus: Real) -> tuple[Arm, Arm]:
    q_0, q_1, q_2, q_3, *_ = columns
    for_alpha, for_beta = arm_rates(columns[:6], l_z)
    return ((q_0, q_3), for_alpha, P_plus / 4), ((q_1, q_2), for_beta, P_minus / 4)


def arm_rates(state: Sequence[Real], l_z: Real) -> tuple[Pair, Pair]:
    """Return the rates of alpha and beta."""
    q_0, q_1, q_2, q_3, l_x, l_y = state
    alpha = (-l_z * q_3 - l_x * q_1 - l_y * q_2, l_z * q_0 - l_y * q_1 + l_x * q_2)
    beta = (-l_z * q_2 + l_x * q_0 + l_y * q_3, l_z * q_1 + l_y * q_0 - l_x * q_3)
    return (alpha[0] / 2, alpha[1] / 2), (beta[0] / 2, beta[1] / 2)


def _fastest(l_x: Reals, l_y: Reals, known: Mapping[str, Any]) -> Reals:
    return np.sqrt(l_x * l_x + l_y * l_y + known["l_z"] ** 2 + 8 * abs(known["g"]))


def _turn(grain: Any) -> Any:
    """Return 2 pi to the digits of a grain."""
    return 2 * np.arctan2(grain - grain, -grain)


def _summed(first: float, changes: Array) -> Array:
    return first + np.concatenate(([0.0], np.cumsum(changes)))
