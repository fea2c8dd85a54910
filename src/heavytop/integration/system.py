"""Formulations as heyoka takes them: their sympy expressions as its own, every constant exact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import evaluated
from heavytop.integration.bits import DOUBLE
from heavytop.integration.library import hy

_FUNCTIONS = {name: getattr(hy, name) for name in ("sin", "cos", "sqrt", "exp", "log")}


def translated(expressions: Sequence[Any], names: dict[str, Any], bits: int = DOUBLE) -> list[Any]:
    """Return the heyoka counterparts of sympy expressions.

    heyoka's own converter refuses thirds and rounds sympy's Floats to double, silently.

    Parameters
    ----------
    expressions : sequence of sympy expressions
    names : mapping from str to heyoka expression
        Of the symbols, by their names: states as variables, constants of a run as ``par[i]``.
    bits : int
        Of the numbers; 1/3 is rounded once to so many.

    Raises
    ------
    WrongType
        A symbol without a name, or a function or number without a counterpart.

    Examples
    --------
    >>> import sympy as sp
    >>> translated([sp.Symbol("x") / 3 + sp.sqrt(2)], {"x": hy.expression("x")})
    [(1.4142135623730951 + (0.33333333333333331 * x))]
    """

    def constant(integer: int) -> Any:
        return hy.expression(float(integer) if bits == DOUBLE else hy.real(integer, bits))

    return evaluated(expressions, names, constant, _FUNCTIONS)


class System(NamedTuple):
    """First-order equations as heyoka takes them, every constant in them of some precision.

    Attributes
    ----------
    equations : list of pairs of heyoka expressions
        The states, each with its time derivative.
    loaded : tuple of str
        Constants of a run, by symbol name: ``par[0]``, ``par[1]``, ...
    zeros : list of heyoka expressions
        Event functions.
    """

    equations: list[tuple[Any, Any]]
    loaded: tuple[str, ...]
    zeros: list[Any]

    @classmethod
    def of(cls, form: Formulation, bits: int, events: tuple[str, ...] = ()) -> Self:
        """Return that of a formulation and of its events, for numbers of so many bits."""
        watched = [form.events[name] for name in events]
        loaded = form.constants_in((*form.derivatives, *watched))
        states = {s.name: hy.expression(s.name) for s in form.states}
        names = states | {p.name: hy.par[i] for i, p in enumerate(loaded)}
        derivatives = translated(form.derivatives, names, bits)
        equations = list(zip(states.values(), derivatives, strict=True))
        return cls(equations, tuple(p.name for p in loaded), translated(watched, names, bits))
