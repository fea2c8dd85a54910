"""A formulation is a module and an entry: Lagrange's, of another name and with other states."""

import sys
from dataclasses import replace
from types import ModuleType

import pytest

import heavytop as ht
from heavytop.equations.euler_angles import lagrange_form
from heavytop.equations.formulation import FORMULATIONS
from heavytop.run import planning
from heavytop.scene.quantities import Need


def backward_form(_=None):
    """The rates stand before the angles: the first state, 140 rad/s, is no tilt."""
    form = lagrange_form()
    turned = {name: getattr(form, name)[::-1] for name in ("states", "derivatives", "start")}
    return replace(form, name="backward", **turned)


@pytest.fixture
def backward(monkeypatch):
    module = ModuleType("heavytop.equations.backward")
    module.backward_form = backward_form
    monkeypatch.setitem(sys.modules, module.__name__, module)
    entry = replace(FORMULATIONS["lagrange"], builder="backward.backward_form", gives=Need.TILT)
    monkeypatch.setitem(FORMULATIONS, "backward", entry)
    monkeypatch.setitem(planning.FORMULATION_OPTIONS, "backward", entry)


@pytest.mark.parametrize(("digits", "bound"), [(12, 1e-12), (30, 1e-30)])
def test_another_formulation_runs_and_is_held_against_its_own_motion(backward, digits, bound):
    scene = ht.load_scene("sicm-kicked", ["want.quantities=['theta']", f"want.digits={digits}"])
    run = ht.propagate(scene, formulation="backward")
    errors = ht.run_errors(run)
    assert max(errors.theta, errors.energy, errors.rates / 100) < bound
    assert run.events.kind == ht.propagate(scene).events.kind


def test_the_unit_of_time_of_a_fast_top_follows_from_its_start(backward):
    fast = ("start.phidot=-15000", "start.psidot=140000", "top.gMR=45600", "span.time=0.002")
    scene = ht.load_scene("sicm-kicked", ["want.quantities=['theta']", *fast])
    run = ht.propagate(scene, formulation="backward")
    assert run.orbit.integrator.pace > 1
    assert ht.run_errors(run).theta < 1e-12
