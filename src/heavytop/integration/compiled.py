"""A formulation as heyoka compiles it, in its own units or with its rates in another one.

heyoka holds the error of a step against one number, the largest state. An axis is of the size of
one whatever the top does; the angular momentum beside it may be a million times as large, or as
small, and then one of the two is held to few digits, unseen. So the same equations are had in
another way: with rates in a unit of theirs, a power of two that is loaded like a constant,

    x = s y,    dy/dt = f(s y) / s.

Products with powers of two are exact, in every coefficient of a series as well. So nothing changes
but the largest state, and with it the length of a step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Self

import heyoka as hy
import numpy as np
from numpy.typing import NDArray

from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import evaluated
from heavytop.integration.bits import DOUBLE
from heavytop.integration.engine import Hits

Array = NDArray[np.float64]

MOST_CACHED = 256 * 2**20  # bytes of compiled code that heyoka keeps on disk: some hundred programs
_HEYOKAS_OWN = 20 * 2**30  # its limit where nobody has set one
_FUNCTIONS = {name: getattr(hy, name) for name in ("sin", "cos", "sqrt", "exp", "log")}

hy.set_logger_level_critical()  # heyoka logs to stdout, which belongs to the results
with suppress(RuntimeError):  # its folder cannot be made: heyoka works without
    if hy.llvm_state.get_diskcache_limit() == _HEYOKAS_OWN:
        hy.llvm_state.set_diskcache_limit(MOST_CACHED)


def translated(
    expressions: Sequence[Any], names: Mapping[str, Any], bits: int = DOUBLE
) -> list[Any]:
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
    UntranslatableExpression
        A symbol without a name, or a function or number without a counterpart.

    Examples
    --------
    >>> import sympy as sp
    >>> translated([sp.Symbol("x") / 3 + sp.sqrt(2)], {"x": hy.expression("x")})
    [(1.4142135623730951 + (0.33333333333333331 * x))]
    """

    def number(integer: int) -> Any:
        return hy.expression(float(integer) if bits == DOUBLE else hy.real(integer, bits))

    return evaluated(expressions, names, number, _FUNCTIONS)


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """First-order equations as heyoka takes them, every constant in them of some precision.

    Attributes
    ----------
    equations : list of pairs of heyoka expressions
        The states, each with its time derivative.
    loaded : tuple of str
        Constants of a run, by symbol name: ``par[0]``, ``par[1]``, ... After them a scaled
        formulation has the unit of its rates and its reciprocal.
    zeros : list of heyoka expressions
        Event functions; scaled ones in that unit too: heyoka holds the error against their values.
    """

    equations: list[tuple[Any, Any]]
    loaded: tuple[str, ...]
    zeros: list[Any] = field(default_factory=list)

    @classmethod
    def of(
        cls, form: Formulation, bits: int, events: tuple[str, ...] = (), *, scaled: bool = False
    ) -> Self:
        """Return that of a formulation and of its events, for numbers of so many bits."""
        watched = [form.events[name] for name in events]
        loaded = form.constants_in((*form.derivatives, *watched))
        unit, reciprocal = (hy.par[len(loaded) + i] for i in range(2))
        rates = set(form.rates) if scaled else set()
        states = {s: hy.expression(s.name) for s in form.states}
        names = {s.name: unit * y if s in rates else y for s, y in states.items()}
        names |= {p.name: hy.par[i] for i, p in enumerate(loaded)}
        derivatives = zip(states.items(), translated(form.derivatives, names, bits), strict=True)
        zeros = translated(watched, names, bits)
        return cls(
            [(y, reciprocal * f if s in rates else f) for (s, y), f in derivatives],
            tuple(p.name for p in loaded),
            [reciprocal * zero for zero in zeros] if scaled else zeros,
        )

    @classmethod
    def of_attitude(cls, bits: int) -> Self:
        """Return that of the attitude form, written out: deriving it takes a tenth of a second.

        dq/dt = l q / 2 and dl/dt = g (-e_y, e_x, 0), with e = q z q*.
        """
        states = hy.make_vars("q_0", "q_1", "q_2", "q_3", "l_x", "l_y")
        q_0, q_1, q_2, q_3, l_x, l_y = states
        g, l_z = hy.par[0], hy.par[1]
        half, two = (hy.expression(hy.real(text, bits)) for text in ("0.5", "2"))
        x, y, z = half * l_x, half * l_y, half * l_z
        derivatives = (
            -(x * q_1) - y * q_2 - z * q_3,
            x * q_0 + y * q_3 - z * q_2,
            y * q_0 + z * q_1 - x * q_3,
            x * q_2 + z * q_0 - y * q_1,
            -(g * (two * q_2 * q_3 - two * q_0 * q_1)),
            g * (two * q_0 * q_2 + two * q_1 * q_3),
        )
        return cls(list(zip(states, derivatives, strict=True)), ("g", "l_z"))


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
        found = System.of(self.formulation, DOUBLE, self.events, scaled=self.scaled)
        self._parameters = found.loaded
        self._sinks = tuple(_Sink() for _ in found.zeros)
        self.taylor = hy.taylor_adaptive(
            found.equations,
            [0.0] * len(found.equations),
            pars=[0.0] * len(found.loaded) + [1.0, 1.0] * self.scaled,
            tol=self.tolerance,
            nt_events=[
                hy.nt_event(zero, sink.recorder())
                for zero, sink in zip(found.zeros, self._sinks, strict=True)
            ],
        )
        self.own, self.units = self.taylor.state, np.ones(len(found.equations))

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
