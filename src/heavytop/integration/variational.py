"""The variational equations: how a motion changes with its start and with its parameters.

Beside the states y, with dy/dt = f(y, p), heyoka integrates their derivatives by the states at
the start and by the parameters, which it has by differentiating f:

    d/dt dy/dy(0) = (df/dy) dy/dy(0),    d/dt dy/dp = (df/dy) dy/dp + df/dp.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from threading import get_ident
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.integration.bits import DOUBLE, LONG_DOUBLE
from heavytop.integration.compiled import System

Array = NDArray[np.float64]  # or of numbers of other bits

_KINDS: Mapping[int, Any] = {LONG_DOUBLE: np.longdouble, DOUBLE: float}


@dataclass(frozen=True, slots=True, eq=False)
class VariedRun:
    """A run in numbers of some bits: its constants by name, and the state at its start."""

    formulation: Formulation
    constants: Mapping[str, Any]
    state: Array
    bits: int = DOUBLE

    @property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that stand in the equations, by which they are varied."""
        return _compiled(self.formulation, self.bits, get_ident())[1]

    def __call__(self, times: Iterable[str | float], most_steps: int = 0) -> Array:
        """The run at k times since its start [s], of either sign, in any order.

        They make an array of shape (k, n, 1 + n + p): the n states, their derivatives by the states
        at the start, and those by p parameters. It is nan at times that are not reached: before
        them the equations become singular, or more steps were needed, each way; 0 is no limit.
        """
        form, bits, n = self.formulation, self.bits, self.state.size
        taylor, parameters, loaded = _compiled(form, bits, get_ident())
        moments, (zero, nan) = rounded(times, bits), rounded([0.0, np.nan], bits)
        unit = rounded(np.eye(n, n + len(parameters)).ravel(), bits)
        rows = np.full((moments.size, n + unit.size), nan)
        taylor.pars[:] = [self.constants[name] for name in loaded]
        for back in (False, True):
            side = np.flatnonzero((moments < 0) == back)
            grid = np.union1d(rounded([0.0], bits), abs(moments[side]))
            taylor.time, taylor.state[:] = zero, np.concatenate((self.state, unit))
            # a callback, though it does nothing, lets an interrupt through
            reached = taylor.propagate_grid(
                -grid if back else grid, max_steps=most_steps, callback=lambda _: True
            )[-1]
            place = np.searchsorted(grid, abs(moments[side]))
            there = place < len(reached)
            rows[side[there]] = reached[place[there]]
        if not form.starts_at_pole:  # theta, its first state, may have left its chart
            theta = rows[:, 0].astype(np.float64)
            rows[~((theta >= 0) & (theta <= np.pi))] = nan
        states, by = rows[:, :n, None], rows[:, n:].reshape(-1, n, unit.size // n)
        return np.concatenate((states, by), axis=2)


def rounded(numbers: Iterable[str | float], bits: int) -> Array:
    """The numbers of so many bits that are nearest to doubles, or to decimal texts."""
    if bits in _KINDS:
        return np.array([_KINDS[bits](x) for x in numbers], dtype=_KINDS[bits])
    return np.array([hy.real(x, bits) for x in numbers], dtype=hy.real)


@cache
def _compiled(form: Formulation, bits: int, _thread: int) -> tuple[Any, tuple[str, ...], list[str]]:
    """The integrator of a thread, the parameters that it varies by, and all constants it loads.

    Its tolerance is the last place of its numbers, relative to the largest of states and
    derivatives.
    """
    system = System.of(form, bits)
    free = {p.name for p in form.given}
    by = {name: hy.par[i] for i, name in enumerate(system.loaded) if name not in free}
    states = [state for state, _ in system.equations]
    varying = hy.var_ode_sys(system.equations, [*states, *by.values()], order=1)
    kind = {"fp_type": _KINDS[bits]} if bits in _KINDS else {"fp_type": hy.real, "prec": bits}
    start = rounded([0.0] * len(states), bits)
    # not compact it takes ten seconds to compile
    taylor = hy.taylor_adaptive(varying, start, compact_mode=True, **kind)
    return taylor, tuple(by), list(system.loaded)
