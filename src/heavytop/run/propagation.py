"""From a scene to a trajectory."""

from __future__ import annotations

import os
import time

import numpy as np

from heavytop.equations.lambdify import exact_values
from heavytop.errors import BadScene, Fault
from heavytop.integration.compiled import Compiled, compiled
from heavytop.integration.integrator import Integrator
from heavytop.integration.orbit import Checkpoint, integrate
from heavytop.integration.turns import Turns
from heavytop.run.estimates import most_steps
from heavytop.run.finishing import Keeper, Progress, finished, in_decimals
from heavytop.run.planning import EPSILON, Plan, closed_form_of, planned, span, start_values
from heavytop.run.trajectory import Trajectory
from heavytop.run.verify import checked, forewarned
from heavytop.scene.arguments import heard, whole
from heavytop.scene.scene import Scene


def propagate(
    scene: Scene,
    *,
    formulation: str = "auto",
    projected: bool = False,
    progress: Progress | None = None,
    step_limit: int | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Trajectory:
    """Integrate a scene.

    Parameters
    ----------
    scene : Scene
        What is to be run.
    formulation : str
        ``auto`` (the least that gives what the scene wants) or the name of a formulation.
    projected : bool
        Whether to put the state back onto the invariants of the start, between blocks of steps:
        for long runs, whose phase is then lost as the square root of the time.
    progress : callable, optional
        Called with the fraction done, after each block of steps.
    step_limit : int, optional
        Steps after which to give up; checked between blocks. By default a million, and a thousand
        for each nutation, which only a form that is singular at a pole ever takes.
    checkpoint : path, optional
        A file in which the trajectory so far is saved every ten seconds, or at longer intervals
        where saving takes long. `load_trajectory` reads it, whatever ended the run.

    Returns
    -------
    Trajectory

    Raises
    ------
    BadScene
        The scene wants what the formulation cannot give.
    EndedEarly
        A singularity, the step limit or an interrupt; it carries the partial trajectory.
    OSError
        `checkpoint` cannot be written.

    Warns
    -----
    MissedDigitsWarning
        Wanted quantities are farther off the closed form than the scene's digits allow.
    DoubtfulWarning
        Events are miscounted, or something else is beyond the precision.
    UnboundedAngleWarning
        In the Lagrangian form, where phi and psi grow in the state of a long run.

    Notes
    -----
    Accuracy: ``tests/analytic/test_book.py`` holds theta, phi, psi of the book's scenes at 2 s
    to 1e-12 of the exact solution.

    References
    ----------
    Jorba & Zou, "A software package for the numerical integration of ODEs by means of high-order
    Taylor methods", *Experimental Mathematics* 14 (2005), for order and step; Biscani & Izzo,
    "Revisiting high-order Taylor methods for astrodynamics and celestial mechanics", *Monthly
    Notices of the Royal Astronomical Society* 504 (2021), for heyoka.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> trajectory = propagate(load_scene("sicm-dropped"))
    >>> trajectory.events.count("cusp")
    5
    """
    step_limit = None if step_limit is None else whole("step_limit", step_limit, 1)
    heard("progress", progress)
    motion = closed_form_of(scene)
    chosen = planned(scene, motion, formulation, projected)
    if chosen.formulation == "none":
        raise _nothing_to_integrate(scene)
    if chosen.folded:
        raise _better_folded(scene, chosen)
    forewarned(chosen)
    end = span(scene, motion)
    began = time.perf_counter()
    _ = chosen.equations
    derive_s = time.perf_counter() - began
    equations = compiled_for(chosen)
    parameters, start = binary_start(scene, chosen)
    samples = np.linspace(0.0, end, scene.samples)
    keeper = Keeper.of(checkpoint, scene, motion, chosen)
    began = time.perf_counter()
    orbit = integrate(
        integrator_of(chosen, equations, parameters, start),
        start,
        samples,
        on_block=progress if chosen.precision == "double" else None,
        step_limit=step_limit or most_steps(motion, end),
        keep=keeper,
    )
    spent = time.perf_counter() - began
    if keeper is not None:
        keeper.at_last(orbit)
    trajectory = finished(scene, motion, chosen, orbit, derive_s, spent)
    if chosen.precision != "double":
        trajectory = in_decimals(trajectory, progress)
    return checked(trajectory)


def compiled_for(chosen: Plan) -> Compiled:
    """Return the compiled equations of a plan."""
    form = chosen.equations
    tolerance = max(chosen.tolerance, EPSILON)  # more digits are the matter of `decimals`
    return compiled(form.integrated or form, chosen.watched, tolerance)


def integrator_of(
    chosen: Plan, equations: Compiled, parameters: dict[str, float], start: Checkpoint
) -> Integrator:
    """Return what takes the steps of a plan's run from a start."""
    return Integrator.of(
        chosen.equations,
        equations,
        parameters,
        start.state,
        projected=chosen.projected,
        follows_phi=chosen.follows_phi,
    )


def binary_start(scene: Scene, chosen: Plan) -> tuple[dict[str, float], Checkpoint]:
    """Return a run's own numbers: every constant and state rounded once from the exact one."""
    form = chosen.equations
    expressions = (*form.parameters.values(), *form.start)
    values = [float(v) for v in exact_values(expressions, start_values(scene))]
    parameters = {p.name: v for p, v in zip(form.parameters, values, strict=False)}
    parameters |= dict(chosen.frame)
    state = np.array(values[len(form.parameters) :])
    if form.integrated is not None:
        state[-2:] = Turns.of(parameters).started(state, *state[-2:].tolist())
    phi = float(scene.start.phi) if chosen.follows_phi else np.nan
    return parameters, Checkpoint((0.0, 0.0), state, phi, 0)


def _nothing_to_integrate(scene: Scene) -> BadScene:
    rule = "class and period need no integration: heavytop.classify and heavytop.Motion have them"
    wants = ", ".join(scene.quantities)
    return BadScene((Fault(scene.name, None, "want.quantities", wants, rule),))


def _better_folded(scene: Scene, chosen: Plan) -> BadScene:
    rule = "a span to be folded: heavytop.fold answers; a formulation by name integrates it"
    key = "span.time" if scene.periods is None else "span.periods"
    value = str(scene.time if scene.periods is None else scene.periods)
    return BadScene((Fault(scene.name, None, key, value, rule, chosen.reasons[-1]),))
