"""What takes the steps of a run: a compiled formulation, projected or not, and turns counted.

heyoka takes its steps in the run's own unit of time (`pace`). Here states, constants and times are
measured in it on the way in, and in seconds again on the way out: nothing is rounded by that. One
unit holds for the whole run, chosen by its start and its constants alone: so a block has the same
bits however it was come to.

phi of the axis form, phi and psi of the attitude form are no states of the equations: they are
read off the others after each block, and their turns are counted. So nothing in the integrator
grows, and the state at a block's start is enough to run it again, or to go on from it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.integration.compiled import Array, Block, Compiled, Hits
from heavytop.integration.following import Following, FollowingAttitude, FollowingAxis
from heavytop.integration.legs import Projected
from heavytop.integration.pace import in_units, paces_of
from heavytop.integration.projection import Projection
from heavytop.integration.turns import Turns
from heavytop.integration.winding import Winding, distinct

LONGEST = float(np.finfo(float).max)


@dataclass(frozen=True, slots=True, eq=False)
class Integrator:
    """What takes the steps of one run.

    Attributes
    ----------
    formulation : Formulation
        Where its last two states are angles that are followed, `compiled` is without them.
    compiled : Compiled
    parameters : dict from str to float
        Constants of the run, by symbol name.
    pace : float
        In whose unit of time steps are taken [1/s].
    projection : Projection or None
        In that unit of time.
    following : Following or None
        What follows phi, or phi and psi.
    """

    formulation: Formulation
    compiled: Compiled
    parameters: dict[str, float]
    pace: float
    projection: Projection | None
    following: Following | None
    _units: Array
    _constants: dict[str, float]

    @classmethod
    def of(
        cls,
        formulation: Formulation,
        compiled: Compiled,
        parameters: dict[str, float],
        start: Array,
        *,
        projected: bool = False,
        follows_phi: bool = False,
    ) -> Self:
        """Return what takes the steps of the run from a start, shape (n,), and follows angles."""
        own = compiled.formulation
        state = start[: len(own.states)]
        pace = float(paces_of(own, state, parameters))
        units, constants = np.where(own.is_rate, pace, 1.0), in_units(pace, parameters)
        projection = Projection.of(own, constants, state / units) if projected else None
        following: Following | None = None
        if follows_phi:
            following = FollowingAxis(Winding.of(parameters, state))
        elif formulation.integrated:
            turns = Turns.of(parameters)
            following = FollowingAttitude(turns, turns.decided(state))
        return cls(formulation, compiled, parameters, pace, projection, following, units, constants)

    @property
    def compile_s(self) -> float:
        """Time spent in compiling [s]."""
        return self.compiled.compile_s

    def for_this_thread(self) -> Self:
        """Return the one like this that belongs to the calling thread."""
        projection = self.projection and self.projection.for_this_thread()
        return replace(self, compiled=self.compiled.for_this_thread(), projection=projection)

    def cautious_step(self, state: Array, far: float) -> float | None:
        """Return a bound for the first steps [s], as `Compiled` does."""
        self.compiled.load(self._constants)
        own = state[: self._units.size] / self._units
        bound = self.compiled.cautious_step(own, self._own_time(far))
        return None if bound is None else bound / self.pace

    def first_step(self, state: Array, far: float, longest: float | None) -> float:
        """Return the length of the first natural step [s]."""
        return self._taken(state[: self._units.size], 1, far, None, longest).elapsed[0]

    def block(
        self,
        state: Array,
        steps: int,
        far: float,
        samples: Array | None = None,
        longest: float | None = None,
        reach: float = 0.0,
    ) -> Block:
        """Take natural steps from a state and sample them.

        Parameters and result are those of `Compiled.block`, but samples may be 0. Angles that are
        followed stand behind the states; they are told up to the time `reach` from the start, the
        samples and the block's end if that comes before.
        """
        following, own = self.following, state[: self._units.size]
        if following is None and (samples is None or samples.size == 0):
            return self._taken(own, steps, far, None, longest)
        forward = math.copysign(1.0, far)
        asked = np.empty(0) if samples is None else np.maximum(forward * samples, 0.0)
        points = np.linspace(0.0, reach, 1 + (following.parts(reach, steps) if following else 0))
        t = distinct(np.concatenate(([0.0], points[1:], asked)))[0]
        block = self._taken(own, steps, far, forward * t[1:], longest)
        rows = np.concatenate((own[None], block.rows))
        t = t[: len(rows)]
        place = np.searchsorted(t, asked)
        place = place[place < t.size]  # the block did not reach the others
        if following is None:
            return replace(block, rows=rows[place])

        def more(t: Array) -> Array:
            return self._taken(own, block.steps, far, t, longest).rows

        end = np.array([block.elapsed[0]])
        times = np.concatenate((t, forward * end, *(forward * h.t for h in block.hits)))
        states = np.concatenate((rows, block.state[None], *(h.states for h in block.hits)))
        unique, where = distinct(times)
        first = (*state[own.size :].tolist(), math.nan)[:2]
        told = following.followed(forward * unique, states[where], first, more)
        told = told[:, : state.size - own.size]

        def with_angles(t: Array, rows: Array) -> Array:
            return np.concatenate((rows, told[np.searchsorted(unique, forward * t)]), axis=1)

        return replace(
            block,
            state=with_angles(end, block.state[None])[0],
            rows=with_angles(forward * t[place], rows[place]),
            hits=tuple(Hits(h.t, h.t_low, with_angles(h.t, h.states)) for h in block.hits),
        )

    def _own_time(self, far: float) -> float:
        """Return a time without end in the run's own unit of time, and finite."""
        return math.copysign(min(abs(far) * self.pace, LONGEST), far)

    def _taken(
        self, state: Array, steps: int, far: float, samples: Array | None, longest: float | None
    ) -> Block:
        """Take steps in the run's own unit of time; the block is measured in seconds."""
        compiled, pace, units = self.compiled, self.pace, self._units
        compiled.load(self._constants)
        taking = Projected(compiled, self.projection) if self.projection else compiled
        if pace == 1:
            return taking.block(state, steps, far, samples, longest)
        done = taking.block(
            state / units,
            steps,
            self._own_time(far),
            None if samples is None else samples * pace,
            None if longest is None else longest * pace,
        )
        high, low = done.elapsed
        return replace(
            done,
            state=done.state * units,
            elapsed=(high / pace, low / pace),
            rows=done.rows * units,
            hits=tuple(Hits(h.t / pace, h.t_low / pace, h.states * units) for h in done.hits),
        )
