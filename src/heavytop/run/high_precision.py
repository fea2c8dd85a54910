"""A run in more than double precision, beside one in doubles: samples and events."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from heavytop.alone import Alone
from heavytop.analytic.motion import Motion
from heavytop.equations.formulation import Formulation
from heavytop.integration import outputs
from heavytop.integration.bits import bits_of, digits_of
from heavytop.integration.high_precision import Mark, PreciseIntegrator
from heavytop.integration.integrator import Orbit
from heavytop.integration.outputs import VECTORS, Sample
from heavytop.integration.turns import GRAIN_BITS, in_bits
from heavytop.numbers.decimals import Context, Number, context, number
from heavytop.run.events import Event, Events, precise_events, schedule
from heavytop.run.planning import Plan, rounded_start, start_values
from heavytop.scene.scene import Scene

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

SPARE_IN_TIME = 20  # digits of the times at which events are looked for


@dataclass(frozen=True, eq=False)
class Decimals:
    """A run in more than double precision, which can be asked for the motion at any time.

    Attributes
    ----------
    digits : int
        Decimal digits wanted.
    form : Formulation
        The equations.
    engine : PreciseIntegrator
        What takes the steps.
    ctx : Context
        Of more digits than the states.
    far, longest : float, float or None
        Bounds of a step, and of the first ones [s].
    marks : tuple of Mark
        States from which it can go on.
    samples : tuple of Sample
        At the sample times of the scene, in mpmath numbers; the last one is the end.
    events : tuple of Event
        In the order of the run, each with its ``kind``, the ``sample`` there and the ``residual``.
    """

    digits: int
    form: Formulation
    engine: PreciseIntegrator
    ctx: Context
    far: float
    longest: float | None
    marks: tuple[Mark, ...]
    samples: tuple[Sample, ...] = ()
    events: tuple[Event, ...] = ()
    _alone: Alone = field(default_factory=Alone, repr=False)

    @classmethod
    def of(cls, scene: Scene, chosen: Plan, orbit: Orbit) -> Decimals:
        """Return the start of the run of a scene's plan; `orbit` is that in doubles."""
        form, bits = chosen.equations, bits_of(chosen.precision)
        ctx = context(digits_of(bits))
        constants, state = rounded_start(form, start_values(scene), ctx)
        constants |= {name: ctx.nstr(ctx.mpf(rate), ctx.dps) for name, rate in chosen.frame}
        own = form.integrated or form
        state = state[: len(own.states)]
        events = tuple(form.events) if chosen.watched else ()
        engine = PreciseIntegrator(own, bits, constants, events, state)
        first = orbit.checkpoints[0]
        far = 4.0 * (orbit.end - first.time[0])
        longest = orbit.integrator.for_this_thread().cautious_step(first, far)
        turns, angles = orbit.integrator.turns, tuple(first.state[len(own.states) :].tolist())
        engine.turns = turns and in_bits(turns, bits)
        start = replace(engine.start(state), turned=angles)
        return cls(scene.digits, form, engine, ctx, far, longest, (start,))

    @cached_property
    def constants(self) -> dict[str, Any]:
        """The constants of the run as they are used, by symbol name, as reals of `ctx`."""
        return self.engine.constants(self.ctx.prec)

    @property
    def parameters(self) -> dict[str, Number]:
        """The same, as numbers of `ctx`."""
        return {name: self.ctx.mpf(str(x)) for name, x in self.constants.items()}

    @property
    def grain(self) -> Number:
        """How well a state is known, once it may have drifted."""
        return self.ctx.ldexp(1, GRAIN_BITS - self.engine.bits)

    def walk(
        self,
        wanted: Sequence[tuple[Number, str | None]],
        on_mark: Callable[[float], None] | None = None,
        first: int = 0,
    ) -> tuple[tuple[Mark | None, ...], tuple[Mark, ...]]:
        """Take natural steps from a mark, the start for one, until everything wanted is found.

        That is the motion at times, or at zeros of event functions close to them.
        """
        ctx = self.ctx
        texts = [(ctx.nstr(ctx.mpf(t), ctx.dps), event) for t, event in wanted]
        with self._alone:
            return self.engine.walk(self.marks[first], texts, self.far, self.longest, on_mark)

    def at(self, times: Sequence[Number]) -> tuple[Sample, ...]:
        """Return the motion at times between start and end, to all digits.

        Parameters
        ----------
        times : sequence of number
            Times [s], of any kind of number, in any order.
        """
        known = [abs(float(mark.t)) for mark in self.marks]
        before = [max(bisect_left(known, abs(float(t))) - 1, 0) for t in times]
        found: dict[int, Any] = {}
        for first in set(before):
            here = [i for i, mark in enumerate(before) if mark == first]
            seen, _ = self.walk([(times[i], None) for i in here], first=first)
            found |= zip(here, seen, strict=True)
        return self.numbers(self.sampled([found[i] for i in range(len(times))]))

    def sampled(self, found: Sequence[Mark]) -> Sample:
        """Return the motion at states of the run, in reals."""
        return self.engine.sample(self.form, found, self.ctx.prec)

    def numbers(self, sample: Sample) -> tuple[Sample, ...]:
        """Return a sample in reals one by one, in numbers of `ctx`."""
        converted = np.frompyfunc(lambda x: self.ctx.mpf(str(x)), 1, 1)
        columns = (converted(getattr(sample, name)).tolist() for name in Sample.__slots__)
        return tuple(Sample(*row) for row in zip(*columns, strict=True))

    def invariants(self, sample: Sample) -> dict[str, Number]:
        """Return the invariants of the formulation at a sample, by name."""
        rows = np.array([[self.real(x) for x in sample.states]])
        found = outputs.invariants(self.form, rows, self.constants, rows[:, 0])
        return {name: self.ctx.mpf(str(x)) for name, (x,) in found.items()}

    def real(self, x: Any) -> Any:
        """Return the real of a number of any kind."""
        return self.engine.wide(self.whole(x))

    def whole(self, x: Any) -> str:
        """Return a text by which every bit comes back."""
        return str(self.ctx.nstr(number(self.ctx, x), self.ctx.dps + 3))

    def rounded(self, samples: Sequence[Sample]) -> Sample:
        """Return the motion at several times, every number rounded to double.

        Parameters
        ----------
        samples : sequence of Sample
            As `at` returns them.
        """
        widths = {name: len(indices) for name, indices in VECTORS.items()}
        widths["states"] = len(self.samples[0].states)

        def column(name: str) -> Any:
            values = np.array([getattr(s, name) for s in samples], dtype=np.float64)
            return values.reshape(-1, widths[name]) if name in widths else values

        return Sample(*map(column, Sample.__slots__))

    def text(self, x: Number) -> str | None:
        """Return a number with the digits that are wanted; None for nan.

        Parameters
        ----------
        x : number
            One of a Sample, in its own unit.
        """
        return None if x != x else str(self.ctx.nstr(x, self.digits))


def in_decimals(
    trajectory: Trajectory,
    before: Decimals | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Decimals, Events]:
    """Integrate a scene in the precision of its plan, and return its events rounded to double.

    Parameters
    ----------
    trajectory : Trajectory
        In double precision.
    before : Decimals, optional
        What the run is a continuation of, with the first of its sample times.
    progress : callable, optional
        Called with the fraction done.
    """
    scene, motion, orbit = trajectory.scene, trajectory.motion, trajectory.orbit
    run = Decimals.of(scene, trajectory.plan, orbit)
    times = _sample_times(scene, motion, run.ctx, before)
    expected = schedule(motion, times[-1], scene.events, scene.digits + SPARE_IN_TIME)
    wanted: list[tuple[Number, str | None]] = [(t, None) for t in times]
    for kind, t in expected:  # a zero near each event, or the start where that is one
        event = "reversal" if kind == "reversal" else "turning"
        wanted.append((t, event if t else None))
    found, marks = run.walk(wanted, progress and (lambda t: progress(t / orbit.end)))
    seen = [one for one in found[: len(times)] if one is not None]
    kinds, met = [kind for kind, _ in expected], found[len(times) :]
    events, rounded = precise_events(scene, motion, run, kinds, met, orbit.end)
    samples = run.numbers(run.sampled(seen))
    return replace(run, marks=marks, samples=samples, events=events), rounded


def _sample_times(
    scene: Scene, motion: Motion, ctx: Context, before: Decimals | None
) -> list[Number]:
    """Return the times of the samples: evenly from zero, or from the old end, to the exact end."""
    if scene.time is not None:
        end = scene.time.mpf(ctx)
    else:
        assert scene.periods is not None
        end = scene.periods.mpf(ctx) * ctx.mpf(motion.form(ctx.dps).period)
    old = [ctx.zero] if before is None else [ctx.mpf(s.t) for s in before.samples]
    count = scene.samples - len(old)
    return old + [old[-1] + (end - old[-1]) * k / count for k in range(1, count + 1)]
