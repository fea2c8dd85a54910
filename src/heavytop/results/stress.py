"""The result of a stress test: the outcome of every method at every case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import StrEnum
from typing import Any, ClassVar, Final

from heavytop.errors import Exit
from heavytop.results.base import Result, group, nonzero, skipped_runs
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import QUANTITIES, Quantity

AUTO: Final = "auto"
WRONG_AXIS: Final = 0.1  # an error of the axis, of 2 at most
MOST_LOST: Final = 2.0  # digits beyond the condition, that auto may lose without a warning
UNTOLD: Final = "?"
UNDETERMINED: Final = "nothing-to-tell"
UNTOLD_RULE: Final = "undetermined: conditioning leaves no digits, so that agreement is chance"
FAR_OFF: Final = f"it ends off by {WRONG_AXIS:g} or more, or with numbers not finite"
HEADS: Final = "a method over its setting; a form alone is Taylor's; :a axis form, :l Lagrange's"


class StressOutcome(StrEnum):
    """How a run ended: its mark in tables and charts, and the rule when it is used."""

    mark: str
    rule: str

    def __new__(cls, value: str, mark: str = "", rule: str = "") -> StressOutcome:
        """Return the member of this value."""
        found = str.__new__(cls, value)
        found._value_, found.mark, found.rule = value, mark, rule
        return found

    REFUSED = "refused", "no", "the method says beforehand that it cannot run this case, and why"
    TIME_LIMIT = "time-limit", "time", "the run exceeded its time limit"
    STEP_LIMIT = "step-limit", "steps", "the run reached or exceeded its limit of steps"
    METHOD_ERROR = "method-error", "err", "its code fails, or returns nan or what is no state"
    SINGULAR = "singular", "sing", "the run stopped on the way, at numbers that are not finite"
    STALLED = "stalled", "stall", "steps shrank to zero, or the equations of one are not solved"
    DIVERGED = "diverged", "div", FAR_OFF
    INACCURATE = "inaccurate", "!", "it ends with fewer than half of the digits that are possible"
    MISSED_EVENTS = "missed-events", "ev", "the end state is right, the number of events is wrong"
    OK = "ok", "", "it ends with half or more of the digits that conditioning and its step leave"


NO_RUN: Final[Mapping[str, Any]] = {
    "case": "", "method": "", "formulation": "", "outcome": "", "error": None, "digits_lost": None,
    "condition": None, "energy_error": None, "steps": None, "named": False, "untold": False,
    "turns": None, "plan": "", "note": "",
}  # fmt: skip
"""The row of a run, with the values of what is not known."""


class Stress(Result):
    """The result of a stress test.

    Attributes
    ----------
    limits : mapping from str to float
        ``time_s`` [s] and ``steps`` of a run, and the ``budget_s`` of all [s].
    hard : mapping from str to str
        The cases, and why each is hard.
    methods : mapping from str to str
        The methods with their headings: a short name, and a tolerance or steps in a period.
    cases : tuple of mapping
        What became of each pair; ``stress["cusp", "auto"]`` is one: its ``case``, ``method``,
        ``formulation`` and ``outcome``; its ``error`` at the end, that of the axis, of the tilt
        where only that is given, of φ or ψ where they are judged; ``digits_lost`` beyond what
        conditioning allows; ``condition``, ``energy_error``, ``steps``; whether it ``named`` a
        problem itself, by an error or a warning; whether its outcome is undetermined (``untold``),
        as conditioning leaves no digits; whole ``turns`` by which φ and ψ are wrong; the ``plan``
        of auto; a ``note`` of what it says and what is wrong with it.
    skipped : tuple of mapping
        ``case``, ``method`` and ``reason`` of runs that were not done; whether their process was
        ``lost``.
    """

    schema: ClassVar = "heavytop/stress/1"
    heading: ClassVar = "Where methods fail"
    table: ClassVar = "cases"
    index: ClassVar = ("case", "method")

    limits: Mapping[str, float]
    hard: Mapping[str, str]
    methods: Mapping[str, str]
    cases: tuple[Any, ...]
    skipped: tuple[Any, ...] = ()

    def __getitem__(self, key: tuple[str, str]) -> Any:
        """Return a run by the names of its case and its method; KeyError if it was not done."""
        return {(run.case, run.method): run for run in self.cases}[key]

    @property
    def silently_wrong(self) -> tuple[Any, ...]:
        """Runs of auto that lost more than two digits, or events, and did not say so."""
        return tuple(run for run in self._runs_of_auto() if silently_wrong(run))

    def _runs_of_auto(self) -> list[Any]:
        return [run for run in self.cases if run.formulation == AUTO]

    def counts(self) -> dict[str, dict[str, int]]:
        """Return how often each method had each outcome, and how often it was undetermined.

        A run that is counted as ``nothing-to-tell`` (undetermined) has no other outcome.
        """
        words = (*map(str, StressOutcome), UNDETERMINED)
        found = {method: dict.fromkeys(words, 0) for method in self.methods}
        for each in self.cases:
            found[each.method][UNDETERMINED if each.untold else str(each.outcome)] += 1
        return found

    def document(self) -> dict[str, Any]:
        """Return the document heavytop/stress/1, with the rules of the outcomes."""
        wrong = [run.case for run in self.silently_wrong]
        return super().document() | {
            "rules": {str(outcome): outcome.rule for outcome in StressOutcome},
            "auto": {"run": bool(self._runs_of_auto()), "silently_wrong": wrong},
        }

    def facts(self) -> Iterator[Fact]:
        """Yield the meanings of marks, what failed or was skipped, and where auto was wrong."""
        if self._runs_of_auto():
            wrong = ", ".join(run.case for run in self.silently_wrong) or "nowhere"
            yield AUTO, f"was silently wrong: {wrong}"
        yield "stress", "digits lost beyond what conditioning allows"
        yield "columns", HEADS
        outcomes = {run.outcome for run in self.cases if not run.untold}
        for outcome in StressOutcome:
            if outcome in outcomes and outcome.mark:
                yield f"{outcome.mark} {outcome}", outcome.rule
        if any(run.untold for run in self.cases):
            yield UNTOLD, UNTOLD_RULE
        ok = StressOutcome.OK
        failed = [x for x in self.cases if x.outcome != ok or x.untold or any(x.turns or ())]
        for (case, outcome, note), runs in group(failed, "case", "outcome", "note").items():
            methods = ", ".join(run.method for run in runs)
            yield case, f"{outcome}: {methods}{note and f': {note}'}"
        yield from (("skipped", text) for text in skipped_runs(self.skipped))

    def tables(self) -> Iterator[Table]:
        """Yield the table with a row for each case and a column for each method."""
        runs, used = group(self.cases, "case"), {run.method for run in self.cases}
        there = [case for case in self.hard if (case,) in runs]
        rows = [{"case": x} | {run.method: cell(run) for run in runs[(x,)]} for x in there]
        if about := {n: Quantity(head, "") for n, head in self.methods.items() if n in used}:
            yield Table(rows, ("case", *about), meanings=about)

    def failures(self) -> Mapping[str, str]:
        """Return users' methods that failed or were killed in every case, and how in the first."""
        bad = (StressOutcome.METHOD_ERROR, StressOutcome.TIME_LIMIT)
        ended = {x.method for x in self.cases if x.outcome not in bad}
        runs = group((*self.cases, *self.skipped), "method").items()
        own = {n: first for (n,), (first, *_) in runs if ":" in n and n not in ended}
        return {name: each.get("note") or each.reason for name, each in own.items()}

    def problems(self) -> Iterator[tuple[Exit, str]]:
        """Yield the cases at which auto was silently wrong, or that nothing was run."""
        yield from super().problems()
        for run in self.silently_wrong:
            why = f"auto was silently wrong at {run.case}: {run.outcome}, {run.note}"
            yield Exit.OUT_OF_BOUND, why


def silently_wrong(run: Any) -> bool:
    """Tell whether a run is wrong or undetermined and gave neither an error nor a warning."""
    lost = (run.digits_lost or 0.0) > MOST_LOST
    return not run.named and (lost or run.untold or run.outcome != StressOutcome.OK)


def cell(run: Mapping[str, Any]) -> str:
    """Return a run in a few letters: the digits it lost, and a mark where it failed.

    Examples
    --------
    >>> cell({"outcome": "inaccurate", "digits_lost": 9.42, "untold": False})
    '9.4 !'
    """
    if run["untold"]:
        return UNTOLD
    lost = run["digits_lost"]
    digits = "" if lost is None else QUANTITIES["digits_lost"].text(lost) if lost else "0"
    return f"{digits} {StressOutcome(run['outcome']).mark}".strip()


class StressCases(Result):
    """The cases and the methods of a stress test."""

    schema: ClassVar = "heavytop/stress-cases/1"
    left_out: ClassVar = ("files", "versions")

    cases: tuple[Any, ...]
    methods: tuple[Any, ...]

    def facts(self) -> Iterator[Fact]:
        """Yield the cases, with top, start, span and why each is hard; and the methods."""
        for case in self.cases:
            numbers = {n: x for n, x in (case.top | case.start).items() if x != "0"}
            yield case.name, f"{case.why}; {nonzero(numbers)}; {case.span}"
        for each in self.methods:
            words = map(each.get, ("short", "formulation", "setting"))
            yield each.name, ", ".join(filter(None, words))
        yield "", "the cases are built in; for a scene of your own use drift or workprec"
