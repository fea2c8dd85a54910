"""Where a rival has landed: axis, angles and energy out of its last state."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.integration.outputs import invariants, sample
from heavytop.numbers.double_double import Array
from heavytop.studies.stresses.raw import Raw


def landed(raw: Raw, form: Formulation, rows: Array, parameters: dict[str, float]) -> Raw:
    """Return a run with what its last state says.

    Parameters
    ----------
    raw : Raw
        It has the time reached.
    form : Formulation
    rows : ndarray, shape (2, n)
        States at the start and at the end.
    parameters : dict from str to float
        Of the formulation.
    """
    times = np.array([0.0, raw.t])
    with np.errstate(all="ignore"):
        seen = sample(form, rows, parameters, times, np.full(2, np.nan))
        energy = invariants(form, rows, parameters, times)["energy"]
    weight = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    return replace(
        raw,
        axis=three(seen.axis[1]),
        theta=float(seen.theta[1]),
        angles=followed(float(seen.phi[1]), float(seen.psi[1])),
        energy=abs(float(energy[1] - energy[0])) / max(abs(float(energy[0])), abs(weight)),
        moved=math.dist(seen.axis[1], seen.axis[0]),
    )


def three(axis: Any) -> tuple[float, float, float]:
    """Return an axis as plain numbers."""
    x, y, z = (float(part) for part in axis)
    return x, y, z


def followed(phi: float, psi: float) -> tuple[float, float] | None:
    """Return phi and psi, or None where they are not followed."""
    return (phi, psi) if math.isfinite(phi) and math.isfinite(psi) else None
