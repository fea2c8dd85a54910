"""The public names, and the modules where they live; ``__init__.py`` reads them from here."""

from .analytic.facts import (
    Facts as Facts,
    facts as facts,
)
from .analytic.many import (
    Motions as Motions,
    motions_many as motions_many,
)
from .analytic.motion import Motion as Motion
from .analytic.form import Record as Record
from .analytic.reference import (
    Reference as Reference,
    reference as reference,
)
from .analytic.sensitivities import sensitivities as sensitivities
from .claims import validate as validate
from .checking.judge import check as check
from .results.check import Check as Check
from .classification import (
    Kind as Kind,
    Verdict as Verdict,
)
from .classification.classify import classify as classify
from .classification.many import classify_many as classify_many
from .comparison.user import Method as Method
from .errors import (
    BadScene as BadScene,
    DoubtfulWarning as DoubtfulWarning,
    EndedEarly as EndedEarly,
    FoldedTiltWarning as FoldedTiltWarning,
    ForeignFile as ForeignFile,
    HeavyTopError as HeavyTopError,
    ImpossibleBodyWarning as ImpossibleBodyWarning,
    ImpossibleStart as ImpossibleStart,
    ImpossibleTop as ImpossibleTop,
    InUse as InUse,
    MissedDigitsWarning as MissedDigitsWarning,
    MissingPackage as MissingPackage,
    NoClosedForm as NoClosedForm,
    NoScheduler as NoScheduler,
    NotCertified as NotCertified,
    StoppedEarly as StoppedEarly,
    WrongType as WrongType,
)
from .integration.outputs import Sample as Sample
from .exact import Exact as Exact
from .plots.film import film as film
from .report.explorer import explore as explore
from .results.atlas import Atlas as Atlas
from .results.certificate import Certificate as Certificate
from .results.drift import Drift as Drift
from .results.stress import Stress as Stress
from .results.validation import Validation as Validation
from .results.work_precision import WorkPrecision as WorkPrecision
from .run.ensemble import propagate_many as propagate_many
from .run.plan import Plan as Plan
from .run.planning import plan as plan
from .run.propagation import (
    extend as extend,
    propagate as propagate,
)
from .run.trajectory import Trajectory as Trajectory
from .run.trajectory_file import load_trajectory as load_trajectory
from .run.verify import (
    Errors as Errors,
    run_errors as run_errors,
)
from .scene.scene import (
    Scene as Scene,
    load_scene as load_scene,
)
from .scene.state import State as State
from .scene.top import Top as Top
from .studies.atlas import atlas as atlas, load_atlas as load_atlas
from .studies.certificate import certify as certify
from .studies.drift import drift as drift
from .studies.study import resume as resume
from .studies.stress import stress as stress
from .studies.find import find as find
from .studies.sweep import sweep as sweep
from .studies.work_precision import work_precision as work_precision

__version__: str
