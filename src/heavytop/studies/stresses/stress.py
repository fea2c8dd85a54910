"""A stress test: what every method did at every case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from heavytop.machine import versions
from heavytop.studies.stresses.cases import Case
from heavytop.studies.stresses.methods import AUTO, Method
from heavytop.studies.stresses.outcome import RULES, Word

SCHEMA: Final = "heavytop/stress/1"
MOST_LOST: Final = 2.0  # digits beyond the condition, of auto
NOTHING: Final = "nothing-to-tell"


@dataclass(frozen=True, slots=True)
class Run:
    """One run.

    Attributes
    ----------
    case, method : str
    formulation : str
    outcome : Word
    error, digits_lost : float or None
        Of the axis at the end, or of φ and ψ; and its decimal digits beyond what conditioning
        allows.
    condition : float or None
    energy_error : float or None
    steps : int or None
    smallest_step : float or None
        [s]
    note, plan : str
    named : bool
        Whether the run itself said that something is wrong.
    untold : bool
        Whether its outcome is chance, as conditioning leaves no digits.
    turns : (int, int), or None
        Whole turns by which φ and ψ are wrong.
    seconds : float or None
        Wall-clock time, with compiling [s].
    """

    case: str
    method: str
    formulation: str
    outcome: Word
    error: float | None = None
    digits_lost: float | None = None
    condition: float | None = None
    energy_error: float | None = None
    steps: int | None = None
    smallest_step: float | None = None
    note: str = ""
    plan: str = ""
    named: bool = False
    untold: bool = False
    turns: tuple[int, int] | None = None
    seconds: float | None = None

    @property
    def silently_wrong(self) -> bool:
        """Whether it lost digits or events, or had none to lose, and did not say so."""
        if self.named:
            return False
        lost = (self.digits_lost or 0.0) > MOST_LOST
        return lost or self.untold or self.outcome is not Word.OK

    def document(self) -> dict[str, Any]:
        """Return the run as a row of the document; without wall-clock values."""
        return {
            "case": self.case,
            "method": self.method,
            "formulation": self.formulation,
            "outcome": str(self.outcome),
            "error": self.error,
            "digits_lost": self.digits_lost,
            "condition": self.condition,
            "energy_error": self.energy_error,
            "steps": self.steps,
            "smallest_step": self.smallest_step,
            "named": self.named,
            "untold": self.untold,
            "turns": None if self.turns is None else list(self.turns),
            "plan": self.plan,
            "note": self.note,
        }


@dataclass(frozen=True, slots=True)
class Skipped:
    """A run that was not done, and why."""

    case: str
    method: str
    reason: str
    lost: bool = False

    def document(self) -> dict[str, Any]:
        """Return it as a row of the document."""
        return {"case": self.case, "method": self.method, "reason": self.reason}


@dataclass(frozen=True, slots=True)
class Stress:
    """The result of a stress test.

    Attributes
    ----------
    cases : tuple of Case
        What was hard.
    methods : tuple of Method
        Who was put to it.
    runs : tuple of Run
        What became of each pair; ``stress["cusp", "auto"]`` is one.
    skipped : tuple of Skipped
        Runs that were not done.
    apart : tuple of Skipped
        Pairs that do not go together.
    limits : dict from str to float
        ``time_s`` [s] and ``steps`` of a run, and the ``budget_s`` of all [s].
    """

    cases: tuple[Case, ...]
    methods: tuple[Method, ...]
    runs: tuple[Run, ...]
    skipped: tuple[Skipped, ...]
    limits: Mapping[str, float]
    apart: tuple[Skipped, ...] = ()

    def __repr__(self) -> str:
        """Return how much was done, in a line."""
        return (
            f"<Stress: {len(self.runs)} runs of {len(self.methods)} methods at "
            f"{len(self.cases)} cases, {len(self.skipped)} skipped>"
        )

    def __getitem__(self, key: tuple[str, str]) -> Run:
        """Return a run by the names of its case and its method; KeyError if it was not done."""
        return {(run.case, run.method): run for run in self.runs}[key]

    @property
    def silently_wrong(self) -> tuple[Run, ...]:
        """Runs of auto that lost more than two digits, or events, and did not say so."""
        return tuple(run for run in self._of_auto() if run.silently_wrong)

    @property
    def asked_auto(self) -> bool:
        """Whether auto was run anywhere."""
        return any(True for _ in self._of_auto())

    def counts(self) -> dict[str, dict[str, int]]:
        """Return how often each method had each outcome, and how often there was nothing to tell.

        What is counted as nothing to tell is not counted as anything else.
        """
        words = [*map(str, Word), NOTHING]
        found = {method.name: dict.fromkeys(words, 0) for method in self.methods}
        for run in self.runs:
            found[run.method][NOTHING if run.untold else str(run.outcome)] += 1
        return found

    def document(self, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/stress/1.

        Parameters
        ----------
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        return {
            "schema": SCHEMA,
            "limits": dict(self.limits),
            "rules": {str(word): rule for word, rule in RULES.items()},
            "hard": {case.name: case.hard for case in self.cases},
            "methods": {each.name: each.short for each in self.methods},
            "settings": {each.name: each.setting for each in self.methods},
            "cases": [run.document() for run in self.runs],
            "skipped": [each.document() for each in self.skipped],
            "apart": [each.document() for each in self.apart],
            "auto": {
                "run": self.asked_auto,
                "silently_wrong": [run.case for run in self.silently_wrong],
            },
            "files": dict(files or {}),
            "versions": versions(),
        }

    def _of_auto(self) -> Iterator[Run]:
        return (run for run in self.runs if run.formulation == AUTO)
