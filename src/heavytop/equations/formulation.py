"""Formulations: the motion as first-order equations, with its outputs, events and invariants.

A formulation is symbolic. Numbers enter through `parameters`, so that one compiled integrator
serves every top, and through `start`, which maps a start in Euler angles to states.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from heavytop.equations import lagrangian as lag
from heavytop.equations.lambdify import Functions, OfInteger, lambdify
from heavytop.equations.registry import FORMULATIONS as FORMULATIONS
from heavytop.exact.pairs import long_epsilon

time = sp.Symbol("t", real=True)
spin = sp.symbols("spin_cos spin_sin", real=True)  # of kappa t / 2, to their own digits


@dataclass(frozen=True, eq=False)
class Formulation:
    """States, right-hand sides, maps from and to Euler angles, events and invariants.

    Attributes
    ----------
    name : str
        The name that users give (``axis``, ``lagrange``).
    states, derivatives : tuple of sympy expressions, equal length
        The states and their time derivatives, functions of states and parameters alone.
    start : tuple of sympy expressions
        The states at the start, functions of A, C, gMR, the angles and their rates.
    parameters : mapping from symbol to expression
        Constants of a run, functions of A, C, gMR and the start.
    outputs : mapping from str to expression
        Physical quantities as functions of states, parameters and the time t. The symbols `spin`
        stand for cosine and sine of half the uniform rotation kappa t.
    events : mapping from str to expression
        Functions whose zeros are the events: ``turning`` has the sign of thetadot, ``reversal``
        that of phidot.
    invariants : mapping from str to expression
        Functions that the exact flow conserves; ``energy`` is E'/A [1/s^2], ``p_phi`` and
        ``p_psi`` are p_phi/A and p_psi/A [1/s].
    spin : sympy expression
        p_psi/A, a function of states and parameters.
    reading : mapping from str to expression
        The numbers that define the motion through a state, as functions of states and of those
        parameters that the derivatives have (these define the motion that is integrated): the axis
        ``e_x`` … and ``l_x`` …, its angular momentum divided by A, both in space, with ``g``,
        ``kappa``, ``phi_0``, ``psi_0``; or Euler's angles and their rates (for ``psidot`` also
        ``omega3``) with ``A``, ``C``, ``gMR``; or the height ``w`` of the cubic form.
    limits : tuple of sympy expressions
        At theta = 0 or pi: |thetadot|, and phidot of an axis that passes the top, or the bottom,
        functions of states and parameters; none where these are no ordinary points.
    given : tuple of symbols
        Parameters that are free: the motion is the same for any value (a frame's rate).
    phi_wraps : bool
        Whether phi, and psi with it, is read off the states, which give it modulo 2 pi.
    psi_side : int
        The sign s for which phi + s psi is known with its turns all the same; 0 for neither.
    """

    name: str
    states: tuple[Any, ...]
    derivatives: tuple[Any, ...]
    start: tuple[Any, ...]
    parameters: Mapping[Any, Any]
    outputs: Mapping[str, Any]
    events: Mapping[str, Any]
    invariants: Mapping[str, Any]
    spin: Any
    reading: Mapping[str, Any]
    limits: tuple[Any, ...] = ()
    given: tuple[Any, ...] = ()
    phi_wraps: bool = False
    psi_side: int = 0

    @cached_property
    def powers(self) -> Mapping[str, int]:
        """The powers of 1/s in the units of its states and constants, by the names of the symbols.

        In another unit of time, equations and events are the same functions of states and
        constants: they are homogeneous in these powers. So is the start as a function of rates.
        """
        defined = [*zip(self.states, self.start, strict=True), *self.parameters.items()]
        fixed = {lag.A: 1.3, lag.C: 0.7, lag.theta: 0.9, lag.phi: 0.4, lag.psi: 0.3}
        function = lambdify([x for _, x in defined], (*fixed, *lag.VELOCITIES, lag.gMR))

        def values(unit: float) -> list[float]:
            rates = (unit * k for k, _ in enumerate(lag.VELOCITIES, 1))
            return list(function(*fixed.values(), *rates, 2.3 * unit**2))

        powers = {symbol.name: 1 for symbol in self.given}  # rates of frames
        for (symbol, _), one, two in zip(defined, values(1.0), values(2.0), strict=True):
            powers[symbol.name] = round(math.log2(two / one)) if one else 0  # of a quadrature
        return powers

    @cached_property
    def is_rate(self) -> NDArray[np.bool_]:
        """Which states are rates [rad/s]; the others have no time in their units."""
        return np.array([self.powers[s.name] == 1 for s in self.states])

    @property
    def height(self) -> Any:
        """The height cos(theta) of the axis, a function of states and parameters."""
        return self.outputs.get("axis_z", sp.cos(self.outputs["theta"]))

    def flow_derivative(self, expression: Any) -> Any:
        """Return the time derivative of a function of the states along the motion."""
        rates = zip(self.states, self.derivatives, strict=True)
        return sum((sp.diff(expression, x) * rate for x, rate in rates), sp.Integer(0))

    def arguments(self) -> tuple[Any, ...]:
        """Return the symbols its outputs may depend on: states, parameters, given, t."""
        return (*self.states, *self.parameters, *self.given, time)

    def constants_in(self, expressions: Iterable[Any]) -> list[Any]:
        """Return those of its constants that occur in expressions, in its own order."""
        used = set().union(*(x.free_symbols for x in expressions))
        return [p for p in (*self.parameters, *self.given) if p in used]


def components(name: str, vector: Iterable[Any]) -> dict[str, Any]:
    """Return the components of a vector in space by the names of outputs."""
    return {f"{name}_{x}": component for x, component in zip("xyz", vector, strict=True)}


# --- functions of a formulation ------------------------------------------------------------------


class Invariants(NamedTuple):
    """Functions of the states and of the constants that occur.

    Attributes
    ----------
    states, constants : tuple of symbols
    values : tuple of expressions
        The invariants without terms that do not depend on the states, which would cost digits.
    slopes : tuple of tuples of expressions
        Their derivatives by the states: one row for each invariant.
    sizes : callable
        The sum of |x dI/dx| over all x in an invariant I, in doubles, as a function of states and
        constants: the change of I, to first order, when all x are rounded, over the relative size
        of the rounding.
    """

    states: tuple[Any, ...]
    constants: tuple[Any, ...]
    values: tuple[Any, ...]
    slopes: tuple[tuple[Any, ...], ...]
    sizes: Callable[..., list[float]]


@cache
def invariants_of(formulation: Formulation) -> Invariants:
    """Return the invariants of a formulation.

    Examples
    --------
    >>> from heavytop.equations.reduced_cubic import cubic_form
    >>> found = invariants_of(cubic_form())
    >>> found.values, found.constants
    ((-k_0*w - k_1*w**2/2 - k_2*w**3/3 + wdot**2/2,), (k_0, k_1, k_2))
    """
    states, found = formulation.states, formulation.invariants.values()
    values = tuple(x.as_independent(*states, as_Add=True)[1] for x in found)
    constants = tuple(formulation.constants_in(values))
    arguments = (*states, *constants)
    sizes = [sum(sp.Abs(a * sp.diff(x, a)) for a in arguments) for x in values]
    slopes = tuple(tuple(sp.diff(x, state) for state in states) for x in values)
    return Invariants(states, constants, values, slopes, lambdify(sizes, arguments))


def observables(
    formulation: Formulation, constants: Sequence[Any], number: OfInteger, functions: Functions
) -> Callable[..., Sequence[Any]]:
    """Return a function of states and constants: u, udot, the invariants, and the axis.

    u is the vertical part of the axis. The three components of the axis stand last, or are
    missing where the states do not give all of them.

    Parameters
    ----------
    formulation : Formulation
    constants : sequence of symbols
        Its parameters, in the order in which they follow the states.
    number, functions
        As `lambdify` takes them.

    Examples
    --------
    >>> from fractions import Fraction
    >>> from heavytop.equations.euler_poisson import axis_form
    >>> form = axis_form()
    >>> names = {p.name: Fraction(0) for p in form.parameters} | {"g": Fraction(1)}
    >>> see = observables(form, tuple(form.parameters), Fraction, {})
    >>> u, udot, energy, *_ = see(1, 0, 0, 0, 1, *names.values())
    >>> u, udot, energy  # the axis lies along x and turns down, about y
    (0, -1, Fraction(1, 2))
    """
    u, known = formulation.height, {*formulation.states, *formulation.parameters}
    axis = [formulation.outputs.get(f"axis_{x}", time) for x in "xyz"]
    seen = [u, formulation.flow_derivative(u), *formulation.invariants.values()]
    seen += axis if all(x.free_symbols <= known for x in axis) else []
    return lambdify(seen, (*formulation.states, *constants), number, functions)


def why_not(formulation: Formulation) -> str:
    """Return the reason why runs of a formulation cannot be projected; empty where they can."""
    if not formulation.invariants:
        return f"the {formulation.name} form has no invariant to project onto"
    if long_epsilon() > np.finfo(float).eps / 256:
        return "long double has no more digits than double on this machine"
    return ""
