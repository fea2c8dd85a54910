"""A run as pictures, films and the player show it: motion, events, and the part that is shown."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, Final, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from heavytop.analytic.motion import Motion
from heavytop.errors import BadScene, Fault
from heavytop.exact.pairs import Array
from heavytop.plots import style
from heavytop.plots.sphere import NUTATIONS, STEADY_TURN_S, push
from heavytop.plots.style import new_label
from heavytop.scene.quantities import values_of

MOST_DRAWN_PERIODS: Final = 12  # more would only blacken the paper
CURVE_POINTS: Final = 4001
UNSEEN: Final = 1e-6  # rad: no eye sees it in a picture
WITHOUT_EVENTS: Final = SimpleNamespace(kind=(), t=(), theta=(), phi=(), axis=np.empty((0, 3)))


@dataclass(frozen=True, eq=False)
class DrawnRun:
    """A run as pictures and the player show it, in doubles.

    Attributes
    ----------
    at : callable
        The motion at times, shape (k,) [s].
    motion : Motion
    end : float
        The end of the run [s].
    title : str
    trajectory : Trajectory or None
        What was integrated; None where the exact motion is all there is.
    marked : bool
        Whether its events are marked.
    """

    at: Callable[[Any], Any]
    motion: Motion
    end: float
    title: str
    trajectory: Any = None
    marked: bool = True

    @classmethod
    def of(cls, run: Any, nutations: int = NUTATIONS) -> DrawnRun:
        """The drawn run of a trajectory, of a scene's exact motion, or of nutations of a motion.

        In place of a trajectory of many digits, which is slow, it has the exact motion, if no eye
        sees the difference.
        """
        if isinstance(run, DrawnRun):
            return run
        if isinstance(run, Motion):
            moving = push(run) or run
            end = nutations * moving.period if moving.period else 2 * STEADY_TURN_S
            return cls(run.at, run, end, str(run.kind))
        from heavytop.run.exact import SceneMotion

        motion, title = run.motion, run.scene.title or run.scene.name
        if isinstance(run, SceneMotion):
            return cls(motion.at, motion, run.span, title)
        same = not run.in_doubles and np.allclose(
            run.samples.axis, motion.at(run.t).axis, UNSEEN, UNSEEN, equal_nan=True
        )
        return cls(motion.at if same else run, motion, float(run.orbit.end), title, run)

    @property
    def events(self) -> Any:
        """The events of a trajectory; of the exact motion there are none."""
        return WITHOUT_EVENTS if self.trajectory is None else self.trajectory.events

    @property
    def has_no_loop(self) -> bool:
        """Whether theta is not drawn against phi: phi is not followed, or the top stands still."""
        return push(self.motion) is not None or not self.follows("phi")

    def follows(self, name: str) -> bool:
        """Whether the run has a quantity."""
        return not np.isnan(self.values(name)).all()

    def values(self, name: str) -> Any:
        """A column at the times drawn."""
        return values_of(self.path, name, self.motion)

    @property
    def shown(self) -> float:
        """The last of the times drawn [s]."""
        most = MOST_DRAWN_PERIODS * float(self.motion.period or np.inf)
        return float(np.copysign(min(abs(self.end), most), self.end))

    @cached_property
    def path(self) -> Any:
        """The motion at the times drawn."""
        return self.at(np.linspace(0.0, self.shown, CURVE_POINTS))

    def mark_events(self, ax: Axes, places: Array) -> None:
        """Mark the events at the given places, shape (k, 2)."""
        kinds = np.asarray(self.events.kind, dtype=object)
        drawn = np.abs(np.asarray(self.events.t)) <= abs(self.shown)
        for kind in style.EVENT_STYLES:
            if len(here := places[drawn & (kinds == kind)]):
                self.mark(ax, kind, here[:, 0], here[:, 1])

    def mark(self, ax: Axes, kind: str, x: Any, y: Any) -> None:
        """Mark events of a kind, where events are marked."""
        label, colour, marker = style.EVENT_STYLES[kind]
        looks: dict[str, Any] = {"ms": 5, "mfc": "white", "ls": "none", "zorder": 3}
        if self.marked:
            ax.plot(x, y, marker, label=new_label(ax, label), color=colour, **looks)


# --- the part of a motion that a film or a player shows, and in what time -----------------------


SHOWN_SPIN: Final = 9.0  # rad of spin in a second of film: slow enough to be followed
PERIODS: Final = 12  # nutations shown, at most, unless more are asked for
BLURRED: Final = 2.0  # rad of spin from frame to frame: more is not seen as a rotation
FEWEST: Final = 16  # points of a path in a nutation, or in a round: fewer show another path


class Clip(NamedTuple):
    """A motion from its start on; where it stands still, the motion after a push.

    Attributes
    ----------
    motion : Motion
    pushed : bool
    end : float
        The last time that is shown; negative where the motion is shown backwards [s].
    seconds : float
        The time in which it is shown [s].
    """

    motion: Motion
    pushed: bool
    end: float
    seconds: float

    @classmethod
    def of(
        cls,
        own: Motion,
        end: float,
        usual_s: float,
        *,
        seconds: float | None = None,
        rounds: float | None = None,
        time: float | None = None,
        speed: float | None = None,
    ) -> Clip:
        """The clip of a motion up to a time `end` [s], by default shown in `usual_s` seconds.

        Raises
        ------
        BadScene
            Rounds are given, and a time too, or the axis does not go round; or speed, time (or
            rounds) and seconds are all given.
        """
        pushed = push(own)
        motion = pushed or own
        if rounds is not None:
            if time is not None or not motion.round:
                rule = "give rounds or time, not both" if time else "the axis does not go round"
                raise BadScene((Fault("film", None, "rounds", f"{rounds:g}", rule),))
            time = rounds * motion.round
        if speed is not None and time is not None:
            if seconds is not None:
                rule = "of speed, time (or rounds) and seconds two at most: the third follows"
                raise BadScene((Fault("film", None, "speed", f"{speed:g}", rule),))
            seconds = time / speed
        seconds = seconds or usual_s
        if time is None:
            time = speed * seconds if speed else _visible_time(motion, abs(end), seconds)
        return cls(motion, pushed is not None, math.copysign(time or 1.0, end), seconds)

    def blur(self, frames: int, points: int) -> list[str]:
        """Sentences that spin or path are too fast for so many frames and points of the path."""
        motion, time = self.motion, abs(self.end)
        shortest = min(filter(None, (motion.period, motion.round)), default=math.inf)
        fast = {
            "the spin": time * abs(motion.mean_angle_rates[1]) > BLURRED * frames,
            "the path": time * FEWEST > points * shortest,
        }
        return [f"{what} is too fast to be shown as it is" for what, blurs in fast.items() if blurs]


def _visible_time(motion: Motion, most: float, seconds: float) -> float:
    """The time [s] of some nutations with spin that the eye can follow; at least one nutation.

    It is at most `most`.
    """
    period, rate = motion.period or math.inf, abs(motion.mean_angle_rates[1])
    slow = SHOWN_SPIN * seconds / rate if rate else math.inf
    return min(most, PERIODS * period, max(slow, period if motion.period else 0.0))
