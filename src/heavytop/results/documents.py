"""The documents of results, each a type by the name of its file, and how they are read back.

Result files are exchanged: nothing in one is executed, and of its texts what a terminal would act
on is spelled out.
"""

from __future__ import annotations

import json
import math
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, Final, Literal, NamedTuple, NotRequired, TypeAlias

from pydantic import AfterValidator, TypeAdapter, ValidationError
from typing_extensions import TypedDict

from heavytop.errors import ForeignFile
from heavytop.files import regular
from heavytop.spelling import harmless

Text: TypeAlias = Annotated[str, AfterValidator(harmless)]
Number: TypeAlias = int | float
Value: TypeAlias = Number | Text | None  # more than 15 digits are a text
Values: TypeAlias = dict[Text, Value]
Column: TypeAlias = list[Number | None]


class Document(TypedDict):
    """What all of them have; the command is what was typed, null where Python was used."""

    command: NotRequired[Text | None]
    files: NotRequired[dict[Text, Text]]
    versions: NotRequired[dict[Text, Text | None]]


class SceneDocument(TypedDict):
    """A scene, as `heavytop.Scene.document` gives it."""

    name: Text
    title: Text
    source: Text
    format: NotRequired[int]
    top: Values
    start: Values
    span: NotRequired[Values]
    want: NotRequired[dict[Text, Value | list[Text]]]


class MotionDocument(TypedDict):
    """What is known of a motion without integrating it."""

    kind: Text
    tags: list[Text]
    certified: bool
    margin: Value
    theta_min: Value
    theta_max: Value
    period: Value
    precession: Value
    spin: Value


class PlanDocument(TypedDict):
    """How a scene is integrated, and why."""

    formulation: Text
    precision: Text
    tolerance: Value
    states: int
    projected: bool
    folded: bool
    reasons: list[Text]


class EventsDocument(TypedDict):
    """How many events of each kind there are, and the first of them."""

    turning: int | None
    reversal: int | None
    cusp: int | None
    table: list[Values]
    omitted: int


class RunDocument(Document):
    """heavytop/run/1."""

    schema: Literal["heavytop/run/1"]
    scene: SceneDocument
    motion: MotionDocument
    constants: Values
    plan: PlanDocument
    final: dict[Text, Value | list[Value]] | None
    events: EventsDocument
    errors: dict[Text, Value | Values]
    missed_digits: Values
    missed_events: dict[Text, list[int]]
    cost: Values
    outcome: Text


class Trace(TypedDict):
    """The path of the axis of one scene."""

    name: Text
    title: Text
    kind: Text
    tags: list[Text]
    seconds: Number
    pushed: NotRequired[Number]
    axis: list[list[Number]]


class TracesDocument(Document):
    """heavytop/traces/1."""

    schema: Literal["heavytop/traces/1"]
    traces: list[Trace]


class DriftMethod(TypedDict):
    """The errors of one method over time."""

    name: Text
    formulation: Text
    language: Text
    us_per_period: NotRequired[Number | None]
    periods: list[Number]
    energy: Column
    p_phi: Column
    p_psi: Column
    phase_s: Column
    axis: Column
    invariants: dict[Text, Column]
    energy_exponent: Number | None
    phase_exponent: Number | None
    stderr: dict[Text, Number | None]
    ended: dict[Text, Text]
    skipped: Text | None


class DriftDocument(Document):
    """heavytop/drift/1."""

    schema: Literal["heavytop/drift/1"]
    scene: SceneDocument
    periods: Number
    ensemble: int
    spread: Number
    samples: int
    seed: int
    methods: list[DriftMethod]


class TimedDocument(TypedDict):
    """A method at one setting: what a period costs, and what it attains."""

    method: Text
    formulation: Text
    language: Text
    tolerance: Number | None
    steps_a_period: Number | None
    bits: int
    rival: bool
    measures: Text
    us_per_period: Number
    rhs_evaluations: Number | None
    error: Number | None
    theta_error: Number | None
    energy_error: Number | None
    error_spread: NotRequired[Number | None]
    us_spread: NotRequired[Number]
    starts: NotRequired[int]
    setup_s: Number
    digits: NotRequired[int]
    wants: NotRequired[Text]
    stands_for: NotRequired[Text]
    missed: NotRequired[bool]


class LeftOut(TypedDict):
    """What was not run, and why."""

    method: Text
    case: NotRequired[Text]
    setting: NotRequired[Values]
    reason: Text


class Leader(TypedDict):
    """The cheapest point within a bound, and who of the other side comes next."""

    method: Text
    stands_for: NotRequired[Text]
    tolerance: Number | None
    steps_a_period: Number | None
    rival: bool
    us_per_period: Number
    error: Number
    against: NotRequired[Leader | None]
    ratio: NotRequired[Number | None]


class Auto(TypedDict):
    """What auto chose for so many digits, and what was better."""

    point: int
    digits: int
    wants: Text
    error: Number
    missed: bool
    ahead: list[Text]


class WorkPrecisionDocument(Document):
    """heavytop/workprec/1."""

    schema: Literal["heavytop/workprec/1"]
    scene: SceneDocument
    periods: Number
    budget: Number
    points: list[TimedDocument]
    front: list[int]
    front_theta: list[int]
    cheapest: dict[Text, Leader | None]
    cheapest_theta: dict[Text, Leader | None]
    auto: list[Auto]
    rivals: dict[Text, list[Text]]
    skipped: list[LeftOut]


class StressRun(TypedDict):
    """One method at one case."""

    case: Text
    method: Text
    outcome: Text
    error: Number | None
    digits_lost: Number | None
    note: Text
    untold: bool
    turns: list[int] | None


class StressDocument(Document):
    """heavytop/stress/1."""

    schema: Literal["heavytop/stress/1"]
    limits: dict[Text, Number | None]
    rules: dict[Text, Text]
    hard: dict[Text, Text]
    methods: dict[Text, Text]
    settings: Values
    cases: list[StressRun]
    skipped: list[LeftOut]
    apart: list[LeftOut]
    auto: dict[Text, bool | list[Text]]


class AxisDocument(TypedDict):
    """One side of a map."""

    name: Text
    low: Number
    high: Number
    count: int
    log: bool


class CurveDocument(TypedDict):
    """A boundary of kinds."""

    name: Text
    x: list[Number]
    y: list[Number]


class AtlasDocument(Document):
    """heavytop/atlas/1."""

    schema: Literal["heavytop/atlas/1"]
    scene: SceneDocument
    axes: dict[Literal["x", "y"], AxisDocument]
    shape: list[int]
    counts: dict[Text, int]
    uncertified: int
    curves: list[CurveDocument]


class PlaceDocument(TypedDict):
    """A place in the plane of energy and momentum."""

    p_phi: Number
    E_prime: Number


class StartDocument(PlaceDocument):
    """The place of a scene."""

    kind: Text


class CriticalSet(TypedDict):
    """The relative equilibria over all p_psi."""

    sheets: list[dict[Text, list[Column]]]
    thread: dict[Text, Column]
    sleeping: dict[Text, Column]
    hanging: dict[Text, Column]


class EnergyMomentumDocument(Document):
    """heavytop/energy-momentum/1."""

    schema: Literal["heavytop/energy-momentum/1"]
    scene: SceneDocument
    p_psi: Number
    ratio: Number | None
    start: StartDocument
    standing: PlaceDocument
    hanging: PlaceDocument
    thread: PlaceDocument | None
    depth: NotRequired[Number | None]
    window: dict[Text, Column]
    edge: dict[Text, list[Number | bool | None]]
    cusps: list[PlaceDocument] | None
    through_top: list[PlaceDocument]
    through_bottom: list[PlaceDocument]
    circuit: dict[Text, Number | Column | list[Column]] | None
    critical_set: NotRequired[CriticalSet | None]


class ClaimDocument(TypedDict):
    """What is claimed, and what was measured."""

    id: Text
    statement: Text
    authority: Text
    numbers: Text
    bound: Number | None
    measured: Number | None
    passed: bool | None
    skipped: Text | None
    failure: Text | None


class ValidationDocument(Document):
    """heavytop/validate/1."""

    schema: Literal["heavytop/validate/1"]
    claims: list[ClaimDocument]


FILES: Final = {
    "run.json": RunDocument,
    "traces.json": TracesDocument,
    "drift.json": DriftDocument,
    "workprec.json": WorkPrecisionDocument,
    "stress.json": StressDocument,
    "atlas.json": AtlasDocument,
    "energy_momentum.json": EnergyMomentumDocument,
    "validate.json": ValidationDocument,
}
"""What verbs write, by the name of the file, in the order of a report."""


class Stored(NamedTuple):
    """A document that was read, with the fingerprint of its file."""

    document: dict[str, Any]
    sha256: str


def read_document(path: Path) -> Stored:
    """Read the document of a result; keys that no result has are left out.

    Raises
    ------
    ForeignFile
        It is no regular file, or not what its name says: the message has the place and the rule.
    """
    try:
        with regular(path) as file:
            data = file.read()
        found = json.loads(data, parse_constant=_finite, parse_float=_finite)
        document = TypeAdapter[Any](FILES[path.name]).validate_python(found, strict=True)
    except ValidationError as wrong:
        first = wrong.errors()[0]
        place = harmless(": ".join([*map(str, first["loc"])]))[:200]
        raise ForeignFile(f"{harmless(path)}: {place}: {harmless(first['msg'])[:200]}") from None
    except (OSError, ValueError, RecursionError) as fault:
        why = getattr(fault, "strerror", None) or fault
        raise ForeignFile(f"{harmless(path)}: not readable as JSON ({why})") from None
    return Stored(document, sha256(data).hexdigest())


def _finite(text: str) -> float:
    if not math.isfinite(value := float(text)):
        raise ValueError(f"{text:.40} is no number of JSON")
    return value
