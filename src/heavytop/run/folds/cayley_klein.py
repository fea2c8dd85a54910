"""Physical quantities from alpha and beta, the Cayley-Klein parameters, and phi and psi in turns.

With alpha, beta, P and w = l_x + i l_y as in `taylor.turning`,

    phidot = (P_plus/|alpha|^2 + P_minus/|beta|^2) / 4,
    psidot = kappa + (P_plus/|alpha|^2 - P_minus/|beta|^2) / 4,

where no pole makes anything cancel. Numbers are doubles, arrays of them, or mpmath's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from heavytop.run.folds.sample import FoldedSample
from heavytop.run.folds.turned import Arithmetic, Real, Turned

Angles = tuple[Turned, Turned]  # phi and psi
Vector = tuple[Real, Real, Real]


@dataclass(frozen=True, slots=True)
class Constants:
    """P_plus, P_minus, l_z and kappa [rad/s]."""

    P_plus: Real
    P_minus: Real
    l_z: Real
    kappa: Real


def nodding(
    m: Arithmetic,
    t: Real,
    state: Sequence[Real],
    sign: Real,
    at_turning: Turned,
    angles: Angles,
    c: Constants,
) -> FoldedSample:
    """Return the motion before (sign = -1) or after (1) a turning point.

    Parameters
    ----------
    m : Arithmetic
    t : real
        Time [s].
    state : sequence of 6 real
        q_0 ... q_3, l_x, l_y as long after it, seen from where it looks simplest.
    sign : real
    at_turning : Turned
        phi at the turning point.
    angles : pair of Turned
        phi and psi at the time itself.
    c : Constants
    """
    q_0, q_1, q_2, q_3, l_x, l_y = state
    up, down = m.sqrt(q_0 * q_0 + q_3 * q_3), m.sqrt(q_1 * q_1 + q_2 * q_2)
    plus, minus = _over(c.P_plus, 4 * up * up), _over(c.P_minus, 4 * down * down)
    across = up * down
    tilting = _over(l_x * (q_0 * q_1 - q_2 * q_3) + l_y * (q_0 * q_2 + q_1 * q_3), across)
    leaving = (across == 0) * m.sqrt(l_x * l_x + l_y * l_y) * (1 - 2 * (up == 0))  # a pole
    rates = (sign * tilting + leaving, plus + minus, c.kappa + plus - minus)
    cos, sin = _circle(m, at_turning)
    l_x = sign * l_x
    momentum = (l_x * cos - l_y * sin, l_x * sin + l_y * cos, c.l_z)
    return _sample(m, t, (up, down), angles, rates, momentum, c.kappa)


def steady(
    m: Arithmetic, t: Real, half: tuple[Real, Real], rates: tuple[Real, Real], angles: Angles
) -> FoldedSample:
    """Return the motion at constant theta, with cosine and sine of theta/2, phidot and psidot."""
    none = 0 * t
    up, down, phidot, psidot = (x + none for x in (*half, *rates))
    momentum = (none, none, phidot)
    return _sample(m, t, (up, down), angles, (none, phidot, psidot), momentum, psidot)


def _sample(
    m: Arithmetic,
    t: Real,
    half: tuple[Real, Real],
    angles: Angles,
    rates: Vector,
    momentum: Vector,
    spin: Real,
) -> FoldedSample:
    """Return the motion; omega = momentum + spin e."""
    (up, down), (phi, psi) = half, angles
    cos, sin = _circle(m, phi)
    axis = (2 * up * down * sin, -2 * up * down * cos, (up - down) * (up + down))
    x, y, z = (l + spin * e for l, e in zip(momentum, axis, strict=True))  # noqa: E741
    thetadot, phidot, psidot = rates
    turn = 2 * m.pi
    return FoldedSample(
        t=t,
        theta=2 * m.atan2(down, up),
        phi=turn * (phi.whole + phi.rest),
        psi=turn * (psi.whole + psi.rest),
        phi_turns=phi.whole,
        psi_turns=psi.whole,
        phi_mod=turn * phi.rest,
        psi_mod=turn * psi.rest,
        thetadot=thetadot,
        phidot=phidot,
        psidot=psidot,
        axis=axis,
        omega=(x, y, z),
        quaternion=_quaternion(m, up, down, angles),
    )


def _over(numerator: Real, divisor: Real) -> Real:
    """Return a quotient, or 0 for 0/0."""
    return numerator / (divisor + (divisor == 0))


def _circle(m: Arithmetic, angle: Turned) -> tuple[Real, Real]:
    radians = 2 * m.pi * angle.rest
    return m.cos(radians), m.sin(radians)


def _quaternion(m: Arithmetic, up: Real, down: Real, angles: Angles) -> tuple[Real, ...]:
    phi, psi = angles
    odd = 1 - 2 * ((phi.whole + psi.whole) % 2)  # half of an odd number of turns makes q -q
    plus, minus = m.pi * (phi.rest + psi.rest), m.pi * (phi.rest - psi.rest)
    up, down = odd * up, odd * down
    return (up * m.cos(plus), down * m.cos(minus), down * m.sin(minus), up * m.sin(plus))
