"""The documents of results, each a type by the name of its file, and how they are read back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from heavytop.display import Plotted
from heavytop.errors import ForeignFile
from heavytop.results.atlas import AtlasResult
from heavytop.results.base import (
    Column,
    Number,
    Part,
    Result,
    Stored,
    Text,
    Values,
    plain,
    read,
)
from heavytop.results.certificate import Certificate
from heavytop.results.drift import Drift
from heavytop.results.run import RunResult
from heavytop.results.stress import Stress
from heavytop.results.validation import Validation
from heavytop.results.work_precision import WorkPrecision
from heavytop.spelling import harmless


@dataclass(frozen=True, kw_only=True)
class CheckedData(Part):
    """The rows of a trajectory, and what its columns are."""

    file: Text
    rows: int
    span: tuple[Number, Number]
    columns: Mapping[Text, Text | None]
    read_as: tuple[Text, ...]


@dataclass(frozen=True, kw_only=True)
class CheckResult(Result, Plotted):
    """What `heavytop.Check.document` says of a trajectory of somebody else."""

    schema: Literal["heavytop/check/1"] = "heavytop/check/1"
    scene: Mapping[Text, Text | Values]
    origin: Text
    data: CheckedData
    assumed: tuple[Text, ...] = ()
    errors: Mapping[Text, Values | None]
    growth: Values
    events: Mapping[Text, Values | None]
    condition: Number
    digits: Number
    digits_as_given: Number
    conventions: tuple[Values, ...]
    alternatives: tuple[Mapping[Text, Text | tuple[Text, ...]], ...]
    method: Values
    slip: Values | None
    curves: Mapping[Text, Column]


FILES: Final = {
    "run.json": RunResult,
    "drift.json": Drift,
    "workprec.json": WorkPrecision,
    "stress.json": Stress,
    "atlas.json": AtlasResult,
    "check.json": CheckResult,
    "certify.json": Certificate,
    "validate.json": Validation,
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
