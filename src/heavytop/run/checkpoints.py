"""Saving a run on its way, so that a kill loses little of it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from heavytop.analytic.motion import Motion
from heavytop.errors import Outcome
from heavytop.integration.orbit import Orbit
from heavytop.run.events import orbit_events
from heavytop.run.planning import Plan
from heavytop.run.trajectory import Statistics, Trajectory
from heavytop.scene.scene import Scene

Progress = Callable[[float], None]
EVERY_S = 10.0  # between two saves of a trajectory on its way
SHARE = 20.0  # times as long as a save takes, until the next one
UNSAVED_S = 1.0  # at the end of the steps; less is not worth a file


@dataclass
class Checkpoints:
    """Saves an orbit on its way, now and then; `saved` and `due` are monotonic times [s]."""

    path: str | os.PathLike[str]
    scene: Scene
    motion: Motion
    plan: Plan
    saved: float
    due: float

    @classmethod
    def of(
        cls, path: str | os.PathLike[str] | None, scene: Scene, motion: Motion, chosen: Plan
    ) -> Checkpoints | None:
        """Return those in a file, if there is to be one."""
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
