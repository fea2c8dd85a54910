"""A formulation as heyoka compiles it, in its own units or with its rates in another one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.integration.bits import DOUBLE
from heavytop.integration.engine import Hits
from heavytop.integration.equations import Equations

Array = NDArray[np.float64]


@dataclass(eq=False)
class Compiled:
    """A compiled formulation; parameters are loaded, never compiled in.

    Parameters
    ----------
    formulation : Formulation
    events : tuple of str
    tolerance : float
        Relative error tolerance of a step.
    scaled : bool
        Whether its rates have a unit of their own.

    Attributes
    ----------
    taylor : heyoka's integrator
    own : ndarray, shape (n,)
        The integrator's state, in its units; looked up once: short runs feel it.
    units : ndarray, shape (n,)
        Of the states, powers of two.
    """

    formulation: Formulation
    events: tuple[str, ...]
    tolerance: float
    scaled: bool = False
    taylor: Any = field(init=False, repr=False)
    own: Array = field(init=False, repr=False)
    units: Array = field(init=False, repr=False)
    _unit: float = field(init=False, default=1.0)
    _parameters: tuple[str, ...] = field(init=False)
    _sinks: tuple[_Sink, ...] = field(init=False)

    def __post_init__(self) -> None:
        found = Equations.of(self.formulation, DOUBLE, self.events, scaled=self.scaled)
        self._parameters = found.loaded
        self._sinks = tuple(_Sink() for _ in found.zeros)
        self.taylor = hy.taylor_adaptive(
            list(zip(found.states, found.derivatives, strict=True)),
            [0.0] * len(found.states),
            pars=[0.0] * len(found.loaded) + [1.0, 1.0] * self.scaled,
            tol=self.tolerance,
            nt_events=[
                hy.nt_event(zero, sink.recorder())
                for zero, sink in zip(found.zeros, self._sinks, strict=True)
            ],
        )
        self.own, self.units = self.taylor.state, np.ones(len(found.states))

    def load(self, parameters: Mapping[str, float]) -> None:
        """Load the constants of a run, by the names of their symbols."""
        count = len(self._parameters)
        self.taylor.pars[:count] = [parameters[name] for name in self._parameters]

    def begin(self, state: Array) -> None:
        """Stand at a state, at time 0."""
        self.taylor.time = 0.0
        self.own[:] = state

    def begin_in(self, unit: float, state: Array) -> None:
        """Stand at a state with rates in a unit [rad/s], at time 0."""
        if unit != self._unit:
            self._measured_in(unit)
        self.begin(state / self.units)

    def forget(self) -> None:
        """Forget the zeros of event functions."""
        for sink in self._sinks:
            sink.clear()

    @property
    def echoes(self) -> bool:
        """Whether a zero at the very start was found twice."""
        return any(sink.t.count(0.0) > 1 for sink in self._sinks)

    def true(self, rows: Array) -> Array:
        """Return states, shape (..., n), in the formulation's own units."""
        return rows * self.units if self.scaled else rows

    def hits(self) -> tuple[Hits, ...]:
        """Return the zeros of event functions met since they were forgotten."""
        width = self.own.size
        found = (sink.hits(width) for sink in self._sinks)
        return tuple([Hits(h.t, h.t_low, self.true(h.states)) for h in found])

    def _measured_in(self, unit: float) -> None:
        self._unit = unit
        rates = set(self.formulation.rates)
        self.units = np.array([unit if s in rates else 1.0 for s in self.formulation.states])
        self.taylor.pars[-2:] = unit, 1 / unit


class _Sink:
    """Collects the zeros of one event function; the callback must be cheap."""

    def __init__(self) -> None:
        self.t: list[float] = []
        self.states: list[bytes] = []

    def clear(self) -> None:
        self.t.clear()
        self.states.clear()

    def recorder(self) -> Any:
        # heyoka copies callbacks deeply, but a function keeps what it closes over
        mark, keep = self.t.append, self.states.append

        def record(taylor: Any, t: float, _sign: int) -> None:
            taylor.update_d_output(t)
            mark(t)
            keep(taylor.d_output.tobytes())

        return record

    def hits(self, width: int) -> Hits:
        states = np.frombuffer(b"".join(self.states)).reshape(-1, width)
        t = np.array(self.t, dtype=float)
        return Hits(t, np.zeros_like(t), states)
