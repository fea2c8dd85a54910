"""Stress tests: every method at every motion at which some are known to fail, and how each fails.

A task is a method at a case, in a process that can be killed.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from itertools import product
from pathlib import Path
from typing import Any, Final

from heavytop import errors
from heavytop.comparison import user
from heavytop.doctor import versions
from heavytop.results.stress import NO_RUN, Stress, StressCases, StressOutcome
from heavytop.results.table import Row
from heavytop.scene.arguments import JOBS, Range, one_of, parse_names, parse_options
from heavytop.scene.scene import Scene
from heavytop.studies.journal import Chunk, Journal, Parameters, keep_budget
from heavytop.studies.methods import parameters_of, read_methods, stress_method, stress_methods
from heavytop.studies.stress_cases import CaseReference, reference
from heavytop.studies.stress_cases import cases as all_cases
from heavytop.studies.stress_runs import judge, prepare
from heavytop.studies.study import Progress, run
from heavytop.studies.workers import SET_UP_S, TIMED_WORKER, TimedOut, check_how

KIND: Final = "stress"
BUDGET_S: Final = 240.0
TIME_S: Final = 3.0
MOST_STRESS_STEPS: Final = 2_000_000
STRESS_LIMITS: Final = {"budget": Range(0, 1e6), "time_limit": Range(0.01, 1e5), "jobs": JOBS}

# --- the study -------------------------------------------------------------------------------


def stress(
    *,
    cases: Sequence[str] | None = None,
    methods: Sequence[str | user.Method | Callable[..., Any]] | None = None,
    budget: float = BUDGET_S,
    time_limit: float = TIME_S,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Stress:
    """Run methods at every motion at which some are known to fail.

    Parameters
    ----------
    cases : sequence of str, optional
        Names; all when left out.
    methods : sequence of str, Method or callable, optional
        Names; all when left out. Those of your own are as in `heavytop.drift`, and stand in a file
        or a module.
    budget : float
        Time after which no run is begun [s]; those that are left are listed as skipped.
    time_limit : float
        Time after which the process of a run is killed [s]; starting it is no part of the run.
    jobs : int
        Runs at the same time.
    folder : path, optional
        Where every run is written down, so that a test that was killed goes on from there. It is
        new, or empty, or holds this test.
    executor : concurrent.futures.Executor, optional
        Its workers do the runs, and `jobs` means nothing.
    progress : callable, optional
        It is given a `heavytop.studies.study.Progress` after each run.

    Returns
    -------
    Stress

    Raises
    ------
    BadScene
        There is no such case or method; an option is out of its bounds. Every fault is listed.
    ForeignFile, InUse, StoppedEarly
        As for `heavytop.drift`.

    Examples
    --------
    >>> found = stress(cases=["through-top"], methods=["auto", "taylor-lagrange"])
    >>> print(found["through-top", "auto"].outcome, found["through-top", "taylor-lagrange"].outcome)
    ok singular

    Notes
    -----
    Accuracy: ``tests/studies/test_stress.py`` compares the conditions of cases with integrated
    variational equations.
    """
    check_how(progress, executor)
    limits = {"budget": budget, "time_limit": time_limit, "jobs": jobs}
    values, faults = parse_options(KIND, limits, STRESS_LIMITS)
    some_cases = all_cases() if cases is None else cases
    some_methods = stress_methods() if methods is None else methods
    chosen, no_cases = parse_names(KIND, "cases", some_cases, one_of(all_cases()))
    known, no_methods = read_methods(KIND, some_methods, stress_method)
    errors.refuse(faults, no_cases, no_methods)
    names = [each.name for each in known]
    user.expect_anywhere(names)
    if all(each.absent for each in known):
        raise errors.MissingPackage(known[0].name, known[0].absent)
    tried = [*dict.fromkeys(each.name for each in chosen)]
    parameters = parameters_of(KIND, names, cases=tried, time_limit=values.pop("time_limit"))
    with Journal.open(folder, parameters) as journal:
        return complete(journal, executor=executor, on_progress=progress, **values)


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the runs: a case and a method."""
    there = [name for name in parameters["methods"] if not stress_method(name).absent]
    return [f"{case}/{method}" for method in there for case in parameters["cases"]]


def complete(journal: Journal, *, budget: float | None = None, **how: Any) -> Stress:
    """Do those runs that are left for which there is time, and return the result."""
    budget = keep_budget(journal, budget, BUDGET_S)
    run(journal, budget=budget, **how)
    return collect(journal, budget)


def collect(journal: Journal, budget: float = BUDGET_S) -> Stress:
    """Return the result of a stress test as far as it is stored.

    Parameters
    ----------
    journal : Journal
    budget : float
        Its budget [s].
    """
    parameters, runs, skipped = journal.parameters, list[Any](), list[Any]()
    methods = [stress_method(name) for name in parameters["methods"]]
    for method, case in product(methods, parameters["cases"]):
        task = f"{case}/{method.name}"
        last = journal.record(task).last
        if last.done:
            [row] = journal.rows(task)
            runs.append({**NO_RUN, **row, "outcome": StressOutcome(row["outcome"])})
            continue
        absent = method.absent and str(errors.MissingPackage(method.name, method.absent))
        reason = absent or last.failed or "the budget was spent"
        about = {"case": case, "method": method.name, "reason": reason}
        skipped.append(about | {"lost": last.failed is not None})
    limits = {"budget_s": budget, "time_s": parameters["time_limit"], "steps": MOST_STRESS_STEPS}
    hard = {name: all_cases()[name].title for name in parameters["cases"]}
    heads = {each.name: f"{each.short} {each.set_to}".rstrip() for each in methods}
    found: Any = {"cases": runs, "skipped": skipped, "versions": versions()}
    return Stress(limits=limits, hard=hard, methods=heads, **found)


def advance(parameters: Parameters, task: str, _checkpoint: object) -> Iterator[Chunk]:
    """Do one run in a process that can be killed; its time limit begins once it is set up."""
    case, _, method = task.partition("/")
    limit, own = parameters["time_limit"], user.origins(parameters.get("own", {}))
    arguments = case, method, reference(case), own
    try:
        [_, found] = TIMED_WORKER.stages(run_task, *arguments, limits=(SET_UP_S, limit))
    except TimedOut as late:
        about = {"case": case, "method": method, "formulation": stress_method(method).states}
        what = {"outcome": StressOutcome.TIME_LIMIT, "note": f"killed: {late}"}
        found = Row(NO_RUN, **about, **what, named=True)
    yield Chunk(rows=[found], done=True)


def run_task(
    case: str, method: str, truth: CaseReference, methods: user.Origins = ()
) -> Iterator[Row]:
    """In a worker: yield an empty row once the method is compiled, then that of its run."""
    user.load(methods)
    with Path(os.devnull).open("w", encoding="utf-8") as nothing:  # Fortran and C print here
        os.dup2(nothing.fileno(), 2)
    chosen = stress_method(method)
    do_run = prepare(all_cases()[case], chosen, truth, MOST_STRESS_STEPS)
    yield Row()
    yield judge(do_run(), truth, case, chosen)


def listing() -> StressCases:
    """Return all cases and methods.

    Examples
    --------
    >>> [found] = [case for case in listing().cases if case.name == "cusp"]
    >>> found.start.psidot, found.span
    ('140', '2.618 periods')
    """
    return StressCases(
        cases=tuple(map(_describe, all_cases().values())),
        methods=tuple(
            {"name": m.name, "short": m.short, "formulation": m.formulation, "setting": m.set_to}
            for m in stress_methods().values()
        ),
    )


def _describe(case: Scene) -> dict[str, Any]:
    """A case as a row of the document heavytop/stress-cases/1."""
    span = f"{case.time} s" if case.periods is None else f"{case.periods} periods"
    top = {name: str(getattr(case.top, name)) for name in ("A", "C", "gMR")}
    start = {name: str(value) for name, value in case.start.given}
    about = {"span": span, "why": case.title, "events": bool(case.events)}
    return {"name": case.name, "top": top, "start": start, **about}
