"""A trajectory held against the closed form of its own binary numbers.

The integrator starts from doubles: the scene's numbers, rounded once. The closed form is
evaluated for exactly those doubles, so that the difference is the integrator's error alone. What
the rounding of the scene's numbers does to the motion is reported apart.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.many_times import DoubleForm, DoubleRecord
from heavytop.analytic.rising import Rising
from heavytop.classification.reduced import (
    FromAxis,
    FromConstants,
    FromScene,
    MotionSource,
    Reduced,
    Through,
)
from heavytop.errors import NoClosedForm
from heavytop.integration.outputs import Sample
from heavytop.numbers import PI, Number
from heavytop.numbers.decimals import context, number
from heavytop.numbers.intervals import rational
from heavytop.run.planning import Plan
from heavytop.run.trajectory import Trajectory
from heavytop.scene.arguments import expect
from heavytop.scene.state import State
from heavytop.scene.top import Top

Array = NDArray[np.float64]

DIGITS = 40
GOLDEN = 0.6180339887498949  # the fraction farthest from all whole ratios


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
    Accuracy: ``tests/two_ways/test_drift.py`` holds the axis of the closed form in doubles, which
    is used here, to 1e-14 of a yardstick of 40 digits.
    """
    expect("trajectory", trajectory, Trajectory, "propagate gives one")
    if trajectory.decimals is not None:
        from heavytop.run.decimal_witness import rounded_errors

        return rounded_errors(trajectory)
    conserved = (energy_error(trajectory), invariant_errors(trajectory))
    try:
        truth = closed_form(trajectory)
    except NoClosedForm as reason:
        return Errors(None, None, None, None, *conserved, None, None, str(reason))
    run = _looked_at(trajectory, truth.period)
    exact = truth(run.t)
    wants = set(trajectory.scene.quantities)
    return Errors(
        theta=_largest(run.theta - exact.theta),
        phi=_followed_error(run.phi - exact.phi),
        psi=_followed_error(run.psi - exact.psi),
        axis=_axis_error(run, exact),
        energy=conserved[0],
        invariants=conserved[1],
        event_time=_event_time(trajectory, truth),
        input_rounding=_input_rounding(trajectory, truth, wants),
    )


def _looked_at(trajectory: Trajectory, period: float | None) -> Sample:
    """Return the samples, and a few times spread over the last period.

    Samples a whole number of periods apart would see every error at one phase only; at a turning
    point that hides an error in time.
    """
    end = trajectory.orbit.end
    reach = min(abs(end), period or abs(end))
    between = end - np.copysign(reach, end) * np.mod(np.arange(1, 8) * GOLDEN, 1.0)
    samples, more = trajectory.samples, trajectory(between)
    return Sample(
        *(np.concatenate((getattr(samples, n), getattr(more, n))) for n in Sample.__slots__)
    )


def _followed_error(difference: Array) -> float | None:
    """Return the largest difference of an angle; None where the run does not follow it."""
    return None if np.isnan(difference).all() else _largest(difference)


def _axis_error(run: Sample, exact: DoubleRecord) -> float | None:
    distance = np.linalg.norm(run.axis - exact.axis, axis=1)
    return None if np.isnan(distance).any() else _largest(distance)


def missed_digits(trajectory: Trajectory, errors: Errors) -> dict[str, float]:
    """Return the wanted quantities that are farther off than the scene's digits allow.

    A quantity x may be off by 10^-digits max(1, |x|).
    """
    if trajectory.decimals is not None:
        from heavytop.run.decimal_witness import missed_decimals

        return missed_decimals(trajectory)
    wants = set(trajectory.scene.quantities)
    end = trajectory(np.array([trajectory.orbit.end]))
    bound = 10.0**-trajectory.scene.digits
    checks = {
        "theta": (wants & {"theta"}, errors.theta, end.theta),
        "phi": (wants & {"phi", "attitude"}, errors.phi, end.phi),
        "psi": (wants & {"psi", "attitude"}, errors.psi, end.psi),
        "axis": (wants & {"axis", "attitude"}, errors.axis, np.ones(1)),
    }
    return {
        name: error
        for name, (wanted, error, value) in checks.items()
        if wanted and error is not None and not error <= bound * max(1.0, abs(float(value[0])))
    }


def closed_form(trajectory: Trajectory) -> DoubleForm:
    """Return the closed form, in double precision, of a run's own binary numbers."""
    return DoubleForm(own_motion(trajectory))


def own_motion(trajectory: Trajectory) -> Rising:
    """Return the motion that the run's own doubles define."""
    state = trajectory.orbit.checkpoints[0].state.tolist()
    source = motion_of(trajectory.plan, DIGITS, state, trajectory.orbit.parameters)
    return Rising(passing(trajectory, source), proved=False)


def passing(trajectory: Trajectory, source: MotionSource) -> MotionSource:
    """Return a motion that passes exactly through the poles through which the scene's does.

    Rounding the start puts the axis beside them. A run turns there as the exact numbers do, and so
    must what it is held against.
    """
    regime = trajectory.motion.rising.regime
    top, bottom = not regime.misses_top, not regime.misses_bottom
    if regime.mirrored:
        top, bottom = bottom, top
    return Through(source, top, bottom) if top or bottom else source


def motion_of(
    plan: Plan, digits: int, state: Sequence[Any], parameters: Parameters
) -> MotionSource:
    """Return the motion through a state of a plan's formulation, given as numbers of any kind.

    Where it is known by roots of them these are taken to as many digits.
    """
    exact = [rational(x) for x in state]
    given = {name: rational(value) for name, value in parameters.items()}
    return _OWN[plan.formulation](context(digits), exact, given, plan.variant)


def _of_angles(
    p: Parameters, theta: Number, phi: Number, psi: Number, *rates: Number, **spin: Number
) -> MotionSource:
    """Return the motion from Euler angles and their rates."""
    thetadot, phidot, *psidot = rates
    start = State(
        theta, phi=phi, psi=psi, thetadot=thetadot, phidot=phidot,
        **(spin or {"psidot": psidot[0]}),
    )  # fmt: skip
    return FromScene(Top(p["A"], p["C"], p["gMR"]), start)


def _of_lagrange(_ctx: Context, state: States, p: Parameters, _variant: Variant) -> MotionSource:
    return _of_angles(p, *state)


def _of_subsystem(_ctx: Context, state: States, p: Parameters, _variant: Variant) -> MotionSource:
    return _of_angles(p, state[0], p["phi_0"], p["psi_0"], *state[1:4])


def _of_axis(_ctx: Context, state: States, p: Parameters, _variant: Variant) -> MotionSource:
    l = (*state[3:5], p["l_z"])  # noqa: E741
    return FromAxis(state[:3], l, p["g"], p["kappa"], p["phi_0"], p["psi_0"])


def _of_attitude(_ctx: Context, state: States, p: Parameters, _variant: Variant) -> MotionSource:
    """Return the motion through q and l; |q|^2 is the length of the axis."""
    w, x, y, z = state[:4]
    e = (2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z)
    l = (*state[4:6], p["l_z"])  # noqa: E741
    return FromAxis(e, l, p["g"], p["kappa"], p["phi_0"], p["psi_0"])


def _of_routh(ctx: Context, state: States, p: Parameters, _variant: Variant) -> MotionSource:
    theta, thetadot = state[:2]
    tilt, p_psi = number(ctx, theta), number(ctx, p["p_psi"])
    along = number(ctx, p["p_minus"]) + 2 * p_psi * ctx.sin(tilt / 2) ** 2
    phidot = rational(along / (number(ctx, p["A"]) * ctx.sin(tilt) ** 2))
    return _of_angles(
        p, theta, p["phi_0"], p["psi_0"], thetadot, phidot, omega3=p["p_psi"] / p["C"]
    )


def _of_cubic(ctx: Context, state: States, p: Parameters, variant: Variant) -> MotionSource:
    """Return the motion through w and wdot of the cubic that the run integrates."""
    w, wdot = state
    side = 1 if variant == "top" else -1
    if w in (0, 2):  # on a pole itself, where wdot is zero whatever the speed
        up = side if not w else -side
        square = number(ctx, abs(p["k_0"] + w * (p["k_1"] + w * p["k_2"])))
        pole = State(
            0 if up > 0 else PI, thetadot=up * rational(ctx.sqrt(square)), omega3=p["n"]
        )  # fmt: skip
        return FromScene(Top(1, 1, p["g"]), pole)
    P, n, g = (rational(x) for x in _momenta(ctx, w, wdot, side, p))
    minus, plus = (w, 2 - w) if side > 0 else (2 - w, w)
    drift, zero = P + side * n * w, Fraction(0)
    kinetic = (wdot * wdot + drift * drift) / (2 * w * (2 - w))
    motion = Reduced(g, n, 1 - minus, minus, plus, zero, drift, kinetic, zero)
    return FromConstants(motion, wdot * wdot, falls=side * wdot > 0)


def _momenta(
    ctx: Context, w: Fraction, wdot: Fraction, side: int, p: Parameters
) -> tuple[Any, Any, Any]:
    """Return P, n and g of the top whose wddot is k_0 + k_1 w + k_2 w^2, through w and wdot.

    Its wdot^2 is 2 k_0 w + k_1 w^2 + 2 k_2 w^3/3 - P^2, and in terms of excess, P, n and g, as
    `height_cubic` has them, k_0 + k_1 = 4 side g - n^2 - side n P and k_2 = -3 side g.
    """
    P, n, k_0, k_1, k_2 = (p[name] for name in ("P", "n", "k_0", "k_1", "k_2"))
    g = -side * k_2 / 3
    P_squared = 2 * k_0 * w + k_1 * w**2 + 2 * k_2 * w**3 / 3 - wdot**2
    middle_squared = P_squared / 4 + 4 * side * g - k_0 - k_1  # of n + side P / 2
    if min(P_squared, middle_squared) < 0:  # through a pole, within rounding
        return P, n, g
    size, middle = (ctx.sqrt(number(ctx, x)) for x in (P_squared, middle_squared))
    own = size if P >= 0 else -size
    return own, (middle if n + side * P / 2 >= 0 else -middle) - side * own / 2, g


Context = Any
States = Sequence[Fraction]
Parameters = Mapping[str, Any]
Variant = str | None

_OWN: Mapping[str, Callable[[Context, States, Parameters, Variant], MotionSource]] = {
    "lagrange": _of_lagrange,
    "subsystem": _of_subsystem,
    "routh": _of_routh,
    "cubic": _of_cubic,
    "axis": _of_axis,
    "attitude": _of_attitude,
}


def energy_error(trajectory: Trajectory) -> float:
    """Return the largest change of E' relative to max(|E'|, gMR)."""
    energy = trajectory.invariants["energy"]
    p = trajectory.orbit.parameters
    g = p["g"] if "g" in p else p["gMR"] / p["A"]
    scale = max(abs(float(energy[0])), abs(g))
    return _largest(energy - energy[0]) / scale if scale else _largest(energy - energy[0])


def invariant_errors(trajectory: Trajectory) -> dict[str, float]:
    """Return the largest relative change of each invariant but the energy."""
    return {
        name: _largest(values - values[0]) / (abs(float(values[0])) or 1.0)
        for name, values in trajectory.invariants.items()
        if name != "energy"
    }


def _event_time(trajectory: Trajectory, truth: DoubleForm) -> float | None:
    """Return the largest time error of the events, by a Newton step to the true zero [s]."""
    events = trajectory.events
    if len(events) == 0:
        return None
    exact = truth(events.t, events.t_low)
    turning = events.is_turning
    with np.errstate(divide="ignore", invalid="ignore"):
        at_turning = exact.udot / exact.uddot
        at_reversal = (exact.u - truth.reversal_u) / exact.udot
    return _largest(np.where(turning, at_turning, at_reversal))


def _input_rounding(trajectory: Trajectory, truth: DoubleForm, wants: set[str]) -> float | None:
    last_time = np.array([trajectory.orbit.end])
    end, exact = trajectory.motion.double(last_time), truth(last_time)
    angles = [a for a in ("theta", "phi", "psi") if a == "theta" or a in wants]
    off = [getattr(end, a) - getattr(exact, a) for a in angles]
    return max(_followed_error(x) or 0.0 for x in off)


def _largest(values: Any) -> float:
    return float(np.max(np.abs(values))) if np.size(values) else 0.0


def phase_error(trajectory: Trajectory, t: float | None = None) -> float:
    """Return how far the nutation runs ahead of the closed form at a time or at the end [s]."""
    truth = closed_form(trajectory)
    at = trajectory.t[-1:] if t is None else np.array([t])
    run, exact = trajectory(at), truth(at)
    du = np.cos(run.theta[0]) - exact.u[0]
    udot = -run.thetadot[0] * np.sin(run.theta[0])
    frequency = truth.frequency
    weight = exact.udot[0] ** 2 + (exact.uddot[0] / frequency) ** 2
    along = du * exact.udot[0] + (udot - exact.udot[0]) * exact.uddot[0] / frequency**2
    return float(along / weight)
