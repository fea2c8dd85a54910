"""A trajectory compared with the exact motion: the quantities, their errors, and the start."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.checking.reading import POSITIONS, matrices, norm
from heavytop.errors import FoldedTiltWarning, HeavyTopError, Impossible
from heavytop.exact.pairs import Array
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.state import State
from heavytop.scene.top import Top

MOMENT_NAMES: Final = ("A", "C", "gMR")
FIRST_FITTED: Final = 12  # rows that a fit begins with
FITTED: Final = 1000  # rows that it ends with
MOST_MISFIT: Final = 1e-3  # rad, RMS, of a fit that is accepted
FOLD_ALLOWED: Final = 1e-9  # rad beyond [0, π] that are ignored
FIRST_ERROR: Final = 0.02  # rad, of the first row, where no integrator has made an error yet
LEAST_MOTION: Final = 0.05  # rad that data move where conventions are undone
FITTED_START: Final = ("theta", "phi", "thetadot", "phidot", "omega3")  # fitted numbers
COMPARED_QUANTITIES: Final = ("matrix", *ANGLES, *RATES, "axis", "vertical", "omega", "omega_body")

Origin = Literal["scene", "first row", "fitted"]

DERIVED: Final[Mapping[str, Callable[[Any], Any]]] = {
    "sine": lambda exact: np.sin(exact.theta),
    "matrix": lambda exact: matrices(exact.quaternion),  # the attitude, from body to space
    "vertical": lambda exact: exact.matrix[:, 2],
    "omega_body": lambda exact: np.einsum("nji,nj->ni", exact.matrix, exact.omega),
    "fastest": lambda exact: float(norm(exact.omega).max()) or 1.0,
}
"""Quantities computed from a record: sin θ, the upward vertical in the body, the largest ω, …"""


class ExactMotion:
    """The exact motion at some times: the quantities of a record, and those of `DERIVED`."""

    def __init__(self, motion: Motion, t: Array) -> None:
        self.record: Any = motion.at(t)

    def __getattr__(self, name: str) -> Any:
        derive = DERIVED.get(name)
        found = self.__dict__[name] = derive(self) if derive else getattr(self.record, name)
        return found

    def value(self, name: str) -> Any:
        """A quantity to compare data with; φ and ψ are modulo 2π."""
        return getattr(self, f"{name}_mod" if name in ("phi", "psi") else name)


_motion = lru_cache(maxsize=64)(Motion)


@lru_cache(maxsize=64)
def _exact_motion(top: Top, start: State, times: bytes) -> ExactMotion:
    """The exact motion at times that are given by the bytes of their array."""
    return ExactMotion(_motion(top, start), np.frombuffer(times))


@dataclass(frozen=True)
class Comparison:
    """Data and the exact motion that they are compared with.

    `given` is its start; without one the start is taken from the data.
    """

    arrays: Mapping[str, Array]
    top: Top
    given: State | None

    @property
    def t(self) -> Array:
        """The times of the data [s]."""
        return self.arrays["t"]

    @property
    def origin(self) -> Origin:
        """The source of the start."""
        if self.given is not None:
            return "scene"
        return "fitted" if self.spin is None else "first row"

    @cached_property
    def start(self) -> State:
        """The start: the given one, that of the first row, or the one that fits best."""
        if self.given is not None:
            return self.given
        with warnings.catch_warnings():  # there is a remark on folded tilts of the data already
            warnings.simplefilter("ignore", FoldedTiltWarning)
            return first_row(self) if self.origin == "first row" else _fit_start(self)

    @property
    def motion(self) -> Motion:
        """The exact motion."""
        return _motion(self.top, self.start)

    @cached_property
    def elapsed(self) -> Array:
        """Times since the start [s]."""
        return self.t - (0.0 if self.given is not None else self.t[0])

    @cached_property
    def exact(self) -> ExactMotion:
        """The exact motion at the times of the data."""
        if self.t.size > FITTED:
            return ExactMotion(self.motion, self.elapsed)
        return _exact_motion(self.top, self.start, self.elapsed.tobytes())

    def replace_values(self, **values: Array | None) -> Comparison:
        """The comparison with other values of some quantities; None removes one."""
        arrays = {k: v for k, v in (dict(self.arrays) | values).items() if v is not None}
        other = replace(self, arrays=arrays)
        if self.given is not None and "t" not in values:  # the same motion at the same times
            other.__dict__["exact"] = self.exact
        return other

    def with_numbers(self, **numbers: Any) -> Comparison:
        """The comparison with other numbers of the top or of the start."""
        top = {name: float(getattr(self.top, name)) for name in MOMENT_NAMES}
        if numbers.keys() & top.keys():
            return replace(self, top=Top.of_numbers(**top | numbers))
        spin = () if numbers.keys() & {"psidot", "omega3"} else (self.start.held,)
        names = (*ANGLES, "thetadot", "phidot", *spin)
        start = {name: float(getattr(self.start, name)) for name in names}
        return replace(self, given=State(**start | numbers))

    def rows(self, which: Any) -> Comparison:
        """The comparison of some rows alone."""
        return replace(self, arrays={name: x[which] for name, x in self.arrays.items()})

    @cached_property
    def folded(self) -> Comparison:
        """The comparison with θ in [0, π]: where it is beyond, φ and ψ turn by π, θ̇ is negated."""
        theta, values = self.values.get("theta"), self.values
        if theta is None or ((theta > -FOLD_ALLOWED) & (theta < np.pi + FOLD_ALLOWED)).all():
            return self
        reduced = np.mod(theta, 2 * np.pi)
        beyond = reduced > np.pi
        turned = {name: values[name] + np.pi * beyond for name in ("phi", "psi") if name in values}
        if "thetadot" in values:
            turned["thetadot"] = values["thetadot"] * (1 - 2 * beyond)
        return self.replace_values(theta=np.where(beyond, 2 * np.pi - reduced, reduced), **turned)

    # --- the quantities of the data, and those that follow from them -------------------------

    @cached_property
    def values(self) -> Mapping[str, Array]:
        """The arrays of the data, and ω in the body where they have the momentum there."""
        values, top = self.arrays, self.top
        if "omega_body" in values or "momentum_body" not in values or top.C == 0:
            return values
        moments = [float(x) for x in (top.A, top.A, top.C)]
        return {**values, "omega_body": values["momentum_body"] / moments}

    @cached_property
    def derived(self) -> dict[str, Array]:
        """The values, and the axis, the vertical and the angles that follow from them."""
        found = dict(self.values)
        if "matrix" in found:
            found |= {"axis": found["matrix"][:, :, 2], "vertical": found["matrix"][:, 2]}
        if "theta" in found and "phi" in found:
            found.setdefault("axis", axes(found["theta"], found["phi"]))
        if "theta" in found and "psi" in found:
            found.setdefault("vertical", axes(found["theta"], np.pi - found["psi"]))
        for name, angle, sign in (("axis", "phi", -1), ("vertical", "psi", 1)):
            if name in found:
                x, y, z = found[name].T
                found.setdefault("theta", np.arctan2(np.hypot(x, y), z))
                found.setdefault(angle, np.arctan2(x, sign * y))
        return found

    @cached_property
    def spin(self) -> tuple[Array, Array, Array] | None:
        """The angular velocity, the symmetry axis and the vertical in one frame; None without ω."""
        known, upward = self.derived, np.broadcast_to([0.0, 0.0, 1.0], (self.t.size, 3))
        if known.keys() >= {"theta", *RATES}:
            thetadot, phidot, psidot = (known[name] for name in RATES)
            e = axes(known["theta"], np.zeros_like(phidot))
            nodes = np.stack([thetadot, 0 * phidot, phidot], axis=-1)
            return nodes + psidot[:, None] * e, e, upward
        if known.keys() >= {"omega", "axis"}:
            return known["omega"], known["axis"], upward
        if known.keys() >= {"omega_body", "vertical"}:
            return known["omega_body"], upward, known["vertical"]
        return None

    # --- the errors of the data --------------------------------------------------------------

    @cached_property
    def errors(self) -> dict[str, Array]:
        """The error of each quantity at each time: positions [rad], rates over the largest one."""
        exact, values, found = self.exact, self.folded.values, dict[str, Array]()
        for name in [name for name in COMPARED_QUANTITIES if name in values]:
            other = exact.value(name)
            off, scale = values[name] - other, 1.0
            if name in ANGLES:
                off = wrap(off) * (1.0 if name == "theta" else exact.sine)
            elif name == "matrix":
                scale = np.sqrt(2)
            elif name not in POSITIONS:
                scale = max(float(norm(other).max()), 1e-3 * exact.fastest)
            found[name] = norm(off) / scale
        return found

    @property
    def first_error(self) -> float:
        """The error of the first row, where that is the start itself [rad]; else 0."""
        positions = [x[0] for name, x in self.errors.items() if name in POSITIONS]
        return float(max(positions, default=0.0)) if self.elapsed[0] == 0 else 0.0


def octaves(size: int, most: int = 8) -> tuple[Any, Any]:
    """Choose at most `most` rows of every octave; return the rows, and where each octave begins.

    Octaves are the first row, the second, two more, four more, …: early rows weigh most.

    >>> rows, begins = octaves(100, 4)
    >>> rows[begins].tolist(), len(rows)
    ([0, 1, 2, 4, 8, 16, 32, 64], 24)
    """
    edges = sorted({0, *(2**k for k in range(int(np.log2(size)) + 1)), size})
    spread = (np.linspace(a, b - 1, min(b - a, most)) for a, b in pairwise(edges))
    each = [np.unique(rows.astype(int)) for rows in spread]
    return np.concatenate(each), np.cumsum([0, *map(len, each[:-1])])


def decades(c: Comparison, begins: Any, least: float = LEAST_MOTION) -> Array:
    """The misfit of each quantity: log10 of its error over the motion's path, mean of octaves.

    Each octave begins at one of the rows `begins`. The error of an integrator grows from nothing
    with the motion; that of a convention is there from the first row on, or as large as the motion.
    A motion of less than `least` [rad] explains nothing.
    """
    errors = np.array([*c.errors.values()]) + 1e-9  # smaller errors make no difference
    axis, attitude = (norm(x - x[0]) for x in (c.exact.axis, c.exact.matrix / np.sqrt(2)))
    moved = np.array([axis if name in ("axis", "theta", "phi") else attitude for name in c.errors])
    squares = (errors / (errors + moved + 1e-3)) ** 2  # motions below 1e-3 rad say little
    if moved.max() < least:  # as if time were frozen: everything fits that
        squares[:] = 1.0
    sums, counts = np.add.reduceat(squares, begins, axis=1), np.diff([*begins, errors.shape[1]])
    return np.asarray(np.log10(sums / counts).mean(axis=1) / 2)


# --- geometry ------------------------------------------------------------------------------------


def wrap(angle: Array) -> Array:
    """An angle in [−π, π]."""
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def axes(theta: Array, phi: Array) -> Array:
    """The symmetry axis of a tilt and an azimuth."""
    sine = np.sin(theta)
    return np.stack([sine * np.sin(phi), -sine * np.cos(phi), np.cos(theta)], axis=-1)


# --- the start -----------------------------------------------------------------------------------


def first_row(c: Comparison) -> State:
    """The start of the values of the first row."""
    angles = {name: float(c.derived[name][0]) for name in ANGLES if name in c.derived}
    if c.values.keys() >= {*RATES}:
        return State(**angles, **{name: float(c.values[name][0]) for name in RATES})
    assert c.spin is not None
    omega, axis, upward = (x[0] for x in c.spin)
    nodes = np.cross(upward, axis)
    sine = float(np.sqrt(nodes @ nodes))
    if not sine:
        raise Impossible([("start", "a first row whose axis is not vertical")])
    phidot = float(omega @ np.cross(axis, nodes)) / sine**2
    thetadot = float(omega @ nodes) / sine
    return State(**angles, thetadot=thetadot, phidot=phidot, omega3=float(omega @ axis))


def _fit_start(c: Comparison) -> State:
    """The start of the motion that fits the data best; the number of fitted rows is doubled."""
    from scipy.optimize import least_squares

    if (axis := c.derived.get("axis")) is None:
        lacking = f"none follows from {', '.join(x for x in c.values if x != 't')} alone"
        raise Impossible([("start", f"{lacking}: give a scene with a start, or theta and phi")])
    guess = first_row(c.replace_values(omega=_estimate_omega(c, axis), axis=axis))
    some = c.rows(np.s_[:: -(-c.t.size // FITTED)])
    some = some.replace_values(t=some.t - some.t[0])

    def state(p: Array) -> State:
        return State(**dict(zip(FITTED_START, p, strict=True)), psi=guess.psi)

    def axis_error(p: Array, rows: int) -> Array:
        near = replace(some.rows(np.s_[:rows]), given=state(p))
        return np.ravel(near.derived["axis"] - near.exact.axis)

    p, size, misfit = np.array([float(getattr(guess, x)) for x in FITTED_START]), some.t.size, 0.0
    doubled = (FIRST_FITTED * 2**k for k in range(8) if FIRST_FITTED * 2**k < size)
    options: dict[str, Any] = {"x_scale": "jac"} | dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15)
    try:
        for rows in (*doubled, size):
            if misfit < MOST_MISFIT:
                found = least_squares(axis_error, p, args=(rows,), **options)
                p, misfit = found.x, np.sqrt(2 * found.cost / rows)
    except HeavyTopError:
        misfit = np.inf
    if not misfit < MOST_MISFIT:
        rule = "no start fits these data: give a scene with a start, or add rates"
        raise Impossible([("start", rule)])
    return state(p)


def _estimate_omega(c: Comparison, axis: Array) -> Array:
    """The angular velocity of the first rows by differences.

    ω₃ follows from A e × ë + C ω₃ ė = −gMR e × ẑ.
    """
    A, C, gMR = (float(getattr(c.top, name)) for name in MOMENT_NAMES)
    t, axis = c.t[:FIRST_FITTED], axis[:FIRST_FITTED]
    rate = np.gradient(axis, t, axis=0, edge_order=2)
    acceleration = np.gradient(rate, t, axis=0, edge_order=2)
    torque = A * np.cross(axis, acceleration) + gMR * np.cross(axis, [0.0, 0.0, 1.0])
    inner = slice(2, -2)
    omega3 = -(rate * torque)[inner].sum() / (C * (rate * rate)[inner].sum() or 1.0)
    return np.asarray(np.cross(axis, rate) + omega3 * axis)
