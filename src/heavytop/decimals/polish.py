"""Events at any number of digits: those of the run in doubles, polished, and judged anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan, sqrt

import numpy as np

from heavytop.decimals.reader import DecimalSample, Values
from heavytop.decimals.run import PreciseRun
from heavytop.events import CUSP_LEVEL, Events, ended
from heavytop.exact import Exact
from heavytop.taylor.precise import Found, Wanted
from heavytop.theory.precision import Number

HEARD = 64  # events between two words of progress


@dataclass(frozen=True, slots=True)
class Polished:
    """An event: what it is, the motion there, and the event function."""

    kind: str
    sample: DecimalSample
    residual: Number


@dataclass(frozen=True)
class Polisher:
    """Makes events at the digits of a run from those in doubles.

    A cusp in doubles may turn out to be none: phidot there is small, but not zero. Where its sign
    is the other one, a pair of reversals lies beside it, closer than doubles could tell.

    Attributes
    ----------
    run : PreciseRun
    events : Events
        In doubles.
    steps : int
        Taken by the run.
    at_poles : mapping from str to Exact
        The limits of phidot at turning points on the vertical itself, as `rates_at_poles` has them.
    """

    run: PreciseRun
    events: Events
    steps: int
    at_poles: Mapping[str, Exact]

    def polished(
        self, found: tuple[Found | None, ...], progress: Callable[[float], None] | None = None
    ) -> tuple[Polished, ...]:
        """Return the events, from what was found where `wanted` asked for them."""
        every: list[Polished] = []
        for i, (kind, one) in enumerate(zip(self.events.kind, found, strict=True)):
            if one is not None:
                every += self._events(kind, one)
            if progress is not None and i % HEARD == 0:
                progress(i / len(found))
        return tuple(sorted(every, key=lambda event: abs(event.sample.t)))

    def as_it_is(self, kind: str, found: Found) -> Polished:
        """Return an event where it was found, without judging it anew."""
        name = "reversal" if kind == "reversal" else "turning"
        residual = self._number(name, self.run.reader.values(found))
        sample = self.run.reader.sample(found)
        if kind in self.at_poles:
            limit = self.at_poles[kind].mpf(self.run.reader.ctx)
            sample = replace(sample, phidot=limit)
        return Polished(kind, sample, residual)

    def _events(self, kind: str, found: Found) -> Iterator[Polished]:
        sample = self.run.reader.sample(found)
        values = self.run.reader.values(found)
        if kind == "reversal":
            yield self.as_it_is(kind, found)
            return
        judged = self._turning(sample, values)
        asked = set(self.events.asked)
        if "turning" in asked or (judged == "cusp" and "cusp" in asked):
            yield self.as_it_is(judged, found)
        if kind == "cusp" and judged != "cusp" and "reversal" in asked:
            for one in self.run.found(list(self._beside(sample.t, values))):
                if one is not None:
                    yield self.as_it_is("reversal", one)

    def _turning(self, sample: DecimalSample, values: Values) -> str:
        """Return the kind of a turning point; a cusp as `events.judged` has it."""
        ctx, b = self.run.reader.ctx, abs(self._number("spin", values))
        sine, phidot = abs(ctx.sin(sample.theta)), sample.phidot
        if sine and phidot is not None:
            noise = ctx.ldexp(abs(phidot) + 2 * b / sine, 1 - self.run.engine.bits)
            level = CUSP_LEVEL * sqrt(1.0 + self.steps)
            if noise < b / 10**6 and abs(phidot) <= level * noise:
                return "cusp"
        return "theta_min" if self._number("opening", values) > 0 else "theta_max"

    def _beside(self, t: Number, values: Values) -> Iterator[Wanted]:
        """Return where the zeros of phidot lie, if any, to second order about a turning point."""
        here, bend = self._number("reversal", values), self._number("bend", values)
        if here * bend < 0:
            apart = self.run.reader.ctx.sqrt(-2 * here / bend)
            beside = (t + side * apart for side in (-1, 1))
            end = self.run.orbit.end
            within = (x for x in beside if 0 <= x * (1 if end > 0 else -1) <= abs(end))
            yield from (self.run.wanted(x, "reversal") for x in within)

    def _number(self, name: str, values: Values) -> Number:
        return self._functions[name](values)

    @cached_property
    def _functions(self) -> dict[str, Callable[[Values], Number]]:
        form = self.run.reader.form
        turning, reversal = form.events["turning"], form.events["reversal"]
        expressions = {
            "turning": turning,
            "reversal": reversal,
            "opening": form.flow_derivative(turning),
            "bend": form.flow_derivative(form.flow_derivative(reversal)),
            "spin": form.spin,
        }
        return {name: self.run.reader.function(x) for name, x in expressions.items()}


def wanted_events(run: PreciseRun, events: Events) -> list[Wanted]:
    """Return what to ask a run for: a zero near each event, or the start where that is one."""
    return [
        run.wanted(t + run.reader.ctx.mpf(low), _function(kind) if t else None)
        for kind, t, low in zip(events.kind, events.t.tolist(), events.t_low.tolist(), strict=True)
    ]


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
