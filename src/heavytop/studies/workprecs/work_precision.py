"""A work–precision diagram: points, their front, and who is cheapest for so many digits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from heavytop.errors import Impossible
from heavytop.integration.bits import DOUBLE
from heavytop.machine import versions
from heavytop.scene.scene import Scene
from heavytop.studies.workprecs.front import (
    Error,
    ahead_of,
    axis_error,
    cheapest,
    front,
    most_accurate,
    theta_error,
)
from heavytop.studies.workprecs.ladder import AUTO
from heavytop.studies.workprecs.point import Point, Skipped

SCHEMA: Final = "heavytop/workprec/1"
BEFORE: Final = 0.382  # of a period before the last one ends: no turning point
TARGETS: Final = {"1e-6": 1e-6, "1e-9": 1e-9, "1e-12": 1e-12}


@dataclass(frozen=True)
class WorkPrecision:
    """What every method costs for what it attains.

    Attributes
    ----------
    scene : Scene
        Its top and start were integrated.
    periods : float
        Nutation periods; the error is that at `BEFORE` of a period before.
    budget : float
        Time that was allowed [s].
    points : tuple of Point
        One method at one setting each: its time and its errors.
    skipped : tuple of Skipped
        What gave no point, and why.
    """

    scene: Scene
    periods: float
    budget: float
    points: tuple[Point, ...]
    skipped: tuple[Skipped, ...]

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
        return front(self.points, theta_error)

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
        return cheapest(self.points, _error_of(wants), bound)

    @property
    def auto(self) -> tuple[Point, ...]:
        """The points that are auto's choices."""
        return tuple(point for point in self.points if point.trial.name == AUTO)

    def ahead_of(self, auto: Point) -> tuple[Point, ...]:
        """Return the points more accurate than a choice of auto, and faster beyond noise.

        Parameters
        ----------
        auto : Point
            One of `auto`.
        """
        return ahead_of(self.points, auto, _error_of(auto.trial.wants or "axis"))

    def document(self, *, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/workprec/1.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        tables = self.scene.document()
        return {
            "schema": SCHEMA,
            "scene": {key: tables[key] for key in ("name", "title", "source", "top", "start")},
            "periods": self.periods,
            "phase": self.periods - BEFORE,
            "budget": self.budget,
            "points": [point.document() for point in self.points],
            "front": list(self.front),
            "front_theta": list(self.front_theta),
            "cheapest": self._cheapest(self._error),
            "cheapest_theta": self._cheapest(theta_error),
            "auto": [self._judged(point) for point in self.auto],
            "rivals": self._rivals,
            "skipped": [each.document() for each in self.skipped],
            "files": dict(files or {}),
            "versions": versions(),
        }

    @property
    def _rivals(self) -> dict[str, list[str]]:
        """Names of the rivals that were run at some setting, and of those that were at none."""
        run = dict.fromkeys(point.trial.name for point in self.points if point.is_rival)
        skipped = (each.trial for each in self.skipped if each.trial.method.is_rival)
        left = dict.fromkeys(trial.name for trial in skipped if trial.name not in run)
        return {"run": list(run), "left_out": list(left)}

    @property
    def _error(self) -> Error:
        return _error_of("axis" if any(p.measures == "axis" for p in self.points) else "theta")

    def _cheapest(self, error: Error) -> dict[str, Any]:
        found = {name: self._leader(error, bound) for name, bound in TARGETS.items()}
        best = most_accurate(self.points, error)
        double = most_accurate(self.points, error, lambda p: p.trial.method.bits == DOUBLE)
        return found | {
            "best": best and self._told(best, error),
            "best_in_doubles": double and self._told(double, error),
        }

    def _leader(self, error: Error, bound: float) -> dict[str, Any] | None:
        """Return the cheapest within a bound, and who else's method comes next, or leads."""
        found = cheapest(self.points, error, bound)
        if found is None:
            return None
        other = cheapest(self.points, error, bound, lambda p: p.is_rival != found.is_rival)
        ratio = other and other.us_per_period / found.us_per_period
        return self._told(found, error) | {
            "against": other and self._told(other, error),
            "ratio": ratio,
        }

    def _told(self, point: Point, error: Error) -> dict[str, Any]:
        known = point.document()
        names = ("method", "stands_for", "tolerance", "steps_a_period", "rival", "us_per_period")
        index = next(i for i, each in enumerate(self.points) if each is point)
        return {name: known[name] for name in names if name in known} | {
            "error": error(point),
            "point": index,
        }

    def _judged(self, auto: Point) -> dict[str, Any]:
        index = next(i for i, each in enumerate(self.points) if each is auto)
        ahead = [other.trial.text for other in self.ahead_of(auto)]
        return {"point": index, "digits": auto.trial.digits, "wants": auto.trial.wants,
                "error": auto.wanted_error, "missed": auto.misses, "ahead": ahead}  # fmt: skip


def _error_of(wants: str) -> Error:
    known = {"axis": axis_error, "theta": theta_error}
    if wants not in known:
        raise Impossible([("wants", f"{wants!r} is not measured; axis and theta are")])
    return known[wants]
