"""Every method of others has the order, the invariants and the accuracy its literature claims.

Splittings and Gauss' collocation have coefficients with all the digits of doubles.
"""

import json
import math
from fractions import Fraction

import numpy as np
import pytest

from heavytop.comparison import METHODS, IntegrationFailed, adaptive, fixed_steps, make_stepper
from heavytop.comparison.methods import named
from heavytop.comparison.steppers import StepperState
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import Exit, Impossible, MissingPackage

from .kicked import MOTION, SPAN, at, axis_error, problem, set_up, started

FIXED = [name for name, method in METHODS.items() if method.fixed]
ADAPTIVE = [name for name in METHODS if name not in FIXED]
FORESEEING = ("gauss8", "implicit-midpoint")  # a step from the one before

# --- the table -----------------------------------------------------------------------------------


def test_a_name_may_end_in_a_formulation():
    assert named("radau-scipy-lagrange").formulation == "lagrange"
    assert named("dop853-cyrk").formulation == "axis"
    for wrong in ("strong", "gauss8-lagrange", "lsoda"):
        with pytest.raises(Impossible, match=f"none called '{wrong}'"):
            named(wrong)


@pytest.mark.parametrize("name", METHODS)
def test_a_missing_package_is_named_with_the_pip_line(name, monkeypatch):
    monkeypatch.setattr("heavytop.comparison.methods.find_spec", lambda package: None)
    assert METHODS[name].absent == METHODS[name].needs != ()
    said = rf"{METHODS[name].needs[0]}.*pip install '\.\[rivals\]'"
    with pytest.raises(MissingPackage, match=said) as refusal:
        make_stepper(METHODS[name], problem(*started(), 1.0))
    assert refusal.value.exit is Exit.USAGE


# --- order, invariants, accuracy -----------------------------------------------------------------


def test_every_method_of_fixed_step_has_its_rows_here():
    for rows in (STEPS, CONSERVED):
        assert rows.keys() == {*FIXED}, "STEPS and CONSERVED, below: what is expected of each"


STEPS = {  # steps in SPAN where the first term of the error rules, and rounding does not
    "strang": (64, 128),
    "blanes-moan-rkn6": (16, 32),
    "sofroniou-spaletta10": (16, 26),
    "implicit-midpoint": (128, 256),
    "gauss8": (4, 7),
    "bobenko-suris": (256, 512),
}


CONSERVED = {  # the largest error of |e|², l·e and E', which may wander between two bounds
    "strang": {"length": 1e-12, "spin": 1e-12, "energy": (1e-6, 1e-3)},
    "blanes-moan-rkn6": {"length": 1e-12, "spin": 1e-12, "energy": 1e-11},
    "sofroniou-spaletta10": {"length": 1e-12, "spin": 1e-12, "energy": 1e-11},
    "implicit-midpoint": {"length": 1e-12, "spin": 1e-12, "energy": 1e-13},
    "gauss8": {"length": 1e-12, "spin": 1e-12, "energy": 1e-13},
    "bobenko-suris": {"length": 1e-12, "spin": 1e-12, "energy": (1e-6, 1e-3), "own": 1e-12},
}


@pytest.mark.parametrize("name", STEPS)
def test_shorter_steps_show_the_order(name):
    few, many = STEPS[name]
    errors = [axis_error(set_up(name, n, SPAN), 2 * SPAN * (1 - 1e-12)) for n in (few, many)]
    order = math.log(errors[0] / errors[1]) / math.log(many / few)
    assert abs(order - METHODS[name].order) < 0.6, (order, errors)
    assert errors[1] > 1e-14
    assert 512 <= METHODS[name].block <= 2**16  # steps of a fraction of a millisecond to some


@pytest.mark.parametrize("name", CONSERVED)
def test_each_conserves_what_it_should(name):
    taken, rows = set_up(name, steps=512), [started()[0]]
    g, l_z = (started()[1][key] for key in ("g", "l_z"))
    place = taken.begin()
    for _ in range(4):
        place = taken.block(place)
        rows.append(taken.states_at(place, [place.time])[0])
    e, ell = np.array(rows)[:, :3], np.column_stack((np.array(rows)[:, 3:], np.full(5, l_z)))
    length, spin = (e * e).sum(axis=1), (ell * e).sum(axis=1) / 25
    energy = ((ell * ell).sum(axis=1) / 2 + g * e[:, 2]) / g
    own = energy - taken.h**2 / 8 * g * (e[:, 0] ** 2 + e[:, 1] ** 2)  # Bobenko and Suris'
    found = {"length": length, "spin": spin, "energy": energy, "own": own}
    for invariant, bounds in CONSERVED[name].items():
        least, most = bounds if isinstance(bounds, tuple) else (0, bounds)
        assert least <= np.abs(found[invariant] - found[invariant][0]).max() < most, invariant


@pytest.mark.parametrize("name", ADAPTIVE)
def test_a_tolerance_is_kept_within_what_ten_periods_make_of_it(name):
    for tolerance in (1e-4, 1e-6) if "radau" in name else (1e-6, 1e-9):
        error = axis_error(set_up(name, tolerance), 10.3 * MOTION.period)
        assert tolerance / 100 < error < 200 * tolerance


@pytest.mark.parametrize("name", [name for name in ADAPTIVE if name.endswith("scipy")])
def test_every_call_of_the_right_hand_side_is_counted(name, monkeypatch):
    right_hand_side, calls = adaptive.right_hand_side, []

    def watched(*given, **options):
        rates = right_hand_side(*given, **options)
        return lambda t, y: calls.append(t) or rates(t, y)

    monkeypatch.setattr(adaptive, "right_hand_side", watched)
    stepper = set_up(name, steps=40)
    assert stepper.block(stepper.begin()).evaluations == len(calls) > 40


@pytest.mark.parametrize("name", ["dop853-scipy", "dop853-cyrk"])
def test_a_block_has_its_steps_whatever_the_unit_of_time(name):
    state, constants = started()
    slow, scale = dict(constants), 2.0**-90 * MOTION.period
    for key, power in {"g": 2, "l_z": 1, "n": 1, "omega3": 1}.items():
        slow[key] *= scale**power
    start = (*state[:3], *(x * scale for x in state[3:])), slow
    stepper = set_up(name, 1e-9, 2.0**90, steps=100, start=start)
    after = stepper.block(stepper.begin())
    assert after.steps == 100
    assert after.time[0] > 2.0**90  # CyRK's longest step is 2^64 s by default


@pytest.mark.parametrize("name", METHODS)
def test_backwards_is_the_past(name):
    setting = {"strang": 3000, "bobenko-suris": 9000, "implicit-midpoint": 9000}.get(name)
    stepper = set_up(name, setting, direction=-1)
    assert at(stepper, -1.3 * MOTION.period)[1] < -1.2999 * MOTION.period
    assert axis_error(stepper, -1.3 * MOTION.period) < 2e-4


@pytest.mark.parametrize("formulation", [f for f in FORMULATIONS if f != "axis"])
def test_any_formulation_can_be_integrated(formulation):
    state, t = at(set_up(f"dop853-cyrk-{formulation}", 1e-10), 1.3 * MOTION.period)
    form, constants = FORMULATIONS[formulation].build(), started(formulation)[1]
    there = dict(zip(form.states, state, strict=True))
    there |= {symbol: constants[symbol.name] for symbol in form.parameters}
    assert abs(form.height.subs(there) - MOTION.at(t).u) < 1e-7


# --- coefficients --------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", [
    fixed_steps.blanes_moan(), fixed_steps.composition(fixed_steps.SOFRONIOU_SPALETTA_10),
], ids=["splitting", "composed"])  # fmt: skip
def test_on_a_spring_a_scheme_is_exact_to_its_order(scheme):
    assert all((row == row[::-1]).all() and abs(math.fsum(row) - 1) < 1e-15 for row in scheme)
    kicks, drifts = ([Fraction(x) / sum(map(Fraction, row)) for x in row] for row in scheme)
    h, q, p = Fraction(1, 1000), Fraction(1), Fraction(0)
    for kick, drift in zip(kicks, [*drifts, Fraction(0)], strict=True):
        p -= h * kick * q
        q += h * drift * p
    terms = [(-1) ** (k // 2) * h**k / math.factorial(k) for k in range(16)]
    assert max(abs(q - sum(terms[::2])), abs(p + sum(terms[1::2]))) < 1e-24


@pytest.mark.parametrize("name", ["strang", "blanes-moan-rkn6", "sofroniou-spaletta10"])
@pytest.mark.parametrize("h", [0.01, 0.019, 0.02, -0.5])  # |l| h from 0.26 to 13 rad
def test_without_gravity_a_splitting_is_the_rotation_itself(name, h):
    ell, e = np.array([3.0, -4.0, 25.0]), np.array([0.6, 0.0, 0.8])
    start, sign = ([*e, *ell[:2]], {"g": 0.0, "l_z": ell[2]}), 1 if h > 0 else -1
    taken = set_up(name, 1.0, abs(h), 3, start, direction=sign)
    n, angle = ell / math.hypot(*ell), 3 * h * math.hypot(*ell)
    exact = e * math.cos(angle) + np.cross(n, e) * math.sin(angle)
    exact += n * (n @ e) * (1 - math.cos(angle))
    assert np.abs(taken.block(taken.begin()).state[:3] - exact).max() < 3e-14


def test_gauss_coefficients_beyond_doubles_leave_no_drift():
    taken = set_up("gauss8", steps=8 * 4000)
    place, first, g = taken.block(taken.begin()), *started()
    *_, e_z, l_x, l_y = place.state
    energy = (l_x**2 + l_y**2) / 2 + g["g"] * e_z
    energy -= (first[3] ** 2 + first[4] ** 2) / 2 + g["g"] * first[2]
    assert abs(energy / g["g"]) < 5e-15
    assert place.evaluations < 150 * place.steps  # each step foresees the next


# --- blocks --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", METHODS)
def test_a_state_read_back_from_text_leads_to_the_same_bits_and_a_look_shows_them(name):
    taken = set_up(name, steps=70)
    first = taken.block(taken.begin())
    second = taken.block(first)
    stored = json.loads(json.dumps([first.time, first.state, first.carry]))
    again = StepperState(*map(tuple, stored), steps=first.steps, evaluations=first.evaluations)
    assert set_up(name, steps=70).block(again) == second
    assert second.evaluations >= second.steps == 140
    rows = taken.states_at(first, [second.time, first.time])
    assert [*map(tuple, rows)] == [second.state, first.state]


@pytest.mark.parametrize("name", [name for name in FIXED if name not in FORESEEING])
def test_what_is_seen_within_a_block_is_the_orbit_itself(name):
    taken, single = set_up(name, steps=60), set_up(name, steps=20)
    place, onward = taken.block(taken.begin()), single.begin()
    for _ in range(4):
        onward = single.block(onward)
    assert tuple(taken.states_at(place, [onward.time])[0]) == onward.state


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
def test_a_look_is_as_good_as_the_steps(name):
    taken = set_up(name, 1e-7, steps=80)
    place = taken.block(taken.begin())
    begins, ends = place.time[0], taken.block(place).time[0]
    times = [*(begins + x * (ends - begins) for x in (0.7, 0.11, 0.112, 0.9)), ends, begins]
    rows = taken.states_at(place, [(t, 0.0) for t in times])
    off = np.abs(rows[:, :3] - MOTION.at(times).axis).max(axis=1)
    assert max(off[:4]) < 3 * max(off[4:]) + 1e-6


# --- where they break, in words and silently -----------------------------------------------------

EULER = ([0.0, 0.0, 0.0, 1.0, 0.0, 140.0], {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456})
HUGE = ([0.0, 0.6, 0.8, 1e200, 1e200], {"g": 1e200, "l_z": 1e200})


# a pole of Euler's angles; numbers that overflow; steps too long for the iteration
@pytest.mark.parametrize(("name", "start", "setting", "period", "said"), [
    *((f"{name}-lagrange", EULER, 1e-8, 1.0, "singular|finite|gave up") for name in ADAPTIVE),
    *((name, HUGE, 1, 1.0, "finite|converge") for name in FIXED),
    *((name, HUGE, None, 1.0, "finite|gave up|overflow") for name in ADAPTIVE),
    *((name, started(), 1, 0.54, "not converge") for name in FORESEEING),
])  # fmt: skip
def test_what_cannot_go_on_says_so_and_prints_nothing(name, start, setting, period, said, capfd):
    taken = set_up(name, setting, period, start=start)
    with pytest.raises(IntegrationFailed, match=said):
        taken.block(taken.begin())
    assert capfd.readouterr() == ("", "")
