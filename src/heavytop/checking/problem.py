"""What a trajectory of somebody else is held against: a top, and a start told or fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final, Literal

import numpy as np

from heavytop.analytic.many_times import DoubleRecord
from heavytop.analytic.motion import Motion
from heavytop.checking.data import ANGLES, RATES, Array, Data
from heavytop.errors import HeavyTopError, Impossible
from heavytop.scene.state import State
from heavytop.scene.top import Top

FIRST_FITTED: Final = 12  # rows that a fit begins with
FITTED: Final = 1000  # rows that it ends with
FITS: Final = 1e-3  # rad: a fit that is farther off, RMS, is none
STEP: Final = 1e-7  # of a difference quotient
ROUNDS: Final = 30

Origin = Literal["scene", "first row", "fitted"]


@dataclass(frozen=True)
class Problem:
    """Data, and the motion that they are held against; without a start it is that of the data."""

    data: Data
    top: Top
    given: State | None

    @property
    def origin(self) -> Origin:
        """Where the start is from."""
        if self.given is not None:
            return "scene"
        return "fitted" if self.data.spinning is None or self.data.axis is None else "first row"

    @cached_property
    def start(self) -> State:
        """The start: the given one, that of the first row, or the one that fits best."""
        if self.given is not None:
            return self.given
        return _first_row(self.data) if self.origin == "first row" else _fitted(self)

    @cached_property
    def motion(self) -> Motion:
        """The exact motion."""
        return Motion(self.top, self.start)

    @property
    def since(self) -> Array:
        """Times since the start [s]."""
        return self.data.t - (0.0 if self.given is not None else self.data.t[0])

    @cached_property
    def exact(self) -> DoubleRecord:
        """The exact motion at the times of the data."""
        return self.motion.at(self.since)

    def off(self) -> Array:
        """How far the data are off, a row at each time: the axis, else a told angle [rad]."""
        if self.data.axis is not None:
            off: Array = self.data.axis - self.exact.axis
            return off
        name = next(name for name in ANGLES if name in self.data.told)
        return wrapped(self.data.told[name] - getattr(self.exact, name))[:, None]

    @cached_property
    def misfit(self) -> float:
        """The RMS of that; infinite where there is no such motion."""
        try:
            return float(np.sqrt((self.off() ** 2).sum(axis=1).mean()))
        except HeavyTopError:
            return np.inf


def wrapped(angle: Array) -> Array:
    """An angle in [−π, π]."""
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def _first_row(data: Data) -> State:
    """The start that the first row tells."""
    angles = {name: float(data.angle(name)[0]) for name in ("theta", "phi")}
    if (psi := data.angle("psi")) is not None:
        angles["psi"] = float(psi[0])
    if {*RATES} <= data.told.keys():
        return State(**angles, **{rate: float(data.told[rate][0]) for rate in RATES})
    axis, omega = data.axis[0], data.omega[0]
    sine = np.hypot(*axis[:2])
    if not sine:
        raise Impossible([("start", "a first row whose axis is not vertical")])
    moving = np.cross(omega, axis)
    phidot = float(axis[0] * moving[1] - axis[1] * moving[0]) / sine**2
    return State(
        **angles,
        thetadot=-float(moving[2]) / sine,
        phidot=phidot,
        omega3=float(omega @ axis),
    )


def _fitted(problem: Problem) -> State:
    """The start of the motion that comes nearest to the data, from more and more of them."""
    data = problem.data
    if data.axis is None:
        raise Impossible([("start", "a start, or data with rates or with the axis")])
    first = replace(data, t=data.t - data.t[0])
    some = first.some(slice(None, None, -(-data.t.size // FITTED)))

    def state(p: Array) -> State:
        return State(p[0], phi=p[1], thetadot=p[2], phidot=p[3], omega3=p[4])

    def tried(p: Array, rows: int) -> Problem:
        return Problem(some.some(slice(0, rows)), problem.top, state(p))

    best = fit(tried, _guess(problem.top, first), some.t.size)
    if not tried(best, some.t.size).misfit < FITS:
        raise Impossible([("start", "a start, or data with rates: no start fits these")])
    return state(best)


def _guess(top: Top, data: Data) -> Array:
    """A start from differences of the first rows: A e × ë + C ω₃ ė = −gMR e × ẑ gives ω₃."""
    A, C, gMR = float(top.A), float(top.C), float(top.gMR)
    t, axis = data.t[:FIRST_FITTED], data.axis[:FIRST_FITTED]
    speed = np.gradient(axis, t, axis=0, edge_order=2)
    faster = np.gradient(speed, t, axis=0, edge_order=2)
    inner = slice(2, -2)
    torque = A * np.cross(axis, faster) + gMR * np.cross(axis, [0.0, 0.0, 1.0])
    omega3 = -(speed * torque)[inner].sum() / (C * (speed * speed)[inner].sum())
    (x, y, z), (dx, dy, dz) = axis[0], speed[0]
    sine = np.hypot(x, y)
    return np.array(
        [np.arctan2(sine, z), np.arctan2(x, -y), -dz / sine, (x * dy - y * dx) / sine**2, omega3]
    )


def fit(tried: Callable[[Array, int], Problem], p: Array, rows: int) -> Array:
    """Parameters that fit best by Gauss and Newton, over twice as many rows each time."""
    many = FIRST_FITTED
    while True:
        many = min(many, rows)
        for _ in range(ROUNDS):
            here = tried(p, many)
            if not np.isfinite(here.misfit):
                return p
            moved = [_moved(p, k) for k in range(p.size)]
            slopes = [(tried(q, many).off() - here.off()).ravel() / STEP for q in moved]
            step = np.linalg.lstsq(np.array(slopes).T, -here.off().ravel(), rcond=None)[0]
            step *= _size(p)
            better = next(
                (q for k in range(8) if tried(q := p + step / 4**k, many).misfit < here.misfit),
                None,
            )
            if better is None:
                break
            p = better
        if many == rows or not tried(p, many).misfit < FITS:
            return p
        many *= 2


def _size(p: Array) -> Any:
    return np.maximum(abs(p), 1e-3)


def _moved(p: Array, k: int) -> Array:
    q = p.copy()
    q[k] += STEP * _size(p)[k]
    return q
