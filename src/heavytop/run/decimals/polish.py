"""Events at any number of digits: found on a run's steps, near where the closed form has them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan

import numpy as np

from heavytop.integration.precise import Found, Wanted
from heavytop.numbers import Exact
from heavytop.numbers.decimals import Number
from heavytop.run.decimals.reader import DecimalSample, Values
from heavytop.run.decimals.run import PreciseRun
from heavytop.run.events import Events, ended

HEARD = 64  # events between two words of progress

Expected = Sequence[tuple[str, Number]]  # kinds and times, as `schedule` has them


@dataclass(frozen=True, slots=True)
class Polished:
    """An event: what it is, the motion there, and the event function."""

    kind: str
    sample: DecimalSample
    residual: Number


@dataclass(frozen=True)
class Polisher:
    """Makes events at the digits of a run.

    The closed form says how many there are and where to look. Their times and states, and whether
    they are there at all, is for the run to say: what it does not resolve is none.

    Attributes
    ----------
    run : PreciseRun
    at_poles : mapping from str to Exact
        The limits of phidot at turning points on the vertical itself, as `rates_at_poles` has them.
    """

    run: PreciseRun
    at_poles: Mapping[str, Exact]

    def polished(
        self,
        expected: Expected,
        found: tuple[Found | None, ...],
        digits: int,
        asked: Collection[str],
        progress: Callable[[float], None] | None = None,
    ) -> tuple[Polished, ...]:
        """Return the events, from what was found where `wanted` asked for them."""
        every: list[Polished] = []
        for i, ((kind, _), one) in enumerate(zip(expected, found, strict=True)):
            if one is not None:
                kind = self._blunt(one, digits) or kind if kind == "cusp" else kind
                if kind == "cusp" or "turning" in asked or kind == "reversal":
                    every.append(self.event(kind, one))
            if progress is not None and i % HEARD == 0:
                progress(i / len(found))
        return tuple(sorted(every, key=lambda event: abs(event.sample.t)))

    def event(self, kind: str, found: Found) -> Polished:
        """Return the event of a kind that was found."""
        name = "reversal" if kind == "reversal" else "turning"
        residual = self._number(name, self.run.reader.values(found))
        sample = self.run.reader.sample(found)
        if kind in self.at_poles:
            limit = self.at_poles[kind].mpf(self.run.reader.ctx)
            sample = replace(sample, phidot=limit)
        return Polished(kind, sample, residual)

    def _blunt(self, found: Found, digits: int) -> str:
        """Return what a turning point is that is no cusp to the digits wanted; or nothing.

        At a cusp phidot is zero, and off by no more than theta's digits let it be.
        """
        ctx, values = self.run.reader.ctx, self.run.reader.values(found)
        sample = self.run.reader.sample(found)
        sine, phidot = abs(ctx.sin(sample.theta)), sample.phidot
        level = ctx.mpf(10) ** -digits * 2 * abs(self._number("spin", values))
        if phidot is not None and abs(phidot) * sine <= level:
            return ""
        return "theta_min" if self._number("opening", values) > 0 else "theta_max"

    def _number(self, name: str, values: Values) -> Number:
        return self._functions[name](values)

    @cached_property
    def _functions(self) -> dict[str, Callable[[Values], Number]]:
        form = self.run.reader.form
        turning = form.events["turning"]
        expressions = {
            "turning": turning,
            "reversal": form.events["reversal"],
            "opening": form.flow_derivative(turning),
            "spin": form.spin,
        }
        return {name: self.run.reader.function(x) for name, x in expressions.items()}


def wanted_events(run: PreciseRun, expected: Expected) -> list[Wanted]:
    """Return what to ask a run for: a zero near each event, or the start where that is one."""
    return [run.wanted(t, _function(kind) if t else None) for kind, t in expected]


def _function(kind: str) -> str:
    return "reversal" if kind == "reversal" else "turning"


def rounded_events(
    polished: tuple[Polished, ...], asked: tuple[str, ...], width: int, end: float
) -> Events:
    """Return the events with every number rounded to double, none behind the end of the run."""
    samples = [event.sample for event in polished]
    high = np.array([float(s.t) for s in samples])
    low = np.array([float(s.t - h) for s, h in zip(samples, high.tolist(), strict=True)])
    t, t_low = ended(high, low, end)
    return Events(
        kind=tuple(event.kind for event in polished),
        t=t,
        t_low=t_low,
        theta=np.array([float(s.theta) for s in samples]),
        phi=np.array([_double(s.phi) for s in samples]),
        phidot=np.array([_double(s.phidot) for s in samples]),
        residual=np.array([float(event.residual) for event in polished]),
        axis=_rows([s.axis for s in samples], 3),
        states=_rows([s.states for s in samples], width),
        asked=asked,
    )


def _double(x: Number | None) -> float:
    return nan if x is None else float(x)


def _rows(vectors: list[tuple[Number, ...] | None], width: int) -> np.ndarray:
    rows = [[nan] * width if v is None else [_double(x) for x in v] for v in vectors]
    return np.array(rows, dtype=float).reshape(len(vectors), width)
