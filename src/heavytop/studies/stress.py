"""Stress: the motions at which methods fail, every method at each of them, and how each fails.

A task is a method at a case, done as its user would do it, in a process that can be killed.
Compiled methods of others are stepped in the axis form; those of fixed step take so many steps that
the last one ends with the span, their step being a part of the nutation period, or of the
pendulum's where nothing nutates. scipy's solvers are called once, from the start to the end.
"""

from __future__ import annotations

import math
import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter

from heavytop import errors
from heavytop.comparison import own
from heavytop.comparison.adaptive import Singular, scipy_stepper
from heavytop.comparison.methods import make_stepper
from heavytop.comparison.steppers import (
    FixedStep,
    InitialValueProblem,
    IntegrationFailed,
    Stepper,
)
from heavytop.exact.pairs import Array, two_product
from heavytop.integration.outputs import event_function, invariants, sample
from heavytop.machine import versions
from heavytop.results.stress import ASTRAY, AUTO, Run, SkippedRun, Stress, StressOutcome
from heavytop.run.events import Counts
from heavytop.run.planning import Plan
from heavytop.run.propagation import binary_start, propagate
from heavytop.run.verify import energy_error
from heavytop.scene.arguments import Range, heard, one_of, parse_names, parse_options
from heavytop.studies.methods import (
    ANGLES,
    TOLERANCE,
    MethodSetting,
    admitted,
    stress_method,
    stress_methods,
)
from heavytop.studies.steppers import top_constants
from heavytop.studies.stress_cases import Case, CaseReference, cases, reference
from heavytop.studies.study import (
    Chunk,
    Journal,
    Parameters,
    Progress,
    keep_budget,
    open_journal,
    reading,
    run,
)
from heavytop.studies.workers import SET_UP_S, TIMED_WORKER, Lost, TimedOut

KIND: Final = "stress"
LISTED: Final = "heavytop/stress-cases/1"
BUDGET_S: Final = 240.0
TIME_S: Final = 3.0
STEPS: Final = 2_000_000
LIMITS: Final = ("time_limit", "step_limit")  # of a run
LIST: Final = "heavytop stress --list"
NUMBERS: Final = {
    "budget": Range(0, 1e6),
    "time_limit": Range(0.01, 1e5),
    "step_limit": Range(1, 10**12, whole=True),
    "jobs": Range(1, 1024, whole=True),
}
KEPT: Final = 0.5  # of the digits that conditioning leaves
BLOCK: Final = 1000  # steps of a fixed step between two looks,
CALL: Final = 50  # and of CyRK, whose steps are known by whole blocks only
OWN_WARNINGS: Final = (errors.DoubtfulWarning,)
WATCHED: Final = ("turning", "reversal")  # sign changes are all that scipy finds: a cusp is none
WANTED: Final = {"taylor-cubic": ("theta",), ANGLES: ("axis", "phi", "psi")}

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
    progress: Callable[[Progress], object] | None = None,
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
    Accuracy: ``tests/studies/test_stress.py`` holds what a case allows to integrated variational
    equations.
    """
    heard("progress", progress)
    methods = methods and admitted(methods, KIND)
    limits = {"budget": budget, "time_limit": time_limit, "step_limit": step_limit, "jobs": jobs}
    parameters, values = _parameters(cases, methods, limits)
    how = {"budget": values["budget"], "jobs": values["jobs"], "executor": executor}
    with open_journal(folder, parameters) as journal:
        return complete(journal, on_progress=progress, **how)


def _parameters(
    some: Any, methods: Any, limits: Mapping[str, float]
) -> tuple[Parameters, dict[str, Any]]:
    """Return the test as JSON, and the limits, unless something is wrong with them."""
    values, faults = parse_options("stress", limits, NUMBERS)
    some = cases() if some is None else some
    methods = stress_methods() if methods is None else methods
    chosen, no_cases = parse_names(KIND, "cases", some, one_of(cases(), LIST))
    known, no_methods = parse_names(KIND, "methods", methods, stress_method)
    if faults := [*faults, *no_cases, *no_methods]:
        raise errors.BadScene(tuple(faults))
    names = list(dict.fromkeys(each.name for each in known))
    own.expect_anywhere(names)
    parameters = {
        "kind": KIND,
        "cases": list(dict.fromkeys(each.name for each in chosen)),
        "methods": names,
        **{name: values[name] for name in LIMITS},
        **own.stated(names),
        "versions": versions(),
    }
    return parameters, values


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the runs: a case and a method."""
    there = [name for name in parameters["methods"] if not stress_method(name).absent]
    return [f"{case}/{method}" for method in there for case in parameters["cases"]]


def complete(
    journal: Journal,
    *,
    budget: float | None = None,
    on_progress: Callable[[Progress], object] | None = None,
    **how: Any,
) -> Stress:
    """Do the runs that are left and for which there is time, and return the result."""
    budget = keep_budget(journal, budget, BUDGET_S)
    until = time.monotonic() + budget

    def heard(now: Progress) -> None:
        if on_progress is not None:
            on_progress(now)
        if now.ended < now.tasks and time.monotonic() >= until:
            raise _Spent

    with suppress(_Spent):
        run(journal, on_progress=heard, **how)
    return collect(journal, budget)


def collect(journal: Journal, budget: float = BUDGET_S) -> Stress:
    """Return what is stored of a stress test.

    Parameters
    ----------
    journal : Journal
    budget : float
        What it was given [s].
    """
    parameters, runs, skipped = journal.parameters, [], []
    methods = [stress_method(name) for name in parameters["methods"]]
    for method in methods:
        for case in parameters["cases"]:
            record = journal.load(f"{case}/{method.name}")
            if record.done:
                with reading(f"run {record.task}"):
                    [row] = record.rows
                    runs.append(TypeAdapter(Run).validate_python(row))
                continue
            absent = method.absent and f"{', '.join(method.absent)} is not installed"
            reason = absent or record.failed or "the budget was spent"
            lost = record.failed is not None
            skipped.append(SkippedRun(case=case, method=method.name, reason=reason, lost=lost))
    limits = {"time_s": parameters["time_limit"], "steps": parameters["step_limit"]}
    return Stress(
        limits={"budget_s": budget, **limits},
        hard={name: cases()[name].hard for name in parameters["cases"]},
        methods={each.name: f"{each.short} {each.set_to}".rstrip() for each in methods},
        cases=tuple(runs),
        skipped=tuple(skipped),
        versions=versions(),
    )


def advance(parameters: Parameters, task: str, _checkpoint: object) -> Iterator[Chunk]:
    """Do one run in a process that can be killed; no clock runs while it gets ready."""
    case, _, method = task.partition("/")
    asked, limit = (case, method, reference(case)), parameters["time_limit"]
    try:
        passes = own.passes(parameters.get("own", {}))
        TIMED_WORKER.call(get_ready, *asked, passes, timeout=SET_UP_S)
        found = TIMED_WORKER.call(put_to_test, *asked, parameters["step_limit"], timeout=limit)
    except TimedOut:
        form = stress_method(method).states
        found = Run(case=case, method=method, formulation=form, outcome=StressOutcome.TIME_LIMIT,
                    named=True, note=f"killed after {limit:g} s")  # fmt: skip
    except Lost as death:
        raise errors.HeavyTopError(f"its process was lost: {death}") from None
    yield Chunk(rows=[found.document()], done=True)


def get_ready(
    case: str, method: str, truth: CaseReference, methods: Sequence[tuple[str, str, str]] = ()
) -> None:
    """In the worker: silence the Fortran and C of solvers, and compile what a method needs."""
    own.let_pass(methods)
    with Path(os.devnull).open("w", encoding="utf-8") as nothing:
        os.dup2(nothing.fileno(), 2)
    chosen = stress_method(method)
    _PREPARED.clear()
    if chosen.is_rival and not chosen.solver:
        _PREPARED[f"{case}/{method}"] = stepper_of(cases()[case], chosen, truth)


_PREPARED: Final[dict[str, tuple[Stepper, int]]] = {}  # in a worker: what the next run takes


def put_to_test(case: str, method: str, truth: CaseReference, step_limit: int) -> Run:
    """In the worker: do a run, and judge it."""
    chosen = stress_method(method)
    return judged(run_case(cases()[case], chosen, truth, step_limit), truth, case, chosen)


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
            {"name": m.name, "short": m.short, "formulation": m.formulation, "setting": m.set_to}
            for m in methods
        ],
    }


# --- one run ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Attempt:
    """What one run gave, before it is judged.

    Attributes
    ----------
    stopped : StressOutcome or None
        What stopped it on the way.
    said : str
        What it said of that, or of a doubt.
    steps : int
    axis : tuple of 3 float, or None
        At the end; None where the formulation gives the tilt alone.
    theta : float or None
    angles : tuple of float
        phi and psi at the end, where the run follows them [rad].
    energy_error : float or None
        How far E' is off its start, relative to max(|E'|, gMR).
    counted : dict from str to int
        Events.
    plan : str
        What auto chose.
    more_bits : bool
        Whether it had more than doubles have.
    """

    stopped: StressOutcome | None = None
    said: str = ""
    steps: int = 0
    axis: tuple[float, float, float] | None = None
    theta: float | None = None
    angles: tuple[float, ...] = ()
    energy_error: float | None = None
    counted: Mapping[str, int] = field(default_factory=dict)
    plan: str = ""
    more_bits: bool = False


def run_case(case: Case, method: MethodSetting, truth: CaseReference, step_limit: int) -> Attempt:
    """Do one run.

    Parameters
    ----------
    case : Case
    method : MethodSetting
        One of `heavytop.studies.methods.stress_methods`.
    truth : CaseReference
        Of the case; only its end and its period are used.
    step_limit : int
        Steps after which it is given up. What looks at them between blocks takes a whole block.
    """
    if not method.is_rival:
        found = _taylor(case, method, step_limit)
    else:
        found = (_called if method.solver else _stepped)(case, method, truth, step_limit)
    if found.stopped is None and found.steps > step_limit:
        said = f"{found.steps} steps, more than its limit"
        return replace(found, stopped=StressOutcome.STEP_LIMIT, said=said)
    return found


def _taylor(case: Case, method: MethodSetting, step_limit: int) -> Attempt:
    scene = replace(case.scene, quantities=WANTED.get(method.name, ("axis",)))
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        try:
            found = propagate(scene, formulation=method.formulation, step_limit=step_limit)
        except errors.BadScene as refusal:
            return Attempt(StressOutcome.REFUSED, "; ".join(fault.rule for fault in refusal.faults))
        except errors.EndedEarly as early:
            found = early.trajectory
    said = "; ".join(str(w.message) for w in heard if issubclass(w.category, OWN_WARNINGS))
    end, chosen = found.orbit.end, found.plan
    result = Attempt(said=said, steps=found.statistics.steps)
    if method.formulation == AUTO:
        parts = (chosen.formulation, chosen.precision, "projected" if chosen.projected else "")
        plan, more_bits = ", ".join(filter(None, parts)), chosen.precision != "double"
        result = replace(result, plan=plan, more_bits=more_bits)
    if found.outcome is not errors.Outcome.FINISHED:
        why = said or f"{found.outcome.sentence}, at t = {end:.6g} s"
        return replace(result, stopped=StressOutcome(found.outcome), said=why)
    with np.errstate(all="ignore"):
        counted = {name: found.events.count(name) or 0 for name in scene.events}
        result = replace(result, energy_error=energy_error(found), counted=counted)
        return _with_motion(result, found([end]))


def stepper_of(case: Case, method: MethodSetting, truth: CaseReference) -> tuple[Stepper, int]:
    """Return a method set up for a case, and how many its steps are if they have one length.

    What it compiles is compiled here.
    """
    parameters, start = binary_start(case.scene, Plan(method.formulation))
    ahead, span = (1 if truth.end >= 0 else -1), abs(truth.end)
    if method.set_by == TOLERANCE:
        setting, steps, block = method.setting, 0, CALL
    else:
        period = truth.period or math.tau / math.sqrt(abs(parameters["g"]))
        steps = math.ceil(span / period * method.setting)
        setting, block = float(steps), min(steps, BLOCK)
    name = method.name.partition("=")[0]
    top = top_constants(case.scene.top)
    found = make_stepper(name, start.state, parameters, setting, span, ahead, steps=block, top=top)
    return found, steps


def _stepped(case: Case, method: MethodSetting, truth: CaseReference, step_limit: int) -> Attempt:
    """Let a compiled method go block by block until one holds the end."""
    prepared = _PREPARED.pop(f"{case.name}/{method.name}", None)
    stepper, steps = prepared or stepper_of(case, method, truth)
    if steps > step_limit:
        return Attempt(StressOutcome.STEP_LIMIT, f"it would take {steps} steps", steps)
    end = stepper.output_time(truth.end)
    if isinstance(stepper, FixedStep):
        end = two_product(stepper.h, float(steps))
    before = after = stepper.begin()
    try:
        while abs(after.time[0]) < abs(end[0]):
            if after.steps >= step_limit:
                return Attempt(StressOutcome.STEP_LIMIT, steps=after.steps)
            before, after = after, stepper.block(after)
        state = stepper.states_at(before, [end])[0]
        if (form := getattr(stepper, "form", None)) is not None:
            state = form.axis_states(state)
    except IntegrationFailed as failure:
        return Attempt(StressOutcome.STALLED, str(failure))
    result = Attempt(steps=steps or after.steps)
    return _arrived(result, case, Plan(method.formulation), truth.end, state)


def _called(case: Case, method: MethodSetting, truth: CaseReference, step_limit: int) -> Attempt:
    """Call one of scipy's solvers once, from any start: at a pole nothing warns its user either."""
    chosen = Plan(method.formulation)
    form, (parameters, start) = chosen.equations, binary_start(case.scene, chosen)
    problem = InitialValueProblem(method.name, form, parameters, tuple(start.state.tolist()))
    stepper = scipy_stepper(
        method.solver, problem, method.setting, step_limit, atol=method.atol, guarded=False
    )
    try:
        taken = stepper.solver(start.state, truth.end, step_limit)
    except Singular as failure:
        return Attempt(StressOutcome.SINGULAR, str(failure))
    except IntegrationFailed as failure:
        return Attempt(StressOutcome.STALLED, str(failure))
    result = Attempt(steps=taken.times.size - 1)
    if taken.times[-1] != truth.end:
        return replace(result, stopped=StressOutcome.STEP_LIMIT)
    if case.counted:
        signs = {name: np.sign(event_function(form, name, taken.states, parameters, taken.times)[0])
                 for name in WATCHED}  # fmt: skip
        counted = {name: int(np.sum(s[:-1] * s[1:] <= 0)) for name, s in signs.items()}
        result = replace(result, counted=counted)
    return _arrived(result, case, chosen, truth.end, taken.states[-1])


def _arrived(result: Attempt, case: Case, chosen: Plan, end: float, state: Array) -> Attempt:
    """Return a result with what the last state says."""
    form, (parameters, start) = chosen.equations, binary_start(case.scene, chosen)
    rows, times = np.array([start.state, state]), np.array([0.0, end])
    if not np.isfinite(rows).all():
        return result
    with np.errstate(all="ignore"):
        seen = sample(form, rows, parameters, times)
        energy = invariants(form, rows, parameters, times)["energy"]
    weight = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    off = abs(float(energy[1] - energy[0])) / max(abs(float(energy[0])), abs(weight))
    return _with_motion(replace(result, energy_error=off), seen)


def _with_motion(result: Attempt, seen: Any) -> Attempt:
    """Return a result with axis and angles, as they were seen at the end."""
    x, y, z = seen.axis[-1].tolist()
    phi, psi = float(seen.phi[-1]), float(seen.psi[-1])
    return replace(
        result,
        axis=None if math.isnan(x + y + z) else (x, y, z),
        theta=float(seen.theta[-1]),
        angles=(phi, psi) if math.isfinite(phi + psi) else (),
    )


# --- how a run is judged ---------------------------------------------------------------------


def judged(found: Attempt, truth: CaseReference, case: str, method: MethodSetting) -> Run:
    """Return what is said of a run; where its method is to follow φ and ψ, these are judged.

    Parameters
    ----------
    found : Attempt
    truth : CaseReference
    case : str
    method : MethodSetting
    """
    told = partial(
        Run,
        case=case,
        method=method.name,
        formulation=method.formulation,
        condition=min(truth.condition, 1e300),
        energy_error=found.energy_error,
        steps=found.steps,
        plan=found.plan,
    )
    if found.stopped:
        return told(outcome=found.stopped, note=found.said, named=True)
    off = [a - b for a, b in zip(found.angles, truth.angles, strict=False)]
    if method.name == ANGLES:
        truth, error = truth.of_angles(), max(map(abs, off), default=math.nan)
    elif found.axis is not None:
        error = math.dist(found.axis, truth.axis)
    else:
        error = math.nan if found.theta is None else abs(found.theta - truth.theta)
    if not math.isfinite(error):
        return told(outcome=StressOutcome.DIVERGED, note="the final state is not finite")
    lost = truth.digits_lost(error)
    outcome, why = _outcome(found, truth, error, lost)
    untold = truth.hopeless and not found.more_bits
    turns = [round(angle / math.tau) for angle in off]
    notes = [
        "undetermined: no digits are left" if untold else "",
        why,
        ", ".join(
            f"{angle} is off by {n:+d} turn{'s'[: abs(n) > 1]}"  # which the axis does not see
            for angle, n in zip("φψ", turns, strict=False)
            if n
        ),
        found.said,
    ]
    return told(
        outcome=outcome,
        error=error,
        digits_lost=lost,
        named=bool(found.said),
        untold=untold,
        turns=(turns[0], turns[1]) if turns else None,
        note="; ".join(filter(None, notes)),
    )


def _outcome(
    found: Attempt, truth: CaseReference, error: float, lost: float
) -> tuple[StressOutcome, str]:
    """Return the outcome of a run that says it has arrived, and what is wrong with it."""
    poor = lost > (1 - KEPT) * truth.digits
    if poor or error >= ASTRAY:
        off = found.energy_error
        said = "reports success" + ("" if off is None else f"; energy error {off:.0e}")
        return StressOutcome.DIVERGED if error >= ASTRAY else StressOutcome.INACCURATE, said
    if missed := missed_events(found.counted, truth.counts):
        return StressOutcome.MISSED_EVENTS, "" if "events: " in found.said else missed
    return StressOutcome.OK, ""


def missed_events(counted: Mapping[str, int], counts: Counts | None) -> str:
    """Say which events were counted otherwise than there are.

    Where a method knows no cusps, phidot may touch zero in each of them, in none, or only at the
    start, if that is one.

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
