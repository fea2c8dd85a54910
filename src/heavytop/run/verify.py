"""Compare a run with the closed form: its errors, the digits and events that it misses, warnings.

Errors are relative to the closed form of the run's own binary start and so are the integrator's
alone; `input_rounding` is what rounding the scene's numbers does to the motion. A run has its
digits where it is close enough to that closed form, or to the scene's. Runs in more digits than
doubles are compared in the same way, in columns of mpmath's numbers, at few samples.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.form import to_mpf
from heavytop.analytic.motion import ClosedForm
from heavytop.errors import DoubtfulWarning, MissedDigitsWarning, NoClosedForm
from heavytop.exact.decimals import Number, context
from heavytop.run.binary_motion import OWN_SPARE_DIGITS, spread_places
from heavytop.run.counts import Counts, count_events, differences
from heavytop.run.plan import Plan
from heavytop.run.trajectory import Trajectory
from heavytop.scene.arguments import expect
from heavytop.scene.quantities import (
    ANGLES,
    QUANTITIES,
    Need,
    columns_of,
    judged_quantities,
    need_of,
    values_of,
)
from heavytop.text import Shown

Array = NDArray[Any]
Columns = Any  # a run or a closed form at several times, with columns of the same names

COMPARED: Final = ("theta", "phi", "psi", "axis", "rates")
GRAIN_BITS: Final = 24  # of a state in more digits that rounding may have spoilt
LEAST_DOUBLE: Final = 5e-324  # the smallest double: an error that is not zero is not shown as zero


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors(Shown):
    """Largest differences between a run and the closed form; None where one of them has no value.

    Attributes
    ----------
    theta, phi, psi, axis : float or None
        Over the samples and at times between them [rad; the axis as a length].
    rates : float or None
        The largest of those of thetadot, phidot and psidot, at the same times [rad/s].
    energy : float
        Of E', relative to max(|E'|, gMR) [1].
    invariants : dict from str to float
        Of the formulation's other invariants, relative to their start [1]: p_phi, p_psi, and
        |e|^2 or |q|^2 as ``length``. In the axis form p_phi is a constant of the equations.
    event_time : float or None
        Over turning points and reversals [s].
    input_rounding : float or None
        What the rounding of the scene's numbers to double does at the end to the angles that the
        wanted quantities need, and to the axis as a length [rad].
    derived : dict from str to float
        Of what the scene wants that follows from other columns [each in its unit].
    why_not : str
        Why there is no closed form to compare with, or empty.
    """

    theta: float | None = None
    phi: float | None = None
    psi: float | None = None
    axis: float | None = None
    rates: float | None = None
    energy: float
    invariants: dict[str, float]
    event_time: float | None = None
    input_rounding: float | None = None
    derived: dict[str, float] = field(default_factory=dict)
    why_not: str = ""


def run_errors(trajectory: Trajectory) -> Errors:
    """The errors of a trajectory against the closed form of its own binary start.

    Parameters
    ----------
    trajectory : Trajectory
        What was run, or the part that was.

    Returns
    -------
    Errors
        The largest at the samples and at times that do not depend on them, 64 spread over the
        span and 16 over the last period; None where a quantity cannot be compared.

    Raises
    ------
    WrongType
        It is no Trajectory.

    Examples
    --------
    >>> import heavytop as ht
    >>> run_errors(ht.propagate(ht.load_scene("sicm-kicked"))).theta < 1e-13
    True

    Notes
    -----
    Accuracy: ``tests/studies/test_drift.py`` holds the axis of the closed form in doubles, which
    is used here, to 1e-14 of a reference of 40 digits.
    """
    expect("trajectory", trajectory, Trajectory, "propagate gives one")
    scene, own = trajectory.motion, trajectory.binary_motion
    changes, wants = _changes(trajectory), trajectory.scene.quantities
    nothing = Errors(energy=changes.pop("energy"), invariants=changes)
    derived = [name for name in wants if QUANTITIES[name].of]
    try:
        run, exact, fixed = trajectory.compared
        off = _differences(trajectory, run, exact, (*COMPARED, *derived))
        off["event_time"], _ = _lateness(trajectory, own.closed_form)
        end = run.t[fixed[-1:]]
        rounded, unrounded = (trajectory.exact(x, end) for x in (own.closed_form, scene))
        need = max(need_of(wants), Need.TILT)
        moved = [name for name in (*ANGLES, "axis") if QUANTITIES[name].need <= need]
        rounding = _differences(trajectory, rounded, unrounded, moved)
    except NoClosedForm as reason:
        return replace(nothing, why_not=str(reason))
    found: dict[str, Any] = {name: _double(x.max()) for name, x in off.items() if x.size}
    found["derived"] = {name: found.pop(name) for name in derived if name in found}
    found["input_rounding"] = _double(max(x.max() for x in rounding.values()))
    return replace(nothing, **found)


@dataclass(frozen=True, slots=True)
class Misses:
    """What a run misses of what its scene wants.

    Attributes
    ----------
    digits : dict from str to float
        Errors larger than the scene's digits allow, of wanted quantities and of event times.
    events : mapping from str to (int, int)
        The least and the greatest true number of the events that are miscounted.
    miscounted : str
        The same in words.
    factor : float
        The largest error in units of the allowed one, at times that do not depend on the samples;
        infinite where events are miscounted, at most 1 where nothing is missed there.
    """

    digits: dict[str, float]
    events: Counts
    miscounted: str
    factor: float

    def __str__(self) -> str:
        off = [f"{name} off by {error:.1e}" for name, error in self.digits.items()]
        return ", ".join(filter(None, (*off, self.miscounted)))


def misses(trajectory: Trajectory) -> Misses:
    """Return what a run misses.

    A quantity x may be off by 10^-digits max(1, |x|), with x at the end; for rates |x| is the
    largest of them all. An event may be late by 10^-digits of a period, and by the time in which
    the rate that vanishes there changes by 10^-digits. Beside a special motion rounding may turn
    the start into another one: a run that agrees with the scene's exact motion misses nothing.
    """
    expected = count_events(trajectory.motion, trajectory.orbit.end, trajectory.scene.events) or {}
    found = {name: trajectory.events.count(name) or 0 for name in expected}
    events = {n: ends for n, ends in expected.items() if not ends[0] <= found[n] <= ends[1]}
    digits, factor = _missed_digits(trajectory)
    wrong = "; ".join(differences(events, found))
    return Misses(digits, events, wrong, np.inf if events else factor)


def _missed_digits(trajectory: Trajectory) -> tuple[dict[str, float], float]:
    """Return the errors that are too large, and the `factor` of `Misses`."""
    names, bound = judged_quantities(trajectory.scene.quantities), _bound(trajectory)
    allowed: dict[str, Any] = {name: bound * _size(trajectory, name) for name in names}
    scene, own = trajectory.motion, trajectory.binary_motion
    try:
        run, exact, fixed = trajectory.compared
        off = _differences(trajectory, run, exact, names)
        off["event_time"], allowed["event_time"] = _lateness(trajectory, own.closed_form)
        if not (far := _exceeding(off, allowed)):
            return {}, 0.0
        exact = trajectory.exact(scene, run.t)
        off = _differences(trajectory, run, exact, [name for name in names if name in far])
        factors = [float(x[fixed].max() / allowed[name]) for name, x in off.items()]
        if "event_time" in far:
            off["event_time"], allowed["event_time"] = _lateness(trajectory, scene)
    except NoClosedForm:
        return {}, 0.0
    return _exceeding(off, allowed), max(factors, default=0.0)


def deviations(trajectory: Trajectory) -> dict[str, Array]:
    """Return |run − closed form| of angles and axis, in doubles, and the times as ``t``.

    At the samples, or at 1000 of them, evenly spaced. Raises `NoClosedForm`.
    """
    run = trajectory.samples.at(spread_places(trajectory.t.size, 1000))
    exact = trajectory.binary_motion.closed_form.at(run.t)
    return {"t": run.t} | _differences(trajectory, run, exact, (*ANGLES, "axis"))


def invariant_drift(
    invariants: Mapping[str, Array], parameters: Mapping[str, Number], grain: Number = 0.0
) -> dict[str, float]:
    """Return the largest change of each invariant, relative to its size at the start.

    That of the energy is relative to max(|E'|, g); that of an invariant that starts within `grain`
    of zero is absolute.
    """
    g = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    sizes = {name: abs(values[0]) for name, values in invariants.items()}
    scales = {name: size if size > grain else 1 for name, size in sizes.items()}
    scales["energy"] = max(sizes["energy"], abs(g)) or 1
    changes = {name: abs(values - values[0]).max() for name, values in invariants.items()}
    return {name: _double(change / scales[name]) for name, change in changes.items()}


# --- warnings ------------------------------------------------------------------------------------


def warn_of_plan(chosen: Plan, stacklevel: int = 3) -> None:
    """Issue the warnings of a plan."""
    for warning in chosen.warnings:
        warnings.warn(warning, DoubtfulWarning, stacklevel=stacklevel)


def warn_of_misses(found: Misses, digits: int, stacklevel: int = 3) -> None:
    """Warn of the events and the digits that a finished run misses."""
    if found.events:
        doubt = f"events: {found.miscounted}, by the exact numbers; this run does not resolve them"
        warnings.warn(doubt, DoubtfulWarning, stacklevel=stacklevel)
    if found.digits:
        warnings.warn(miss_text(found.digits, digits), MissedDigitsWarning, stacklevel=stacklevel)


def miss_text(found: dict[str, float], digits: int) -> str:
    """Return in words which errors are larger than the digits allow."""
    off = ", ".join(f"{name} {error:.1e}" for name, error in found.items())
    late = f"; event_time: at least 1e-{digits} periods" * ("event_time" in found)
    off += f" (allowed: 1e-{digits} max(1, |x|){late})"
    return f"{digits} digits were requested and are not met: off the closed form by {off}"


# --- a run and a closed form, in columns of the same numbers -------------------------------------


def _differences(
    trajectory: Trajectory, run: Columns, exact: Columns, names: Iterable[str]
) -> dict[str, Array]:
    """Return the error at each time of those of some quantities that the run follows."""
    found, motion = {}, trajectory.motion
    for name in names:
        off = [values_of(run, x, motion) - values_of(exact, x, motion) for x in columns_of(name)]
        sizes = [np.sqrt((x * x).sum(axis=1)) if x.ndim > 1 else abs(x) for x in off]
        found[name] = reduce(np.maximum, sizes)
    return {name: size for name, size in found.items() if (size == size).any()}  # else it is nan


def _lateness(trajectory: Trajectory, motion: ClosedForm) -> tuple[Array, Array]:
    """Return how late events are, by a Newton step to the true zero, and how late they may be [s].

    Either way in time counts as late.
    """
    events, scene = trajectory.events, trajectory.motion
    turning, later = events.is_turning, 0 * events.t
    if events.own is not None:
        few = spread_places(len(events))
        turning, later = turning[few], later[few]
        at = trajectory.exact(motion, trajectory.numbers(events.own["t"][few]))
    elif motion is trajectory.binary_motion.closed_form:
        at, later = trajectory.exact_events
    else:
        at = trajectory.exact(motion, events.t, events.t_low)
    b = abs(scene.refine("p_psi/A", lambda c: float(c.start.b)))
    reversal = _reversal_u(trajectory, motion) if b else np.inf
    zero = np.where(turning, at.udot, at.u - reversal)
    slope = np.where(turning, at.uddot, at.udot)
    known = slope != 0
    sine2, slope, b = (at.one_minus_u * at.one_plus_u)[known], slope[known], b or 1.0
    softness = np.where(turning[known], np.sqrt(sine2), sine2 / b) / abs(slope)  # 1/|θ̈|, 1/|φ̈|
    period = scene.period or 1 / (scene.growth or 1.0)
    allowed = _bound(trajectory) * (period + softness)
    return abs(zero[known] / slope + later[known]), allowed


def _reversal_u(trajectory: Trajectory, motion: ClosedForm) -> Number:
    """Return cos θ of the tilt at which φ̇ is 0, of a top that spins, to the digits of the times."""
    digits = trajectory.scene.digits + OWN_SPARE_DIGITS
    ball = motion.refine("a reversal", lambda c: c.start.a / c.start.b, max(digits, 17))
    return float(ball) if trajectory.in_doubles else to_mpf(ball, digits)


def _changes(trajectory: Trajectory) -> dict[str, float]:
    """Return the changes of the invariants, by name; in more digits over few samples."""
    constants = trajectory.orbit.parameters
    if trajectory.in_doubles:
        return invariant_drift(trajectory.invariants, constants)
    samples, number = trajectory.raw_samples, trajectory.numbers
    few = samples.at(np.append(0, spread_places(samples.t.size)))
    columns = {name: number(x) for name, x in trajectory.raw_invariants(few).items()}
    grain = trajectory.ctx.ldexp(1, GRAIN_BITS - trajectory.bits)
    return invariant_drift(columns, {name: number(x) for name, x in constants.items()}, grain)


def _bound(trajectory: Trajectory) -> Any:
    """Return 10^-digits; of a run in more digits as mpmath's, lest it be below all doubles."""
    ten: Any = 10.0 if trajectory.in_doubles else context(20).mpf(10)
    return ten**-trajectory.scene.digits


def _exceeding(off: Mapping[str, Array], allowed: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest error of each quantity that has one larger than is allowed."""
    far = {name: each[~(each <= allowed[name])] for name, each in off.items()}
    return {name: _double(each.max()) for name, each in far.items() if each.size}


def _size(trajectory: Trajectory, name: str) -> float:
    """Return the size to which errors of a quantity are relative, at least 1.

    It is the value at the end, or the largest value of all columns where there are several.
    """
    run, columns = trajectory.samples, columns_of(name)
    values = (values_of(run, column, trajectory.motion) for column in columns)
    sizes = (abs(x if len(columns) > 1 else x[-1:]) for x in values)
    return max(float(np.fmax.reduce(size, axis=None, initial=1.0)) for size in sizes)


def _double(x: Number) -> float:
    """Return a number as a double; one that is not zero does not become zero."""
    return max(float(x), LEAST_DOUBLE) if x else 0.0
