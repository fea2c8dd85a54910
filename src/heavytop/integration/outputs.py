"""What is told of a motion, from the states of a formulation: angles, rates, attitude, invariants.

Numbers are arrays of doubles or, in more digits, of heyoka's reals: numpy computes with both.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation, spin
from heavytop.equations.lambdify import lambdified
from heavytop.exact.pairs import two_product
from heavytop.integration.bits import DOUBLE
from heavytop.scene.quantities import ANGLES, RATES

Array = NDArray[np.float64]
Parameters = Mapping[str, Any]
VECTORS = {"axis": "xyz", "omega": "xyz", "quaternion": "0123"}


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
def _function(form: Formulation, what: str, bits: int) -> Any:
    """Return a function of numbers of so many bits: of outputs, an event function and so on."""
    arguments = form.arguments()
    if what in form.events:
        expressions: Any = (form.events[what], form.flow_derivative(form.events[what]))
    elif what == "spin":
        expressions = (form.spin,)
    elif what == "limits":
        expressions = form.limits
    else:
        expressions = tuple(getattr(form, what).values())
    if what == "outputs":
        arguments = (*arguments, *spin)
    if bits == DOUBLE:
        return lambdified(expressions, arguments)
    from heavytop.integration.library import hy

    return lambdified(expressions, arguments, lambda integer: hy.real(integer, bits))


def _values(
    form: Formulation, what: str, rows: Array, parameters: Parameters, t: Array, *spun: Array
) -> list[Array]:
    bits = getattr(next(iter(parameters.values())), "prec", DOUBLE)
    known = (parameters[p.name] for p in (*form.parameters, *form.given))
    with np.errstate(divide="ignore", invalid="ignore"):
        values = _function(form, what, bits)(*rows.T, *known, t, *spun)
    # numpy takes its time to see that there is nothing to do
    return [x if np.shape(x) == t.shape else np.broadcast_to(x, t.shape) for x in values]


@np.errstate(divide="ignore", invalid="ignore")  # nan, and 0/0 at a pole
def sample(form: Formulation, rows: Array, parameters: Parameters, t: Array) -> Sample:
    """Return the physical quantities at states of a formulation."""
    values = _values(form, "outputs", rows, parameters, t, *_spun(parameters, t))
    unknown = np.full(t.shape, np.nan)
    full = dict.fromkeys(ANGLES, unknown) | dict(zip(form.outputs, values, strict=True))
    full |= _limits_at_poles(form, rows, full, parameters, t)
    full |= _attitude(full)
    scalars = {name: full[name] for name in (*ANGLES, *RATES)}
    vectors = {
        name: np.stack([full.get(f"{name}_{i}", unknown) for i in indices], axis=-1)
        for name, indices in VECTORS.items()
    }
    return Sample(t, **scalars, **vectors, states=rows)


def hypot(x: Any, y: Any) -> Any:
    """Return the length of a vector in the plane; heyoka's reals have no function for it."""
    return np.hypot(x, y) if x.dtype == np.float64 else np.sqrt(x * x + y * y)


def _spun(parameters: Parameters, t: Array) -> tuple[Array, Array]:
    """Return cosine and sine of kappa t / 2: its last digits count, however many turns it is."""
    kappa = parameters.get("kappa", 0)
    if t.dtype != np.float64:
        return np.cos(kappa * t / 2), np.sin(kappa * t / 2)
    turned, rest = two_product(np.full(t.shape, kappa / 2), t)
    c, s = np.cos(rest), np.sin(rest)
    return np.cos(turned) * c - np.sin(turned) * s, np.sin(turned) * c + np.cos(turned) * s


def _attitude(full: Mapping[str, Array]) -> dict[str, Array]:
    """Return the quaternion of the angles where the formulation has none of its own."""
    if "quaternion_0" in full:
        return {}
    half, phi, psi = full["theta"] / 2, full["phi"], full["psi"]
    plus, minus = (phi + psi) / 2, (phi - psi) / 2
    c, s = np.cos(half), np.sin(half)
    parts = (c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus))
    return {f"quaternion_{i}": part for i, part in enumerate(parts)}


def _limits_at_poles(
    form: Formulation, rows: Array, full: Mapping[str, Array], parameters: Parameters, t: Array
) -> dict[str, Array]:
    """Return the rates where the axis is exactly vertical, and phi undefined.

    A passing axis leaves with the speed it has, phi turning as its regular term says; where the
    axis rests, phi stays and psi takes all the spin.
    """
    pole = np.isnan(full["phidot"])
    if not (form.limits and pole.any()):
        return {}
    tilting, at_top, at_bottom = _values(form, "limits", rows, parameters, t)
    up = full["axis_z"] > 0
    regular = np.where(up, at_top, at_bottom)
    phidot = np.where(pole, np.where(tilting > 0, regular, 0 * regular), full["phidot"])
    thetadot = np.where(pole, np.where(up, tilting, -tilting), full["thetadot"])
    psidot = np.where(pole, parameters["omega3"] - phidot * full["axis_z"], full["psidot"])
    return {"phidot": phidot, "thetadot": thetadot, "psidot": psidot}


def invariants(
    form: Formulation, rows: Array, parameters: Parameters, t: Array
) -> dict[str, Array]:
    """Return the invariants of a formulation at its states, by name, in units A = 1.

    ``energy`` is E'/A [1/s^2], ``p_phi`` and ``p_psi`` are p_phi/A and p_psi/A [1/s].
    """
    values = _values(form, "invariants", rows, parameters, t)
    return dict(zip(form.invariants, values, strict=True))


def spin_momentum(form: Formulation, rows: Array, parameters: Parameters, t: Array) -> Array:
    """Return p_psi/A at states of a formulation [1/s]."""
    return _values(form, "spin", rows, parameters, t)[0]


def event_function(
    form: Formulation, event: str, rows: Array, parameters: Parameters, t: Array
) -> tuple[Array, Array]:
    """Return an event function and its time derivative at states of a formulation."""
    zero, slope = _values(form, event, rows, parameters, t)
    return zero, slope
