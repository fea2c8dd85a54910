"""A stress test: what every method did at every case."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from heavytop.machine import versions
from heavytop.stresses.cases import Case
from heavytop.stresses.methods import AUTO, Method
from heavytop.stresses.outcome import RULES, Word

SCHEMA: Final = "heavytop/stress/1"
MOST_LOST: Final = 2.0  # digits beyond the condition, of auto


@dataclass(frozen=True, slots=True)
class Run:
    """One run.

    Attributes
    ----------
    case, method : str
    formulation : str
    outcome : Word
    error, digits_lost : float or None
        Of the axis at the end, and its decimal digits beyond what conditioning allows.
    condition : float or None
    energy_error : float or None
    steps : int or None
    smallest_step : float or None
        [s]
    note, plan : str
    named : bool
        Whether the run itself said that something is wrong.
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
    seconds: float | None = None

    @property
    def silently_wrong(self) -> bool:
        """Whether it lost digits, or events, and did not say so."""
        if self.named:
            return False
        return self.outcome is not Word.OK or (self.digits_lost or 0.0) > MOST_LOST

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
            "plan": self.plan,
            "note": self.note,
        }


@dataclass(frozen=True, slots=True)
class Skipped:
    """A run that was not done, and why."""

    case: str
    method: str
    reason: str


@dataclass(frozen=True, slots=True)
class Stress:
    """The result of a stress test.

    Attributes
    ----------
    cases : tuple of Case
    methods : tuple of Method
    runs : tuple of Run
    skipped : tuple of Skipped
    limits : dict from str to float
        ``time_s`` and ``steps`` of a run, and the ``budget_s`` of all.
    """

    cases: tuple[Case, ...]
    methods: tuple[Method, ...]
    runs: tuple[Run, ...]
    skipped: tuple[Skipped, ...]
    limits: Mapping[str, float]

    def __getitem__(self, key: tuple[str, str]) -> Run:
        """Return a run by the names of its case and its method; KeyError if it was not done."""
        return {(run.case, run.method): run for run in self.runs}[key]

    @property
    def silently_wrong(self) -> tuple[Run, ...]:
        """Runs of auto that lost more than two digits, or events, and did not say so."""
        return tuple(run for run in self.runs if run.method == AUTO and run.silently_wrong)

    def counts(self) -> dict[str, dict[str, int]]:
        """Return how often each method had each outcome."""
        return {
            method.name: {
                str(word): sum(r.outcome is word for r in self._of(method.name)) for word in Word
            }
            for method in self.methods
        }

    def document(self, files: Mapping[str, str] | None = None) -> dict[str, Any]:
        """Return the document heavytop/stress/1."""
        return {
            "schema": SCHEMA,
            "limits": dict(self.limits),
            "rules": {str(word): rule for word, rule in RULES.items()},
            "hard": {case.name: case.hard for case in self.cases},
            "methods": {each.name: each.short for each in self.methods},
            "cases": [run.document() for run in self.runs],
            "skipped": [
                {"case": s.case, "method": s.method, "reason": s.reason} for s in self.skipped
            ],
            "auto": {"silently_wrong": [run.case for run in self.silently_wrong]},
            "files": dict(files or {}),
            "versions": versions(),
        }

    def _of(self, method: str) -> Iterator[Run]:
        return (run for run in self.runs if run.method == method)
