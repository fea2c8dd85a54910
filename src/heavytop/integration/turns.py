"""How often the top has turned: phi of the axis form, phi and psi of the attitude form.

Neither is a state of the equations: they are read off the states, which give them modulo 2 pi, and
their turns are counted along the way, in doubles. A run of more digits counts them on its own
steps: one in doubles that comes near a separatrix has lost its phase there, and would pass a pole
a turn too often or too seldom. What is less than a turn is read to all digits of the states.

**The axis** gives phi, whose change between two states is proved in one of two ways. Its rate is a
sum of two terms that never change sign, functions of u = e_z alone,

    phi' = (1/2) [ P_plus / (1 + u) + P_minus / (1 - u) ],

so the turning points of u bound it over the whole motion. If exactly one value of the change lies
between the bounds, that is the change.

In a pass close to a pole the bounds are far apart. There z = e_x + i e_y is followed in the
plane: if the path strays from its chord by less than the chord's distance from the origin, it can
be pulled straight without crossing the pole, and turns by the angle between its ends. The
strayings are at most dt^2 max|z''| / 8, and with w = l_x + i l_y

    z' = i l_z z - i e_z w,    w' = i g z,    so    |z|' <= |w|,    |w|' <= |g| |z|.

An interval that is not decided is divided. One that rounding does not let us divide holds a pass
through the pole itself: there phi jumps by pi, in the sense of the pole's own term, and forward
in time where that is exactly zero.

**The quaternion** gives two complex numbers, with psi less its uniform part,

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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Self, TypeAlias

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.integration.outputs import hypot

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Real = Any  # of heyoka, or any type that has arithmetic and numpy's functions
Reals: TypeAlias = Any  # an array of doubles, or of heyoka's reals
Pair = tuple[Reals, Reals]  # a real and an imaginary part, or phi and psi
More = Callable[[Array], Array]

PARTS = 8  # into how many parts an undecided interval is divided
FINEST = 16 * np.finfo(float).eps  # relative to the largest time: no time lies between
WIDENING = 1e-7  # of the roots of a cubic in double precision, a double root included
SLACK = 1e-6  # radians: far above rounding, far below a turn
CLOSE = 1e-9  # of the axis to the pole: beyond any drift of the state
STRAIGHT = 0.01  # of a chord's length: how far a path that crosses a pole may stray
MOST_POINTS = 2**20  # in one block: bounds the memory, should an axis linger at a pole
GRAIN = 16 * np.finfo(float).eps  # how well a state is known: nothing closer is told apart
GRAIN_BITS: Final = 24  # of a state in more digits that rounding may have spoilt
LEAST_GRAIN = 1e-140  # whose square is a double
ROUNDING = 64 * np.finfo(float).eps  # of P_plus and P_minus, relative to their terms
FITTING: Final = 5.7  # radians between the bounds of a change, so that one value fits
MOST_PARTS: Final = 8  # of a step, before its turns are told by where it goes
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


def nearest(angle: Reals, near: Array, passing: Any = False, turn: Any = 2 * np.pi) -> Reals:
    """Return the angle nearest to another one, in doubles, of those whole turns apart.

    In a pass they are half turns apart: which side of it, the other angle says. A `turn` has the
    digits of the angle.
    """
    step = np.where(passing, 0.5, 1.0)
    turns = np.round((near - angle.astype(np.float64)) / (2 * np.pi * step))
    return angle + turn * (step * turns)


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


# --- phi from the axis ---------------------------------------------------------------------------


def azimuth(rows: Array) -> Array:
    """Return phi modulo 2 pi, shape (k,); exactly at a pole, that in which the axis leaves."""
    e_x, e_y, e_z, l_x, l_y = rows[:, :5].T
    at_pole = (e_x == 0) & (e_y == 0)
    x = np.where(at_pole, l_y * e_z, e_x)
    y = np.where(at_pole, -l_x * e_z, e_y)
    angles: Array = np.arctan2(x, -y)
    return angles


@dataclass(frozen=True, slots=True)
class AxisTurns:
    """The rate of phi as a function of u, for one motion.

    Attributes
    ----------
    g, l_z, P_plus, P_minus : float
        Constants of the axis form: gMR/A, p_phi/A, (p_phi + p_psi)/A, (p_phi - p_psi)/A.
    slowest, fastest : float
        Bounds of phi' over the whole motion [rad/s].
    grain, close : float
        How well a state is known, and how near to a pole it may have drifted to the other side.
    """

    g: float
    l_z: float
    P_plus: float
    P_minus: float
    slowest: float
    fastest: float
    grain: float = GRAIN
    close: float = CLOSE

    @classmethod
    def of(cls, parameters: Mapping[str, float], state: Array) -> Self:
        """Return the turns of the motion through a state of the axis form."""
        g, l_z, *P = (parameters[name] for name in ("g", "l_z", "P_plus", "P_minus"))
        e_x, e_y, u, l_x, l_y = state[:5].tolist()
        energy = l_x * l_x + l_y * l_y + l_z * l_z + 2 * g * u
        n = e_x * l_x + e_y * l_y + u * l_z
        u1, u2 = _turning(g, l_z, energy, n)
        plus = _bounds(_uncertain(P[0], P), 1 + u1, 1 + u2)
        minus = _bounds(_uncertain(P[1], P), 1 - u2, 1 - u1)
        slowest, fastest = ((plus[i] + minus[i]) / 2 for i in range(2))
        return cls(g, l_z, P[0], P[1], slowest, fastest)

    def parts(self, length: float, most: int | None = None) -> int:
        """Return into how many parts a time is divided [s], for turns to be told in each.

        Where bounds would take more parts than `most`, they are as many; 0 without `most`.
        """
        parts = (self.fastest - self.slowest) * abs(length) / FITTING if length else 0.0
        return max(1, math.ceil(parts)) if parts < (most or MOST_PARTS) else most or 0

    def followed(self, t: Array, rows: Array, first: Sequence[float], more: More | None) -> Array:
        """Return phi at some times, shape (k, 1), from that at the first [rad]."""
        phi = first[0] + self._turned(t, rows, more)
        upright = ~rows[:, (0, 1, 3, 4)].any(axis=1)
        return np.where(upright, phi, nearest(azimuth(rows), phi))[:, None]

    def read(self, rows: Reals, told: Array, known: Mapping[str, Any], grain: Any) -> list[Reals]:
        """Return phi, to the digits of the states; where the axis stays on a pole, the start's."""
        x, y, z, p, q = rows.T[:5]
        l_z, own = known["l_z"], np.where(z > 0, known["P_minus"], known["P_plus"])
        rate, fastest = (p * z - l_z * x, q * z - l_z * y), _fastest(p, q, known)
        phi, rests, passing = argument((-y, x), rate, own, fastest, grain)
        return [nearest(np.where(rests, known["phi_0"], phi), told[:, 0], passing, _turn(grain))]

    def _turned(self, t: Array, rows: Array, more: More | None) -> Array:
        """Return the change of phi since the first time [rad], shape (k,).

        Parameters
        ----------
        t : ndarray, shape (k,)
            Times, monotonic [s].
        rows : ndarray, shape (k, n)
            States there.
        more : callable, optional
            States at further times within the range, in the same order; without it the least
            change is taken where none is proved.
        """
        if t.size < 2:
            return np.zeros(t.size)
        asked = t
        forward = 1.0 if t[-1] >= t[0] else -1.0
        finest = FINEST * float(np.max(np.abs(t)))
        while True:
            change, decided = self._changes(t, rows)
            open_ = np.flatnonzero(~decided & (np.abs(np.diff(t)) > finest))
            if more is None or open_.size == 0 or open_.size * PARTS > MOST_POINTS:
                break
            between = _divided(t, open_)
            order = np.argsort(forward * np.concatenate((t, between)), kind="stable")
            rows = np.concatenate((rows, more(between)))[order]
            t = np.concatenate((t, between))[order]
        total = np.concatenate(([0.0], np.cumsum(change)))
        return total[np.searchsorted(forward * t, forward * asked)]

    def started(self, state: Array, phi: float) -> tuple[float]:
        """Return phi at a start; on a pole that in which the axis leaves, phi or phi + pi."""
        if state[0] != 0 or state[1] != 0 or not state[3:5].any():
            return (phi,)
        leaving = float(azimuth(state[None])[0])
        return (leaving + turns_behind(leaving - phi),)

    def _changes(self, t: Array, rows: Array) -> tuple[Array, Mask]:
        """Return the change of phi over each interval, and whether it is proved."""
        dt = np.diff(t)
        least = np.diff(self._telling(rows))
        low, high = self.slowest * dt, self.fastest * dt
        change, decided = _fitting(least, np.minimum(low, high), np.maximum(low, high))
        if decided.all():
            return change, decided
        beside, across, resting = self._path(dt, rows)
        change = np.where(decided, change, principal(least))
        turned = np.where(beside | decided, change, self._sided(dt, rows, change))
        return np.where(resting, 0.0, turned), decided | beside | across | resting

    def _sided(self, dt: Array, rows: Array, change: Array) -> Array:
        """Return the change over a pass: half a turn, in the sense of the pole's own term."""
        u = rows[:-1, 2] + rows[1:, 2]
        P = np.where(u > 0, self.P_minus, self.P_plus)
        return in_sense(np.where(np.where(P == 0, 1.0, P) * dt < 0, -1.0, 1.0), change)

    def _telling(self, rows: Array) -> Array:
        """Return the azimuths, but at a row on a pole that is only being passed that of the last.

        There the azimuth is rounding, and would be counted on both sides of it.
        """
        angles = azimuth(rows)
        size = np.hypot(rows[:, 0], rows[:, 1])
        beside = np.minimum(size[:-2], size[2:])
        passed = 1 + np.flatnonzero((size[1:-1] < self.close) & (size[1:-1] < 1e-3 * beside))
        if passed.size:
            passed = passed[self._drifted(rows[passed])]
            angles[passed] = angles[passed - 1]
        return angles

    def _path(self, dt: Array, rows: Array) -> tuple[Mask, Mask, Mask]:
        """Tell where the path goes: beside the pole, across it, or nowhere at all.

        Beside: it can be pulled straight. Across: it is straight, and so close to the pole that
        not the state, which has drifted, but the constants of the motion must say on which side.
        Nowhere: it stays on the vertical, and phi stays what it was.
        """
        z, w = rows[:, 0] + 1j * rows[:, 1], rows[:, 3] + 1j * rows[:, 4]
        half, mu = np.abs(dt) / 2, np.sqrt(abs(self.g))
        with np.errstate(over="ignore"):  # a step so long decides nothing, and is divided
            grown, mixed = np.cosh(mu * half), _sinhc(mu * half) * half
        sizes_z, sizes_w = (np.maximum(np.abs(x[:-1]), np.abs(x[1:])) for x in (z, w))
        with np.errstate(over="ignore", invalid="ignore"):
            largest_z = sizes_z * grown + sizes_w * mixed
            largest_w = sizes_w * grown + sizes_z * mixed * mu**2
            acceleration = (self.l_z**2 + mu**2) * largest_z
            acceleration += (abs(self.l_z) + largest_w * largest_z) * largest_w
            stray = dt * dt * acceleration / 8
        distance = _distance_from_origin(z[:-1], z[1:])
        drifted = self._drifted(rows)
        close = (distance < self.close) & (drifted[:-1] | drifted[1:])
        across = close & (stray < STRAIGHT * np.abs(np.diff(z)))
        resting = (sizes_z == 0) & (sizes_w == 0)
        return (distance > stray + self.grain * sizes_z) & ~close, across, resting

    def _drifted(self, rows: Array) -> Mask:
        """Tell where phi' sin^2 theta is off the constants by half the pole's own term of it."""
        u, z, w = rows[:, 2], rows[:, 0] + 1j * rows[:, 1], rows[:, 3] + 1j * rows[:, 4]
        own = np.where(u > 0, self.P_minus, self.P_plus)
        other, far = self.P_plus + self.P_minus - own, 1 + np.abs(u)
        said = (own * far + other * np.abs(z) ** 2 / far) / 2
        seen = self.l_z * np.abs(z) ** 2 - u * (z.conj() * w).real
        return np.abs(seen - said) >= np.abs(own) / 2  # type: ignore[no-any-return]


def _sinhc(x: Array) -> Array:
    """Return sinh(x)/x, which is 1 at 0."""
    tiny = x < 1e-8
    return np.where(tiny, 1.0, np.sinh(x) / np.where(tiny, 1.0, x))


def _distance_from_origin(a: Any, b: Any) -> Array:
    """Return how close the chord from a to b comes to the origin of the complex plane."""
    chord = b - a
    length = np.abs(chord)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(length > 0, -(a * chord.conj()).real / length**2, 0.0)
    nearest: Array = np.abs(a + np.clip(along, 0.0, 1.0) * chord)
    return nearest


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


def _uncertain(P: float, both: Sequence[float]) -> tuple[float, float]:
    error = ROUNDING * (abs(both[0]) + abs(both[1]))
    return P - error, P + error


def _fitting(principal: Array, low: Array, high: Array) -> tuple[Array, Mask]:
    """Return the change of phi that fits the bounds, and whether only one does."""
    least = np.ceil((low - SLACK - principal) / (2 * np.pi))
    most = np.floor((high + SLACK - principal) / (2 * np.pi))
    decided = (least == most) & np.isfinite(most)
    turns = np.where(decided, most, -np.round(principal / (2 * np.pi)))
    return principal + 2 * np.pi * turns, decided


def _divided(t: Array, open_: NDArray[np.intp]) -> Array:
    fractions = np.arange(1, PARTS) / PARTS
    inside = t[open_, None] + fractions * (t[open_ + 1] - t[open_])[:, None]
    return distinct(inside.ravel())[0] if t[-1] >= t[0] else distinct(inside.ravel())[0][::-1]


def _bounds(P: tuple[float, float], nearest: float, farthest: float) -> tuple[float, float]:
    """Bound P / distance, given the least and the largest distance from the pole."""
    if nearest <= 0:
        return -np.inf, np.inf  # through the pole phi jumps, even where P is zero
    steep = 1 / nearest
    low = P[0] * (steep if P[0] < 0 else 1 / farthest)
    high = P[1] * (steep if P[1] > 0 else 1 / farthest)
    return low, high


# --- phi and psi from the quaternion -------------------------------------------------------------


Arm = tuple[Pair, Pair, Any]  # alpha or beta, its rate, its angular momentum


@dataclass(frozen=True, slots=True)
class AttitudeTurns:
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

    def parts(self, length: float, most: int | None = None) -> int:
        """Return into how many parts a time is divided [s]."""
        return max(1, math.ceil(min(abs(length) / self.apart, MOST_POINTS)))

    def followed(
        self, t: Array, rows: Array, first: Sequence[float], more: More | None = None
    ) -> Array:
        """Return phi and psi at times no farther apart than is decided, shape (k, 2) [rad].

        Parameters
        ----------
        t : ndarray, shape (k,)
            Times, monotonic [s].
        rows : ndarray, shape (k, n)
            States there.
        first : sequence of float
            phi and psi at the first of them [rad].
        """
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

    def started(self, state: Array, phi: float, psi: float) -> tuple[float, float]:
        """Return phi and psi at the start.

        On a pole phi is that in which the axis leaves, phi or phi + pi, and psi compensates.
        """
        more = [0.0, 0.0]
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


Turns: TypeAlias = AxisTurns | AttitudeTurns


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
