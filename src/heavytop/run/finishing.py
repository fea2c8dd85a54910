"""From an orbit to the trajectory of its scene, in doubles or in the digits that were asked for."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.errors import EndedEarly, Outcome
from heavytop.integration.integrator import Seen
from heavytop.integration.orbit import Orbit
from heavytop.run.estimates import SINGULAR
from heavytop.run.orbit_events import orbit_events
from heavytop.run.planning import Plan, span
from heavytop.run.trajectory import Statistics, Trajectory
from heavytop.scene.scene import Scene

if TYPE_CHECKING:
    from heavytop.run.decimals.result import Decimals

Progress = Callable[[float], None]
EVERY_S = 10.0  # between two saves of a trajectory on its way
SHARE = 20.0  # times as long as a save takes, until the next one
UNSAVED_S = 1.0  # at the end of the steps; less is not worth a file

_OUTCOMES = {
    "reached": Outcome.FINISHED,
    "singular": Outcome.SINGULAR,
    "interrupted": Outcome.INTERRUPTED,
    "step-limit": Outcome.STEP_LIMIT,
}


def finished(
    scene: Scene, motion: Motion, chosen: Plan, orbit: Orbit, derive_s: float, integrate_s: float
) -> Trajectory:
    """Return the trajectory of an orbit.

    Parameters
    ----------
    scene : Scene
    motion : Motion
    chosen : Plan
    orbit : Orbit
    derive_s, integrate_s : float
        What its equations and its steps took [s].

    Raises
    ------
    EndedEarly
        A singularity, the step limit or an interrupt; it carries the trajectory.
    """
    compiled = orbit.integrator.compiled
    if orbit.ending == "reached" and _left_the_chart(orbit):
        orbit = replace(orbit, ending="singular")
    if orbit.ending == "singular" and chosen.precision != "double":  # more bits may go on
        orbit = replace(orbit, ending="reached", end=span(scene, motion))
    trajectory = Trajectory(
        scene=scene,
        motion=motion,
        plan=chosen,
        orbit=orbit,
        events=orbit_events(scene, motion, chosen, orbit),
        outcome=_OUTCOMES[orbit.ending],
        statistics=Statistics(
            orbit.steps, compiled.order, derive_s, compiled.compile_s, integrate_s
        ),
    )
    if trajectory.outcome is not Outcome.FINISHED:
        raise EndedEarly(trajectory.outcome, trajectory, _why(trajectory))
    return trajectory


def _why(trajectory: Trajectory) -> str:
    """Say what stops a run of a form that is singular at the poles, and what does not."""
    motion, form = trajectory.motion, trajectory.plan.formulation
    if trajectory.outcome is Outcome.INTERRUPTED or form not in SINGULAR:
        return ""
    near = min(motion.from_top, motion.from_bottom)
    passing = (
        f"the {form} form is singular at the poles, and the axis comes {near:.1e} rad near one"
    )
    return f"{passing}; the axis form and the attitude form are regular there"


@dataclass
class Keeper:
    """Saves an orbit on its way, now and then, so that a kill loses little of it."""

    path: str | os.PathLike[str]
    scene: Scene
    motion: Motion
    plan: Plan
    saved: float
    due: float

    @classmethod
    def of(
        cls, path: str | os.PathLike[str] | None, scene: Scene, motion: Motion, chosen: Plan
    ) -> Keeper | None:
        """Return the keeper of a file, if there is to be one."""
        now = time.monotonic()
        return None if path is None else cls(path, scene, motion, chosen, now, now + EVERY_S)

    def __call__(self, so_far: Callable[[], Orbit]) -> None:
        """Save the orbit so far, if it is time."""
        if time.monotonic() >= self.due:
            self._save(so_far())

    def at_last(self, orbit: Orbit) -> None:
        """Save the orbit at the end of its steps, before what is made of it takes its time."""
        if time.monotonic() - self.saved >= UNSAVED_S and orbit.ending in ("reached", "singular"):
            self._save(orbit)

    def _save(self, orbit: Orbit) -> None:
        began = time.monotonic()
        # events are found at the end
        later = replace(orbit, hits=tuple(seen.where(seen.t != seen.t) for seen in orbit.hits))
        Trajectory(
            scene=self.scene,
            motion=self.motion,
            plan=self.plan,
            orbit=orbit,
            events=orbit_events(self.scene, self.motion, self.plan, later),
            outcome=Outcome.INTERRUPTED,
            statistics=Statistics(orbit.steps, 0, 0.0, 0.0, 0.0),
        ).save(self.path)
        self.saved = time.monotonic()
        self.due = self.saved + max(EVERY_S, SHARE * (self.saved - began))


def _left_the_chart(orbit: Orbit) -> bool:
    """Tell whether a form that is singular at the poles stepped over one, theta leaving 0 to pi."""
    if orbit.integrator.formulation.starts_at_pole:
        return False
    theta = orbit.samples.rows[:, 0]  # of these forms it is the first state
    return bool(np.any((theta < 0) | (theta > np.pi)))


def in_decimals(
    trajectory: Trajectory, progress: Progress | None, before: Decimals | None = None
) -> Trajectory:
    """Return a trajectory in the precision of its plan, beside its run in doubles.

    Parameters
    ----------
    trajectory : Trajectory
    progress : callable, optional
    before : Decimals, optional
        What is known already, of an earlier end.

    Raises
    ------
    EndedEarly
        An interrupt or a singularity; it carries the trajectory in doubles.
    """
    from heavytop.integration.precise import Unfinished
    from heavytop.run.decimals import result

    scene, spent = trajectory.scene, trajectory.statistics
    parts = (trajectory.motion, trajectory.plan, trajectory.orbit)
    try:
        decimals, events = result.in_decimals(scene, *parts, before, progress)
    except KeyboardInterrupt:
        doubles = replace(trajectory, outcome=Outcome.INTERRUPTED)
        raise EndedEarly(Outcome.INTERRUPTED, doubles) from None
    except Unfinished:
        doubles = replace(trajectory, outcome=Outcome.SINGULAR)
        raise EndedEarly(Outcome.SINGULAR, doubles) from None
    engine, orbit = decimals.run.engine, trajectory.orbit
    if orbit.samples.t.size != len(decimals.samples):  # doubles ended before
        run = decimals.rounded(decimals.samples)
        orbit = replace(orbit, samples=Seen(run.t, 0 * run.t, run.states, run.phi))
    cost = Statistics(
        decimals.steps,
        engine.order,
        spent.derive_s,
        engine.compile_s,
        spent.integrate_s + decimals.integrate_s,
    )
    return replace(trajectory, orbit=orbit, events=events, statistics=cost, decimals=decimals)
