"""The variational equations: how a motion changes with its start and with its parameters.

Beside the states y, with dy/dt = f(y, p), heyoka integrates their derivatives by the states at
the start and by the parameters, which it has by differentiating f:

    d/dt dy/dy(0) = (df/dy) dy/dy(0),    d/dt dy/dp = (df/dy) dy/dp + df/dp.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from threading import local
from typing import Any

import heyoka as hy
import numpy as np

from heavytop.models.formulation import Formulation
from heavytop.taylor.integrator import Array
from heavytop.taylor.translate import translate


@dataclass(frozen=True, slots=True)
class Varied:
    """States of a formulation and their derivatives at given times.

    Attributes
    ----------
    states : ndarray, shape (k, n)
        nan at times that were not reached: before them the equations become singular.
    matrix : ndarray, shape (k, n, n)
        d state(t) / d state(0).
    by_parameters : ndarray, shape (k, n, p)
        d state(t) / d parameters.
    """

    states: Array
    matrix: Array
    by_parameters: Array


@dataclass(eq=False)
class Variational:
    """A formulation with its variational equations, compiled; belongs to one thread.

    Parameters
    ----------
    formulation : Formulation
    tolerance : float
        Relative error tolerance of a step, of the largest of states and derivatives.

    Attributes
    ----------
    parameters : tuple of str
        The formulation's parameters that stand in its equations, by which it is varied.
    """

    formulation: Formulation
    tolerance: float
    parameters: tuple[str, ...] = field(init=False)
    _constants: tuple[str, ...] = field(init=False)
    _taylor: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        form = self.formulation
        used = set().union(*(x.free_symbols for x in form.derivatives))
        varied = [p for p in form.parameters if p in used]
        symbols = (*varied, *(p for p in form.given if p in used))
        self.parameters = tuple(p.name for p in varied)
        self._constants = tuple(p.name for p in symbols)
        states = hy.make_vars(*(s.name for s in form.states))
        names = dict(zip(form.states, states, strict=True))
        names |= {p: hy.par[i] for i, p in enumerate(symbols)}
        system = list(zip(states, translate(form.derivatives, names), strict=True))
        varying = hy.var_ode_sys(system, [*states, *(names[p] for p in varied)], order=1)
        self._taylor = hy.taylor_adaptive(
            varying, np.zeros(len(states)), tol=self.tolerance, compact_mode=True
        )  # not compact it takes ten seconds to compile

    def run(self, state: Array, constants: Mapping[str, float], times: Array) -> Varied:
        """Integrate from a state at time 0.

        Parameters
        ----------
        state : ndarray, shape (n,)
        constants : mapping from str to float
            The constants of the run, by the names of their symbols.
        times : ndarray, shape (k,)
            Times of either sign, in any order [s].
        """
        n, p = state.size, len(self.parameters)
        start = np.concatenate((state, np.eye(n, n + p).ravel()))
        rows = np.empty((times.size, start.size))
        self._taylor.pars[:] = [constants[name] for name in self._constants]
        for side, sign in ((times >= 0, 1.0), (times < 0, -1.0)):
            if side.any():
                rows[side] = self._one_way(start, sign, np.abs(times[side]))
        by = rows[:, n:].reshape(-1, n, n + p)
        return Varied(rows[:, :n], by[:, :, :n], by[:, :, n:])

    def _one_way(self, start: Array, sign: float, distances: Array) -> Array:
        taylor = self._taylor
        taylor.time = 0.0
        taylor.state[:] = start
        grid = np.union1d(0.0, distances)
        # a callback, though it does nothing, lets an interrupt through
        reached = taylor.propagate_grid(sign * grid, callback=lambda _: True)[-1]
        rows = np.full((grid.size, start.size), np.nan)
        rows[: len(reached)] = reached
        found: Array = rows[np.searchsorted(grid, distances)]
        return found


def variational(formulation: Formulation, tolerance: float) -> Variational:
    """Return the variational equations of a formulation, compiled once per thread."""
    built: dict[Any, Variational] = _OF_THIS_THREAD.__dict__.setdefault("built", {})
    key = (formulation, tolerance)
    if key not in built:
        built[key] = Variational(*key)
    return built[key]


_OF_THIS_THREAD = local()
