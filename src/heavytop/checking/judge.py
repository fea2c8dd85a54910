"""The judge: how far a trajectory of somebody else is from the exact motion, and in what."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any, Final

import numpy as np

from heavytop.analytic.events import EVENTS
from heavytop.analytic.motion import Motion
from heavytop.analytic.record import Record
from heavytop.checking.data import ANGLES, Array, Data, read
from heavytop.checking.problem import Comparison, wrapped
from heavytop.checking.result import Check, Count, Phase, Size
from heavytop.checking.slips import find_slip
from heavytop.errors import BadScene, Fault, ForeignFile, HeavyTopError, Unseparated
from heavytop.scene.scene import Scene, load_scene, no_scene, read_scene
from heavytop.scene.state import State
from heavytop.scene.top import Top

ULP: Final = Fraction(1, 2**53)
LOOKS: Final = 8  # times at which the motion's own condition is looked at,
LOOK_DIGITS: Final = 40  # in so many digits
WINDOWS: Final = 100  # of time, at most, in each of which there is one phase
WINDOW_ROWS: Final = 5  # at least
ROUNDS: Final = 20
ROUNDED: Final = 1e-15  # an error of such size does not tell how it grows
LEAST_PHASE: Final = 1e-14  # of the time: what rounding leaves
CERTAIN: Final = 3.0  # standard errors from which on a phase is told from 0
FEWEST: Final = 5  # phases whose growth is fitted,
REACH: Final = 4.0  # over times that are in such a ratio,
SURE: Final = 0.2  # and whose exponent has at most this standard error
UPRIGHT: Final = 1e-6  # rad from the vertical, where phi and psi are not told apart
FAINT: Final = 1e-3  # of the whole swing: a turn that is smaller is noise
NOISE: Final = 1e-12  # rad, likewise
AT_REST: Final = 0.01  # of the greatest rate: the axis stands still at a cusp


def check(
    data: str | os.PathLike[str] | Mapping[str, Any],
    scene: Scene | Top | str | os.PathLike[str] | None = None,
    columns: Mapping[str, str] | None = None,
) -> Check:
    """Judge a trajectory of your own by the exact motion.

    Parameters
    ----------
    data : path or mapping from str to array_like
        A table with a header (CSV, TSV), ``.npz``, ``.mat``, netCDF or HDF5, or arrays by their
        names: ``t`` [s] and any of theta, phi, psi [rad]; axis; quaternion, scalar first, or
        matrix, from body to space; thetadot, phidot, psidot, omega or omega_body [rad/s]. Of the
        folder of a run it is ``trajectory.nc``.
    scene : Scene, Top, str or path, optional
        What the data are of. Of a top alone, or a scene file with a table ``[top]`` alone, the
        start is that of the first row, or fitted where the data have no rates. It may be left out
        for a trajectory that ``heavytop run`` wrote.
    columns : mapping from str to str, optional
        What columns are called that have no usual name: ``{"t": "Zeit", "axis_x": "a"}``.

    Returns
    -------
    Check

    Raises
    ------
    ForeignFile
        The data cannot be read, or are no trajectory; everything that is wrong is listed.
    BadScene
        The scene cannot be read, or there is none.
    Impossible
        No motion starts as the first row says, or none fits.
    NoClosedForm
        The data reach beyond 2⁶² periods.
    WrongType
        An argument is not what is taken.

    Examples
    --------
    >>> import numpy as np
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> t = np.linspace(0, 5, 501)
    >>> mine = Motion(scene.top, scene.start).at(1.0001 * t)
    >>> found = check({"t": t, "axis": mine.axis}, scene)
    >>> f"{found.digits:.1f} digits, {found.phase.last:.1e} s ahead at {found.phase.t:.1f} s"
    '2.6 digits, 4.7e-04 s ahead at 4.7 s'
    >>> degrees = {"t": t, "theta": np.degrees(mine.theta), "phi": np.degrees(mine.phi)}
    >>> check(degrees, scene).slip.sentence
    'the angles are in degrees'

    Notes
    -----
    Accuracy: ``tests/checking/test_judge.py`` holds planted errors of the axis, of the phase and of
    the energy to 2 %, and data of the closed form to 14 digits.
    """
    told = read(data, columns)
    problem = Comparison(told, *_motion_of(scene, told))
    slip = find_slip(problem)
    try:
        digits = problem.digits
    except HeavyTopError as impossible:
        if slip is None:
            raise
        raise ForeignFile(f"{told.name}: {impossible}; it would fit if {slip.sentence}") from None
    curves = _curves(problem)
    phase_t, shifts, phase, growth = _phase(problem, curves)
    powers = {name: _power(problem, curves.get(name)) for name in ("axis", "energy")}
    return Check(
        name=told.name,
        top=problem.top,
        start=problem.start,
        origin=problem.origin,
        errors={name: _size(told.t, curve) for name, curve in curves.items()},
        digits=digits,
        phase=phase,
        growth={"phase": growth, **powers},
        events=_events(problem),
        condition=_condition(problem),
        columns={name: told.used.get(name, "") for name in told.columns},
        slip=slip,
        curves={"t": told.t, **curves, "phase_t": phase_t, "phase": shifts},
    )


def subject(scene: str | os.PathLike[str], changes: Sequence[str] = ()) -> Scene | Top:
    """The scene of a name, changed; or its top, where a file has nothing but a table [top]."""
    try:
        return load_scene(scene, changes)
    except BadScene as bad:
        if not any(fault.key == "start" for fault in bad.faults):
            raise
        lacking = ["format=1", "start.theta=0", "span.periods=1"]
        return load_scene(scene, [*changes, *lacking]).top


def _motion_of(scene: Any, data: Data) -> tuple[Top, State | None]:
    """The top, and the start where there is one."""
    if isinstance(scene, Top):
        return scene, None
    if isinstance(scene, str | os.PathLike):
        scene = subject(scene)
        if isinstance(scene, Top):
            return scene, None
    elif scene is None and data.scene is not None:
        scene = read_scene(data.scene, data.name)
    if scene is None:
        rule = "give the scene of the data, or a file with only its [top]"
        raise BadScene((Fault("check", None, "scene", "", rule, "--scene sicm-kicked"),))
    if not isinstance(scene, Scene):
        raise no_scene(scene, "check")
    return scene.top, scene.start


def _size(t: Array, curve: Array) -> Size:
    at = int(np.nanargmax(abs(curve)))
    return Size(abs(float(curve[at])), float(np.sqrt(np.nanmean(curve**2))), float(t[at]))


def _curves(problem: Comparison) -> dict[str, Array]:
    """The error of everything that the data tell, at each time."""
    data, exact = problem.data, problem.exact
    found = {}
    if data.axis is not None:
        found["axis"] = np.linalg.norm(data.axis - exact.axis, axis=1)
    for name in ANGLES:
        if (mine := data.angle(name)) is not None:
            off = wrapped(mine - getattr(exact, name))
            told = off == off if name == "theta" else np.sin(exact.theta) > UPRIGHT
            if told.any():
                off[told], off[~told] = np.unwrap(off[told]), np.nan
                found[name] = off
    if data.spinning is not None:
        A, C, gMR = (float(getattr(problem.top, name)) for name in ("A", "C", "gMR"))
        _, E0, p_phi, p_psi = problem.motion.constants.floats.values()
        u, speed, omega3, upright = data.spinning
        momentum = max(abs(p_phi), abs(p_psi)) or 1.0
        found["energy"] = (A * speed / 2 + gMR * u - E0) / (max(abs(E0), abs(gMR)) or 1.0)
        found["p_phi"] = (A * (upright - omega3 * u) + C * omega3 * u - p_phi) / momentum
        found["p_psi"] = (C * omega3 - p_psi) / momentum
    return found


# --- phase ---------------------------------------------------------------------------------------


def _phase(
    problem: Comparison, curves: Mapping[str, Array]
) -> tuple[Array, Array, Phase | None, float | None]:
    """How far the data run ahead [s]: times, shifts there, what is to be said of them, their power.

    In windows of whole periods the shift is that with which the exact tilt fits best, found by
    Newton's steps from that of the window before. Where the tilt is steady, or not told, the
    precession is fitted.
    """
    data, motion, since = problem.data, problem.motion, problem.since
    name = "phi" if motion.regime.steady or "theta" not in curves else "theta"
    nothing = np.empty(0), np.empty(0), None, None
    if name not in curves:
        return nothing
    mine, shift, found = data.angle(name), 0.0, []
    for rows in _windows(since, motion.period):
        for _ in range(ROUNDS):
            there = motion.at(since[rows] + shift)
            off, slope = wrapped(mine[rows] - getattr(there, name)), getattr(there, f"{name}dot")
            if not (weight := (slope * slope).sum()):
                return nothing
            step = float((off * slope).sum() / weight)
            shift += step
            if abs(step) <= 1e-6 * abs(shift):
                break
        spread = np.sqrt(((off - step * slope) ** 2).mean() / weight)
        found.append((float(data.t[rows].mean()), shift, spread))
    t, shifts, spreads = np.array(found).T
    after = abs(t - data.t[0])
    growth = _growth(after, abs(shifts), np.maximum(spreads, LEAST_PHASE * after))
    largest = float(shifts[abs(shifts).argmax()])
    rms = float(np.sqrt((shifts**2).mean()))
    return t, shifts, Phase(float(shifts[-1]), rms, largest, float(t[-1])), growth


def _power(problem: Comparison, curve: Array | None) -> float | None:
    """The power of time by which an error grows, told from its RMS in windows of whole periods."""
    if curve is None:
        return None
    rows = _windows(problem.since, problem.motion.period)
    after = np.array([abs(problem.since[each].mean()) for each in rows])
    size = np.array([np.sqrt(np.nanmean(curve[each] ** 2)) for each in rows])
    return _growth(after, size, np.full(size.shape, ROUNDED))


def _windows(t: Array, period: float | None) -> list[slice]:
    """The rows of windows that are whole periods long, or parts alike; the last has the rest."""
    span = float(t[-1] - t[0])
    unit = period or span / WINDOWS
    count = max(1, min(WINDOWS, int(span / unit), t.size // WINDOW_ROWS))
    width = unit * max(1, int(span / unit / count))
    edges = np.searchsorted(t, t[0] + width * np.arange(1, count))
    bounds = np.unique([0, *edges, t.size])
    return [slice(a, b) for a, b in pairwise(bounds)]


def _growth(t: Array, shift: Array, spread: Array) -> float | None:
    told = (shift > CERTAIN * spread) & (t > 0)
    if told.sum() < FEWEST or t[told].max() < REACH * t[told].min():
        return None
    line, errors = np.polyfit(np.log(t[told]), np.log(shift[told]), 1, cov=True)
    return float(line[0]) if np.sqrt(errors[0, 0]) < SURE else None


# --- events --------------------------------------------------------------------------------------


def _events(problem: Comparison) -> dict[str, Count]:
    """Events of the data, counted as those of the exact motion at the same times are.

    Where that count is not the proved one, the rows are too far apart for it.
    """
    data, exact, since = problem.data, problem.exact, problem.since
    theta, phi = data.angle("theta"), data.angle("phi")
    mine = _counted(since, theta, phi, exact)
    same = _counted(since, exact.theta, exact.phi_mod, exact)
    found = {}
    try:
        problem.motion.require_proof()
        for event in EVENTS:
            least, most = _proved(problem.motion, event, since)
            told = mine[event] if least <= (same[event] or 0) <= most else None
            found[event] = Count(told, least, most)
    except Unseparated:
        return {}
    return found


def _proved(motion: Motion, event: str, t: Array) -> tuple[int, int]:
    """The least and the most events from the first time to the last, give or take a row."""
    (a, b), (c, d), times = t[:2].tolist(), t[-2:].tolist(), motion.events(event)
    before = 2 * a - b if a < 0 else max(0.0, 2 * a - b)
    return times.count(b, c), times.count(before, 2 * d - c)


def _counted(t: Array, theta: Any, phi: Any, exact: Record) -> dict[str, int | None]:
    """Turns of θ and of φ; a turn of θ at which the axis rests is a cusp."""
    found: dict[str, int | None] = dict.fromkeys(EVENTS)
    if theta is not None:
        tops = _turns(theta, FAINT * np.ptp(exact.theta) + NOISE)
        found["turning"] = len(tops)
    if phi is not None:
        phi = np.unwrap(phi)
        part = (t - t[0]) / (t[-1] - t[0])
        swing = np.ptp(exact.phi - np.polyval(np.polyfit(part, exact.phi, 1), part))
        found["reversal"] = len(_turns(phi, FAINT * swing + NOISE))
    if phi is not None and theta is not None:
        rate = abs(np.gradient(phi, t)[tops])
        found["cusp"] = int((rate < AT_REST * abs(exact.phidot).max()).sum())
    return found


def _turns(x: Array, least: float) -> list[int]:
    """The rows where x turns, but for turns smaller than `least`."""
    found, at, way = [], 0, 0.0
    for k, value in enumerate(x.tolist()):
        gone = value - x[at]
        if gone * way > 0 or (gone == 0 and not way):
            at = k
        elif abs(gone) > least:
            if way:
                found.append(at)
            at, way = k, gone
    return found


# --- the motion's own condition ------------------------------------------------------------------


def _condition(problem: Comparison) -> float:
    """How far the axis moves, at most, when each number changes by half an ulp [rad]."""
    start, body = problem.start, ("A", "C", "gMR")
    state = ("theta", "thetadot", "phidot", start.held)
    numbers = {name: getattr(problem.top, name) for name in body}
    numbers |= {name: getattr(start, name) for name in state}
    looks = np.linspace(0, problem.since.size - 1, LOOKS).astype(int)
    times = [float(problem.since[k]) for k in looks]

    def axes(**changed: Any) -> Any:
        x = numbers | changed
        motion = Motion(Top.of_numbers(*(x[n] for n in body)), State(**{n: x[n] for n in state}))
        records: Any = motion.at(times, LOOK_DIGITS)
        return np.array([record.axis for record in records])

    there, moved = axes(), np.zeros(LOOKS)
    for name, value in numbers.items():
        if value.sign():  # A grows and the others shrink, so that C ≤ 2A and θ ≤ π stay
            change = (axes(**{name: value * (1 + (ULP if name == "A" else -ULP))}) - there) * 2**53
            moved += (change.astype(float) ** 2).sum(axis=1)
    return float(ULP) * float(np.sqrt(moved.max()))
