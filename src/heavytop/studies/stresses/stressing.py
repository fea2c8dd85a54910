"""Doing a stress test: every run in a process that can be killed, all within a budget."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeVar

from heavytop.comparison.methods import absent
from heavytop.comparison.methods import named as rival
from heavytop.errors import BadScene, Fault
from heavytop.machine import versions
from heavytop.scene.arguments import Range, heard, one_of, parse_names, parse_options
from heavytop.scene.scene import Scene
from heavytop.studies.stresses.cases import Case, cases
from heavytop.studies.stresses.keeper import PATIENCE_S, Keeper, Killed, Lost
from heavytop.studies.stresses.methods import AUTO, METHODS, Method
from heavytop.studies.stresses.outcome import Word
from heavytop.studies.stresses.stress import Run, Skipped, Stress

BUDGET_S: Final = 240.0
TIME_S: Final = 3.0
STEPS: Final = 2_000_000
LIST: Final = "heavytop stress --list"
NUMBERS: Final = {
    "budget": Range(0, 1e6),
    "time_limit": Range(0.01, 1e5),
    "step_limit": Range(1, 10**12, whole=True),
}

T = TypeVar("T")
Show = Callable[[float], object]


def stress(
    *,
    cases: Sequence[str] | None = None,
    methods: Sequence[str] | None = None,
    budget: float = BUDGET_S,
    time_limit: float = TIME_S,
    step_limit: int = STEPS,
    progress: Show | None = None,
) -> Stress:
    """Put methods under stress: at every motion at which some are known to fail.

    Parameters
    ----------
    cases, methods : sequence of str, optional
        Names; all when left out.
    budget : float
        Time for all of it [s], the truths of the cases included; runs for which it does not suffice
        are listed as skipped.
    time_limit : float
        Time after which the process of a run is killed [s]; starting it is no part of the run.
    step_limit : int
        Steps after which a run is given up.
    progress : callable, optional
        Called with the fraction done, after each run.

    Returns
    -------
    Stress

    Raises
    ------
    BadScene
        There is no such case or method; an option is out of its bounds. Every fault is listed.

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
    limits = {"budget": budget, "time_limit": time_limit, "step_limit": step_limit}
    chosen, asked, limits = _chosen(cases, methods, limits)
    pairs = [(c, m) for m in asked for c in chosen if not _apart(c, m)]
    apart = filter(None, (_apart(c, m) for m in asked for c in chosen))
    runs: list[Run] = []
    skipped: list[Skipped] = []
    until = time.monotonic() + limits["budget"]
    keeper = Keeper({"kind": "stress", "step_limit": limits["step_limit"], "versions": versions()})
    try:
        for number, (case, method) in enumerate(_in_order(pairs)):
            found = _one(keeper, case, method, limits["time_limit"], until)
            (runs if isinstance(found, Run) else skipped).append(found)  # type: ignore[arg-type]
            if progress is not None:
                progress((number + 1) / len(pairs))
    finally:
        keeper.close()
    place = {(case.name, method.name): i for i, (case, method) in enumerate(pairs)}
    for some in (runs, skipped):
        some.sort(key=lambda each: place[each.case, each.method])
    return Stress(chosen, asked, tuple(runs), tuple(skipped), _bounds(limits), tuple(apart))


def _in_order(pairs: list[tuple[Case, Method]]) -> list[tuple[Case, Method]]:
    """Return auto first, and what must be compiled, method by method; then the rest case by case.

    A worker that had to be killed takes with it what it compiled, and the truths that it knew.
    """
    first = [pair for pair in pairs if pair[1].formulation == AUTO or pair[1].rival]
    cases = list(dict.fromkeys(case.name for case, _ in pairs))
    rest = [pair for pair in pairs if pair not in first]
    return first + sorted(rest, key=lambda pair: cases.index(pair[0].name))


def _apart(case: Case, method: Method) -> Skipped | None:
    """Say why a method is not put to a case, if it is not."""
    if method.first_order and not case.first_order:
        return Skipped(case.name, method.name, "it solves u' = ±√f(u), put to first-order only")
    return None


def _package(method: Method) -> str:
    """Return the packages that a method lacks, in words."""
    lacking = absent(rival(method.rival)) if method.rival else ()
    return ", ".join(lacking)


def _one(
    keeper: Keeper, case: Case, method: Method, time_limit: float, until: float
) -> Run | Skipped:
    spent = Skipped(case.name, method.name, "the budget was spent")
    if lacking := _package(method):
        return Skipped(case.name, method.name, f"{lacking} is not installed")
    try:
        if not _prepared(keeper, case, method, until):
            return spent
        limit = min(time_limit, until - time.monotonic())
        row, seconds = keeper.run(limit)
    except Late:
        return Skipped(case.name, method.name, f"its truth had not come after {PATIENCE_S:g} s")
    except Killed:
        return spent if limit < time_limit else _late(case, method, f"killed after {limit:g} s")
    except Lost as death:
        reason = f"its process was lost: {death}"
        return Skipped(case.name, method.name, reason, lost=True)
    if seconds > time_limit:
        return _late(case, method, f"back after {seconds:.2g} s")
    row["turns"] = None if row["turns"] is None else tuple(row["turns"])
    word = Word(row.pop("outcome"))
    return Run(case.name, method.name, method.formulation, word, **row, seconds=seconds)


class Late(Exception):
    """What a case allows was not known in time: no method is to blame."""


def _prepared(keeper: Keeper, case: Case, method: Method, until: float) -> bool:
    """Let a worker get ready, if the budget lasts so long."""
    left = until - time.monotonic()
    if left <= 0:
        return False
    try:
        keeper.prepare(f"{case.name}/{method.name}", min(PATIENCE_S, left))
    except Killed:
        if left >= PATIENCE_S:
            raise Late from None
        return False
    return time.monotonic() < until


def _late(case: Case, method: Method, note: str) -> Run:
    word = Word.TIME_LIMIT
    return Run(case.name, method.name, method.formulation, word, note=note, named=True)


def _bounds(limits: Mapping[str, float]) -> dict[str, float]:
    units = {"budget": "budget_s", "time_limit": "time_s", "step_limit": "steps"}
    return {units[name]: limit for name, limit in limits.items()}


def _chosen(
    some: Sequence[str] | None, methods: Sequence[str] | None, limits: Mapping[str, float]
) -> tuple[tuple[Case, ...], tuple[Method, ...], dict[str, Any]]:
    found, no_cases = _each("cases", _names(some), cases())
    asked, no_methods = _each("methods", methods, METHODS)
    values, wrong = parse_options("stress", limits, NUMBERS)
    if faults := [*no_cases, *no_methods, *wrong]:
        raise BadScene(tuple(faults))
    return found, asked, values


def _names(some: Any) -> Any:
    """Refuse scenes by a word of their own: somebody hoped to add a case.

    Raises
    ------
    BadScene
    """
    given = [some] if isinstance(some, Scene) else some
    listed = given if isinstance(given, list | tuple) else []
    scenes = [each for each in listed if isinstance(each, Scene)]
    if not scenes:
        return some
    rule = "names of cases, which are built in; drift and work_precision take a scene of your own"
    raise BadScene(tuple(Fault("stress", None, "cases", f"scene {s.name}", rule) for s in scenes))


def _each(
    key: str, some: Sequence[str] | None, known: Mapping[str, T]
) -> tuple[tuple[T, ...], list[Fault]]:
    """Return what is asked for by name, none of it twice, and all where nothing is named."""
    found, faults = parse_names("stress", key, known if some is None else some, one_of(known, LIST))
    return tuple({id(each): each for each in found}.values()), faults
