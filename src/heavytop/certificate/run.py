"""A run in doubles: the numbers that it was integrated from, and its steps, repeated."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from heavytop.certificate.flow import Flow
from heavytop.certificate.steps import Steps
from heavytop.certificate.system import CERTIFIED
from heavytop.equations.formulation import Formulation
from heavytop.equations.registry import FORMULATIONS
from heavytop.exact.pairs import UNIT, Array, add
from heavytop.integration.engine import engine
from heavytop.integration.orbit import Checkpoint, Integrator, Polynomials


@dataclass(frozen=True, kw_only=True)
class BinaryRun:
    """All numbers that a run in doubles depends on: they determine its bits.

    Attributes
    ----------
    formulation : str
    variant : str or None
        The variant of the formulation; quadratures that it adds are not certified.
    watched : tuple of str
        Event functions that the integrator evaluates.
    tolerance : float
    projected : bool
    constants : mapping from str to float
    start : tuple of float
        The state at time 0.
    end : float
        The last time [s].
    block : float
        The length of the longest block of steps [s].
    period : float or None
        The approximate period of its exact motion [s]; the exact one is proved.
    """

    formulation: str
    variant: str | None
    watched: Sequence[str]
    tolerance: float
    projected: bool
    constants: Mapping[str, float]
    start: Sequence[float]
    end: float
    block: float
    period: float | None

    @property
    def core(self) -> Formulation:
        """The formulation whose right-hand sides are quadratic: without angles and quadratures."""
        return FORMULATIONS[self.formulation].build(None)

    @cached_property
    def integrator(self) -> Integrator:
        """The integrator of its steps."""
        form = FORMULATIONS[self.formulation].build(self.variant)
        equations, start = engine(form, tuple(self.watched), self.tolerance), np.array(self.start)
        return Integrator(equations, self.constants, start, projected=self.projected)

    def flow(self) -> Flow:
        """Return the exact motion of the same numbers."""
        own, core = self.integrator, self.core
        start = np.array(self.start[: len(core.states)]) / np.where(core.is_rate, own.pace, 1.0)
        end, period = self.end * own.pace, None
        if self.period is not None and not 0 <= self.end <= self.period:  # else all is tabulated
            period = self.period * own.pace
        return Flow(core, own.scaled_constants, start.tolist(), end, period)

    def steps(self, start: Checkpoint, count: int) -> tuple[Steps, Checkpoint]:
        """Take some steps of the run again, and return them with the checkpoint after them.

        The last step is cut at the end of the run; steps that would begin later are left out.
        """
        own = self.integrator
        kept, end = own.polynomials(start, count, 4.0 * self.end)
        high, low = (np.full(kept.length.size, word * own.pace) for word in start.time)
        label = add((high, low), (kept.begun[:, 0], kept.begun[:, 1]))
        forward, last = math.copysign(1.0, self.end), abs(self.end * own.pace)
        # a little more, as this difference is rounded
        left = np.maximum(last - forward * label[0] + 4 * UNIT * last, 0.0)
        length = forward * np.minimum(np.abs(kept.length), left)
        clock = _time_error(start, kept, own.pace, self.block * own.pace)
        states = kept.coefficients[:, : len(self.core.states)].transpose(2, 1, 0)
        read = CERTIFIED[self.formulation].read
        steps = Steps.of(np.ascontiguousarray(states), label, length, clock, read)
        return steps.where(slice(np.count_nonzero(length))), end

    def ends_elsewhere(self, steps: Steps, state: Array) -> bool:
        """Return whether the last steps do not lead to this state at the end of the run."""
        last, i = abs(self.end * self.integrator.pace), steps.length.size - 1
        if i < 0 or not abs(steps.begun[i] + steps.length[i]) >= last:
            return True
        (high, low), more, plain = steps.at(np.array([i]), steps.length[[i]])
        off = (more + plain)[:, 0] + (2 * steps.clock[i] + 16 * UNIT * last) * steps.speed[i]
        near = np.abs((high + low)[:, 0] - state) <= 2 * off
        # the states that outputs read have a bound of their speed, and no unit
        return not bool(near[: CERTIFIED[self.formulation].read].all())


def _time_error(start: Checkpoint, kept: Polynomials, pace: float, block: float) -> Array:
    """Return for each step a bound of the error of the time at which its polynomial is evaluated.

    A time is measured from the start of its block, then from the start of its leg, then from its
    step; each difference of doubles is rounded, except differences with zero, and of two numbers
    within a factor of two (Sterbenz). A time that is before the first step of a block, or of a leg,
    only by rounding, becomes its beginning: the rounded time was after the end of the block before.
    `block` is the length of the longest block.
    """
    since = np.abs(kept.begun[:, 0] + kept.length)
    leg = np.abs(kept.begun[:, 0] - kept.restarted) + np.abs(kept.length)
    begun = abs(start.time[0]) * pace
    first = 0.0 if start.time == (0.0, 0.0) else np.where(since < begun, 1.0, 2.0)
    second = np.where(kept.restarted == 0, 0.0, np.where(leg < np.abs(kept.restarted), 1.0, 2.0))
    off = UNIT * (first * since + second * leg + 2 * np.abs(kept.length))
    off[:1] += 0.0 if start.time == (0.0, 0.0) else 4 * UNIT * block
    off += 4 * UNIT * np.abs(np.diff(kept.restarted, prepend=0.0))  # 0 except where a leg begins
    return np.asarray(off * (1 + 1e-9))


def binary_run(trajectory: Any, period: float | None) -> BinaryRun:
    """Return the numbers of a trajectory in doubles; `period` is the approximate one."""
    chosen, orbit = trajectory.plan, trajectory.orbit
    width = len(orbit.integrator.formulation.states)
    begun = [*(checkpoint.time[0] for checkpoint in orbit.checkpoints), orbit.end]
    return BinaryRun(
        formulation=chosen.formulation,
        variant=chosen.variant,
        watched=chosen.watched,
        tolerance=orbit.integrator.engine.tolerance,
        projected=orbit.integrator.projection is not None,
        constants=dict(orbit.parameters),
        start=tuple(orbit.checkpoints[0].state[:width].tolist()),
        end=float(orbit.end),
        block=float(np.max(np.abs(np.diff(begun)))),
        period=period,
    )
