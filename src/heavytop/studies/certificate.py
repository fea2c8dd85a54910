"""Certificates: proved bounds of the error of a run in doubles, at all times.

A certificate is a study. Its tasks are parts of the run, each of some blocks of steps, which are
integrated again and must give the same bits as before.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from dataclasses import asdict
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final

import numpy as np

from heavytop.certificate.bounds import bound
from heavytop.certificate.events import Proof, match_events
from heavytop.certificate.flow import Flow
from heavytop.certificate.run import BinaryRun, binary_run
from heavytop.certificate.steps import LEADING_TERMS
from heavytop.certificate.system import CERTIFIED, TooCoarse
from heavytop.doctor import versions
from heavytop.errors import ForeignFile, NotCertified, Outcome, WrongType
from heavytop.exact.pairs import UNIT
from heavytop.integration.orbit import Checkpoint
from heavytop.integration.outputs import sample
from heavytop.results.certificate import CERTIFIED_QUANTITIES, Certificate
from heavytop.run.counts import KINDS_OF
from heavytop.run.estimates import DOUBLE_DIGITS
from heavytop.run.planning import plan
from heavytop.run.propagation import propagate
from heavytop.run.trajectory import Trajectory
from heavytop.scene.arguments import JOBS, read_argument
from heavytop.scene.quantities import Need, need_of
from heavytop.scene.scene import Scene
from heavytop.studies.journal import Chunk, Journal, Parameters
from heavytop.studies.study import Progress, run
from heavytop.studies.workers import check_how

KIND: Final = "certificate"
RUN_PARTS: Final = 64  # of a run, at most: tasks that may be done at the same time
BLOCKS_A_CHUNK: Final = 16  # between two checkpoints
LONG: Final = 4_000_000  # steps of a run in which errors are looked for in every part
SMALLEST: Final = 1e-6  # rad: the least nutation of which doubles resolve the events
TURNS_LOST: Final = 1.0  # rad: with a larger bound whole turns are not proved


def certify(
    run: Trajectory | Scene,
    *,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Certificate:
    """Prove how far a run is from the exact motion, over all times and not only at samples.

    The exact motion is that of the run's own binary numbers. The steps are taken again; a
    stored run whose bits differ is refused.

    Parameters
    ----------
    run : Trajectory or Scene
        A run in doubles, in the axis or the attitude form; a scene is run first: in the attitude
        form, if it wants psi. Where its span takes more than doubles for its digits it is run in
        doubles, projected.
    jobs : int
        Processes; results do not depend on it.
    folder : path, optional
        Where everything is stored, so that what was killed goes on from there. It is new, or
        empty, or holds this certificate.
    executor : concurrent.futures.Executor, optional
        Its workers do the work, wherever they are, and `jobs` means nothing.
    progress : callable, optional
        It is given a `heavytop.studies.study.Progress` again and again.

    Returns
    -------
    Certificate
        Bounds of axis, theta and phi, of psi in the attitude form, and what is proved of the
        events.

    Raises
    ------
    WrongType
        It is neither a Trajectory nor a Scene.
    NotCertified
        It is no whole run in doubles in one of these forms; the motion is so near a separatrix
        that 1024 bits do not tell its period.
    ForeignFile
        Integrated again, the run has other bits; the folder holds something else.
    InUse, StoppedEarly
        As for `heavytop.drift`.

    Examples
    --------
    >>> import heavytop as ht
    >>> found = certify(ht.propagate(ht.load_scene("sicm-kicked")))
    >>> found.proved, found.bound["axis"] < 3e-15, found.events.turning.count
    (True, True, 8)

    Notes
    -----
    Accuracy: ``tests/studies/test_certificate.py`` holds the bounds to errors found at random
    times to 30 digits, which never exceed them.

    References
    ----------
    Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, I.10: logarithmic norms
    and defects.
    """
    check_how(progress, executor)
    jobs = read_argument("jobs", jobs, JOBS)
    parameters = certificate_parameters(run_in_doubles(run) if isinstance(run, Scene) else run)
    with Journal.open(folder, parameters) as journal:
        return complete(journal, jobs=jobs, executor=executor, on_progress=progress)


def run_in_doubles(scene: Scene) -> Trajectory:
    """Run a scene as auto does, but in doubles and in a form that can be certified.

    It is run however long the steps take.
    """
    chosen = plan(scene)
    if chosen.precision != "double" and scene.digits > DOUBLE_DIGITS:
        return propagate(scene)
    wanted = {"psi"} if need_of(scene.quantities) >= Need.PSI else set[str]()
    able = [name for name, each in CERTIFIED.items() if wanted <= {*each.angles}]
    form = chosen.formulation if chosen.formulation in able else able[0]
    short = chosen.formulation != "none" and chosen.precision == "double"
    return propagate(scene, formulation=form, projected=chosen.projected or not short)


def certificate_parameters(trajectory: Trajectory) -> Parameters:
    """Return the parameters of a certificate, for JSON.

    Raises
    ------
    WrongType, NotCertified, ForeignFile
        As of `certify`.
    """
    if not isinstance(trajectory, Trajectory):
        raise WrongType("run: a Trajectory or a Scene; heavytop.propagate gives one")
    if reason := why_not(trajectory):
        raise NotCertified(reason)
    orbit, exact = trajectory.orbit, trajectory.binary_motion.closed_form
    own = binary_run(trajectory, exact.period)
    width = len(own.start)
    again, stored = orbit.at(orbit.samples.t).states, orbit.samples.states
    if not np.array_equal(again[:, :width], stored[:, :width], equal_nan=True):
        raise ForeignFile(f"{trajectory.scene.name}: integrated again, its samples are others")
    run = asdict(own)
    own, flow = _prepare(json.dumps(run, sort_keys=True))
    if orbit.steps == 0 and not flow.rests:
        raise NotCertified("the run took no step, though the axis moves")
    legs = orbit.checkpoints[:: math.ceil(len(orbit.checkpoints) / RUN_PARTS)]
    rounding, events = _rounding(trajectory, own, flow), trajectory.events
    return {
        "kind": KIND,
        "scene": trajectory.scene.problem(),
        "run": run,
        "legs": [_as_json(point, width) for point in legs],
        "steps": orbit.steps,
        "final": orbit.samples.states[-1, : len(own.core.states)].tolist(),
        "rounding": rounding,
        "floor": _floor(trajectory, own, flow, rounding) if len(legs) > 1 else {},
        "start": _start_errors(trajectory, own),
        "turns": _turns(trajectory, own, flow),
        "spins": trajectory.psi is not None,
        "counts": {event: events.count(event) for event in KINDS_OF if event in events.asked},
        "events": _match_events(trajectory, own, flow),
        "versions": versions(),
    }


def why_not(trajectory: Trajectory) -> str:
    """Return why a trajectory cannot be certified; empty where it can."""
    chosen = trajectory.plan
    if trajectory.outcome is not Outcome.FINISHED:
        return f"the run ended early ({trajectory.outcome}): only a whole one is certified"
    if not trajectory.in_doubles:
        return "the run has more digits than doubles: its digits are held to the closed form"
    if chosen.formulation not in CERTIFIED:
        forms = " and ".join(CERTIFIED)
        return f"the {chosen.formulation} form is not certified; of all forms, {forms} are"
    if (order := trajectory.orbit.integrator.engine.order) < LEADING_TERMS:
        return f"its Taylor polynomials have order {order}: {LEADING_TERMS} is the least"
    return ""


def _rounding(trajectory: Trajectory, own: BinaryRun, flow: Flow) -> dict[str, float]:
    """Return the rounding of angles when whole turns and the uniform spin are added; 0 of others.

    Angles without a bound are left out.
    """
    rounding = dict.fromkeys(("axis", "theta"), 0.0)
    with suppress(TooCoarse):
        rest = CERTIFIED[own.formulation].rest
        phi = UNIT * flow.largest_angle + rest
        uniform = rest + 4 * UNIT * abs(own.constants["kappa"] * own.end)
        of_angles = {"phi": phi, "psi": phi + uniform}
        rounding |= {name: of_angles[name] for name in _followed_angles(trajectory)}
    return rounding


def _followed_angles(trajectory: Trajectory) -> list[str]:
    """Return those of phi and psi that a run follows and that can be bounded."""
    names = CERTIFIED[trajectory.plan.formulation].angles
    return [name for name in names if getattr(trajectory, name) is not None]


def _start_errors(trajectory: Trajectory, own: BinaryRun) -> dict[str, float]:
    """Return the errors of the start: of the tilt, and of the length of the axis, 1 if exact.

    The trajectory gives the scene's tilt at time 0, not that of the state.
    """
    start = np.array([own.start[: len(own.core.states)]])
    tilt = sample(own.core, start, trajectory.orbit.parameters, np.zeros(1)).theta[0]
    # the axis, or a quaternion, whose square is the length of the axis
    axis = own.start[: CERTIFIED[own.formulation].read]
    square = sum((Fraction(x) ** 2 for x in axis), Fraction(-1))
    off = abs(float(trajectory(0.0).theta - tilt))
    return {"theta": off, "axis": abs(float(square)) * (1 + 2 * UNIT)}


def _turns(trajectory: Trajectory, own: BinaryRun, flow: Flow) -> dict[str, bool]:
    """Return for each angle whether it has the turns of the exact motion at all samples."""
    samples, turns = trajectory.samples, dict.fromkeys(_followed_angles(trajectory), False)
    with suppress(TooCoarse):
        near = flow.angles_near(samples.t * own.integrator.pace)
        for name in turns:
            turns[name] = bool(np.all(np.abs(getattr(samples, name) - near[name]) < math.pi))
    return turns


def _match_events(trajectory: Trajectory, own: BinaryRun, flow: Flow) -> dict[str, Any]:
    """Compare turning points and reversals of a run with those of the exact motion."""
    pace, events, motion = own.integrator.pace, trajectory.events, trajectory.motion
    found: dict[str, Any] = {}
    for event in ("turning", "reversal"):
        if event in events.asked:
            here = events.of(event)
            proof = Proof(None, 0.0, f"{event}: the nutation is below what doubles can tell")
            if motion.nutates and float(motion.theta_max) - float(motion.theta_min) > SMALLEST:
                times = here.t * pace, here.t_low * pace
                proof = match_events(flow, event, times, own.end * pace)
            found[event] = {"proved": proof.proved, "off": proof.off / pace, "why": proof.why}
    return found


def _floor(
    trajectory: Trajectory, own: BinaryRun, flow: Flow, rounding: Mapping[str, float]
) -> dict[str, float]:
    """Return errors found near the end, below which bounds need not be refined anywhere.

    In long runs they are looked for at the beginning of each part, too.
    """
    orbit, exact = trajectory.orbit, dict.fromkeys(rounding, 0.0)
    points = orbit.checkpoints
    some = points[: -1 : math.ceil(len(points) / RUN_PARTS)] if orbit.steps > LONG else ()
    found: dict[str, float] = {}
    for point in (points[-1], *some):
        steps, _ = own.steps(point, min(point.block_steps, orbit.steps - point.steps))
        with _expect_accurate():
            here, _ = bound(flow, steps, {}, exact, deepest=0)
        found |= {name: max(x, found.get(name, 0.0)) for name, x in here.items()}
    return found


# --- the study -------------------------------------------------------------------------------


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the parts of the run; the last one, with the largest errors, first."""
    return [f"part/{i:04d}" for i in reversed(range(len(parameters["legs"])))]


def advance(parameters: Parameters, task: str, checkpoint: Any) -> Iterator[Chunk]:
    """Yield some blocks of a part of the run at a time; the last chunk has what was found."""
    place, legs = int(task.rpartition("/")[2]), parameters["legs"]
    own, flow = _prepare(json.dumps(parameters["run"], sort_keys=True))
    begun, after = legs[place]["steps"], legs[place + 1] if place + 1 < len(legs) else None
    last = after["steps"] if after else parameters["steps"]
    found = checkpoint or {"at": legs[place], "found": {}, "proved": {}}
    at, done = found["at"], False
    point = Checkpoint(tuple(at["time"]), np.array(at["state"]), at["steps"])
    while not done:
        clock, same = time.perf_counter(), True
        for _ in range(BLOCKS_A_CHUNK):
            if point.steps >= last:
                break
            before = point
            steps, point = own.steps(point, min(point.block_steps, last - point.steps))
            with _expect_accurate():
                here = bound(flow, steps, parameters["floor"], parameters["rounding"])
            for name, values in zip(("found", "proved"), here, strict=True):
                found[name] = {n: _largest([x, found[name].get(n, 0.0)]) for n, x in values.items()}
            same &= point.steps > before.steps
        done, found["at"] = point.steps >= last, _as_json(point, len(own.start))
        if done and after:
            same &= found["at"] == after
        elif done and last > 0:
            same &= not own.ends_elsewhere(steps, np.array(parameters["final"]))
        if not same:
            name = parameters["scene"]["name"]
            raise ForeignFile(f"{name}: integrated again, its bits are others")
        rows = [{name: found[name] for name in ("found", "proved")}] if done else []
        fraction = (point.steps - begun) / max(last - begun, 1)
        yield Chunk({**found}, rows, done, fraction, time.perf_counter() - clock)


def complete(journal: Journal, **how: Any) -> Certificate:
    """Run the tasks that are left, and return the certificate."""
    run(journal, **how)
    return collect(journal)


def _as_json(point: Checkpoint, width: int) -> dict[str, Any]:
    """Return a checkpoint for JSON, with the first `width` states."""
    return {"time": [*point.time], "state": point.state[:width].tolist(), "steps": point.steps}


def _largest(values: Sequence[float | None]) -> float | None:
    """Return the largest of some bounds; None where one of them is None or infinite."""
    numbers = [x for x in values if x is not None and math.isfinite(x)]
    return max(numbers, default=0.0) if len(numbers) == len(values) else None


@lru_cache(maxsize=2)
def _prepare(key: str) -> tuple[BinaryRun, Flow]:
    """Return the run of a JSON text, and the exact motion of its numbers."""
    own = BinaryRun(**json.loads(key))
    with _expect_accurate():
        return own, own.flow()


@contextmanager
def _expect_accurate() -> Iterator[None]:
    """A block in which failing arithmetic means that the exact motion is not known well enough."""
    try:
        yield
    except (ArithmeticError, ValueError) as error:
        raise NotCertified(f"the exact motion is not known well enough: {error}") from None


# --- the result ------------------------------------------------------------------------------


def collect(journal: Journal) -> Certificate:
    """Return the certificate of a run from all of its parts."""
    asked, rows = journal.parameters, list[dict[str, Any]]()
    for task in tasks(asked):
        if failed := journal.record(task).last.failed:
            raise ForeignFile(failed)
        rows += journal.rows(task)
    rounding, turns, proofs = asked["rounding"], asked["turns"], asked["events"]
    observed, proved = (
        {n: _largest([row[what].get(n, 0.0) for row in rows]) for n in rounding}
        for what in ("found", "proved")
    )
    bounds: dict[str, Any] = dict.fromkeys(CERTIFIED_QUANTITIES) | {
        n: x + rounding[n] + asked["start"].get(n, 0.0) for n, x in proved.items() if x is not None
    }
    unbounded = [n for n in ("axis", "theta", *turns) if bounds[n] is None]
    near = "the axis comes too near to a pole"
    cause = "the run is too far from the exact motion" if "axis" in unbounded else near
    why = [f"{n} is not bounded: {cause}" for n in unbounded]
    if asked["spins"] and "psi" not in turns:
        form = asked["run"]["formulation"]
        why.append(f"psi is not bounded in the {form} form, but in the attitude form")
    whole_turns = all(x and (bounds[n] or math.inf) < TURNS_LOST for n, x in turns.items())
    if not whole_turns:
        why.append("whole turns are not proved: angles are not near enough to the exact ones")
    why += [proof["why"] for proof in proofs.values() if proof["why"]]
    sure = {event: proofs.get(event, {}).get("proved") for event in asked["counts"]}
    events: Any = {each: {"count": n, "proved": sure[each]} for each, n in asked["counts"].items()}
    if "cusp" in events and sure.get("reversal") is not None:  # no two zeros of phidot are one
        events["cusp"]["proved"] = events["cusp"]["count"] == 0
    elif "cusp" in events:
        why.append("cusp: one is not told from loops or waves that are nearly cusps")
    missed = False in [each["proved"] for each in events.values()]
    late = max((proof["off"] for proof in proofs.values() if proof["proved"]), default=None)
    return Certificate(
        **{name: asked[name] for name in ("scene", "steps", "versions")},
        **{name: asked["run"][name] for name in ("formulation", "projected", "tolerance")},
        t=asked["run"]["end"],
        bound=bounds,
        rounding={n: None if bounds[n] is None else rounding[n] for n in CERTIFIED_QUANTITIES},
        observed={n: observed.get(n) for n in CERTIFIED_QUANTITIES},
        turns=whole_turns if turns else None,
        events=dict.fromkeys(KINDS_OF) | events | {"time_bound_s": late},
        proved=None not in (bounds["axis"], bounds["theta"]) and not missed,
        why=tuple(why),
    )
