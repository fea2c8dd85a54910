"""The Taylor integrator as a march: the very blocks of steps that a trajectory is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.integration.integrator import NEVER, Checkpoint, Integrator, Observed
from heavytop.numbers.double_double import Array, DoubleDouble, add

FAR = 1e6  # periods: no step is that long


@dataclass(frozen=True, eq=False)
class TaylorMarch:
    """A compiled formulation on its way from one start.

    Attributes
    ----------
    engine : Integrator
    start : ndarray, shape (n,)
    period : float
        Of the nutation, negative for a run backwards [s].
    """

    engine: Integrator
    start: Array
    period: float

    def begin(self) -> StepperState:
        """Return the start."""
        return StepperState((0.0, 0.0), tuple(self.start.tolist()))

    def block(self, place: StepperState) -> StepperState:
        """Take a block of natural steps, as `Stepper` says."""
        done = self._block(place)
        if done.block.singular or done.block.steps == 0:
            raise IntegrationFailed(f"singular, or overflow, after {done.end.steps} steps")
        return replace(
            place,
            time=done.end.time,
            state=tuple(done.end.state.tolist()),
            steps=done.end.steps,
            evaluations=place.evaluations + done.block.steps,
        )

    def states_at(self, place: StepperState, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times in the block after a place, from its Taylor polynomials."""
        local = [add(t, (-place.time[0], -place.time[1])) for t in times]
        inside = np.array([high + low for high, low in local])
        return self._block(replace(place, time=(0.0, 0.0)), inside).samples.rows

    def output_time(self, t: float) -> DoubleDouble:
        """Return the time itself."""
        return (t, 0.0)

    def _block(self, place: StepperState, samples: Array = NEVER) -> Observed:
        start = Checkpoint(place.time, np.array(place.state), np.nan, place.steps)
        longest = None if place.steps else self._first_steps
        return self.engine.block(start, start.block_steps, self._far, samples, longest)

    @property
    def _far(self) -> float:
        return FAR * self.period

    @cached_property
    def _first_steps(self) -> float | None:
        return self.engine.cautious_step(Checkpoint((0.0, 0.0), self.start, np.nan, 0), self._far)
