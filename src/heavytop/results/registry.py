"""The table of all kinds of results, by the names of their files: a new study is a row here.

It has names alone and imports nothing: the command line reads it before anything else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple


class ResultEntry(NamedTuple):
    """A kind of result.

    Attributes
    ----------
    result : str
        Its class, as ``module:name``.
    command : str
        The functions of its verb, as in `heavytop.cli`, the last that of a study; the verb has the
        name of the file.
    reported : sequence of str, optional
        The arguments with which ``report SCENE`` calls that function: the scene, and texts; None
        where it does not. `folder` and `progress` are added where the function has them.
    """

    result: str
    command: str = ""
    reported: Sequence[str] | None = ("scene",)

    @property
    def study(self) -> str:
        """The module whose tasks give it; its kind in a journal is the last part of that."""
        return self.function.partition(":")[0]

    @property
    def function(self) -> str:
        """The function of a study, as ``module:name``; empty where there is none."""
        return self.command.rpartition(" ")[2]


RESULTS: Final[Mapping[str, ResultEntry]] = {
    "run.json": ResultEntry("results.run:RunResult"),
    "drift.json": ResultEntry("results.drift:Drift", "studies.drift:drift"),
    "workprec.json": ResultEntry(
        "results.work_precision:WorkPrecision", "studies.work_precision:work_precision"
    ),
    "stress.json": ResultEntry(
        "results.stress:Stress", "cli.verbs:stress studies.stress:stress", reported=()
    ),
    "atlas.json": ResultEntry(
        "results.atlas:Atlas",
        "studies.atlas:atlas",
        reported=("scene", "phidot=-30:40:300", "theta=0.02:1.5:300"),
    ),
    "check.json": ResultEntry("results.check:Check"),
    "certify.json": ResultEntry(
        "results.certificate:Certificate",
        "cli.verbs:certify studies.certificate:certify",
        reported=None,
    ),
    "validate.json": ResultEntry("results.validation:Validation", "claims:validate", reported=()),
}
"""In the order of a report."""
