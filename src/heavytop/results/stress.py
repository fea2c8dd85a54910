"""The result of a stress test: what became of every method at every case, and what it is called."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, Literal

from heavytop.display import Plotted
from heavytop.results.base import Number, Part, Result, Text

AUTO: Final = "auto"
ASTRAY: Final = 0.1  # an error of the axis, of 2 at most
MOST_LOST: Final = 2.0  # digits beyond the condition, of auto
UNTOLD: Final = "?"
UNDETERMINED: Final = "nothing-to-tell"


class StressOutcome(StrEnum):
    """How a run ended; `RULES` says when each is used."""

    OK = "ok"
    INACCURATE = "inaccurate"
    SINGULAR = "singular"
    STALLED = "stalled"
    DIVERGED = "diverged"
    STEP_LIMIT = "step-limit"
    TIME_LIMIT = "time-limit"
    REFUSED = "refused"
    MISSED_EVENTS = "missed-events"


RULES: Final = {
    StressOutcome.REFUSED: "the method says beforehand that it cannot run this case, and why",
    StressOutcome.TIME_LIMIT: "the run exceeded its time limit",
    StressOutcome.STEP_LIMIT: "the run reached or exceeded its limit of steps",
    StressOutcome.SINGULAR: "the run stopped on the way: the equations gave numbers that are "
    "not finite",
    StressOutcome.STALLED: "the steps shrank to zero, or the equations of a step have no solution",
    StressOutcome.DIVERGED: f"the run reports success, but its axis (φ or ψ, where they are "
    f"judged) is off by {ASTRAY:g} or more, or its numbers are not finite",
    StressOutcome.INACCURATE: "the run reports success, with fewer than half of the digits that "
    "conditioning leaves",
    StressOutcome.MISSED_EVENTS: "the end state is right, the number of events is wrong",
    StressOutcome.OK: "the run reports success, with at least half of the digits that conditioning "
    "leaves",
}
MARKS: Final = {
    "inaccurate": "!",
    "singular": "sing",
    "stalled": "stall",
    "diverged": "div",
    "step-limit": "steps",
    "time-limit": "time",
    "refused": "no",
    "missed-events": "ev",
}
"""Of tables and charts."""


@dataclass(frozen=True, kw_only=True)
class Run(Part):
    """One run, judged.

    Attributes
    ----------
    case, method : str
    formulation : str
    outcome : StressOutcome
    error : float or None
        Distance of the axis from the true one at the end; of the tilt, where only that is given;
        of φ or ψ, where they are judged.
    digits_lost : float or None
        Decimal digits of the error beyond what conditioning allows.
    condition : float or None
    energy_error : float or None
    steps : int or None
    named : bool
        Whether the run itself reported a problem, by an error or a warning.
    untold : bool
        Whether its outcome is undetermined: conditioning leaves no digits.
    turns : (int, int), or None
        Whole turns by which φ and ψ are wrong, where the run follows them.
    plan, note : str
        What auto chose; what the run says, and what is wrong with it.
    """

    case: Text
    method: Text
    formulation: Text
    outcome: StressOutcome
    error: Number | None = None
    digits_lost: Number | None = None
    condition: Number | None = None
    energy_error: Number | None = None
    steps: int | None = None
    named: bool = False
    untold: bool = False
    turns: tuple[int, int] | None = None
    plan: Text = ""
    note: Text = ""

    @property
    def silently_wrong(self) -> bool:
        """Whether it lost digits or events, or had none to lose, and did not say so."""
        lost = (self.digits_lost or 0.0) > MOST_LOST
        return not self.named and (lost or self.untold or self.outcome is not StressOutcome.OK)


@dataclass(frozen=True, kw_only=True)
class SkippedRun(Part):
    """A run that was not done, and why; `lost` says that its process was."""

    case: Text
    method: Text
    reason: Text
    lost: bool = False


@dataclass(frozen=True, kw_only=True, repr=False)
class Stress(Result, Plotted):
    """The result of a stress test.

    Attributes
    ----------
    limits : dict from str to float
        ``time_s`` [s] and ``steps`` of a run, and the ``budget_s`` of all [s].
    hard : dict from str to str
        The cases, and why each is hard.
    methods : dict from str to str
        The methods with their headings: a short name, and a tolerance or steps in a period.
    cases : tuple of Run
        What became of each pair; ``stress["cusp", "auto"]`` is one.
    skipped : tuple of SkippedRun
        Runs that were not done.
    """

    schema: Literal["heavytop/stress/1"] = "heavytop/stress/1"
    limits: Mapping[Text, Number]
    hard: Mapping[Text, Text]
    methods: Mapping[Text, Text]
    cases: tuple[Run, ...]
    skipped: tuple[SkippedRun, ...] = ()

    def __repr__(self) -> str:
        """Return how much was done, in a line."""
        return (
            f"<Stress: {len(self.cases)} runs of {len(self.methods)} methods at "
            f"{len(self.hard)} cases, {len(self.skipped)} skipped>"
        )

    def __getitem__(self, key: tuple[str, str]) -> Run:
        """Return a run by the names of its case and its method; KeyError if it was not done."""
        return {(run.case, run.method): run for run in self.cases}[key]

    @property
    def silently_wrong(self) -> tuple[Run, ...]:
        """Runs of auto that lost more than two digits, or events, and did not say so."""
        return tuple(run for run in self.cases if run.formulation == AUTO and run.silently_wrong)

    def counts(self) -> dict[str, dict[str, int]]:
        """Return how often each method had each outcome, and how often it was undetermined.

        A run that is counted as ``nothing-to-tell`` (undetermined) has no other outcome.
        """
        words = (*map(str, StressOutcome), UNDETERMINED)
        found = {method: dict.fromkeys(words, 0) for method in self.methods}
        for each in self.cases:
            found[each.method][UNDETERMINED if each.untold else str(each.outcome)] += 1
        return found

    def document(self, *, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/stress/1.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return super().document(files=files) | {
            "rules": {str(outcome): rule for outcome, rule in RULES.items()},
            "auto": {
                "run": any(run.formulation == AUTO for run in self.cases),
                "silently_wrong": [run.case for run in self.silently_wrong],
            },
        }
