"""A run: what is known of its motion, the plan, the end, the events, the errors, and the cost."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

from heavytop.analytic.events import EVENTS
from heavytop.doctor import version
from heavytop.errors import Outcome
from heavytop.exact import decimals
from heavytop.exact.decimals import context
from heavytop.results import run_texts
from heavytop.results.base import Fact, Result, Table
from heavytop.results.classification import motion_summary, plan_summary, warnings_of
from heavytop.scene.quantities import RATES, Need, need_of

if TYPE_CHECKING:  # a report reads results, and loads no integrator
    from heavytop.run.exact import SceneMotion
    from heavytop.run.trajectory import Trajectory
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


class RunFigure(NamedTuple):
    """A figure of a run: what it shows, and its panels, by the names that `plot` has for them."""

    title: str
    panels: tuple[str, ...]


PICTURES: Final = {
    "overview": RunFigure(
        "tilt over precession, and the path of the axis on the unit sphere", ("loop", "sphere")
    ),
    "angles": RunFigure("tilt, precession and rate of spin over time", ("theta", "phi", "psidot")),
    "potential": RunFigure("effective potential, energy, and allowed tilts", ("potential",)),
    "phase": RunFigure("the plane of tilt and tilt rate, with neighbouring energies", ("phase",)),
    "errors": RunFigure("distance of the run from the closed form over time", ("errors",)),
}
"""The figures of a run, by the name of the file."""

NO_EVENTS: Final = {"turning": None, "reversal": None, "cusp": None, "table": (), "omitted": 0}
NO_COST: Final = {
    "steps": 0, "derive_s": 0.0, "compile_s": 0.0, "integrate_s": 0.0, "us_per_period": None
}  # fmt: skip


@dataclass(frozen=True, kw_only=True, repr=False)
class RunResult(Result):
    """Everything a run has to say; where nothing is integrated, what is known without it.

    Attributes
    ----------
    scene : mapping
        As `heavytop.Scene.document` gives it.
    motion : mapping
        As `heavytop.results.classification.motion_summary` gives it.
    constants : mapping from str to float
        E, E_prime, p_phi and p_psi.
    plan : mapping
        As `heavytop.results.classification.plan_summary` gives it.
    final : mapping or None
        The motion at the end.
    events : mapping
        How many events there are of each kind, None where they are not asked for; the first of
        them as ``table``, and how many are ``omitted`` from it. More than 15 digits are a text.
    errors : mapping
        As in `heavytop.Errors`.
    missed_digits : mapping from str to float
        Wanted quantities that are farther off than the scene's digits allow.
    missed_events : mapping from str to (int, int)
        The least and the greatest true number of the events that are miscounted.
    cost : mapping
        Steps, and the time that each part of the work took.
    outcome : str
        One of `heavytop.errors.Outcome`.
    warnings : tuple of str
        What no rigid body can be, a θ that was folded, what another kick would do.
    source : {"integrated", "closed form"}
        What the end and the events are from.
    """

    schema: ClassVar = "heavytop/run/1"
    heading: ClassVar = "Run"

    scene: Any
    motion: Any
    constants: Any
    plan: Any
    final: Any = None
    events: Any = field(default_factory=lambda: NO_EVENTS)
    errors: Any = field(default_factory=lambda: NOTHING)
    missed_digits: Mapping[str, Any] = field(default_factory=dict)
    missed_events: Mapping[str, Any] = field(default_factory=dict)
    cost: Any = field(default_factory=lambda: NO_COST)
    outcome: str = Outcome.FINISHED
    warnings: tuple[str, ...] = ()
    source: str = "integrated"

    def facts(self) -> Iterator[Fact]:
        """What is known without integrating, the plan, the end, the errors and the cost."""
        return run_texts.run_facts(self)

    def tables(self) -> Iterator[Table]:
        """The events."""
        yield from run_texts.event_tables(self.events)


def run_result(run: Trajectory | SceneMotion, files: Mapping[str, str] | None = None) -> RunResult:
    """Return the result of a run; of a scene that nothing is integrated of what is known.

    Parameters
    ----------
    run : Trajectory or SceneMotion
    files : mapping from str to str, optional
        Names and paths of the files written.
    """
    from heavytop.run.exact import SceneMotion

    known = replace(_known(run), files=dict(files or {}))
    if not isinstance(run, SceneMotion):
        return _integrated(run, known)
    if not run.moves:
        return known
    return replace(known, final=_exact_final(run), events=NO_EVENTS | run.counts)


def _integrated(trajectory: Trajectory, known: RunResult) -> RunResult:
    from heavytop.run.verify import missed_digits, missed_events, run_errors

    errors = run_errors(trajectory)
    return replace(
        known,
        final=_final_of(trajectory),
        events=_events(trajectory),
        errors=asdict(errors),
        missed_digits=missed_digits(trajectory),
        missed_events=missed_events(trajectory),
        cost=_cost(trajectory),
        outcome=trajectory.outcome,
    )


def _known(run: Trajectory | SceneMotion) -> RunResult:
    """What is known of a scene and its plan without integrating."""
    scene, motion = run.scene, run.motion
    return RunResult(
        scene=scene.document(),
        motion=motion_summary(motion),
        constants=motion.constants._asdict(),
        plan=plan_summary(run.plan),
        warnings=warnings_of(scene),
        source=run.source,
        versions={name: version(name) for name in LIBRARIES},
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
    numbers = math if trajectory.in_doubles else trajectory.ctx
    final = _final(trajectory.end, partial(_shown, trajectory), numbers, attitude=attitude)
    return final | _reaction(trajectory.scene, trajectory.end)


def _reaction(scene: Scene, end: Any) -> dict[str, Any]:
    """The force of the pivot at the end [N], in doubles, where it is known."""
    if scene.top.mass is None:
        return {}
    axis, omega = ([float(x) for x in getattr(end, name)] for name in ("axis", "omega"))
    return {"reaction": scene.top.reaction(axis, omega).tolist()}


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


def _events(trajectory: Trajectory) -> dict[str, Any]:
    events = trajectory.events
    table = events.table(MOST_ROWS)
    if events.own is not None:
        for i, row in enumerate(table):
            own = {name: _shown(trajectory, x[i]) for name, x in events.own.items() if name in row}
            row |= own | {"residual": row["residual"]}
    counts = {event: events.count(event) for event in EVENTS}
    return {**counts, "table": table, "omitted": len(events) - len(table)}


def _shown(trajectory: Trajectory, x: decimals.Number) -> float | str | None:
    """Return a number as JSON has it, None for nan."""
    if trajectory.in_doubles:
        return float(x)
    text = trajectory.text(x)
    return text if text is None or trajectory.scene.digits > NUMBER_DIGITS else float(x)


def _cost(trajectory: Trajectory) -> dict[str, Any]:
    spent = trajectory.statistics
    period = trajectory.motion.period if spent.whole else None
    periods = abs(trajectory.orbit.end) / float(period) if period else 0.0
    names = ("steps", "derive_s", "compile_s", "integrate_s")
    found = {name: getattr(spent, name) for name in names}
    return found | {"us_per_period": spent.integrate_s / periods * 1e6 if periods else None}
