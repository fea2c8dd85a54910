"""The state-transition matrix: how the state at a time changes with the state at the start."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.analytic.motion import Motion
from heavytop.equations.formulation import FORMULATIONS, Formulation
from heavytop.equations.lambdify import exact_values
from heavytop.errors import DoubtfulWarning, EndedEarly, Impossible, NotANumber, Outcome
from heavytop.integration.bits import DOUBLE, enough
from heavytop.integration.variational import Varied, rounded, variational
from heavytop.numbers.decimals import context
from heavytop.run.error_growth import fastest
from heavytop.run.planning import EPSILON, Plan, closed_form_of, planned, span, start_values
from heavytop.scene.scene import Scene

Array = NDArray[np.float64]
FINER: Final = enough(DOUBLE + 1)  # bits
SPARE_DIGITS: Final = 12
MOST_TURNS: Final = 1e6  # of the top, by its fastest rate: some minutes
DOUBTFUL: Final = 1e-8
LINEAR: Final = 0.1  # where two runs are farther apart, neither may have any digits
CHANCE: Final = 32.0
FAR: Final = 0.01  # rad
MOST_STEPS: Final = 100_000  # beside a pole, in a form that is singular there
LEAST: Final = 1e-3  # of its natural size, beside which errors of a smaller derivative count


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


@dataclass(frozen=True, slots=True)
class Numbers:
    """What is varied: a formulation, the constants of a run by name, and the state at its start."""

    formulation: Formulation
    constants: Mapping[str, Any]
    state: Array
    bits: int = DOUBLE


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
        A time is not a finite number, or farther off than a million turns of the top.
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

    Accuracy: ``tests/two_ways/test_sensitivity.py`` holds every column to 1e-12 of its largest
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
    chosen = planned(scene, motion, formulation)
    if t is None:
        times = np.linspace(0.0, span(scene, motion), scene.samples)
    else:
        times = _times(t)
        _expect_near(scene, times)
    varied, more = numbers(scene, chosen), gains(motion, formulation)
    most_steps = 0 if more else MOST_STEPS
    coarse = integrated(varied, times, most_steps)
    there = coarse.reached  # farther, long doubles would creep up to a pole
    fine = integrated(numbers(scene, chosen, FINER), times[there], most_steps)
    names = variational(varied.formulation, DOUBLE).parameters
    constants = np.array([varied.constants[name] for name in names], dtype=np.float64)
    error = likely_error(_apart(coarse.at(there), fine, constants), (FINER - DOUBLE) * more)
    reached = np.isfinite(error)
    there[there] = reached
    found = Transition(
        times=times[there],
        names=tuple(s.name for s in varied.formulation.states),
        parameters=names,
        states=fine.states[reached].astype(np.float64),
        matrix=fine.matrix[reached].astype(np.float64),
        by_parameters=fine.by_parameters[reached].astype(np.float64),
        error=error[reached],
    )
    if not there.all():
        raise EndedEarly(Outcome.SINGULAR, found)
    _warn(found)
    return found


def numbers(scene: Scene, chosen: Plan, bits: int = DOUBLE) -> Numbers:
    """Return the run's own numbers: every constant and state rounded once from the exact one."""
    form = chosen.equations
    form = form.integrated or form  # angles that are read off and counted are not varied
    values = at_start(scene, (*form.parameters.values(), *form.start), bits)
    names = [p.name for p in form.parameters]
    constants = dict(zip(names, values[: len(names)], strict=True))
    frame = zip(dict(chosen.frame), rounded(dict(chosen.frame).values(), bits), strict=True)
    return Numbers(form, constants | dict(frame), values[len(names) :], bits)


def integrated(varied: Numbers, times: Iterable[str | float], most_steps: int = 0) -> Varied:
    """Return states and derivatives at times since the start [s].

    They are nan at times that are not reached: before them the equations become singular, or too
    many steps (0 is any number) were needed.
    """
    form, bits = varied.formulation, varied.bits
    moments = rounded(times, bits)
    found = variational(form, bits).run(varied.state, varied.constants, moments, most_steps)
    if not form.starts_at_pole:  # theta, their first state, may have left its chart
        theta = found.states[:, 0].astype(np.float64)
        found.states[~((theta >= 0) & (theta <= np.pi))] = rounded([np.nan], bits)
    return found


def at_start(scene: Scene, expressions: Iterable[Any], bits: int = DOUBLE) -> Array:
    """Return the values at a scene's start, each rounded once from the exact one."""
    named = start_values(scene) | {"omega3": scene.start.omega3}
    ctx = context(digits_of(bits))
    values = (x.mpf(ctx) for x in exact_values(tuple(expressions), named))
    return rounded((ctx.nstr(x, ctx.dps) for x in values), bits)


def digits_of(bits: int) -> int:
    """Return the decimal digits of a text that is to be rounded to so many bits."""
    return int(bits * 0.30103) + SPARE_DIGITS


def _apart(coarse: Varied, fine: Varied, parameters: Array) -> Array:
    """Return at each time the largest difference in a column, relative to its size."""
    one, other = (
        np.concatenate((v.states[:, :, None], v.matrix, v.by_parameters), axis=2).astype(np.float64)
        for v in (coarse, fine)
    )
    size, gap = abs(other).max(axis=1), abs(one - other).max(axis=1)
    if parameters.any():  # a column that is zero but for rounding counts beside the others
        by = size[:, -parameters.size :]
        least = LEAST * (by * abs(parameters)).max(axis=1, keepdims=True)
        by[:] = np.maximum(by, least / np.where(parameters == 0, np.inf, abs(parameters)))
    return (gap / np.where(size == 0, 1, size)).max(axis=1)  # type: ignore[no-any-return]


def gains(motion: Motion, formulation: str) -> bool:
    """Return whether more bits surely help: not in a form beside a pole where it is singular.

    There p_phi and p_psi may differ by less than either precision tells, and both lose the same.
    """
    far = min(motion.from_top, motion.from_bottom) > FAR
    return far or FORMULATIONS[formulation].starts_at_pole


def likely_error(apart: Any, gained: int) -> Array:
    """Return the likely error of the finer of two runs, from how far they are apart, relative.

    As long as some digits are left in both, it is less by as many bits as were gained; chance may
    make either error smaller or larger, for which there is a factor.
    """
    found: Array = np.where(apart < LINEAR, np.ldexp(CHANCE, -gained), 1.0) * apart
    return np.maximum(found, EPSILON)


def _warn(found: Transition) -> None:
    worst = found.error.argmax() if found.error.size else 0
    if (found.error > DOUBTFUL).any():
        told = f"off by {found.error[worst]:.1e} of a column at t = {found.times[worst]:.6g} s"
        said = f"state_transition: digits are lost, by rounding that grows with the motion: {told}"
        warnings.warn(said, DoubtfulWarning, stacklevel=3)


def _expect_near(scene: Scene, times: Array) -> None:
    """Refuse times that would take hours, or for ever.

    Raises
    ------
    Impossible
    """
    start = {name: np.array([float(x)]) for name, x in start_values(scene).items()}
    turning = float(fastest(start)[0])
    farthest = MOST_TURNS * 2 * np.pi / turning if turning else np.inf
    if times.size and abs(times).max() > farthest:
        raise Impossible([("t", f"at most {farthest:.3g} s here, a million turns of the top")])


def _times(t: ArrayLike) -> Array:
    try:
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        raise NotANumber("t: times, in seconds") from None
    if times.ndim != 1 or not np.isfinite(times).all():
        raise NotANumber("t: finite times, in one row, in seconds")
    return times
