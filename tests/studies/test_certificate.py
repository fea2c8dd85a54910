"""Certificates: bounds that no error exceeds, and planted errors that make them fail."""

import math
from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import heavytop as ht

from ..certificates import run_of
from ..trajectories import planted
from .toy import drop_line

ANGLES = ("theta", "phi", "psi")


@pytest.fixture
def certified(script):
    """What makes the certificate of a run: no error that is looked for exceeds its bounds."""
    largest_errors = script("45_certificates").largest_errors

    def certified(run):
        found, errors = ht.certify(run), largest_errors(run, 1, times=2000, taken=20)
        for name, bound in found.bound.items():
            assert bound is None or max(errors[name], found.observed[name]) <= bound
        return found

    return certified


@pytest.mark.parametrize(("name", "form", "span"), [
    *(("sicm-kicked", form, {"time": 2}) for form in ("axis", "attitude")),
    # back in time only a period leads; and a table that ends before its period is none
    *(("sicm-kicked", "axis", {"periods": n}) for n in (300, -0.1, 0.6)),
    *((f"sicm-{x}", "attitude", {"periods": n}) for x, n in (("dropped", 30), ("kicked", -0.6))),
    ("steady-betsch", "axis", {"time": 2}),
    ("force-free", "axis", {"time": 3}),
    ("spherical-pendulum", "axis", {"time": -5}),
])  # fmt: skip
def test_no_error_exceeds_its_bound(certified, name, form, span):
    found = certified(run_of(name, form, **span))
    assert found.proved
    assert found.bound["theta"] <= max(20 * found.observed["theta"], 4e-15)
    proved = None if "steady" in name else True
    assert (found.events.turning.proved, found.events.time_bound_s is None) == (proved, not proved)


def test_a_projected_run_is_certified_step_by_step_and_a_fast_one_in_its_own_time(certified):
    scene = ht.load_scene("sicm-kicked", ["span.periods=200"])
    assert certified(ht.propagate(scene, formulation="axis", projected=True)).bound["axis"] < 3e-13
    scene = ht.load_scene("sicm-kicked", ["start.psidot=3e5", "span.time=0.005", "want.digits=9"])
    assert certified(ht.propagate(scene, formulation="axis")).bound["axis"] < 5e-15


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
def test_a_scene_whose_digits_take_more_than_doubles_is_run_in_doubles():
    scene = ht.load_scene("through-top", ['want.quantities=["axis", "rates"]'])
    assert ht.plan(scene).precision != "double"
    found = ht.certify(scene)
    assert (found.proved, found.projected, found.bound["axis"] < 1e-12) == (True, True, True)


def test_a_state_off_by_one_ulp_is_refused_at_a_block_and_at_a_sample():
    trajectory = run_of("sicm-kicked", periods=100)
    orbit = trajectory.orbit
    first, second, *others = orbit.checkpoints
    block, states = second.state.copy(), orbit.samples.states.copy()
    block[0], states[9, 0] = np.nextafter(block[0], 2), np.nextafter(states[9, 0], 2)
    checkpoints = (first, replace(second, state=block), *others)
    for wrong in ({"checkpoints": checkpoints}, {"samples": orbit.samples._replace(states=states)}):
        with pytest.raises(ht.ForeignFile, match="others"):
            ht.certify(replace(trajectory, orbit=replace(orbit, **wrong)))


@pytest.mark.parametrize("form", ["axis", "attitude"])
def test_a_turn_too_many_is_seen(form):
    """At one of the samples, of an angle alone that no state shows."""
    trajectory = run_of("sicm-kicked", form, periods=30, samples=9)
    assert ht.certify(trajectory).turns is True
    for name in ("phi", "psi")[: 1 if form == "axis" else 2]:
        angles = getattr(trajectory, name) + 2 * math.pi * (np.arange(9) == 5)
        wrong = replace(trajectory.samples, **{name: angles})
        assert ht.certify(planted(trajectory, samples=wrong)).turns is False


def test_psi_is_bounded_in_the_attitude_form_and_a_scene_that_wants_it_is_run_in_that():
    scene = ht.load_scene("sicm-kicked")
    for wanted, form in ((ANGLES, "attitude"), (("theta", "phi"), "axis"), (("theta",), "axis")):
        found = ht.certify(replace(scene, quantities=wanted))
        assert (found.formulation, found.proved) == (form, True)
        assert [n for n, x in found.bound.items() if x] == ["axis", *wanted]
        assert all(found.events[event].proved for event in ("turning", "reversal"))


@pytest.mark.parametrize("count", [0, 2])
@pytest.mark.parametrize("which", [1, 3, -1])
def test_a_missed_or_doubled_event_is_seen(which, count):
    trajectory = run_of("sicm-kicked")
    events = trajectory.events
    times = np.ones(len(events), int)
    times[which] = count
    columns = ("t", "t_low", "theta", "phi", "phidot", "residual", "axis", "states", "place")
    kept = {name: np.repeat(getattr(events, name), times, axis=0) for name in columns}
    kinds = tuple(np.repeat(events.kind, times).tolist())
    found = ht.certify(planted(trajectory, events=replace(events, kind=kinds, **kept)))
    assert not found.proved
    event = "reversal" if events.kind[which] == "reversal" else "turning"
    assert found.events[event].proved is False
    assert event in " ".join(found.why)


def test_an_event_at_a_wrong_time_widens_the_bound():
    trajectory = run_of("sicm-kicked")
    t = trajectory.events.t + 1e-9 * (np.arange(len(trajectory.events)) == 4)
    found = ht.certify(planted(trajectory, events=replace(trajectory.events, t=t)))
    assert ht.certify(trajectory).events.time_bound_s < 1e-15 < 0.99e-9 < found.events.time_bound_s


def test_what_cannot_be_certified_says_why():
    scene = ht.load_scene("sicm-kicked")
    with pytest.raises(ht.NotCertified, match=r"lagrange form .* axis and attitude"):
        ht.certify(ht.propagate(scene, formulation="lagrange"))
    loose = ht.propagate(replace(scene, digits=1, time=20), formulation="axis")
    integrator = copy(loose.orbit.integrator)
    integrator.engine = SimpleNamespace(order=5, bits=53)
    with pytest.raises(ht.NotCertified, match="order 5"):
        ht.certify(replace(loose, orbit=replace(loose.orbit, integrator=integrator)))
    for precise in (replace(scene, digits=30), ht.propagate(replace(scene, digits=25))):
        with pytest.raises(ht.NotCertified, match="more digits"):
            ht.certify(precise)


def test_parts_resumed_and_shared_out_give_the_same(tmp_path):
    trajectory = run_of("sicm-kicked", periods=2000, digits=9)
    first = ht.certify(trajectory).document()
    assert ht.certify(trajectory, folder=tmp_path, jobs=2).document() == first
    drop_line(tmp_path)
    assert ht.resume(tmp_path).document() == first


@pytest.mark.parametrize(("name", "form", "unbounded", "axis"), [
    ("through-top", "axis", "phi", 1e-14), ("sleeping", "axis", "psi", 3e-16),
    ("sleeping", "attitude", "psi", 5e-15),
])  # fmt: skip
def test_an_angle_that_is_not_bounded_is_named_where_the_axis_is(name, form, unbounded, axis):
    found = ht.certify(run_of(name, form))
    assert found.bound[unbounded] is None
    assert f"{unbounded} is not bounded" in " ".join(found.why)
    assert (found.proved, found.turns, found.bound["axis"] < axis) == (True, False, True)


def test_a_cusp_is_not_proved_nor_what_is_far_from_the_exact_motion(monkeypatch):
    """Its numbers rounded, the motion has loops or waves where there are cusps."""
    scene = ht.load_scene("sicm-dropped")
    assert ht.certify(scene).events.cusp == {"count": 5, "proved": None}
    monkeypatch.setattr("heavytop.certificate.bounds.NORMS_HOLD", 1e-17)
    found = ht.certify(scene)
    assert (found.bound["axis"], found.observed["axis"] > 1e-17) == (None, True)
    assert "axis is not bounded: the run is too far" in found.why[0]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_random_motions(certified, script, seed):
    """Of both forms, projected or not, a small slice of what that script looks at."""
    assert certified(script("45_certificates").drawn(seed)).proved


@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
@pytest.mark.parametrize("form", ["axis", "attitude"])
@pytest.mark.parametrize(("phi", "psi"), [(0, 1e6), (-1.1e6, 0), (1e3, -1e9)])
def test_angles_that_begin_far_from_zero_are_rounded_more(certified, form, phi, psi):
    """An output is rounded in units of its own last place, however small its change is."""
    start = ht.State(1.0, phidot=0.3, psidot=1.0, phi=phi, psi=psi)
    scene = ht.Scene(ht.Top(2, 1, 1), start, time=5, quantities=ANGLES)
    found = certified(ht.propagate(scene, formulation=form))
    assert found.bound["phi"] < 1e-15 * (10 + 2 * abs(phi) + abs(psi))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::heavytop.errors.MissedDigitsWarning")
def test_near_a_separatrix_the_angles_of_a_period_are_known_for_all_periods(certified):
    """With 192 bits the table is good, but not the turns after many periods."""
    for top, start, periods in (
        (ht.Top(2, 1, 1), ht.State(1e-4, psidot=1.2 * math.sqrt(2.0)), -1.5),
        (ht.Top(5.5, 0.63, 0.3), ht.State(5.6e-5, phi=2.7, psi=0.13, psidot=2.7), -5.5),
    ):
        scene = ht.Scene(top, start, periods=periods)
        for form in ("attitude", "axis"):  # of the second top this needs 384 bits
            assert certified(ht.propagate(scene, formulation=form)).bound["theta"] < 2e-6
