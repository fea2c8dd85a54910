"""The documents of results, each a type by the name of its file, and how they are read back."""

from __future__ import annotations

from pathlib import Path
from typing import Final, Literal, NotRequired, TypeAlias

from typing_extensions import TypedDict

from heavytop.errors import ForeignFile
from heavytop.results.atlas import AtlasResult
from heavytop.results.base import Number, Result, Stored, Text, Value, read
from heavytop.results.drift import Drift
from heavytop.results.stress import Stress
from heavytop.results.work_precision import WorkPrecision
from heavytop.spelling import harmless

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
    axis: list[list[Number]]


class TracesDocument(Document):
    """heavytop/traces/1."""

    schema: Literal["heavytop/traces/1"]
    traces: list[Trace]


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
    "drift.json": Drift,
    "workprec.json": WorkPrecision,
    "stress.json": Stress,
    "atlas.json": AtlasResult,
    "energy_momentum.json": EnergyMomentumDocument,
    "validate.json": ValidationDocument,
}
"""What verbs write, by the name of the file, in the order of a report."""


def read_document(path: Path) -> Stored:
    """Read the document of a result; keys that no result has are left out.

    Raises
    ------
    ForeignFile
        It is no regular file, or not what its name says: the message has the place and the rule.
    """
    found, fingerprint = read(path, FILES[path.name])
    try:
        document = found.document() if isinstance(found, Result) else found
    except (ArithmeticError, ValueError) as fault:  # what follows from its numbers has no value
        raise ForeignFile(f"{harmless(path)}: not what was written ({fault})") from None
    return Stored(document, fingerprint)
