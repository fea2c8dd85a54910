"""A state at a turning point of theta, seen from where it looks simplest.

With alpha, beta and P as in `turns`, and w = l_x + i l_y,

    2 alpha' = i l_z alpha - w beta*,    2 beta' = i l_z beta + w alpha*,    w' = 2 g alpha beta.

At a turning point alpha and beta each move at right angles to themselves. Turned about the vertical
and about the axis of the body until both are real and not negative, w is imaginary, and the motion
is the same in either direction of time:

    alpha(-t) = alpha(t)*,    beta(-t) = beta(t)*,    w(-t) = -w(t)*.

A pass through a pole is a turning point where alpha or beta is zero and has a speed; it is the
limit of close passes on the side to which the argument then turns.

The numbers may be of any type that has arithmetic and numpy's functions, such as heyoka's reals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from heavytop.integration.following import Pair, arm_rates

Real = Any


@dataclass(frozen=True, slots=True)
class Turning:
    """A turning point.

    Attributes
    ----------
    arguments : pair of real
        Of alpha and beta [rad], in (-pi, pi].
    state : tuple of 6 real
        q_0 ... q_3, l_x, l_y after both have been turned to zero.
    steepness : real
        By how much faster than its own rate the argument of alpha or of beta turns.
    """

    arguments: Pair
    state: tuple[Real, ...]
    steepness: Real


def turning(state: Sequence[Real], l_z: Real, momenta: Pair, rate: Real) -> Turning:
    """Return a turning point.

    Parameters
    ----------
    state : sequence of 6 real
        q_0 ... q_3, l_x, l_y.
    l_z : real
    momenta : pair of real
        P_plus and P_minus, four times the angular momenta of alpha and beta.
    rate : real
        A typical rate of the motion [rad/s], to tell passes by.
    """
    q_0, q_1, q_2, q_3, l_x, l_y = state
    arms = ((q_0, q_3), (q_1, q_2))
    seen = [_seen(*each, rate) for each in zip(arms, arm_rates(state, l_z), momenta, strict=True)]
    (a, alpha, fast), (b, beta, also_fast) = seen
    lean = l_y * np.cos(a + b) - l_x * np.sin(a + b)
    zero = l_x - l_x
    return Turning((a, b), (alpha, beta, zero, zero, zero, lean), max(fast, also_fast))


def _seen(arm: Pair, speed: Pair, P: Real, rate: Real) -> tuple[Real, Real, Real]:
    """Return the argument of alpha or beta, its size, and its steepness.

    Closer to the pole than it moves in 1/rate, its size follows from P, which keeps its digits.
    """
    ahead = (rate * arm[0] + sense(P) * speed[1], rate * arm[1] - sense(P) * speed[0])
    size, fast = np.sqrt(arm[0] ** 2 + arm[1] ** 2), np.sqrt(speed[0] ** 2 + speed[1] ** 2)
    argument = np.arctan2(ahead[1], ahead[0])
    if fast <= rate * size:
        return argument, size, rate / rate
    size = abs(P) / (4 * fast)
    return argument, size, fast / (rate * size) if P else rate / rate


def sense(x: Real) -> int:
    """Return -1 where a number is negative, else 1: forward in time where P is zero."""
    return -1 if x < 0 else 1


def arguments(state: Sequence[Real]) -> Pair:
    """Return the arguments of alpha and beta [rad]."""
    q_0, q_1, q_2, q_3, *_ = state
    return np.arctan2(q_3, q_0), np.arctan2(q_2, q_1)


def rise(state: Sequence[Real]) -> Real:
    """Return the rate of u = cos(theta)."""
    q_0, q_1, q_2, q_3, l_x, l_y = state
    return -2 * (l_x * (q_0 * q_1 - q_2 * q_3) + l_y * (q_0 * q_2 + q_1 * q_3))


def rise_rate(state: Sequence[Real], l_z: Real, n: Real, g: Real) -> Real:
    """Return the second time derivative of u, where n = l.e."""
    q_0, q_1, q_2, q_3, l_x, l_y = state
    u = q_0 * q_0 + q_3 * q_3 - q_1 * q_1 - q_2 * q_2
    return l_z * n - (l_x * l_x + l_y * l_y + l_z * l_z) * u - g * (1 - u * u)
