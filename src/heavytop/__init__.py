"""The axisymmetric heavy top: derived, integrated by Taylor's method, held against the truth.

Names are imported when they are first used, so that ``import heavytop`` costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOMES = {
    "Atlas": "atlases.atlas",
    "BadScene": "errors",
    "Circuit": "circuit",
    "Drift": "drifts.drift",
    "Enclosure": "balls",
    "DoubtfulWarning": "errors",
    "EndedEarly": "errors",
    "EnergyMomentum": "diagram",
    "Errors": "witness",
    "Exact": "exact",
    "Facts": "derived",
    "Folded": "folded",
    "ForeignFile": "errors",
    "ForeignStudy": "errors",
    "ForeignWorker": "errors",
    "HeavyTopError": "errors",
    "ImpossibleStart": "errors",
    "ImpossibleTop": "errors",
    "InUse": "errors",
    "Kind": "kinds",
    "MissedDigitsWarning": "errors",
    "MissingPackage": "errors",
    "Motion": "motion",
    "Motions": "motions",
    "NoClosedForm": "errors",
    "NoScheduler": "errors",
    "NoWorkerWarning": "errors",
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
    "Validation": "claims.validation",
    "Verdict": "kinds",
    "WorkPrecision": "workprecs.work_precision",
    "WrongType": "errors",
    "atlas": "atlases.mapping",
    "classify": "kinds.certify",
    "classify_many": "kinds.many",
    "drift": "drifts.drifting",
    "enclose": "balls",
    "energy_momentum": "diagram",
    "extend": "continuation",
    "facts": "derived",
    "fold": "folded",
    "load_atlas": "atlases.mapping",
    "load_scene": "scene",
    "load_trajectory": "archive",
    "merge_atlases": "atlases.mapping",
    "motions_many": "motions",
    "plan": "planning",
    "propagate": "propagation",
    "propagate_many": "ensemble",
    "resume": "resuming",
    "run_errors": "witness",
    "sensitivities": "sensitivity",
    "state_transition": "transition",
    "stress": "stresses.stressing",
    "validate": "claims.validating",
    "work_precision": "workprecs.measuring",
}

__all__ = [
    "Atlas",
    "BadScene",
    "Circuit",
    "DoubtfulWarning",
    "Drift",
    "Enclosure",
    "EndedEarly",
    "EnergyMomentum",
    "Errors",
    "Exact",
    "Facts",
    "Folded",
    "ForeignFile",
    "ForeignStudy",
    "ForeignWorker",
    "HeavyTopError",
    "ImpossibleStart",
    "ImpossibleTop",
    "InUse",
    "Kind",
    "MissedDigitsWarning",
    "MissingPackage",
    "Motion",
    "Motions",
    "NoClosedForm",
    "NoScheduler",
    "NoWorkerWarning",
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
    "Validation",
    "Verdict",
    "WorkPrecision",
    "WrongType",
    "atlas",
    "classify",
    "classify_many",
    "drift",
    "enclose",
    "energy_momentum",
    "extend",
    "facts",
    "fold",
    "load_atlas",
    "load_scene",
    "load_trajectory",
    "merge_atlases",
    "motions_many",
    "plan",
    "propagate",
    "propagate_many",
    "resume",
    "run_errors",
    "sensitivities",
    "state_transition",
    "stress",
    "validate",
    "work_precision",
]

if TYPE_CHECKING:
    from heavytop.archive import load_trajectory
    from heavytop.atlases.atlas import Atlas
    from heavytop.atlases.mapping import atlas, load_atlas, merge_atlases
    from heavytop.balls import Enclosure, enclose
    from heavytop.circuit import Circuit
    from heavytop.claims.validating import validate
    from heavytop.claims.validation import Validation
    from heavytop.continuation import extend
    from heavytop.derived import Facts, facts
    from heavytop.diagram import EnergyMomentum, energy_momentum
    from heavytop.drifts.drift import Drift
    from heavytop.drifts.drifting import drift
    from heavytop.ensemble import propagate_many
    from heavytop.errors import (
        BadScene,
        DoubtfulWarning,
        EndedEarly,
        ForeignFile,
        ForeignStudy,
        ForeignWorker,
        HeavyTopError,
        ImpossibleStart,
        ImpossibleTop,
        InUse,
        MissedDigitsWarning,
        MissingPackage,
        NoClosedForm,
        NoScheduler,
        NoWorkerWarning,
        StoppedEarly,
        WrongType,
    )
    from heavytop.exact import Exact
    from heavytop.folded import Folded, fold
    from heavytop.kinds import Kind, Verdict
    from heavytop.kinds.certify import classify
    from heavytop.kinds.many import classify_many
    from heavytop.motion import Motion
    from heavytop.motions import Motions, motions_many
    from heavytop.planning import Plan, plan
    from heavytop.propagation import propagate
    from heavytop.quantities import Sample
    from heavytop.resuming import resume
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
    module = sys.modules[__name__]  # with it Python says which name may have been meant
    raise AttributeError(f"module 'heavytop' has no attribute '{name}'", name=name, obj=module)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
