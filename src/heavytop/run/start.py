"""Where a run begins: its own numbers, each rounded once from the exact one of the scene."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import Rounded, exact_texts
from heavytop.exact import Exact
from heavytop.exact.decimals import context
from heavytop.exact.pairs import EPSILON
from heavytop.integration.bits import DOUBLE, bits_of, digits_of
from heavytop.integration.blocks import Checkpoint, Integrator
from heavytop.integration.engine import engine
from heavytop.integration.library import hy
from heavytop.run.plan import Plan
from heavytop.scene.scene import Scene


def start_values(scene: Scene) -> dict[str, Exact]:
    """The exact numbers of a scene by the symbols of the Lagrangian."""
    of_top = {name: getattr(scene.top, name) for name in ("A", "C", "gMR")}
    names = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")
    return of_top | {name: getattr(scene.start, name) for name in names}


def integrator_of(chosen: Plan, constants: dict[str, Any], start: Checkpoint) -> Integrator:
    """Return what takes the steps of a plan's run from a start."""
    bits = bits_of(chosen.precision)
    watched, tolerance = (chosen.watched, chosen.tolerance) if bits == DOUBLE else ((), EPSILON)
    found = engine(chosen.equations, watched, tolerance, bits)
    return Integrator(found, constants, start.state, projected=chosen.projected)


def binary_start(scene: Scene, chosen: Plan) -> tuple[dict[str, Any], Checkpoint]:
    """Return a run's own numbers: every constant and state rounded once from the exact one."""
    form, bits, numbers = chosen.equations, bits_of(chosen.precision), start_values(scene)
    frame: dict[str, Any] = dict(chosen.frame)
    if bits == DOUBLE:
        values, zero, kind = _own_numbers(form)(numbers), 0.0, float
    else:
        texts = exact_texts(
            (*form.parameters.values(), *form.start), numbers, context(digits_of(bits))
        )
        values, zero = [hy.real(x, bits) for x in texts], hy.real(0, bits)
        frame, kind = {name: hy.real(rate, bits) for name, rate in frame.items()}, hy.real
    constants = {p.name: v for p, v in zip(form.parameters, values, strict=False)} | frame
    state = np.array(values[len(form.parameters) :], kind)
    return constants, Checkpoint((zero, zero), state, 0)


@cache
def _own_numbers(form: Formulation) -> Rounded:
    """Return the constants and the start of a formulation, as functions of a scene's numbers."""
    return Rounded((*form.parameters.values(), *form.start))
