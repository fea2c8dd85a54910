"""Many tops at once against one at a time: the same motions, to rounding."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import ImpossibleStart, NotANumber, Outcome

SICM = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456}
RANDOM = np.random.default_rng(11)
THETA = RANDOM.uniform(0.05, 3.0, 37)
PHIDOT = RANDOM.uniform(-15, 15, 37)
OMEGA3 = RANDOM.uniform(60, 180, 37)
TIME = RANDOM.uniform(-2, 2, 37)


@pytest.mark.parametrize("formulation", ["axis", "routh", "cubic"])
def test_as_one_at_a_time(formulation):
    """37 tops, each with its own span, forwards or backwards."""
    many = ht.propagate_many(
        **SICM, theta=THETA, phidot=PHIDOT, omega3=OMEGA3, time=TIME, formulation=formulation
    )
    top = ht.Top(**SICM)
    assert set(many.outcomes) == {Outcome.FINISHED}
    for i in range(37):
        start = ht.State(THETA[i], phidot=PHIDOT[i], omega3=OMEGA3[i])
        scene = ht.Scene(top, start, time=TIME[i], quantities=("theta",), events=())
        one = ht.propagate(scene, formulation=formulation)
        assert many.final.theta[i] == pytest.approx(one.theta[-1], abs=3e-12)


def test_events_as_one_at_a_time():
    """Turning points and reversals: as many, at the same times; the start counts."""
    many = ht.propagate_many(
        **SICM, theta=THETA, phidot=PHIDOT, omega3=OMEGA3, time=1.0,
        events=("turning", "reversal"),
    )  # fmt: skip
    top = ht.Top(**SICM)
    for i in range(0, 37, 6):
        start = ht.State(THETA[i], phidot=PHIDOT[i], omega3=OMEGA3[i])
        events = ht.propagate(ht.Scene(top, start, time=1, events=("turning", "reversal"))).events
        for k, event in enumerate(("turning", "reversal")):
            mine = (many.zeros.which == i) & (many.zeros.event == k)
            t = events.t[events.is_turning if event == "turning" else ~events.is_turning]
            assert many.count(event)[i] == t.size
            assert many.zeros.t[mine] == pytest.approx(t, abs=1e-11)


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_the_same_bits_on_any_number_of_threads(jobs):
    given = {"theta": np.resize(THETA, 1000), "phidot": np.resize(PHIDOT, 1000)}
    runs = [
        ht.propagate_many(**SICM, **given, omega3=140.0, time=0.7, events=("turning",), jobs=n)
        for n in (1, jobs)
    ]
    assert np.array_equal(runs[0].states, runs[1].states)
    assert np.array_equal(runs[0].zeros.t, runs[1].zeros.t)
    assert np.array_equal(runs[0].zeros.which, runs[1].zeros.which)
    alone = ht.propagate_many(
        **SICM, theta=THETA[5], phidot=PHIDOT[5], omega3=140.0, time=0.7, events=("turning",)
    )
    assert np.array_equal(alone.states[0], runs[0].states[5])


def test_a_bad_one_spoils_only_itself():
    """Not a number, too large for doubles, and, in the textbook form, through the vertical."""
    phidot = np.zeros(20)
    phidot[3], phidot[8], phidot[12] = np.nan, 1e200, np.inf
    good = np.isfinite(phidot) & (phidot < 1e100)
    many = ht.propagate_many(**SICM, theta=0.1, phidot=phidot, omega3=140.0, time=1.0)
    assert [i for i, end in enumerate(many.outcomes) if end is not Outcome.FINISHED] == [3, 8, 12]
    assert np.isnan(many.states[~good]).all()
    assert len({tuple(state) for state in many.states[good].tolist()}) == 1
    swing = ht.propagate_many(
        A=1.0, C=1.0, gMR=1.0, theta=[1.0, np.pi / 3], thetadot=[0.0, 0.0], psidot=[0.0, 0.5],
        time=30.0, formulation="lagrange", step_limit=10_000,
    )  # fmt: skip
    assert swing.outcomes[1] is Outcome.FINISHED


def test_a_step_limit_is_named():
    found = ht.propagate_many(**SICM, theta=0.1, omega3=140.0, time=100.0, step_limit=50)
    assert found.outcomes == (Outcome.STEP_LIMIT,)


def test_shapes():
    found = ht.propagate_many(
        **SICM, theta=0.1, phidot=np.zeros((3, 1)), omega3=np.full(4, 140.0), time=0.1
    )
    assert found.shape == (3, 4)
    assert found.end.shape == found.final.theta.shape == (12,)
    assert found.final.axis.shape == (12, 3)
    empty = ht.propagate_many(**SICM, theta=np.empty(0), time=1.0)
    assert empty.states.shape == (0, 5)
    assert empty.outcomes == ()


def test_bad_input():
    with pytest.raises(ImpossibleStart, match="not both"):
        ht.propagate_many(**SICM, theta=0.1, psidot=1.0, omega3=1.0, time=1.0)
    with pytest.raises(NotANumber, match="broadcast"):
        ht.propagate_many(**SICM, theta=np.zeros(3), phidot=np.zeros(4), time=1.0)
    with pytest.raises(NotANumber):
        ht.propagate_many(**SICM, theta="upright", time=1.0)
