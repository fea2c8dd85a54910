"""The result of a work–precision diagram: points, Pareto front, the cheapest methods."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from operator import itemgetter
from typing import Any, ClassVar, Final

from heavytop.errors import Impossible
from heavytop.exact.decimals import DOUBLE
from heavytop.results.base import Result, group, skipped_runs
from heavytop.results.drift import order_of
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import QUANTITIES, quantity_of

TARGETS: Final = {"1e-6": 1e-6, "1e-9": 1e-9, "1e-12": 1e-12}
ERROR_KEYS: Final = {
    "axis": "axis_error", "theta": "theta_error", "phase": "phase_error", "energy": "energy_error"
}  # fmt: skip
"""The quantities whose errors are measured, and the keys of these."""
LEADER_KEYS: Final = ("method", "tolerance", "steps_a_period", "rival", "us_per_period")
POINT_COLUMNS: Final = ("method", "order", *TARGETS, "error", "of", "us_per_period", "setup_s")
FRONT: Final = ("method", "setting", "us_per_period", "error")
LEADERS: Final = ("to", *FRONT, "next", "ratio")
TIME_AT: Final = QUANTITIES["us_per_period"]._replace(symbol="at")
BESTS: Final = {name: TIME_AT._replace(symbol=name) for name in TARGETS} | {
    "error": QUANTITIES["error"]._replace(symbol="best"), "us_per_period": TIME_AT
}  # fmt: skip


class WorkPrecision(Result):
    """The time and the error of every method at each setting.

    Attributes
    ----------
    scene : mapping
        Its top and start were integrated, and neighbouring starts.
    periods : float
        Nutation periods to go.
    phase : float
        The time at which the error is measured [nutation periods], not a turning point.
    budget : float
        Time that was allowed [s].
    points : tuple of mapping
        One method at one setting each: medians over the ``starts``, and spreads, distances of the
        upper quartile from the lower one. ``method``, ``formulation`` and ``language`` of the
        right-hand side; its ``tolerance`` or ``steps_a_period``; ``bits`` of its numbers; whether
        it is a ``rival``, and ``has_order``, one for all its steps; ``us_per_period`` and
        ``us_spread``, the best of ``runs`` of a start in the blocks of steps over the ``periods``
        they covered [µs]; ``steps`` and ``rhs_evaluations`` of the run from the scene's own start
        (the steps too, of Taylor's methods and compiled ones of one's own); ``error`` and
        ``error_spread`` of what it ``measures``, the axis or, where the states do not give it,
        theta [rad]; ``theta_error`` [rad]; ``phase_error`` [s], None beyond a twentieth of a
        period; ``energy_error``, relative to max(|E'|, gMR); ``setup_s``, to compile [s]; how
        often a method of one's own ``warned``.
    skipped : tuple of mapping
        The ``method``, the ``setting`` and the ``reason`` of settings without a point.
    """

    schema: ClassVar = "heavytop/workprec/1"
    heading: ClassVar = "Work and precision"
    table: ClassVar = "points"
    index: ClassVar = ("method", "tolerance", "steps_a_period")

    scene: Mapping[str, Any]
    periods: float
    phase: float
    budget: float
    points: tuple[Any, ...]
    skipped: tuple[Any, ...]

    @property
    def front(self) -> tuple[int, ...]:
        """Indices of the points that none beats in time and error of the axis, fastest first.

        Where no point has an axis the error is that of theta.
        """
        return front(self.points, self._error)

    def cheapest(self, bound: float, wants: str = "axis") -> Any:
        """Return the fastest point with an error of at most a bound, or None.

        Parameters
        ----------
        bound : float
            Of the axis, a unit vector, or of theta [rad].
        wants : str
            ``axis``, ``theta``, ``phase`` or ``energy``: the error of which.

        Raises
        ------
        Impossible
            It wants anything else.
        """
        if wants not in ERROR_KEYS:
            raise Impossible([("wants", f"{wants!r} is not measured; {', '.join(ERROR_KEYS)} are")])
        return fastest(self.points, ERROR_KEYS[wants], bound)

    def document(self) -> dict[str, Any]:
        """Return the document heavytop/workprec/1, with what follows from the points."""
        return super().document() | {
            "front": [*self.front],
            "cheapest": self._leaders(),
            "orders": {row["method"]: row["order"] for row in summaries(self.points)},
        }

    def facts(self) -> Iterator[Fact]:
        """Yield how it was measured; what was left out and why."""
        yield "runs", f"{self.periods:g} nutation periods, all methods interleaved in one process"
        yield "times", "µs a period to reach this error; then the least error, and its time"
        yield "errors", "of the axis, or of θ [rad], where the states give no axis"
        yield "order", "the power of the step with which the error falls, measured here"
        for point in self.points:
            for text, count in point.get("warned", {}).items():
                yield point.method, f"warned {count}× at {setting(point)}: {text}"
        yield from (("left out", text) for text in skipped_runs(self.skipped))

    def tables(self) -> Iterator[Table]:
        """Yield tables of all methods, of the front, and of the cheapest methods on either side."""
        yield Table([*summaries(self.points)], POINT_COLUMNS, meanings=BESTS)
        side = quantity_of(self._error).symbol
        if rows := [self.points[i] for i in self.front]:
            yield _point_table(rows, FRONT, f"Pareto front, {side}")
            leaders = [
                {**each, "to": target, "next": (each.get("against") or {}).get("method")}
                for target, each in self._leaders().items()
                if each
            ]
            yield _point_table(leaders, LEADERS, f"cheapest, {side}")

    def failures(self) -> Mapping[str, str]:
        """Return users' methods that have no point, and why their first setting has none."""
        measured = {point.method for point in self.points}
        skipped = group(self.skipped, "method").items()
        return {n: x.reason for (n,), (x, *_) in skipped if ":" in n and n not in measured}

    @property
    def _error(self) -> str:
        """The key of the error of the axis, or of theta where no point has an axis."""
        axis = any(point["measures"] == "axis" for point in self.points)
        return "axis_error" if axis else "theta_error"

    def _leader(self, points: Sequence[Any], bound: float | None = None) -> Any:
        """Return the fastest point within a bound, or the most accurate one, as the JSON has it."""
        if bound is None:
            bound = min((error_of_point(p, self._error) for p in points), default=math.inf)
        if (point := fastest(points, self._error, bound)) is None:
            return None
        known = {name: point[name] for name in LEADER_KEYS}
        return known | {"error": point["error"], "point": self.points.index(point)}

    def _leaders(self) -> dict[str, Any]:
        """Return the cheapest within each target, beside the other side's; and the most accurate.

        The sides are the Taylor integrator and its rivals.
        """
        found = dict[str, Any]()
        for target, bound in TARGETS.items():
            found[target] = first = self._leader(self.points, bound)
            if first:
                others = [each for each in self.points if each["rival"] != first["rival"]]
                other = self._leader(others, bound)
                ratio = other and other["us_per_period"] / first["us_per_period"]
                first |= {"against": other, "ratio": ratio}
        doubles = [point for point in self.points if point["bits"] <= DOUBLE]
        return found | {"best": self._leader(self.points), "best_in_doubles": self._leader(doubles)}


def front(points: Sequence[Any], error: str) -> tuple[int, ...]:
    """Return the indices of the points that none beats, from the fastest to the most accurate.

    Parameters
    ----------
    points : sequence of mapping
    error : str
        One of the values of `ERROR_KEYS`; points without it are left out.
    """
    off = [error_of_point(point, error) for point in points]
    rank = [(p["us_per_period"], x, p["method"]) for p, x in zip(points, off, strict=True)]
    found, least = list[int](), math.inf
    for i in sorted(range(len(points)), key=rank.__getitem__):
        if off[i] < least:
            found, least = [*found, i], off[i]
    return tuple(found)


def fastest(points: Sequence[Any], error: str, bound: float) -> Any:
    """Return the fastest point with an error within a bound, or None."""
    unbeaten = (points[i] for i in front(points, error))
    return next((point for point in unbeaten if error_of_point(point, error) <= bound), None)


def summaries(points: Sequence[Any]) -> Iterator[dict[str, Any]]:
    """Yield a row for each method: its least time within each of `TARGETS`, and its least error.

    Parameters
    ----------
    points : sequence of mapping
    """
    for (name, of), same in group(points, "method", "measures").items():
        best = min(same, key=itemgetter("error"))
        times = {x: fastest(same, "error", bound) for x, bound in TARGETS.items()}
        within = {target: point and point["us_per_period"] for target, point in times.items()}
        setup = max(point["setup_s"] for point in same)
        steps = {p["steps"] / p["periods"]: p["error"] for p in same if p["has_order"]}
        known = {"of": quantity_of(of).symbol, "order": order_of(steps), "setup_s": setup}
        yield {**best, "method": name, **known, **within}


def _point_table(rows: Sequence[Mapping[str, Any]], columns: Sequence[str], title: str) -> Table:
    """Return a table of some points, with their settings in words."""
    return Table([{**row, "setting": setting(row)} for row in rows], columns, title)


def setting(point: Mapping[str, Any]) -> str:
    """Return the setting of a point in words."""
    if point["tolerance"] is not None:
        return f"{point['tolerance']:.2g}"
    return f"{point['steps_a_period']:g} steps a period"


def error_of_point(point: Mapping[str, Any], error: str) -> float:
    """Return an error of a point by one of the values of `ERROR_KEYS`; infinity without one."""
    of_axis = point["error"] if point.get("measures") == "axis" else None
    off = point.get(error, of_axis)
    return math.inf if off is None else float(off)
