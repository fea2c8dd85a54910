"""How the period, and what turns in it, changes with the top and its start.

Everything is integrated, from the variational equations; no closed form is differentiated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.equations import gradients
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import BadScene, EndedEarly, Fault, Outcome
from heavytop.integration.bits import DOUBLE
from heavytop.integration.variational import rounded, variational
from heavytop.numbers import Exact
from heavytop.numbers.decimals import Number
from heavytop.run.planning import Plan, closed_form_of, planned
from heavytop.run.transition import (
    FINER,
    LEAST,
    MOST_STEPS,
    Transition,
    at_start,
    digits_of,
    gains,
    integrated,
    likely_error,
    numbers,
    state_transition,
)
from heavytop.scene.arguments import text_of
from heavytop.scene.scene import Scene

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
ONE: Final = Exact.of(1)
PRECISE: Final = (128, 192, 256)  # bits
WORST: Final = 1e-8


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
        The likely error of the worst of them: 32 times what is expected of the finer of two runs
        from how far they are apart, in the worst derivative of T, of Δφ or of Δψ by an x in its
        natural size. It is relative to the derivative, or to a thousandth of T or 1 rad if that is
        larger, for a change of x by its own size (of θ by 1 rad; of gMR and of a rate at least by
        A/T² and 1/T). It is not a bound.
    """

    period: Rates
    precession: Rates | None
    spin: Rates | None
    units: Mapping[str, str]
    error: float


def sensitivities(scene: Scene, formulation: str = "attitude") -> Sensitivities:
    """Return the derivatives of T, Δφ, Δψ by all that a scene gives, to eight digits or better.

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
        Nothing nutates; there is no such formulation, it cannot start at the scene's pole, or its
        digits are lost: the error would be above 1e-8.
    EndedEarly
        The formulation is singular on the way, at a pole, or takes 100 000 steps beside one.

    Notes
    -----
    With g the function whose zeros are the turning points and t₁ the time of one, g returns to
    its value after a period, whatever x is: g(t₁ + T; x) = g(t₁; x), so

        dT/dx = (∂g(t₁)/∂x − ∂g(t₁ + T)/∂x) / ġ,
        dΔφ/dx = ∂φ(t₁ + T)/∂x − ∂φ(t₁)/∂x + φ̇ dT/dx.

    Of the two turning points the one farther from the poles is taken. Everything is integrated in
    doubles and in long doubles; where the error is above 1e-8, in 128 to 256 bits too, which
    takes seconds, and a minute where the top nods slowly; not beside a pole in a form that is
    singular there, which takes too many steps. Where the axis passes
    exactly through a pole, Δφ jumps by 2π from one side of it to the other; its derivatives do not.

    Accuracy: ``tests/two_ways/test_sensitivity.py`` holds them to 1e-12 of the closed form's.

    References
    ----------
    Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, section I.14, for the
    variational equations.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
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
    one = replace(scene, time=None, periods=ONE, digits=12, quantities=wanted, events=())
    chosen = planned(one, motion, formulation)
    sizes, natural = _sizes(scene, motion.period), np.array([[motion.period], [1.0], [1.0]])
    coarse, known = np.full((len(wanted), sizes.size), np.nan), DOUBLE
    more = gains(motion, formulation)
    for bits in (DOUBLE, FINER, *(PRECISE if more else ())):
        fine = _slopes(scene, motion, chosen, wanted[1:], bits)
        scale = np.maximum(abs(fine * sizes), LEAST * natural[: len(wanted)])
        gap = abs((fine - coarse) * sizes).max(axis=1, keepdims=True)  # by chance one may be none
        error = likely_error((gap / scale).max(), (bits - known) * more)
        coarse, known = fine, bits
        if error < WORST:
            break
    else:
        raise BadScene((Fault(scene.name, None, "formulation", formulation, _lost(float(error))),))
    inputs = [symbol.name for symbol in gradients.inputs(scene.start.held)]
    by_name = [dict(zip(inputs, row.tolist(), strict=True)) for row in fine]
    period, precession, spin = by_name if len(by_name) == 3 else (by_name[0], None, None)
    units = {x: UNITS[x] for x in inputs}
    return Sensitivities(period, precession, spin, units, float(error))


def _slopes(
    scene: Scene, motion: Motion, chosen: Plan, angles: tuple[str, ...], bits: int
) -> Array:
    """The derivatives of T and of what the angles turn in it, in numbers of so many bits."""
    times = _turnings(motion, digits_of(bits))
    (before, _), (after, rate) = _observed(scene, motion, chosen, ("turning", *angles), times, bits)
    by_period = (before[0] - after[0]) / rate[0]
    turned = after[1:] - before[1:] + np.outer(rate[1:], by_period)
    return np.vstack((by_period, turned)).astype(np.float64)


def _has_angles(motion: Motion, formulation: str) -> bool:
    """Whether φ and ψ can be read off at a turning point."""
    entry = FORMULATIONS.get(formulation, FORMULATIONS["axis"])  # the plan refuses a wrong name
    return "psi" in entry.gives and not motion.from_top == motion.from_bottom == 0


def _turnings(motion: Motion, digits: int) -> tuple[str, str]:
    """The first time [s] of the turning point that is farther from the poles, and the next."""
    form = motion.form(digits)
    assert form.lower_turning is not None
    assert form.period is not None
    one, other = (abs(form.ctx.sin(tilt)) for tilt in form.tilts)
    first: Number = (form.lower_turning + (0 if one >= other else form.period / 2)) % form.period
    return form.ctx.nstr(first, digits), form.ctx.nstr(first + form.period, digits)


def _sizes(scene: Scene, period: float) -> Array:
    """The natural size of each x: its own; 1 rad; of gMR and rates at least A/T² and 1/T."""
    top, start = scene.top, scene.start
    A, C, gMR = float(top.A), float(top.C), abs(float(top.gMR))
    given = (start.thetadot, start.phidot, getattr(start, start.held))
    rates = [max(abs(float(rate)), 1 / period) for rate in given]
    return np.array([A, C, max(gMR, A / period**2), 1, *rates])


def _lost(error: float) -> str:
    kept = "the attitude form keeps the most of them, also beside both poles"
    return f"loses its digits here: in more and more bits it is still off by {error:.0e}; {kept}"


def _observed(
    scene: Scene,
    motion: Motion,
    chosen: Plan,
    names: tuple[str, ...],
    times: tuple[str, ...],
    bits: int,
) -> Iterator[tuple[Array, Array]]:
    """At each time, of what is named: derivatives by what the scene gives (m, x), and by time."""
    varied = numbers(scene, chosen, bits)
    limit = 0 if gains(motion, chosen.formulation) else MOST_STEPS
    form, found = varied.formulation, integrated(varied, times, limit)
    if not found.reached.all():
        raise EndedEarly(Outcome.SINGULAR, None)
    rows = gradients.start_gradient(form, scene.start.held)
    start = at_start(scene, (x for row in rows for x in row), bits).reshape(len(rows), -1)
    by_state, by_parameter = np.split(start, [len(form.states)])
    by = variational(form, bits).parameters
    in_equations = [p.name in by for p in form.parameters]
    fixed = [varied.constants[p.name] for p in (*form.parameters, *form.given)]
    gradient = gradients.observed_gradient(form, names)
    for i, t in enumerate(rounded(times, bits)):
        moved = found.matrix[i] @ by_state + found.by_parameters[i] @ by_parameter[in_equations]
        here = np.array(gradient(*found.states[i], *fixed, t), dtype=start.dtype)
        yield here[:, :-1] @ np.concatenate((moved, by_parameter)), here[:, -1]
