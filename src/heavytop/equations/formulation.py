"""A formulation: one way of writing the motion as first-order equations.

Everything in it is symbolic. Numbers enter through `parameters`, so that one compiled
integrator serves every top, and through `start`, which maps a start in Euler angles to states.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import sympy as sp

time = sp.Symbol("t", real=True)


@dataclass(frozen=True, slots=True, eq=False)
class Formulation:
    """States, right-hand sides, maps from and to Euler angles, events and invariants.

    Attributes
    ----------
    name : str
        The name users hold (``axis``, ``lagrange``).
    summary : str
        One line of words.
    states, derivatives : tuple of sympy expressions, equal length
        The states and their time derivatives, functions of states and parameters alone.
    start : tuple of sympy expressions
        The states at the start, functions of A, C, gMR, the angles and their rates.
    parameters : mapping from symbol to expression
        Constants of a run, functions of A, C, gMR and the start.
    given : tuple of symbols
        Parameters that are free: the motion is the same for any value (a frame's rate).
    outputs : mapping from str to expression
        Physical quantities as functions of states, parameters and the time t. Where phi is not
        among the states, ``phi_mod`` is its value modulo 2 pi and the winding is counted
        elsewhere; the symbol `turned_phi` then stands for phi counted from the start. The
        symbols `spin` stand for cosine and sine of half the uniform rotation kappa t.
    events : mapping from str to expression
        Functions whose zeros are the events: ``turning`` has the sign of thetadot, ``reversal``
        that of phidot.
    invariants : mapping from str to expression
        Functions that the exact flow conserves; ``energy`` is E'/A [1/s^2], ``p_phi`` and
        ``p_psi`` are p_phi/A and p_psi/A [1/s].
    spin : sympy expression
        p_psi/A, a function of states and parameters.
    starts_at_pole : bool
        Whether theta = 0 and theta = pi are ordinary points.
    unbounded : bool
        Whether an angle that grows without bound sits in the state.
    integrated : Formulation, optional
        This one without its last two states, where these are angles that the others give modulo
        2 pi: they are not integrated, but read off, and their turns counted.
    rates : tuple of sympy symbols
        Those of the states that are rates [rad/s], as large or small as the top is fast or slow;
        the others are of the size of one. Empty where angles grow in the state, which would only
        be the largest states the sooner.
    """

    name: str
    summary: str
    states: tuple[Any, ...]
    derivatives: tuple[Any, ...]
    start: tuple[Any, ...]
    parameters: Mapping[Any, Any]
    given: tuple[Any, ...]
    outputs: Mapping[str, Any]
    events: Mapping[str, Any]
    invariants: Mapping[str, Any]
    spin: Any
    starts_at_pole: bool
    unbounded: bool
    integrated: Formulation | None = None
    rates: tuple[Any, ...] = ()

    def flow_derivative(self, expression: Any) -> Any:
        """Return the time derivative of a function of the states along the motion."""
        rates = zip(self.states, self.derivatives, strict=True)
        return sum((sp.diff(expression, x) * rate for x, rate in rates), sp.Integer(0))

    def arguments(self) -> tuple[Any, ...]:
        """Return the symbols its outputs may depend on: states, parameters, given, t."""
        return (*self.states, *self.parameters, *self.given, time)


turned_phi = sp.Symbol("turned_phi", real=True)
spin = sp.symbols("spin_cos spin_sin", real=True)  # of kappa t / 2, to their own digits
