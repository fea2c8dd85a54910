"""How the period, and what turns in it, changes with the top and its start.

Everything is integrated, from the variational equations; no closed form is differentiated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heavytop.arguments import text_of
from heavytop.errors import BadScene, Fault
from heavytop.models import gradients
from heavytop.models.ladder import LADDER
from heavytop.motion import Motion
from heavytop.planning import EPSILON, closed_form_of, plan
from heavytop.scene import Scene
from heavytop.transition import Numbers, Transition, at_start, numbers, state_transition, transition

__all__ = ["UNITS", "Sensitivities", "Transition", "sensitivities", "state_transition"]

Array = NDArray[np.float64]
Rates = Mapping[str, float]

UNITS: Mapping[str, str] = {
    "A": "kg m^2",
    "C": "kg m^2",
    "gMR": "kg m^2 s^-2",
    "theta": "rad",
    "thetadot": "rad/s",
    "phidot": "rad/s",
    "psidot": "rad/s",
    "omega3": "rad/s",
}
ANGLES = ("theta", "phi", "psi")
ROUNDING = 64 * EPSILON  # of derivatives after a period, as the tests find it
WORST = 1e-8


@dataclass(frozen=True, slots=True)
class Sensitivities:
    """Derivatives of the period and of what turns in it, by each parameter and start value x.

    Of psidot and omega3 the one that the scene gives is varied, and held when another value is.

    Attributes
    ----------
    period : mapping from str to float
        dT/dx [s per unit of x].
    precession, spin : mapping from str to float, or None
        dΔφ/dx and dΔψ/dx [rad per unit of x]; None in a formulation without these angles, and
        where both turning points are at the poles, so that φ is nowhere to be read off.
    units : mapping from str to str
        The unit of each x.
    error : float
        Estimated relative error of `period`, x counted in its natural size: from how well the
        derivatives of cos θ, whose rate vanishes at a turning point, return after a period. It is
        not a bound.
    """

    period: Rates
    precession: Rates | None
    spin: Rates | None
    units: Mapping[str, str]
    error: float


def sensitivities(scene: Scene, formulation: str = "axis") -> Sensitivities:
    """Return the derivatives of T, Δφ, Δψ by all that a scene gives, in double precision.

    Parameters
    ----------
    scene : Scene
        Its top and start; span and wants do not matter.
    formulation : str
        The name of the formulation whose variational equations are integrated.

    Returns
    -------
    Sensitivities
        By name of each number of the top and the start [of the quantity per unit of the number].

    Raises
    ------
    BadScene
        Nothing nutates; there is no such formulation, it cannot start at the scene's pole, or fewer
        than eight digits are left: beside a pole, or of a nutation that is itself tiny.
    EndedEarly
        The formulation is singular on the way, at a pole.

    Notes
    -----
    With g the function whose zeros are the turning points and t₁ the time of one, g returns to
    its value after a period, whatever x is: g(t₁ + T; x) = g(t₁; x), so

        dT/dx = (∂g(t₁)/∂x − ∂g(t₁ + T)/∂x) / ġ,
        dΔφ/dx = ∂φ(t₁ + T)/∂x − ∂φ(t₁)/∂x + φ̇ dT/dx.

    Of the two turning points the one farther from the poles is taken. Where the axis passes
    exactly through a pole, Δφ jumps by 2π from one side of it to the other; its derivatives do not.

    Accuracy: ``tests/two_ways/test_sensitivity.py`` holds them to 1e-12 of the closed form's.

    References
    ----------
    Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, section I.14, for the
    variational equations.

    Examples
    --------
    >>> from heavytop.scene import load_scene
    >>> found = sensitivities(load_scene("sicm-kicked"))
    >>> round(found.period["phidot"], 9), round(found.precession["phidot"], 7)
    (-0.007692825, -0.0759131)
    """
    motion = closed_form_of(scene)
    if motion.period is None:
        rule = f"nothing nutates: {motion.kind} has no period to vary"
        raise BadScene((Fault(scene.name, None, "sensitivities", "", rule),))
    text_of("formulation", formulation)
    wanted = ANGLES if _has_angles(motion, formulation) else ANGLES[:1]
    chosen = plan(replace(scene, quantities=wanted, events=()), formulation)
    varied, turning = numbers(scene, chosen), _turning(motion)
    found = transition(varied, np.array([turning, turning + motion.period]))
    names = ("turning", "height", *wanted[1:])
    (before, _), (after, rate) = _observed(scene, varied, found, names)
    by_period = (before[0] - after[0]) / rate[0]
    turned = after - before + np.outer(rate, by_period)
    sizes = _sizes(scene, motion.period)
    error = _error(before * sizes, after * sizes, rate, motion.period)
    if not error < WORST:
        raise BadScene((Fault(scene.name, None, "formulation", formulation, _lost(error)),))
    inputs = [symbol.name for symbol in gradients.inputs(scene.start.held)]
    by_name = [dict(zip(inputs, row.tolist(), strict=True)) for row in (by_period, *turned[2:])]
    period, precession, spin = by_name if len(by_name) == 3 else (by_name[0], None, None)
    return Sensitivities(period, precession, spin, {x: UNITS[x] for x in inputs}, error)


def _has_angles(motion: Motion, formulation: str) -> bool:
    """Whether φ and ψ can be read off at a turning point."""
    rung = LADDER.get(formulation, LADDER["axis"])  # a wrong name is refused by the plan
    return "psi" in rung.gives and not motion.from_top == motion.from_bottom == 0


def _turning(motion: Motion) -> float:
    """The first time of the turning point that is farther from the poles [s]."""
    form = motion.exact
    assert form.lower_turning is not None
    assert form.period is not None
    one, other = (abs(form.ctx.sin(tilt)) for tilt in form.tilts)
    later = 0 if one >= other else form.period / 2
    return float((form.lower_turning + later) % form.period)


def _sizes(scene: Scene, period: float) -> Array:
    """What counts as 1 in each x: the moments themselves, A/T² for gMR, 1 rad, and 1/T."""
    A, C = float(scene.top.A), float(scene.top.C)
    return np.array([A, C, A / period**2, 1, *[1 / period] * 3])


def _error(before: Array, after: Array, rate: Array, period: float) -> float:
    """The estimated relative error of dT/dx, from derivatives by x in its natural size.

    cos θ must come back by itself, with what the period adds at its small rate; and in a tiny
    nutation T is the quotient of two small numbers.
    """
    by_period = (before[0] - after[0]) / rate[0]
    left = abs(after[1] - before[1] + rate[1] * by_period).max() / max(abs(before[1]).max(), 1)
    late = max(abs(before[0]).max(), abs(after[0]).max()) / abs(rate[0])
    return float(max(left, ROUNDING) * max(late / max(abs(by_period).max(), period), 1))


def _lost(error: float) -> str:
    kept = "beside a pole the axis form keeps them, in a tiny nutation none does"
    return f"loses its digits here, all but {error:.0e} of the period's derivatives; {kept}"


def _observed(
    scene: Scene, varied: Numbers, found: Transition, names: tuple[str, ...]
) -> Iterator[tuple[Array, Array]]:
    """At each time, of what is named: derivatives by what the scene gives (m, x), and by time."""
    form, constants = varied.formulation, varied.constants
    rows = gradients.start_gradient(form, scene.start.held)
    start = at_start(scene, (x for row in rows for x in row)).reshape(len(rows), -1)
    by_state, by_parameter = np.split(start, [varied.state.size])
    in_equations = [p.name in found.parameters for p in form.parameters]
    fixed = [constants[p.name] for p in (*form.parameters, *form.given)]
    gradient = gradients.observed_gradient(form, names)
    for i, t in enumerate(found.times):
        moved = found.matrix[i] @ by_state + found.by_parameters[i] @ by_parameter[in_equations]
        here = np.array(gradient(*found.states[i], *fixed, t), dtype=np.float64)
        yield here[:, :-1] @ np.concatenate((moved, by_parameter)), here[:, -1]
