"""The state-transition matrix: how the state at a time changes with the state at the start."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.engines import formulation_of, start_values
from heavytop.errors import EndedEarly, NotANumber, Outcome
from heavytop.models import gradients
from heavytop.models import lagrangian as lag
from heavytop.models.formulation import Formulation
from heavytop.models.numeric import exact_values
from heavytop.planning import EPSILON, Plan, closed_form_of, plan, span
from heavytop.scene import Scene
from heavytop.taylor.variational import variational

Array = NDArray[np.float64]


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
    """

    times: Array
    names: tuple[str, ...]
    parameters: tuple[str, ...]
    states: Array
    matrix: Array
    by_parameters: Array

    @property
    def multipliers(self) -> NDArray[np.complex128]:
        """Eigenvalues of the matrix at each time, shape (k, n), after a period Floquet's."""
        return np.linalg.eigvals(self.matrix).astype(np.complex128)


@dataclass(frozen=True, slots=True)
class Numbers:
    """What is varied: a formulation, the constants of a run by name, and the state at its start."""

    formulation: Formulation
    constants: Mapping[str, float]
    state: Array


def state_transition(
    scene: Scene, formulation: str = "axis", t: ArrayLike | None = None
) -> Transition:
    """Return the state-transition matrix along the motion of a scene, in double precision.

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
    NotANumber
        A time is not a finite number.
    EndedEarly
        The equations are singular on the way; its `trajectory` is the `Transition` up to there.

    Notes
    -----
    Accuracy: ``tests/two_ways/test_sensitivity.py`` holds every column to 1e-12 of its largest
    entry, over a period, against the closed form; ``validation/15_sensitivities.py`` measures how
    that grows, and what sharing its step control with the matrix costs the state.

    References
    ----------
    As of `heavytop.sensitivities`.

    Examples
    --------
    >>> from heavytop.scene import load_scene
    >>> kicked = load_scene("sicm-kicked", ["want.quantities=['theta']"])
    >>> found = state_transition(kicked, t=[0.5])
    >>> found.names
    ('e_x', 'e_y', 'e_z', 'l_x', 'l_y')
    >>> found.parameters, found.matrix.shape, round(float(np.linalg.det(found.matrix[0])), 12)
    (('g', 'l_z'), (1, 5, 5), 1.0)
    """
    chosen = plan(scene, formulation)
    if t is None:
        times = np.linspace(0.0, span(scene, closed_form_of(scene)), scene.samples)
    else:
        times = _times(t)
    return transition(numbers(scene, chosen), times)


def numbers(scene: Scene, chosen: Plan) -> Numbers:
    """Return the run's own numbers: every constant and state rounded once from the exact one."""
    form = formulation_of(chosen)
    form = form.integrated or form  # angles that are read off and counted are not varied
    values = at_start(scene, (*form.parameters.values(), *form.start))
    names = [p.name for p in form.parameters]
    constants = dict(zip(names, values[: len(names)].tolist(), strict=True))
    return Numbers(form, constants | dict(chosen.frame), values[len(names) :])


def at_start(scene: Scene, expressions: Iterable[Any]) -> Array:
    """Return the values at a scene's start, each rounded once from the exact one."""
    named = start_values(scene) | {"omega3": scene.start.omega3}
    symbols = (*gradients.inputs("psidot"), *gradients.inputs("omega3"), lag.phi, lag.psi)
    known = {symbol: named[symbol.name] for symbol in symbols}
    return np.array([float(x) for x in exact_values(tuple(expressions), known)])


def transition(varied: Numbers, times: Array) -> Transition:
    """Return the state-transition matrix at times since the start [s].

    Raises
    ------
    EndedEarly
        The equations are singular on the way.
    """
    form = varied.formulation
    engine = variational(form, EPSILON)
    found = engine.run(varied.state, varied.constants, times)
    there = np.isfinite(found.states).all(axis=1)
    if not form.starts_at_pole:  # theta, their first state, may have left its chart
        there &= (found.states[:, 0] >= 0) & (found.states[:, 0] <= np.pi)
    reached = Transition(
        times=times[there],
        names=tuple(s.name for s in form.states),
        parameters=engine.parameters,
        states=found.states[there],
        matrix=found.matrix[there],
        by_parameters=found.by_parameters[there],
    )
    if not there.all():
        raise EndedEarly(Outcome.SINGULAR, reached)
    return reached


def _times(t: ArrayLike) -> Array:
    try:
        times = np.atleast_1d(np.asarray(t, dtype=np.float64))
    except (TypeError, ValueError, OverflowError):
        raise NotANumber("t: times, in seconds") from None
    if times.ndim != 1 or not np.isfinite(times).all():
        raise NotANumber("t: finite times, in one row, in seconds")
    return times
