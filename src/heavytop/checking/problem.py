"""What a trajectory of somebody else is held against: a top, and a start told or fitted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final, Literal

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.analytic.record import Record
from heavytop.checking.data import ANGLES, RATES, Array, Data
from heavytop.errors import HeavyTopError, Impossible
from heavytop.scene.state import State
from heavytop.scene.top import Top

FIRST_FITTED: Final = 12  # rows that a fit begins with
FITTED: Final = 1000  # rows that it ends with
FITS: Final = 1e-3  # rad: a fit that is farther off, RMS, is none
STEP: Final = 1e-7  # of a difference quotient
ROUNDS: Final = 30
NO_AXIS: Final = (
    "none follows from {} alone: give a scene with a start, or add the axis (theta and phi)"
)
LEAST: Final = 2.0**-53  # rad: the least error
START: Final = ("theta", "phi", "thetadot", "phidot", "omega3")  # what is fitted

Origin = Literal["scene", "first row", "fitted"]


@dataclass(frozen=True)
class Comparison:
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
    def exact(self) -> Record:
        """The exact motion at the times of the data."""
        found: Record = self.motion.at(self.since)
        return found

    def off(self) -> Array:
        """How far the data are off, a row at each time: the axis, else a told angle [rad]."""
        if self.data.axis is not None:
            off: Array = self.data.axis - self.exact.axis
            return off
        name = next(name for name in ANGLES if name in self.data.told)
        return wrapped(self.data.told[name] - getattr(self.exact, name))[:, None]

    @cached_property
    def digits(self) -> float:
        """The decimal digits that the data have, where they are fewest."""
        off = self.off()
        largest = float(np.sqrt((off * off).sum(axis=1)).max())
        return max(0.0, -float(np.log10(max(largest, LEAST))))

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
    speed = np.cross(omega, axis)
    phidot = float(axis[0] * speed[1] - axis[1] * speed[0]) / sine**2
    thetadot = -float(speed[2]) / sine
    return State(**angles, thetadot=thetadot, phidot=phidot, omega3=float(omega @ axis))


def _fitted(problem: Comparison) -> State:
    """The start of the motion that comes nearest to the data, from more and more of them."""
    data = problem.data
    if data.axis is None:
        raise Impossible([("start", NO_AXIS.format(", ".join(data.told)))])
    first = replace(data, t=data.t - data.t[0])
    some = first.some(slice(None, None, -(-data.t.size // FITTED)))
    guess = _first_row(first.telling(omega=_omega(problem.top, first)))

    def state(p: Array) -> State:
        return State(**dict(zip(START, p, strict=True)), psi=guess.psi)

    def tried(p: Array, rows: int) -> Comparison:
        return Comparison(some.some(slice(0, rows)), problem.top, state(p))

    best = fit(tried, np.array([float(getattr(guess, name)) for name in START]), some.t.size)
    if not tried(best, some.t.size).misfit < FITS:
        raise Impossible(
            [("start", "no start fits these data: give a scene with a start, or add rates")]
        )
    return state(best)


def _omega(top: Top, data: Data) -> Array:
    """The angular velocity by differences of the first rows, at these alone.

    A e × ë + C ω₃ ė = −gMR e × ẑ gives ω₃.
    """
    A, C, gMR = float(top.A), float(top.C), float(top.gMR)
    t, axis = data.t[:FIRST_FITTED], data.axis[:FIRST_FITTED]
    speed = np.gradient(axis, t, axis=0, edge_order=2)
    faster = np.gradient(speed, t, axis=0, edge_order=2)
    torque = A * np.cross(axis, faster) + gMR * np.cross(axis, [0.0, 0.0, 1.0])
    inner = slice(2, -2)
    omega3 = -(speed * torque)[inner].sum() / (C * (speed * speed)[inner].sum() or 1.0)
    omega: Array = np.cross(axis, speed) + omega3 * axis
    return omega


def fit(tried: Callable[[Array, int], Comparison], p: Array, rows: int) -> Array:
    """Parameters that fit best by Gauss and Newton, over twice as many rows each time."""
    many = FIRST_FITTED
    while True:
        many = min(many, rows)
        for _ in range(ROUNDS):
            here = tried(p, many)
            if not np.isfinite(here.misfit):
                return p
            off, size = here.off().ravel(), np.maximum(abs(p), 1e-3)
            moved = p + STEP * np.diag(size)
            slopes = np.array([tried(q, many).off().ravel() - off for q in moved]) / STEP
            step = size * np.linalg.lstsq(slopes.T, -off, rcond=None)[0]
            shorter = (p + step / 4**k for k in range(8))
            better = next((q for q in shorter if tried(q, many).misfit < here.misfit), None)
            if better is None:
                break
            p = better
        if many == rows or not tried(p, many).misfit < FITS:
            return p
        many *= 2
