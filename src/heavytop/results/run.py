"""The result of a run: motion, plan, end, events, errors, and cost."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

from heavytop.doctor import versions
from heavytop.errors import Outcome
from heavytop.exact.decimals import context
from heavytop.results import classification
from heavytop.results.base import error_text
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import ANGLES, RATES, Need, derived, need_of, quantity_of, values_of
from heavytop.scene.scene_file import EVENTS

if TYPE_CHECKING:  # a report reads results, and loads no integrator
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory import Trajectory

DOCUMENT, TRAJECTORY = "run.json", "trajectory.nc"
ROUNDING: Final = 32 * sys.float_info.epsilon  # of the largest in a column
FIRST_EVENTS: Final = 8  # rows shown at a terminal; the rest is counted
EVENT_ROWS: Final = 10_000  # of the table of events; a saved trajectory has them all
NUMBER_DIGITS: Final = 15  # what a number of JSON surely holds; beyond them it is a text
AsNumber = Callable[[Any], float | str | None]
"""A function to a number as JSON has it: a text, where it has more digits than that holds."""
ERROR_NAMES: Final = (
    "theta", "phi", "psi", "axis", "rates", "energy", "event_time", "input_rounding"
)  # fmt: skip
NOT_RUN: Final = {"invariants": {}, "why_not": "nothing was integrated"}
NO_ERRORS: Final = dict.fromkeys(ERROR_NAMES) | NOT_RUN
TIMES: Final = ("derive_s", "compile_s", "integrate_s")
AT_POLE: Final = "φ jumps by π: the value before or after it is given; φ̇ is the limit"
NO_EVENTS: Final = {**dict.fromkeys(EVENTS), "table": (), "omitted": 0}
FIGURES: Final[Mapping[str, tuple[str, tuple[str, ...]]]] = {
    "overview": (
        "tilt over precession or time, and the path of the axis on the unit sphere",
        ("loop", "sphere"),
    ),
    "angles": ("tilt, precession and rate of spin over time", ("theta", "phi", "psidot")),
    "potential": ("effective potential, energy, and allowed tilts", ("potential",)),
    "phase": ("the plane of tilt and tilt rate, with neighbouring energies", ("phase",)),
    "errors": ("distance of the run from the closed form over time", ("errors",)),
}  # fmt: skip
"""The figures of a run by the names of their files: a title, and the pictures side by side."""
NO_COST: Final = {"steps": 0, **dict.fromkeys(TIMES, 0.0), "us_per_period": None}


class RunResult(classification.MotionResult):
    """The result of a run; where nothing is integrated, what the closed form gives.

    Attributes
    ----------
    scene, motion, top, constants, warnings
        As of `heavytop.results.classification.MotionResult`.
    plan : mapping
        As `heavytop.results.classification.plan_summary` gives it.
    final : mapping or None
        The motion at the end.
    events : mapping
        The number of events of each kind, None where they are not asked for; the first of them as
        ``table``, and how many are ``omitted`` from it. More than 15 digits are a text.
    errors : mapping
        As in `heavytop.Errors`, with what is ``derived`` among the others.
    missed_digits : mapping from str to float
        Errors of wanted quantities that are larger than the scene's digits allow.
    missed_events : mapping from str to (int, int)
        The least and the greatest true number of the events that are miscounted.
    cost : mapping
        Steps, and the time that each part of the work took.
    outcome : str
        One of `heavytop.errors.Outcome`.
    source : {"integrated", "closed form"}
        From what the end and the events are.
    run : Trajectory or SceneMotion or None
        The motion over the span; None where the scene does not want it, or its file is missing.
    """

    schema: ClassVar = "heavytop/run/1"
    heading: ClassVar = "Run"
    data_file: ClassVar = TRAJECTORY
    left_out: ClassVar = ("run",)

    plan: Any
    final: Any = None
    events: Any = field(default_factory=lambda: NO_EVENTS)
    errors: Any = field(default_factory=lambda: NO_ERRORS)
    missed_digits: Mapping[str, Any] = field(default_factory=dict)
    missed_events: Mapping[str, Any] = field(default_factory=dict)
    cost: Any = field(default_factory=lambda: NO_COST)
    outcome: str = Outcome.FINISHED
    source: str = "integrated"
    run: Any = field(default=None, compare=False)

    def save_data(self, folder: Path) -> dict[str, str]:
        """Write ``trajectory.nc``, or remove that of an earlier run where there is no motion.

        Parameters
        ----------
        folder : Path
        """
        if self.run is None:
            (folder / TRAJECTORY).unlink(missing_ok=True)
            return {}
        self.run.save(folder / TRAJECTORY)
        return {"trajectory": TRAJECTORY}

    def figures(self) -> Iterator[tuple[str, str, Callable[[], Any]]]:
        """Yield the figures of the motion, if there is one."""
        if self.run is not None:
            yield from import_module("heavytop.plots.figures").run_figures(self.run)

    def facts(self) -> Iterator[Fact]:
        """Yield what is known without integrating, the plan, the end, the errors and the cost."""
        yield from super().facts()
        yield from classification.plan_facts(self.plan)
        yield from self.notes()
        if self.final:
            follow = (name for name in self.final if quantity_of(name).of)
            yield from classification.numbers(self.final, "t", *ANGLES, *follow)
            counts = (f"{n} {name}" for name in EVENTS if (n := self.events[name]) is not None)
            yield "events", ", ".join(counts) or "none requested"
        if self.outcome != Outcome.FINISHED:
            yield "outcome", self.outcome
        known = {name: x for name, x in self.errors.items() if isinstance(x, float)}
        sizes = (f"{name.replace('_', ' ')} {error_text(name, x)}" for name, x in known.items())
        words = [*sizes, *filter(None, [self.errors.why_not])]
        yield "errors", f"against the closed form: {', '.join(words)}"
        if self.events.table and self.motion.kind.startswith("through-"):
            yield "at the pole", AT_POLE
        spent = [f"{name[:-2]} {1000 * self.cost[name]:.1f} ms" for name in TIMES]
        pace = self.cost.us_per_period
        spent += [] if pace is None else [f"{pace:.4g} µs a period"]
        yield "cost", ", ".join([f"{self.cost.steps} steps", *spent])

    def tables(self) -> Iterator[Table]:
        """Yield the table of the events."""
        if self.events.table:
            yield event_table(self.events)


def run_result(run: Trajectory | SceneMotion) -> RunResult:
    """Return the result of a run, integrated or not."""
    from heavytop.run.trajectory import Trajectory

    scene, motion = run.scene, run.motion
    found: dict[str, Any] = {}
    if isinstance(run, Trajectory):
        found = _integration_facts(run)
    elif run.moves:
        ctx, digits = context(run.digits), scene.digits
        as_number: AsNumber = float if digits <= NUMBER_DIGITS else partial(ctx.nstr, n=digits)
        final = _end_facts(run, ctx, as_number, attitude=True)
        found = {"final": final, "events": NO_EVENTS | run.counts}
    return RunResult.of(
        scene,
        motion,
        classification.motion_summary(motion),
        plan=classification.plan_summary(run.plan),
        source=run.source,
        versions=versions(),
        run=run if found else None,
        **found,
    )


def _integration_facts(run: Trajectory) -> dict[str, Any]:
    """Return the fields of the result of an integrated run."""
    from heavytop.run.verify import misses, run_errors

    arithmetic = math if run.in_doubles else run.ctx
    as_number: AsNumber = float if run.in_doubles or run.scene.digits <= NUMBER_DIGITS else run.text
    attitude = need_of(run.scene.quantities) >= Need.PSI
    errors, missed = asdict(run_errors(run)), misses(run)
    return {
        "final": _end_facts(run, arithmetic, as_number, attitude=attitude),
        "events": _events(run, as_number),
        "errors": errors | errors.pop("derived"),
        "missed_digits": missed.digits,
        "missed_events": missed.events,
        "cost": _cost(run),
        "outcome": run.outcome,
    }


def _end_facts(
    run: Trajectory | SceneMotion, arithmetic: Any, as_number: AsNumber, *, attitude: bool
) -> dict[str, Any]:
    """Return the motion at the end; pi of whole turns is that of `arithmetic`."""
    names = ("t", *ANGLES, *RATES, "axis", "omega", "quaternion", *derived(run.scene.top))
    final: dict[str, Any] = {"quaternion": None}
    for name in [x for x in names if attitude or x != "quaternion"]:
        value = values_of(run.end, name, run.motion)
        final[name] = tuple(map(as_number, value)) if quantity_of(name).parts else as_number(value)
    for angle in ("phi", "psi"):
        turns, rest = split_turns(getattr(run.end, angle), arithmetic)
        final |= {f"{angle}_turns": turns, f"{angle}_mod": as_number(rest)}
    return final


def split_turns(angle: Any, math: Any) -> tuple[int | None, Any]:
    """Return whole turns and the rest of an angle, by the pi and the floor of `math`."""
    if angle != angle:
        return None, angle
    turns = int(math.floor(angle / (2 * math.pi)))
    return turns, angle - turns * 2 * math.pi


def _events(run: Trajectory, as_number: AsNumber) -> dict[str, Any]:
    """Return the number of events of each kind, and the first of them as a table."""
    events = run.events
    table = events.table(EVENT_ROWS)
    for name, values in (events.own or {}).items():  # with all the digits of the run
        for row, value in zip(table, values, strict=False):
            if name in row and name != "residual":
                row[name] = as_number(value)
    counts = {event: events.count(event) for event in EVENTS}
    return {**counts, "table": table, "omitted": len(events) - len(table)}


def _cost(run: Trajectory) -> dict[str, Any]:
    """Return the number of steps, and the time that each part of the work took."""
    spent, period = run.statistics, run.motion.period
    periods = abs(run.orbit.end) / float(period) if spent.whole and period else 0.0
    found = {name: getattr(spent, name) for name in ("steps", *TIMES)}
    return found | {"us_per_period": spent.integrate_s / periods * 1e6 if periods else None}


def event_table(events: Any) -> Table:
    """Return the table of the events, shown in as many digits as fit."""
    columns = {n: clean(row[n] for row in events.table) for n in ("t", "theta", "phi", "phidot")}
    rows = [
        {"event": row.kind, "residual": row.residual} | {n: x[k] for n, x in columns.items()}
        for k, row in enumerate(events.table)
    ]
    return Table(rows, ("event", *columns, "residual"), first=FIRST_EVENTS, more=events.omitted)


def clean(values: Iterable[Any]) -> list[float | None]:
    """Return the numbers of a column, with 0 for those within the rounding of the largest.

    Examples
    --------
    >>> clean([-15, -7.1e-15, "12.3", None])
    [-15.0, 0.0, 12.3, None]
    """
    found = [None if value is None else float(value) for value in values]
    least = ROUNDING * max((abs(value) for value in found if value is not None), default=0.0)
    return [0.0 if value is not None and abs(value) < least else value for value in found]
