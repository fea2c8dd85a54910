"""The methods that are put under stress: every form of the equations, auto, and what others use.

Whose the others' are is said in `heavytop.comparison`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from heavytop.equations.formulation import FORMULATIONS
from heavytop.run.planning import EPSILON

AUTO: Final = "auto"
ANGLES: Final = "auto-angles"
DEFAULTS: Final = "solve-ivp-defaults"
FORMS: Final = ("axis", "attitude", "cubic", "routh", "subsystem", "lagrange")
TIGHT: Final = {"dop853": 1e-12, "lsoda": 1e-11, "radau": 1e-8}  # as far as each goes in good time
COMPILED: Final = (("blanes-moan-rkn6", "rkn6", 64), ("gauss8", "gauss8", 32))
CYRK: Final = "dop853-cyrk"


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
    rival : str
        The name of a compiled rival; empty for the others.
    per_period : int
        Steps in a nutation period, where they have one length.
    angles : bool
        Whether phi and psi are wanted, and it is they that are judged.
    """

    name: str
    formulation: str
    short: str
    solver: str = ""
    rtol: float = EPSILON
    atol: float = EPSILON
    first_order: bool = False
    rival: str = ""
    per_period: int = 0
    angles: bool = False

    @property
    def own(self) -> bool:
        """Whether it is the package's own."""
        return not self.solver and not self.rival

    @property
    def setting(self) -> str:
        """What is set, for a heading: a tolerance or steps a period; auto sets it for itself."""
        if self.formulation == AUTO:
            return ""
        return f"{self.per_period}/period" if self.per_period else shortest(self.rtol)


def shortest(tolerance: float) -> str:
    """Return a tolerance in the fewest digits.

    Examples
    --------
    >>> shortest(1e-8), shortest(EPSILON)
    ('1e-8', '2.2e-16')
    """
    mantissa, _, power = f"{tolerance:.1e}".partition("e")
    return f"{float(mantissa):g}e{int(power)}"


def _rows() -> list[Method]:
    found = [Method(AUTO, AUTO, "auto"), Method(ANGLES, AUTO, "auto:φψ", angles=True)]
    found += [Method(f"taylor-{form}", form, form) for form in FORMS]
    for form, mark in (("axis", "a"), ("lagrange", "l")):
        for solver, tolerance in TIGHT.items():
            name = f"{solver}-scipy" + ("" if form == "axis" else f"-{form}")
            found.append(Method(name, form, f"{solver}:{mark}", solver, tolerance, tolerance))
    found += [
        Method(name, "axis", f"{short}:a", rival=name, per_period=steps)
        for name, short, steps in COMPILED
    ]
    found.append(Method(CYRK, "axis", "cyrk:a", rival=CYRK, rtol=1e-12, atol=1e-12))
    found.append(Method(DEFAULTS, "lagrange", "ivp:l", "rk45", 1e-3, 1e-6))
    for solver, tolerance in TIGHT.items():
        name = f"{solver}-scipy-first-order"
        found.append(Method(name, "first-order", f"{solver}:1", solver, tolerance, tolerance, True))
    return found


METHODS: Final[Mapping[str, Method]] = MappingProxyType({each.name: each for each in _rows()})
assert set(FORMS) == set(FORMULATIONS)
