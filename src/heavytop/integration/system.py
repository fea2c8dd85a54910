"""The one place that imports heyoka: settings, numbers, translated equations, the unit of time.

heyoka compares the error of a step with the largest state. The axis is of size 1; angular momenta
may be a million times larger or smaller, and then one of the two has few digits, unseen. So times
are multiplied by the pace of the motion, rates divided by it, constants by powers of it. A pace is
a power of two, so that nothing is rounded; that of ordinary tops is 1.
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
    import heyoka  # it has wheels for Linux only, where alone pip installs it
except ImportError as fault:
    if is_interrupt(fault):
        raise KeyboardInterrupt from None
    broken = "" if isinstance(fault, ModuleNotFoundError) else str(fault)
    raise MissingPackage("integration", ["heyoka"], broken=broken) from fault
hy = heyoka

MOST_CACHED = 256 * 2**20  # bytes of compiled code that heyoka keeps on disk: some hundred programs
SLOWEST_PACE, FASTEST_PACE = 2.0**-8, 2.0**8  # rad/s; motions between them have the pace 1
MOST_EXPONENT = 500  # of a pace: far beyond any top, and squares are still finite
_HEYOKAS_OWN = 20 * 2**30  # heyoka's default limit
_FUNCTIONS = {name: getattr(hy, name) for name in ("sin", "cos", "sqrt", "exp", "log")}

hy.set_logger_level_critical()  # heyoka logs to stdout, which belongs to the results
with suppress(RuntimeError):  # its folder cannot be made: heyoka works without
    if hy.llvm_state.get_diskcache_limit() == _HEYOKAS_OWN:
        hy.llvm_state.set_diskcache_limit(MOST_CACHED)


def number_of(bits: int) -> Callable[[Any], Any]:
    """Return the function that rounds a number or a decimal text to so many bits."""
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
    """Return the equations of a formulation for heyoka, every number in them of so many bits.

    They are pairs of a state and its derivative; the names of the constants of a run, which are
    ``par[0]``, ``par[1]``, …; and the event functions.
    """
    watched = [form.events[name] for name in events]
    loaded = form.constants_in((*form.derivatives, *watched))
    states = {s.name: hy.expression(s.name) for s in form.states}
    names = states | {p.name: hy.par[i] for i, p in enumerate(loaded)}
    equations = zip(states.values(), translate(form.derivatives, names, bits), strict=True)
    return [*equations], tuple(p.name for p in loaded), translate(watched, names, bits)


def paces_of(form: Formulation, states: Array, parameters: Mapping[str, Any]) -> Array:
    """Return the paces of motions through states, shape (..., n), with their constants [1/s].

    A pace is of the size of the largest rate in the state, or of the rates to which gravity and the
    energy h can lead: at a turning point rates may vanish, but only there.

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
    """Return constants of a formulation, by symbol name, in the unit of time of a pace.

    Examples
    --------
    >>> from heavytop.equations.euler_poisson import axis_form
    >>> in_units(axis_form(), 4.0, {"g": 32.0, "l_z": 8.0, "phi_0": 3.0})
    {'g': 2.0, 'l_z': 2.0, 'phi_0': 3.0}
    """
    return {name: x / pace ** form.powers[name] for name, x in values.items()}
