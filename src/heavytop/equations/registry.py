"""The table of formulations: it is read without sympy, and without deriving any of them.

A new formulation is an entry here and a module beside this one, whose function builds it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from heavytop.scene.quantities import Need

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation


@dataclass(frozen=True, slots=True)
class FormulationEntry:
    """A formulation's line in the table, which can be read without deriving any of them.

    Attributes
    ----------
    builder : str
        The function that derives it from a variant, as ``module.name``.
    variants : tuple of (str or None)
        What the builder accepts: how phi and psi are had, or which pole heights are measured from.
    gives : Need
        How much of a motion it can follow.
    starts_at_pole : bool
        Whether a start with theta = 0 or pi is an ordinary one.
    """

    builder: str
    variants: tuple[str | None, ...]
    gives: Need = Need.PSI
    starts_at_pole: bool = True

    def build(self, variant: str | None = None) -> Formulation:
        """Return the formulation, derived once."""
        module, name = self.builder.split(".")
        found: Formulation = getattr(import_module(f"heavytop.equations.{module}"), name)(variant)
        return found


_ANGLES = (None, "angles")

FORMULATIONS: Mapping[str, FormulationEntry] = {
    "cubic": FormulationEntry("reduced_cubic.cubic_form", ("top", "bottom"), Need.TILT),
    "routh": FormulationEntry("euler_angles.routh_form", _ANGLES, starts_at_pole=False),
    "subsystem": FormulationEntry("euler_angles.subsystem_form", _ANGLES, starts_at_pole=False),
    "axis": FormulationEntry("euler_poisson.axis_form", (None, "phi", "sigma", "delta")),
    "attitude": FormulationEntry("quaternion.attitude_form", _ANGLES),
    "lagrange": FormulationEntry("euler_angles.lagrange_form", (None,), starts_at_pole=False),
}
