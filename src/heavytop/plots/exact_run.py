"""The exact motion, seen as a run: what draws or plays one asks the closed form instead."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.plots.sphere import touched

if TYPE_CHECKING:
    from heavytop.run.exact import SceneMotion

STEADY_S: Final = 2.0  # of a motion that has no period
_NOTHING: Final = SimpleNamespace(
    kind=(), **dict.fromkeys(("t", "theta", "phi"), ()), axis=np.empty((0, 3))
)


@dataclass(frozen=True, eq=False)
class ExactRun:
    """The exact motion, seen as a run of some nutations without events."""

    events = _NOTHING
    motion: Motion
    scene: Any
    orbit: Any

    @classmethod
    def of(cls, motion: Motion, periods: int) -> ExactRun:
        """That of a motion."""
        moving = touched(motion) or motion
        end = periods * moving.period if moving.period else STEADY_S
        scene = SimpleNamespace(title="", name=str(motion.kind), top=motion.top)
        return cls(motion, scene, SimpleNamespace(end=end))

    @classmethod
    def of_scene(cls, run: SceneMotion) -> ExactRun:
        """That of a scene which was not integrated."""
        return cls(run.motion, run.scene, SimpleNamespace(end=run.span))

    def __call__(self, t: Any) -> Any:
        """The motion at some times [s]."""
        return self.motion.at(t)

    @property
    def samples(self) -> Any:
        """The motion at its start."""
        return self.motion.at(np.zeros(1))


@dataclass(frozen=True, eq=False)
class Unmarked:
    """A run without marks of its events."""

    run: Any
    events = _NOTHING

    def __getattr__(self, name: str) -> Any:
        return getattr(self.run, name)

    def __call__(self, t: Any) -> Any:
        """The motion at some times [s]."""
        return self.run(t)
