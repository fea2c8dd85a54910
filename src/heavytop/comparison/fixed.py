"""Marches of fixed step in the axis form: time after j steps is exactly h j."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from heavytop.comparison.kernel import Kernel
from heavytop.comparison.march import Array, Place, Stopped
from heavytop.numbers.double_double import DoubleDouble, two_product


@dataclass(frozen=True, slots=True, eq=False)
class FixedStep:
    """A march of equal steps.

    Attributes
    ----------
    start : tuple of float
        The states e_x, e_y, e_z, l_x, l_y at the start.
    g, l_z : float
        The parameters of the axis form.
    h : float
        The step [s], negative backwards.
    kernel : callable
        What takes the steps.
    table : ndarray
        The method's coefficients times h.
    carried, scratch : int
        Words that go from block to block, and words that only go from step to step.
    forces : int
        Evaluations a step, or 0 where the kernel counts them.
    steps : int
        Steps in a block.
    compile_s : float
        What compiling took [s]; 0 where it was done before.
    """

    start: tuple[float, ...]
    g: float
    l_z: float
    h: float
    kernel: Kernel
    table: Array
    carried: int
    scratch: int
    forces: int
    steps: int
    compile_s: float

    def begin(self) -> Place:
        """Return the place at the start, time 0."""
        return Place((0.0, 0.0), self.start, (0.0,) * self.carried)

    def block(self, place: Place) -> Place:
        """Take a block of steps."""
        state, work = self._taken_up(place)
        evaluations = self._advance(state, work, self.steps)
        steps = place.steps + self.steps
        return Place(
            time=two_product(self.h, float(steps)),
            state=tuple(state.tolist()),
            carry=tuple(work[: self.carried].tolist()),
            steps=steps,
            evaluations=place.evaluations + evaluations,
        )

    def seen(self, place: Place, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at ends of steps in the block after a place: the orbit's own bits.

        Raises
        ------
        ValueError
            A time is not the end of a step of this block.
        """
        wanted = [self._step_at(t) - place.steps for t in times]
        if not all(0 <= step <= self.steps for step in wanted):
            raise ValueError("a time is outside the block")
        state, work = self._taken_up(place)
        rows, done = {}, 0
        for step in sorted(set(wanted)):
            self._advance(state, work, step - done)
            rows[step], done = state.copy(), step
        return np.array([rows[step] for step in wanted]).reshape(-1, len(self.start))

    def offered(self, t: float) -> DoubleDouble:
        """Return the end of the first step that is not before t."""
        step = math.ceil(t / self.h)
        while self._covers(step - 1, t):
            step -= 1
        while not self._covers(step, t):
            step += 1
        return two_product(self.h, float(step))

    def _covers(self, step: int, t: float) -> bool:
        high, low = two_product(self.h, float(step))
        return (high, low) >= (t, 0.0) if self.h > 0 else (high, low) <= (t, 0.0)

    def _step_at(self, t: DoubleDouble) -> int:
        step = round(t[0] / self.h)
        if two_product(self.h, float(step)) != tuple(t):
            raise ValueError(f"{t[0]!r} s is not the end of a step")
        return step

    def _taken_up(self, place: Place) -> tuple[Array, Array]:
        rest = (0.0,) * self.scratch
        return np.array(place.state), np.array([*place.carry, *rest])

    def _advance(self, state: Array, work: Array, steps: int) -> int:
        counted = self.kernel(state, work, self.g, self.l_z, self.table, steps)
        if counted < 0:
            raise Stopped("the iteration for a step does not converge: the steps are too long")
        if not np.isfinite(state).all():
            raise Stopped("the numbers are no longer finite")
        return counted + self.forces * steps
