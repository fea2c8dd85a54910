"""Many tops at once against one at a time: the same motions, to rounding."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import HeavyTopError, Impossible, ImpossibleStart, NotANumber, Outcome
from heavytop.run.ensemble import Ensemble
from heavytop.run.events import tally

from ..motions import BOOK, KICKED

SICM = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456}
RANDOM = np.random.default_rng(11)
THETA = RANDOM.uniform(0.05, 3.0, 37)
PHIDOT = RANDOM.uniform(-15, 15, 37)
OMEGA3 = RANDOM.uniform(60, 180, 37)
TIME = RANDOM.uniform(-2, 2, 37)


@pytest.mark.parametrize("formulation", ["axis", "routh", "cubic"])
def test_as_one_at_a_time(formulation):
    """37 tops, each with its own span, forwards or backwards: theta, and the times of events."""
    events = () if formulation == "routh" else ("turning", "reversal")
    many = ht.propagate_many(
        **SICM, theta=THETA, phidot=PHIDOT, omega3=OMEGA3, time=TIME, formulation=formulation,
        events=events, states=True,
    )  # fmt: skip
    assert set(many.outcomes) == {Outcome.FINISHED}
    for i in range(37):
        start = ht.State(THETA[i], phidot=PHIDOT[i], omega3=OMEGA3[i])
        scene = ht.Scene(BOOK, start, time=TIME[i], quantities=("theta",), events=events)
        one = ht.propagate(scene, formulation=formulation)
        assert many.final.theta[i] == pytest.approx(one.theta[-1], abs=3e-12)
        for k, event in enumerate(events):
            mine = (many.zeros.which == i) & (many.zeros.event == k)
            t = one.events.of(event).t
            assert many.count(event)[i] == t.size
            assert many.zeros.t[mine] == pytest.approx(t, abs=1e-11)
            met = ht.Motion(BOOK, start).at(many.zeros.t[mine].tolist())
            assert many.met.theta[mine] == pytest.approx(np.array(met.theta, float), abs=1e-11)
            assert many.met.phidot[mine] == pytest.approx(
                np.array(met.phidot, float), rel=1e-11, abs=1e-9
            )


def test_what_is_impossible_is_singular_and_spoils_no_other():
    given = {"A": [3.28e-4, -1.0, 1.0, 1.0], "C": [6.6e-5, 6.6e-5, 3.0, 1.0], "gMR": 0.0456}
    found = ht.propagate_many(**given, theta=[0.1, 0.1, 0.1, 4.0], omega3=140.0, time=0.5,
                              events=("turning",))  # fmt: skip
    assert found.missed.tolist() == [False, True, True, True]
    assert found.outcomes == (Outcome.FINISHED, *3 * (Outcome.SINGULAR,))
    assert found.count("turning")[1:].tolist() == [0, 0, 0]
    assert repr(found) == "<Ensemble: (4,) tops, axis, 3 missed>"
    with pytest.raises(ht.HeavyTopError, match="'cusp': none of those looked for"):
        found.count("cusp")


def test_states_at_zeros_are_there_only_where_they_were_kept():
    found = ht.propagate_many(**SICM, theta=0.1, phidot=-15.0, omega3=140.0, time=1.0,
                              events=("turning",))  # fmt: skip
    assert found.count("turning")[0] > 2
    with pytest.raises(ht.HeavyTopError, match="states=True"):
        _ = found.met


@pytest.mark.parametrize("jobs", [2, 3])
def test_the_same_bits_on_any_number_of_threads(jobs):
    given = {"theta": np.resize(THETA, 1000), "phidot": np.resize(PHIDOT, 1000)}
    asked = {"omega3": 140.0, "time": 0.7, "events": ("turning",)}
    one, many = (ht.propagate_many(**SICM, **given, **asked, jobs=n) for n in (1, jobs))
    assert np.array_equal(one.states, many.states)
    assert np.array_equal(one.zeros.t, many.zeros.t)
    assert np.array_equal(one.zeros.which, many.zeros.which)


def test_the_same_bits_whoever_is_beside():
    """Some of them start on an event, others beside it: no top's bits depend on its neighbours."""
    phidot, thetadot = np.where(np.arange(37) % 3, PHIDOT, 0.0), np.where(np.arange(37) % 2, 0.0, 1)
    given = {"theta": THETA, "phidot": phidot, "thetadot": thetadot, "omega3": OMEGA3}
    rest = {"time": 20.0, "events": ("turning", "reversal")}
    many = ht.propagate_many(**SICM, **given, **rest)
    for i in range(0, 37, 4):
        alone = ht.propagate_many(**SICM, **{k: v[i : i + 1] for k, v in given.items()}, **rest)
        assert np.array_equal(alone.states[0], many.states[i])
        assert np.array_equal(alone.zeros.t, many.zeros.t[many.zeros.which == i])


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
    over = ht.propagate_many(
        **SICM, theta=np.array([np.pi, 1.0, 1.1, 1.2]), thetadot=3.0, psidot=100.0, time=1.0,
        formulation="routh", step_limit=20_000,
    )  # fmt: skip
    assert over.outcomes[1:] == (Outcome.FINISHED,) * 3


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
    with pytest.raises(Impossible, match="broadcast"):
        ht.propagate_many(**SICM, theta=np.zeros(3), phidot=np.zeros(4), time=1.0)
    with pytest.raises(NotANumber):
        ht.propagate_many(**SICM, theta="upright", time=1.0)
    with pytest.raises(NotANumber, match="2\\^53"):
        ht.propagate_many(**SICM, theta=0.1, phidot=2**54, time=1.0)
    assert ht.propagate_many(**SICM, theta=0.1, time=1.0, longest=np.nan).missed.all()
    with pytest.raises(Impossible, match="digits: a whole number from 1 to 13"):
        ht.propagate_many(**SICM, theta=0.1, time=1.0, digits=30)


@pytest.mark.parametrize(
    "start",
    [
        {"theta": np.linspace(0.2, 1.4, 13), "thetadot": x, "phi": phi, "psidot": 200.0}
        for x, phi in ((-2.0, 0.3), (2.0, 0.0), (0.0, 2.0))
    ],
)
def test_a_start_on_a_reversal_or_a_cusp_counts_as_it_does(start):
    """φ̇ = 0 in loops, and from rest: the numbers are those of the closed form."""
    found = ht.propagate_many(**SICM, **start, time=0.7, events=("turning", "reversal"))
    motions = [
        ht.Motion(BOOK, ht.State(**(start | {"theta": theta}))) for theta in start["theta"].tolist()
    ]
    counts = [tally(motion, 0.7) for motion in motions]
    for event in found.events:
        assert found.count(event).tolist() == [count[event][0] for count in counts]
    reversals = found.zeros.t[found.zeros.event == 1]
    assert (reversals == 0).sum() == (13 if start["thetadot"] else 0)
    assert not found.missed.any()


def test_an_end_on_a_turning_point_counts():
    halves = np.arange(1, 9) * ht.Motion(BOOK, KICKED).period / 2
    start = {"theta": 0.1, "phidot": -15.0, "psidot": 140.0}
    found = ht.propagate_many(**SICM, **start, time=halves, events=("turning",))
    assert found.count("turning").tolist() == list(range(2, 10))


def test_a_start_on_a_turning_point_loses_no_other_one():
    """A nutation too small for the steps to see: the first holds the start and the next zero."""
    theta, phidot = 0.9, 7.0
    steady = (0.0456 + 3.28e-4 * phidot**2 * np.cos(theta)) / (6.6e-5 * phidot)
    start = {"theta": theta, "phidot": phidot * (1 + 1e-9), "omega3": steady}
    found = ht.propagate_many(**SICM, **start, time=1.0, events=("turning",))
    motion = ht.Motion(BOOK, ht.State(**start))
    half = motion.period / 2
    assert found.count("turning")[0] == int(1.0 / half) + 1
    assert found.zeros.t == pytest.approx(half * np.arange(int(1.0 / half) + 1), abs=1e-6)


def test_lost_digits_are_marked():
    """The unstable sleeper, 1e-7 rad off the vertical: 1.5 % off, in doubles."""
    start = {"theta": np.array([0.1, 1e-7]), "psidot": np.array([140.0, 90.0])}
    asked = {"time": 10.0, "events": ("turning", "reversal")}
    exact = [
        float(ht.Motion(BOOK, ht.State(x, psidot=spin)).at(10, 40).theta)
        for x, spin in ((0.1, 140.0), (1e-7, 90.0))
    ]
    found = ht.propagate_many(**SICM, **start, **asked)
    off = abs(found.final.theta - exact)
    assert off[1] > 1e-9  # or there would be nothing to see
    assert (off <= found.error).all()
    assert found.missed.tolist() == [False, True]


@pytest.mark.parametrize("junk", [-1, 1.5, True, np.nan, "x", 10**400, [1, 2], np.array([1.0, 2])])
@pytest.mark.parametrize("name", ["step_limit", "jobs", "events", "digits"])
def test_junk_options_are_named(name, junk):
    with pytest.raises(HeavyTopError, match=name):
        ht.propagate_many(**SICM, theta=0.1, time=1.0, **{name: junk})


@pytest.mark.parametrize("given", [{"time": 1e12, "step_limit": 1000}, {"longest": 1e-12}])
def test_what_never_ends_has_a_limit(given):
    found = ht.propagate_many(
        **SICM, **({"theta": np.full(9, 0.1), "psidot": 140.0, "time": 2.0} | given)
    )
    assert set(found.outcomes) == {Outcome.STEP_LIMIT}
    assert found.missed.all()


@pytest.fixture
def fuzz(monkeypatch):
    """``validation/fuzz_many.py``: every top is as right as its run says."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "validation"))
    return import_module("fuzz_many")


@pytest.mark.parametrize(("seed", "stretch"), [(5, 1.0), (6, 40.0)])
def test_no_top_is_wrong_beyond_what_its_run_says(fuzz, seed, stretch):
    assert fuzz.misses(seed, 48, "axis", stretch) == []


def test_an_estimate_that_is_too_small_is_found(fuzz, monkeypatch):
    """Planted: errors a hundred thousandth of what they are said to be, and no marks."""
    honest = Ensemble.error.func
    monkeypatch.setattr(Ensemble, "error", property(lambda run: honest(run) / 1e5))
    monkeypatch.setattr(Ensemble, "missed", property(lambda run: np.zeros(run.end.size, bool)))
    assert len(fuzz.misses(5, 48)) > 5
