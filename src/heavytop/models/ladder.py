"""The ladder of formulations: one table, from which the least that serves is chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from heavytop.models.attitude_form import attitude_form
from heavytop.models.axis_form import axis_form
from heavytop.models.cubic_form import cubic_form
from heavytop.models.formulation import Formulation
from heavytop.models.lagrange_form import lagrange_form
from heavytop.models.routh_form import routh_form
from heavytop.models.subsystem_form import subsystem_form

EVERYTHING = frozenset({"class", "period", "theta", "rates", "axis", "phi", "psi", "attitude"})
TILT = frozenset({"class", "period", "theta", "rates"})


@dataclass(frozen=True, slots=True)
class Rung:
    """A formulation's place on the ladder.

    Attributes
    ----------
    build : callable
        From a variant to the formulation.
    variants : tuple of (str or None)
        What `build` accepts: how phi and psi are had, or which pole heights are measured from.
    gives : frozenset of str
        The quantities it can give.
    starts_at_pole : bool
        Whether a start with theta = 0 or pi is an ordinary one.
    """

    build: Callable[[str | None], Formulation]
    variants: tuple[str | None, ...]
    gives: frozenset[str]
    starts_at_pole: bool


LADDER: Mapping[str, Rung] = {
    "cubic": Rung(
        lambda variant: cubic_form(variant or "top"), ("top", "bottom"), TILT, starts_at_pole=True
    ),
    "routh": Rung(routh_form, (None, "angles"), EVERYTHING, starts_at_pole=False),
    "subsystem": Rung(subsystem_form, (None, "angles"), EVERYTHING, starts_at_pole=False),
    "axis": Rung(axis_form, (None, "sigma", "delta"), EVERYTHING, starts_at_pole=True),
    "attitude": Rung(attitude_form, (None, "angles"), EVERYTHING, starts_at_pole=True),
    "lagrange": Rung(lambda _: lagrange_form(), (None,), EVERYTHING, starts_at_pole=False),
}
