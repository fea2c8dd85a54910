"""Many tops at once against one at a time: the same motions, to rounding."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import HeavyTopError, Impossible, ImpossibleStart, NotANumber, Outcome
from heavytop.run.counts import tally
from heavytop.run.ensemble import Ensemble

from ..motions import BOOK

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
    asked = {"time": TIME, "formulation": formulation, "events": events}
    many = ht.propagate_many(**SICM, theta=THETA, phidot=PHIDOT, omega3=OMEGA3, **asked)
    assert set(many.outcomes) == {Outcome.FINISHED}
    for i in range(37):
        start = ht.State(THETA[i], phidot=PHIDOT[i], omega3=OMEGA3[i])
        scene = ht.Scene(BOOK, start, time=TIME[i], quantities=("theta",), events=events)
        one = ht.propagate(scene, formulation=formulation)
        assert many.final.theta[i] == pytest.approx(one.theta[-1], abs=3e-12)
        for k, event in enumerate(events):
            mine = (many.zeros.which == i) & (many.zeros.event == k)
            assert many.count(event)[i] == one.events.count(event)
            assert many.zeros.t[mine] == pytest.approx(one.events.of(event).t, abs=1e-11)


def test_what_is_impossible_is_singular_and_spoils_no_other():
    given = {"A": [3.28e-4, -1.0, 1.0, 1.0], "C": [[6.6e-5], [-3.0]], "gMR": 0.0456}
    start = {"theta": [0.1, 0.1, 0.1, 4.0], "omega3": 140.0}
    found = ht.propagate_many(**given, **start, time=0.5, events=("turning",))
    assert found.shape == (2, 4)
    good = [True, False, True, False, *4 * [False]]
    assert [each is Outcome.FINISHED for each in found.outcomes] == good
    assert (found.missed | good).all()
    assert not found.count("turning")[np.invert(good)].any()
    with pytest.raises(HeavyTopError, match="'cusp': none of those looked for"):
        found.count("cusp")
    empty = ht.propagate_many(**SICM, theta=np.empty(0), time=1.0)
    assert (empty.states.shape, empty.outcomes) == ((0, 5), ())


def test_the_same_bits_whoever_is_beside_on_any_number_of_threads():
    """Some of them start on an event, others beside it: no top's bits depend on its neighbours."""
    phidot, thetadot = np.where(np.arange(37) % 3, PHIDOT, 0.0), np.where(np.arange(37) % 2, 0.0, 1)
    given = {"theta": THETA, "phidot": phidot, "thetadot": thetadot, "omega3": OMEGA3}
    rest = {"time": 20.0, "events": ("turning", "reversal")}
    many, threads = (ht.propagate_many(**SICM, **given, **rest, jobs=n) for n in (1, 3))
    assert np.array_equal(many.states, threads.states)
    assert np.array_equal(many.zeros.t, threads.zeros.t)
    for i in range(0, 37, 4):
        alone = ht.propagate_many(**SICM, **{k: v[i : i + 1] for k, v in given.items()}, **rest)
        assert np.array_equal(alone.states[0], many.states[i])
        assert np.array_equal(alone.zeros.t, many.zeros.t[many.zeros.which == i])


def test_a_bad_one_spoils_only_itself(monkeypatch):
    """Not a number, too large for doubles, and, in a form singular there, on the vertical."""
    phidot = np.zeros(20)
    phidot[3], phidot[8], phidot[12] = np.nan, 1e200, np.inf
    good = np.isfinite(phidot) & (phidot < 1e100)
    many = ht.propagate_many(**SICM, theta=0.1, phidot=phidot, omega3=140.0, time=1.0)
    assert [i for i, end in enumerate(many.outcomes) if end is not Outcome.FINISHED] == [3, 8, 12]
    assert np.isnan(many.states[~good]).all()
    assert len({tuple(state) for state in many.states[good].tolist()}) == 1
    start = {"theta": [np.pi, 1.0, 1.1, 1.2], "thetadot": 3.0, "psidot": 100.0, "time": 1.0}
    monkeypatch.setattr("heavytop.run.ensemble.MOST_STEPS", 20_000)
    over = ht.propagate_many(**SICM, **start, formulation="routh")
    assert over.outcomes[1:] == (Outcome.FINISHED,) * 3


BAD = [
    ({"psidot": 1.0, "omega3": 1.0}, ImpossibleStart, "not both"),
    ({"theta": np.zeros(3), "phidot": np.zeros(4)}, Impossible, "broadcast"),
    ({"theta": "upright"}, NotANumber, "theta"),
    ({"phidot": 2**54}, NotANumber, "2\\^53"),
    ({"digits": 30}, Impossible, "digits.*a whole number from 1 to 13"),
    *(({name: -1}, HeavyTopError, name) for name in ("jobs", "events", "digits")),
    *(({name: "x"}, HeavyTopError, name) for name in ("jobs", "events", "digits")),
]


@pytest.mark.parametrize(("given", "error", "said"), BAD)
def test_bad_input_is_named(given, error, said):
    with pytest.raises(error, match=said):
        ht.propagate_many(**SICM, **({"theta": 0.1, "time": 1.0} | given))


@pytest.mark.parametrize(("thetadot", "phi"), [(-2.0, 0.3), (2.0, 0.0), (0.0, 2.0)])
def test_a_start_on_a_reversal_or_a_cusp_counts_as_it_does(thetadot, phi):
    """φ̇ = 0 in loops, and from rest: the numbers are those of the closed form."""
    tilts, start = np.linspace(0.2, 1.4, 13), {"thetadot": thetadot, "phi": phi, "psidot": 200.0}
    asked = {"time": 0.7, "events": ("turning", "reversal")}
    found = ht.propagate_many(**SICM, theta=tilts, **start, **asked)
    counts = [tally(ht.Motion(BOOK, ht.State(theta, **start)), 0.7) for theta in tilts.tolist()]
    for event in found.events:
        assert found.count(event).tolist() == [count[event][0] for count in counts]
    reversals = found.zeros.t[found.zeros.event == 1]
    assert (reversals == 0).sum() == (13 if thetadot else 0)
    assert not found.missed.any()


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
    found = ht.propagate_many(**SICM, **start, time=8.0, events=("turning", "reversal"))
    starts = (ht.State(0.1, psidot=140), ht.State(1e-7, psidot=90))
    off = abs(found.final.theta - [float(ht.Motion(BOOK, x).at(8, 40).theta) for x in starts])
    assert off[1] > 1e-9  # or there would be nothing to see
    assert (off <= found.error).all()
    assert found.missed.tolist() == [False, True]


def test_what_never_ends_has_a_limit(monkeypatch):
    monkeypatch.setattr("heavytop.run.ensemble.MOST_STEPS", 1000)
    found = ht.propagate_many(**SICM, theta=np.full(9, 0.1), psidot=140.0, time=1e12)
    assert set(found.outcomes) == {Outcome.STEP_LIMIT}
    assert found.missed.all()


@pytest.fixture
def fuzz(monkeypatch):
    """``validation/43_fuzz.py``: every top is as right as its run says."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "validation"))
    return import_module("43_fuzz")


@pytest.mark.parametrize(("seed", "stretch"), [(5, 1.0), (6, 40.0)])
def test_no_top_is_wrong_beyond_what_its_run_says(fuzz, seed, stretch):
    assert fuzz.many_misses(seed, 48, "axis", stretch) == []


def test_an_estimate_that_is_too_small_is_found(fuzz, monkeypatch):
    """Planted: errors a hundred thousandth of what they are said to be, and no marks."""
    honest = Ensemble.error.func
    monkeypatch.setattr(Ensemble, "error", property(lambda run: honest(run) / 1e5))
    monkeypatch.setattr(Ensemble, "missed", property(lambda run: np.zeros(run.end.size, bool)))
    assert len(fuzz.many_misses(5, 48)) > 5
