"""The methods that are put under stress: every form of the equations, auto, and what others use."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from types import MappingProxyType
from typing import Final

from heavytop.models.ladder import LADDER
from heavytop.planning import EPSILON

AUTO: Final = "auto"
DEFAULTS: Final = "solve-ivp-defaults"
FORMS: Final = ("axis", "attitude", "cubic", "routh", "subsystem", "lagrange")
TIGHT: Final = {"dop853": 1e-12, "lsoda": 1e-11, "radau": 1e-8}  # as far as each goes in good time


@dataclass(frozen=True, slots=True)
class Method:
    """One method.

    Attributes
    ----------
    name : str
    formulation : str
        The equations; ``auto`` chooses.
    short : str
        A heading for it.
    solver : str
        scipy's solver; empty for the package's own integrator.
    rtol, atol : float
        Tolerances.
    first_order : bool
        Whether it solves u' = sqrt(f(u)) instead.
    """

    name: str
    formulation: str
    short: str
    solver: str = ""
    rtol: float = EPSILON
    atol: float = EPSILON
    first_order: bool = False


def _rows() -> list[Method]:
    found = [Method(AUTO, AUTO, "auto")]
    found += [Method(f"taylor-{form}", form, form) for form in FORMS]
    for form, mark in (("axis", "a"), ("lagrange", "l")):
        for solver, tolerance in TIGHT.items():
            name = f"{solver}-scipy" + ("" if form == "axis" else f"-{form}")
            found.append(Method(name, form, f"{solver}:{mark}", solver, tolerance, tolerance))
    found.append(Method(DEFAULTS, "lagrange", "ivp:l", "rk45", 1e-3, 1e-6))
    for solver, tolerance in TIGHT.items():
        name = f"{solver}-scipy-first-order"
        found.append(Method(name, "first-order", f"{solver}:1", solver, tolerance, tolerance, True))
    return found


METHODS: Final[Mapping[str, Method]] = MappingProxyType({each.name: each for each in _rows()})
assert set(FORMS) == set(LADDER)


def nearest(name: str, known: Mapping[str, object]) -> str:
    """Return a hint at what may have been meant, or nothing.

    Examples
    --------
    >>> nearest("taylor-axes", METHODS)
    'did you mean "taylor-axis"?'
    """
    near = get_close_matches(name, known, 1)
    return f'did you mean "{near[0]}"?' if near else ""
