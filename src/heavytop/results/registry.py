"""Every kind of result, by the file it is written to: a new study is a row here.

Names alone, nothing is imported for them: the command line reads this before anything else.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, NamedTuple


class ResultEntry(NamedTuple):
    """What belongs to a kind of result.

    Attributes
    ----------
    result : str
        Its class, as ``module.name`` of `heavytop.results`.
    command : str
        The functions of its verb, which is called as the file is, as in `heavytop.cli`; the last is
        that of a study.
    """

    result: str
    command: str = ""

    @property
    def study(self) -> str:
        """The module whose tasks give it; its kind in a journal is the last part of that."""
        return self.command.rpartition(" ")[2].partition(":")[0]


RESULTS: Final[Mapping[str, ResultEntry]] = {
    "run.json": ResultEntry("run.RunResult"),
    "drift.json": ResultEntry("drift.Drift", "studies.drift:drift"),
    "workprec.json": ResultEntry(
        "work_precision.WorkPrecision", "studies.work_precision:work_precision"
    ),
    "stress.json": ResultEntry("stress.Stress", "cli.verbs:stress studies.stress:stress"),
    "atlas.json": ResultEntry("atlas.Atlas", "studies.atlas:atlas"),
    "check.json": ResultEntry("check.Check"),
    "certify.json": ResultEntry(
        "certificate.Certificate", "cli.verbs:certify studies.certificate:certify"
    ),
    "validate.json": ResultEntry("validation.Validation", "claims:validate"),
}
"""In the order of a report."""
