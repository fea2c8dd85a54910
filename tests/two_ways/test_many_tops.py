"""Many tops at once against one at a time: the same motions, to rounding."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import HeavyTopError, Impossible, ImpossibleStart, NotANumber, Outcome
from heavytop.run.events import tally

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
            met = ht.Motion(top, start).at(many.zeros.t[mine].tolist())
            assert many.met.theta[mine] == pytest.approx(np.array(met.theta, float), abs=1e-11)
            assert many.met.phidot[mine] == pytest.approx(np.array(met.phidot, float), abs=1e-9)


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
    with pytest.raises(Impossible, match="broadcast"):
        ht.propagate_many(**SICM, theta=np.zeros(3), phidot=np.zeros(4), time=1.0)
    with pytest.raises(NotANumber):
        ht.propagate_many(**SICM, theta="upright", time=1.0)
    with pytest.raises(NotANumber, match="2\\^53"):
        ht.propagate_many(**SICM, theta=0.1, phidot=2**54, time=1.0)
    assert ht.propagate_many(**SICM, theta=0.1, time=1.0, longest=np.nan).missed.all()


@pytest.mark.parametrize("phi", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("thetadot", [-2.0, 2.0])
def test_a_start_on_a_reversal_counts_in_all_tops(phi, thetadot):
    """φ̇ = 0 in loops: the numbers are those of the closed form, from the start on."""
    tops = {"theta": np.linspace(0.2, 1.4, 13), "thetadot": thetadot, "phi": phi, "psidot": 200.0}
    found = ht.propagate_many(**SICM, **tops, time=0.7, events=("turning", "reversal"))
    motions = [
        ht.Motion(ht.Top(**SICM), ht.State(theta, thetadot=thetadot, phi=phi, psidot=200.0))
        for theta in tops["theta"].tolist()
    ]
    counts = [tally(motion, 0.7) for motion in motions]
    for event in found.events:
        assert found.count(event).tolist() == [count[event][0] for count in counts]
    first = [
        found.zeros.t[(found.zeros.which == i) & (found.zeros.event == 1)][0] for i in range(13)
    ]
    assert first == [0.0] * 13
    assert not found.missed.any()


def test_a_start_on_a_turning_point_loses_no_other_one():
    """A nutation too small for the steps to see: the first holds the start and the next zero."""
    theta, phidot = 0.9, 7.0
    steady = (0.0456 + 3.28e-4 * phidot**2 * np.cos(theta)) / (6.6e-5 * phidot)
    start = {"theta": theta, "phidot": phidot * (1 + 1e-9), "omega3": steady}
    found = ht.propagate_many(**SICM, **start, time=1.0, events=("turning",))
    motion = ht.Motion(ht.Top(**SICM), ht.State(**start))
    half = motion.period / 2
    assert found.count("turning")[0] == int(1.0 / half) + 1
    assert found.zeros.t == pytest.approx(half * np.arange(int(1.0 / half) + 1), abs=1e-6)


def test_an_end_on_a_turning_point_counts():
    motion = ht.Motion(ht.Top(**SICM), ht.State(0.1, phidot=-15.0, psidot=140.0))
    halves = np.arange(1, 9) * motion.period / 2
    found = ht.propagate_many(
        **SICM, theta=0.1, phidot=-15.0, psidot=140.0, time=halves, events=("turning",)
    )
    assert found.count("turning").tolist() == list(range(2, 10))


def test_released_at_rest_there_are_cusps_and_no_reversals():
    found = ht.propagate_many(
        **SICM, theta=THETA, psidot=140.0, time=1.0, events=("turning", "reversal")
    )
    assert not found.count("reversal").any()


def test_lost_digits_are_marked():
    """The unstable sleeper, 1e-7 rad off the vertical: 1.5 % off, in doubles."""
    start = {"theta": np.array([0.1, 1e-7]), "psidot": np.array([140.0, 90.0])}
    asked = {"time": 10.0, "events": ("turning", "reversal")}
    exact = [
        float(ht.Motion(ht.Top(**SICM), ht.State(x, psidot=spin)).at(10, 40).theta)
        for x, spin in ((0.1, 140.0), (1e-7, 90.0))
    ]
    found = ht.propagate_many(**SICM, **start, **asked)
    off = abs(found.final.theta - exact)
    assert off[1] > 1e-9  # or there would be nothing to see
    assert (off <= found.error).all()
    assert found.missed.tolist() == [False, True]


def test_digits_that_doubles_cannot_have():
    with pytest.raises(Impossible, match="digits: a whole number from 1 to 13"):
        ht.propagate_many(**SICM, theta=0.1, time=1.0, digits=30)


@pytest.mark.parametrize("junk", [-1, 1.5, True, np.nan, "x", 10**400, [1, 2], np.array([1.0, 2])])
@pytest.mark.parametrize("name", ["step_limit", "jobs", "events", "digits"])
def test_junk_options_are_named(name, junk):
    with pytest.raises(HeavyTopError, match=name):
        ht.propagate_many(**SICM, theta=0.1, time=1.0, **{name: junk})


def test_one_that_breaks_off_ends_no_other_at_the_step_limit():
    """The textbook form steps over the pole in one of four lanes."""
    theta = np.array([np.pi, 1.0, 1.1, 1.2])
    found = ht.propagate_many(
        **SICM, theta=theta, thetadot=3.0, psidot=100.0, time=1.0, formulation="routh",
        step_limit=20_000,
    )  # fmt: skip
    assert found.outcomes[1:] == (Outcome.FINISHED,) * 3


@pytest.mark.parametrize("given", [{"time": 1e12, "step_limit": 1000}, {"longest": 1e-12}])
def test_what_never_ends_has_a_limit(given):
    found = ht.propagate_many(
        **SICM, **({"theta": np.full(9, 0.1), "psidot": 140.0, "time": 2.0} | given)
    )
    assert set(found.outcomes) == {Outcome.STEP_LIMIT}
    assert found.missed.all()
