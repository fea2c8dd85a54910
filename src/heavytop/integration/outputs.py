"""Angles, rates, attitude, invariants and refined events from the states of a formulation.

Numbers are arrays of doubles or, in more digits, of heyoka's reals: numpy computes with both.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike, NDArray

from heavytop.equations.formulation import Formulation, spin
from heavytop.equations.lambdify import lambdify
from heavytop.errors import NotANumber
from heavytop.exact.decimals import DOUBLE, precision
from heavytop.exact.pairs import Array, add_turns, two_product
from heavytop.scene.quantities import ANGLES, RATES

if TYPE_CHECKING:
    from heavytop.integration.engine import TimedStates

RunConstants = Mapping[str, Any]
POLE_DISTANCE = 1e-9  # from an axis to a pole, larger than any drift of the state,
POLE_BITS = 0.5  # and in more digits 2 to minus this share of their bits: its square is rounding


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """The motion at given times; arrays have time as axis 0, angles are in radians.

    Attributes
    ----------
    t, theta, phi, psi : ndarray, shape (k,)
        Time [s], tilt, precession and spin [rad]; phi and psi are continuous from the start,
        and nan where the plan does not follow them.
    thetadot, phidot, psidot : ndarray, shape (k,)
        Their rates [rad/s].
    axis, omega : ndarray, shape (k, 3)
        The symmetry axis and the angular velocity [rad/s], both in space; nan as phi and psi
        are, but for axis z, the cosine of theta.
    quaternion : ndarray, shape (k, 4)
        The attitude, body to space, scalar first [1]; nan where the plan does not follow it.
    states : ndarray, shape (k, n)
        The states of the formulation, each in its unit [SI].
    """

    t: Array
    theta: Array
    phi: Array
    psi: Array
    thetadot: Array
    phidot: Array
    psidot: Array
    axis: Array
    omega: Array
    states: Array
    attitude: Array | None = field(default=None, repr=False)  # if it is not that of the angles

    COLUMNS: ClassVar = ("t", *ANGLES, *RATES, "axis", "omega", "quaternion", "states")

    @property
    @np.errstate(invalid="ignore")  # nan
    def quaternion(self) -> Array:
        """The attitude, body to space, scalar first; nan where the plan does not follow it."""
        if self.attitude is not None:
            return self.attitude
        plus, minus = (self.phi + self.psi) / 2, (self.phi - self.psi) / 2
        c, s = np.cos(self.theta / 2), np.sin(self.theta / 2)
        parts = c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus)
        return np.stack(parts, axis=-1)

    def at(self, index: Any) -> Sample:
        """Return the motion at some of the times.

        Parameters
        ----------
        index : int, slice or ndarray of bool or int
            Which: one, or several.
        """
        columns = (getattr(self, name) for name in self.__slots__)
        some: list[Any] = [None if x is None else x[index] for x in columns]
        return Sample(*some)

    def mapped(self, function: Callable[[Array], Array]) -> Sample:
        """Return the same motion in other numbers.

        Parameters
        ----------
        function : callable
            From a column to another.
        """
        columns: Any = {name: function(getattr(self, name)) for name in self.COLUMNS}
        return Sample(attitude=columns.pop("quaternion"), **columns)


@cache
def _function(form: Formulation, what: str, bits: int) -> Any:
    """Return a field of a formulation, or an event with its derivative, as a function of numbers.

    `what` names it; `bits` are those of the numbers.
    """
    arguments = form.arguments()
    if what in form.events:
        expressions: Any = (form.events[what], form.flow_derivative(form.events[what]))
    else:
        found = getattr(form, what)
        expressions = tuple(found.values() if isinstance(found, Mapping) else np.atleast_1d(found))
    if what == "outputs":
        arguments = (*arguments, *spin)
    if bits == DOUBLE:
        return lambdify(expressions, arguments)
    from heavytop.integration.system import number_of

    return lambdify(expressions, arguments, number_of(bits))


@cache
def _uses_half_spin(form: Formulation) -> bool:
    """Tell whether outputs contain cosine and sine of half the uniform spin angle, kappa t / 2."""
    return any(sp.sympify(value).has(*spin) for value in form.outputs.values())


def form_values(
    form: Formulation, what: str, rows: Array, parameters: RunConstants, t: Array, *spun: Array
) -> list[Array]:
    """Return the values of a field of a formulation at states: ``outputs``, ``invariants`` ….

    Of an event function there are two: itself and its time derivative; ``spin`` is p_psi/A [1/s].
    """
    bits = precision(next(iter(parameters.values())))
    constants = [parameters[p.name] for p in (*form.parameters, *form.given)]
    with np.errstate(divide="ignore", invalid="ignore"):
        values = _function(form, what, bits)(*rows.T, *constants, t, *spun)
    # numpy takes its time to see that there is nothing to do
    return [x if np.shape(x) == t.shape else np.broadcast_to(x, t.shape) for x in values]


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # nan, and 0/0 at a pole
def sample(
    form: Formulation, rows: Array, parameters: RunConstants, t: Array, near: Any = None
) -> Sample:
    """Return the physical quantities at states of a formulation.

    Where these give phi and psi modulo 2 pi, turns are added that bring them near those of `near`,
    a better known motion in doubles. An angle that stays more than a quarter turn off, or has none
    to compare with, is left as it is.
    """
    spun = _half_spin(parameters, t) if _uses_half_spin(form) else (t, t)
    values = form_values(form, "outputs", rows, parameters, t, *spun)
    unknown = np.full(t.shape, np.nan)
    full = dict.fromkeys(ANGLES, unknown) | dict(zip(form.outputs, values, strict=True))
    full |= _limits_at_poles(form, rows, full, parameters, t)
    if form.phi_wraps:
        full |= _unwrap(form, full, parameters, near)

    def vector(name: str, indices: str = "xyz") -> Array:
        return np.stack([full.get(f"{name}_{i}", unknown) for i in indices], axis=-1)

    scalars = {name: full[name] for name in (*ANGLES, *RATES)}
    attitude = vector("quaternion", "0123") if "quaternion_0" in full else None
    axis, omega = vector("axis"), vector("omega")
    return Sample(t, **scalars, axis=axis, omega=omega, states=rows, attitude=attitude)


def _unwrap(
    form: Formulation, full: Mapping[str, Array], parameters: RunConstants, near: Any
) -> dict[str, Array]:
    """Return phi and psi with the turns of `near`; beside a pole phi from the axis' velocity."""
    phi, beside = _azimuth_beside_poles(full, parameters)
    # phi + side psi does not depend on how phi is computed
    side = form.psi_side or np.where(full["axis_z"] > 0, 1, -1)
    psi = full["psi"] - side * (phi - full["phi"])
    if near is not None:
        turned = _nearest(phi, near.phi, beside)
        # not by the turns of phi, which is rounded: psi may be much smaller
        psi = psi - side * (turned - phi) if form.psi_side else _nearest(psi, near.psi, beside)
        phi = turned
    return {"phi": phi, "psi": psi}


def _azimuth_beside_poles(
    full: Mapping[str, Array], parameters: RunConstants
) -> tuple[Array, NDArray[np.bool_]]:
    """Return phi modulo 2 pi, and where the axis is so near a pole that half turns are in doubt.

    A state that has drifted may pass a pole on the wrong side, its angular momentum about the
    vertical differing from that in the constants. In a pass so close the axis moves on a straight
    line through the pole, and phi follows from its velocity. Where it rests at a pole phi stays.
    """
    x, y, z = (full[f"axis_{i}"] for i in "xyz")
    phi, size, constant = full["phi"], hypot(x, y), next(iter(parameters.values()))
    bits, close = precision(constant), POLE_DISTANCE
    if bits > DOUBLE:
        close = type(constant)(2, bits) ** -int(POLE_BITS * bits)
    beside = size < close
    if not beside.any():
        return phi, beside
    omega: list[Any] = [full[f"omega_{i}"] for i in "xyz"]
    p, q = omega[1] * z - omega[2] * y, omega[2] * x - omega[0] * z  # the velocity of the axis
    momentum: Any = np.where(z > 0, parameters["P_minus"], parameters["P_plus"])  # in units A = 1
    speed, g, l_z = hypot(p, q), abs(parameters["g"]), parameters["l_z"]
    fastest = np.sqrt(p * p + q * q + l_z * l_z + 8 * g)
    off = abs(x * q - y * p - momentum)
    # a smaller difference may come from the curvature of the path
    drifted = (2 * off >= abs(momentum)) & (off > 2 * size * size * fastest) | (size == 0)
    straight = (size * fastest < speed) & (2 * abs(momentum) < close * speed)
    side = np.where(x * p + y * q < 0, -1.0, 1.0)
    phi = np.where(beside & drifted & straight, np.arctan2(side * p, -side * q), phi)
    return np.where((size == 0) & (speed == 0), parameters["phi_0"], phi), beside


def _nearest(angle: Array, near: Array, half: NDArray[np.bool_]) -> Array:
    """Return an angle with whole turns added, or half turns, that bring it within a quarter turn.

    Where there are none it is returned as it is.
    """
    unit = np.where(half, 0.5, 1.0)
    turns = unit * np.rint((near - angle.astype(np.float64)) / (2 * np.pi * unit))
    if angle.dtype == np.float64:
        turned = add_turns(angle, turns)
    else:
        turned = angle + 2 * np.arctan2(abs(0 * angle), 0 * angle - 1) * turns
    return np.where(abs(turned.astype(np.float64) - near) <= np.pi / 2, turned, angle)


def hypot(x: Any, y: Any) -> Any:
    """Return the length of a vector in the plane; heyoka's reals have no function for it."""
    return np.hypot(x, y) if x.dtype == np.float64 else np.sqrt(x * x + y * y)


def _half_spin(parameters: RunConstants, t: Array) -> tuple[Array, Array]:
    """Return cosine and sine of kappa t / 2, right to the last digits for any number of turns."""
    kappa = parameters.get("kappa", 0)
    if t.dtype != np.float64:
        return np.cos(kappa * t / 2), np.sin(kappa * t / 2)
    turned, rest = two_product(np.full(t.shape, kappa / 2), t)
    c, s = np.cos(rest), np.sin(rest)
    return np.cos(turned) * c - np.sin(turned) * s, np.sin(turned) * c + np.cos(turned) * s


def _limits_at_poles(
    form: Formulation, rows: Array, full: Mapping[str, Array], parameters: RunConstants, t: Array
) -> dict[str, Array]:
    """Return the rates, with their limits where the axis is exactly vertical and phi undefined.

    A passing axis leaves with the speed it has, and phidot is its regular term; where the axis
    rests phi stays, and psi takes all the spin.
    """
    pole = np.isnan(full["phidot"]) & ~np.isnan(full["theta"])
    if not (form.limits and pole.any()):
        return {}
    speed, at_top, at_bottom = form_values(form, "limits", rows, parameters, t)
    up = full["axis_z"] > 0
    regular = np.where(up, at_top, at_bottom)
    phidot = np.where(pole, np.where(speed > 0, regular, 0 * regular), full["phidot"])
    thetadot = np.where(pole, np.where(up, speed, -speed), full["thetadot"])
    psidot = np.where(pole, parameters["omega3"] - phidot * full["axis_z"], full["psidot"])
    return {"phidot": phidot, "thetadot": thetadot, "psidot": psidot}


def invariants(
    form: Formulation, rows: Array, parameters: RunConstants, t: Array
) -> dict[str, Array]:
    """Return the invariants of a formulation at its states, by name, in units A = 1.

    ``energy`` is E'/A [1/s^2], ``p_phi`` and ``p_psi`` are p_phi/A and p_psi/A [1/s].
    """
    values = form_values(form, "invariants", rows, parameters, t)
    return dict(zip(form.invariants, values, strict=True))


def newton_step(
    form: Formulation, event: str, seen: TimedStates, parameters: RunConstants, small: Any
) -> tuple[TimedStates, NDArray[np.bool_]]:
    """Return the zeros of an event function beside states in reals, and which of these have one.

    One step of Newton's method takes a state to the zero, along the tangent. The part of the
    function that is left gives the error along the curve, as a part of the step, and the change of
    the rates gives the distance from the curve. Both must be below `small`, relative to 1 or to
    the state, else there is no zero. A state at time 0, the start, is not moved.
    """

    def rates_of(at: TimedStates) -> Array:
        return np.stack(form_values(form, "derivatives", at.states, parameters, at.t), axis=-1)

    zero, slope = form_values(form, event, seen.states, parameters, seen.t)
    rates, here = rates_of(seen), (seen.t == 0) | (zero == 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        change = np.where(here, 0 * zero, -zero / slope)
        step = change[:, None] * rates
        there = seen._replace(t=seen.t + change, states=seen.states + step)
        left = abs(form_values(form, event, there.states, parameters, there.t)[0])
        part = np.where(here, 0 * zero, left / abs(zero))
        size, allowed = abs(step), small * (1 + abs(seen.states))
        bent = abs(change[:, None] * (rates_of(there) - rates)) / 2
        close = (size * part[:, None] <= allowed) & (part < 1)[:, None] & (bent <= allowed)
        found = ((size <= allowed) | close).all(axis=1)
    return there.where(found), found


def times_of(t: ArrayLike) -> Array:
    """Return a time, or a one-dimensional array of them, as doubles [s]; refuse any other."""
    try:
        times = np.asarray(t, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        times = np.array(np.nan)
    if times.ndim > 1 or not np.isfinite(times).all():
        raise NotANumber("t: a finite time or a one-dimensional array of them")
    return times
