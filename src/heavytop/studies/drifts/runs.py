"""A run of a drift study: one method from one start, with the yardstick of its own numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from heavytop.comparison.steppers import Stepper
from heavytop.errors import BadScene, Fault
from heavytop.integration.bits import DOUBLE, named
from heavytop.integration.high_precision import PreciseIntegrator
from heavytop.numbers.decimals import context
from heavytop.run.high_precision import rounded_start
from heavytop.run.planning import EPSILON, Plan, plan, start_values
from heavytop.run.propagation import binary_start, compiled_for, integrator_of
from heavytop.run.verify import motion_of
from heavytop.scene.scene import Scene
from heavytop.studies.drifts.methods import Method
from heavytop.studies.drifts.precise_march import LATE_WORDS, PreciseMarch
from heavytop.studies.drifts.taylor_march import TaylorMarch
from heavytop.studies.drifts.yardstick import DIGITS, Yardstick

ONLY_TILT = {"quantities": ("theta",), "events": (), "samples": 2, "digits": 10}
SPARE_DIGITS = 12  # of texts and of the yardstick, beyond those of the run's numbers


@dataclass(frozen=True, eq=False)
class Run:
    """One method set up for one start.

    Attributes
    ----------
    march : Stepper
    yardstick : Yardstick
    period : float
        Of the nutation of this run's own start [s].
    """

    march: Stepper
    yardstick: Yardstick
    period: float


def run(scene: Scene, method: Method) -> Run:
    """Return a method set up for the start of a scene.

    Raises
    ------
    BadScene
        The method's formulation cannot start there; nothing nutates.
    MissingPackage
        A rival whose package is not installed.
    """
    chosen = _plan(scene, method)
    if method.bits > DOUBLE:
        return _precise(scene, chosen, method)
    parameters, start = binary_start(scene, chosen)
    state = start.state
    own = partial(_own, chosen)
    yardstick = Yardstick(chosen.equations, parameters, tuple(state.tolist()), own)
    period = _period(scene, yardstick)
    if method.is_rival:
        from heavytop.comparison.methods import make_stepper

        form = chosen.equations
        taken = make_stepper(
            method.name, state, parameters, method.setting, period, formulation=form
        )
        return Run(taken, yardstick, period)
    engine = integrator_of(chosen, compiled_for(chosen), parameters, start)
    return Run(TaylorMarch(engine, np.array(state), period), yardstick, period)


def _plan(scene: Scene, method: Method) -> Plan:
    """Return the plan of a run that keeps no more than the tilt."""
    wants = Scene(scene.top, scene.start, periods=1, name=scene.name, **ONLY_TILT)  # type: ignore[arg-type]
    chosen = plan(wants, method.formulation, projected=method.projected)
    tolerance = EPSILON if method.is_rival else max(method.setting, EPSILON)
    return replace(chosen, precision=named(method.bits), tolerance=tolerance)


def _precise(scene: Scene, chosen: Plan, method: Method) -> Run:
    digits = int(method.bits * 0.30103) + SPARE_DIGITS
    form = chosen.equations
    texts, start = rounded_start(form, start_values(scene), context(digits))
    engine = PreciseIntegrator(form, method.bits, texts, start=start)
    doubles, first = binary_start(scene, chosen)
    own = integrator_of(chosen, compiled_for(chosen), doubles, first)
    march = PreciseMarch(engine, tuple(start), 1.0, own.cautious_step(first, 1e6))
    begun = march.begin()
    yardstick = Yardstick(
        form,
        engine.parameter_texts(),
        (*begun.state, *begun.carry[:-LATE_WORDS]),
        partial(_own, chosen),
        max(DIGITS, digits + SPARE_DIGITS),
    )
    period = _period(scene, yardstick)
    return Run(replace(march, period=period), yardstick, period)


def _own(chosen: Plan, digits: int, states: Sequence[Any], parameters: Any) -> Any:
    return motion_of(chosen, digits, states, parameters)


def _period(scene: Scene, yardstick: Yardstick) -> float:
    period = yardstick.period
    if period is None:  # a study is refused where nothing nutates, but this run is rounded
        rule = f"so close to a pole that, as it is rounded here, nothing nutates ({DIGITS} digits)"
        fault = Fault(scene.name, None, "start.theta", str(scene.start.theta), rule)
        raise BadScene((fault,))
    return period
