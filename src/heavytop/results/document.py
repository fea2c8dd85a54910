"""The run document, schema heavytop/run/1: everything a run has to say, as plain values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Any

from heavytop.analytic.motion import Motion
from heavytop.errors import Outcome
from heavytop.machine import version
from heavytop.results.classification import constants_document, finite, motion_document
from heavytop.results.final import event_rows, final_document, shown, split
from heavytop.results.plan_document import chosen_document
from heavytop.run.events import EVENTS
from heavytop.run.planning import Plan, closed_form_of
from heavytop.run.trajectory import Trajectory
from heavytop.run.verify import Errors, missed_digits, missed_events, run_errors
from heavytop.scene.scene import Scene

SCHEMA = "heavytop/run/1"
MOST_ROWS = 10_000  # of the table of events; a saved trajectory has them all
_LIBRARIES = ("heavytop", "heyoka", "numpy", "sympy", "mpmath", "python-flint")


def run_document(trajectory: Trajectory, files: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Return the document of a run: scene, motion, constants, plan, events, errors, cost.

    Parameters
    ----------
    trajectory : Trajectory
    files : mapping from str to str, optional
        Names and paths of the files written.
    """
    errors = run_errors(trajectory)
    return _document(trajectory.scene, trajectory.motion, trajectory.plan) | {
        "final": _final(trajectory),
        "events": _events(trajectory),
        "errors": {k: finite(v) for k, v in asdict(errors).items()},
        "missed_digits": missed_digits(trajectory, errors),
        "missed_events": {name: list(true) for name, true in missed_events(trajectory).items()},
        "cost": _cost(trajectory),
        "outcome": str(trajectory.outcome),
        "files": dict(files or {}),
    }


def known_document(scene: Scene, chosen: Plan) -> dict[str, Any]:
    """Return the document of a scene of which nothing has to be integrated.

    Parameters
    ----------
    scene : Scene
        It wants its class and its period at most.
    chosen : Plan
    """
    return _document(scene, closed_form_of(scene), chosen)


def _document(scene: Scene, motion: Motion, chosen: Plan) -> dict[str, Any]:
    """What is known before anything is integrated, and nothing in place of the rest."""
    nothing = Errors(None, None, None, None, 0.0, {}, None, None, "nothing was integrated")
    costs = dict.fromkeys(("derive_s", "compile_s", "integrate_s"), 0.0)
    return {
        "schema": SCHEMA,
        "scene": scene.document(),
        "motion": motion_document(motion),
        "constants": constants_document(motion),
        "plan": chosen_document(chosen),
        "final": None,
        "events": dict.fromkeys(EVENTS) | {"table": [], "omitted": 0},
        "errors": {k: finite(v) for k, v in asdict(nothing).items()} | {"energy": None},
        "missed_digits": {},
        "missed_events": {},
        "cost": {"steps": 0, **costs, "us_per_period": None},
        "outcome": str(Outcome.FINISHED),
        "files": {},
        "versions": {name: version(name) for name in _LIBRARIES},
    }


def _final(trajectory: Trajectory) -> dict[str, Any]:
    attitude = bool({"attitude", "psi"} & set(trajectory.scene.quantities))
    if (decimals := trajectory.decimals) is None:
        end, told, numbers = trajectory(trajectory.orbit.end), finite, math
    else:
        end, told, numbers = decimals.samples[-1], partial(shown, decimals), decimals.ctx
    turned = lambda angle: split(getattr(end, angle), numbers)  # noqa: E731
    return final_document(end, told, turned, attitude=attitude)


def _events(trajectory: Trajectory) -> dict[str, Any]:
    events = trajectory.events
    counts = {event: events.count(event) for event in EVENTS}
    table = [
        {name: finite(value) for name, value in row.items()} for row in events.table(MOST_ROWS)
    ]
    if trajectory.decimals is not None:
        table = event_rows(trajectory.decimals, MOST_ROWS)
    return counts | {"table": table, "omitted": len(events) - len(table)}


def _cost(trajectory: Trajectory) -> dict[str, Any]:
    spent = trajectory.statistics
    period = trajectory.motion.period if spent.whole else None
    periods = abs(trajectory.orbit.end) / float(period) if period else 0.0
    names = ("steps", "derive_s", "compile_s", "integrate_s")
    return {name: getattr(spent, name) for name in names} | {
        "us_per_period": finite(spent.integrate_s / periods * 1e6) if periods else None
    }
