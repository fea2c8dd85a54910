"""A run: what is known of its motion, the plan, the end, the events, the errors, and the cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, Literal

from heavytop.analytic.enclosure import EVENTS
from heavytop.errors import Outcome
from heavytop.exact import decimals
from heavytop.exact.decimals import context
from heavytop.machine import version
from heavytop.results.base import (
    Number,
    Part,
    Result,
    SceneTables,
    Text,
    Value,
    Values,
    finite,
)
from heavytop.results.classification import MotionSummary, PlanSummary, warnings_of
from heavytop.scene.quantities import RATES, Need, need_of

if TYPE_CHECKING:  # a report reads results, and loads no integrator
    from heavytop.run.events import Event
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory import Decimals, Trajectory
    from heavytop.scene.scene import Scene

MOST_ROWS: Final = 10_000  # of the table of events; a saved trajectory has them all
NUMBER_DIGITS: Final = 15  # what a number of JSON surely holds; beyond them it is a text
LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "sympy", "mpmath", "python-flint")
MEASURED: Final = (
    "theta", "phi", "psi", "axis", "rates", "energy", "event_time", "input_rounding"
)  # fmt: skip
NOTHING: Final = dict.fromkeys(MEASURED) | {
    "invariants": {},
    "why_not": "nothing was integrated",
}


@dataclass(frozen=True, kw_only=True)
class EventRow(Part):
    """One event; more than 15 digits are a text."""

    kind: Text
    t: Value
    theta: Value = None
    phi: Value = None
    phidot: Value = None
    residual: Value = None


@dataclass(frozen=True, kw_only=True)
class EventTable(Part):
    """How many events of each kind there are, and the first of them; None is not asked for."""

    turning: int | None = None
    reversal: int | None = None
    cusp: int | None = None
    table: tuple[EventRow, ...] = ()
    omitted: int = 0


@dataclass(frozen=True, kw_only=True)
class RunCost(Part):
    """Steps, and the time that each part of the work took."""

    steps: int = 0
    derive_s: Number = 0.0
    compile_s: Number = 0.0
    integrate_s: Number = 0.0
    us_per_period: Number | None = None


@dataclass(frozen=True, kw_only=True)
class RunResult(Result):
    """Everything a run has to say; where nothing is integrated, what is known without it.

    Attributes
    ----------
    scene : SceneTables
    motion : MotionSummary
    constants : mapping from str to float
        E, E_prime, p_phi and p_psi.
    plan : PlanSummary
    final : mapping or None
        The motion at the end.
    events : EventTable
    errors : mapping
        As in `heavytop.Errors`.
    missed_digits : mapping from str to float
        Wanted quantities that are farther off than the scene's digits allow.
    missed_events : mapping from str to (int, int)
        The least and the greatest true number of the events that are miscounted.
    cost : RunCost
    outcome : Outcome
    warnings : tuple of str
        What no rigid body can be, a θ that was folded, what another kick would do.
    source : {"integrated", "closed form"}
        What the end and the events are from.
    """

    schema: Literal["heavytop/run/1"] = "heavytop/run/1"
    scene: SceneTables
    motion: MotionSummary
    constants: Values
    plan: PlanSummary
    final: Mapping[Text, Value | tuple[Value, ...]] | None = None
    events: EventTable = EventTable()
    errors: Mapping[Text, Value | Values] = field(default_factory=lambda: NOTHING)
    missed_digits: Values = field(default_factory=dict)
    missed_events: Mapping[Text, tuple[int, ...]] = field(default_factory=dict)
    cost: RunCost = RunCost()
    outcome: Outcome = Outcome.FINISHED
    warnings: tuple[Text, ...] = ()
    source: Text = "integrated"


def exact_result(run: SceneMotion, files: Mapping[str, str] | None = None) -> RunResult:
    """Return the result of a scene of which nothing is integrated.

    Parameters
    ----------
    run : SceneMotion
    files : mapping from str to str, optional
        Names and paths of the files written.

    Returns
    -------
    RunResult
        Its end and its events, but of a scene that wants its class and its period at most.
    """
    known = replace(_known(run), files=dict(files or {}))
    if not run.moves:
        return known
    return replace(known, final=_exact_final(run), events=EventTable(**run.counts))


def _known(run: Trajectory | SceneMotion) -> RunResult:
    """What is known of a scene and its plan without integrating."""
    scene, motion = run.scene, run.motion
    return RunResult(
        scene=SceneTables(**scene.document()),
        motion=MotionSummary.of(motion),
        constants=finite(dict(motion.constants.items())),
        plan=PlanSummary.of(run.plan),
        warnings=warnings_of(scene),
        source=run.source,
        versions={name: version(name) for name in LIBRARIES},
    )


def run_result(trajectory: Trajectory, files: Mapping[str, str] | None = None) -> RunResult:
    """Return the result of a run.

    Parameters
    ----------
    trajectory : Trajectory
    files : mapping from str to str, optional
        Names and paths of the files written.
    """
    from heavytop.run.verify import missed_digits, missed_events, run_errors

    errors = run_errors(trajectory)
    return replace(
        _known(trajectory),
        final=_final_of(trajectory),
        events=_events(trajectory),
        errors=finite(asdict(errors)),
        missed_digits=missed_digits(trajectory, errors),
        missed_events=missed_events(trajectory),
        cost=_cost(trajectory),
        outcome=trajectory.outcome,
        files=dict(files or {}),
    )


# --- the end -------------------------------------------------------------------------------------


def _final(
    end: Any, shown: Callable[[Any], Any], numbers: Any, *, attitude: bool
) -> dict[str, Any]:
    """The motion at the end, each number as `shown` has it; whole turns of an angle and the rest.

    `numbers` is what has their pi and their floor.
    """
    final = {name: shown(getattr(end, name)) for name in ("t", "theta")}
    for angle in ("phi", "psi"):
        turns, rest = split(getattr(end, angle), numbers)
        final |= {angle: shown(getattr(end, angle)), f"{angle}_turns": turns}
        final |= {f"{angle}_mod": shown(rest)}
    final |= {name: shown(getattr(end, name)) for name in RATES}
    final |= {name: tuple(map(shown, getattr(end, name))) for name in ("axis", "omega")}
    return final | {"quaternion": tuple(map(shown, end.quaternion)) if attitude else None}


def _final_of(trajectory: Trajectory) -> dict[str, Any]:
    attitude = need_of(trajectory.scene.quantities) >= Need.PSI
    if (many := trajectory.decimals) is None:
        end = trajectory(trajectory.orbit.end)
        final = _final(end, finite, math, attitude=attitude)
        return final | _reaction(trajectory.scene, end)
    final = _final(many.samples[-1], partial(_shown, many), many.ctx, attitude=attitude)
    return final | _reaction(trajectory.scene, many.samples[-1])


def _reaction(scene: Scene, end: Any) -> dict[str, Any]:
    """The force of the pivot at the end [N], in doubles, where it is known."""
    if scene.top.mass is None:
        return {}
    axis, omega = ([float(x) for x in getattr(end, name)] for name in ("axis", "omega"))
    return {"reaction": tuple(map(finite, scene.top.reaction(axis, omega)))}


def _exact_final(run: SceneMotion) -> dict[str, Any]:
    ctx, digits = context(run.digits), run.scene.digits

    def shown(x: decimals.Number) -> float | str:
        return str(ctx.nstr(x, digits)) if digits > NUMBER_DIGITS else float(x)

    return _final(run.end, shown, ctx, attitude=True) | _reaction(run.scene, run.end)


def split(angle: Any, math: Any) -> tuple[int | None, Any]:
    """Whole turns and the rest, by the pi and the floor of `math`."""
    if angle != angle:
        return None, angle
    turns = int(math.floor(angle / (2 * math.pi)))
    return turns, angle - turns * 2 * math.pi


# --- events and cost -----------------------------------------------------------------------------


def _events(trajectory: Trajectory) -> EventTable:
    events, many = trajectory.events, trajectory.decimals
    if many is None:
        table = tuple(EventRow(**finite(row)) for row in events.table(MOST_ROWS))
    else:
        table = tuple(_row(many, event) for event in many.events[:MOST_ROWS])
    counts = {event: events.count(event) for event in EVENTS}
    return EventTable(**counts, table=table, omitted=len(events) - len(table))


def _row(many: Decimals, event: Event) -> EventRow:
    names = ("t", "theta", "phi", "phidot")
    row = {name: _shown(many, getattr(event.sample, name)) for name in names}
    return EventRow(kind=event.kind, residual=float(event.residual), **row)


def _shown(many: Decimals, x: decimals.Number) -> float | str | None:
    """Return a number as JSON has it, None for nan."""
    text = many.text(x)
    return text if text is None or many.digits > NUMBER_DIGITS else float(x)


def _cost(trajectory: Trajectory) -> RunCost:
    spent = trajectory.statistics
    period = trajectory.motion.period if spent.whole else None
    periods = abs(trajectory.orbit.end) / float(period) if period else 0.0
    names = ("steps", "derive_s", "compile_s", "integrate_s")
    return RunCost(
        **{name: getattr(spent, name) for name in names},
        us_per_period=finite(spent.integrate_s / periods * 1e6) if periods else None,
    )
