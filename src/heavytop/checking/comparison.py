"""A trajectory beside the exact motion: what is compared, and where the motion starts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Any, Final, Literal

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.checking.reading import POSITIONS, Array, Data
from heavytop.errors import HeavyTopError, Impossible
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.state import State
from heavytop.scene.top import Top

FIRST_FITTED: Final = 12  # rows that a fit begins with
FITTED: Final = 1000  # rows that it ends with
FITS: Final = 1e-3  # rad: a fit that is farther off, RMS, is none
CLOSELY: Final = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15)
FOLD_ALLOWED: Final = 1e-9  # rad beyond [0, π] that nobody minds
FLOOR: Final = 1e-9  # of errors: what is smaller fits as well
STILL_ANGLE: Final = 1e-3  # rad: motions that are smaller say little
FIRST: Final = 0.02  # rad by which the first row may be off: no integrator has made an error yet
MOVES: Final = 0.05  # rad that a motion moves at least, to say anything
OCTAVE_ROWS: Final = 8  # that are looked at of each octave
LEAST_RATE: Final = 1e-3  # of |ω|: the scale of a rate that is smaller all the time
FITTED_START: Final = ("theta", "phi", "thetadot", "phidot", "omega3")  # what is fitted
EXACT_VECTORS: Final = {"axis": 1.0, "vertical": 1.0} | dict.fromkeys(
    ("omega", "omega_body", "momentum_body")
)
"""The vectors that are compared, with what their errors are relative to: the largest if None."""

Origin = Literal["scene", "first row", "fitted"]


class ExactMotion:
    """The exact motion at some times, with what data are compared with."""

    def __init__(self, motion: Motion, t: Array) -> None:
        self.record: Any = motion.at(t)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.record, name)

    @cached_property
    def sine(self) -> Array:
        """Of the tilt."""
        return np.asarray(np.sin(self.theta))

    @cached_property
    def rotation(self) -> Array:
        """The attitude as matrices."""
        return matrices(self.quaternion)

    @property
    def vertical(self) -> Array:
        """The upward vertical in the body."""
        return self.rotation[:, 2]

    @cached_property
    def omega_body(self) -> Array:
        """The angular velocity in the body."""
        found: Array = np.einsum("nji,nj->ni", self.rotation, self.omega)
        return found

    @cached_property
    def fastest(self) -> float:
        """The largest angular velocity."""
        return float(norm(self.omega).max()) or 1.0

    def angle(self, name: str) -> Array:
        """An Euler angle, φ and ψ modulo 2π."""
        found: Array = getattr(self, name if name == "theta" else f"{name}_mod")
        return found

    @cached_property
    def moved(self) -> tuple[Array, Array]:
        """How far the axis, and the attitude, are from those of the first time."""
        turned = norm(self.rotation - self.rotation[0]) / np.sqrt(2)
        return norm(self.axis - self.axis[0]), turned


_motion = lru_cache(maxsize=64)(Motion)


@lru_cache(maxsize=64)
def _exact(top: Top, start: State, times: bytes) -> ExactMotion:
    return ExactMotion(_motion(top, start), np.frombuffer(times))


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
        return "fitted" if self.spin is None or self.axis is None else "first row"

    @cached_property
    def start(self) -> State:
        """The start: the given one, that of the first row, or the one that fits best."""
        if self.given is not None:
            return self.given
        return first_row(self) if self.origin == "first row" else _fitted(self)

    @property
    def motion(self) -> Motion:
        """The exact motion."""
        return _motion(self.top, self.start)

    @cached_property
    def since(self) -> Array:
        """Times since the start [s]."""
        return self.data.t - (0.0 if self.given is not None else self.data.t[0])

    @cached_property
    def exact(self) -> ExactMotion:
        """The exact motion at the times of the data."""
        if self.data.t.size > FITTED:
            return ExactMotion(self.motion, self.since)
        return _exact(self.top, self.start, self.since.tobytes())

    def updated(self, **values: Array | None) -> Comparison:
        """The same of data with other values; None takes one away."""
        other = replace(self, data=self.data.updated(**values))
        if self.given is not None:  # the same motion at the same times
            other.__dict__["exact"] = self.exact
        return other

    def rows(self, which: Any) -> Comparison:
        """The same of some rows."""
        return replace(self, data=self.data.rows(which))

    @cached_property
    def folded(self) -> Comparison:
        """The same with θ in [0, π]: beyond, φ and ψ turn by π and θ̇ changes its sign."""
        theta, values = self.data.values.get("theta"), self.data.values
        if theta is None or ((theta > -FOLD_ALLOWED) & (theta < np.pi + FOLD_ALLOWED)).all():
            return self
        reduced = np.mod(theta, 2 * np.pi)
        out = reduced > np.pi
        turned = {name: values[name] + np.pi * out for name in ("phi", "psi") if name in values}
        if "thetadot" in values:
            turned["thetadot"] = values["thetadot"] * (1 - 2 * out)
        return self.updated(theta=np.where(out, 2 * np.pi - reduced, reduced), **turned)

    # --- what the data give, or what follows from it; None where nothing does ----------------

    @cached_property
    def matrix(self) -> Any:
        """The attitude as matrices (n, 3, 3) from body to space."""
        q = self.data.values.get("quaternion")
        return self.data.values.get("matrix") if q is None else matrices(q)

    @cached_property
    def axis(self) -> Any:
        """The symmetry axis (n, 3) in space."""
        if self.matrix is not None:
            return self.matrix[:, :, 2]
        if "axis" in self.data.values:
            return self.data.values["axis"]
        theta, phi = self.angle("theta"), self.data.values.get("phi")
        return None if theta is None or phi is None else axes(theta, phi)

    def angle(self, name: str) -> Any:
        """An Euler angle [rad]; continuous only where it is given."""
        values = self.data.values
        if name in values:
            return values[name]
        if name == "theta" and "elevation" in values:
            return np.pi / 2 - values["elevation"]
        axis, vertical = values.get("axis"), values.get("vertical")
        if self.matrix is not None:
            axis, vertical = self.matrix[:, :, 2], self.matrix[:, 2]
        if name == "psi":
            return None if vertical is None else np.arctan2(vertical[:, 0], vertical[:, 1])
        if name == "phi":
            return None if axis is None else np.arctan2(axis[:, 0], -axis[:, 1])
        e = vertical if axis is None else axis
        return None if e is None else np.arctan2(np.hypot(e[:, 0], e[:, 1]), e[:, 2])

    def rate(self, name: str) -> Any:
        """The rate of an Euler angle [rad/s]."""
        if name == "thetadot" and "elevationdot" in self.data.values:
            return -self.data.values["elevationdot"]
        return self.data.values.get(name)

    @property
    def omega_body(self) -> Any:
        """The angular velocity (n, 3) in the body [rad/s], given or by the angular momentum."""
        values = self.data.values
        if "momentum_body" in values and "omega_body" not in values and self.top.C != 0:
            return values["momentum_body"] / moments(self.top)
        return values.get("omega_body")

    @cached_property
    def attitude(self) -> Any:
        """The attitude as matrices, also from angles."""
        angles = [self.angle(name) for name in ANGLES]
        if self.matrix is not None or any(x is None for x in angles):
            return self.matrix
        return rotations(*angles)

    @cached_property
    def spin(self) -> tuple[Array, Array, Array, Array] | None:
        """Return cosθ, |ė|², ω₃ and ω_z: what energy and momenta are made of."""
        theta, rates = self.angle("theta"), [self.rate(name) for name in RATES]
        if theta is not None and not any(x is None for x in rates):
            thetadot, phidot, psidot = rates
            across, omega3 = phidot * np.sin(theta), psidot + phidot * np.cos(theta)
            upright = across * np.sin(theta) + omega3 * np.cos(theta)
            return np.cos(theta), thetadot**2 + across**2, omega3, upright
        if "omega" in self.data.values and self.axis is not None:
            omega, e = self.data.values["omega"], self.axis
            omega3, across = (omega * e).sum(axis=1), np.cross(omega, e)
            return e[:, 2], (across**2).sum(axis=1), omega3, omega[:, 2]
        w, g = self.omega_body, self.data.values.get("vertical")
        if w is not None and g is None and self.attitude is not None:
            g = self.attitude[:, 2]
        if w is None or g is None:
            return None
        return g[:, 2], w[:, 0] ** 2 + w[:, 1] ** 2, w[:, 2], (w * g).sum(axis=1)

    # --- how far off they are ----------------------------------------------------------------

    @cached_property
    def errors(self) -> dict[str, Array]:
        """How far off the data are at each time, by what they give [rad, or of the largest]."""
        folded, exact, values = self.folded, self.exact, self.data.values
        found = dict[str, Array]()
        if self.matrix is not None:
            found["attitude"] = norm(self.matrix - exact.rotation) / np.sqrt(2)
        for name in ANGLES:
            if name in values or (name == "theta" and "elevation" in values):
                weight = 1.0 if name == "theta" else exact.sine
                found[name] = weight * abs(wrapped(folded.angle(name) - exact.angle(name)))
        for name in RATES:
            if (mine := folded.rate(name)) is not None:
                other = getattr(exact, name)
                scale = max(float(abs(other).max()), LEAST_RATE * exact.fastest)
                found[name] = abs(mine - other) / scale
        for name in [name for name in EXACT_VECTORS if name in values]:
            other = getattr(exact, name.replace("momentum", "omega"))
            other = other * moments(self.top) if name == "momentum_body" else other
            scale = EXACT_VECTORS[name] or float(norm(other).max()) or 1.0
            found[name] = norm(values[name] - other) / scale
        return found

    @property
    def first(self) -> float:
        """How far off the first row is, where it is the start itself [rad]."""
        there = [x[0] for name, x in self.errors.items() if name in POSITIONS or name == "attitude"]
        return float(max(there, default=0.0)) if self.since[0] == 0 else 0.0


def octaves(size: int, most: int = OCTAVE_ROWS) -> tuple[Any, Any]:
    """At most so many rows of every octave, and where each octave begins among them.

    Octaves are the first row, the second, two more, four more, …: early rows weigh most.
    """
    edges = [0, *(2**k for k in range(int(np.log2(size)) + 1)), size]
    each = [
        np.unique(np.linspace(a, b - 1, min(b - a, most)).astype(int))
        for a, b in pairwise(edges)
        if b > a
    ]
    return np.concatenate(each), np.cumsum([0, *map(len, each[:-1])])


def decades(c: Comparison, begins: Any) -> dict[str, float]:
    """How far off each quantity is, of how far the motion has moved: its decades, mean of octaves.

    Each octave begins at one of the rows `begins`. An error that an integrator makes grows from
    nothing with the motion, one of a convention is there from the first row on, or as large as the
    motion.
    """
    errors = np.array([*c.errors.values()]) + FLOOR
    axis, attitude = c.exact.moved
    moved = np.array([axis if name in ("axis", "theta", "phi") else attitude for name in c.errors])
    squares = (errors / (errors + moved + STILL_ANGLE)) ** 2
    if moved.max() < MOVES:  # as if time were frozen: everything fits that
        squares[:] = 1.0
    sums, counts = np.add.reduceat(squares, begins, axis=1), np.diff([*begins, errors.shape[1]])
    means = np.log10(sums / counts).mean(axis=1)
    names = (name.removesuffix("_body") for name in c.errors)
    return dict(zip(names, (means / 2).tolist(), strict=True))


# --- geometry ------------------------------------------------------------------------------------


def wrapped(angle: Array) -> Array:
    """An angle in [−π, π]."""
    return angle - 2 * np.pi * np.rint(angle / (2 * np.pi))


def norm(vectors: Array) -> Array:
    """The length of each row, of a vector or of a matrix."""
    flat = vectors.reshape(len(vectors), -1)
    found: Array = np.sqrt(np.einsum("ni,ni->n", flat, flat))
    return found


def moments(top: Top) -> Array:
    """The principal moments about the pivot."""
    return np.array([float(top.A), float(top.A), float(top.C)])


def axes(theta: Array, phi: Array) -> Array:
    """The symmetry axis of a tilt and an azimuth."""
    sine = np.sin(theta)
    return np.stack([sine * np.sin(phi), -sine * np.cos(phi), np.cos(theta)], axis=-1)


def matrices(quaternion: Array) -> Array:
    """The rotation of quaternions, scalar first, of any length."""
    w, x, y, z = (quaternion / norm(quaternion)[:, None]).T
    entries = (
        *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack(entries, axis=-1).reshape(-1, 3, 3)


def rotations(theta: Array, phi: Array, psi: Array) -> Array:
    """Rz(φ) Rx(θ) Rz(ψ)."""
    plus, minus, c, s = (phi + psi) / 2, (phi - psi) / 2, np.cos(theta / 2), np.sin(theta / 2)
    parts = c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus)
    return matrices(np.stack(parts, axis=-1))


# --- the start -----------------------------------------------------------------------------------


def first_row(c: Comparison) -> State:
    """The start that the first row gives."""
    first = replace(c, data=c.data.rows(slice(0, 1)))
    angles = {name: first.angle(name) for name in ANGLES}
    state = {name: float(angle[0]) for name, angle in angles.items() if angle is not None}
    if all(c.rate(name) is not None for name in RATES):
        return State(**state, **{name: float(c.rate(name)[0]) for name in RATES})
    omega = first.data.values.get("omega")
    if omega is None:
        omega = np.einsum("nij,nj->ni", first.attitude, first.omega_body)
    axis, omega = first.axis[0], omega[0]
    if not (sine := np.hypot(*axis[:2])):
        raise Impossible([("start", "a first row whose axis is not vertical")])
    speed = np.cross(omega, axis)
    phidot = float(axis[0] * speed[1] - axis[1] * speed[0]) / sine**2
    thetadot = -float(speed[2]) / sine
    return State(**state, thetadot=thetadot, phidot=phidot, omega3=float(omega @ axis))


def _fitted(c: Comparison) -> State:
    """The start of the motion that comes nearest to the data, from more and more of them."""
    from scipy.optimize import least_squares

    if c.axis is None:
        lacking = f"none follows from {', '.join(c.data.values)} alone"
        raise Impossible([("start", f"{lacking}: give a scene with a start, or theta and phi")])
    guess = first_row(c.updated(omega=_omega(c), axis=c.axis))
    some = c.data.rows(np.s_[:: -(-c.data.t.size // FITTED)])
    some = replace(some, t=some.t - some.t[0])

    def state(p: Array) -> State:
        return State(**dict(zip(FITTED_START, p, strict=True)), psi=guess.psi)

    def axis_error(p: Array, rows: int) -> Array:
        near = Comparison(some.rows(slice(0, rows)), c.top, state(p))
        off: Array = near.axis - near.exact.axis
        return off.ravel()

    p, rows = np.array([float(getattr(guess, name)) for name in FITTED_START]), FIRST_FITTED
    try:
        while True:
            found = least_squares(axis_error, p, x_scale="jac", args=(rows,), **CLOSELY)
            p, misfit = found.x, np.sqrt(2 * found.cost / min(rows, some.t.size))
            if rows >= some.t.size or misfit > FITS:
                break
            rows *= 2
    except HeavyTopError:
        misfit = np.inf
    if not misfit < FITS:
        rule = "no start fits these data: give a scene with a start, or add rates"
        raise Impossible([("start", rule)])
    return state(p)


def _omega(c: Comparison) -> Array:
    """The angular velocity by differences of the first rows.

    A e × ë + C ω₃ ė = −gMR e × ẑ gives ω₃.
    """
    A, C, gMR = (float(getattr(c.top, name)) for name in ("A", "C", "gMR"))
    t, axis = c.data.t[:FIRST_FITTED], c.axis[:FIRST_FITTED]
    speed = np.gradient(axis, t, axis=0, edge_order=2)
    faster = np.gradient(speed, t, axis=0, edge_order=2)
    torque = A * np.cross(axis, faster) + gMR * np.cross(axis, [0.0, 0.0, 1.0])
    inner = slice(2, -2)
    omega3 = -(speed * torque)[inner].sum() / (C * (speed * speed)[inner].sum() or 1.0)
    omega: Array = np.cross(axis, speed) + omega3 * axis
    return omega
