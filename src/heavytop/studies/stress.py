"""Stress: the motions at which methods fail, every method at each of them, and how each fails."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import asdict, dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any, Final

from heavytop.errors import BadScene, Fault, HeavyTopError
from heavytop.machine import versions
from heavytop.run.events import Counts
from heavytop.scene.arguments import Range, heard, one_of, parse_names, parse_options, path_of
from heavytop.studies import runner
from heavytop.studies.conditioning import CaseReference, reference
from heavytop.studies.methods import ANGLES, AUTO, FIRST_ORDER, Method, stress_methods
from heavytop.studies.store import Chunk, MemoryStore, Parameters, open_store, reading
from heavytop.studies.stress_cases import Case, cases
from heavytop.studies.stress_runs import RunResult, run, stepper_of
from heavytop.studies.timed import Lost, TimedOut, Worker

KIND: Final = "stress"
SCHEMA: Final = "heavytop/stress/1"
LISTED: Final = "heavytop/stress-cases/1"
BUDGET_S: Final = 240.0
TIME_S: Final = 3.0
STEPS: Final = 2_000_000
LIST: Final = "heavytop stress --list"
NUMBERS: Final = {
    "budget": Range(0, 1e6),
    "time_limit": Range(0.01, 1e5),
    "step_limit": Range(1, 10**12, whole=True),
    "jobs": Range(1, 1024, whole=True),
}
MOST_LOST: Final = 2.0  # digits beyond the condition, of auto
KEPT: Final = 0.5  # of the digits that conditioning leaves
ASTRAY: Final = 0.1  # an error of the axis, of 2 at most
STILL: Final = 1e-3  # of the way the axis went
UNDETERMINED: Final = "nothing-to-tell"

WORKER: Final = Worker()  # of this process


class Outcome(StrEnum):
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
    Outcome.REFUSED: "it says beforehand that it cannot, and why",
    Outcome.TIME_LIMIT: "it had not come back at its time limit, or took longer",
    Outcome.STEP_LIMIT: "it had taken all the steps it may take, or more",
    Outcome.SINGULAR: "it stopped on the way: the equations gave no finite numbers",
    Outcome.STALLED: "its steps vanished or have no solution; or it rests where the axis moves",
    Outcome.DIVERGED: f"it says it has arrived, {ASTRAY:g} or more from the axis (where they are "
    "judged, from φ or ψ), or with no numbers",
    Outcome.INACCURATE: "it says it has arrived, without half of the digits that conditioning "
    "leaves",
    Outcome.MISSED_EVENTS: "it arrived in place, with more events or fewer than there are",
    Outcome.OK: "it arrived, with at least half of the digits that conditioning leaves",
}
STOPPED: Final = {
    "refused": Outcome.REFUSED,
    "singular": Outcome.SINGULAR,
    "step-limit": Outcome.STEP_LIMIT,
    "failed": Outcome.STALLED,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One run, judged.

    Attributes
    ----------
    case, method : str
    formulation : str
    outcome : Outcome
    error : float or None
        Distance of the axis from the true one at the end; of the tilt, where only that is given;
        of φ or ψ, where they are judged.
    digits_lost : float or None
        Decimal digits of the error beyond what conditioning allows.
    condition : float or None
    energy_error : float or None
    steps : int or None
    smallest_step : float or None
        [s]
    named : bool
        Whether the run itself said, by an error or a warning, that something is wrong.
    untold : bool
        Whether its outcome is chance, as conditioning leaves no digits.
    turns : (int, int), or None
        Whole turns by which φ and ψ are wrong, where the run follows them.
    plan, note : str
        What auto chose; what the run says, and what is wrong with it.
    seconds : float or None
        Wall-clock time [s].
    """

    case: str
    method: str
    formulation: str
    outcome: Outcome
    error: float | None = None
    digits_lost: float | None = None
    condition: float | None = None
    energy_error: float | None = None
    steps: int | None = None
    smallest_step: float | None = None
    named: bool = False
    untold: bool = False
    turns: tuple[int, int] | None = None
    plan: str = ""
    note: str = ""
    seconds: float | None = None

    @property
    def silently_wrong(self) -> bool:
        """Whether it lost digits or events, or had none to lose, and did not say so."""
        if self.named:
            return False
        lost = (self.digits_lost or 0.0) > MOST_LOST
        return lost or self.untold or self.outcome is not Outcome.OK

    def document(self) -> dict[str, Any]:
        """Return the run as a row of the document; without wall-clock values."""
        row = asdict(self) | {"outcome": str(self.outcome)}
        row["turns"] = self.turns and list(self.turns)
        del row["seconds"]
        return row


@dataclass(frozen=True, slots=True)
class SkippedRun:
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
    methods : tuple of Method
    runs : tuple of Run
        What became of each pair; ``stress["cusp", "auto"]`` is one.
    skipped : tuple of SkippedRun
        Runs that were not done.
    limits : dict from str to float
        ``time_s`` [s] and ``steps`` of a run, and the ``budget_s`` of all [s].
    apart : tuple of SkippedRun
        Pairs that do not go together.
    """

    cases: tuple[Case, ...]
    methods: tuple[Method, ...]
    runs: tuple[Run, ...]
    skipped: tuple[SkippedRun, ...]
    limits: Mapping[str, float]
    apart: tuple[SkippedRun, ...] = ()

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
        return tuple(run for run in self._of_auto if run.silently_wrong)

    def counts(self) -> dict[str, dict[str, int]]:
        """Return how often each method had each outcome, and how often there was nothing to tell.

        What is counted as nothing to tell is not counted as anything else.
        """
        found = {
            method.name: dict.fromkeys([*map(str, Outcome), UNDETERMINED], 0)
            for method in self.methods
        }
        for each in self.runs:
            found[each.method][UNDETERMINED if each.untold else str(each.outcome)] += 1
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
            "rules": {str(outcome): rule for outcome, rule in RULES.items()},
            "hard": {case.name: case.hard for case in self.cases},
            "methods": {each.name: each.short for each in self.methods},
            "settings": {each.name: each.heading for each in self.methods},
            "cases": [run.document() for run in self.runs],
            "skipped": [each.document() for each in self.skipped],
            "apart": [each.document() for each in self.apart],
            "auto": {
                "run": bool(self._of_auto),
                "silently_wrong": [run.case for run in self.silently_wrong],
            },
            "files": dict(files or {}),
            "versions": versions(),
        }

    @property
    def _of_auto(self) -> list[Run]:
        return [run for run in self.runs if run.formulation == AUTO]


# --- how a run is judged ---------------------------------------------------------------------


def judged(found: RunResult, truth: CaseReference, case: str, method: Method) -> Run:
    """Return what is said of a run; where its method is to follow φ and ψ, these are judged.

    Parameters
    ----------
    found : RunResult
    truth : CaseReference
    case : str
    method : Method
    """
    told = partial(
        Run,
        case=case,
        method=method.name,
        formulation=method.formulation,
        condition=min(truth.condition, 1e300),
        energy_error=found.energy_error,
        steps=found.steps,
        smallest_step=found.smallest_step,
        plan=found.plan,
        note=found.said,
        named=bool(found.said),
    )
    if found.ending in STOPPED:
        return told(outcome=STOPPED[found.ending], named=True)
    off = [a - b for a, b in zip(found.angles or (), truth.angles, strict=False)]
    if method.name == ANGLES:
        truth, error = truth.of_angles(), max(map(abs, off), default=math.nan)
    else:
        error = _error(found, truth)
    if not math.isfinite(error):
        return told(outcome=Outcome.DIVERGED, note="no numbers at the end", named=False)
    lost = truth.digits_lost(error)
    outcome, why = _outcome(found, truth, error, lost)
    untold = truth.hopeless and not found.more_bits
    turns = tuple(round(angle / math.tau) for angle in off)
    notes = [
        "nothing to tell: no digits left" if untold else "",
        why,
        ", ".join(map(_turned, ("φ", "ψ"), turns)).strip(", "),
        "" if found.more_bits else _leaving(truth),
        found.said,
    ]
    return told(
        outcome=outcome,
        error=error,
        digits_lost=lost,
        untold=untold,
        turns=(turns[0], turns[1]) if turns else None,
        note="; ".join(filter(None, notes)),
    )


def _error(found: RunResult, truth: CaseReference) -> float:
    if found.axis is not None:
        return math.dist(found.axis, truth.axis)
    return math.nan if found.theta is None else abs(found.theta - truth.theta)


def _outcome(
    found: RunResult, truth: CaseReference, error: float, lost: float
) -> tuple[Outcome, str]:
    """Return the outcome of a run that says it has arrived, and what is wrong with it."""
    poor = lost > (1 - KEPT) * truth.digits
    if poor and (found.resting or found.moved <= STILL * truth.moved):
        said = f"at rest after {found.steps} steps, and says that it has arrived"
        return Outcome.STALLED, said
    if poor or error >= ASTRAY:
        off = found.energy_error
        said = "says that it has arrived" + (
            "" if off is None else f"; its energy is off by {off:.0e}"
        )
        return Outcome.DIVERGED if error >= ASTRAY else Outcome.INACCURATE, said
    if missed := missed_events(found.counted, truth.counts):
        return Outcome.MISSED_EVENTS, "" if "events: " in found.said else missed
    return Outcome.OK, ""


def _turned(angle: str, turns: int) -> str:
    """Say by how many whole turns an angle is wrong: an axis and an energy do not see them."""
    return f"{angle} is off by {turns:+d} turn{'s'[: abs(turns) > 1]}" if turns else ""


def _leaving(truth: CaseReference) -> str:
    """Say where doubles hold nothing any more, whoever computes with them."""
    if truth.leaves is None:
        return ""
    return f"leaves the vertical's neighbourhood by rounding at t ≈ {truth.leaves:.3g} s"


def missed_events(counted: Mapping[str, int], counts: Counts | None) -> str:
    """Say which events were counted otherwise than there are.

    Where a method knows no cusps, phidot may touch zero in each of them, in none, or only at the
    start, which is one.

    Examples
    --------
    >>> missed_events({"turning": 5}, {"turning": (6, 6)})
    '5 turning, not 6'
    """
    if counts is None or not counted:
        return ""
    cusps = counts.get("cusp", (0, 0)) if "cusp" not in counted else (0, 0)
    wrong = []
    for name, found in counted.items():
        least, most = counts[name]
        touched = name == "reversal" and cusps[0] > 0 and found in (1, *cusps)
        if not (least <= found <= most or touched):
            wrong.append(f"{found} {name}, not {least}")
    return "; ".join(wrong)


# --- the study -------------------------------------------------------------------------------


class _Spent(Exception):
    """The budget was spent."""


def stress(
    *,
    cases: Sequence[str] | None = None,
    methods: Sequence[str] | None = None,
    budget: float = BUDGET_S,
    time_limit: float = TIME_S,
    step_limit: int = STEPS,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    progress: Callable[[float], object] | None = None,
) -> Stress:
    """Put methods under stress: at every motion at which some are known to fail.

    Parameters
    ----------
    cases, methods : sequence of str, optional
        Names; all when left out.
    budget : float
        Time after which no run is begun [s]; those that are left are listed as skipped.
    time_limit : float
        Time after which the process of a run is killed [s]; starting it is no part of the run.
    step_limit : int
        Steps after which a run is given up.
    jobs : int
        Runs at the same time.
    folder : path, optional
        Where every run is written down, so that a test that was killed goes on from there. It is
        new, or empty, or holds this test.
    executor : concurrent.futures.Executor, optional
        Its workers do the runs, and `jobs` means nothing.
    progress : callable, optional
        Called with the fraction done, after each run.

    Returns
    -------
    Stress

    Raises
    ------
    BadScene
        There is no such case or method; an option is out of its bounds. Every fault is listed.
    ForeignFile, InUse, StoppedEarly, ForeignWorker
        As for `heavytop.drift`.

    Examples
    --------
    >>> found = stress(cases=["through-top"], methods=["auto", "taylor-lagrange"])
    >>> print(found["through-top", "auto"].outcome, found["through-top", "taylor-lagrange"].outcome)
    ok singular

    Notes
    -----
    Accuracy: ``tests/two_ways/test_stress.py`` holds what a case allows to what the closed form
    makes of changed starts.
    """
    heard("progress", progress)
    limits = {"budget": budget, "time_limit": time_limit, "step_limit": step_limit, "jobs": jobs}
    parameters, values = _parameters(cases, methods, limits)

    def told(now: runner.Progress) -> None:
        if progress is not None:
            progress(now.fraction)

    place = None if folder is None else path_of("folder", folder)
    with open_store(place, parameters) as store:
        how = {"budget": values["budget"], "jobs": values["jobs"], "executor": executor}
        return complete(store, on_progress=told, **how)


def _parameters(
    some: Any, methods: Any, limits: Mapping[str, float]
) -> tuple[Parameters, dict[str, Any]]:
    """Return the test as JSON, and the limits, unless something is wrong with them."""
    found, no_cases = _named("cases", some, cases())
    asked, no_methods = _named("methods", methods, stress_methods())
    values, wrong = parse_options("stress", limits, NUMBERS)
    if faults := (*no_cases, *no_methods, *wrong):
        raise BadScene(faults)
    parameters = {
        "kind": KIND,
        "cases": found,
        "methods": asked,
        "time_limit": values["time_limit"],
        "step_limit": values["step_limit"],
        "versions": versions(),
    }
    return parameters, values


def _named(key: str, some: Any, known: Mapping[str, Any]) -> tuple[list[str], list[Fault]]:
    """Return the names of what is asked for, none of it twice, and all where nothing is named."""
    found, faults = parse_names("stress", key, known if some is None else some, one_of(known, LIST))
    return list(dict.fromkeys(each.name for each in found)), faults


def _pairs(parameters: Parameters) -> list[tuple[Case, Method]]:
    known = stress_methods()
    return [(cases()[c], known[m]) for m in parameters["methods"] for c in parameters["cases"]]


def _apart(case: Case, method: Method) -> bool:
    return method.formulation == FIRST_ORDER and not case.first_order


def renewed(parameters: Parameters) -> Parameters:
    """Return the parameters that a test asked for with these would have."""
    limits = {"time_limit": parameters["time_limit"], "step_limit": parameters["step_limit"]}
    return _parameters(parameters["cases"], parameters["methods"], limits)[0]


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the runs: a case and a method."""
    return [
        f"{case.name}/{method.name}"
        for case, method in _pairs(parameters)
        if not (method.absent or _apart(case, method))
    ]


def complete(
    store: MemoryStore,
    *,
    budget: float = BUDGET_S,
    on_progress: Callable[[runner.Progress], object] | None = None,
    **how: Any,
) -> Stress:
    """Do the runs that are left and for which there is time, and return the result."""
    until = time.monotonic() + budget

    def heard(now: runner.Progress) -> None:
        if on_progress is not None:
            on_progress(now)
        if now.ended < now.tasks and time.monotonic() >= until:
            raise _Spent

    with suppress(_Spent), WORKER:
        runner.run(store, on_progress=heard, **how)
    return collect(store, budget)


def collect(store: MemoryStore, budget: float = BUDGET_S) -> Stress:
    """Return what is stored of a stress test.

    Parameters
    ----------
    store : MemoryStore
    budget : float
        What it was given [s].
    """
    parameters, runs, skipped, apart = store.parameters, [], [], []
    for case, method in _pairs(parameters):
        name = f"{case.name}/{method.name}"
        record = store.load(name)
        no_run = partial(SkippedRun, case.name, method.name)
        if record.done:
            with reading(f"run {name}"):
                [row] = record.rows
                turns = row["turns"] and (*row["turns"],)
                read = {"outcome": Outcome(row["outcome"]), "turns": turns}
                runs.append(Run(**row | read, seconds=store.seconds.get(name)))
        elif _apart(case, method):
            apart.append(no_run("it solves u' = ±√f(u), for the case first-order alone"))
        elif method.absent:
            skipped.append(no_run(f"{', '.join(method.absent)} is not installed"))
        elif record.failed:
            skipped.append(no_run(record.failed, lost=True))
        else:
            skipped.append(no_run("the budget was spent"))
    return Stress(
        cases=tuple(cases()[name] for name in parameters["cases"]),
        methods=tuple(stress_methods()[name] for name in parameters["methods"]),
        runs=tuple(runs),
        skipped=tuple(skipped),
        limits={
            "budget_s": budget,
            "time_s": parameters["time_limit"],
            "steps": parameters["step_limit"],
        },
        apart=tuple(apart),
    )


def advance(parameters: Parameters, task: str, _checkpoint: object) -> Iterator[Chunk]:
    """Do one run in a process that can be killed; no clock runs while it gets ready."""
    case, _, method = task.partition("/")
    time_limit, asked = parameters["time_limit"], (case, method, reference(case))
    form = stress_methods()[method].formulation
    late = partial(Run, case=case, method=method, formulation=form, outcome=Outcome.TIME_LIMIT,
                   named=True)  # fmt: skip
    seconds = time_limit
    try:
        WORKER.call(get_ready, *asked)
        limits = (parameters["step_limit"],)
        found, seconds = WORKER.call(put_to_test, *asked, *limits, timeout=time_limit)
        if seconds > time_limit:
            found = late(note=f"back after {seconds:.2g} s")
    except TimedOut:
        found = late(note=f"killed after {time_limit:g} s")
    except Lost as death:
        raise HeavyTopError(f"its process was lost: {death}") from None
    yield Chunk(rows=[found.document()], done=True, seconds=seconds)


def get_ready(case: str, method: str, truth: CaseReference) -> None:
    """In the worker: silence the Fortran and C of solvers, and compile what a method needs."""
    with Path(os.devnull).open("w") as nothing:
        os.dup2(nothing.fileno(), 2)
    chosen = stress_methods()[method]
    if chosen.is_rival and not chosen.solver:
        stepper_of(cases()[case], chosen, truth)


def put_to_test(case: str, method: str, truth: CaseReference, step_limit: int) -> tuple[Run, float]:
    """In the worker: do a run, and judge it; return it with the time it took [s]."""
    chosen = stress_methods()[method]
    began = time.perf_counter()
    found = run(cases()[case], chosen, truth, step_limit)
    seconds = time.perf_counter() - began
    return judged(found, truth, case, chosen), seconds


def listing() -> dict[str, Any]:
    """Return all cases and methods as the document heavytop/stress-cases/1.

    Examples
    --------
    >>> [found] = [case for case in listing()["cases"] if case["name"] == "cusp"]
    >>> found["start"]["psidot"], found["span"]
    ('140', '2.618 periods')
    """
    methods = stress_methods().values()
    return {
        "schema": LISTED,
        "cases": [case.document() for case in cases().values()],
        "methods": [
            {"name": m.name, "short": m.short, "formulation": m.formulation, "setting": m.heading}
            for m in methods
        ],
    }
