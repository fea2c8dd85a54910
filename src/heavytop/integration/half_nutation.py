"""Half a nutation in extended precision, which tells all the rest of the motion.

theta nods between two turning points, half a period apart. With alpha, beta and P as in `turns`,
and w = l_x + i l_y,

    2 alpha' = i l_z alpha - w beta*,    2 beta' = i l_z beta + w alpha*,    w' = 2 g alpha beta.

The sum of their arguments is phi, the difference psi without its uniform part. Nothing changes when
alpha turns by a, beta by b and w by a + b: so each step starts where alpha and beta are real and
not negative, and what they have turned before is counted beside. At a turning point they move at
right angles to themselves and w is then imaginary, so that the motion is the same in either
direction of time:

    alpha(-t) = alpha(t)*,    beta(-t) = beta(t)*,    w(-t) = -w(t)*.

From one turning point to the next the angles gain constant amounts. So two swings, from a turning
point to the next and from that to the one after, tell the motion at all times; the second repeats
the first backwards, and how well it does measures the errors of both.

A pass through a pole is a turning point where alpha or beta is zero and has a speed; it is the
limit of close passes on the side to which the argument then turns.

No two turning points are closer than pi/(2 sqrt(K)), with K of `turns`: u' obeys Hill's equation
with a factor of at most 4 K. No step is longer, so none is missed, and every turn is counted.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.alone import Alone
from heavytop.equations.formulation import FORMULATIONS
from heavytop.integration.high_precision import PreciseIntegrator, Unfinished
from heavytop.integration.turns import AttitudeTurns, Pair, Real, arm_rates

Array = NDArray[np.float64]
State = tuple[Real, ...]  # q_0 ... q_3, l_x, l_y

MOST_STEPS = 2000  # in half a nutation
MOST_ITERATIONS = 200
QUICK = 256  # bits up to which half a nutation is done sooner than its code would be improved
CUT = 2.0**-60  # of the largest term of a polynomial: doubles do not feel less


@dataclass(frozen=True, slots=True, eq=False)
class SwingStep:
    """A step that starts with alpha and beta real.

    Attributes
    ----------
    start, length : real
        When it starts, since the turning point, and how long it is [s].
    state : tuple of real
        At its start.
    turned : pair of real
        What phi and psi, without its uniform part, have gained before [rad].
    terms : ndarray, shape (order + 1, 6)
        The states in doubles, as polynomials in the fraction of the step. Those that start at a
        turning point keep the relative digits of alpha and beta, however close to a pole: each
        term is small by itself.
    """

    start: Real
    length: Real
    state: State
    turned: Pair
    terms: Array

    def at(self, since: Array) -> tuple[Array, Array]:
        """Return states, shape (6, k), and what phi and psi have gained, shape (2, k) [rad]."""
        x = (since - float(self.start)) / float(self.length)
        states = np.repeat(self.terms[-1][:, None], since.size, axis=1)
        for term in self.terms[-2::-1]:
            states *= x
            states += term[:, None]
        before = np.array([[float(angle)] for angle in self.turned])
        return states, before + np.stack(angles(states))


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """From a state to the next turning point.

    Attributes
    ----------
    duration : real
        How long it takes [s].
    turned : pair of real
        What phi and psi gain [rad].
    end : tuple of real
        The state at the end, once alpha and beta have been turned back until they are real.
    steps : tuple of SwingStep
    """

    duration: Real
    turned: Pair
    end: State
    steps: tuple[SwingStep, ...]


class HalfNutation(PreciseIntegrator):
    """Half a nutation, integrated in numbers of so many bits.

    Parameters
    ----------
    bits : int
    constants : mapping from str to str
        Those of the attitude form, as decimal texts.
    state : sequence of str
        The start with phi = psi = 0, where alpha and beta are real, as decimal texts.

    Attributes
    ----------
    first, half : str
        The time of a turning point, and half a period [s]. Texts hold every bit.
    before, turned : tuple of str
        What phi and psi, without its uniform part, gain until then, and in half a period [rad].
    closure : float
        By how much the second swing differs from the first [rad; times by the rate of the motion].
    lost_bits : float
        How many bits were lost to what is hard to tell: flat turning points, close passes.
    count : int
        Steps taken.
    integrate_s : float
        Wall-clock time without compiling [s].

    Raises
    ------
    Unfinished
        No turning point was reached in so many steps, or in finite numbers.
    """

    def __init__(self, bits: int, constants: Mapping[str, str], state: Sequence[str]) -> None:
        super().__init__(FORMULATIONS["attitude"].build(), bits, constants, quick=bits <= QUICK)
        self._asked = bits, constants, state
        began = time.perf_counter()
        self._alone, self._none = Alone(), self.number("0")
        start = tuple(map(self.number, state))
        doubles = np.array([float(x) for x in start])
        turns = AttitudeTurns.of({name: float(x) for name, x in self._constants.items()}, doubles)
        rate, apart = 2 * math.sqrt(turns.stiffness), turns.apart / 2
        if not (0 < rate < math.inf and 0 < apart < math.inf):
            raise Unfinished("its rates are beyond the range of doubles, squared")
        self._rate, self._apart = self.number(repr(rate)), self.number(repr(apart))
        lead = self._swing(start) if rise(start) else self._ended([], self._none, start)
        first = self._swing(lead.end)
        second = self._swing(first.end)
        self.first, self.before = str(lead.duration), self._texts(lead.turned)
        self.half, self.turned = str(first.duration), self._texts(first.turned)
        self._both = (*first.steps, *second.steps)
        self._later = 2 * float(first.duration)  # than in the first swing the second is looked up
        begin = ((0.0, first), (self._later, second))
        self._starts = np.array([t + float(step.start) for t, x in begin for step in x.steps])
        closure = self._closure(first, second)
        rounding = float(closure * self.number("2") ** bits)
        self.closure = float(closure)
        self.lost_bits = max(self._lost(first.end, second.end), math.log2(max(1.0, rounding)))
        self.count = len(lead.steps) + len(self._both)
        self.integrate_s = time.perf_counter() - began

    def at(self, odd: NDArray[np.bool_], since: Array) -> tuple[Array, Array]:
        """Return states, shape (6, k), and what phi and psi gain, shape (2, k), in doubles.

        Parameters
        ----------
        odd : ndarray of bool, shape (k,)
            Whether the turning point before is one at which the first swing ends.
        since : ndarray, shape (k,)
            Times since that turning point: at least zero, and not beyond the swing [s].
        """
        states, turned = np.empty((6, since.size)), np.empty((2, since.size))
        held = self._held(odd, since)
        for i in np.flatnonzero(np.bincount(held)):
            here = np.flatnonzero(held == i)
            states[:, here], turned[:, here] = self._both[i].at(since[here])
        return states, turned

    def at_one(self, odd: bool, since: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the state and what phi and psi gain, at one time to all digits."""
        (held,) = self._held(np.array([odd]), np.array([float(since)]))
        step = self._both[held]
        with self._alone:
            self._stepped(step.state)
            self._taylor.update_d_output(self.number(self.wide(since) - step.start))
            state = tuple(self._taylor.d_output)
        turned = (x + y for x, y in zip(step.turned, angles(state), strict=True))
        return self._texts(state), self._texts(turned)

    def _held(self, odd: NDArray[np.bool_], since: Array) -> NDArray[np.intp]:
        """Return which step holds each time."""
        return np.searchsorted(self._starts, since + self._later * odd, side="right") - 1

    def _texts(self, numbers: Iterable[Real]) -> tuple[str, ...]:
        return tuple(map(str, numbers))

    def _closure(self, first: Swing, second: Swing) -> Real:
        """Return by how much two swings differ."""
        turned = (abs(x - y) for x, y in zip(first.turned, second.turned, strict=True))
        return max(abs(first.duration - second.duration) * self._rate, *turned)

    def _lost(self, *ends: State) -> float:
        """Return the bits lost where u hardly turns back, and where an argument turns fast."""
        bend = float(min(abs(self._bend(end)) for end in ends) / self._rate**2)
        turning = [
            float(np.sqrt(x * x + y * y) / (self._rate * size))
            for end in ends
            for size, (x, y) in zip(end, arm_rates(end, self._constants["l_z"]), strict=False)
            if size
        ]
        steep = math.log2(max(1.0, *turning) / max(bend, 2.0 ** -min(self.bits, 1000)))
        return steep + abs(math.log2(float(self._rate)))

    def _stepped(self, state: State) -> Real:
        """Take a step from a state, at time 0, and return its length [s]."""
        self._taylor.time = self._none
        for i, value in enumerate(state):
            self._taylor.state[i] = value
        return self._step(self._apart)

    def _swing(self, state: State) -> Swing:
        """Integrate to the next turning point, from one or from a state between two."""
        steps: list[SwingStep] = []
        elapsed, turned = self.wide("0"), (self._none, self._none)
        sign = sense(rise(state)) if rise(state) else 0
        while len(steps) < MOST_STEPS:
            length = self._stepped(state)
            steps.append(SwingStep(elapsed, length, state, turned, cut(self._taylor.tc, length)))
            end = tuple(self._taylor.state)
            rising = sense(rise(end))
            elapsed = elapsed + length
            if sign * rising < 0:
                since = self._turning_back(length, rising)
                return self._ended(steps, elapsed + since, self._dense(since))
            sign, (phi, psi) = rising, angles(end)
            state, turned = turned_back(end, phi), (turned[0] + phi, turned[1] + psi)
        raise Unfinished(f"no turning point in {MOST_STEPS} steps")

    def _turning_back(self, length: Real, sign: int) -> Real:
        """Return when u turns back in the last step, since its end [s]; `sign` is that of u' there.

        Newton's method, kept between the two times that are known to have the zero between them.
        """
        low, high = -length, self._none
        enough = length * self.number("2") ** -(self.bits // 2 + 4)
        x = low / 2
        for _ in range(MOST_ITERATIONS):
            state = self._dense(x)
            slope, value = self._bend(state), rise(state)
            low, high = (low, x) if sign * value > 0 else (x, high)
            new = x - value / slope if slope else low
            if abs(new - x) <= enough:  # the next change is its square
                return new
            x = new if low < new < high else (low + high) / 2
        return x  # all rounding: too few bits

    def _ended(self, steps: Sequence[SwingStep], duration: Real, state: State) -> Swing:
        """Return a swing that ends at a turning point, or begins and ends there."""
        l_z, P_plus, P_minus = (self._constants[name] for name in ("l_z", "P_plus", "P_minus"))
        q_0, q_1, q_2, q_3, *_ = state
        alpha_rate, beta_rate = arm_rates(state, l_z)
        a, alpha = _at_turning((q_0, q_3), alpha_rate, P_plus, self._rate)
        b, beta = _at_turning((q_1, q_2), beta_rate, P_minus, self._rate)
        *_, lean = turned_back(state, a + b)
        end = alpha, beta, self._none, self._none, self._none, lean
        phi, psi = steps[-1].turned if steps else (self._none, self._none)
        return Swing(duration, (phi + a + b, psi + a - b), end, tuple(steps))

    def _bend(self, state: State) -> Real:
        """Return the second time derivative of u, where n = l.e."""
        l_z, n, g = (self._constants[name] for name in ("l_z", "n", "g"))
        q_0, q_1, q_2, q_3, l_x, l_y = state
        u = q_0 * q_0 + q_3 * q_3 - q_1 * q_1 - q_2 * q_2
        return l_z * n - (l_x * l_x + l_y * l_y + l_z * l_z) * u - g * (1 - u * u)


def _at_turning(arm: Pair, speed: Pair, P: Real, rate: Real) -> Pair:
    """Return the argument of alpha or beta at a turning point, and its size.

    Closer to the pole than it moves in 1/rate, its size follows from P, which keeps its digits.
    """
    ahead = (rate * arm[0] + sense(P) * speed[1], rate * arm[1] - sense(P) * speed[0])
    size, fast = np.sqrt(arm[0] ** 2 + arm[1] ** 2), np.sqrt(speed[0] ** 2 + speed[1] ** 2)
    return np.arctan2(ahead[1], ahead[0]), size if fast <= rate * size else abs(P) / (4 * fast)


def sense(x: Real) -> int:
    """Return -1 where a number is negative, else 1: forward in time where P is zero."""
    return -1 if x < 0 else 1


def angles(state: Iterable[Real]) -> Pair:
    """Return what phi and psi have gained in a step [rad]; alpha and beta turn by less than pi.

    Where one is zero, in the middle of a pass, it is as the moment after: at a right angle.
    """
    q_0, q_1, q_2, q_3, *_ = state
    a, b = (np.arctan2(y + (x == 0) * (y == 0), x) for x, y in ((q_0, q_3), (q_1, q_2)))
    return a + b, a - b


def turned_back(state: State, phi: Real) -> State:
    """Return a state as it is once alpha and beta are turned until they are real."""
    q_0, q_1, q_2, q_3, l_x, l_y = state
    alpha, beta, none = np.sqrt(q_0**2 + q_3**2), np.sqrt(q_1**2 + q_2**2), phi - phi
    c, s = np.cos(phi), np.sin(phi)
    return alpha, beta, none, none, c * l_x + s * l_y, c * l_y - s * l_x


def rise(state: Sequence[Real]) -> Real:
    """Return the rate of u = cos(theta)."""
    q_0, q_1, q_2, q_3, l_x, l_y = state
    return -2 * (l_x * (q_0 * q_1 - q_2 * q_3) + l_y * (q_0 * q_2 + q_1 * q_3))


def cut(coefficients: Any, length: Real) -> Array:
    """Return polynomials in doubles, shape (order + 1, n), from coefficients of shape (n, ...).

    They are in the fraction of a step, and end where doubles do not feel the rest.
    """
    powers = np.array([length**k for k in range(coefficients.shape[1])])
    terms: Array = (coefficients * powers).astype(np.float64).T
    felt = (np.abs(terms) > CUT * np.abs(terms).max(axis=0)).any(axis=1)
    return terms[: np.flatnonzero(felt)[-1] + 1]
