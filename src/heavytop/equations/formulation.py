"""Formulations: ways of writing the motion as first-order equations.

Everything in a formulation is symbolic. Numbers enter through `parameters`, so that one compiled
integrator serves every top, and through `start`, which maps a start in Euler angles to states.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from heavytop.equations import lagrangian as lag
from heavytop.equations.lambdify import lambdified
from heavytop.equations.registry import FORMULATIONS as FORMULATIONS

time = sp.Symbol("t", real=True)
spin = sp.symbols("spin_cos spin_sin", real=True)  # of kappa t / 2, to their own digits


@dataclass(frozen=True, eq=False)
class Formulation:
    """States, right-hand sides, maps from and to Euler angles, events and invariants.

    Attributes
    ----------
    name : str
        The name users hold (``axis``, ``lagrange``).
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
        What defines the motion through a state, as functions of states and parameters: the axis
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

    @property
    def starts_at_pole(self) -> bool:
        """Whether theta = 0 and theta = pi are ordinary points."""
        return FORMULATIONS[self.name].starts_at_pole

    @cached_property
    def powers(self) -> Mapping[str, int]:
        """The powers of 1/s in the units of its states and constants, by the names of the symbols.

        Measured in another unit of time, equations and events are the same functions of states and
        constants: they are homogeneous in these powers. So is what the start makes of rates.
        """
        of = [*zip(self.states, self.start, strict=True), *self.parameters.items()]
        known = {lag.A: 1.3, lag.C: 0.7, lag.theta: 0.9, lag.phi: 0.4, lag.psi: 0.3}
        function = lambdified([x for _, x in of], (*known, *lag.VELOCITIES, lag.gMR))

        def values(unit: float) -> list[float]:
            rates = (unit * k for k, _ in enumerate(lag.VELOCITIES, 1))
            return list(function(*known.values(), *rates, 2.3 * unit**2))

        powers = {symbol.name: 1 for symbol in self.given}  # rates of frames
        for (symbol, _), one, two in zip(of, values(1.0), values(2.0), strict=True):
            powers[symbol.name] = round(math.log2(two / one)) if one else 0  # as a quadrature is
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
    """Return the components of a vector in space as outputs are called."""
    return {f"{name}_{x}": component for x, component in zip("xyz", vector, strict=True)}
