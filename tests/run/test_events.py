"""Events of runs: where the exact motion has them, and as many."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import Impossible
from heavytop.integration.engine import TimedStates, reals
from heavytop.integration.outputs import newton_step
from heavytop.run.counts import count_events, schedule
from heavytop.run.verify import Misses

from ..motions import BOOK, KICKED
from ..trajectories import angles_of, run_of
from ..views import Digits

ALL = ("turning", "reversal", "cusp")


def counts(events):
    return tuple(events.count(name) for name in ALL)


# --- in doubles ----------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")
@pytest.mark.parametrize("miss", ["0", "1e-20", "-1e-20", "1e-11", "-1e-11", "1e-3", "-1e-3"])
def test_near_a_cusp_the_events_are_counted_right(miss):
    """Just below a cusp the precession reverses twice a period; just above it never does.

    Within the rounding of doubles it takes more digits to tell: at 1e-20 rad/s reversals lie 2e-12
    s about the turning point, where doubles see one double root.
    """
    start = ht.State("0.1", phidot=miss, psidot=140)
    for digits, periods, n in ((12, "20.3", 21), (30, "4.3", 5)):
        run = ht.propagate(ht.Scene(BOOK, start, periods=periods, events=ALL, digits=digits))
        reversals, cusps = (2 * n - 1) * miss.startswith("-"), n * (miss == "0")
        assert counts(run.events) == (2 * n - 1, reversals, cusps)
        assert digits > 12 or bool(run.plan.tried) == (abs(float(miss)) == 1e-20)
    for kind, rate in zip(run.events.kind, run.numbers(run.events.own["phidot"]), strict=True):
        assert kind != "reversal" or abs(rate) < run.ctx.mpf(10) ** -30


def test_a_table_and_a_choice_of_them():
    events = run_of("span.periods=2").events
    assert [row["kind"] for row in events.table(3)] == ["theta_min", "reversal", "theta_max"]
    assert counts(events) == (len(events.of("turning")), len(events.of("reversal")), 0) == (5, 4, 0)
    assert set(events.of("theta_min").kind) == {"theta_min"}
    for ask in (events.of, events.count):
        with pytest.raises(Impossible, match="one of"):
            ask("cups")
    few = run_of("want.events=['cusp']").events
    assert (few.count("turning"), few.count("cusp")) == (None, 0)


# --- in more digits ------------------------------------------------------------------------------


def test_events_have_all_digits():
    run = run_of("want.digits=60", "span.time=3")
    truth = Digits(run.motion, 80)
    times = [run.numbers(run.events.of(x).own["t"]) for x in ("turning", "reversal")]
    assert [*map(len, times)] == [12, 11]
    off = [truth.ctx.mpf(t) - n * truth.period / 2 for n, t in enumerate(times[0])]
    off += [truth(truth.ctx.mpf(t)).phidot for t in times[1]]
    assert max(map(abs, off)) < truth.ctx.mpf(10) ** -70  # released at a turning point
    assert run.events.t.tolist() == sorted(map(float, np.concatenate(times)))


# let go at a cusp, where in doubles the axis form counts 26, 4 and 1, and the cubic form runs away
LET_GO = (ht.State("1e-6", psidot=90), {"periods": "20.3", "digits": 30}, (41, 0, 21))
# the axis passes the bottom so closely that theta turns there within 1e-9 s
BESIDE = (ht.State("1.0", phidot="1e-6"), {"time": 2, "digits": 25}, (11, 0, 0))
FORMS = [("attitude", *BESIDE), ("routh", *BESIDE)]
SLOW = [("subsystem", *BESIDE), ("lagrange", *BESIDE)]
SLOW += [(form, *LET_GO) for form in ("auto", "axis", "attitude", "cubic", "lagrange")]
FORMS += [pytest.param(*each, marks=pytest.mark.slow) for each in SLOW]


@pytest.mark.parametrize(("form", "start", "span", "counted"), FORMS)
def test_no_form_loses_an_event_beside_a_pole(form, start, span, counted):
    scene = ht.Scene(BOOK, start, quantities=angles_of(form), samples=3, events=ALL, **span)
    run = ht.propagate(scene, formulation=form)
    assert counts(run.events) == counted
    assert ht.run_errors(run).event_time < 1e-29


NONE = [("axis", "reversal", ["0", "-0.6", "0.8", "0", "0"])]
NONE += [("subsystem", "turning", ["1", "-0.5", "0", "0"])]  # thetadot is linear in the state


@pytest.mark.parametrize(("name", "event", "state"), NONE)
def test_an_event_that_is_none_is_not_found(name, event, state):
    """Theta is constant, with l along the vertical, without gravity; or one step is not enough."""
    form = FORMULATIONS[name].build()
    known = {p.name: reals("1", 128)[()] for p in form.parameters} | {"g": reals("0", 128)[()]}
    t, rows = reals(np.array(["0.5"]), 128), reals(np.array([state]), 128)
    _, found = newton_step(form, event, TimedStates(t, 0 * t, rows), known, reals("1e-30", 128)[()])
    assert found.tolist() == [False]


# --- by the closed form --------------------------------------------------------------------------


def test_a_count_says_where_an_end_leaves_it_open():
    motion = ht.Motion(BOOK, KICKED)
    at_half = count_events(motion, motion.period / 2)
    assert at_half == {"turning": (1, 2), "reversal": (1, 1), "cusp": (0, 0)}
    assert count_events(motion, 0.6 * motion.period, ("turning",)) == {"turning": (2, 2)}
    assert count_events(motion, motion.period, ()) is None
    assert count_events(ht.Motion(BOOK, ht.State(0, psidot=200)), 1.0) is None  # theta is constant


@pytest.mark.parametrize(("name", "side"), [("through-top", 1), ("through-bottom", -1)])
def test_at_a_pole_phidot_is_its_limit(name, side):
    """Of a pass, p_psi/2A at the top and -p_psi/2A at the bottom; elsewhere it is the run's."""
    run = run_of(name=name)
    top, passes = run.scene.top, "theta_min" if side > 0 else "theta_max"
    limit = side * float(top.C * run.scene.start.omega3 / (2 * top.A))
    at_pole = np.array([kind == passes for kind in run.events.kind])
    assert at_pole.sum() > 2
    assert run.events.phidot[at_pole] == pytest.approx(limit, rel=1e-14)
    away = run.motion.at(run.events.t[~at_pole]).phidot
    assert run.events.phidot[~at_pole] == pytest.approx(away, rel=1e-9, abs=1e-9)


@pytest.mark.slow
def test_no_run_is_wrong_in_silence_and_unchecked_ones_are_found(script, monkeypatch):
    """Planted: nothing is held against the closed form; and the last event is never looked for."""
    fuzz = script("43_fuzz")
    assert fuzz.run_misses(3, 8, ("doubles", "more", "extended")) == []
    monkeypatch.setattr("heavytop.run.propagation.misses", lambda _: Misses({}, {}, "", 0.0))
    for way in ("doubles", "extended"):
        assert fuzz.run_misses(3, 16, (way,))
    monkeypatch.setattr("heavytop.run.events.schedule", lambda *given: schedule(*given)[:-1])
    assert len(fuzz.run_misses(3, 16, ("more",))) > 4


WHOLE = [*product(("sicm-kicked", "sicm-dropped"), (1, 5, -7), (12, 30))]
BETWEEN_DOUBLES = ("sicm-kicked", 7, 30)  # is where this one ends
LAST_OF_BITS = ("sicm-kicked", 1, 16)  # is where the end of this one is rounded


@pytest.mark.parametrize(("name", "periods", "digits"), [*WHOLE, BETWEEN_DOUBLES, LAST_OF_BITS])
def test_an_event_at_the_end_is_within_the_run(name, periods, digits):
    run = run_of(f"span.periods={periods}", f"want.digits={digits}", name=name)
    assert run(run.events.t).theta == pytest.approx(run.events.theta, abs=1e-14)
    exact = periods * ht.Motion(run.scene.top, run.scene.start).period
    assert abs(run.events.t[-1] + run.events.t_low[-1] - float(exact)) < 1e-14


def test_a_reversal_that_rounding_puts_behind_the_end_is_at_it():
    start = ht.State(theta="pi/5", phidot=0, thetadot="-0.9", psidot=60)
    scene = replace(ht.load_scene("sicm-kicked"), start=start, time=None, periods=ht.Exact.of(1))
    assert ht.propagate(scene).events.count("reversal") == 3


@pytest.mark.parametrize("seed", range(10))
def test_a_start_exactly_on_an_event_counts_however_it_is_rounded(seed):
    source = np.random.default_rng(seed)
    start = ht.State(theta=source.uniform(0.2, 2), phi=source.uniform(-3, 3), psidot=20)
    wants = {"periods": 3, "quantities": ("theta",), "events": ALL}
    events = ht.propagate(ht.Scene(ht.Top(A=1, C="0.5", gMR=1), start, **wants)).events
    assert counts(events) == (7, 0, 4)
    assert events.t[0] == 0
