"""Runs of shipped scenes, and two of them that have the same bits, however they were made."""

from dataclasses import replace

import numpy as np

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.scene.quantities import ANGLES, QUANTITIES
from heavytop.studies.steppers import time_shift


def angles_of(formulation):
    """The angles that a formulation, or auto, follows."""
    entry = FORMULATIONS.get(formulation)
    return tuple(x for x in ANGLES if entry is None or QUANTITIES[x].need <= entry.gives)


def run_of(*changes, name="sicm-kicked", **how):
    """A run of a shipped scene with changes."""
    return ht.propagate(ht.load_scene(name, changes), **how)


def planted(run, **parts):
    """The run as if it had found these events, or had these samples."""
    found = replace(run)
    vars(found).update(parts)
    return found


def with_states(run, rows):
    """The run as if its samples had these states."""
    return replace(run, orbit=replace(run.orbit, samples=run.orbit.samples._replace(states=rows)))


def phase_error(run, t=None):
    """How far the nutation runs ahead of the closed form at a time or at the end [s]."""
    truth, at = run.binary_motion.closed_form, run.t[-1:] if t is None else np.array([t])
    there, exact, frequency = run(at), truth.at(at), 2 * np.pi / (truth.period or np.inf)
    off = np.cos(there.theta) - exact.u, -there.thetadot * np.sin(there.theta) - exact.udot
    return float(time_shift(*off, exact, frequency)[0])


def same(a, b):
    return np.array_equal(a, b, equal_nan=True)


def assert_same_run(one, other):
    assert one.orbit.steps == other.orbit.steps
    assert one.plan.projected == other.plan.projected
    for a, b in zip(one.orbit.checkpoints, other.orbit.checkpoints, strict=True):
        assert a.time == b.time
        assert same(a.state, b.state)
    assert one.events.kind == other.events.kind
    for name in ("t", "t_low", "phi", "states", "residual"):
        assert same(getattr(one.events, name), getattr(other.events, name)), name
