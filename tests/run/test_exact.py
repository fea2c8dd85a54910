"""Spans that would take hours of steps: the closed form answers, and a run says so."""

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht
from heavytop.exact.decimals import context
from heavytop.run.counts import count_exactly
from heavytop.run.planning import MANY_PERIODS, MOST_S, plan_steps
from heavytop.scene.scene_file import EVENTS
from heavytop.studies import certificate
from heavytop.studies.methods import plan_auto

from ..commands import document, names, printed, refused

FAR = ("sicm-kicked", "--set", "span.periods=1e12")


def kicked(periods, **wants):
    return replace(ht.load_scene("sicm-kicked", [f"span.periods={periods}"]), **wants)


@pytest.fixture(scope="module")
def far(tmp_path_factory):
    """The folder of a run of 1e12 periods, and its document."""
    folder = tmp_path_factory.mktemp("far") / "run"
    return folder, document("run", *FAR, "-o", folder)


# --- the plan --------------------------------------------------------------------------------


def test_nothing_is_integrated_beyond_an_hour_of_steps():
    hour = MOST_S / ht.plan(kicked(1e8)).seconds * 1e8  # periods
    below, beyond = ht.plan(kicked(0.99 * hour)), ht.plan(kicked(1.01 * hour))
    assert (below.formulation, below.projected) == ("axis", True)
    assert (beyond.formulation, beyond.states, beyond.seconds) == ("none", 0, 0.0)
    assert beyond.reasons[-1].endswith("periods take 1.01 h")
    # but a million periods however long they take
    digits = {"digits": 30, "events": ()}
    assert ht.plan(kicked(0.999 * MANY_PERIODS, **digits)).seconds > MOST_S
    assert ht.plan(kicked(1.001 * MANY_PERIODS, **digits)).formulation == "none"
    assert ht.plan(ht.load_scene("sicm-kicked", ["want.digits=1000"])).formulation == "axis"
    still = ht.plan(ht.Scene(ht.Top(1, 1, 1), ht.State(0), time=1e299))  # takes a step or two
    assert (still.formulation, still.precision) == ("axis", "double")


def test_who_asks_for_steps_gets_them(monkeypatch):
    """A form by name, a projected state, auto in studies, and certificates."""
    scene = kicked(1e12)
    assert ht.plan(scene, "attitude").formulation == "attitude"
    for chosen in (ht.plan(scene, projected=True), plan_steps(scene)):
        assert (chosen.formulation, chosen.precision, chosen.projected) == ("axis", "double", True)
    assert plan_auto("auto", scene, 1e12).text == "taylor-axis-projected"
    options = []
    monkeypatch.setattr(certificate, "propagate", lambda scene, **how: options.append(how))
    certificate.run_in_doubles(scene)
    assert options == [{"formulation": "attitude", "projected": True}]


# --- what a run says -------------------------------------------------------------------------


@pytest.mark.parametrize("digits", [12, 40])
def test_the_end_is_that_of_the_closed_form_at_more_digits(digits):
    found, scene, ctx = document("run", *FAR, "--digits", digits), kicked(1e12), context(120)
    final, motion = found["final"], ht.Motion(scene.top, scene.start)
    exact = motion.at(10**12 * motion.mpf("period", 120), 110)
    bound = 10.0 ** -(min(digits, 16) - 2)
    for name in ("phi", "psi"):
        whole = final[f"{name}_turns"] * 2 * ctx.pi + ctx.mpf(final[f"{name}_mod"])
        assert abs(whole - getattr(exact, name)) < (1e-14 if digits < 16 else 10.0 ** (1 - digits))
    for name in ("theta", "thetadot", "phidot", "psidot"):
        assert abs(ctx.mpf(final[name]) - getattr(exact, name)) < 200 * bound
    for name in ("axis", "omega", "quaternion"):
        assert np.allclose([float(x) for x in final[name]], np.array(getattr(exact, name), float))
    assert isinstance(final["theta"], str if digits > 15 else float)
    assert found["missed_digits"] == found["missed_events"] == {}


def test_a_run_says_that_nothing_was_integrated(far):
    """It starts at a turning point and ends at one, 1e12 periods later; both count."""
    folder, found = far
    assert (found["source"], found["plan"]["formulation"]) == ("closed form", "none")
    assert (found["outcome"], found["cost"]["steps"]) == ("finished", 0)
    errors, events = found["errors"], found["events"]
    assert (errors.pop("why_not"), errors.pop("invariants")) == ("nothing was integrated", {})
    assert set(errors.values()) == {None}
    assert [events[name] for name in (*EVENTS, "table")] == [2 * 10**12 + 1, 2 * 10**12, 0, []]
    assert {"overview.svg", "angles.png", "phase.svg"} <= names(folder)
    assert names(folder) == {*found["files"].values()}
    assert not any(name.startswith("errors") for name in names(folder))


def test_what_is_not_decided_is_not_counted(monkeypatch):
    scene = kicked(1e12)
    motion = ht.Motion(scene.top, scene.start)
    monkeypatch.setattr(ht.Motion, "doubt", "P_minus")
    assert count_exactly(motion, context(60).mpf(10), EVENTS) == {}


# --- its folder ------------------------------------------------------------------------------


def test_film_report_check_and_resume_take_its_folder(far, tmp_path):
    folder = far[0]
    assert document("check", folder, "--digits", 15)["data"]["span"][0] == 0
    printed("film", folder, "-o", tmp_path / "x.gif", "--seconds", 1, "--size", "80x64")
    printed("report", folder, "-o", tmp_path / "page.html")
    assert "this run is finished" in refused(0, "resume", folder)
    assert document("run", folder, "--set", "span.periods=2")["events"]["turning"] == 5


def test_no_trajectory_is_read_from_it(far):
    with pytest.raises(ht.ForeignFile, match=r"nothing was integrated.* heavytop\.Motion"):
        ht.load_trajectory(far[0] / "trajectory.nc")
    refused(3, "certify", far[0])
