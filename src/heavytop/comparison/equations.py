"""What solvers of others are given, a function of time and states, and the time they make of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from heavytop.comparison.march import Stopped
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import lambdified
from heavytop.errors import Impossible
from heavytop.numbers.double_double import DoubleDouble, add

_MATH = {"sin": math.sin, "cos": math.cos, "sqrt": math.sqrt}


class Singular(Exception):
    """Derivatives that are not finite."""


def later(time: DoubleDouble, steps: float) -> DoubleDouble:
    """Return a time some steps later.

    Raises
    ------
    Stopped
        They are too short to change it, which LSODA takes for success.
    """
    result = add(time, (steps, 0.0))
    if result == time:
        raise Stopped("the solver gave up: its steps vanish")
    return result


def constants(equations: Formulation) -> tuple[Any, ...]:
    """Return the symbols besides the states that the derivatives hold."""
    used = set().union(*(x.free_symbols for x in equations.derivatives))
    return tuple(p for p in (*equations.parameters, *equations.given) if p in used)


def values(equations: Formulation, parameters: Mapping[str, float]) -> tuple[float, ...]:
    """Return the numbers of `constants`, in their order.

    Raises
    ------
    Impossible
        One of them is not among the parameters.
    """
    names = [symbol.name for symbol in constants(equations)]
    if lacking := [(name, "is not given") for name in names if name not in parameters]:
        raise Impossible(lacking)
    return tuple(float(parameters[name]) for name in names)


def derivatives(equations: Formulation) -> Callable[..., Sequence[float]]:
    """Return the derivatives as a function of the states and of `constants`, in floats."""
    arguments = (*equations.states, *constants(equations))
    return lambdified(equations.derivatives, arguments, float, _MATH)


def right_hand_side(
    equations: Formulation, parameters: Mapping[str, float]
) -> Callable[[float, Any], Sequence[float]]:
    """Return f(t, y), y a numpy array, that raises `Singular` instead of returning no numbers."""
    rates, known = derivatives(equations), values(equations, parameters)

    def at(_: float, y: Any) -> Sequence[float]:
        try:
            result = rates(*y.tolist(), *known)
        except (ZeroDivisionError, OverflowError, ValueError) as error:
            raise Singular from error
        if not math.isfinite(sum(result)):
            raise Singular
        return result

    return at
