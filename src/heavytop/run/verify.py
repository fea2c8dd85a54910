"""A run compared with the closed form, and what is to be said of it.

Its errors are those against the closed form of its own numbers, the scene's each rounded once to
the run's digits, so that the difference is the integrator's alone; what that rounding does to the
motion is told apart. A run in doubles and one in more
digits are compared alike, in arrays of floats or of mpmath's numbers. Of the latter a few samples
and events stand for all.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.many_times import DoubleForm
from heavytop.analytic.rising import Rising
from heavytop.classification.reduced import (
    FromAxis,
    FromConstants,
    FromScene,
    MotionSource,
    Reduced,
    Through,
)
from heavytop.errors import (
    DoubtfulWarning,
    MissedDigitsWarning,
    NoClosedForm,
    UnboundedAngleWarning,
)
from heavytop.integration.outputs import ANGLES
from heavytop.integration.projection import GOLDEN
from heavytop.numbers.decimals import Context, Number, context, number
from heavytop.numbers.intervals import rational
from heavytop.run.events import EVENTS, Counts, differences, tally
from heavytop.run.planning import Plan
from heavytop.run.trajectory import Trajectory
from heavytop.scene.arguments import expect
from heavytop.scene.state import State
from heavytop.scene.top import Top

Array = NDArray[Any]
Columns = Any  # what a run, a DoubleForm or `_columns` says at several times, by the same names

COMPARED = (*ANGLES, "axis")
FEW = 16  # samples and events that stand for all, where a closed form takes long
GLANCED_AT = 24  # samples, before all are compared
LEAST = 5e-324  # the smallest double: an error that is not zero is not shown as zero
DIGITS = 40  # of roots that a motion in doubles is known by
SPARE_DIGITS = 10  # beyond those of a run in more digits

Known = Mapping[str, Fraction]  # states and constants by the names of their symbols


@dataclass(frozen=True, slots=True)
class Errors:
    """Largest differences between a run and the closed form; None where there is nothing to hold.

    Attributes
    ----------
    theta, phi, psi, axis : float or None
        Over the samples and a few times spread over the last period [rad; the axis as a length].
    energy : float
        Of E', relative to max(|E'|, gMR).
    invariants : dict from str to float
        Of the formulation's other invariants, relative to their start: p_phi, p_psi, and
        |e|^2 or |q|^2 as ``length``. In the axis form p_phi is a constant of the equations.
    event_time : float or None
        Over turning points and reversals [s].
    input_rounding : float or None
        What the rounding of the scene's numbers to double does to the wanted angles at the end.
    why_not : str
        Why there is no closed form to hold against, or empty.
    """

    theta: float | None
    phi: float | None
    psi: float | None
    axis: float | None
    energy: float
    invariants: dict[str, float]
    event_time: float | None
    input_rounding: float | None
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
        The largest at the samples and at times spread over the last period; None where there is
        nothing to hold a quantity against.

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
    Accuracy: ``tests/studies/test_steppers.py`` holds the axis of the closed form in doubles, which
    is used here, to 1e-14 of a yardstick of 40 digits.
    """
    expect("trajectory", trajectory, Trajectory, "propagate gives one")
    changes = conserved(*_invariants(trajectory))
    nothing = Errors(None, None, None, None, changes.pop("energy"), changes, None, None)
    try:
        own, run = _closed_form(trajectory), _looked_at(trajectory)
        off = {name: _double(error) for name, error in _largest(run, own(run.t)).items()}
        moved = _off_exactly(trajectory, own(_samples(trajectory).t[-1:]))
        late = _event_time(trajectory, own)
    except NoClosedForm as reason:
        return replace(nothing, why_not=str(reason))
    wanted = {"theta", *trajectory.scene.quantities}.intersection(ANGLES)
    rounding = _double(max(moved[name] for name in wanted))
    return replace(nothing, **off, event_time=late, input_rounding=rounding)  # type: ignore[arg-type]


def missed_digits(trajectory: Trajectory, errors: Errors) -> dict[str, float]:
    """Return the wanted quantities that are farther off than the scene's digits allow.

    A quantity x may be off by 10^-digits max(1, |x|). So near a special motion that rounding turns
    a start into it, the motion of the run's own numbers is another one: what agrees with that of
    the exact numbers misses nothing.
    """
    found = _beyond(trajectory, {name: getattr(errors, name) for name in COMPARED})
    exactly = _off_exactly(trajectory, _looked_at(trajectory)) if found else {}
    return {name: found[name] for name in _beyond(trajectory, exactly) if name in found}


def deviations(trajectory: Trajectory, most: int = 1000) -> dict[str, Array]:
    """Return times as ``t``, and |run − closed form| there of what the run follows, in doubles.

    At the samples, or at so many of them, evenly spaced. Raises `NoClosedForm`.
    """
    run = trajectory.samples.at(_some(trajectory.t.size, most))
    return {"t": run.t} | _apart(run, closed_form(trajectory)(run.t))


def energy_error(trajectory: Trajectory) -> float:
    """Return the largest change of E' relative to max(|E'|, gMR), in doubles."""
    return conserved(trajectory.invariants, trajectory.orbit.parameters)["energy"]


def conserved(
    invariants: Mapping[str, Array], parameters: Mapping[str, Number], grain: Number = 0.0
) -> dict[str, float]:
    """Return the largest change of each invariant, relative to its start if that is known.

    That of the energy is relative to max(|E'|, g); an invariant that starts within `grain` of
    zero is not divided.
    """
    g = parameters["g"] if "g" in parameters else parameters["gMR"] / parameters["A"]
    sizes = {name: abs(values[0]) for name, values in invariants.items()}
    scales = {name: size if size > grain else 1 for name, size in sizes.items()}
    scales["energy"] = max(sizes["energy"], abs(g)) or 1
    changes = {name: abs(values - values[0]).max() for name, values in invariants.items()}
    return {name: _double(change / scales[name]) for name, change in changes.items()}


def phase_error(trajectory: Trajectory, t: float | None = None) -> float:
    """Return how far the nutation runs ahead of the closed form at a time or at the end [s]."""
    truth = closed_form(trajectory)
    at = trajectory.t[-1:] if t is None else np.array([t])
    run, exact = trajectory(at), truth(at)
    off = np.cos(run.theta) - exact.u, -run.thetadot * np.sin(run.theta) - exact.udot
    return float(ahead(*off, exact, truth.frequency)[0])


def ahead(du: Any, dudot: Any, exact: Columns, frequency: Any) -> Any:
    """Return the shift in time that explains du and dudot best, in the units of the orbit [s]."""
    weight = exact.udot**2 + (exact.uddot / frequency) ** 2
    return (du * exact.udot + dudot * exact.uddot / frequency**2) / weight


# --- warnings ------------------------------------------------------------------------------------


def forewarned(chosen: Plan, stacklevel: int = 3) -> None:
    """Warn of what a plan says may disappoint."""
    about = UnboundedAngleWarning if chosen.formulation == "lagrange" else DoubtfulWarning
    for warning in chosen.warnings:
        warnings.warn(warning, about, stacklevel=stacklevel)


def checked(trajectory: Trajectory, stacklevel: int = 3) -> Trajectory:
    """Return a run that reached its end, with a warning of what it is known to be wrong about.

    However it was made, in one piece, continued or resumed, in doubles or in more digits.
    """
    counted = {name: trajectory.events.count(name) for name in EVENTS}
    if wrong := "; ".join(differences(missed_events(trajectory), counted)):
        doubt = f"events: {wrong} by the exact numbers, which this run does not resolve"
        warnings.warn(doubt, DoubtfulWarning, stacklevel=stacklevel)
    if lack := doubtful_digits(trajectory):
        warnings.warn(lack, MissedDigitsWarning, stacklevel=stacklevel)
    return trajectory


def missed_events(trajectory: Trajectory) -> Counts:
    """Return the least and the greatest true number of the events that are miscounted, by name."""
    expected = tally(trajectory.motion, trajectory.orbit.end, trajectory.scene.events) or {}
    return {
        name: (least, most)
        for name, (least, most) in expected.items()
        if not least <= (trajectory.events.count(name) or 0) <= most
    }


def doubtful_digits(trajectory: Trajectory) -> str:
    """Return the wanted quantities that miss their digits; or nothing.

    A run is glanced at first, beside the motion of the exact numbers. What is farther off than it
    may be, be it by the rounding of the scene's numbers alone, is compared with its own.
    """
    try:
        suspects = _beyond(trajectory, _off_exactly(trajectory, _samples(trajectory, GLANCED_AT)))
    except NoClosedForm:
        return ""
    found = missed_digits(trajectory, run_errors(trajectory)) if suspects else {}
    return missed(found, trajectory.scene.digits) if found else ""


def missed(found: dict[str, float], digits: int) -> str:
    """Return what is farther off the closed form than the digits asked for allow, in words."""
    off = ", ".join(f"{name} {error:.1e}" for name, error in found.items())
    return f"{digits} digits were asked for, and are not met: off the closed form by {off}"


# --- a run and a closed form, in columns of the same numbers -------------------------------------


@dataclass(frozen=True, slots=True)
class _ManyDigits:
    """A closed form at many digits, called as a `DoubleForm` is."""

    form: ClosedForm

    def __call__(self, t: Sequence[Number]) -> Columns:
        return _columns([self.form(each) for each in t], ("t", *COMPARED, "u", "udot", "uddot"))

    @property
    def reversal_u(self) -> Number:
        r = self.form.reduced
        return r.a / r.b if r.b else np.inf


def _closed_form(trajectory: Trajectory, exactly: bool = False) -> DoubleForm | _ManyDigits:
    """The closed form of a run's own numbers, or of the scene's exact ones."""
    if trajectory.decimals is None:
        return trajectory.motion.double if exactly else closed_form(trajectory)
    motion = trajectory.motion.rising if exactly else own_motion(trajectory)
    return _ManyDigits(ClosedForm(motion, trajectory.decimals.digits + SPARE_DIGITS))


def _columns(records: Sequence[Any], names: Sequence[str]) -> Columns:
    """Records of mpmath numbers as arrays of these, but for what they do not know."""
    columns = {name: [getattr(record, name) for record in records] for name in names}
    known = {name: np.array(x, dtype=object) for name, x in columns.items() if None not in x}
    return SimpleNamespace(**known)


def _some(count: int, most: int) -> slice:
    """Some of so many, evenly spaced, the last among them."""
    every = max(1, -(-count // most))
    return slice((count - 1) % every, None, every)


def _samples(trajectory: Trajectory, most: int | None = None) -> Columns:
    """The samples, or so many of them; of a run in more digits a few."""
    count, decimals = trajectory.t.size, trajectory.decimals
    if decimals is None:
        return trajectory.samples.at(_some(count, most or count))
    return _columns(decimals.samples[_some(count, FEW)], ("t", *COMPARED))


def _looked_at(trajectory: Trajectory) -> Columns:
    """The samples, and in doubles a few times spread over the last period.

    Samples a whole number of periods apart would see every error at one phase only; at a turning
    point that hides an error in time.
    """
    samples, end = _samples(trajectory), trajectory.orbit.end
    if trajectory.decimals is not None:
        return samples
    reach = min(abs(end), trajectory.motion.period or abs(end))
    more = trajectory(end - np.copysign(reach, end) * np.mod(np.arange(1, 8) * GOLDEN, 1.0))
    pairs = ((getattr(samples, name), getattr(more, name)) for name in samples.__slots__)
    return replace(samples, **dict(zip(samples.__slots__, map(np.concatenate, pairs), strict=True)))


def _invariants(trajectory: Trajectory) -> tuple[Mapping[str, Array], Mapping[str, Number], Number]:
    """The invariants, at the start first; the constants; and how well a state is known."""
    if trajectory.decimals is None:
        return trajectory.invariants, trajectory.orbit.parameters, 0.0
    run, samples = trajectory.decimals, trajectory.decimals.samples
    some = (samples[0], *samples[_some(len(samples), FEW)])
    each = [run.invariants(sample) for sample in some]
    columns = {name: np.array([values[name] for values in each]) for name in each[0]}
    return columns, run.parameters, run.grain


def _event_time(trajectory: Trajectory, own: Any) -> float | None:
    """The largest time error of the events, by a Newton step to the true zero [s]."""
    events, some = trajectory.events, slice(None)
    if trajectory.decimals is None:
        at = own(events.t, events.t_low)
    else:
        some = _some(len(events), FEW)
        at = own([event.sample.t for event in trajectory.decimals.events[some]])
    turning = events.is_turning[some]
    zero = np.where(turning, at.udot, at.u - own.reversal_u)
    slope = np.where(turning, at.uddot, at.udot)
    known = slope != 0
    return _double(abs(zero[known] / slope[known]).max()) if known.any() else None


def _apart(run: Columns, exact: Columns) -> dict[str, Array]:
    """How far a run is off at each time, in what it follows."""
    told = [name for name in COMPARED if hasattr(run, name)]
    off = {name: getattr(run, name) - getattr(exact, name) for name in told}
    sizes = {n: np.sqrt((x * x).sum(axis=1)) if n == "axis" else abs(x) for n, x in off.items()}
    return {name: size for name, size in sizes.items() if (size == size).any()}  # else it is nan


def _largest(run: Columns, exact: Columns) -> dict[str, Number]:
    return {name: each.max() for name, each in _apart(run, exact).items()}


def _off_exactly(trajectory: Trajectory, run: Columns) -> dict[str, Number]:
    """How far a run is off the motion of the scene's exact numbers."""
    return _largest(run, _closed_form(trajectory, exactly=True)(run.t))


def _beyond(trajectory: Trajectory, off: Mapping[str, Number | None]) -> dict[str, float]:
    """Those of the wanted quantities that are farther off than their digits allow."""
    wanted, samples = {*trajectory.scene.quantities}, trajectory.samples
    if "attitude" in wanted:
        wanted |= {"phi", "psi", "axis"}
    ends = {name: getattr(samples, name)[-1] for name in ANGLES} | {"axis": 1.0}
    bound = context(20).mpf(10) ** -trajectory.scene.digits
    return {
        name: _double(error)
        for name, error in off.items()
        if name in wanted and error is not None and not bound * max(1, abs(ends[name])) >= error
    }


def _double(x: Number) -> float:
    """A number as a double; one smaller than any is the smallest there is."""
    return max(float(x), LEAST) if x else 0.0


# --- the motion that a run's own numbers define --------------------------------------------------


def closed_form(trajectory: Trajectory) -> DoubleForm:
    """Return the closed form, in doubles, of a run's own numbers."""
    return DoubleForm(own_motion(trajectory))


def own_motion(trajectory: Trajectory) -> Rising:
    """Return the motion of a run's own numbers, through the poles that the scene's passes.

    Rounding the start puts the axis beside them. A run turns there as the exact numbers do, and so
    must what it is compared with.
    """
    decimals, orbit = trajectory.decimals, trajectory.orbit
    if decimals is None:
        own = DIGITS, orbit.checkpoints[0].state.tolist(), orbit.parameters
    else:
        start = list(decimals.samples[0].states)
        own = decimals.ctx.dps + SPARE_DIGITS, start, decimals.parameters
    source = motion_of(trajectory.plan, *own)
    regime = trajectory.motion.rising.regime
    passed = not regime.misses_top, not regime.misses_bottom
    top, bottom = passed[::-1] if regime.mirrored else passed
    return Rising(Through(source, top, bottom) if top or bottom else source, proved=False)


def motion_of(
    plan: Plan, digits: int, state: Iterable[Any], parameters: Mapping[str, Any]
) -> MotionSource:
    """Return the motion through a state of a plan's formulation, given as numbers of any kind.

    Where it is known by roots of them these are taken to as many digits.
    """
    names = (symbol.name for symbol in plan.equations.states)
    given = (*parameters.items(), *zip(names, state, strict=True))
    known = {name: rational(value) for name, value in given}
    if "w" in known:
        return _from_cubic(known, context(digits), 1 if plan.variant == "top" else -1)
    return _from_angles(known, context(digits)) if "theta" in known else _from_axis(known)


def _from_angles(known: Known, ctx: Context) -> MotionSource:
    """The motion from Euler angles and their rates; Routh's form has momenta for two of these."""
    phi, psi = (known[name if name in known else f"{name}_0"] for name in ("phi", "psi"))
    if "p_minus" in known:
        sine, half = (ctx.sin(number(ctx, x)) for x in (known["theta"], known["theta"] / 2))
        p_minus, p_psi, A = (number(ctx, known[name]) for name in ("p_minus", "p_psi", "A"))
        phidot = rational((p_minus + 2 * p_psi * half**2) / (A * sine**2))
        rates = {"phidot": phidot, "omega3": known["p_psi"] / known["C"]}
    else:
        rates = {name: known[name] for name in ("phidot", "psidot")}
    start = State(known["theta"], phi=phi, psi=psi, thetadot=known["thetadot"], **rates)
    return FromScene(Top(*(known[name] for name in ("A", "C", "gMR"))), start)


def _from_axis(known: Known) -> MotionSource:
    """The motion from the axis, or a quaternion q whose |q|² is the length of it."""
    if "q_0" in known:
        w, x, y, z = (known[f"q_{i}"] for i in range(4))
        axis = 2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z
    else:
        axis = known["e_x"], known["e_y"], known["e_z"]
    momentum = [known[f"l_{x}"] for x in "xyz"]
    return FromAxis(axis, momentum, *(known[x] for x in ("g", "kappa", "phi_0", "psi_0")))


def _from_cubic(known: Known, ctx: Context, side: int) -> MotionSource:
    """The motion from ẅ = k₀ + k₁ w + k₂ w² through w and ẇ, as the run integrates it.

    At w = 0 and w = 2 the cubic that is ẇ² has the values −P² and −(P + 2 side n)².
    """
    w, wdot = known["w"], known["wdot"]
    k = [known[f"k_{i}"] for i in range(3)]

    def momentum(pole: int, given: Fraction) -> Fraction:
        rise = sum(each * (w**i - Fraction(pole) ** i) / i for i, each in enumerate(k, 1))
        square = 2 * rise - wdot**2
        if square < 0:  # through the pole, within rounding
            return given
        root = rational(ctx.sqrt(number(ctx, square)))
        return root if given >= 0 else -root

    P = momentum(0, known["P"])
    n = side * (momentum(2, known["P"] + 2 * side * known["n"]) - P) / 2
    drift, sin2, zero = P + side * n * w, w * (2 - w), Fraction(0)
    pull = k[0] + w * (k[1] + w * k[2])  # on a pole, where ẇ vanishes, this is the square of θ̇
    kinetic = (wdot**2 + drift**2) / (2 * sin2) if sin2 else abs(pull) / 2
    above, below = (w, 2 - w)[::side]
    motion = Reduced(-side * k[2] / 3, n, 1 - above, above, below, zero, drift, kinetic, zero)
    return FromConstants(motion, wdot**2, falls=side * wdot > 0)
