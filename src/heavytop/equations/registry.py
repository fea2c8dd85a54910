"""The table of formulations, which is read without sympy, and without deriving any of them.

A new formulation is an entry here and a function that builds it, in a module beside this one. A
formulation that cannot start at a pole has no `limits`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from importlib import import_module
from typing import TYPE_CHECKING

from heavytop.scene.quantities import Need

if TYPE_CHECKING:
    from heavytop.equations.formulation import Formulation


@dataclass(frozen=True, slots=True)
class FormulationEntry:
    """A row of the table of formulations.

    Attributes
    ----------
    builder : str
        The function that derives it from a variant, as ``module.name``.
    variants : tuple of (str or None)
        The arguments of the builder: None; ``angles``, both angles by quadratures with the two
        `rates`, or read off the states; ``phi``, and with psi by one quadrature ``sigma`` or
        ``delta``; ``top`` and ``bottom``, the pole that heights are measured from.
    gives : Need
        How much of a motion it can follow.
    states : int
        The number of its states without phi and psi.
    us : float
        The time of a nutation period without events or samples [µs].
    rates : tuple of str
        The symbols of the rates of uniform rotations that are subtracted from its angles.
    grows : bool
        Whether phi and psi, which grow, are states.
    point_mass : bool
        Whether C may be 0.
    starts_at_pole : bool
        Whether a start with theta = 0 or pi is an ordinary one.
    """

    builder: str
    variants: tuple[str | None, ...]
    gives: Need = Need.PSI
    states: int = 0
    us: float = 10.0
    rates: tuple[str, ...] = ()
    grows: bool = False
    point_mass: bool = False
    starts_at_pole: bool = True

    @cache  # noqa: B019 (entries stay as long as the module)
    def build(self, variant: str | None = None) -> Formulation:
        """Return the formulation, derived once."""
        module, name = self.builder.split(".")
        found: Formulation = getattr(import_module(f"heavytop.equations.{module}"), name)(variant)
        return found


_POLES, _ANGLES, _SIDES = ("top", "bottom"), (None, "angles"), (None, "phi", "sigma", "delta")
_RATES = ("phi_rate", "psi_rate")
_polar = partial(FormulationEntry, starts_at_pole=False)

# us is from ``validation/03_benchmarks.py``
FORMULATIONS: Mapping[str, FormulationEntry] = {
    "cubic": FormulationEntry(
        "reduced_cubic.cubic_form", _POLES, gives=Need.TILT, states=2, us=2.5, point_mass=True
    ),
    "routh": _polar("euler_angles.routh_form", _ANGLES, states=2, us=21.0, rates=_RATES),
    "subsystem": _polar("euler_angles.subsystem_form", _ANGLES, states=4, us=36.0, rates=_RATES),
    "axis": FormulationEntry(
        "euler_poisson.axis_form", _SIDES, states=5, us=3.8, rates=("frame_rate",), point_mass=True
    ),
    "attitude": FormulationEntry("euler_poisson.attitude_form", _ANGLES, states=6, us=10.0),
    "lagrange": _polar("euler_angles.lagrange_form", (None,), states=6, us=30.0, grows=True),
}
