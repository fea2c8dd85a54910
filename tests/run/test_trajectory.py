"""A trajectory asked for any time, and stored and read back: the same bits, in more digits too."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import Impossible, NotANumber
from heavytop.integration import outputs
from heavytop.results.run import RunResult, run_result

ALL = 'want.quantities=["theta", "phi", "psi", "axis"]'


@pytest.fixture(scope="module")
def whole():
    return ht.propagate(ht.load_scene("sicm-kicked", ["span.time=400"]))


@pytest.fixture(scope="module")
def precise():
    changes = [ALL, "want.digits=30", "span.time=7", "want.samples=15"]
    return ht.propagate(ht.load_scene("sicm-kicked", changes))


def same(a, b):
    return np.array_equal(a, b, equal_nan=True)


def test_dense_output_is_the_samples(whole):
    shuffled = np.random.default_rng(7).permutation(whole.t)
    again, order = whole(shuffled), np.argsort(shuffled)
    for name in again.__slots__:
        assert same(getattr(again, name)[order], getattr(whole.samples, name)), name


def test_dense_output_in_more_digits_is_the_same_run_rounded(precise):
    decimals = precise.decimals
    again = decimals.at([s.t for s in decimals.samples][::-1])
    assert [s.states for s in again[::-1]] == [s.states for s in decimals.samples]
    assert [s.phi for s in again[::-1]] == [s.phi for s in decimals.samples]
    assert precise.theta.tolist() == [float(s.theta) for s in decimals.samples]
    assert precise(precise.t[3]).theta == precise.theta[3]
    assert precise.statistics.order > 40


@pytest.mark.parametrize("formulation", ["axis", "attitude", "lagrange", "routh"])
def test_samples_in_more_digits_are_those_of_the_same_formulas_in_doubles(formulation):
    """Every column, vectors and attitude too, from the states of the run, rounded or not."""
    changes = [ALL, "want.digits=30", "span.time=1", "want.samples=7"]
    run = ht.propagate(ht.load_scene("sicm-kicked", changes), formulation=formulation)
    form, states = run.orbit.integrator.formulation, run.samples.states
    again = outputs.sample(form, states, run.orbit.parameters, run.t)
    for name in ht.Sample.__slots__:
        assert getattr(again, name) == pytest.approx(getattr(run.samples, name), abs=1e-11), name


def test_what_a_formulation_does_not_give_is_nan_as_in_doubles():
    changes = ["want.digits=40", "span.time=1", 'want.quantities=["theta"]', "want.samples=7"]
    run = ht.propagate(ht.load_scene("sicm-kicked", changes), formulation="cubic")
    end = run.decimals.samples[-1]
    for numbers in (end.phi, end.psi, *end.axis[:2], *end.omega, *end.quaternion):
        assert numbers != numbers
        assert run.decimals.text(numbers) is None
    assert abs(end.axis[2] - run.decimals.ctx.cos(end.theta)) < 1e-45
    assert run.phi is run.psi is None
    final = run_result(run).final
    assert final["phi"] is final["phi_turns"] is final["axis"][0] is None
    assert run.to_xarray()["phi_text"].to_numpy().tolist() == [""] * 7


def test_times_that_are_refused_and_none(whole, precise):
    for trajectory in (whole, precise):
        one, none = trajectory(np.array([0.5])), trajectory(np.empty(0))
        for name in one.__slots__:
            assert getattr(none, name).shape == (0, *getattr(one, name).shape[1:])
        for t in (-1e-9, trajectory.t[-1] + 1e-6):
            with pytest.raises(Impossible, match="where the trajectory was integrated"):
                trajectory(t)
        for t in ("soon", np.nan, [[1.0]]):
            with pytest.raises(NotANumber, match="a finite time"):
                trajectory(t)


def test_documents_spell_decimals_out(precise, tmp_path):
    result = run_result(precise, files={"document": "run.json"})
    document, truth = result.document(), precise.motion.form(50)
    final, ctx = document["final"], truth.ctx
    assert abs(ctx.mpf(final["theta"]) - truth(7).theta) < ctx.mpf(10) ** -30
    psi = ctx.mpf(final["psi"])
    back = final["psi_turns"] * 2 * ctx.pi + ctx.mpf(final["psi_mod"])
    assert abs(psi - back) < ctx.mpf(10) ** -27 * abs(psi) / 100
    assert isinstance(document["events"]["table"][1]["t"], str)
    assert isinstance(document["errors"]["rates"], float)
    assert document["plan"]["precision"] == "128 bits"
    result.save(tmp_path / "run.json")
    assert RunResult.load(tmp_path / "run.json").document() == document
    fifteen = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=15", "span.time=1"]))
    assert isinstance(run_result(fifteen).final["theta"], float)
