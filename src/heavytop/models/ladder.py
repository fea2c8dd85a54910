"""The ladder of formulations: one table, from which the least that serves is chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from heavytop.models.axis_form import axis_form
from heavytop.models.formulation import Formulation
from heavytop.models.lagrange_form import lagrange_form


@dataclass(frozen=True, slots=True)
class Rung:
    """A formulation's place on the ladder: how to build it and what it can give."""

    build: Callable[..., Formulation]
    gives: frozenset[str]
    psi_by_quadrature: bool
    starts_at_pole: bool


EVERYTHING = frozenset({"theta", "axis", "phi", "psi", "rates", "attitude"})

LADDER: Mapping[str, Rung] = {
    "axis": Rung(axis_form, EVERYTHING, psi_by_quadrature=True, starts_at_pole=True),
    "lagrange": Rung(lagrange_form, EVERYTHING, psi_by_quadrature=False, starts_at_pole=False),
}
