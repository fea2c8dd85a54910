"""How a motion changes with the top and with its start, and how well that is known.

Everything is integrated, from the variational equations; no closed form is differentiated. What is
integrated twice, in two kinds of numbers, tells by how far it is apart how far it is off.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.analytic.motion import Motion
from heavytop.equations import gradients
from heavytop.equations.formulation import FORMULATIONS
from heavytop.equations.lambdify import exact_texts
from heavytop.errors import DoubtfulWarning, EndedEarly, Impossible, Outcome
from heavytop.integration.bits import DOUBLE, digits_of, enough
from heavytop.integration.compiled import VariedRun, rounded
from heavytop.numbers import Exact
from heavytop.numbers.decimals import context
from heavytop.run.estimates import periods_of
from heavytop.run.planning import (
    EPSILON,
    Plan,
    closed_form_of,
    plan_steps,
    planned,
    refusal,
    rounded_start,
    span,
    start_values,
)
from heavytop.run.trajectory import times_of
from heavytop.scene.arguments import text_of
from heavytop.scene.quantities import Need, need_of
from heavytop.scene.scene import Scene

Array = NDArray[np.float64]
Rates = Mapping[str, float]

UNITS: Mapping[str, str] = {
    **dict.fromkeys(("A", "C"), "kg m^2"),
    "gMR": "kg m^2 s^-2",
    "theta": "rad",
    **dict.fromkeys(("thetadot", "phidot", "psidot", "omega3"), "rad/s"),
}
SPINS: Final = ("psidot", "omega3")  # of which a scene gives one

FINER: Final = enough(DOUBLE + 1)  # bits
PRECISE: Final = (128, 192, 256)  # bits
DOUBTFUL: Final = 1e-8  # an error of derivatives
LINEAR: Final = 0.1  # where two runs are farther apart, neither may have any digits
CHANCE: Final = 32.0
LEAST: Final = 1e-3  # of its natural size, beside which errors of a smaller derivative count
FAR: Final = 0.01  # rad
MOST_STEPS: Final = 100_000  # beside a pole, in a form that is singular there
MOST_PERIODS: Final = 1e6  # which take some minutes


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

    Accuracy: ``tests/run/test_sensitivities.py`` holds them to 1e-12 of the closed form's.

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
        raise refusal(scene, "sensitivities", "", rule)
    entry = FORMULATIONS.get(text_of("formulation", formulation), FORMULATIONS["axis"])
    angles = entry.gives >= Need.PSI and not motion.from_top == motion.from_bottom == 0
    wanted = ("theta", "phi", "psi")[: 3 if angles else 1]
    one = replace(scene, time=None, periods=Exact.of(1), digits=12, quantities=wanted, events=())
    chosen = planned(one, motion, formulation)
    most_steps = _most_steps(motion, chosen)
    sizes, natural = _sizes(scene, motion.period), np.array([[motion.period], [1.0], [1.0]])
    coarse, known = np.full((len(wanted), sizes.size), np.nan), DOUBLE
    for bits in (DOUBLE, FINER, *(() if most_steps else PRECISE)):
        fine = _slopes(one, motion, chosen, most_steps, bits)
        scale = np.maximum(abs(fine * sizes), LEAST * natural[: len(wanted)])
        gap = abs((fine - coarse) * sizes).max(axis=1, keepdims=True)  # by chance one may be none
        error = _likely_error((gap / scale).max(), 0 if most_steps else bits - known)
        coarse, known = fine, bits
        if error < DOUBTFUL:
            break
    else:
        lost = f"loses its digits here: in more and more bits it is still off by {error:.0e}"
        kept = "the attitude form keeps the most of them, also beside both poles"
        raise refusal(scene, "formulation", formulation, f"{lost}; {kept}")
    names = _given(scene)
    period, *turned = (dict(zip(names, row.tolist(), strict=True)) for row in fine)
    precession, spin = turned or (None, None)
    units = {x: UNITS[x] for x in names}
    return Sensitivities(period, precession, spin, units, float(error))


@dataclass(frozen=True, slots=True, eq=False)
class Transition:
    """The state-transition matrix along a motion.

    Attributes
    ----------
    times : ndarray, shape (k,)
        Times since the start [s].
    names : tuple of n str
        The states of the formulation.
    parameters : tuple of p str
        The parameters in its equations; a parameter is a function of A, C, gMR and the start.
    states : ndarray, shape (k, n)
        The states themselves, integrated beside their derivatives.
    matrix : ndarray, shape (k, n, n)
        d state(t) / d state(0), at fixed parameters.
    by_parameters : ndarray, shape (k, n, p)
        d state(t) / d parameter, at fixed state(0).
    error : ndarray, shape (k,)
        The likely error of states, and of each column of matrix and by_parameters [of its largest
        entry]: 32 times what is expected of this run, in long doubles, from how far one in doubles
        is off it. It is not a bound. Beside a pole a form that is singular there is not expected to
        be any better in long doubles. (A column of by_parameters counts as a thousandth of the
        largest at least, each times its parameter: some are zero but for rounding.)
    """

    times: Array
    names: tuple[str, ...]
    parameters: tuple[str, ...]
    states: Array
    matrix: Array
    by_parameters: Array
    error: Array

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Eigenvalues of the matrix at each time, shape (k, n), after a period Floquet's."""
        return np.linalg.eigvals(self.matrix).astype(np.complex128)


def state_transition(
    scene: Scene, formulation: str = "axis", t: ArrayLike | None = None
) -> Transition:
    """Return the state-transition matrix along the motion of a scene, and how far to trust it.

    Parameters
    ----------
    scene : Scene
        Its quantities decide whether angles are among the states, as in `propagate`.
    formulation : str
        The name of a formulation.
    t : array_like, optional
        Times since the start, of either sign, in any order [s]; by default the scene's samples.

    Returns
    -------
    Transition
        Matrices of shape (k, n, n) for k times and n states.

    Raises
    ------
    BadScene
        The scene wants what the formulation cannot give, or there is no such formulation.
    NotANumber, Impossible
        A time is not a finite number, or farther off than a million nutation periods;
        of what does not nutate, turns.
    EndedEarly
        The equations are singular on the way, or take 100 000 steps beside a pole where they are
        nearly so; its `trajectory` is the `Transition` up to there.

    Warns
    -----
    DoubtfulWarning
        At a time the error is larger than 1e-8: the motion makes rounding grow.

    Notes
    -----
    It is integrated in doubles and again in long doubles; the second is given, rounded to doubles.

    Accuracy: ``tests/run/test_sensitivities.py`` holds every column to 1e-12 of its largest
    entry, over a period, against the closed form; ``validation/15_sensitivities.py`` measures how
    that grows, and what sharing its step control with the matrix costs the state.

    References
    ----------
    As of `heavytop.sensitivities`.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> kicked = load_scene("sicm-kicked", ["want.quantities=['theta']"])
    >>> found = state_transition(kicked, t=[0.5])
    >>> found.names
    ('e_x', 'e_y', 'e_z', 'l_x', 'l_y')
    >>> found.parameters, found.matrix.shape, round(float(np.linalg.det(found.matrix[0])), 12)
    (('g', 'l_z'), (1, 5, 5), 1.0)
    """
    motion = closed_form_of(scene)
    nothing = need_of(scene.quantities) is Need.NOTHING
    wanted = replace(scene, quantities=("theta",)) if nothing else scene
    chosen = plan_steps(wanted, formulation)
    times = np.linspace(0.0, span(scene, motion), scene.samples) if t is None else _times(motion, t)
    most_steps = _most_steps(motion, chosen)
    run = varied_run(scene, chosen)
    coarse = run(times, most_steps)
    there = np.isfinite(coarse[:, 0, 0])  # farther, long doubles would creep up to a pole
    fine = varied_run(scene, chosen, FINER)(times[there], most_steps).astype(np.float64)
    apart = _apart(coarse[there], fine, np.array([run.constants[p] for p in run.parameters]))
    error = _likely_error(apart, 0 if most_steps else FINER - DOUBLE)
    reached = np.isfinite(error)
    there[there] = reached
    names = tuple(s.name for s in run.formulation.states)
    states, matrix, by_parameters = np.split(fine[reached], [1, 1 + len(names)], axis=2)
    found = Transition(
        times[there], names, run.parameters, states[:, :, 0], matrix, by_parameters, error[reached]
    )
    if not there.all():
        raise EndedEarly(Outcome.SINGULAR, found)
    if (found.error > DOUBTFUL).any():
        worst = found.error.argmax()
        told = f"off by {found.error[worst]:.1e} of a column at t = {found.times[worst]:.6g} s"
        said = f"state_transition: digits are lost, by rounding that grows with the motion: {told}"
        warnings.warn(said, DoubtfulWarning, stacklevel=2)
    return found


def varied_run(scene: Scene, chosen: Plan, bits: int = DOUBLE) -> VariedRun:
    """A plan's run with its variational equations, every number rounded once from the exact one."""
    constants, state = rounded_start(chosen, start_values(scene), context(digits_of(bits)))
    known = dict(zip(constants, rounded(constants.values(), bits), strict=True))
    # angles that are read off and counted are not varied
    return VariedRun(chosen.integrated, known, rounded(state, bits), bits)


def at_start(scene: Scene, chosen: Plan, expressions: Iterable[Any], bits: int = DOUBLE) -> Array:
    """The values at the start of a plan's run, each rounded once from the exact one."""
    frame = {name: Exact.of(rate) for name, rate in chosen.frame}
    ctx = context(digits_of(bits))
    return rounded(exact_texts(tuple(expressions), _start(scene) | frame, ctx), bits)


def _start(scene: Scene) -> dict[str, Exact]:
    return start_values(scene) | {"omega3": scene.start.omega3}


def _given(scene: Scene) -> tuple[str, ...]:
    """The names of the numbers that a scene gives, with the spin that it holds."""
    return tuple(x for x in UNITS if x == scene.start.held or x not in SPINS)


# --- the derivatives of a period ---------------------------------------------------------------


def _slopes(scene: Scene, motion: Motion, chosen: Plan, most_steps: int, bits: int) -> Array:
    """The derivatives of T, and of what φ and ψ turn in it, if the scene wants them."""
    run, times = varied_run(scene, chosen, bits), _turnings(motion, digits_of(bits))
    form, found = run.formulation, run(times, most_steps)
    if np.isnan(found[:, 0, 0].astype(np.float64)).any():
        raise EndedEarly(Outcome.SINGULAR, None)
    gradient = gradients.start_gradient(form, _given(scene))
    start = at_start(scene, chosen, chain(*gradient), bits).reshape(len(gradient), -1)
    by_state, by_parameter = np.split(start, [len(form.states)])
    used = [p.name in run.parameters for p in form.parameters]
    begun = np.concatenate((by_state, by_parameter[used]))
    slopes = gradients.observed_gradient(form, angles="psi" in scene.quantities)
    ends = []
    for here, t in zip(found, rounded(times, bits), strict=True):
        rows = np.array(slopes(*here[:, 0], *run.constants.values(), t), dtype=start.dtype)
        moved = np.concatenate((here[:, 1:] @ begun, by_parameter))
        ends.append((rows[:, :-1] @ moved, rows[:, -1]))
    (before, _), (after, rate) = ends
    by_period = (before[0] - after[0]) / rate[0]
    turned = after[1:] - before[1:] + np.outer(rate[1:], by_period)
    return np.vstack((by_period, turned)).astype(np.float64)


def _turnings(motion: Motion, digits: int) -> tuple[str, str]:
    """The first time [s] of the turning point that is farther from the poles, and the next."""
    form: Any = motion.form(digits)
    one, other = (abs(form.ctx.sin(tilt)) for tilt in form.tilts)
    first = (form.lower_turning + (0 if one >= other else form.period / 2)) % form.period
    return form.ctx.nstr(first, digits), form.ctx.nstr(first + form.period, digits)


def _sizes(scene: Scene, period: float) -> Array:
    """The natural size of each x: its own; 1 rad; of gMR and rates at least A/T² and 1/T."""
    least = {"A": 0.0, "C": 0.0, "gMR": float(scene.top.A) / period**2, "theta": 0.0}
    own = _start(scene) | {"theta": 1}
    return np.array([max(abs(float(own[x])), least.get(x, 1 / period)) for x in _given(scene)])


# --- how far to trust them ---------------------------------------------------------------------


def _apart(coarse: Array, fine: Array, parameters: Array) -> Array:
    """At each time the largest difference in a column, relative to its size."""
    size, gap = abs(fine).max(axis=1), abs(coarse - fine).max(axis=1)
    own, by = abs(parameters), size[:, size.shape[1] - parameters.size :]
    # a column that is zero but for rounding counts beside the others
    least = LEAST * (by * own).max(axis=1, keepdims=True, initial=0.0)
    by[:] = np.maximum(by, least / np.where(own == 0, np.inf, own))
    return (gap / np.where(size == 0, 1, size)).max(axis=1)  # type: ignore[no-any-return]


def _most_steps(motion: Motion, chosen: Plan) -> int:
    """How many steps a run may take; 0, which is any number, where more bits surely help it.

    In a form beside a pole where it is singular p_phi and p_psi may differ by less than either
    precision tells, and both lose the same.
    """
    far = min(motion.from_top, motion.from_bottom) > FAR
    return 0 if far or chosen.equations.starts_at_pole else MOST_STEPS


def _likely_error(apart: Any, gained: int) -> Array:
    """Return the likely error of the finer of two runs, from how far they are apart, relative.

    As long as some digits are left in both, it is less by as many bits as were gained; chance may
    make either error smaller or larger, for which there is a factor.
    """
    found: Array = np.where(apart < LINEAR, np.ldexp(CHANCE, -gained), 1.0) * apart
    return np.maximum(found, EPSILON)


def _times(motion: Motion, t: ArrayLike) -> Array:
    """Times in a row, if none would take hours, or for ever."""
    times = np.atleast_1d(times_of(t))
    each = periods_of(motion, 1.0)
    if times.size and abs(times).max() * each > MOST_PERIODS:
        rule = f"at most {MOST_PERIODS / each:.3g} s here, a million nutation periods"
        raise Impossible([("t", rule)])
    return times
