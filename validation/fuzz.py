"""Random scenes where numbers break: over 16 decades, at the poles and past them, beside cusps."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

import heavytop as ht
from heavytop.errors import Impossible

FAMILIES = ("any", "pole-start", "close-pass", "cusp-kick", "sleeper", "steady", "planar", "fast")


def scenes(seed: int, count: int, families: tuple[str, ...] = FAMILIES) -> Iterator[ht.Scene]:
    """Yield random scenes, each named by its family, seed and number; the span is a few nods."""
    for number in range(count):
        family = families[number % len(families)]
        yield scene(family, random.Random(f"{family} {seed} {number}"), f"{family}-{seed}-{number}")


def scene(family: str, draw: random.Random, name: str) -> ht.Scene:
    """Return one random scene of a family: the same for the same state of `draw`."""
    while True:
        try:
            top = _top(draw)
            start = _START[family](draw, top)
            time = _rate(top, start) ** -1 * draw.uniform(0.5, 40) * draw.choice((1, 1, -1))
            return ht.Scene(top, start, time=time, name=name)
        except Impossible:
            continue


def _top(draw: random.Random) -> ht.Top:
    A = 10 ** draw.uniform(-8, 8)
    C = A * draw.choice((draw.uniform(0.02, 2), 10 ** draw.uniform(-4, 0), 1.0))
    sign = draw.choice((1, 1, 1, -1))
    return ht.Top(A, C, sign * A * 10 ** draw.uniform(-4, 4))


def _slow(top: ht.Top) -> float:
    """Return the rate of the pendulum that the top would be without spin [rad/s]."""
    return math.sqrt(abs(float(top.gMR)) / float(top.A))


def _rate(top: ht.Top, start: ht.State) -> float:
    """Return about how fast it nods [rad/s]."""
    spin = float(top.C) / float(top.A) * abs(float(start.omega3))
    return _slow(top) + spin + abs(float(start.phidot)) + abs(float(start.thetadot))


def _sleeping(top: ht.Top) -> float:
    """Return the spin rate from which on it sleeps [rad/s]."""
    return 2 * float(top.A) / float(top.C) * _slow(top)


def _signed(draw: random.Random, low: float, high: float) -> float:
    return draw.choice((-1, 1)) * 10 ** draw.uniform(low, high)


def _tiny_tilt(draw: random.Random) -> float:
    tilt = 10 ** draw.uniform(-12, -1)
    return tilt if draw.random() < 0.75 else math.pi - tilt


def _any(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    return ht.State(
        theta=draw.uniform(0.01, 3.13),
        phi=draw.uniform(-3, 3),
        psi=draw.uniform(-3, 3),
        thetadot=slow * _signed(draw, -3, 1),
        phidot=slow * _signed(draw, -3, 1),
        psidot=_sleeping(top) * _signed(draw, -2, 1),
    )


def _pole_start(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    return ht.State(
        theta=0 if draw.random() < 0.6 else "pi",
        phi=draw.uniform(-7, 7),
        psi=draw.uniform(-7, 7),
        thetadot=slow * 10 ** draw.uniform(-3, 1),
        psidot=draw.choice((0.0, _sleeping(top) * _signed(draw, -3, 1))),
    )


def _close_pass(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    return ht.State(
        theta=_tiny_tilt(draw),
        phi=draw.uniform(-3, 3),
        thetadot=slow * draw.choice((0.0, _signed(draw, -3, 1))),
        phidot=slow * draw.choice((0.0, _signed(draw, -3, 1))),
        psidot=_sleeping(top) * _signed(draw, -3, 0.5),
    )


def _cusp_kick(draw: random.Random, top: ht.Top) -> ht.State:
    return ht.State(
        theta=draw.choice((draw.uniform(0.05, 3.0), 10 ** draw.uniform(-6, -1))),
        phidot=_slow(top) * draw.choice((0.0, _signed(draw, -15, -9), _signed(draw, -9, -1))),
        psidot=_sleeping(top) * _signed(draw, -0.5, 0.7),
    )


def _sleeper(draw: random.Random, top: ht.Top) -> ht.State:
    near = 1 + _signed(draw, -12, -1)
    return ht.State(
        theta=10 ** draw.uniform(-12, -2),
        phidot=_slow(top) * draw.choice((0.0, _signed(draw, -6, 0))),
        psidot=_sleeping(top) * near * draw.choice((-1, 1)),
    )


def _steady(draw: random.Random, top: ht.Top) -> ht.State:
    theta, omega3 = draw.uniform(0.1, 1.5), _sleeping(top) * 10 ** draw.uniform(0.1, 0.7)
    A, C, gMR = (float(x) for x in (top.A, top.C, top.gMR))
    p_psi = C * omega3
    root = math.sqrt(abs(p_psi**2 - 4 * A * gMR * math.cos(theta)))
    phidot = 2 * gMR / (p_psi + root) * (1 + _signed(draw, -14, -2))
    return ht.State.kicked(theta=theta, omega3=omega3, phidot=phidot)


def _planar(draw: random.Random, top: ht.Top) -> ht.State:
    slow = _slow(top)
    theta = draw.choice((0, "pi/3", "2*pi/3", "pi/2", "pi", draw.uniform(0, math.pi)))
    return ht.State(
        theta=theta, phi=draw.uniform(-3, 3), psi=1.0, thetadot=slow * _signed(draw, -2, 1)
    )


def _fast(draw: random.Random, top: ht.Top) -> ht.State:
    return ht.State(
        theta=draw.choice((draw.uniform(0.05, 3.0), _tiny_tilt(draw))),
        thetadot=_slow(top) * draw.choice((0.0, _signed(draw, -3, 2))),
        phidot=_slow(top) * draw.choice((0.0, _signed(draw, -3, 2))),
        psidot=_sleeping(top) * _signed(draw, 1, 4),
    )


_START = {
    "any": _any,
    "pole-start": _pole_start,
    "close-pass": _close_pass,
    "cusp-kick": _cusp_kick,
    "sleeper": _sleeper,
    "steady": _steady,
    "planar": _planar,
    "fast": _fast,
}
