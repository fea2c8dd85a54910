"""Projection onto the invariants: where it puts a state, what it keeps, and what it is worth."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
import sympy as sp

import heavytop as ht
from heavytop.equations import formulation
from heavytop.equations.euler_poisson import axis_form
from heavytop.equations.formulation import FORMULATIONS
from heavytop.integration import projection
from heavytop.integration.orbit import Integrator
from heavytop.integration.projection import Projection

from ..motions import BOOK, CONE, LIE, LIE_START
from ..trajectories import phase_error

ALL = 'want.quantities=["theta", "phi", "psi"]'


def scene(periods, *overrides, name="sicm-kicked", wants='want.quantities=["theta"]'):
    return ht.load_scene(name, overrides=[f"span.periods={periods}", wants, *overrides])


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_state_is_put_back_within_its_rounding(formulation):
    run = ht.propagate(scene(3.3, "want.events=[]"), formulation=formulation)
    form, start = run.orbit.integrator.formulation, run.orbit.checkpoints[0].state
    known = [run.orbit.parameters[p.name] for p in form.parameters]
    values = [*form.invariants.values()]
    slopes = [[sp.diff(x, s) for s in form.states] for x in values]
    functions = sp.lambdify((*form.states, *form.parameters), (values, slopes), "mpmath")

    def exactly(state):
        """The invariants at a state in doubles, and their slopes, at 50 digits."""
        with mpmath.workdps(50):
            found = functions(*map(mpmath.mpf, (*state.tolist(), *known)))
        return [np.array(each) for each in found]

    project = Projection.of(form, run.orbit.parameters, start)
    there, (target, _) = run.samples.states[-1], exactly(start)
    shaken = np.random.default_rng(3)
    for _ in range(20):
        off = there * (1 + 1e-12 * shaken.choice((-1, 1), there.size))
        (before, slope), (after, _) = exactly(off), exactly(project(off))
        rounding = np.abs(slope.astype(float)) @ np.spacing(np.abs(off)) / 2
        assert (np.abs((after - target).astype(float)) <= 1.1 * rounding).all()
        assert (np.abs((before - target).astype(float)) > 10 * rounding).any()


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_every_form_can_be_projected(formulation):
    periods = 90.3 if FORMULATIONS[formulation].grows else 1000.3
    run = ht.propagate(scene(periods, "want.events=[]"), formulation=formulation, projected=True)
    assert run.plan.projected
    assert abs(phase_error(run)) < 1e-12
    energy = run.invariants["energy"]  # E' of the kicked top is about gMR
    assert np.sqrt(np.mean((energy / energy[0] - 1) ** 2)) < 3e-15


@pytest.fixture(scope="module")
def whole():
    """Several blocks, each of several legs."""
    return ht.propagate(scene(700, wants=ALL), formulation="axis", projected=True)


def integrator_of(run):
    """What takes the steps of a run whose unit of time is the second, and its start."""
    integrator = run.orbit.integrator.for_this_thread()
    assert integrator.pace == 1
    integrator.engine.load(run.orbit.parameters)
    return integrator, run.orbit.checkpoints[0]


def test_legs_lose_no_time(whole, monkeypatch):
    """Samples and events of a late leg are those of a block of it alone, low words and all."""
    integrator, start = integrator_of(whole)
    stride, step = integrator.projection.stride, integrator.first_step_bound(start, 1e4)
    monkeypatch.setattr(Integrator, "first_step_bound", lambda *_: step)
    monkeypatch.setattr(Projection, "longest", lambda *_: step)
    begun = integrator.block(start, 20 * stride, 1e4).end
    wanted = begun.time[0] + np.array([1.0, 1.7])
    both = integrator.block(start, 21 * stride, 1e4, wanted)
    alone = integrator.block(begun, stride, 1e4, wanted)
    assert np.array_equal(both.samples.states, alone.samples.states)
    assert both.end.time == alone.end.time
    for all_of_them, later in zip(both.hits, alone.hits, strict=True):
        assert np.array_equal(all_of_them.t[-later.t.size :], later.t)
        assert np.array_equal(all_of_them.t_low[-later.t.size :], later.t_low)
        assert later.t_low.any()


NEAR = ("start.theta=1e-3", "start.thetadot=2", "start.psidot=10")  # the top: steps grow
LAST = [("axis", False, 70), ("axis", True, 73), ("lagrange", False, 0.1, *NEAR)]


@pytest.mark.parametrize("how", LAST)
def test_the_last_step_is_the_one_that_passes_the_end(how):
    """Also the last of a leg; and where steps end, as doubles have it, a sample is as any other."""
    run = ht.propagate(scene(*how[2:], wants=ALL), formulation=how[0], projected=how[1])
    (integrator, start), last = integrator_of(run), run.orbit.checkpoints[-1]
    left = run.orbit.steps - last.steps
    before, behind = (integrator.block(last, n, 1e4).end.time[0] for n in (left - 1, left))
    assert before <= run.orbit.end < behind
    t = integrator.polynomials(start, 256, 1e4)[0].begun[1:, 0]
    alone = [run.orbit.at(each).states[0] for each in t[:, None]]
    assert np.array_equal(alone, run.orbit.at(t).states)


def test_events_are_those_of_the_own_motion(whole):
    turning = whole.events.is_turning
    n = np.arange(1401)
    expected = n * whole.binary_motion.closed_form.period / 2
    ulps = np.abs(whole.events.t[turning] - expected) / np.spacing(np.maximum(expected, 1.0))
    assert (ulps / np.sqrt(np.maximum(n, 1))).max() < 4
    low = whole.events.t_low[1:]  # the start itself is an event, at exactly 0
    assert (low != 0).mean() > 0.9


def test_steps_do_not_fall_into_a_cycle():
    """Natural steps of the cubic form do, and their phase error then grows as the time itself."""
    starts = (scene(30_001, "want.events=[]", f"start.theta={0.1 + k / 1000}") for k in range(8))
    runs = [ht.propagate(each, formulation="cubic", projected=True) for each in starts]
    phases = [phase_error(x, (30_000 + 2 / 3) * x.binary_motion.closed_form.period) for x in runs]
    assert np.sqrt(np.mean(np.square(phases))) < 2e-14


# Invariants depend on each other where nothing nutates, and nearly so where hardly anything does.
CONES = {x: ht.State("pi/3", thetadot=x, phidot=10, psidot="135.6") for x in ("0", "1e-9", "0.1")}
MOTIONS = {
    **{f"nutating by {x} rad/s": (CONE, start) for x, start in CONES.items()},
    "sleeping": (BOOK, ht.State(theta=0, psidot=140)),
    "close to the bottom": (LIE, LIE_START),
}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("formulation", ["axis", "cubic"])
def test_no_motion_is_worse_for_it(motion, formulation):
    wanted = ht.Scene(*MOTIONS[motion], time=200, quantities=("theta",), events=())
    plain, projected = (
        ht.propagate(wanted, formulation=formulation, projected=each) for each in (False, True)
    )
    assert 0.99 < projected.orbit.steps / plain.orbit.steps < 1.08  # evened out, no more than that
    errors = [ht.run_errors(run).theta for run in (plain, projected)]
    assert errors[1] <= max(2 * errors[0], 1e-14)


def test_a_form_without_invariants_is_refused_by_name():
    bare = replace(axis_form(), invariants={})
    with pytest.raises(ValueError, match="axis form has no invariant"):
        Projection.of(bare, {}, np.zeros(5))


def test_a_machine_without_longer_doubles_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(formulation, "long_epsilon", lambda: projection.EPSILON)
    with pytest.raises(ht.BadScene, match="long double has no more digits than double"):
        ht.propagate(scene(1), projected=True)


@pytest.mark.parametrize("periods", ["2.007", "3.19", "4.213", "-2.007"])
def test_a_sample_on_the_end_of_a_leg(periods):
    """Where phi is followed, a leg's end is looked at, and within rounding is the next one's."""
    wants = "want.quantities=['theta', 'phi']"
    wanted = scene(periods, "want.events=[]", "want.samples=2", wants=wants)
    assert ht.run_errors(ht.propagate(wanted, formulation="axis", projected=True)).phi < 1e-13
