"""Events of a run: turning points, reversals and cusps.

At a cusp phidot has a double root, where a root finder may report none, one or two zeros. A cusp is
therefore found at the turning point, a simple root of thetadot, by the size of phidot there: in
doubles compared with its rounding, in more digits with those that are wanted. Zeros of phidot
beside a cusp are no reversals and are dropped.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.errors import Impossible, Outcome
from heavytop.exact import Exact
from heavytop.exact.decimals import context
from heavytop.exact.pairs import EPSILON, Array
from heavytop.integration.engine import TimedStates
from heavytop.integration.outputs import Sample, form_values, newton_step
from heavytop.run.counts import KINDS_OF, TURNING, schedule
from heavytop.run.plan import exact_span
from heavytop.scene.scene import Scene
from heavytop.scene.scene_file import EVENTS

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

Places = NDArray[np.intp]

EVENT_FUNCTIONS = ("turning", "reversal")  # thetadot and phidot, but for a factor
EVENT_KINDS = (*TURNING, "reversal", "turning")
EVENT_COLUMNS = ("t", "theta", "phi", "phidot", "residual")
STORED = (*EVENT_COLUMNS, "t_low", "axis", "states")
FROM_STATES = ("theta", "phi", "phidot", "axis", "states")

BLUR = 1e-9  # of a step: how far from an exact start its own zero may be found
EDGE_LEVEL = 4.0  # ulp of the time, times the root of the number of turning points
SPARE_IN_TIME: Final = 20  # digits beyond the scene's, of times at which events are looked for


class EventZeros(NamedTuple):
    """Zeros of the event functions in a run: those of thetadot, then those of phidot.

    Attributes
    ----------
    place : ndarray of int, shape (k,)
        The index of each among the readings of the run.
    t, t_low : ndarray, shape (k,)
        Times [s], and their low words.
    level : ndarray, shape (k,)
        The size up to which phidot counts as zero there.
    residual, slope : ndarray, shape (k,)
        The event function there, and its time derivative.
    turning : ndarray of bool, shape (k,)
        Which are zeros of thetadot.
    """

    place: Places
    t: Array
    t_low: Array
    level: Array
    residual: Array
    slope: Array
    turning: NDArray[np.bool_]

    @classmethod
    def of(
        cls, run: Trajectory, event: str, at: Sample, place: Places, t_low: Array, level: Array
    ) -> EventZeros:
        """Return the zeros of an event function at some indices of the readings of a run."""
        t, states, form = at.t[place], at.states[place], run.orbit.integrator.formulation
        residual, slope = form_values(form, event, states, run.orbit.parameters, t)
        return cls(place, t, t_low, level, residual, slope, np.full(t.size, event == "turning"))

    @classmethod
    def join(cls, parts: Iterable[EventZeros]) -> EventZeros:
        """Return the parts one after the other."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))

    def where(self, index: Any) -> EventZeros:
        """Return those that an index, slice or mask selects."""
        return EventZeros(*[column[index] for column in self])


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Events:
    """Events in the order of the run.

    Attributes
    ----------
    kind : tuple of str, length k
        ``theta_min``, ``theta_max``, ``reversal`` or ``cusp``; `of` gives those of one kind.
    t : ndarray, shape (k,)
        Times [s].
    t_low : ndarray, shape (k,)
        Low words of the times [s].
    theta, phi, phidot : ndarray, shape (k,)
        Tilt, precession [rad] and precession rate [rad/s]; phi is nan where it is not followed.
        Where the exact motion passes through the vertical itself phi is that before or after the
        pass, π apart, and phidot is its limit.
    residual : ndarray, shape (k,)
        The event function at the state found: thetadot sin(theta) or thetadot at a turning
        point, phidot sin^2(theta) or phidot at a reversal, as the formulation has it [rad/s].
    axis : ndarray, shape (k, 3)
    states : ndarray, shape (k, n)
        Full states of the formulation.
    place : ndarray of int, shape (k,)
        The index of each among all times at which the run was recorded.
    asked : tuple of str
        The kinds of event the scene asked for.
    own : mapping from str to ndarray, or None
        The same columns in the numbers of a run that has more digits than doubles.
    """

    kind: tuple[str, ...]
    t: Array
    t_low: Array
    theta: Array
    phi: Array
    phidot: Array
    residual: Array
    axis: Array
    states: Array
    place: Places
    asked: tuple[str, ...]
    own: Mapping[str, Any] | None = None

    def __len__(self) -> int:
        return len(self.kind)

    def __repr__(self) -> str:
        counted = ", ".join(f"{self.count(event)} {event}" for event in self.asked)
        return f"<Events: {counted or 'none asked for'}>"

    def table(self, most: int | None = None) -> list[dict[str, Any]]:
        """Return the events, or the first of them, as rows with kind, t, theta, phi, ...

        Parameters
        ----------
        most : int, optional
            How many at most.
        """
        columns = {name: getattr(self, name)[:most].tolist() for name in EVENT_COLUMNS}
        rows = zip(self.kind[:most], *columns.values(), strict=True)
        return [dict(zip(("kind", *EVENT_COLUMNS), row, strict=True)) for row in rows]

    def of(self, kind: str) -> Events:
        """Return those of one kind; none where there are none, or it was not asked for.

        Parameters
        ----------
        kind : {"theta_min", "theta_max", "cusp", "reversal", "turning"}
            Which; ``turning`` are the first three.

        Raises
        ------
        Impossible
            Another name.

        Examples
        --------
        >>> import heavytop as ht
        >>> events = ht.propagate(ht.load_scene("sicm-kicked", ["span.periods=2"])).events
        >>> len(events.of("reversal")), events.of("theta_max").kind
        (4, ('theta_max', 'theta_max'))
        """
        if kind not in EVENT_KINDS:
            raise Impossible([("kind", f"one of {', '.join(EVENT_KINDS)}, not {kind!r}")])
        some = np.array([k in KINDS_OF.get(kind, (kind,)) for k in self.kind], dtype=bool)
        kept = {name: getattr(self, name)[some] for name in (*STORED, "place")}
        own = self.own and {name: column[some] for name, column in self.own.items()}
        return Events(tuple(compress(self.kind, some)), asked=self.asked, own=own, **kept)

    @property
    def is_turning(self) -> NDArray[np.bool_]:
        """Which are turning points, cusps included."""
        return np.array([k != "reversal" for k in self.kind], dtype=bool)

    def count(self, event: str) -> int | None:
        """Return how many ``turning``, ``reversal`` or ``cusp``; None where not asked for.

        Parameters
        ----------
        event : {"turning", "reversal", "cusp"}
            Which; a cusp is a turning point too.

        Raises
        ------
        Impossible
            Another name.
        """
        if event not in EVENTS:
            raise Impossible([("event", f"one of {', '.join(EVENTS)}, not {event!r}")])
        return sum(map(self.kind.count, KINDS_OF[event])) if event in self.asked else None


def events_of(trajectory: Trajectory) -> Events:
    """Return the events that the scene asks for; none of a trajectory that is still on its way."""
    scene, motion = trajectory.scene, trajectory.motion
    if not (scene.events and trajectory.with_events):
        states = trajectory.orbit.samples.states[:0].astype(np.float64)
        none = dict.fromkeys(STORED, np.empty(0)) | {"axis": np.empty((0, 3)), "states": states}
        return Events((), **none, place=np.empty(0, np.intp), asked=scene.events)
    at, zeros = (zeros_found if trajectory.in_doubles else zeros_expected)(trajectory)
    kind, chosen = _select(at.phidot, zeros, scene.events)
    names = FROM_STATES if trajectory.in_doubles else Sample.COLUMNS
    columns: dict[str, Any] = {name: getattr(at, name)[chosen.place] for name in names}
    columns |= {"t": chosen.t, "t_low": chosen.t_low, "residual": chosen.residual}
    for which, limit in rates_at_poles(motion).items():
        columns["phidot"] = np.where(kind == which, trajectory.nearest(limit), columns["phidot"])
    doubles, own = columns, None
    if not trajectory.in_doubles:
        own = columns
        with np.errstate(invalid="ignore"):  # nan
            doubles = {name: columns[name].astype(np.float64) for name in STORED}
            low = (columns["t"] - doubles["t"]).astype(np.float64)
        doubles["t"], doubles["t_low"] = _clip_times(doubles["t"], low, trajectory.orbit.end)
    return Events(tuple(kind.tolist()), **doubles, place=chosen.place, asked=scene.events, own=own)


def events_expected(trajectory: Trajectory) -> list[tuple[str, Any]]:
    """Return the exact kinds and times of events, rounded to numbers of the run."""
    scene, motion = trajectory.scene, trajectory.motion
    end = trajectory.orbit.end
    if trajectory.outcome is Outcome.FINISHED:
        # more digits than the times have tell whether an event is at the end
        end = exact_span(scene, motion, context(scene.digits + 2 * SPARE_IN_TIME))
    expected = schedule(motion, end, scene.events, scene.digits + SPARE_IN_TIME)
    return [(kind, trajectory.nearest(t)) for kind, t in expected]


def zeros_expected(trajectory: Trajectory) -> tuple[Sample, EventZeros]:
    """Return readings and zeros of a run that watched for none, by Newton's method.

    The closed form gives the kinds and the times from which Newton's method starts. Times and
    states of the zeros are those of the run: an event that it does not resolve is left out, and a
    cusp whose phidot is not zero to the digits wanted is an ordinary turning point.
    """
    run, integrator = trajectory, trajectory.orbit.integrator
    form, constants, number = integrator.formulation, run.orbit.parameters, integrator.engine.number
    small, zeros, cusps = number(10) ** -run.scene.digits, [], []
    expected = events_expected(run)
    for event in EVENT_FUNCTIONS:
        here = [(kind, t) for kind, t in expected if kind in KINDS_OF[event]]
        t = np.array([t for _, t in here], integrator.engine.nothing.dtype)
        found, resolved = newton_step(form, event, run.orbit.lookup(t), constants, small)
        zeros.append(found)
        cusps.append(np.array([kind == "cusp" for kind, _ in here], dtype=bool)[resolved])
    at, is_cusp = run.read(TimedStates.join(zeros)), np.concatenate(cusps)
    momentum = abs(form_values(form, "spin", at.states, constants, at.t)[0])
    level = np.where(is_cusp, 2 * small * momentum / abs(np.sin(at.theta)), number("nan"))
    places = np.split(np.arange(at.t.size), [cusps[0].size])
    return at, EventZeros.join(
        EventZeros.of(run, event, at, place, 0 * at.t[place], level[place])
        for event, place in zip(EVENT_FUNCTIONS, places, strict=True)
    )


def rates_at_poles(motion: Motion) -> dict[str, Exact]:
    """The limits of φ̇ where the axis passes exactly through the vertical [rad/s].

    In passing φ jumps by π; φ̇ = (p_φ − p_ψ u)/(A (1 − u²)) tends to p_ψ/2A at the top, where
    p_φ = p_ψ, and to −p_ψ/2A at the bottom. A run, which is off by its rounding, passes beside the
    pole with any rate. Keys are the kinds of turning point, ``theta_min`` or ``theta_max``.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("through-bottom")
    >>> limits = rates_at_poles(Motion(scene.top, scene.start))
    >>> [(kind, round(float(rate), 6)) for kind, rate in limits.items()]
    [('theta_max', -4.02439)]
    """
    passed = {"theta_min": not motion.from_top, "theta_max": not motion.from_bottom}
    if not (motion.nutates and any(passed.values())):
        return {}
    limit = motion.top.C * motion.start.omega3 / (2 * motion.top.A)
    limits = {"theta_min": limit, "theta_max": -limit}
    return {kind: limits[kind] for kind, passes in passed.items() if passes}


def zeros_found(trajectory: Trajectory) -> tuple[Sample, EventZeros]:
    """Return the readings of a run in doubles, and the zeros that its integrator found.

    A start that is an event comes first. `level` is the rounding of phidot = (a - b u)/sin^2, whose
    terms cancel at a cusp; it grows as the root of the steps. Where it is not small against b, near
    a pole, it decides nothing and is nan.
    """
    orbit, scene, at = trajectory.orbit, trajectory.scene, trajectory.readings
    form, constants, start = orbit.integrator.formulation, orbit.parameters, slice(1)
    b = abs(float(form_values(form, "spin", at.states[start], constants, at.t[start])[0][0]))
    step, end = abs(orbit.end) / max(orbit.steps, 1), orbit.samples.t.size + orbit.between.t.size
    hits = dict(zip(trajectory.plan.watched, orbit.hits, strict=True))
    zeros = []
    for event in EVENT_FUNCTIONS:
        hit = hits.get(event, orbit.samples.where(slice(0)))
        begins = int(event in hits and _starts_at_event(scene, event))
        place = np.concatenate((np.arange(begins), np.arange(end, end := end + hit.t.size)))
        with np.errstate(divide="ignore", invalid="ignore"):
            noise = abs(at.phidot[place]) + 2 * b / abs(np.sin(at.theta[place]))
        noise *= EPSILON
        level = np.where(noise < 1e-6 * b, np.sqrt(1.0 + orbit.steps) * noise, np.nan)
        t_low = np.concatenate((np.zeros(begins), hit.t_low))
        found = EventZeros.of(trajectory, event, at, place, t_low, level)
        zeros.append(_zeros_in_span(found, begins, orbit.end, step))
    return at, EventZeros.join(zeros)


def _starts_at_event(scene: Scene, event: str) -> bool:
    """Tell whether the start is exactly an event: rounded, it is not quite a zero."""
    start = scene.start
    if event == "reversal":
        return start.phidot.sign() == 0
    return start.thetadot.sign() == 0 or float(start.theta) == 0.0 or start.theta.sign() == 0


def _zeros_in_span(zeros: EventZeros, begins: int, end: float, step: float) -> EventZeros:
    """Return the zeros of a run from 0 to `end` [s], both included.

    A zero that only rounding, of the time or of the event function, puts behind the end is at the
    end. Where the start is an event (the first zero, `begins` = 1) the integrator may have found it
    again beside the start; that one is left out. `step` is the mean step, a measure of how fast
    things happen [s].
    """
    forward = 1.0 if end >= 0 else -1.0
    margin = EDGE_LEVEL * EPSILON * abs(end) * np.sqrt(zeros.t.size - begins + 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        margin = margin + np.fmin(abs(zeros.level / zeros.slope), BLUR * step)
    kept = zeros.where(forward * zeros.t <= abs(end) + margin)
    t, t_low = _clip_times(kept.t, kept.t_low, end)
    kept = kept._replace(t=t, t_low=t_low)
    if not begins:
        return kept
    residual, slope = float(kept.residual[0]), float(kept.slope[0])
    distinct = np.abs(t) > 16 * (abs(residual / slope) if slope else 0.0) + BLUR * step
    distinct[0] = True
    return kept.where(distinct)


def _clip_times(t: Array, t_low: Array, end: float) -> tuple[Array, Array]:
    """Return times and low words; of a time behind the end the excess goes into the low word."""
    behind = np.abs(t) > abs(end)
    return np.where(behind, end, t), np.where(behind, (t - end) + t_low, t_low)


def _select(
    phidot: Array, zeros: EventZeros, asked: Sequence[str]
) -> tuple[NDArray[Any], EventZeros]:
    """Return kinds and zeros of the events that are asked for, in the order of the run.

    `phidot` is given at all readings. A motion with cusps has no reversals: a zero of phidot whose
    nearest turning point is a cusp is part of that (`shadow`).
    """
    turning, t = zeros.turning, np.abs(zeros.t)
    cusp = turning & (abs(phidot[zeros.place]) <= zeros.level)
    turned = t[turning]
    nearest = np.searchsorted((turned[1:] + turned[:-1]) / 2, t)
    shadow = np.append(cusp[turning], False)[nearest]
    kinds = np.where(turning, np.where(zeros.slope > 0, "theta_min", "theta_max"), "reversal")
    kinds[cusp] = "cusp"
    wanted = np.where(turning, "turning" in asked, ~shadow & ("reversal" in asked))
    wanted |= cusp & ("cusp" in asked)
    order = np.flatnonzero(wanted)
    order = order[np.argsort(t[order], kind="stable")]
    return kinds[order], zeros.where(order)
