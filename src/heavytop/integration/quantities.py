"""Physical quantities along a motion, from the states of a formulation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation, spin, turned_phi
from heavytop.equations.lambdify import lambdified
from heavytop.numbers.double_double import two_product

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
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
        The attitude, body to space, scalar first; nan where the plan does not follow it.
    states : ndarray, shape (k, n)
        The states of the formulation.
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
    quaternion: Array
    states: Array

    def at(self, index: Any) -> Sample:
        """Return some of them.

        Parameters
        ----------
        index : int, slice or ndarray of bool
            One by its number, or several.
        """
        return Sample(*(getattr(self, name)[index] for name in self.__slots__))


@cache
def _outputs(formulation: Formulation) -> tuple[tuple[str, ...], Any]:
    names = tuple(formulation.outputs)
    arguments = (*formulation.arguments(), turned_phi, *spin)
    return names, lambdified([formulation.outputs[n] for n in names], arguments)


@cache
def _invariants(formulation: Formulation) -> tuple[tuple[str, ...], Any]:
    names = tuple(formulation.invariants)
    return names, lambdified([formulation.invariants[n] for n in names], formulation.arguments())


@cache
def _event_functions(formulation: Formulation, event: str) -> Any:
    zero = formulation.events[event]
    return lambdified([zero, formulation.flow_derivative(zero)], formulation.arguments())


def _values(
    formulation: Formulation, rows: Array, parameters: dict[str, float], t: Array
) -> list[Any]:
    named = (*formulation.parameters, *formulation.given)
    return [*rows.T, *(parameters[p.name] for p in named), t]


def sample(
    formulation: Formulation, rows: Array, parameters: dict[str, float], t: Array, phi: Array
) -> Sample:
    """Return the physical quantities at states of a formulation."""
    names, function = _outputs(formulation)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = function(*_values(formulation, rows, parameters, t), phi, *_spun(parameters, t))
    full = {n: np.broadcast_to(v, t.shape) for n, v in zip(names, values, strict=True)}
    full |= _limits_at_poles(full, parameters)
    unknown = np.full(t.shape, np.nan)
    axis, omega = (
        np.stack([full.get(f"{what}_{x}", unknown) for x in "xyz"], axis=-1)
        for what in ("axis", "omega")
    )
    found = Sample(
        t=t,
        theta=full["theta"],
        phi=full.get("phi", phi),
        psi=full.get("psi", unknown),
        thetadot=full["thetadot"],
        phidot=full["phidot"],
        psidot=full["psidot"],
        axis=axis,
        omega=omega,
        quaternion=_attitude(full, phi),
        states=rows,
    )
    return found


def _spun(parameters: dict[str, float], t: Array) -> tuple[Array, Array]:
    """Return cosine and sine of kappa t / 2: its last digits count, however many turns it is."""
    half, rest = two_product(np.full(t.shape, parameters.get("kappa", 0.0) / 2), t)
    c, s = np.cos(rest), np.sin(rest)
    return np.cos(half) * c - np.sin(half) * s, np.sin(half) * c + np.cos(half) * s


def _attitude(full: dict[str, Array], phi: Array) -> Array:
    """Return the quaternion, from the angles where the formulation has none of its own."""
    if "quaternion_0" in full:
        return np.stack([full[f"quaternion_{i}"] for i in range(4)], axis=-1)
    psi = full.get("psi", np.full(phi.shape, np.nan))
    half, phi = full["theta"] / 2, full.get("phi", phi)
    plus, minus = (phi + psi) / 2, (phi - psi) / 2
    c, s = np.cos(half), np.sin(half)
    parts = (c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus))
    return np.stack(parts, axis=-1)


def _limits_at_poles(full: dict[str, Array], parameters: dict[str, float]) -> dict[str, Array]:
    """Return the rates where the axis is exactly vertical, and phi undefined.

    A passing axis leaves with the speed it has, phi turning as its regular term says; where the
    axis rests, phi stays and psi takes all the spin.
    """
    pole = np.isnan(full["phidot"])
    if not pole.any() or not {"kappa", "k_0"} & set(parameters):
        return {}
    up = full["axis_z"] > 0
    if "k_0" in parameters:  # the cubic form
        tilting = np.sqrt(np.maximum(parameters["k_0"], 0.0))
        regular = np.where(up, parameters["n"], -parameters["n"]) / 2
    else:
        kappa = parameters["kappa"]
        tilting = np.hypot(*(full[f"omega_{x}"] - kappa * full[f"axis_{x}"] for x in "xy"))
        regular = np.where(up, parameters["P_plus"], parameters["P_minus"]) / 4
    phidot = np.where(pole, np.where(tilting > 0, regular, 0.0), full["phidot"])
    thetadot = np.where(pole, np.where(up, tilting, -tilting), full["thetadot"])
    psidot = np.where(pole, parameters["omega3"] - phidot * full["axis_z"], full["psidot"])
    return {"phidot": phidot, "thetadot": thetadot, "psidot": psidot}


def invariants(
    formulation: Formulation, rows: Array, parameters: dict[str, float], t: Array
) -> dict[str, Array]:
    """Return the invariants of a formulation at its states, by name, in units A = 1.

    ``energy`` is E'/A [1/s^2], ``p_phi`` and ``p_psi`` are p_phi/A and p_psi/A [1/s].
    """
    names, function = _invariants(formulation)
    values = function(*_values(formulation, rows, parameters, t))
    return {n: np.broadcast_to(v, t.shape) for n, v in zip(names, values, strict=True)}


def spin_momentum(
    formulation: Formulation, rows: Array, parameters: dict[str, float], t: Array
) -> Array:
    """Return p_psi/A at states of a formulation [1/s]."""
    (value,) = _spin(formulation)(*_values(formulation, rows, parameters, t))
    return np.broadcast_to(value, t.shape)


@cache
def _spin(formulation: Formulation) -> Any:
    return lambdified([formulation.spin], formulation.arguments())


def event_function(
    formulation: Formulation, event: str, rows: Array, parameters: dict[str, float], t: Array
) -> tuple[Array, Array]:
    """Return an event function and its time derivative at states of a formulation."""
    function = _event_functions(formulation, event)
    zero, slope = function(*_values(formulation, rows, parameters, t))
    return np.broadcast_to(zero, t.shape), np.broadcast_to(slope, t.shape)
