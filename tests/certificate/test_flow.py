"""The exact solution as a table, held to the elliptic closed form, which shares nothing with it."""

from dataclasses import replace
from types import SimpleNamespace as Fake

import numpy as np
import pytest
import sympy as sp
from flint import arb, arb_poly

from heavytop.certificate.events import zeros
from heavytop.certificate.flow import SETTINGS, Flow
from heavytop.certificate.system import TooCoarse
from heavytop.equations.registry import FORMULATIONS
from heavytop.exact.balls import working
from heavytop.exact.pairs import add, two_product

from ..certificates import flow_of, run_of
from ..motions import product
from ..views import Digits

NUTATING = ("sicm-kicked", "sicm-dropped", "spherical-pendulum", "force-free", "steady-betsch")
RNG = np.random.default_rng(24)


@pytest.mark.parametrize("name", NUTATING)
def test_the_solution_is_that_of_the_elliptic_functions(name):
    """Two enclosures of one motion: by integrating the equations in balls, and in closed form."""
    trajectory = run_of(name)
    _, flow = flow_of(trajectory)
    form = Digits(trajectory.binary_motion.closed_form, 30)
    for t in RNG.uniform(0, flow.period[0], 12):
        exact = form(float(t))
        with working(flow.bits):
            e = flow.table.ball(arb(float(t)))[:3]
            length = sum((x * x for x in e), arb(0)).sqrt()
            for ball, x in zip(e, exact.axis, strict=True):
                assert float(ball.rad()) < 1e-25
                assert abs(float((ball / length - arb(str(x))).mid())) < 1e-25


@pytest.mark.parametrize("form", ["axis", "attitude"])
def test_many_periods_later_it_is_turned(form):
    trajectory = run_of("sicm-kicked", form, periods=1000, digits=9)
    _, flow = flow_of(trajectory)
    exact = Digits(trajectory.binary_motion.closed_form, 30)
    times = RNG.uniform(0, trajectory.orbit.end, 6)
    (high, _), off = flow.at((times, np.zeros(6)))
    for k, t in enumerate(times):
        true = exact(float(t))
        mine, theirs = high[:3, k], true.axis
        if form == "attitude":  # without the uniform turn about the axis
            half = trajectory.orbit.parameters["kappa"] * exact.ctx.mpf(t) / 2
            back = (exact.ctx.cos(half), 0, 0, -exact.ctx.sin(half))
            mine, theirs = high[:4, k], product(true.quaternion, back)
            mine = mine * np.sign(mine @ np.array(theirs, float))
        assert np.allclose(mine, np.array(theirs, float), rtol=0, atol=4e-16)
    assert off.max() < 1e-17


@pytest.mark.parametrize("form", ["axis", "attitude"])
@pytest.mark.parametrize("name", ["sicm-kicked", "force-free", "lie-group-benchmark"])
@pytest.mark.parametrize("periods", [-9.3, 0.7, 40])
def test_the_angles_are_near_those_of_the_elliptic_functions(name, form, periods):
    trajectory = run_of(name, form, periods=periods, samples=2, events=(), digits=6)
    own, flow = flow_of(trajectory)
    times = trajectory.orbit.end * RNG.uniform(0, 1, 2000)
    exact = trajectory.binary_motion.closed_form.at(times)
    near = flow.angles_near(times * own.integrator.pace)
    for angle, x in near.items():
        assert np.max(np.abs(x - getattr(exact, angle))) < np.pi / 2
    assert np.max(np.abs(exact.phi)) <= flow.largest_angle
    assert set(near) == ({"phi"} if form == "axis" else {"phi", "psi"})


@pytest.mark.parametrize(("second", "found"), [("0", [1]), ("0.9", [1, 1.9])])
def test_a_zero_where_two_pieces_meet_is_one_and_two_are_two(second, found):
    """It is found in both pieces, as balls that overlap."""
    x = sp.Symbol("x")
    form = Fake(states=[x], events={"turning": x})
    pieces = [Fake(p=[arb_poly([-arb(at), 1])], error=arb("1e-40")) for at in ("1", second)]
    table = Fake(bounds=Fake(size=1), piece=1.0, reach=arb("1.01"), pieces=pieces)
    rest = {"system": Fake(weights=(1.0,)), "constants": {}, "bits": 192, "exact_period": None}
    assert [float(zero) for zero in zeros(Fake(form=form, table=table, **rest), "turning")] == found


def test_a_flow_that_is_wrong_does_not_close(monkeypatch):
    """Turned by a wrong angle, after a period nothing is where it was."""
    own, _ = flow_of(run_of("sicm-kicked"))
    core = FORMULATIONS["axis"].build(None)
    start = list(own.start[:5])
    angles = Flow.__dict__["_angles"]
    monkeypatch.setattr("heavytop.certificate.flow.SETTINGS", SETTINGS[:1])
    monkeypatch.setattr(Flow, "_angles", lambda self, last: {
        place: 1.000001 * a for place, a in angles(self, last).items()
    })  # fmt: skip
    with pytest.raises(TooCoarse, match="after a period"):
        Flow(core, own.integrator.scaled_constants, start, 3.0, own.period)


def test_the_period_is_proved_whatever_it_is_said_to_be(monkeypatch):
    """One that is said to be too long is found as it is, and none where it is too short."""
    own, flow = flow_of(run_of("sicm-kicked"))
    monkeypatch.setattr("heavytop.certificate.flow.SETTINGS", SETTINGS[:1])
    assert replace(own, period=1.3 * own.period).flow().period == flow.period
    for short in (0.4, 0.8):
        with pytest.raises(TooCoarse, match="period"):
            replace(own, period=short * own.period).flow()


def test_after_many_periods_more_is_told_to_be_off():
    """What the period and the angles may be off counts once a period."""
    _, flow = flow_of(run_of("sicm-kicked"))
    times = (np.array([k * flow.period[0]]) for k in (0.5, 1e15 + 0.5))
    early, late = (flow.at((t, np.zeros(1)))[1] for t in times)
    assert early < 1e-17
    assert late - early >= 1e15 * flow.off_a_period * flow.bounds.speed > 1e-17


@pytest.mark.parametrize("periods", [1e3, 1e8, -1e8])
def test_many_whole_periods_later_it_is_at_a_turning_point(periods):
    """Whether a time is just before or just after one, its double does not tell."""
    _, flow = flow_of(run_of("sicm-kicked", periods=3))
    n = periods + np.arange(-200.0, 200)
    whole = two_product(n, flow.period[0])
    t = add(whole, (n * flow.period[1], np.zeros_like(n)))
    for off in (-0.4, 0.0, 0.4):
        aside = off * np.spacing(np.abs(whole[0]))
        (high, _), _ = flow.at(add(t, (aside, np.zeros_like(n))))
        assert np.max(np.abs(high[2] - flow.start[2])) < 1e-15
