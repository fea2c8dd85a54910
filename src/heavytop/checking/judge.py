"""`check`: the errors of somebody else's trajectory against the exact motion, and their causes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from heavytop.checking import method
from heavytop.checking.comparison import FOLD_ALLOWED, MOMENT_NAMES, Comparison, wrap
from heavytop.checking.conventions import TABLE
from heavytop.checking.reading import POSITIONS, Data, norm, read
from heavytop.checking.search import Explanation, Judgement, Undoing, explain, undo, undo_names
from heavytop.doctor import versions
from heavytop.errors import BadScene, Fault, HeavyTopError, refuse
from heavytop.exact.pairs import UNIT, Array
from heavytop.results.check import CHECKED_QUANTITIES, Check, Finding
from heavytop.scene.arguments import one_of, parse_names
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.scene import Scene, expect_scene, load_scene, read_scene
from heavytop.scene.scene_file import EVENTS
from heavytop.scene.state import State
from heavytop.scene.top import Top

CHARTED: Final = 1000  # times of the curves in the document and in charts
ALONE: Final = 10.0  # times the other errors: an error of one rate alone
RATE_ROUNDING: Final = 1e-13  # of a rate, relative to its largest value
START_NUMBERS: Final = (*ANGLES, *RATES, "omega3")
UPRIGHT_SINE: Final = 1e-6  # sin θ below which errors of φ and ψ have no meaning


def check(
    data: str | os.PathLike[str] | Mapping[str, Any],
    scene: Scene | Top | str | os.PathLike[str] | None = None,
    columns: Mapping[str, str] | None = None,
    undone: Sequence[str] = (),
) -> Check:
    """Compare a trajectory of your own with the exact motion.

    Parameters
    ----------
    data : path or mapping from str to array_like
        A table with a header (CSV, TSV), ``.npz``, ``.mat``, netCDF or HDF5, or arrays by their
        names: ``t`` [s] and any of theta, phi, psi [rad]; axis; quaternion, scalar first, or
        matrix, from body to space; thetadot, phidot, psidot, omega or omega_body [rad/s]; L and
        gamma, the vertical, in the body. In the folder of a run ``trajectory.nc`` is read.
    scene : Scene, Top, str or path, optional
        The scene of the data. For a top alone, or a scene file with a table ``[top]`` alone, the
        start is that of the first row, or fitted where the data have no rates. It may be left out
        for a trajectory that ``heavytop run`` wrote.
    columns : mapping from str to str, optional
        The names of columns that have no usual name, with a unit if they have one:
        ``{"t": "Zeit", "theta": "a [deg]"}``.
    undone : sequence of str
        Conventions that are undone before the data are compared, such as ``["y-up"]``.

    Returns
    -------
    Check

    Raises
    ------
    ForeignFile
        The data cannot be read, or are no trajectory; every fault is listed.
    BadScene
        The scene cannot be read, there is none, or there is no such convention.
    Impossible
        No motion starts as the first row says, or none fits.
    NoClosedForm
        The data reach beyond 2⁶² periods.
    WrongType
        An argument has a wrong type.

    Examples
    --------
    >>> import numpy as np
    >>> from heavytop.analytic.motion import Motion
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> t = np.linspace(0, 5, 501)
    >>> mine = Motion(scene.top, scene.start).at(1.0001 * t)
    >>> found = check({"t": t, "axis": mine.axis}, scene)
    >>> f"{found.digits:.1f} digits, {found.phase.last:.1e} s ahead at {found.phase.t:.1f} s"
    '2.6 digits, 4.7e-04 s ahead at 4.7 s'
    >>> degrees = {"t": t, "theta": np.degrees(mine.theta), "phi": np.degrees(mine.phi)}
    >>> [each.name for each in check(degrees, scene).conventions]
    ['degrees']

    Notes
    -----
    Accuracy: ``tests/checking/test_judge.py`` holds planted errors of the axis, of the phase and of
    the energy to 2 %, and data of the closed form to 14 digits; ``validation/47_conventions.py``
    counts what is said of planted conventions.
    """
    expect_conventions(undone)
    given = read(data, columns)
    motion = _motion_of(scene, given)

    def posed(arrays: Mapping[str, Array]) -> Comparison:
        comparison = Comparison(arrays, *motion)
        return undo_names(comparison, undone) if undone else comparison

    comparison = posed(given.values)
    verdict = explain(comparison)
    found, steps, agent = _undo_sure(verdict, comparison)
    judged = undo(comparison, steps)
    curves = error_curves(judged)
    shaken = error_curves(undo(posed(given.shaken), steps)) if given.shaken else {}
    phase = method.measure_phase(judged)
    growth = {name: method.measure_growth(judged, curves.get(name)) for name in ("axis", "energy")}
    named = {each.name for each in found}
    declared = [Finding(x, "the header says so") for x in given.declared if x not in named]
    conventions = (*found, *declared)
    assumed = [*given.remarks, *_remark_angles(judged)]
    digits = _digits(_largest_errors(comparison))
    if undone:
        without = _digits(_largest_errors(Comparison(given.values, *motion)))
        assumed.append(f"undone: {', '.join(undone)} ({digits:.1f} digits, without {without:.1f})")
    if verdict.alike:
        names = sorted(name for step in steps for name in step.names)
        assumed.append(f"judged as {' and '.join(names) or 'they are'}")
    condition, largest = method.measure_condition(judged), _largest_errors(judged)
    alone = _lone_error(largest)
    charted = {"t": judged.t, **curves, "phase_t": phase.t, "phase": phase.shifts}
    sizes = {name: _size(judged.t, curve) for name, curve in curves.items()}
    before, after = _rms_error(comparison), max(_rms_error(judged) or 0.0, UNIT)
    rms = {"error_before": before, "error_after": after}
    slips = [{"name": x.name, "sentence": x.sentence, **rms} for x in conventions]
    return Check(
        scene={"name": given.name, "title": "", **_problem_of(judged)},
        data=_data_of(given),
        origin=comparison.origin,
        errors=dict.fromkeys(CHECKED_QUANTITIES) | sizes | {"phase_s": phase.phase},
        digits=_digits(largest),
        digits_as_given=digits,
        growth={"phase": phase.growth, **growth},
        events=dict.fromkeys(EVENTS) | method.count_events(judged),
        condition=condition,
        conventions=conventions,
        alternatives=tuple(map(_alternative, verdict.alike)),
        method=method.describe_method(judged, curves, agent, condition, shaken, alone)
        | {"no_phase": phase.why},
        assumed=tuple(assumed),
        slip=next(iter(slips), None),
        curves={name: x[:: -(-x.size // CHARTED) or 1].tolist() for name, x in charted.items()},
        versions=versions(),
    )


def _alternative(found: Explanation) -> dict[str, Any]:
    """An explanation as JSON has it: the names of its conventions, and their sentences."""
    names = [name for step in found.steps for name in step.names]
    return {"names": names, "sentence": "; ".join(dict.fromkeys(x.sentence for x in found.steps))}


def _problem_of(judged: Comparison) -> dict[str, Any]:
    """The top and the start in doubles."""
    return {
        "top": {name: float(getattr(judged.top, name)) for name in MOMENT_NAMES},
        "start": {name: float(getattr(judged.start, name)) for name in START_NUMBERS},
    }


def _data_of(given: Data) -> dict[str, Any]:
    """The description of the data, as JSON has it."""
    t = given.values["t"].tolist()
    return {
        "file": given.name,
        "rows": len(t),
        "span": [t[0], t[-1]],
        "columns": {name: quantity or None for name, quantity in given.columns.items()},
        "read_as": [*dict.fromkeys(x for x in given.columns.values() if x not in ("", "t"))],
    }


def _undo_sure(
    verdict: Judgement, comparison: Comparison
) -> tuple[list[Finding], list[Undoing], str]:
    """The findings that are sure, the conventions to undo, and what else acts, in words."""

    def findings(steps: list[Undoing]) -> list[Finding]:
        found = [Finding(x, s.sentence, verdict.gain(s)) for s in steps for x in s.names]
        return sorted(found, key=lambda x: -(x.gain or 0))

    numbers = [step for step in verdict.best.steps if step.convention.about == "number"]
    steps = [step for step in verdict.best.steps if step not in numbers]
    sure = [step for step in steps if verdict.sure.issuperset(step.names)]
    described = [step for step in sure if not step.convention.physics]
    turned = [step for step in sure if step in described or "spin-sign" in step.names]
    # A motor or friction may look like other physics, but not where the data fit already.
    for some in () if verdict.best.fits else (described, turned):
        judged = undo(comparison, some)
        if judged.given is not None and (agent := method.find_agent(judged)):
            return [*findings(some), Finding(*agent)], some, agent[1]
    other = "" if verdict.alike else "".join(step.sentence for step in numbers)
    return findings(sure), steps, other


def expect_conventions(undone: Sequence[str]) -> None:
    """Raise `BadScene` for a name of no convention."""
    known = {row.name: row for row in TABLE}
    refuse(parse_names("check", "undone", undone, one_of(known), least=0)[1])


def subject(scene: str | os.PathLike[str], changes: Sequence[str] = ()) -> Scene | Top:
    """The changed scene of a name or path; or the top, where a file has only a table [top]."""
    try:
        return load_scene(scene, changes)
    except BadScene as bad:
        if not any(fault.key == "start" for fault in bad.faults):
            raise
        return load_scene(scene, [*changes, "format=1", "start.theta=0", "span.periods=1"]).top


def _motion_of(scene: Any, data: Data) -> tuple[Top, State | None]:
    """The top and the start of the scene; None for the start where it is to be taken from data."""
    if isinstance(scene, str | os.PathLike):
        scene = subject(scene)
    elif scene is None and isinstance(data.scene, str):
        scene = read_scene(data.scene, data.name)
    if scene is None:
        rule = "give the scene of the data, or a file with only its [top]"
        raise BadScene((Fault("check", None, "scene", "", rule, "--scene sicm-kicked"),))
    return (scene, None) if isinstance(scene, Top) else (expect_scene(scene).top, scene.start)


def _remark_angles(c: Comparison) -> list[str]:
    """Remarks that θ is folded, with the first such row, and that angles are unwrapped."""
    remarks = []
    if c.folded is not c:
        theta = c.arrays["theta"]
        row = int(np.argmax((theta < -FOLD_ALLOWED) | (theta > np.pi + FOLD_ALLOWED)))
        where = f"row {row + 1} (t = {c.t[row]:g} s, {theta[row]:.6g})"
        remarks.append(f"θ leaves [0, π] in {where}: folded")
    jumps = {x: abs(np.diff(c.arrays[x])) for x in ("phi", "psi") if x in c.arrays}
    if jumping := [name for name, step in jumps.items() if (step > np.pi).any()]:
        remarks.append(f"unwrapped: {', '.join(jumping)}")
    return remarks


# --- the sizes of errors -------------------------------------------------------------------------


def _size(t: Array, curve: Array) -> dict[str, float]:
    """The largest size of an error, its root mean square, and the time of the largest."""
    at = int(np.nanargmax(abs(curve)))
    return {"max": abs(float(curve[at])), "rms": method.rms(curve), "t_max": float(t[at])}


def _largest_errors(c: Comparison) -> dict[str, float]:
    """The largest error of each quantity; empty where there is no motion."""
    try:
        errors = dict(c.errors)
        if "axis" in c.derived:
            errors["axis"] = norm(c.derived["axis"] - c.exact.axis)
    except HeavyTopError:
        return {}
    for name, angle in (("phi", "phi"), ("psi", "psi"), ("matrix", "psi")):
        if name in errors:  # a growing angle is written with a fixed number of digits
            errors[name] = errors[name] / np.maximum(1, abs(getattr(c.exact, angle)))
    return {name: float(np.nanmax(error)) for name, error in errors.items()}


def _digits(largest: Mapping[str, float]) -> float:
    """The number of decimal digits that all quantities have."""
    return max(0.0, -float(np.log10(max(*largest.values(), UNIT) if largest else 1.0)))


def _lone_error(largest: Mapping[str, float]) -> str:
    """Words for a rate with ten times the error of all else and of rounding; empty without one."""
    name = max(largest, key=largest.__getitem__, default=POSITIONS[0])
    if name in POSITIONS:
        return ""
    off = largest[name]
    if off < ALONE * max([RATE_ROUNDING, *(x for other, x in largest.items() if other != name)]):
        return ""
    return f"{name} is off by {off:.2g} of its largest, all else by less"


def _rms_error(c: Comparison) -> float | None:
    """The RMS error of the first quantity; None where there is no motion."""
    try:
        return method.rms(next(iter(c.errors.values())))
    except HeavyTopError:
        return None


def error_curves(c: Comparison) -> dict[str, Array]:
    """The error of each quantity that the data give, at each time."""
    exact, found = c.exact, dict[str, Array]()
    if "axis" in c.derived:
        found["axis"] = norm(c.derived["axis"] - exact.axis)
    for name in ANGLES:
        if name in c.folded.derived:
            off = wrap(c.folded.derived[name] - exact.value(name))
            clear = off == off if name == "theta" else exact.sine > UPRIGHT_SINE
            if clear.any():
                off[clear], off[~clear] = np.unwrap(off[clear]), np.nan
                found[name] = off
    if c.spin is not None:
        A, C, gMR = (float(getattr(c.top, name)) for name in MOMENT_NAMES)
        _, E0, p_phi, p_psi = c.motion.constants.floats.values()
        omega, e, upward = c.spin
        omega3, u = (omega * e).sum(axis=1), (e * upward).sum(axis=1)
        across = omega - omega3[:, None] * e
        momentum = max(abs(p_phi), abs(p_psi)) or 1.0
        energy = A * (across**2).sum(axis=1) / 2 + gMR * u
        found["energy"] = (energy - E0) / (max(abs(E0), abs(gMR)) or 1.0)
        found["p_phi"] = (A * (across * upward).sum(axis=1) + C * omega3 * u - p_phi) / momentum
        found["p_psi"] = (C * omega3 - p_psi) / momentum
    return found
