"""Doing a stress test: every run in a process that can be killed, all within a budget."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeVar

from heavytop.errors import BadScene, Fault
from heavytop.machine import versions
from heavytop.stresses.cases import Case, cases
from heavytop.stresses.keeper import Keeper, Killed, Lost
from heavytop.stresses.methods import METHODS, Method, nearest
from heavytop.stresses.outcome import Word
from heavytop.stresses.stress import Run, Skipped, Stress

BUDGET_S: Final = 240.0
TIME_S: Final = 3.0
STEPS: Final = 2_000_000
BOUNDS: Final = {"budget": (0.0, 1e6), "time_limit": (0.01, 1e5), "step_limit": (1, 1e12)}

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
        Time for all of it [s]; runs for which it does not suffice are listed as skipped.
    time_limit : float
        Time after which the process of a run is killed [s].
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
    """
    limits = {"budget": budget, "time_limit": time_limit, "step_limit": step_limit}
    chosen, asked = _chosen(cases, methods, limits)
    pairs = [(c, m) for m in asked for c in chosen if c.first_order or not m.first_order]
    runs: list[Run] = []
    skipped: list[Skipped] = []
    until = time.monotonic() + budget
    keeper = Keeper({"kind": "stress", "step_limit": int(step_limit), "versions": versions()})
    try:
        for number, (case, method) in enumerate(pairs):
            found = _one(keeper, case, method, time_limit, until)
            (runs if isinstance(found, Run) else skipped).append(found)  # type: ignore[arg-type]
            if progress is not None:
                progress((number + 1) / len(pairs))
    finally:
        keeper.close()
    bounds = {"budget_s": budget, "time_s": time_limit, "steps": step_limit}
    return Stress(chosen, asked, tuple(runs), tuple(skipped), bounds)


def _one(
    keeper: Keeper, case: Case, method: Method, time_limit: float, until: float
) -> Run | Skipped:
    spent = Skipped(case.name, method.name, "the budget was spent")
    if time.monotonic() >= until:
        return spent
    whose = (case.name, method.name, method.formulation)
    limit = time_limit
    try:
        keeper.prepare(f"{case.name}/{method.name}")
        limit = min(time_limit, until - time.monotonic())
        row, seconds = keeper.run(limit)
    except Killed:
        if limit < time_limit:
            return spent
        return Run(*whose, Word.TIME_LIMIT, note=f"killed after {time_limit:g} s", named=True)
    except Lost as death:
        return Skipped(case.name, method.name, f"its process was lost: {death}")
    word = Word(row.pop("outcome"))
    return Run(*whose, word, **row, seconds=seconds)


def _chosen(
    some: Sequence[str] | None, methods: Sequence[str] | None, limits: Mapping[str, float]
) -> tuple[tuple[Case, ...], tuple[Method, ...]]:
    faults: list[Fault] = []
    found = _named("cases", some, cases(), faults)
    asked = _named("methods", methods, METHODS, faults)
    for name, value in limits.items():
        least, most = BOUNDS[name]
        if not least <= value <= most:  # nan too
            faults.append(Fault("stress", None, name, str(value), f"from {least:g} to {most:g}"))
    if faults:
        raise BadScene(tuple(faults))
    return found, asked


def _named(
    key: str, names: Sequence[str] | None, known: Mapping[str, T], faults: list[Fault]
) -> tuple[T, ...]:
    if names is None:
        return tuple(known.values())
    if not names:
        faults.append(Fault("stress", None, key, "", "at least one"))
    for name in names:
        if name not in known:
            rule = f"one of {', '.join(known)}"
            faults.append(Fault("stress", None, key, name[:60], rule, nearest(name, known)))
    return tuple(known[name] for name in dict.fromkeys(names) if name in known)
