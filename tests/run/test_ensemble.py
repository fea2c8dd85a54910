"""Many tops at once against one at a time: the same motions, to rounding."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import HeavyTopError, Outcome
from heavytop.run.counts import count_events
from heavytop.run.ensemble import Ensemble
from heavytop.scene.quantities import Need

from ..motions import BOOK, motion

SICM = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456}
RANDOM = np.random.default_rng(11)
THETA = RANDOM.uniform(0.05, 3.0, 37)
PHIDOT = RANDOM.uniform(-15, 15, 37)
OMEGA3 = RANDOM.uniform(60, 180, 37)
TIME = RANDOM.uniform(-2, 2, 37)
EVENTS = ("turning", "reversal")


@pytest.mark.parametrize("name", FORMULATIONS)
def test_the_ends_have_what_the_form_gives(name):
    """φ and ψ with their turns, and the attitude; nan where the form gives a tilt alone.

    37 tops, each with its own span, forwards or backwards, and the times of its events.
    """
    start = {"theta": THETA, "phi": 0.3, "psi": -0.5, "phidot": PHIDOT, "psidot": OMEGA3}
    found = ht.propagate_many(**SICM, **start, time=TIME, formulation=name, events=EVENTS)
    full, gives = ht.propagate_many(**SICM, **start, time=TIME).final, FORMULATIONS[name].gives
    for i in range(37):
        one = {key: np.broadcast_to(x, 37)[i] for key, x in start.items()}
        exact = motion(**SICM, **one).at(TIME[i])
        for angle, need in (("theta", Need.TILT), ("phi", Need.PHI), ("psi", Need.PSI)):
            x = getattr(found.final, angle)[i]
            known = getattr(exact, angle) if gives >= need else np.nan
            assert x == pytest.approx(float(known), abs=2e-11, nan_ok=True)
        for k, event in enumerate(EVENTS):
            mine, ends = (found.zeros.which == i) & (found.zeros.event == k), sorted((0, TIME[i]))
            times = [float(t) for t in motion(**SICM, **one).events(event).times(*ends, 20)]
            assert sorted(found.zeros.t[mine]) == pytest.approx(times, abs=1e-11)
    together = (found.final.quaternion * full.quaternion).sum(axis=1)
    assert together == pytest.approx(1.0 if gives >= Need.PSI else np.full(37, np.nan), nan_ok=True)
    assert found.final.axis == pytest.approx(full.axis, abs=1e-11, nan_ok=True) or gives < Need.PSI
    assert not found.missed.any()
    quick = start | {name: start[name] * 2.0**20 for name in ("phidot", "psidot")}
    strong = SICM | quick | {"gMR": 0.0456 * 2.0**40, "time": TIME / 2**20}
    fast = ht.propagate_many(**strong, formulation=name, events=EVENTS)
    assert fast.zeros.t * 2**20 == pytest.approx(found.zeros.t, abs=1e-11)


@pytest.mark.parametrize("tilt", [1e-9, np.pi - 1e-9])
def test_beside_a_pole_the_attitude_is_that_of_the_closed_form(tilt):
    """There φ is known to 1e-7 only, and ψ by the axis form is so much less, or more."""
    start = {"theta": tilt, "phidot": 3.0, "psidot": 140.0}
    run, exact = ht.propagate_many(**SICM, **start, time=2.0), motion(**SICM, **start).at(2.0)
    assert abs(run.final.phi[0] - float(exact.phi)) > 1e-12
    assert run.final.quaternion[0] == pytest.approx(exact.quaternion, abs=1e-12)
    assert not run.missed[0]


def test_a_close_pass_is_on_the_side_that_its_momenta_say():
    top = {"A": 37325692.3315996, "C": 3652479.61803216, "gMR": -5695413.03844305}
    start = {"theta": 3.34400873760287e-12, "phi": -1.01984036024358, "psidot": -0.173647340723830}
    end = 9.5 * motion(**top, **start).period
    found, exact = ht.propagate_many(**top, **start, time=end).final, motion(**top, **start).at(end)
    angles = [float(exact.phi), float(exact.psi)]
    assert [found.phi[0], found.psi[0]] == pytest.approx(angles, abs=1e-3)


def test_what_is_impossible_is_singular_and_no_event_was_looked_for_in_vain():
    given = {"A": [3.28e-4, -1.0, 1.0, 1.0, 1.0], "C": [[6.6e-5], [-3.0]], "gMR": 0.0456}
    start = {"theta": [0.1, 0.1, 0.1, 4.0, 0.1], "omega3": 140.0}
    found = ht.propagate_many(**given, **start, time=[0.5] * 4 + [np.inf], events=("turning",))
    good = [True, False, True, False, *6 * [False]]
    assert found.shape == (2, 5)
    assert [each is Outcome.FINISHED for each in found.outcomes] == good
    assert (~found.missed).tolist() == (found.count("turning") > 0).tolist() == good
    with pytest.raises(HeavyTopError, match="'cusp': none of those looked for"):
        found.count("cusp")
    rest = ht.propagate_many(A=1, C=1, gMR=0, theta=1, time=1, events=("turning",))
    assert (rest.count("turning")[0], rest.missed[0]) == (0, False)
    empty = ht.propagate_many(**SICM, theta=np.empty(0), time=1.0)
    assert (empty.states.shape, empty.outcomes) == ((0, 5), ())


def test_the_same_bits_whoever_is_beside_on_any_number_of_threads():
    """Some of them start on an event, others beside it: no top's bits depend on its neighbours."""
    phidot, thetadot = np.where(np.arange(37) % 3, PHIDOT, 0.0), np.where(np.arange(37) % 2, 0.0, 1)
    given = {"theta": THETA, "phidot": phidot, "thetadot": thetadot, "omega3": OMEGA3}
    rest = {"time": 20.0, "events": EVENTS}
    many, threads = (ht.propagate_many(**SICM, **given, **rest, jobs=n) for n in (1, 3))
    assert np.array_equal(many.states, threads.states)
    assert np.array_equal(many.zeros.t, threads.zeros.t)
    for i in range(0, 37, 4):
        alone = ht.propagate_many(**SICM, **{k: v[i : i + 1] for k, v in given.items()}, **rest)
        assert np.array_equal(alone.states[0], many.states[i])
        assert np.array_equal(alone.zeros.t, many.zeros.t[many.zeros.which == i])


def test_a_bad_one_spoils_only_itself():
    """Not a number, too large for doubles, and, in a form singular there, on the vertical."""
    phidot, psi = np.zeros((2, 20))
    phidot[3], phidot[8], phidot[12], psi[15], psi[16] = np.nan, 1e200, np.inf, np.nan, np.inf
    good = np.isfinite(psi) & (abs(phidot) < 1e100)
    many = ht.propagate_many(**SICM, theta=0.1, psi=psi, phidot=phidot, omega3=140.0, time=1.0)
    ended = [i for i, end in enumerate(many.outcomes) if end is not Outcome.FINISHED]
    assert ended == np.flatnonzero(many.missed).tolist() == [3, 8, 12, 15, 16]
    assert np.isnan(np.c_[many.states, many.final.phidot][~good]).all()
    assert len({tuple(state) for state in many.states[good].tolist()}) == 1
    start = {"theta": [np.pi, 1.0, 1.1, 1.2], "thetadot": 3.0, "psidot": 100.0, "time": 1.0}
    over = ht.propagate_many(**SICM, **start, formulation="routh")
    assert over.outcomes[1:] == (Outcome.FINISHED,) * 3


@pytest.mark.parametrize(("thetadot", "phi"), [(-2.0, 0.3), (2.0, 0.0), (0.0, 2.0)])
def test_a_start_on_a_reversal_or_a_cusp_counts_as_it_does(thetadot, phi):
    """φ̇ = 0 in loops, and from rest: the numbers are those of the closed form."""
    tilts, start = np.linspace(0.2, 1.4, 13), {"thetadot": thetadot, "phi": phi, "psidot": 200.0}
    found = ht.propagate_many(**SICM, theta=tilts, **start, time=0.7, events=EVENTS)
    counts = [count_events(ht.Motion(BOOK, ht.State(x, **start)), 0.7) for x in tilts.tolist()]
    for event in found.events:
        assert found.count(event).tolist() == [count[event][0] for count in counts]
    assert (found.zeros.t[found.zeros.event == 1] == 0).sum() == (13 if thetadot else 0)
    assert not found.missed.any()


def test_a_start_on_a_turning_point_loses_no_other_one():
    """A nutation too small for the steps to see: the first holds the start and the next zero."""
    theta, phidot = 0.9, 7.0
    steady = (0.0456 + 3.28e-4 * phidot**2 * np.cos(theta)) / (6.6e-5 * phidot)
    start = {"theta": theta, "phidot": phidot * (1 + 1e-9), "omega3": steady}
    found = ht.propagate_many(**SICM, **start, time=1.0, events=("turning",))
    half = ht.Motion(BOOK, ht.State(**start)).period / 2
    times = half * np.arange(int(1.0 / half) + 1)
    assert found.count("turning")[0] == times.size
    assert found.zeros.t == pytest.approx(times, abs=1e-6)


def test_a_lost_turn_is_marked():
    """A pendulum that swings through the bottom and back: θ > π in Euler's angles, and φ stays."""
    swing = {"theta": 1.0, "time": 2.1 * ht.Motion(BOOK, ht.State(1.0)).period}
    axis, angles = (ht.propagate_many(**SICM, **swing, formulation=x) for x in ("axis", "lagrange"))
    assert axis.final.phi == pytest.approx(2 * np.pi, abs=1e-12)
    assert angles.final.phi == pytest.approx(0.0, abs=1e-12)
    assert np.maximum(axis.error, angles.error) < 1e-12
    assert (axis.missed[0], angles.missed[0]) == (False, True)


def test_what_never_ends_has_a_limit(monkeypatch):
    monkeypatch.setattr("heavytop.run.ensemble.MOST_STEPS", 1000)
    found = ht.propagate_many(**SICM, theta=np.full(9, 0.1), psidot=140.0, time=1e12)
    assert set(found.outcomes) == {Outcome.STEP_LIMIT}
    assert found.missed.all()


STRETCHED = [("axis", 1.0), ("axis", 40.0), ("attitude", 1.0), ("cubic", 1.0)]


@pytest.mark.parametrize(("name", "stretch"), STRETCHED)
def test_no_top_is_wrong_beyond_what_its_run_says(script, name, stretch):
    assert script("43_fuzz").many_misses(5, 48, name, stretch) == []


PLANTED = [("error", lambda error: error / 1e5), ("error", lambda error: error + 1e-12)]


@pytest.mark.parametrize(("fact", "planted"), [*PLANTED, ("missed", np.zeros_like)])
def test_a_mark_that_is_not_measured_is_found(script, monkeypatch, fact, planted):
    honest = getattr(Ensemble, fact).func
    monkeypatch.setattr(Ensemble, fact, property(lambda run: planted(honest(run))))
    assert len(script("43_fuzz").many_misses(6, 48, "axis", 40.0)) > 5


def test_the_mark_of_a_top_does_not_depend_on_who_measures_it(monkeypatch):
    """In arrays or each by a motion: the same marks."""
    given = {"theta": THETA, "phidot": PHIDOT, "omega3": OMEGA3, "time": 20 * TIME}
    marks = []
    for promised in (1e-12, 0.0):
        monkeypatch.setattr("heavytop.analytic.many.PROMISED", promised)
        marks.append(ht.propagate_many(**SICM, **given, digits=13, events=EVENTS).missed.tolist())
    assert marks[0] == marks[1]
    assert 0 < sum(marks[0]) < 37
