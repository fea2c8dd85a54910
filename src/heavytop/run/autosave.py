"""A run saved on its way, so that a kill loses little of it."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from heavytop.errors import Outcome
from heavytop.integration.orbit import Orbit
from heavytop.run.trajectory import Trajectory

SAVE_S = 10.0  # between two saves of a trajectory on its way
SAVE_SHARE = 20.0  # times as long as a save takes, until the next one
UNSAVED_S = 1.0  # at the end of the steps; less is not worth a file
WHOLE = (Outcome.FINISHED, Outcome.SINGULAR)


@dataclass
class Checkpoints:
    """Saves what has become of a trajectory; `saved` and `due` are monotonic times [s]."""

    path: str | os.PathLike[str]
    begun: Trajectory
    saved: float = field(default_factory=time.monotonic)
    due: float = field(default_factory=lambda: time.monotonic() + SAVE_S)

    def __call__(self, so_far: Callable[[], Orbit]) -> None:
        """Save the orbit so far, if it is time."""
        if time.monotonic() >= self.due:
            self._save(so_far())

    def at_last(self, orbit: Orbit) -> None:
        """Save the orbit at the end of its steps, before what is made of it takes its time."""
        long = time.monotonic() - self.saved >= UNSAVED_S
        if orbit.outcome is Outcome.INTERRUPTED or (long and orbit.outcome in WHOLE):
            self._save(orbit)

    def _save(self, orbit: Orbit) -> None:
        began, so_far = time.monotonic(), replace(orbit, outcome=Outcome.INTERRUPTED)
        replace(self.begun, orbit=so_far, with_events=False).save(self.path)
        self.saved = time.monotonic()
        self.due = self.saved + max(SAVE_S, SAVE_SHARE * (self.saved - began))
