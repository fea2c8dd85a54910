"""The axisymmetric heavy top: derived, integrated by Taylor's method, held against the truth.

Names are imported when they are first used, so that ``import heavytop`` costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOMES = {
    "Atlas": "studies.atlas",
    "BadScene": "errors",
    "Check": "checking.judge",
    "Circuit": "analytic.monodromy",
    "Drift": "studies.drift_result",
    "Enclosure": "analytic.enclosure",
    "DoubtfulWarning": "errors",
    "EndedEarly": "errors",
    "EnergyMomentum": "analytic.energy_momentum",
    "Errors": "run.verify",
    "Exact": "numbers",
    "Facts": "analytic.facts",
    "Folded": "run.periodic",
    "ForeignFile": "errors",
    "ForeignStudy": "errors",
    "ForeignWorker": "errors",
    "HeavyTopError": "errors",
    "ImpossibleStart": "errors",
    "ImpossibleTop": "errors",
    "InUse": "errors",
    "Kind": "classification",
    "MissedDigitsWarning": "errors",
    "MissingPackage": "errors",
    "Motion": "analytic.motion",
    "Motions": "analytic.many_motions",
    "NoClosedForm": "errors",
    "NoScheduler": "errors",
    "NoWorkerWarning": "errors",
    "Plan": "run.planning",
    "Reference": "analytic.reference",
    "Sample": "integration.outputs",
    "Scene": "scene.scene",
    "Sensitivities": "run.sensitivities",
    "State": "scene.state",
    "StoppedEarly": "errors",
    "Stress": "studies.stress",
    "Top": "scene.top",
    "Trajectory": "run.trajectory",
    "Transition": "run.sensitivities",
    "Validation": "claims.validate",
    "Verdict": "classification",
    "WorkPrecision": "studies.work_precision",
    "WrongType": "errors",
    "atlas": "studies.atlas",
    "check": "checking.judge",
    "classify": "classification.classify",
    "classify_many": "classification.many",
    "drift": "studies.drift",
    "enclose": "analytic.enclosure",
    "energy_momentum": "analytic.energy_momentum",
    "extend": "run.propagation",
    "facts": "analytic.facts",
    "fold": "run.periodic",
    "load_atlas": "studies.atlas",
    "load_scene": "scene.scene",
    "load_trajectory": "run.trajectory_file",
    "merge_atlases": "studies.atlas",
    "motions_many": "analytic.many_motions",
    "plan": "run.planning",
    "propagate": "run.propagation",
    "propagate_many": "run.ensemble",
    "reference": "analytic.reference",
    "resume": "studies.resume",
    "run_errors": "run.verify",
    "sensitivities": "run.sensitivities",
    "state_transition": "run.sensitivities",
    "stress": "studies.stress",
    "validate": "claims.validate",
    "work_precision": "studies.work_precision",
}

__all__ = [
    "Atlas",
    "BadScene",
    "Check",
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
    "Reference",
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
    "check",
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
    "reference",
    "resume",
    "run_errors",
    "sensitivities",
    "state_transition",
    "stress",
    "validate",
    "work_precision",
]

if TYPE_CHECKING:
    from heavytop.analytic.enclosure import Enclosure, enclose
    from heavytop.analytic.energy_momentum import EnergyMomentum, energy_momentum
    from heavytop.analytic.facts import Facts, facts
    from heavytop.analytic.many_motions import Motions, motions_many
    from heavytop.analytic.monodromy import Circuit
    from heavytop.analytic.motion import Motion
    from heavytop.analytic.reference import Reference, reference
    from heavytop.checking.judge import Check, check
    from heavytop.claims.validate import Validation, validate
    from heavytop.classification import Kind, Verdict
    from heavytop.classification.classify import classify
    from heavytop.classification.many import classify_many
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
    from heavytop.integration.outputs import Sample
    from heavytop.numbers import Exact
    from heavytop.run.ensemble import propagate_many
    from heavytop.run.periodic import Folded, fold
    from heavytop.run.planning import Plan, plan
    from heavytop.run.propagation import extend, propagate
    from heavytop.run.sensitivities import (
        Sensitivities,
        Transition,
        sensitivities,
        state_transition,
    )
    from heavytop.run.trajectory import Trajectory
    from heavytop.run.trajectory_file import load_trajectory
    from heavytop.run.verify import Errors, run_errors
    from heavytop.scene.scene import Scene, load_scene
    from heavytop.scene.state import State
    from heavytop.scene.top import Top
    from heavytop.studies.atlas import Atlas, atlas, load_atlas, merge_atlases
    from heavytop.studies.drift import drift
    from heavytop.studies.drift_result import Drift
    from heavytop.studies.resume import resume
    from heavytop.studies.stress import Stress, stress
    from heavytop.studies.work_precision import WorkPrecision, work_precision


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f"heavytop.{_HOMES[name]}"), name)
        globals()[name] = value  # the function, not the module of the same name
        return value
    module = sys.modules[__name__]  # with it Python says which name may have been meant
    raise AttributeError(f"module 'heavytop' has no attribute '{name}'", name=name, obj=module)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
