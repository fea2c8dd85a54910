"""The ladder of formulations: one table, from which the least that serves is chosen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from heavytop.equations.formulation import Formulation

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


def _cubic(variant: str | None) -> Formulation:
    from heavytop.equations.cubic_form import cubic_form

    return cubic_form(variant or "top")


def _routh(variant: str | None) -> Formulation:
    from heavytop.equations.routh_form import routh_form

    return routh_form(variant)


def _subsystem(variant: str | None) -> Formulation:
    from heavytop.equations.subsystem_form import subsystem_form

    return subsystem_form(variant)


def _axis(variant: str | None) -> Formulation:
    from heavytop.equations.axis_form import axis_form

    return axis_form(variant)


def _attitude(variant: str | None) -> Formulation:
    from heavytop.equations.attitude_form import attitude_form

    return attitude_form(variant)


def _lagrange(_: str | None) -> Formulation:
    from heavytop.equations.lagrange_form import lagrange_form

    return lagrange_form()


LADDER: Mapping[str, Rung] = {
    "cubic": Rung(_cubic, ("top", "bottom"), TILT, starts_at_pole=True),
    "routh": Rung(_routh, (None, "angles"), EVERYTHING, starts_at_pole=False),
    "subsystem": Rung(_subsystem, (None, "angles"), EVERYTHING, starts_at_pole=False),
    "axis": Rung(_axis, (None, "sigma", "delta"), EVERYTHING, starts_at_pole=True),
    "attitude": Rung(_attitude, (None, "angles"), EVERYTHING, starts_at_pole=True),
    "lagrange": Rung(_lagrange, (None,), EVERYTHING, starts_at_pole=False),
}
