"""Every method of others has the order, the invariants and the accuracy its literature claims."""

import json
import math
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from mpmath import mpf, workdps

from heavytop.cli import Exit, exit_code
from heavytop.comparison import METHODS, IntegrationFailed, absent, make_stepper, named
from heavytop.comparison.adaptive import (
    AdaptiveStepper,
    Singular,
    Taken,
    axis_acceleration,
    right_hand_side,
)
from heavytop.comparison.methods import IAS15
from heavytop.comparison.steppers import StepperState
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import Impossible, MissingPackage

from .kicked import SPAN, at, axis_error, motion, set_up, started

FIXED = [name for name, method in METHODS.items() if method.fixed]
ADAPTIVE = [name for name in METHODS if name not in (*FIXED, IAS15)]

# --- the table -----------------------------------------------------------------------------------


def test_the_table_can_be_read_without_any_library_and_not_be_changed():
    program = (
        "import sys\n"
        "for name in ('numba', 'scipy', 'CyRK', 'sympy'): sys.modules[name] = None\n"
        "from heavytop.comparison import METHODS; print(len(METHODS))\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (run.stdout, run.stderr) == (f"{len(METHODS)}\n", "")
    with pytest.raises(TypeError):
        METHODS["strang"] = METHODS["gauss8"]
    assert all(512 <= METHODS[name].block <= 2**16 for name in FIXED)


def test_a_name_may_end_in_a_formulation():
    assert named("radau-scipy-lagrange").formulation == "lagrange"
    assert named("dop853-cyrk").formulation == "axis"
    for wrong, nearest in (("strong", "strang"), ("gauss8-lagrange", "gauss8"), ("lsoda", "lsoda")):
        with pytest.raises(Impossible, match=f"none called '{wrong}'.*{nearest}"):
            named(wrong)


@pytest.mark.parametrize("name", METHODS)
def test_a_missing_package_is_named_with_the_pip_line(name, monkeypatch):
    method = METHODS[name]
    monkeypatch.setattr("heavytop.comparison.methods.find_spec", lambda package: None)
    assert absent(method) == method.needs != ()
    with pytest.raises(
        MissingPackage, match=r"pip install 'heavytop\[(rivals|rebound)\]'"
    ) as refusal:
        make_stepper(name, *started(), None, 1.0)
    assert method.needs[0] in str(refusal.value)
    assert exit_code(refusal.value) is Exit.USAGE


@pytest.mark.parametrize(
    ("name", "setting", "period", "said"),
    [
        ("strang", 0.5, 1.0, "strang.*is not from"),
        ("dop853-scipy", 1e-16, 1.0, "dop853-scipy.*is not from"),
        ("gauss8", math.nan, 1.0, "gauss8.*is not from"),
        *(("strang", 100, period, "parts of a period") for period in (-1.0, math.inf, math.nan)),
    ],
)
def test_settings_out_of_bounds_are_refused(name, setting, period, said):
    with pytest.raises(Impossible, match=said):
        set_up(name, setting, period)


@pytest.mark.slow
@pytest.mark.parametrize("name", METHODS)
def test_what_does_not_fit_the_equations_is_refused(name):
    set_up(name)
    state, parameters = started()
    with pytest.raises(Impossible, match="l_z: is not given"):
        make_stepper(name, state, {"g": 1.0}, None, 1.0)
    with pytest.raises(Impossible, match="4 states, where the equations have 5"):
        make_stepper(name, state[:4], parameters, None, 1.0)


# --- order, invariants, accuracy -----------------------------------------------------------------

STEPS = {  # steps in SPAN where the first term of the error rules, and rounding does not
    "strang": (64, 128),
    "blanes-moan-rkn6": (16, 32),
    "kahan-li8": (16, 32),
    "sofroniou-spaletta10": (16, 26),
    "implicit-midpoint": (128, 256),
    "gauss8": (4, 7),
    "bobenko-suris": (256, 512),
}


@pytest.mark.parametrize("name", FIXED)
def test_shorter_steps_show_the_order(name):
    few, many = STEPS[name]
    errors = [axis_error(set_up(name, n, SPAN), 2 * SPAN * (1 - 1e-12)) for n in (few, many)]
    order = math.log(errors[0] / errors[1]) / math.log(many / few)
    assert abs(order - METHODS[name].order) < 0.6, (order, errors)
    assert errors[1] > 1e-14


@pytest.mark.parametrize("name", FIXED)
def test_each_conserves_what_it_should(name):
    taken = set_up(name, steps=512)
    g, l_z = (started()[1][key] for key in ("g", "l_z"))

    def invariants(state):
        e, ell = np.array(state[:3]), np.array([*state[3:], l_z])
        energy = (ell @ ell / 2 + g * e[2]) / g
        own = energy - taken.h**2 / 8 * g * (e[0] ** 2 + e[1] ** 2)  # Bobenko and Suris'
        return np.array([e @ e, ell @ e / 25, energy, own])

    place, rows = taken.begin(), []
    for _ in range(4):
        place = taken.block(place)
        rows.append(invariants(taken.states_at(place, [place.time])[0]))
    length, spin, energy, own = np.abs(np.array(rows) - invariants(started()[0])).max(axis=0)
    assert max(length, spin) < 1e-12
    if name in ("strang", "bobenko-suris"):
        assert 1e-6 < energy < 1e-3
    else:
        assert energy < (1e-13 if name in ("implicit-midpoint", "gauss8") else 1e-11)
    assert own < 1e-12 or name != "bobenko-suris"


@pytest.mark.parametrize("name", ADAPTIVE)
def test_a_tolerance_is_kept_within_what_ten_periods_make_of_it(name):
    for tolerance in (1e-4, 1e-6) if "radau" in name else (1e-6, 1e-9):
        error = axis_error(set_up(name, tolerance), 10.3 * motion().period)
        assert tolerance / 100 < error < 200 * tolerance


@pytest.mark.parametrize("name", METHODS)
def test_backwards_is_the_past(name):
    setting = {"strang": 3000, "bobenko-suris": 9000, "implicit-midpoint": 9000}.get(name)
    stepper = set_up(name, setting, direction=-1)
    assert at(stepper, -1.3 * motion().period)[1] < -1.2999 * motion().period
    assert axis_error(stepper, -1.3 * motion().period) < 2e-4


def test_two_programs_of_one_method_agree():
    one, other = set_up("dop853-scipy", 1e-9, steps=100), set_up("dop853-cyrk", 1e-9, steps=100)
    a, b = one.block(one.begin()), other.block(other.begin())
    assert abs(a.time[0] - b.time[0]) < 1e-6 * a.time[0]
    assert a.evaluations == b.evaluations
    t = 4.3 * motion().period
    assert np.abs(at(one, t)[0] - at(other, t)[0]).max() < 1e-11


@pytest.mark.parametrize("formulation", [f for f in FORMULATIONS if f != "axis"])
@pytest.mark.parametrize("solver", ["dop853-scipy", "dop853-cyrk"])
def test_any_formulation_can_be_integrated(solver, formulation):
    state, t = at(set_up(f"{solver}-{formulation}", 1e-10), 1.3 * motion().period)
    exact = motion().at(t)
    if formulation == "attitude":
        a, b, c, d = state[:4]
        measured, true = a * a - b * b - c * c + d * d, exact.u
    else:
        measured, true = state[0], exact.one_minus_u if formulation == "cubic" else exact.theta
    assert abs(measured - true) < 1e-7


# --- blocks --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "names", [("strang", "kahan-li8"), ("gauss8", "gauss8"), ("dop853-cyrk", "dop853-cyrk")]
)
def test_what_comes_later_finds_its_steps_compiled_and_says_all_the_same_what_that_took(names):
    first, later = map(set_up, names)
    assert first.compile_s == later.compile_s > 0


@pytest.mark.parametrize("name", METHODS)
def test_a_state_read_back_from_text_leads_to_the_same_bits(name):
    taken = set_up(name, steps=70)
    first = taken.block(taken.begin())
    second = taken.block(first)
    told = json.loads(json.dumps([first.time, first.state, first.carry]))
    again = StepperState(*map(tuple, told), steps=first.steps, evaluations=first.evaluations)
    assert set_up(name, steps=70).block(again) == second
    assert second.steps == 140
    assert second.evaluations >= second.steps


@pytest.mark.parametrize("name", FIXED)
def test_what_is_seen_is_the_orbit_itself(name):
    taken, single = set_up(name, steps=60), set_up(name, steps=20)
    place = taken.block(taken.begin())
    ends = [taken.output_time(taken.h * (60 + k - 0.5)) for k in (60, 1, 17, 0)]
    rows = taken.states_at(place, ends)
    assert tuple(rows[0]) == taken.block(place).state
    assert tuple(rows[3]) == place.state
    if name not in ("gauss8", "implicit-midpoint"):  # these foresee a step from the one before
        onward = single.begin()
        for _ in range(4):
            onward = single.block(onward)
        assert tuple(taken.states_at(place, [onward.time])[0]) == onward.state
    compensated = ("sofroniou-spaletta10", "implicit-midpoint", "gauss8")
    assert len(taken.begin().carry) == (5 if name in compensated else 0)
    with pytest.raises(ValueError, match="outside"):
        taken.states_at(place, [taken.output_time(taken.h * 121)])
    with pytest.raises(ValueError, match="not the end of a step"):
        taken.states_at(place, [(ends[1][0] * (1 + 1e-9), 0.0)])


@pytest.mark.parametrize("sign", [1, -1])
def test_the_time_of_a_fixed_step_is_exact(sign):
    taken = set_up("strang", 97, direction=sign, steps=333_333)
    place = taken.block(taken.block(taken.begin()))
    assert sum(map(Fraction, place.time)) == Fraction(taken.h) * 666_666
    for t in (0.0, taken.h, 1e3 * taken.h, 77.7 * taken.h, taken.h * 1234567):
        high, low = taken.output_time(t)
        steps = (Fraction(high) + Fraction(low)) / Fraction(taken.h)
        assert steps.denominator == 1
        assert steps - 1 < Fraction(t) / Fraction(taken.h) <= steps


@pytest.mark.parametrize("name", ADAPTIVE)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_block_starts_with_the_step_of_the_one_before(name, sign):
    taken, single = (set_up(name, 1e-7, direction=sign, steps=n) for n in (60, 1))
    place = taken.block(taken.begin())
    if name == "lsoda-scipy":
        assert place.carry == ()
    else:
        [step] = place.carry
        taken_on = sign * (single.block(place).time[0] - place.time[0])
        assert abs(taken_on - step) < 1e-12


@pytest.mark.parametrize("name", ADAPTIVE)
def test_a_look_is_as_good_as_the_steps_and_leaves_them(name):
    taken = set_up(name, 1e-7, steps=80)
    place = taken.block(taken.begin())
    after = taken.block(place)
    inside = [
        (place.time[0] + x * (after.time[0] - place.time[0]), 0.0) for x in (0.7, 0.11, 0.112, 0.9)
    ]
    rows = taken.states_at(place, [*inside, after.time, place.time])
    assert tuple(rows[-2]) == after.state
    assert tuple(rows[-1]) == place.state
    ends = [np.abs(p.state[:3] - motion().at(p.time[0]).axis).max() for p in (place, after)]
    for t, row in zip(inside, rows, strict=False):
        assert np.abs(row[:3] - motion().at(t[0]).axis).max() < 3 * max(ends) + 1e-6
    assert taken.output_time(0.3) == (0.3, 0.0)
    with pytest.raises(ValueError, match="outside"):
        taken.states_at(place, [(after.time[0] * 1.01, 0.0)])


# --- where they break, in words and silently -----------------------------------------------------

EULER = ([0.0, 0.0, 0.0, 1.0, 0.0, 140.0], {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456})
HUGE = ([0.0, 0.6, 0.8, 1e200, 1e200], {"g": 1e200, "l_z": 1e200})
BREAK = [  # a pole of Euler's angles; numbers that overflow; steps too long for the iteration
    *((f"{name}-lagrange", EULER, 1e-8, 1.0, "singular|finite|gave up") for name in ADAPTIVE),
    *((name, HUGE, 1, 1.0, "finite|converge") for name in FIXED),
    *((name, HUGE, None, 1.0, "finite|gave up|overflow") for name in ADAPTIVE),
    *((name, started(), 1, 0.54, "not converge") for name in ("gauss8", "implicit-midpoint")),
]


@pytest.mark.parametrize(("name", "start", "setting", "period", "said"), BREAK)
def test_what_cannot_go_on_says_so_and_prints_nothing(name, start, setting, period, said, capfd):
    set_up(name)
    taken = make_stepper(name, *start, setting, period)
    with pytest.raises(IntegrationFailed, match=said):
        taken.block(taken.begin())
    assert capfd.readouterr() == ("", "")


def test_no_solver_is_given_what_is_no_number():
    rates = right_hand_side(FORMULATIONS["axis"].build(), {"g": 1.0, "l_z": 1e200})
    assert rates(0.0, np.array([0.0, 0.6, 0.8, 3.0, 4.0]))[3] == -0.6
    with pytest.raises(Singular):
        rates(0.0, np.array([0.0, 1e200, 0.8, 0.0, 0.0]))


def test_steps_too_short_to_change_the_time_stop_it_in_words():
    def ended(length):
        taken = Taken(np.array([0.0, length]), np.zeros((2, 1)), 1, ())
        stepper = AdaptiveStepper(lambda *_, **__: taken, (0.0,), 1, 1)
        return stepper.block(StepperState((1.0, 1e-20), (0.0,))).time

    assert ended(1e-30) == (1.0, 1e-20 + 1e-30)
    with pytest.raises(IntegrationFailed, match="vanish"):
        ended(1e-40)


@pytest.mark.parametrize("t", [0.0, 0.31, 1.7])
def test_the_axis_is_a_particle_to_rebound(t):
    """Its acceleration is the second difference of the exact motion, at 40 digits."""
    top, h = motion().top, mpf("1e-8")
    with workdps(40):
        e, before, after = (
            np.array(motion().at(mpf(t) + shift, digits=40).axis) for shift in (0, -h, h)
        )
        velocity, exact = (after - before) / (2 * h), (after - 2 * e + before) / h**2
    spin = float(motion().constants.p_psi) / float(top.A)
    found = axis_acceleration(e.astype(float), velocity.astype(float), float(top.gMR / top.A), spin)
    assert found == pytest.approx(exact.astype(float), rel=1e-10)
    with pytest.raises(Impossible, match="none called 'ias15-rebound-lagrange'"):
        named("ias15-rebound-lagrange")
