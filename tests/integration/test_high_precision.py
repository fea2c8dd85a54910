"""Runs in long double and in any number of bits, against the closed form at their own digits."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.integration import outputs
from heavytop.integration.bits import LONG_DOUBLE
from heavytop.integration.high_precision import PreciseIntegrator, Unfinished
from heavytop.numbers import Exact
from heavytop.results.run import RunResult, run_result
from heavytop.run.estimates import Forecast
from heavytop.run.planning import plan
from heavytop.run.verify import deviations, missed_digits

ALL = 'want.quantities=["theta", "phi", "psi", "axis"]'
NONE = "want.events=[]"

if LONG_DOUBLE != 64:
    pytest.skip("long double here is not that of x86", allow_module_level=True)


def scene(digits, *overrides, name="sicm-kicked"):
    wanted = [f"want.digits={digits}", "want.samples=7", *overrides]
    return ht.load_scene(name, overrides=wanted)


def exactly(run, digits):
    """Return the closed form of the scene's exact numbers, and its numbers' type."""
    form = ht.Motion(run.scene.top, run.scene.start).form(digits)
    return form, form.ctx


@pytest.mark.parametrize("digits", [14, 15, 17, 33, 60, 100])
def test_every_digit_asked_for_is_right(digits):
    """Of theta, phi, psi and the axis, at every sample, relative to max(1, |x|)."""
    run = ht.propagate(scene(digits, "span.time=3", ALL))
    truth, ctx = exactly(run, digits + 20)
    bound = ctx.mpf(10) ** -digits
    assert len(run.decimals.samples) == 7
    for sample in run.decimals.samples:
        exact = truth(ctx.mpf(sample.t))
        pairs = [(getattr(sample, n), getattr(exact, n)) for n in ("theta", "phi", "psi")]
        for mine, true in (*pairs, *zip(sample.axis, exact.axis, strict=True)):
            assert abs(ctx.mpf(mine) - true) <= bound * max(1, abs(true))
    assert missed_digits(run, ht.run_errors(run)) == {}
    assert run.decimals.samples[-1].t == 3


def test_the_bound_is_not_slack():
    """The errors are those of the bits: a run in fewer bits would be seen."""
    run = ht.propagate(scene(60, "span.time=3", NONE))
    assert run.plan.precision == "256 bits"
    errors = ht.run_errors(run)
    for error in (errors.theta, errors.phi, errors.psi):
        assert 1e-79 < error < 1e-74
    assert 1e-78 < errors.input_rounding < 1e-73


def test_the_errors_that_are_drawn_are_against_the_numbers_of_more_digits():
    """Doubles round the start, and what that does to this motion is a million times as much."""
    found = deviations(ht.propagate(scene(30, NONE, name="near-separatrix")))
    assert max(found[name].max() for name in ("theta", "axis")) < 1e-14


def test_plans_name_the_precision():
    precision = {d: plan(scene(d)).precision for d in (13, 14, 30, 60, 1000)}
    names = ("double", "long double", "128 bits", "256 bits", "3392 bits")
    assert tuple(precision.values()) == names
    assert plan(scene(60)).tolerance == 2.0**-255
    motion = ht.Motion(scene(70).top, scene(70).start)
    far, near = (Forecast(scene(70), motion, end).bits("axis") for end in (1e6, 1.0))
    assert far > near


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_every_formulation_at_forty_digits(formulation):
    tilt = 'want.quantities=["theta"]' if formulation == "cubic" else ALL
    run = ht.propagate(scene(40, "span.time=1", tilt), formulation=formulation)
    assert missed_digits(run, ht.run_errors(run)) == {}
    assert ht.run_errors(run).energy < 1e-50
    assert run.events.kind[:3] == ("theta_min", "reversal", "theta_max")


KINDS = (
    "sicm-dropped lie-group-benchmark through-top through-bottom separatrix near-separatrix "
    "sleeping steady-betsch planar-pendulum inverted-gravity"
)


@pytest.mark.parametrize("name", KINDS.split())
def test_every_kind_of_motion_at_thirty_digits(name):
    run = ht.propagate(scene(30, name=name))
    errors = ht.run_errors(run)
    assert missed_digits(run, errors) == {}
    assert errors.theta < 1e-30
    if len(run.events):
        assert errors.event_time < 1e-30


def test_what_a_formulation_does_not_give_is_nan_as_in_doubles():
    run = ht.propagate(scene(40, "span.time=1", 'want.quantities=["theta"]'), formulation="cubic")
    end = run.decimals.samples[-1]
    for numbers in (end.phi, end.psi, *end.axis[:2], *end.omega, *end.quaternion):
        assert numbers != numbers
        assert run.decimals.text(numbers) is None
    assert abs(end.axis[2] - run.decimals.ctx.cos(end.theta)) < 1e-45
    final = run_result(run).final
    assert final["phi"] is final["phi_turns"] is final["axis"][0] is None
    assert run.to_xarray()["phi_text"].to_numpy().tolist() == [""] * 7
    assert run(np.array([])).axis.shape == (0, 3)


@pytest.mark.parametrize("formulation", ["axis", "attitude", "lagrange", "routh"])
def test_samples_in_more_digits_are_those_of_the_same_formulas_in_doubles(formulation):
    """Every column, vectors and attitude too, from the states of the run, rounded or not."""
    run = ht.propagate(scene(30, "span.time=1", ALL), formulation=formulation)
    form, states = run.orbit.integrator.formulation, run.samples.states
    again = outputs.sample(form, states, run.orbit.parameters, run.t)
    for name in ht.Sample.__slots__:
        assert getattr(again, name) == pytest.approx(getattr(run.samples, name), abs=1e-11), name


def test_events_have_all_digits():
    run = ht.propagate(scene(60, "span.time=3"))
    truth, ctx = exactly(run, 80)
    turning = [e for e in run.decimals.events if e.kind.startswith("theta")]
    assert len(turning) == 12
    for n, event in enumerate(turning):  # released at a turning point
        assert abs(ctx.mpf(event.sample.t) - n * truth.period / 2) < ctx.mpf(10) ** -70
    reversals = [e.sample for e in run.decimals.events if e.kind == "reversal"]
    assert len(reversals) == 11
    assert all(abs(truth(ctx.mpf(s.t)).phidot) < ctx.mpf(10) ** -70 for s in reversals)
    assert run.events.t.tolist() == [float(e.sample.t) for e in run.decimals.events]


@pytest.mark.parametrize("formulation", ["axis", "attitude"])
@pytest.mark.parametrize("digits", [20, 30])
def test_in_a_pass_through_the_pole_phi_is_that_before_or_after(digits, formulation):
    """A quarter of a turn from the middle between the turning points beside it, either way."""
    run = ht.propagate(scene(digits, name="through-top"), formulation=formulation)
    phi = run.events.phi
    passes = np.flatnonzero(np.array(run.events.kind[1:-1]) == "theta_min") + 1
    assert passes.size > 3
    middle = (phi[passes - 1] + phi[passes + 1]) / 2
    assert abs(phi[passes] - middle) == pytest.approx(np.pi / 2, abs=1e-9)


def test_cusps_are_cusps_at_any_number_of_digits():
    run = ht.propagate(scene(40, name="sicm-dropped"))
    assert run.events.count("cusp") == 5
    assert run.events.count("reversal") == 0


@pytest.mark.filterwarnings("ignore::heavytop.errors.DoubtfulWarning")
@pytest.mark.parametrize(("phidot", "reversals"), [("-1e-20", 9), ("1e-20", 0)])
def test_what_doubles_take_for_a_cusp_is_told_apart(phidot, reversals):
    """Reversals lie 2e-12 s about the turning point, where doubles see one double root."""
    near = scene(30, f"start.phidot={phidot}", name="sicm-dropped")
    run = ht.propagate(near)
    assert run.events.count("cusp") == 0
    assert run.events.count("reversal") == reversals
    assert ht.propagate(replace(near, digits=12)).events.count("cusp") == 5
    _, ctx = exactly(run, 50)
    for event in run.decimals.events:
        if event.kind == "reversal":
            assert abs(event.sample.phidot) < ctx.mpf(10) ** -30


def test_close_passes_turn_the_right_way():
    """Past the bottom at 7e-7 rad: phi turns by half a turn in 1e-7 s, hundreds of times."""
    run = ht.propagate(scene(30, "span.periods=300.3", NONE, name="lie-group-benchmark"))
    assert missed_digits(run, ht.run_errors(run)) == {}


def test_a_decimal_means_itself():
    """0.1 s is not the double 0.1, nor is any number of the scene."""
    run = ht.propagate(scene(40, "span.time=0.1", NONE))
    _, ctx = exactly(run, 60)
    assert abs(ctx.mpf(run.decimals.samples[-1].t) - ctx.mpf("0.1")) < ctx.mpf(10) ** -50
    assert run.decimals.text(run.decimals.samples[-1].t) == "0.1"


@pytest.fixture(scope="module")
def whole():
    return ht.propagate(scene(30, "span.time=7", "want.samples=15"))


def same(one, other):
    return [s.states for s in one.samples] == [s.states for s in other.samples]


def test_neither_sampling_nor_asking_again_nor_extending_changes_anything(whole):
    seen = whole.decimals.samples
    other = ht.propagate(replace(whole.scene, samples=3)).decimals.samples
    assert [s.states for s in other] == [s.states for s in seen[::7]]
    again = whole.decimals.at([s.t for s in seen[::-1]])[::-1]
    assert [(s.states, s.phi) for s in again] == [(s.states, s.phi) for s in seen]
    part = ht.propagate(replace(whole.scene, time=Exact.of("3.5"), samples=8))
    longer, uneven = ht.extend(part, 7), ht.extend(part, 7, samples=2)
    assert same(longer.decimals, whole.decimals)
    assert longer.events.t.tolist() == whole.events.t.tolist()
    assert uneven.t.tolist() == [*part.t.tolist(), 5.25, 7.0]
    assert uneven.decimals.samples[-1].states == seen[-1].states


def test_the_trajectory_is_the_decimals_rounded(whole):
    assert whole.theta.tolist() == [float(s.theta) for s in whole.decimals.samples]
    assert whole(whole.t[3]).theta == whole.theta[3]
    assert whole.statistics.order > 40


def test_a_stored_run_is_the_run(whole, tmp_path):
    whole.save(tmp_path / "run.nc")
    ht.propagate(scene(12, "start.phidot=-150"))  # the compiled loop is shared
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    for name in ("samples", "events", "longest"):
        assert repr(getattr(loaded.decimals, name)) == repr(getattr(whole.decimals, name))
    assert loaded.events.t.tolist() == whole.events.t.tolist()
    assert loaded(3.3).theta == whole(3.3).theta
    assert loaded.statistics.steps == whole.statistics.steps
    data, last = whole.to_xarray(), whole.decimals.samples[-1]
    assert data["theta_text"].to_numpy()[-1] == whole.decimals.text(last.theta)
    assert len(str(data["event_t_text"].to_numpy()[3])) > 30


def test_documents_spell_decimals_out(whole):
    document = run_result(whole).document()
    theta = document["final"]["theta"]
    assert isinstance(theta, str)
    truth, ctx = exactly(whole, 50)
    assert abs(ctx.mpf(theta) - truth(7).theta) < ctx.mpf(10) ** -30
    psi = ctx.mpf(document["final"]["psi"])
    back = document["final"]["psi_turns"] * 2 * ctx.pi + ctx.mpf(document["final"]["psi_mod"])
    assert abs(psi - back) < ctx.mpf(10) ** -27 * abs(psi) / 100
    assert isinstance(document["events"]["table"][1]["t"], str)
    assert isinstance(document["errors"]["theta"], float)
    assert document["plan"]["precision"] == "128 bits"
    fifteen = run_result(ht.propagate(replace(whole.scene, digits=15, time=Exact.of(1))))
    assert isinstance(fifteen.final["theta"], float)


def test_a_result_is_read_back_as_it_was(whole, tmp_path):
    found = run_result(whole, files={"document": "run.json"})
    found.save(tmp_path / "run.json")
    assert RunResult.load(tmp_path / "run.json").document() == found.document()


def test_projection_is_for_doubles():
    with pytest.raises(ht.BadScene, match="only in double precision"):
        ht.propagate(scene(30), projected=True)


def test_leaving_the_finite_numbers_is_said():
    form = FORMULATIONS["routh"].build()
    constants = dict.fromkeys((p.name for p in form.parameters), "1")
    engine = PreciseIntegrator(form, 128, constants)
    with pytest.raises(Unfinished):
        engine.walk(engine.start(["0", "0"]), [("1", None)], 10.0)


def test_an_event_that_is_none_is_not_found():
    form = FORMULATIONS["axis"].build()
    constants = {p.name: "1" for p in form.parameters} | {"g": "0"}
    engine = PreciseIntegrator(form, 128, constants, ["reversal"])
    start = engine.start(["0", "-0.6", "0.8", "0", "0"])  # l along the vertical: theta is constant
    found, _ = engine.walk(start, [("0.5", "reversal"), ("0.5", None)], 10.0)
    assert found[0] is None
    assert np.isclose(float(found[1].state[0]), 0.6 * np.sin(0.5))


def cubic(bits):
    form = FORMULATIONS["cubic"].build("top")
    return PreciseIntegrator(form, bits, {f"k_{i}": "1" for i in range(3)})


def test_steps_do_not_go_back():
    engine = cubic(128)
    start = engine.start(["0.1", "0"])
    for t, far in (("-0.5", 10.0), ("0.5", -10.0)):
        with pytest.raises(ValueError, match="before the mark"):
            engine.walk(start, [(t, None)], far)


@pytest.mark.parametrize("bits", [LONG_DOUBLE, 128])
def test_texts_hold_every_bit(bits):
    engine = cubic(bits)
    third = engine.number("1") / engine.number("3")
    assert engine.number(engine.text(third)) == third


def test_no_times_give_no_rows_of_every_width():
    doubles, decimals = (
        ht.propagate(ht.load_scene("sicm-kicked", [d])) for d in ("want.digits=9", "want.digits=20")
    )
    assert decimals.decimals is not None
    for trajectory in (doubles, decimals):
        one, none = trajectory(np.array([0.5])), trajectory(np.empty(0))
        for name in one.__slots__:
            assert getattr(none, name).shape == (0, *getattr(one, name).shape[1:])
