"""How much of a motion a film or a player shows, and in what time."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from heavytop.analytic.motion import Motion
from heavytop.errors import BadScene, Fault
from heavytop.plots.sphere import touched

SHOWN_SPIN: Final = 9.0  # rad of spin in a second of film: slow enough to be followed
PERIODS: Final = 12  # nutations shown, at most, unless more are asked for


class Clip(NamedTuple):
    """A motion from its start on, or what it is after a push, where it would stand still.

    Attributes
    ----------
    motion : Motion
    pushed : bool
    end : float
        The last time that is shown; negative of a motion that is shown backwards [s].
    seconds : float
        How long it is shown [s].
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
        """What is shown of a motion to a time `end` [s], in `usual_s` unless it is asked otherwise.

        Raises
        ------
        BadScene
            Rounds, and a time or an axis that does not go round; or speed, time and seconds.
        """
        pushed = touched(own)
        motion = pushed or own
        if rounds is not None:
            if time is not None or not motion.round:
                rule = "or time: one of both" if time else "the axis does not go round"
                raise BadScene((Fault("film", None, "rounds", f"{rounds:g}", rule),))
            time = rounds * motion.round
        if speed is not None and time is not None:
            if seconds is not None:
                rule = "of speed, time (or rounds) and seconds two at most: the third follows"
                raise BadScene((Fault("film", None, "speed", f"{speed:g}", rule),))
            seconds = time / speed
        seconds = seconds or usual_s
        if time is None:
            time = speed * seconds if speed else _usual(motion, abs(end), seconds)
        return cls(motion, pushed is not None, math.copysign(time or 1.0, end), seconds)


def _usual(motion: Motion, most: float, seconds: float) -> float:
    """Some nutations with no more spin than can be followed, but one at least if there is time."""
    period, rate = motion.period or math.inf, abs(motion.mean_angle_rates[1])
    slow = SHOWN_SPIN * seconds / rate if rate else math.inf
    return min(most, PERIODS * period, max(slow, period if motion.period else 0.0))
