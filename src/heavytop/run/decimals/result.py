"""What a run in more than double precision has to say: samples, events, and the cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.integration.orbit import Orbit
from heavytop.integration.quantities import Sample
from heavytop.numbers.decimals import Context, Number
from heavytop.run.decimals.polish import Polished, Polisher, rounded_events, wanted_events
from heavytop.run.decimals.reader import DecimalSample
from heavytop.run.decimals.run import PreciseRun
from heavytop.run.events import Events
from heavytop.run.expected_events import schedule
from heavytop.run.planning import Plan, start_values
from heavytop.run.poles import rates_at_poles
from heavytop.scene.scene import Scene

Array = NDArray[np.float64]
SPARE_DIGITS = 20  # of the times at which events are looked for
WALKED = 0.5  # of what is done, at the end of the steps, where there are events to read


@dataclass(frozen=True, eq=False)
class Decimals:
    """A trajectory at the digits that its scene wants.

    Attributes
    ----------
    digits : int
        Decimal digits wanted.
    run : PreciseRun
    samples : tuple of DecimalSample
        At the sample times of the scene; the last one is the end.
    events : tuple of Polished
        In the order of the run.
    steps : int
        Natural steps.
    integrate_s : float
        Wall-clock time of the integration, with its events polished and its samples read [s].
    """

    digits: int
    run: PreciseRun
    samples: tuple[DecimalSample, ...]
    events: tuple[Polished, ...]
    steps: int
    integrate_s: float

    def at(self, times: Sequence[Number]) -> tuple[DecimalSample, ...]:
        """Return the motion at times between start and end, to all digits.

        Parameters
        ----------
        times : sequence of number
            Times [s], of any kind of number.
        """
        return self.run.at(times)

    @staticmethod
    def rounded(samples: Sequence[DecimalSample]) -> Sample:
        """Return the motion at several times, every number rounded to double.

        Parameters
        ----------
        samples : sequence of DecimalSample
            As `at` returns them.
        """

        def column(name: str) -> Array:
            return np.array([_double(getattr(s, name)) for s in samples])

        def rows(name: str, width: int) -> Array:
            vectors = [getattr(s, name) or (None,) * width for s in samples]
            return np.array([[_double(x) for x in v] for v in vectors]).reshape(-1, width)

        scalars = ("t", "theta", "phi", "psi", "thetadot", "phidot", "psidot")
        return Sample(
            **{name: column(name) for name in scalars},
            axis=rows("axis", 3),
            omega=rows("omega", 3),
            quaternion=rows("quaternion", 4),
            states=rows("states", len(samples[0].states) if samples else 0),
        )

    def text(self, x: Number | None) -> str | None:
        """Return a number with the digits that are wanted, or None.

        Parameters
        ----------
        x : number or None
            One of a DecimalSample, in its own unit.
        """
        return None if x is None else str(self.run.reader.ctx.nstr(x, self.digits))


def in_decimals(
    scene: Scene,
    motion: Motion,
    chosen: Plan,
    orbit: Orbit,
    before: Decimals | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Decimals, Events]:
    """Integrate a scene in the precision of its plan, and return its events rounded to double.

    Parameters
    ----------
    scene : Scene
    motion : Motion
    chosen : Plan
    orbit : Orbit
        The run in double precision.
    before : Decimals, optional
        What the run is a continuation of, with the first of its sample times.
    progress : callable, optional
        Called with the fraction done.
    """
    run = PreciseRun.of(chosen, start_values(scene), orbit)
    began = time.perf_counter()
    times = _sample_times(scene, motion, run.reader.ctx, before)
    expected = schedule(motion, times[-1], scene.events, scene.digits + SPARE_DIGITS)
    wanted = [run.wanted(t) for t in times] + wanted_events(run, expected)
    walked = WALKED if expected else 1.0
    walk = run.walk(wanted, progress and (lambda t: progress(walked * t / orbit.end)))
    run = PreciseRun(run.reader, run.engine, orbit, run.far, run.longest, walk.marks)
    polisher = Polisher(run, rates_at_poles(motion))
    heard = progress and (lambda done: progress(walked + (1 - walked) * done))
    seen = walk.found[len(times) :]
    polished = polisher.polished(expected, seen, scene.digits, scene.events, heard)
    samples = tuple(run.reader.sample(one) for one in walk.found[: len(times)] if one is not None)
    decimals = Decimals(
        digits=scene.digits,
        run=run,
        samples=samples,
        events=polished,
        steps=walk.steps,
        integrate_s=time.perf_counter() - began,
    )
    width = len(samples[0].states)
    return decimals, rounded_events(polished, scene.events, width, orbit.end)


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


def _double(x: Number | None) -> float:
    return nan if x is None else float(x)
