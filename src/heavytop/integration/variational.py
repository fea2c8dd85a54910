"""The variational equations: how a motion changes with its start and with its parameters.

Beside the states y, with dy/dt = f(y, p), heyoka integrates their derivatives by the states at
the start and by the parameters, which it has by differentiating f:

    d/dt dy/dy(0) = (df/dy) dy/dy(0),    d/dt dy/dp = (df/dy) dy/dp + df/dp.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from threading import local
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.integration.bits import DOUBLE, LONG_DOUBLE
from heavytop.integration.compiled import Array, System


@dataclass(frozen=True, slots=True)
class Varied:
    """States of a formulation and their derivatives at given times, in numbers of some bits.

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

    @property
    def reached(self) -> NDArray[np.bool_]:
        """At which times they were reached."""
        found: NDArray[np.bool_] = np.logical_and.reduce(
            np.isfinite(self.states.astype(np.float64)), axis=1
        )
        return found

    def at(self, which: NDArray[np.bool_]) -> Varied:
        """Return those of some times."""
        return Varied(self.states[which], self.matrix[which], self.by_parameters[which])


@dataclass(eq=False)
class Variational:
    """A formulation with its variational equations, compiled; belongs to one thread.

    Parameters
    ----------
    formulation : Formulation
    bits : int
        Of the significand of its numbers. Their last place is the tolerance of a step, relative to
        the largest of states and derivatives.

    Attributes
    ----------
    parameters : tuple of str
        The formulation's parameters that stand in its equations, by which it is varied.
    """

    formulation: Formulation
    bits: int
    parameters: tuple[str, ...] = field(init=False)
    _constants: tuple[str, ...] = field(init=False)
    _taylor: Any = field(init=False, repr=False)

    def __post_init__(self) -> None:
        system = System.of(self.formulation, self.bits)
        given = {p.name for p in self.formulation.given}
        self._constants = system.loaded
        self.parameters = tuple(p for p in system.loaded if p not in given)
        states = [state for state, _ in system.equations]
        varied = [hy.par[i] for i, name in enumerate(system.loaded) if name in self.parameters]
        varying = hy.var_ode_sys(system.equations, [*states, *varied], order=1)
        kind: dict[str, Any] = {"fp_type": hy.real, "prec": self.bits}
        if self.bits in _KINDS:
            kind = {"fp_type": _KINDS[self.bits]}
        self._taylor = hy.taylor_adaptive(
            varying, rounded([0.0] * len(states), self.bits), compact_mode=True, **kind
        )  # not compact it takes ten seconds to compile

    def run(
        self, state: Array, constants: Mapping[str, Any], times: Array, most_steps: int = 0
    ) -> Varied:
        """Integrate from a state at time 0.

        Parameters
        ----------
        state : ndarray, shape (n,)
        constants : mapping from str to number
            The constants of the run, by the names of their symbols.
        times : ndarray, shape (k,)
            Times of either sign, in any order [s].
        most_steps : int
            After so many nothing more is reached, forwards and backwards each; 0 is no limit.
        """
        n, p = state.size, len(self.parameters)
        start = np.concatenate((state, rounded(np.eye(n, n + p).ravel(), self.bits)))
        rows = np.empty((times.size, start.size), dtype=state.dtype)
        self._taylor.pars[:] = [constants[name] for name in self._constants]
        back = times < 0
        for side, forwards in ((~back, True), (back, False)):
            if side.any():
                rows[side] = self._one_way(start, np.abs(times[side]), forwards, most_steps)
        by = rows[:, n:].reshape(-1, n, n + p)
        return Varied(rows[:, :n], by[:, :, :n], by[:, :, n:])

    def _one_way(self, start: Array, distances: Array, forwards: bool, most_steps: int) -> Array:
        taylor = self._taylor
        zero, nan = rounded([0.0, np.nan], self.bits)
        taylor.time = zero
        taylor.state[:] = start
        grid = np.union1d(np.array([zero], dtype=start.dtype), distances)
        # a callback, though it does nothing, lets an interrupt through
        reached = taylor.propagate_grid(
            grid if forwards else -grid, max_steps=most_steps, callback=lambda _: True
        )[-1]
        rows = np.full((grid.size, start.size), nan, dtype=start.dtype)
        rows[: len(reached)] = reached
        found: Array = rows[np.searchsorted(grid, distances)]
        return found


def rounded(numbers: Iterable[str | float], bits: int) -> Array:
    """Return the numbers of so many bits that are nearest to doubles, or to decimal texts."""
    if bits in _KINDS:
        return np.array([_KINDS[bits](x) for x in numbers], dtype=_KINDS[bits])
    return np.array([hy.real(x, bits) for x in numbers], dtype=hy.real)


def variational(formulation: Formulation, bits: int) -> Variational:
    """Return the variational equations of a formulation, compiled once per thread."""
    built: dict[Any, Variational] = _OF_THIS_THREAD.__dict__.setdefault("built", {})
    key = (formulation, bits)
    if key not in built:
        built[key] = Variational(*key)
    return built[key]


_KINDS: Mapping[int, Any] = {LONG_DOUBLE: np.longdouble, DOUBLE: float}
_OF_THIS_THREAD = local()
