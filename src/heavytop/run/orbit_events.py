"""The events of an orbit: the zeros its integrator saw, and a start that is itself one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.motion import Motion
from heavytop.integration.integrator import Seen
from heavytop.integration.orbit import Orbit
from heavytop.integration.quantities import Sample, event_function, sample, spin_momentum
from heavytop.numbers import Exact
from heavytop.run.events import Candidates, Events, judged, within
from heavytop.run.planning import EPSILON, Plan
from heavytop.run.poles import rates_at_poles
from heavytop.scene.scene import Scene

Array = NDArray[np.float64]


def orbit_events(scene: Scene, motion: Motion, chosen: Plan, orbit: Orbit) -> Events:
    """Return the events a scene asks for, from the zeros seen along its orbit."""
    zeros = dict(zip(chosen.watched, orbit.hits, strict=True))
    none = Seen(np.empty(0), np.empty(0), orbit.samples.rows[:0], np.empty(0))
    found = {
        event: within(
            _candidates(orbit, event, zeros.get(event, none)),
            _starting(scene, orbit, event) if event in zeros else None,
            orbit.end,
            abs(orbit.end) / max(orbit.steps, 1),
        )
        for event in ("turning", "reversal")
    }
    events = judged(found["turning"], found["reversal"], scene.events, orbit.steps)
    return _with_limits(events, rates_at_poles(motion))


def _with_limits(events: Events, at_poles: Mapping[str, Exact]) -> Events:
    """Return the events with phidot on the vertical as the exact motion has it."""
    if not at_poles:
        return events
    phidot, kind = events.phidot.copy(), np.array(events.kind)
    for which, limit in at_poles.items():
        phidot[kind == which] = float(limit)
    return replace(events, phidot=phidot)


def _candidates(orbit: Orbit, event: str, seen: Seen) -> Candidates:
    form, parameters = orbit.integrator.formulation, orbit.parameters
    zero, slope = event_function(form, event, seen.rows, parameters, seen.t)
    at = sample(form, seen.rows, parameters, seen.t, seen.phi)
    return Candidates(
        t=seen.t,
        t_low=seen.t_low,
        states=seen.rows,
        phi=at.phi,
        theta=at.theta,
        phidot=at.phidot,
        axis=at.axis,
        residual=zero,
        slope=slope,
        noise=_phidot_rounding(orbit, at),
    )


def _phidot_rounding(orbit: Orbit, at: Sample) -> Array:
    """Return the rounding of phidot = (a - b u)/sin^2, whose terms cancel at a cusp [rad/s].

    Where it is not small against b itself, near a pole, it decides nothing: nan.
    """
    form, first = orbit.integrator.formulation, orbit.checkpoints[0].state[None]
    b = abs(float(spin_momentum(form, first, orbit.parameters, np.zeros(1))[0]))
    with np.errstate(divide="ignore", invalid="ignore"):
        noise = EPSILON * (np.abs(at.phidot) + 2 * b / np.abs(np.sin(at.theta)))
    return np.where(noise < 1e-6 * b, noise, np.nan)


def _starting(scene: Scene, orbit: Orbit, event: str) -> Candidates | None:
    start = scene.start
    at_pole = float(start.theta) == 0.0 or start.theta.sign() == 0
    exactly = {
        "turning": start.thetadot.sign() == 0 or at_pole,
        "reversal": start.phidot.sign() == 0,
    }
    if not exactly[event]:
        return None
    first = orbit.checkpoints[0]
    seen = Seen(np.zeros(1), np.zeros(1), first.state[None], np.array([first.phi]))
    return _candidates(orbit, event, seen)
