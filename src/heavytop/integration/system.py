"""heyoka, at its one door: its settings and numbers, and formulations as it takes them.

Whoever needs it takes it from here. It has wheels for Linux only, so pip installs it there alone.
Here too is the unit of time in which the steps of a motion are taken: a power of two, so nothing
is rounded. `heavytop.integration.engine` says what it is for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import evaluate
from heavytop.errors import MissingPackage, is_interrupt
from heavytop.exact.decimals import DOUBLE
from heavytop.exact.pairs import Array

try:
    import heyoka
except ImportError as fault:
    if is_interrupt(fault):
        raise KeyboardInterrupt from None
    broken = "" if isinstance(fault, ModuleNotFoundError) else str(fault)
    raise MissingPackage("integration", ["heyoka"], broken=broken) from fault
hy = heyoka

MOST_CACHED = 256 * 2**20  # bytes of compiled code that heyoka keeps on disk: some hundred programs
# rad/s, between which rates are as good as of the size of one
SLOWEST_PACE, FASTEST_PACE = 2.0**-8, 2.0**8
MOST_EXPONENT = 500  # of the exponent: far beyond any top, and squares are still finite
_HEYOKAS_OWN = 20 * 2**30  # its limit where nobody has set one
_FUNCTIONS = {name: getattr(hy, name) for name in ("sin", "cos", "sqrt", "exp", "log")}

hy.set_logger_level_critical()  # heyoka logs to stdout, which belongs to the results
with suppress(RuntimeError):  # its folder cannot be made: heyoka works without
    if hy.llvm_state.get_diskcache_limit() == _HEYOKAS_OWN:
        hy.llvm_state.set_diskcache_limit(MOST_CACHED)


def number_of(bits: int) -> Callable[[Any], Any]:
    """Return what makes a number of so many bits of another one, or of a decimal text."""
    return float if bits == DOUBLE else partial(hy.real, prec=bits)


def translate(expressions: Sequence[Any], names: dict[str, Any], bits: int = DOUBLE) -> list[Any]:
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
    >>> translate([sp.Symbol("x") / 3 + sp.sqrt(2)], {"x": hy.expression("x")})
    [(1.4142135623730951 + (0.33333333333333331 * x))]
    """
    number = number_of(bits)
    return evaluate(expressions, names, lambda integer: hy.expression(number(integer)), _FUNCTIONS)


def equations_of(
    form: Formulation, bits: int, events: tuple[str, ...]
) -> tuple[list[tuple[Any, Any]], tuple[str, ...], list[Any]]:
    """Return first-order equations, every constant in them of so many bits.

    These are pairs of a state and its derivative, for heyoka; the names of the constants of a run,
    which are ``par[0]``, ``par[1]``, …; and the event functions.
    """
    watched = [form.events[name] for name in events]
    loaded = form.constants_in((*form.derivatives, *watched))
    states = {s.name: hy.expression(s.name) for s in form.states}
    names = states | {p.name: hy.par[i] for i, p in enumerate(loaded)}
    equations = zip(states.values(), translate(form.derivatives, names, bits), strict=True)
    return [*equations], tuple(p.name for p in loaded), translate(watched, names, bits)


def paces_of(form: Formulation, states: Array, parameters: Mapping[str, Any]) -> Array:
    """Return the paces of motions through states, shape (..., n), with their constants [1/s].

    Each is of the size of the largest of the rates in the state, and of what gravity and the
    energy h can make of them: at a turning point rates may vanish, and they do not stay so.

    Examples
    --------
    >>> from heavytop.equations.euler_poisson import axis_form
    >>> states = np.array([[0, 0, 1, 3, -200.0], [0, 0, 1, 3, -1000.0], [0, 0, 1, 0, 0.0]])
    >>> paces_of(axis_form(), states, {"g": np.array([1.0, 1.0, 5e-7])})
    array([1.000000e+00, 1.024000e+03, 1.953125e-03])
    """
    g = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    falling = (2 * (abs(g) + abs(parameters.get("h", 0.0)))) ** 0.5
    turning = abs(states[..., form.is_rate]).max(axis=-1, initial=0.0)
    pace = np.maximum(turning, falling)
    far = (pace > 0) & (pace < np.inf) & ~((pace >= SLOWEST_PACE) & (pace <= FASTEST_PACE))
    if not far.any():
        return np.ones(far.shape)
    exponent = np.clip(np.frexp(pace)[1], -MOST_EXPONENT, MOST_EXPONENT)
    return np.where(far, np.ldexp(1.0, exponent), 1.0)


def in_units(form: Formulation, pace: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return constants of a formulation in the unit of time of a pace, by their symbols' names.

    Examples
    --------
    >>> from heavytop.equations.euler_poisson import axis_form
    >>> in_units(axis_form(), 4.0, {"g": 32.0, "l_z": 8.0, "phi_0": 3.0})
    {'g': 2.0, 'l_z': 2.0, 'phi_0': 3.0}
    """
    return {name: x / pace ** form.powers[name] for name, x in values.items()}
