"""The documents of results, each a type by the name of its file, and how they are read back."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from heavytop.errors import ForeignFile
from heavytop.results.atlas import AtlasResult
from heavytop.results.base import Number, Part, Result, Stored, Text, plain, read
from heavytop.results.drift import Drift
from heavytop.results.energy_momentum import Diagram
from heavytop.results.run import RunResult
from heavytop.results.stress import Stress
from heavytop.results.work_precision import WorkPrecision
from heavytop.spelling import harmless


@dataclass(frozen=True, kw_only=True)
class Trace(Part):
    """The path of the axis of one scene."""

    name: Text
    title: Text
    kind: Text
    tags: tuple[Text, ...]
    seconds: Number
    axis: tuple[tuple[Number, ...], ...]
    pushed: Number | None = None


@dataclass(frozen=True, kw_only=True)
class Traces(Result):
    """The paths of the axis of scenes."""

    schema: Literal["heavytop/traces/1"] = "heavytop/traces/1"
    traces: tuple[Trace, ...]


@dataclass(frozen=True, kw_only=True)
class CheckedClaim(Part):
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


@dataclass(frozen=True, kw_only=True)
class CheckedClaims(Result):
    """The claims of a validation."""

    schema: Literal["heavytop/validate/1"] = "heavytop/validate/1"
    claims: tuple[CheckedClaim, ...]


FILES: Final = {
    "run.json": RunResult,
    "traces.json": Traces,
    "drift.json": Drift,
    "workprec.json": WorkPrecision,
    "stress.json": Stress,
    "atlas.json": AtlasResult,
    "energy_momentum.json": Diagram,
    "validate.json": CheckedClaims,
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
        document = plain(found)
    except (ArithmeticError, ValueError) as fault:  # what follows from its numbers has no value
        raise ForeignFile(f"{harmless(path)}: not what was written ({fault})") from None
    return Stored(document, fingerprint)
