"""What Top and State share: reading values as exact numbers, and saying which are broken."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from heavytop.errors import NotANumber
from heavytop.numbers import Exact, Number
from heavytop.numbers.parse import ANGLES, RATES

Broken: TypeAlias = "list[tuple[str, str]]"  # (name, rule) of every value that breaks a rule

_UNITS: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(("theta", "phi", "psi"), ANGLES),
    **dict.fromkeys(("thetadot", "phidot", "psidot", "omega3"), RATES),
}


def read(**given: Number) -> tuple[Broken, dict[str, Exact]]:
    """Every value that is one as an exact number, and what is wrong with the others."""
    broken: Broken = []
    values: dict[str, Exact] = {}
    for name, value in given.items():
        try:
            values[name] = Exact.of(value, _UNITS.get(name, ()))
        except NotANumber as error:
            broken.append((name, str(error)))
    return broken, values


def fill(instance: object, values: Mapping[str, object]) -> None:
    """Set fields of a frozen instance that is being made."""
    for name, value in values.items():
        object.__setattr__(instance, name, value)


def made(name: str, **values: Exact) -> str:
    """The call that makes an instance, its numbers as the texts they are read from."""
    return f"{name}({', '.join(f'{key}={str(value)!r}' for key, value in values.items())})"


def short(x: Exact) -> str:
    """A number for a message: exactly where that is short, so that it can be taken over."""
    exact = str(Exact(x.terms))
    return exact if x.fraction is not None and len(exact) <= 24 else f"{float(x):.17g}"
