"""A formulation is a module and an entry: Euler's equations with the vertical in the body."""

import sys
from dataclasses import replace
from types import ModuleType

import pytest
import sympy as sp

import heavytop as ht
from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import FORMULATIONS, Formulation
from heavytop.equations.registry import FormulationEntry
from heavytop.run import planning
from heavytop.scene.quantities import Need

v_1, v_2, v_3 = vertical = sp.symbols("v_1 v_2 v_3", real=True)
w_1, w_2, omega3 = sp.symbols("w_1 w_2 omega3", real=True)
phi_0, psi_0 = sp.symbols("phi_0 psi_0", real=True)


def euler_form(_=None):
    """A w1' = (A - C) w2 w3 + gMR v2, A w2' = (C - A) w1 w3 - gMR v1, v' = v x w."""
    A, C, gMR = top = lag.A, lag.C, lag.gMR
    w_3 = omega3
    w = w_1, w_2, w_3
    across, along = v_1 * w_2 - v_2 * w_1, v_1 * w_1 + v_2 * w_2
    horizontal = v_1**2 + v_2**2
    theta, phidot = sp.atan2(sp.sqrt(horizontal), v_3), along / horizontal
    sine, spin_rate = sp.sin(lag.theta), lag.psidot + lag.phidot * sp.cos(lag.theta)
    rates = {"thetadot": -across / sp.sqrt(horizontal), "phidot": phidot}
    return Formulation(
        name="euler",
        states=(*vertical, w_1, w_2),
        derivatives=(
            *sp.Matrix(vertical).cross(sp.Matrix(w)),
            ((A - C) * w_2 * w_3 + gMR * v_2) / A,
            ((C - A) * w_1 * w_3 - gMR * v_1) / A,
        ),
        start=(
            sine * sp.sin(lag.psi),
            sine * sp.cos(lag.psi),
            sp.cos(lag.theta),
            lag.thetadot * sp.cos(lag.psi) + lag.phidot * sine * sp.sin(lag.psi),
            -lag.thetadot * sp.sin(lag.psi) + lag.phidot * sine * sp.cos(lag.psi),
        ),
        parameters={x: x for x in top} | {w_3: spin_rate, phi_0: lag.phi, psi_0: lag.psi},
        outputs=rates | {"theta": theta, "psidot": w_3 - phidot * v_3, "axis_z": v_3},
        events={"turning": -across, "reversal": along},
        invariants={
            "energy": (w_1**2 + w_2**2) / 2 + gMR * v_3 / A,
            "p_phi": along + C * w_3 * v_3 / A,
            "length": horizontal + v_3**2,
        },
        spin=C * w_3 / A,
        reading=rates
        | {"theta": theta, "phi": phi_0, "psi": psi_0}
        | {x.name: x for x in (*top, w_3)},
    )


@pytest.fixture
def euler(monkeypatch):
    module = ModuleType("heavytop.equations.euler_body")
    module.euler_form = euler_form
    monkeypatch.setitem(sys.modules, module.__name__, module)
    entry = FormulationEntry("euler_body.euler_form", (None,), Need.TILT, states=5)
    monkeypatch.setitem(FORMULATIONS, "euler", entry)
    monkeypatch.setitem(planning.FORMULATION_OPTIONS, "euler", entry)


@pytest.mark.parametrize(("digits", "bound"), [(12, 1e-12), (30, 1e-30)])
def test_another_formulation_runs_and_is_held_against_its_own_motion(euler, digits, bound):
    scene = ht.load_scene("sicm-kicked", ["want.quantities=['theta']", f"want.digits={digits}"])
    run = ht.propagate(scene, formulation="euler")
    errors = ht.run_errors(run)
    assert errors.theta < bound
    assert errors.energy < bound
    assert errors.rates < 100 * bound
    assert run.events.kind == ht.propagate(scene).events.kind


def test_the_unit_of_time_of_a_fast_top_follows_from_its_start(euler):
    fast = ("start.phidot=-15000", "start.psidot=140000", "top.gMR=45600", "span.time=0.002")
    scene = ht.load_scene("sicm-kicked", ["want.quantities=['theta']", *fast])
    run = ht.propagate(scene, formulation="euler")
    assert run.orbit.integrator.pace > 1
    assert ht.run_errors(run).theta < 1e-12


def test_the_tilt_of_a_form_that_is_singular_at_poles_is_found_by_its_name(euler, monkeypatch):
    """Its first state is below 0 at times, and is no tilt."""
    entry = replace(FORMULATIONS["euler"], starts_at_pole=False)
    monkeypatch.setitem(FORMULATIONS, "euler", entry)
    monkeypatch.setitem(planning.FORMULATION_OPTIONS, "euler", entry)
    scene = ht.load_scene("sicm-kicked", ["want.quantities=['theta']"])
    assert ht.propagate(scene, formulation="euler").outcome == "finished"
