"""Stress: what a case allows, what is counted, how a run is judged: each against another way."""

import math
import os
from dataclasses import replace

import pytest

import heavytop as ht
from heavytop.comparison import user
from heavytop.comparison.adaptive import right_hand_side, scipy_stepper
from heavytop.comparison.steppers import InitialValueProblem
from heavytop.equations.formulation import FORMULATIONS
from heavytop.results.stress import StressOutcome, silently_wrong
from heavytop.run.binary_motion import binary_start
from heavytop.run.plan import closed_form_of
from heavytop.studies.methods import stress_method, stress_methods
from heavytop.studies.stress_cases import CaseReference, cases, reference
from heavytop.studies.stress_runs import CaseRun, judge, miscounted_events, prepare

from ..integrators import raises

TURNING = ("through-", "planar", "near-", "start-", "falling-", "separatrix-", "spin-1e7")


def found(case, method, step_limit=200_000):
    truth, chosen = reference(case), stress_method(method)
    return judge(prepare(cases()[case], chosen, truth, step_limit)(), truth, case, chosen)


def verdict(result, truth, method="auto"):
    return judge(result, truth, "a case", stress_methods()[method])


# --- what a case allows ----------------------------------------------------------------------


# From the largest of state-transition matrices of the axis form, by variational equations that
# heyoka integrated; they count a change of the length of the axis too, which no motion has
@pytest.mark.parametrize(("name", "condition"), {
    "through-top": 33.39, "lie-group": 9.127, "separatrix-40": 8.046e8, "kicked-fast-1e10": 3.29,
    "hundred-periods": 404.1,
}.items())  # fmt: skip
def test_the_condition_is_that_of_integrated_variational_equations(name, condition):
    assert 0.9 < reference(name).condition / condition < 1.01


# --- how a run is judged ---------------------------------------------------------------------

HERE = CaseReference(1.0, 0.6, (0.0, -0.6, 0.8), 10.0, {"turning": (3, 3)}, None)


def arrived(off=0.0, **more):
    return CaseRun(axis=(off, -0.6, 0.8), **({"counted": {"turning": 3}} | more))


@pytest.mark.parametrize(("word", "runs"), {
    "ok": [arrived(1e-10), arrived(message="a doubt")],
    "inaccurate": [arrived(1e-6)],
    "diverged": [arrived(math.nan), CaseRun(theta=0.7 + 1e-12)],
    "missed-events": [arrived(counted={"turning": 2})],
    "refused": [CaseRun(StressOutcome.REFUSED, "no")],
    "step-limit": [CaseRun(StressOutcome.STEP_LIMIT)],
}.items())  # fmt: skip
def test_every_outcome_has_one_rule(word, runs):
    for raw in runs:
        finding = verdict(raw, HERE)
        assert finding.outcome == word
        assert finding.named == (raw.message != "" or word == "step-limit")
        assert word == "ok" or finding.note or raw.message == ""


def test_a_fixed_step_is_held_to_its_order_and_its_length():
    """Of order 4, a hundred steps a period allow (2 pi/100)^4 times the condition, which is 10."""
    allowed = (math.tau / 100) ** 4
    tried = [(1e-3, allowed), (5e-2, allowed), (1e-3, allowed**2)]
    outcomes = [verdict(arrived(off, step_error=step), HERE).outcome for off, step in tried]
    assert outcomes == ["ok", "inaccurate", "inaccurate"]


def test_what_the_code_of_a_method_does_wrong_is_called_that():
    wrong = {raises: "METHOD_ERROR", (lambda f, y, h: y + h * f(y)): "DIVERGED"}
    for function, outcome in wrong.items():
        assert found("ten-periods", user.register(function)).outcome is StressOutcome[outcome]


def test_what_is_right_where_no_digits_are_left_is_chance_unless_there_are_more_bits():
    undetermined = CaseReference(80.0, 0.0, (0.0, 0.0, 1.0), 1e16, None, None)
    assert undetermined.digits == 0 < HERE.digits
    lost = verdict(CaseRun(axis=(0.6, 0.0, 0.8)), undetermined)
    assert (lost.outcome, lost.digits_lost) == (StressOutcome.DIVERGED, 0.0)
    lucky = CaseRun(axis=(1e-9, 0.0, 1.0))
    finding = verdict(lucky, undetermined)
    assert (finding.outcome, finding.untold) == (StressOutcome.OK, True)
    assert "undetermined: no digits are left" in finding.note
    assert not verdict(lucky._replace(more_bits=True), undetermined).untold


def test_whole_turns_of_phi_and_psi_are_seen_though_the_axis_does_not_see_them():
    here = replace(HERE, angles=(7.0, -40.0))
    turned = arrived(angles=(7.0 - 2 * math.tau, -40.0))
    finding = verdict(turned, here)
    assert (finding.outcome, finding.turns) == (StressOutcome.OK, (-2, 0))
    assert finding.note == "φ is off by -2 turns"
    finding = verdict(turned, here, "auto-angles")
    assert (finding.outcome, finding.error) == (StressOutcome.DIVERGED, pytest.approx(2 * math.tau))
    near = verdict(arrived(angles=(7.0 + 6e-14, -40.0)), here, "auto-angles")
    assert (near.outcome, near.digits_lost, near.turns) == (StressOutcome.OK, 0.0, (0, 0))
    assert here.of_angles().condition == pytest.approx(10 / 0.6 + 47)


def test_a_finder_of_sign_changes_may_see_cusps_or_not_but_nothing_between():
    counts = {"turning": (6, 6), "reversal": (0, 0), "cusp": (3, 3)}
    said = [miscounted_events({"turning": 6, "reversal": n}, counts) for n in (0, 1, 3, 2, 4)]
    assert said == ["", "", "", "2 reversal, not 0", "4 reversal, not 0"]
    three = {"turning": 6, "reversal": 1, "cusp": 3}
    assert miscounted_events(three, counts) == "1 reversal, not 0"


# --- the runs themselves ---------------------------------------------------------------------


BY_AUTO = [(name, "auto") for name in cases() if name != "1e5-periods"]
BY_AUTO += [(name, "auto-angles") for name in cases() if name.startswith(TURNING)]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), BY_AUTO)
def test_auto_is_never_silently_wrong(name, method):
    finding = found(name, method)
    assert not silently_wrong(finding), finding


# from what others measured with other programs, before this one was written
@pytest.mark.slow
@pytest.mark.parametrize(("pair", "outcome"), {
    ("through-top", "taylor-lagrange"): StressOutcome.SINGULAR,
    ("start-at-top", "taylor-lagrange"): StressOutcome.REFUSED,
    ("start-at-top", "dop853-scipy-lagrange"): StressOutcome.SINGULAR,
    ("through-top", "lsoda-scipy-lagrange"): StressOutcome.INACCURATE,
    ("near-top-1e-12", "taylor-lagrange"): StressOutcome.INACCURATE,
    ("separatrix-80", "taylor-axis"): StressOutcome.DIVERGED,
    ("ten-periods", "solve-ivp-defaults"): StressOutcome.INACCURATE,
    ("kick-1e-6", "dop853-scipy"): StressOutcome.MISSED_EVENTS,
    ("cusp", "dop853-scipy"): StressOutcome.OK,
    ("sleeping-1+1e-8", "gauss8"): StressOutcome.STALLED,
}.items())  # fmt: skip
def test_what_is_known_to_fail_fails_so(pair, outcome):
    assert found(*pair).outcome is outcome


@pytest.mark.parametrize("form", FORMULATIONS)
def test_away_from_poles_every_form_keeps_its_digits(form):
    finding = found("ten-periods", f"taylor-{form}")
    assert (finding.outcome, finding.digits_lost < 1.0) == (StressOutcome.OK, True)


def test_the_step_limit_is_kept_by_everybody():
    for method in ("taylor-axis", "dop853-scipy", "gauss8"):
        assert found("hundred-periods", method, 300).outcome is StressOutcome.STEP_LIMIT


@pytest.mark.parametrize("solver", ["RK45", "DOP853", "LSODA", "Radau"])
def test_a_solver_that_is_called_once_does_what_solve_ivp_does(solver):
    from scipy.integrate import solve_ivp

    parameters, start = binary_start(cases()["cusp"], ht.Plan("lagrange"))
    state, seen = tuple(start.state.tolist()), []
    problem = InitialValueProblem(FORMULATIONS["lagrange"].build(), parameters, state, period=0.9)
    stepper = scipy_stepper(solver, problem, 1e-6, 0, atol=1e-9, guarded=False)
    last = replace(stepper, on_steps=seen.append).block(stepper.begin())
    [taken] = seen
    assert last.time == (0.9, 0.0)
    ours = solve_ivp(right_hand_side(problem), (0, 0.9), start.state, method=solver,
                     rtol=1e-6, atol=1e-9)  # fmt: skip
    assert taken.times.tolist() == ours.t.tolist()
    assert taken.states.tolist() == ours.y.T.tolist()


# --- what auto says --------------------------------------------------------------------------


def test_the_time_is_named_at_which_doubles_have_lost_the_vertical():
    """It is 53 ln 2 over the growth rate, 1/2."""
    assert "t = 73.5 s" in ht.plan(cases()["separatrix-3000"]).warnings[-1]
    assert not ht.plan(cases()["separatrix-40"], "axis").warnings


# --- limits ----------------------------------------------------------------------------------


@pytest.mark.processes
def test_a_process_that_is_lost_is_not_the_methods_fault(monkeypatch):
    monkeypatch.setattr("heavytop.studies.stress.run_task", os.abort)
    monkeypatch.setattr("heavytop.studies.stress.reference", lambda name: None)
    [skipped] = ht.stress(cases=["cusp"], methods=["auto"]).skipped
    assert skipped.lost
    assert "abort() takes no arguments" in skipped.reason


@pytest.mark.slow
@pytest.mark.processes
def test_lsoda_does_not_return_from_the_pole_and_the_test_goes_on():
    """What goes on takes a hundredth of a second, so that the limit is far on any machine."""
    methods = ["lsoda-scipy-lagrange", "taylor-axis"]
    got = ht.stress(cases=["start-at-top"], methods=methods, time_limit=4.0)
    assert [str(run.outcome) for run in got.cases] == ["time-limit", "ok"]
    [killed, _] = got.cases
    assert (killed.case, killed.note) == ("start-at-top", "killed: it did not return within 4 s")


@pytest.mark.processes
def test_a_set_up_that_does_not_return_is_named_with_its_own_limit(monkeypatch):
    monkeypatch.setattr("heavytop.studies.stress.SET_UP_S", 0.01)
    [run] = ht.stress(cases=["cusp"], methods=["auto"]).cases
    assert (run.outcome, run.note) == ("time-limit", "killed: it did not return within 0.01 s")


@pytest.mark.processes
def test_nothing_is_begun_after_the_budget_and_what_is_left_is_named():
    got = ht.stress(cases=["cusp"] * 2, methods=["auto", "taylor-axis", "auto"], budget=0.0)
    assert (got.cases, [s.method for s in got.skipped]) == ((), ["auto", "taylor-axis"])
    methods = ["lsoda-scipy-lagrange", "lsoda-scipy"]
    one = ht.stress(cases=["start-at-top"], methods=methods, budget=1.0, time_limit=2.0)
    assert [str(run.outcome) for run in one.cases] == ["time-limit"]  # begun within the budget
    assert [s.reason for s in one.skipped] == ["the budget was spent"]


def test_a_test_that_is_resumed_has_the_budget_it_was_begun_with(tmp_path):
    ht.stress(cases=["cusp"], methods=["auto"], budget=0, folder=tmp_path)
    assert ht.resume(tmp_path).limits["budget_s"] == 0
    ht.stress(cases=["cusp"], methods=["auto"], budget=60, folder=tmp_path)  # it may be changed
    assert ht.resume(tmp_path).limits["budget_s"] == 60


def test_the_cases_are_those_that_were_asked_for():
    motions = {name: closed_form_of(case) for name, case in cases().items()}
    for power in (2, 6, 12):
        assert motions[f"near-top-1e-{power}"].from_top == pytest.approx(10.0**-power, rel=0.02)
    assert motions["near-bottom-1e-6"].from_bottom == pytest.approx(1e-6, rel=0.02)
    kinds = {
        "through-top": "through-top", "through-bottom": "through-bottom",
        "steady+0": "uniform-precession", "separatrix-10": "separatrix",
        "kick+1e-15": "waves", "kick-1e-15": "loops",
    }  # fmt: skip
    assert {name: str(motions[name].kind) for name in kinds} == kinds
    for power in range(2, 8):
        fast = cases()[f"spin-1e{power}"]
        assert float(fast.start.omega3) == 10.0**power
        assert float(fast.top.C * fast.start.omega3) == pytest.approx(4.0, rel=1e-14)
    pushed = [motions[f"sleeping-1{sign}1e-{p}"] for sign in "+-" for p in (4, 8, 12)]
    assert all(float(motion.at(20.0).theta) > 1.8e-5 for motion in pushed)  # 1e-6 when it starts
