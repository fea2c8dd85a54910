"""The axisymmetric heavy top: derived, integrated by Taylor's method, held against the truth.

Names are imported when they are first used, so that ``import heavytop`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOMES = {
    "BadScene": "errors",
    "Drift": "drifts.drift",
    "Enclosure": "balls",
    "EndedEarly": "errors",
    "Errors": "witness",
    "Exact": "exact",
    "Facts": "facts",
    "Folded": "folded",
    "ForeignFile": "errors",
    "ForeignStudy": "errors",
    "HeavyTopError": "errors",
    "ImpossibleStart": "errors",
    "ImpossibleTop": "errors",
    "InUse": "errors",
    "Kind": "kinds",
    "MissingPackage": "errors",
    "Motion": "motion",
    "NoClosedForm": "errors",
    "Plan": "planning",
    "Sample": "quantities",
    "Scene": "scene",
    "Sensitivities": "sensitivity",
    "State": "state",
    "StoppedEarly": "errors",
    "Stress": "stresses.stress",
    "Top": "top",
    "Trajectory": "trajectory",
    "Transition": "transition",
    "Verdict": "kinds",
    "WorkPrecision": "workprecs.work_precision",
    "classify": "kinds.certify",
    "classify_many": "kinds.many",
    "drift": "drifts.drifting",
    "enclose": "balls",
    "extend": "propagation",
    "fold": "folded",
    "load_scene": "scene",
    "load_trajectory": "archive",
    "plan": "planning",
    "propagate": "propagation",
    "propagate_many": "ensemble",
    "resume": "drifts.drifting",
    "run_errors": "witness",
    "sensitivities": "sensitivity",
    "state_transition": "transition",
    "stress": "stresses.stressing",
    "work_precision": "workprecs.measuring",
}

__all__ = [
    "BadScene",
    "Drift",
    "Enclosure",
    "EndedEarly",
    "Errors",
    "Exact",
    "Facts",
    "Folded",
    "ForeignFile",
    "ForeignStudy",
    "HeavyTopError",
    "ImpossibleStart",
    "ImpossibleTop",
    "InUse",
    "Kind",
    "MissingPackage",
    "Motion",
    "NoClosedForm",
    "Plan",
    "Sample",
    "Scene",
    "Sensitivities",
    "State",
    "StoppedEarly",
    "Stress",
    "Top",
    "Trajectory",
    "Transition",
    "Verdict",
    "WorkPrecision",
    "classify",
    "classify_many",
    "drift",
    "enclose",
    "extend",
    "fold",
    "load_scene",
    "load_trajectory",
    "plan",
    "propagate",
    "propagate_many",
    "resume",
    "run_errors",
    "sensitivities",
    "state_transition",
    "stress",
    "work_precision",
]

if TYPE_CHECKING:
    from heavytop.archive import load_trajectory
    from heavytop.balls import Enclosure, enclose
    from heavytop.drifts.drift import Drift
    from heavytop.drifts.drifting import drift, resume
    from heavytop.ensemble import propagate_many
    from heavytop.errors import (
        BadScene,
        EndedEarly,
        ForeignFile,
        ForeignStudy,
        HeavyTopError,
        ImpossibleStart,
        ImpossibleTop,
        InUse,
        MissingPackage,
        NoClosedForm,
        StoppedEarly,
    )
    from heavytop.exact import Exact
    from heavytop.facts import Facts
    from heavytop.folded import Folded, fold
    from heavytop.kinds import Kind, Verdict
    from heavytop.kinds.certify import classify
    from heavytop.kinds.many import classify_many
    from heavytop.motion import Motion
    from heavytop.planning import Plan, plan
    from heavytop.propagation import extend, propagate
    from heavytop.quantities import Sample
    from heavytop.scene import Scene, load_scene
    from heavytop.sensitivity import Sensitivities, sensitivities
    from heavytop.state import State
    from heavytop.stresses.stress import Stress
    from heavytop.stresses.stressing import stress
    from heavytop.top import Top
    from heavytop.trajectory import Trajectory
    from heavytop.transition import Transition, state_transition
    from heavytop.witness import Errors, run_errors
    from heavytop.workprecs.measuring import work_precision
    from heavytop.workprecs.work_precision import WorkPrecision


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f"heavytop.{_HOMES[name]}"), name)
        globals()[name] = value  # the function, not the module of the same name
        return value
    raise AttributeError(f"module 'heavytop' has no attribute '{name}'")


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
