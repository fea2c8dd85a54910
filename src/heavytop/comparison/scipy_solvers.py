"""scipy's adaptive solvers as marches: a block is a fresh solver and a fixed number of its steps.

A block starts at local time 0 with the step that the block before would have taken next (LSODA
finds its own, since it starts again at order 1), and knows nothing else of what was before: so it
is the same whoever takes it. A look at a time between two steps is one step aside, of the method's
own accuracy, where scipy's interpolants of DOP853 and Radau are of lower order than their steps;
LSODA's own interpolant is what it steps with.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from heavytop.comparison.equations import Singular, later, right_hand_side
from heavytop.comparison.march import Array, Place, Stopped
from heavytop.equations.formulation import Formulation
from heavytop.numbers.double_double import DoubleDouble, add

RTOL_LEAST = 100 * 2.0**-52  # scipy raises any smaller relative tolerance to this, with a warning
_FAR = 2.0**40  # a bound in time [s] that no block reaches
_STEPS = {"dop853": 500, "radau": 200, "lsoda": 4000}


def scipy_march(
    solver: str,
    equations: Formulation,
    start: tuple[float, ...],
    parameters: Mapping[str, float],
    tolerance: float,
    direction: int,
    steps: int | None,
) -> ScipyMarch:
    """Return the march of one of scipy's solvers: ``dop853``, ``lsoda`` or ``radau``."""
    import scipy.integrate as scipy

    return ScipyMarch(
        solver={"dop853": scipy.DOP853, "lsoda": scipy.LSODA, "radau": scipy.Radau}[solver],
        right_hand_side=right_hand_side(equations, parameters),
        start=start,
        tolerance=tolerance,
        direction=direction,
        restarts=solver != "lsoda",
        steps=_STEPS[solver] if steps is None else steps,
    )


@dataclass(frozen=True, slots=True, eq=False)
class ScipyMarch:
    """A march of one of scipy's solvers.

    Attributes
    ----------
    solver : type
        The class of `scipy.integrate`.
    right_hand_side : callable
        The derivatives, of time and states.
    start : tuple of float
        The states at the start.
    tolerance : float
        Relative and absolute; scipy keeps the relative one above 2.2e-14.
    direction : int
        1 forwards, -1 backwards.
    restarts : bool
        Whether a fresh solver goes on at full order with the step it is given.
    steps : int
        Steps in a block.
    """

    solver: Any
    right_hand_side: Callable[[float, Any], Sequence[float]]
    start: tuple[float, ...]
    tolerance: float
    direction: int
    restarts: bool
    steps: int
    compile_s: float = 0.0

    def begin(self) -> Place:
        """Return the place at the start, time 0."""
        return Place((0.0, 0.0), self.start)

    def block(self, place: Place) -> Place:
        """Take a block of steps."""
        with _spoken():
            solver = self._fresh(place)
            for _ in range(self.steps):
                _step(solver)
        return Place(
            time=later(place.time, float(solver.t)),
            state=tuple(solver.y.tolist()),
            carry=(float(solver.h_abs),) if self.restarts else (),
            steps=place.steps + self.steps,
            evaluations=place.evaluations + solver.nfev,
        )

    def seen(self, place: Place, times: Sequence[DoubleDouble]) -> Array:
        """Return the states at times in the block after a place: a step aside for each.

        Raises
        ------
        ValueError
            A time is not in the block.
        """
        local = [add(t, (-place.time[0], -place.time[1]))[0] for t in times]
        order = sorted(range(len(local)), key=lambda i: self.direction * local[i])
        rows = np.empty((len(local), len(self.start)))
        with _spoken():
            solver, steps = self._fresh(place), 0
            before, state = 0.0, solver.y.copy()
            for i in order:
                while self.direction * (local[i] - solver.t) > 0 and steps < self.steps:
                    before, state = float(solver.t), solver.y.copy()
                    _step(solver)
                    steps += 1
                if not 0 <= self.direction * local[i] <= self.direction * solver.t:
                    raise _Outside("a time is outside the block")
                rows[i] = self._aside(solver, before, state, local[i])
        return rows

    def offered(self, t: float) -> DoubleDouble:
        """Return t itself."""
        return t, 0.0

    def _aside(self, solver: Any, before: float, state: Array, t: float) -> Array:
        """Return the states at t, in the last step of a solver, which it leaves as it is."""
        if t == solver.t:
            return solver.y  # type: ignore[no-any-return]
        if t == before:
            return state
        if not self.restarts:
            return solver.dense_output()(t)  # type: ignore[no-any-return]
        aside = self._solver(state, t - before, abs(t - before))
        while aside.status == "running":
            _step(aside)
        return aside.y  # type: ignore[no-any-return]

    def _fresh(self, place: Place) -> Any:
        first = place.carry[0] if place.carry else None
        return self._solver(np.array(place.state), self.direction * _FAR, first)

    def _solver(self, state: Array, bound: float, first: float | None) -> Any:
        return self.solver(
            self.right_hand_side,
            0.0,
            state,
            bound,
            first_step=first,
            rtol=max(self.tolerance, RTOL_LEAST),
            atol=self.tolerance,
        )


def _step(solver: Any) -> None:
    message = solver.step()
    if solver.status == "failed":
        raise Stopped(f"the solver gave up: {message or 'without saying why'}".rstrip("."))
    if not np.isfinite(solver.y).all():
        raise Stopped("the numbers are no longer finite")


class _Outside(ValueError):
    """A time that is not in a block."""


@contextmanager
def _spoken() -> Iterator[None]:
    """Turn what a solver raises into `Stopped`; its warnings say nothing that is not checked."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            yield
        except Singular as error:
            raise Stopped(
                "the equations are singular, or overflow, where the motion went"
            ) from error
        except _Outside:
            raise
        except (ValueError, np.linalg.LinAlgError) as error:  # as Radau's, of infinite numbers
            raise Stopped(f"the solver gave up: {error}") from error
