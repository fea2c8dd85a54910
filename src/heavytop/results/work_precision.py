"""A work–precision diagram: points, the fronts that none beats, and who is cheapest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Literal

from heavytop.display import Plotted
from heavytop.errors import Impossible
from heavytop.results.base import Number, Part, Problem, Result, Text, Values

TARGETS: Final = {"1e-6": 1e-6, "1e-9": 1e-9, "1e-12": 1e-12}
ERRORS: Final = {"axis": "axis_error", "theta": "theta_error"}
DOUBLE: Final = 53  # bits


@dataclass(frozen=True, kw_only=True)
class Point(Part):
    """One method at one setting, as measured: medians over the starts, and spreads.

    A spread is the distance of the upper quartile from the lower one.

    Attributes
    ----------
    method : str
        Its name; ``auto`` or ``auto=DIGITS`` of what a plan chose.
    formulation, language : str
        Of the right-hand side.
    tolerance, steps_a_period : float or None
        The setting, of which a method has one or the other.
    bits : int
        Of the numbers it computes in.
    measures : str
        ``axis`` or, where the states do not give the axis, ``theta``, of which `error` is.
    rival : bool
        Whether it is somebody else's.
    us_per_period, us_spread : float
        Best time of a start in the blocks of steps, over the periods they covered [µs].
    rhs_evaluations, steps : int
        Of the run from the scene's own start.
    error, error_spread : float
        Distance of the axis, a unit vector, from the exact one; or |Δθ| [rad].
    starts : int
    theta_error : float
        |Δθ| [rad].
    energy_error : float
        Of E', relative to max(|E'|, gMR).
    setup_s : float
        To derive and to compile, in this process [s].
    runs : int
        Runs of each start of which the time is the best.
    periods : float
        Nutation periods that the blocks of a run from the scene's own start covered.
    """

    method: Text
    formulation: Text
    language: Text
    tolerance: Number | None
    steps_a_period: Number | None
    bits: int
    measures: Literal["axis", "theta"]
    rival: bool
    us_per_period: Number
    us_spread: Number
    rhs_evaluations: int | None
    error: Number
    error_spread: Number
    starts: int
    theta_error: Number
    energy_error: Number
    setup_s: Number
    runs: int
    periods: Number
    steps: int

    @property
    def axis_error(self) -> Number | None:
        """The error of the axis, where the states give it."""
        return self.error if self.measures == "axis" else None

    @property
    def setting(self) -> Number | None:
        """The tolerance, or the steps a period."""
        return self.steps_a_period if self.tolerance is None else self.tolerance

    @property
    def label(self) -> str:
        """The method with its setting, for a person."""
        return f"{self.method}={self.setting:.3g}"


@dataclass(frozen=True, kw_only=True)
class SkippedSetting(Part):
    """One method at one setting that gave no point, and why.

    Attributes
    ----------
    method : str
        Its name.
    setting : mapping from str to float
        Its tolerance, or its steps a period.
    rival : bool
        Whether it is somebody else's.
    reason : str
    """

    method: Text
    setting: Values
    rival: bool = False
    reason: Text


@dataclass(frozen=True, kw_only=True, repr=False)
class WorkPrecision(Result, Plotted):
    """What every method costs for what it attains.

    Attributes
    ----------
    scene : Problem
        Its top and start were integrated, and neighbouring starts.
    periods : float
        Nutation periods to go.
    phase : float
        Where the error is looked at, in nutation periods from the start: at no turning point.
    budget : float
        Time that was allowed [s].
    points : tuple of Point
        One method at one setting each: its time and its errors.
    skipped : tuple of SkippedSetting
        What gave no point, and why.
    """

    schema: Literal["heavytop/workprec/1"] = "heavytop/workprec/1"
    scene: Problem
    periods: Number
    phase: Number
    budget: Number
    points: tuple[Point, ...]
    skipped: tuple[SkippedSetting, ...]

    def __repr__(self) -> str:
        of = f"{self.scene.name}, {self.periods:g} periods"
        return f"<WorkPrecision of {of}: {len(self.points)} points, {len(self.skipped)} skipped>"

    @cached_property
    def front(self) -> tuple[int, ...]:
        """Indices of the points that none beats in time and error of the axis, fastest first.

        Of theta, where no point has an axis.
        """
        return front(self.points, self._error)

    @cached_property
    def front_theta(self) -> tuple[int, ...]:
        """Indices of the points that none beats in time and error of theta, fastest first."""
        return front(self.points, "theta_error")

    def cheapest(self, bound: float, wants: str = "axis") -> Point | None:
        """Return the fastest point with an error of at most a bound, or None.

        Parameters
        ----------
        bound : float
            Of the axis, as a length, or of theta [rad].
        wants : str
            ``axis`` or ``theta``: the error of which; phi and psi are not measured.

        Raises
        ------
        Impossible
            It wants anything else.
        """
        if wants not in ERRORS:
            raise Impossible([("wants", f"{wants!r} is not measured; axis and theta are")])
        index = self._cheapest(ERRORS[wants], bound)
        return None if index is None else self.points[index]

    def document(self, *, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/workprec/1, with what follows from the points.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return super().document(files=files) | {
            "front": list(self.front),
            "front_theta": list(self.front_theta),
            "cheapest": self._leaders(self._error),
            "cheapest_theta": self._leaders("theta_error"),
            "rivals": self._rivals,
        }

    @property
    def _rivals(self) -> dict[str, list[str]]:
        """Names of the rivals that were run at some setting, and of those that were at none."""
        run, left = (
            dict.fromkeys(each.method for each in some if each.rival)
            for some in (self.points, self.skipped)
        )
        return {"run": list(run), "left_out": [name for name in left if name not in run]}

    @property
    def _error(self) -> str:
        return "axis_error" if any(p.measures == "axis" for p in self.points) else "theta_error"

    def _cheapest(self, error: str, bound: float, rival: bool | None = None) -> int | None:
        """Return the index of the fastest point within a bound; of rivals, or of ours, alone."""
        within = [
            i
            for i, off in _errors(self.points, error).items()
            if off <= bound and rival in (None, self.points[i].rival)
        ]
        return min(within, key=lambda i: _rank(self.points[i]), default=None)

    def _leaders(self, error: str) -> dict[str, Any]:
        """Return who is cheapest within each target, with the best of the other side; the best."""
        found: dict[str, Any] = {}
        for name, bound in TARGETS.items():
            found[name] = first = self._told(self._cheapest(error, bound), error)
            if first is not None:
                other = self._told(self._cheapest(error, bound, not first["rival"]), error)
                ratio = other and other["us_per_period"] / first["us_per_period"]
                first |= {"against": other, "ratio": ratio}
        off = _errors(self.points, error)
        for name, bits in (("best", math.inf), ("best_in_doubles", DOUBLE)):
            among = [i for i in off if self.points[i].bits <= bits]
            best = min(among, key=lambda i: (off[i], _rank(self.points[i])), default=None)
            found[name] = self._told(best, error)
        return found

    def _told(self, index: int | None, error: str) -> dict[str, Any] | None:
        if index is None:
            return None
        point = self.points[index]
        names = ("method", "tolerance", "steps_a_period", "rival", "us_per_period")
        known = {name: getattr(point, name) for name in names}
        return known | {"error": getattr(point, error), "point": index}


def front(points: Sequence[Point], error: str) -> tuple[int, ...]:
    """Return the indices of the points that none beats, from the fastest to the most accurate.

    Parameters
    ----------
    points : sequence of Point
    error : str
        ``axis_error`` or ``theta_error``; who has none takes no part.
    """
    off, found = _errors(points, error), list[int]()
    for i in sorted(off, key=lambda i: _rank(points[i], off[i])):
        if not found or off[i] < off[found[-1]]:
            found.append(i)
    return tuple(found)


def _errors(points: Sequence[Point], error: str) -> dict[int, float]:
    """The errors of those points that have one, by their indices."""
    return {i: getattr(p, error) for i, p in enumerate(points) if getattr(p, error) is not None}


def _rank(point: Point, error: float = 0.0) -> tuple[float, float, str]:
    """What comes first."""
    return point.us_per_period, error, point.method
