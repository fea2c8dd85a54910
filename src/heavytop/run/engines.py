"""The engine of a plan, compiled, and the numbers a run starts from."""

from __future__ import annotations

import time

import numpy as np

from heavytop.equations.formulation import FORMULATIONS, Formulation
from heavytop.equations.lambdify import exact_values
from heavytop.integration.counting import Counting
from heavytop.integration.engine import Engine
from heavytop.integration.integrator import Integrator, integrator
from heavytop.integration.legs import Projected
from heavytop.integration.orbit import Checkpoint
from heavytop.integration.projection import Projection
from heavytop.integration.turns import Turns
from heavytop.numbers import Exact
from heavytop.run.planning import EPSILON, Plan
from heavytop.scene.scene import Scene


def compiled_for(chosen: Plan) -> Integrator:
    """Return the compiled integrator of a plan."""
    form = formulation_of(chosen)
    tolerance = max(chosen.tolerance, EPSILON)  # more digits are the matter of `decimals`
    return integrator(form.integrated or form, chosen.watched, tolerance)


def formulation_of(chosen: Plan) -> Formulation:
    """Return the formulation of a plan, with the angles it counts."""
    return FORMULATIONS[chosen.formulation].build(chosen.variant)


def engine_of(
    chosen: Plan, compiled: Integrator, parameters: dict[str, float], start: Checkpoint
) -> Engine:
    """Return what takes the steps of a plan: the integrator, as it projects and counts turns."""
    form = formulation_of(chosen)
    engine: Engine = compiled
    if chosen.projected:
        state = start.state[: len(compiled.formulation.states)]
        engine = Projected(compiled, Projection.of(compiled.formulation, parameters, state))
    return engine if form.integrated is None else Counting(engine, form, Turns.of(parameters))


def compiled_and_timed(chosen: Plan) -> tuple[Integrator, float]:
    """Return the compiled integrator of a plan, and how long its equations took to derive [s]."""
    began = time.perf_counter()
    formulation_of(chosen)
    derive_s = time.perf_counter() - began
    return compiled_for(chosen), derive_s


def start_values(scene: Scene) -> dict[str, Exact]:
    """Return the exact numbers of a scene by the symbols of the Lagrangian."""
    top, start = scene.top, scene.start
    return {
        "A": top.A,
        "C": top.C,
        "gMR": top.gMR,
        "theta": start.theta,
        "phi": start.phi,
        "psi": start.psi,
        "thetadot": start.thetadot,
        "phidot": start.phidot,
        "psidot": start.psidot,
    }


def binary_start(scene: Scene, chosen: Plan) -> tuple[dict[str, float], Checkpoint]:
    """Return a run's own numbers: every constant and state rounded once from the exact one."""
    form = formulation_of(chosen)
    expressions = (*form.parameters.values(), *form.start)
    values = [float(v) for v in exact_values(expressions, start_values(scene))]
    count = len(form.parameters)
    parameters = {p.name: v for p, v in zip(form.parameters, values[:count], strict=True)}
    parameters |= dict(chosen.frame)
    state = np.array(values[count:])
    if form.integrated is not None:
        state[-2:] = Turns.of(parameters).started(state, *state[-2:].tolist())
    phi = float(scene.start.phi) if chosen.follows_phi else np.nan
    return parameters, Checkpoint((0.0, 0.0), state, phi, 0)
