"""Certificates: proved bounds of the error of a run in doubles, over all of its times.

A certificate is a study: its tasks are parts of the run, each of some blocks of steps, which are
integrated again and must lead to the same bits as before.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict
from fractions import Fraction
from functools import lru_cache
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from heavytop.certificate.balls import UNIT, TooCoarse
from heavytop.certificate.bounds import bound
from heavytop.certificate.events import Proof, held
from heavytop.certificate.flow import Flow
from heavytop.certificate.run import BinaryRun, binary_run
from heavytop.certificate.steps import LEAD
from heavytop.doctor import versions
from heavytop.errors import ForeignFile, NotCertified, Outcome, WrongType
from heavytop.integration.blocks import Checkpoint
from heavytop.integration.outputs import sample
from heavytop.results.certificate import QUANTITIES, Certificate
from heavytop.run.estimates import MOST_DIGITS
from heavytop.run.events import KINDS_OF
from heavytop.run.planning import plan
from heavytop.run.propagation import binary_start, propagate
from heavytop.run.trajectory import Trajectory
from heavytop.scene.arguments import heard, whole
from heavytop.scene.quantities import ANGLES as ANGLE_NAMES
from heavytop.scene.scene import Scene
from heavytop.studies.study import Chunk, Journal, Parameters, Progress, open_journal, run

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.certificate.steps import Steps

KIND: Final = "certificate"
PARTS: Final = 64  # of a run: what may be done at the same time
BLOCKS: Final = 16  # done at a time: each of them would be stored
LONG: Final = 4_000_000  # steps, of which a few more take little time
FORMS: Final = ("axis", "attitude", "cubic")
SMALLEST: Final = 1e-6  # rad: a nutation that a run in doubles can have events of
TURN: Final = 0.95  # of the time in which Sturm's theorem lets an argument turn
ASTRAY: Final = 0.03  # rad: by less than half of what `TURN` leaves of a quarter turn
# Beside half a unit in the last place: an argument, or a sum of two, added to whole turns; and what
# those of the rounded start are off the angles that the run begins with.
REST: Final = {"axis": 9 * UNIT, "attitude": 20 * UNIT, "cubic": 0.0}


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
        A run in doubles, in the axis, the attitude or the cubic form; a scene is run first. Where
        its span takes more than doubles for its digits it is run in doubles, projected.
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
        Bounds of axis, theta, phi and psi, and what is proved of the events.

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
    heard("progress", progress)
    jobs = whole("jobs", jobs, 1, 1024)
    if isinstance(run, Scene):
        run = run_in_doubles(run)
    parameters = certificate_parameters(run)
    with open_journal(folder, parameters) as journal:
        return complete(journal, jobs=jobs, executor=executor, on_progress=progress)


def run_in_doubles(scene: Scene) -> Trajectory:
    """Run a scene as auto does, but in doubles where that takes more bits for a long span.

    However long the steps take, they are taken.
    """
    chosen = plan(scene)
    if chosen.formulation == "none":
        return propagate(scene, projected=True)
    if chosen.precision == "double" or scene.digits > MOST_DIGITS:
        return propagate(scene)
    return propagate(scene, formulation=chosen.formulation, projected=True)


def certificate_parameters(trajectory: Trajectory) -> Parameters:
    """Return what is asked of a certificate, as JSON.

    Raises
    ------
    WrongType, NotCertified, ForeignFile
        As of `certify`.
    """
    if not isinstance(trajectory, Trajectory):
        raise WrongType("run: a Trajectory or a Scene; heavytop.propagate gives one")
    if reason := why_not(trajectory):
        raise NotCertified(reason)
    own, orbit = binary_run(trajectory), trajectory.orbit
    numbers, begun = binary_start(trajectory.scene, trajectory.plan)
    first = orbit.checkpoints[0]
    same = numbers == orbit.parameters and np.array_equal(begun.state, first.state)
    if not (same and (first.time, first.steps) == ((0.0, 0.0), 0)):
        raise ForeignFile(f"{trajectory.scene.name}: its numbers are not those of its scene")
    last = orbit.checkpoints[-1]
    rests = orbit.steps == last.steps == 0
    if not (rests or 0 < orbit.steps - last.steps <= last.block_steps):
        raise ForeignFile(
            f"{trajectory.scene.name}: its steps do not lead from its last checkpoint"
        )
    seen = orbit.at(orbit.samples.t).states
    if not np.array_equal(seen, orbit.samples.states, equal_nan=True):
        raise ForeignFile(f"{trajectory.scene.name}: integrated again, its samples are others")
    points, width = orbit.checkpoints, len(own.integrator.formulation.states)
    every = math.ceil(len(points) / PARTS)
    legs = [
        _place(points[i])
        | {
            "print": _print("", points[i + 1 : i + every + 1], slice(width)),
            "angles": _print("", points[i + 1 : i + every + 1], slice(width, None)),
        }
        for i in range(0, len(points), every)
    ]
    events = trajectory.events
    parameters = {
        "kind": KIND,
        "scene": trajectory.scene.problem(),
        "run": asdict(own),
        "legs": legs,
        "last": _place(points[-1]),
        "steps": orbit.steps,
        "states": width,
        "final": orbit.samples.states[-1, :width].tolist(),
        "sizes": _sizes(trajectory),
        "told": _told(trajectory),
        "counts": {event: events.count(event) for event in KINDS_OF if event in events.asked},
        "versions": versions(),
    }
    return parameters | {"events": _held(trajectory, _key(parameters))}


def _held(trajectory: Trajectory, key: str) -> dict[str, Any]:
    """Hold turning points and reversals of a run against those of the exact motion."""
    own, flow = _prepared(key)
    pace, events, motion = own.integrator.pace, trajectory.events, trajectory.motion
    found: dict[str, Any] = {}
    for event in ("turning", "reversal"):
        if event in events.asked:
            here = events.of(event)
            proof = Proof(None, 0.0, f"{event}: the nutation is below what doubles can tell")
            if _nutates(motion):
                proof = held(flow, event, (here.t * pace, here.t_low * pace), own.end * pace)
            found[event] = {"proved": proof.proved, "off": proof.off / pace, "why": proof.why}
    return found


def _nutates(motion: Motion) -> bool:
    """Tell whether the tilt changes by more than rounding: else events are those of the scene."""
    return motion.nutates and float(motion.theta_max) - float(motion.theta_min) > SMALLEST


def why_not(trajectory: Trajectory) -> str:
    """Return why there is no certificate of a trajectory, or nothing."""
    chosen = trajectory.plan
    if trajectory.outcome is not Outcome.FINISHED:
        return f"the run ended early ({trajectory.outcome}): only a whole one is certified"
    if not trajectory.in_doubles:
        return "the run has more digits than doubles: its digits are held to the closed form"
    if chosen.formulation not in FORMS:
        return f"the {chosen.formulation} form is not quadratic: one of {', '.join(FORMS)}"
    if (order := trajectory.orbit.integrator.engine.order) < LEAD:
        return f"its Taylor polynomials have order {order}: {LEAD} is the least"
    return ""


def _sizes(trajectory: Trajectory) -> dict[str, float]:
    """Return what bounds the rounding of phi and psi: how large they are, and how often known."""
    orbit, known = trajectory.orbit, trajectory.orbit.parameters
    points, seen = orbit.checkpoints, orbit.samples
    times = np.abs(np.append([point.time[0] for point in points], seen.t))
    states = np.concatenate(([point.state for point in points], seen.states))
    own = len(orbit.integrator.formulation.states)
    side = -1 if trajectory.plan.variant == "delta" else 1
    uniform = abs(known.get("kappa", 0.0) + side * known.get("frame_rate", 0.0))
    beside = 0.0  # what psi of the axis form is added up from: its start, and its quadrature
    if trajectory.plan.variant in ("sigma", "delta"):
        begun = abs(known["psi_0"]) + abs(known["phi_0"])
        beside = begun + float(np.max(np.abs(states[:, own - 1])))
    return {
        "angle": float(np.max(np.abs(states[:, own:]), initial=0.0)),
        "aside": _aside(trajectory) * abs(orbit.end),
        "beside": beside,
        "gap": float(np.max(np.diff(np.sort(times)))),
        "uniform": uniform * abs(orbit.end),
    }


def _aside(trajectory: Trajectory) -> float:
    """Return how far P may be from that of the start, in P/(1 + side e_z), the rate of psi.

    In the run it is a rounded constant; of the start it is l_z + side l e/|e|, and e_z is e_z/|e|.
    """
    known, variant = trajectory.orbit.parameters, trajectory.plan.variant
    if variant not in ("sigma", "delta"):
        return 0.0
    side, name = (1, "P_plus") if variant == "sigma" else (-1, "P_minus")
    start = trajectory.orbit.checkpoints[0].state
    e, l_z = [Fraction(x) for x in start[:3].tolist()], Fraction(known["l_z"])
    l = [Fraction(x) for x in start[3:5].tolist()] + [l_z]  # noqa: E741
    along = sum((x * y for x, y in zip(e, l, strict=True)), Fraction(0))
    off = abs(float(Fraction(known[name]) - l_z - side * along))
    return off + _length("axis", start) * (abs(float(along)) + abs(known[name]))


def _length(formulation: str, state: Any) -> float:
    """Return by how much the axis of a start is longer or shorter than one."""
    kept = {"axis": 3, "attitude": 4}.get(formulation)
    if kept is None:
        return 0.0
    square = sum((Fraction(float(x)) ** 2 for x in state[:kept]), Fraction(-1))
    return abs(float(square)) * (1 + 2 * UNIT)  # of q the square is the length


def _told(trajectory: Trajectory) -> dict[str, float]:
    """Return by how much angles at the start are those of the scene, and not of the state.

    Beside them stands what the length of the axis is off: the exact motion has one of length one.
    """
    orbit = trajectory.orbit
    seen = trajectory(0.0)
    form = orbit.integrator.formulation
    state = orbit.checkpoints[0].state[None]
    own = sample(form, state, orbit.parameters, np.zeros(1)).at(0)
    off = {
        name: abs(float(getattr(seen, name)) - float(getattr(own, name))) for name in ANGLE_NAMES
    }
    off["axis"] = _length(trajectory.plan.formulation, state[0])
    return {name: x for name, x in off.items() if x == x}


# --- the study -------------------------------------------------------------------------------


def tasks(parameters: Parameters) -> list[str]:
    """Return the names of the parts of the run; the last one, with the largest errors, first."""
    return [f"part/{i:04d}" for i in reversed(range(len(parameters["legs"])))]


def advance(parameters: Parameters, task: str, checkpoint: Any) -> Iterator[Chunk]:
    """Yield some blocks of a part of the run at a time; the last chunk has what was found."""
    place = int(task.rpartition("/")[2])
    legs, own_states = parameters["legs"], slice(parameters["states"])
    angles = slice(parameters["states"], None)
    own, flow = _prepared(_key(parameters))
    rounding = _rounding(parameters["sizes"], flow, own)
    first, whole = legs[place], place + 1 == len(legs)
    last = parameters["steps"] if whole else legs[place + 1]["steps"]
    floor = {} if len(legs) == 1 else _floor(_key(parameters))
    begun = {"found": {}, "proved": {}, "print": "", "angles": ""}
    left = checkpoint or _place(_point(first)) | begun
    point, done = _point(left), False
    while not done:
        clock = time.perf_counter()
        for _ in range(BLOCKS):
            count, before = min(point.block_steps, last - point.steps), point.steps
            if count > 0:
                steps, point = own.steps(point, count)
                try:
                    here = bound(flow, steps, floor, rounding)
                except ArithmeticError as error:
                    raise _unknown(error) from None
                for name, values in (("found", here.found), ("proved", here.proved)):
                    left[name] = _larger(left[name], values)
            done, same = point.steps >= last, True
            if not (done and whole):  # where a run ends is no checkpoint
                left["print"] = _print(left["print"], [point], own_states)
                left["angles"] = _print(left["angles"], [point], angles)
            elif count > 0:
                same = not own.ends_elsewhere(steps, np.array(parameters["final"]))
            else:
                same = parameters["steps"] == 0
            same &= left["print"] == first["print"] if done else point.steps > before
            if not same:
                name = parameters["scene"]["name"]
                raise ForeignFile(f"{name}: integrated again, its bits are others")
            if done:
                break
        left |= _place(point)
        gone = (point.steps - first["steps"]) / max(last - first["steps"], 1)
        rows = []
        if done:
            counted = left["angles"] == first["angles"]
            rows = [{"found": left["found"], "proved": left["proved"], "counted": counted}]
        yield Chunk({**left}, rows, done, gone, time.perf_counter() - clock)


def complete(journal: Journal, **how: Any) -> Certificate:
    """Do what is left, and return the certificate."""
    run(journal, **how)
    return collect(journal)


def _place(point: Checkpoint) -> dict[str, Any]:
    return {"time": list(point.time), "state": point.state.tolist(), "steps": point.steps}


def _point(known: Mapping[str, Any]) -> Checkpoint:
    return Checkpoint(tuple(known["time"]), np.array(known["state"]), known["steps"])


def _print(before: str, points: Sequence[Checkpoint], part: slice) -> str:
    """Return the fingerprint of states and times that follow others, whose fingerprint is known."""
    for point in points:
        numbers = ",".join(x.hex() for x in (*point.time, *point.state[part].tolist()))
        before = sha256(f"{before},{point.steps},{numbers}".encode()).hexdigest()[:32]
    return before


def _larger(a: Mapping[str, float | None], b: Mapping[str, float]) -> dict[str, float | None]:
    """The larger of two bounds of each: none, where one of them is none or infinite."""
    return {n: _most([x if math.isfinite(x) else None, a.get(n, 0.0)]) for n, x in b.items()}


def _key(parameters: Parameters) -> str:
    kept = {name: parameters[name] for name in ("run", "steps", "last")}
    legs = [{name: leg[name] for name in ("time", "state", "steps")} for leg in parameters["legs"]]
    return json.dumps(kept | {"legs": legs}, sort_keys=True)


@lru_cache(maxsize=2)
def _prepared(key: str) -> tuple[BinaryRun, Flow]:
    """Return a run, and the exact motion of its numbers."""
    own = BinaryRun(**json.loads(key)["run"])
    steps = _last_steps(key, own)
    try:
        return own, own.flow(steps)
    except (TooCoarse, ValueError) as error:
        raise _unknown(error) from None


def _unknown(error: Exception) -> NotCertified:
    return NotCertified(f"the exact motion is not known well enough: {error}")


def _last_steps(key: str, own: BinaryRun) -> Steps:
    """Return the last block of steps of a run."""
    known = json.loads(key)
    last = _point(known["last"])
    return own.steps(last, known["steps"] - last.steps)[0]


@lru_cache(maxsize=2)
def _floor(key: str) -> dict[str, float]:
    """Return errors that are found near the end: no smaller bound is of use anywhere.

    In long runs they are looked for where each part begins, too.
    """
    (own, flow), known = _prepared(key), json.loads(key)
    legs = known["legs"] if known["steps"] > LONG else []
    points = [_point(leg) for leg in legs[:-1]]
    blocks = (own.steps(point, point.block_steps)[0] for point in points)
    found: dict[str, float] = {}
    try:
        for steps in (_last_steps(key, own), *blocks):
            here = bound(flow, steps, {}, dict.fromkeys(QUANTITIES, 0.0), deepest=0).found
            found |= {name: max(x, found.get(name, 0.0)) for name, x in here.items()}
    except ArithmeticError as error:
        raise _unknown(error) from None
    return found


# --- the result ------------------------------------------------------------------------------


def collect(journal: Journal) -> Certificate:
    """Return the certificate that all parts of a run add up to."""
    asked = journal.parameters
    records = [journal.load(task) for task in tasks(asked)]
    for record in records:
        if record.failed:
            raise ForeignFile(record.failed)
    own, flow = _prepared(_key(asked))
    names = _names(own)
    rows = [row for record in records for row in record.rows]
    observed = {n: _most([row["found"].get(n, 0.0) for row in rows]) for n in names}
    bounds = {n: _most([row["proved"].get(n, 0.0) for row in rows]) for n in names}
    rounding = _rounding(asked["sizes"], flow, own)
    for name, known in bounds.items():
        if known is not None:
            total = known + rounding[name] + asked["told"].get(name, 0.0)
            bounds[name] = total if math.isfinite(total) else None

    why = [
        f"{n} is not bounded: the axis comes too near to a pole" for n in names if bounds[n] is None
    ]
    turns, events_held = _turns(own, flow, bounds, why), asked["events"]
    if turns and not all(row["counted"] for row in rows):
        turns = False
        why.append("whole turns are not proved: counted from step to step they are others")
    why += [proof["why"] for proof in events_held.values() if proof["why"]]
    events: dict[str, Any] = {
        event: {"count": count, "proved": events_held.get(event, {}).get("proved")}
        for event, count in asked["counts"].items()
    }
    if "cusp" in events and "turning" in events:  # each is a turning point
        events["cusp"]["proved"] = events["turning"]["proved"]
    verdicts = [each["proved"] for each in events.values()]
    late = max((proof["off"] for proof in events_held.values()), default=None)
    if asked["steps"] == 0 and not flow.rests:
        raise NotCertified("the run took no step, though the axis moves")
    least = [n for n in ("axis", "theta") if n in names]
    return Certificate(
        scene=asked["scene"],
        formulation=own.formulation,
        projected=own.projected,
        tolerance=own.tolerance,
        steps=asked["steps"],
        t=own.end,
        bound={n: bounds.get(n) for n in QUANTITIES},
        rounding={n: None if bounds.get(n) is None else rounding[n] for n in QUANTITIES},
        observed={n: observed.get(n) for n in QUANTITIES},
        turns=turns if own.quadrature or own.formulation != "cubic" else None,
        events=dict.fromkeys(KINDS_OF) | events | {"time_bound_s": late},
        proved=all(bounds[n] is not None for n in least) and False not in verdicts,
        why=tuple(why),
        versions=asked["versions"],
    )


def _rounding(sizes: Mapping[str, float], flow: Flow, own: BinaryRun) -> dict[str, float]:
    """Return how far theta, phi and psi are off by being put together of turns and a rest."""
    gap = own.integrator.pace * sizes["gap"]
    # of the two arguments that phi and psi are made of, each turns by pi in pi/sqrt(K) at least
    turned = 2 * (math.sqrt(max(flow.bounds.stiffness, 0.0)) * gap + math.pi)
    size = sizes["angle"] + min(turned, flow.bounds.turning * gap) + 2 * math.pi
    phi = UNIT * size + REST[own.formulation]
    psi = 2 * phi + 4 * UNIT * sizes["uniform"]
    if own.quadrature:  # a sum of five from left to right, phi the last, and before it a product
        beside = sizes["beside"] + flow.beside_rate * gap
        psi = 4 * UNIT * (beside + sizes["uniform"]) + phi + UNIT * size
        factor = flow.beside_factor
        psi += 1.01 * sizes["aside"] * factor * max(1.0, factor) if sizes["aside"] else 0.0
    return {"axis": 0.0, "theta": 0.0, "phi": phi, "psi": psi}


def _names(own: BinaryRun) -> Sequence[str]:
    """Return the quantities that a run has."""
    if own.formulation == "cubic":
        return ("theta",)
    if own.formulation == "attitude" or own.quadrature:
        return QUANTITIES if own.form.phi_wraps else QUANTITIES[:2]
    return QUANTITIES[:3] if own.variant else QUANTITIES[:2]


def _most(values: Sequence[float | None]) -> float | None:
    """Return the largest of some bounds: none, if there is one that is none."""
    return None if None in values else max((x for x in values if x is not None), default=0.0)


def _turns(own: BinaryRun, flow: Flow, bounds: Mapping[str, float | None], why: list[str]) -> bool:
    """Tell whether whole turns are counted rightly.

    They are if the states are read often enough for Sturm's theorem, as `integration.turns` has it,
    and if the angles read off them are off by less than what is left of half a turn.
    """
    counted = own.integrator.turns
    if counted is None:
        return False
    half = 1 if own.formulation == "attitude" else 2
    turned = math.sqrt(max(flow.bounds.stiffness, 0.0)) * counted.apart * own.integrator.pace * half
    off = [bounds.get(name) for name in ("axis", "phi", "psi") if name in _names(own)]
    if any(x is None for x in off) or not turned < TURN * math.pi:
        why.append("whole turns are not proved: the axis comes near to a pole")
        return False
    axis, *angles = (x for x in off if x is not None)
    if axis * flow.bounds.inverse < ASTRAY and max(angles, default=0.0) < ASTRAY:
        return True
    why.append("whole turns are not proved: the errors are too large for the distance to a pole")
    return False
