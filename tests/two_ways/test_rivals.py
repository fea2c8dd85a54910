"""Every rival has the order, the invariants and the accuracy its literature claims."""

import json
import math
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from types import SimpleNamespace

import numpy as np
import pytest

import heavytop as ht
from heavytop.cli import Exit, exit_code
from heavytop.comparison import METHODS, IntegrationFailed, absent, make_stepper, named, symplectic
from heavytop.comparison.adaptive import AdaptiveStepper, Singular, Taken, right_hand_side
from heavytop.comparison.collocation import coefficients
from heavytop.comparison.methods import IAS15
from heavytop.comparison.steppers import StepperState
from heavytop.equations.formulation import FORMULATIONS
from heavytop.equations.lambdify import exact_values
from heavytop.errors import Impossible, MissingPackage
from heavytop.run.planning import start_values

FIXED = [name for name, method in METHODS.items() if method.fixed]
ADAPTIVE = [name for name in METHODS if name not in FIXED]
SPLITTINGS = [n for n in FIXED if n not in ("implicit-midpoint", "gauss8", "bobenko-suris")]
SPAN = 0.77  # s, not a multiple of the period: an error of phase shows at first order


@cache
def motion(scene="sicm-kicked"):
    loaded = ht.load_scene(scene)
    return ht.Motion(loaded.top, loaded.start)


@cache
def started(formulation="axis", scene="sicm-kicked"):
    """Return states and parameters of a scene, each rounded once from its exact value."""
    form = FORMULATIONS[formulation].build()
    expressions = (*form.start, *form.parameters.values())
    values = [float(v) for v in exact_values(expressions, start_values(ht.load_scene(scene)))]
    names = [p.name for p in form.parameters]
    return tuple(values[: len(form.start)]), dict(
        zip(names, values[len(form.start) :], strict=True)
    )


def needed(name):
    """Return a method, or skip by name what its packages are missing for."""
    method = named(name)
    if missing := absent(method):
        pytest.skip(f"{name} needs {' and '.join(missing)}")
    return method


def set_up(name, setting=None, period=None, scene="sicm-kicked", **more):
    method = needed(name)
    state, parameters = started(method.formulation, scene)
    period = motion(scene).period if period is None else period
    return make_stepper(name, state, parameters, setting, period, **more)


def at(taken, t):
    """Return the states at the first output time from t on, and that time."""
    place, time = taken.begin(), taken.output_time(t)
    while abs((after := taken.block(place)).time[0]) < abs(time[0]):
        place = after
    return taken.states_at(place, [time])[0], time[0]


def axis_error(taken, t, scene="sicm-kicked"):
    state, time = at(taken, t)
    return float(np.abs(state[:3] - motion(scene).at(time).axis).max())


# --- the table ---------------------------------------------------------------------------------


def test_the_table_can_be_read_without_any_library():
    program = (
        "import sys\n"
        "for name in ('numba', 'scipy', 'CyRK', 'sympy'): sys.modules[name] = None\n"
        "from heavytop.comparison import METHODS; print(len(METHODS))\n"
    )
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (run.stdout, run.stderr) == (f"{len(METHODS)}\n", "")


def test_the_table_cannot_be_changed():
    with pytest.raises(TypeError):
        METHODS["strang"] = METHODS["gauss8"]


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
    extra = "rebound" if name == "ias15-rebound" else "rivals"
    with pytest.raises(MissingPackage, match=rf"pip install 'heavytop\[{extra}\]'") as refusal:
        make_stepper(name, *started(), None, 1.0)
    assert method.needs[0] in str(refusal.value)
    assert exit_code(refusal.value) is Exit.USAGE


def test_settings_out_of_bounds_are_refused():
    for name, setting in (("strang", 0.5), ("dop853-scipy", 1e-16), ("gauss8", math.nan)):
        with pytest.raises(Impossible, match=f"{name}.*is not from"):
            set_up(name, setting)
    for period in (-1.0, math.inf, math.nan):
        with pytest.raises(Impossible, match="parts of a period"):
            set_up("strang", 100, period)


@pytest.mark.parametrize("name", METHODS)
def test_what_does_not_fit_the_equations_is_refused(name):
    needed(name)
    state, parameters = started()
    with pytest.raises(Impossible, match="l_z: is not given"):
        make_stepper(name, state, {"g": 1.0}, None, 1.0)
    with pytest.raises(Impossible, match="4 states, where the equations have 5"):
        make_stepper(name, state[:4], parameters, None, 1.0)


# --- the coefficients --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("half", "order"),
    [
        (("1",), 2),
        (symplectic.KAHAN_LI_8, 8),
        (symplectic.SOFRONIOU_SPALETTA_10, 10),
    ],
)
def test_a_composition_is_symmetric_and_its_odd_powers_cancel(half, order):
    lengths = [Fraction(x) for x in half]
    lengths += lengths[-2::-1]
    assert abs(sum(lengths) - 1) < 1e-23
    for power in range(3, order, 2):  # the conditions of one commutator each
        assert abs(sum(x**power for x in lengths)) < 1e-23
    kicks, drifts = symplectic.composition(half)
    assert (drifts == np.array([float(x) for x in lengths])).all()
    assert (kicks == kicks[::-1]).all()
    assert abs(kicks.sum() - 1) < 1e-15


def test_blanes_and_moan_s_sums_are_one():
    kicks, drifts = symplectic.blanes_moan()
    for row in (kicks, drifts):
        assert (row == row[::-1]).all()
        assert abs(math.fsum(row) - 1) < 1e-16
    assert np.count_nonzero(kicks) == 14


@pytest.mark.parametrize(
    "scheme",
    [
        symplectic.blanes_moan(),
        symplectic.composition(symplectic.KAHAN_LI_8),
        symplectic.composition(symplectic.SOFRONIOU_SPALETTA_10),
    ],
    ids=["blanes-moan", "kahan-li", "sofroniou-spaletta"],
)
def test_on_a_spring_a_scheme_is_exact_to_its_order(scheme):
    kicks, drifts = ([Fraction(x) / sum(map(Fraction, row)) for x in row] for row in scheme)
    h, q, p = Fraction(1, 1000), Fraction(1), Fraction(0)
    for kick, drift in zip(kicks, [*drifts, Fraction(0)], strict=True):
        p -= h * kick * q
        q += h * drift * p
    cosine = sum((-1) ** k * h ** (2 * k) / math.factorial(2 * k) for k in range(8))
    sine = sum((-1) ** k * h ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(8))
    assert max(abs(q - cosine), abs(p + sine)) < 1e-24


@pytest.mark.parametrize("s", [1, 2, 8])
def test_gauss_collocation_is_of_order_2s_and_symplectic(s):
    high, rest, beyond = coefficients(s)
    a, b, beyond = high[:s].T, high[s], beyond.T
    c = (1 + np.polynomial.legendre.leggauss(s)[0]) / 2
    for k in range(1, 2 * s + 1):
        assert abs(b @ c ** (k - 1) - 1 / k) < 1e-15
    for k in range(1, s + 1):
        assert np.abs(a @ c ** (k - 1) - c**k / k).max() < 1e-15
        ahead = ((1 + c) ** k - 1) / k
        assert np.abs(beyond @ c ** (k - 1) - ahead).max() < 1e-15 * np.abs(beyond).max() * s
    exactly = np.vectorize(Fraction, otypes=[object])
    a, b = exactly(a) + exactly(rest[:s].T), exactly(b) + exactly(rest[s])
    product = b[:, None] * a
    assert np.abs(product + product.T - np.outer(b, b)).max() < 1e-32
    assert abs(b.sum() - 1) < 1e-32


# --- the order ---------------------------------------------------------------------------------

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


@pytest.mark.parametrize("name", ["strang", "blanes-moan-rkn6", "kahan-li8"])
@pytest.mark.parametrize("h", [0.01, 0.019, 0.02, -0.5])  # |l| h from 0.26 to 13 rad
def test_without_gravity_a_splitting_is_the_rotation_itself(name, h):
    needed(name)
    ell = np.array([3.0, -4.0, 25.0])
    e = np.array([0.6, 0.0, 0.8])
    sign = 1 if h > 0 else -1
    taken = make_stepper(name, [*e, *ell[:2]], {"g": 0.0, "l_z": ell[2]}, 1, abs(h), sign, steps=3)
    n, angle = ell / math.hypot(*ell), 3 * h * math.hypot(*ell)
    exact = e * math.cos(angle) + np.cross(n, e) * math.sin(angle)
    exact += n * (n @ e) * (1 - math.cos(angle))
    assert np.abs(taken.block(taken.begin()).state[:3] - exact).max() < 3e-14


@pytest.mark.parametrize("name", FIXED)
def test_each_conserves_what_it_should(name):
    taken = set_up(name, steps=512)
    g, l_z = (started()[1][key] for key in ("g", "l_z"))

    def invariants(state):
        e, ell = np.array(state[:3]), np.array([*state[3:], l_z])
        return np.array([e @ e, ell @ e / 25, (ell @ ell / 2 + g * e[2]) / g])

    def of_bobenko_and_suris(state):
        return invariants(state)[2] - g * taken.h**2 / 8 * (state[0] ** 2 + state[1] ** 2)

    place, rows = taken.begin(), []
    for _ in range(4):
        place = taken.block(place)
        rows.append(taken.states_at(place, [place.time])[0])
    start = started()[0]
    length, spin, energy = np.abs([invariants(s) - invariants(start) for s in rows]).max(axis=0)
    assert max(length, spin) < 1e-12
    if name in ("implicit-midpoint", "gauss8"):
        assert energy < 1e-13
    elif name in ("strang", "bobenko-suris"):
        assert 1e-6 < energy < 1e-3
    else:
        assert energy < 1e-11
    if name == "bobenko-suris":
        own = [of_bobenko_and_suris(s) for s in rows]
        assert np.abs(np.subtract(own, of_bobenko_and_suris(start))).max() < 1e-12


def test_gauss_coefficients_rounded_to_doubles_would_drift():
    taken = set_up("gauss8", steps=8 * 4000)
    g, l_z, table = taken.advance.args
    rounded = table.copy()
    rounded[17:] = 0
    bare = replace(taken, advance=partial(taken.advance.func, g, l_z, rounded))
    e_z, l_x, l_y = np.transpose([m.block(m.begin()).state[2:] for m in (taken, bare)])
    first = started()[0]
    energy = (l_x**2 + l_y**2) / 2 + g * e_z - (first[3] ** 2 + first[4] ** 2) / 2 - g * first[2]
    ours, theirs = np.abs(energy / g)
    assert ours < 5e-15
    assert theirs > 2e-14


def test_compensated_sums_lose_less():
    taken = set_up("sofroniou-spaletta10", 64, steps=64)
    plain = replace(symplectic.SOFRONIOU_SPALETTA, compensated=False)
    bare = plain.stepper(taken.start, *taken.advance.args[:2], taken.h, 64)
    t = 60.3 * motion().period
    assert axis_error(taken, t) < axis_error(bare, t) / 2


@pytest.mark.parametrize(
    "names", [("strang", "kahan-li8"), ("gauss8", "gauss8"), ("dop853-cyrk", "dop853-cyrk")]
)
def test_what_comes_later_finds_its_steps_compiled_and_says_all_the_same_what_that_took(names):
    first, later = map(set_up, names)
    assert first.compile_s == later.compile_s > 0


# --- blocks ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", METHODS)
def test_a_state_read_back_from_text_leads_to_the_same_bits(name):
    taken = set_up(name, steps=70)
    second = taken.block(taken.block(taken.begin()))
    first = taken.block(taken.begin())
    told = json.loads(json.dumps([first.time, first.state, first.carry]))
    again = type(first)(*map(tuple, told), steps=first.steps, evaluations=first.evaluations)
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


def test_only_what_sums_are_compensated_by_is_carried():
    words = {name: len(set_up(name, steps=1).begin().carry) for name in FIXED}
    compensated = ("sofroniou-spaletta10", "implicit-midpoint", "gauss8")
    assert words == {name: 5 if name in compensated else 0 for name in FIXED}


@pytest.mark.parametrize("name", ADAPTIVE)
def test_a_look_is_as_good_as_the_steps_and_leaves_them(name):
    taken = set_up(name, 1e-7, steps=80)
    place = taken.block(taken.begin())
    end = taken.block(place).time
    inside = [(place.time[0] + x * (end[0] - place.time[0]), 0.0) for x in (0.7, 0.11, 0.112, 0.9)]
    rows = taken.states_at(place, [*inside, end, place.time])
    assert tuple(rows[-2]) == taken.block(place).state
    assert tuple(rows[-1]) == place.state
    ends = [
        np.abs(p.state[:3] - motion().at(p.time[0]).axis).max() for p in (place, taken.block(place))
    ]
    for t, row in zip(inside, rows, strict=False):
        assert np.abs(row[:3] - motion().at(t[0]).axis).max() < 3 * max(ends) + 1e-6
    assert taken.output_time(0.3) == (0.3, 0.0)
    with pytest.raises(ValueError, match="outside"):
        taken.states_at(place, [(end[0] * 1.01, 0.0)])


@pytest.mark.parametrize("name", ADAPTIVE)
def test_a_tolerance_is_kept_within_what_ten_periods_make_of_it(name):
    tolerances = (1e-4, 1e-6) if "radau" in name else (1e-6, 1e-9)
    errors = [axis_error(set_up(name, x), 10.3 * motion().period) for x in tolerances]
    for tolerance, error in zip(tolerances, errors, strict=True):
        assert error < 200 * tolerance
        if name != IAS15:  # whose epsilon is that of the last term of a series
            assert tolerance / 100 < error


@pytest.mark.parametrize("name", METHODS)
def test_backwards_is_the_past(name):
    setting = {"strang": 3000, "bobenko-suris": 9000, "implicit-midpoint": 9000}.get(name)
    taken = set_up(name, setting, direction=-1)
    state, t = at(taken, -1.3 * motion().period)
    assert t < -1.2999 * motion().period
    assert np.abs(state[:3] - motion().at(t).axis).max() < 2e-4


class OneParticle:
    """What is asked of a simulation of REBOUND 4, with classical Runge-Kutta steps."""

    def __init__(self):
        self.t, self.dt, self.integrator = 0.0, 1e-3, ""
        self.ri_ias15, self.contents = SimpleNamespace(epsilon=None), self
        OneParticle.last = self

    def add(self, **where):
        self.particles = [SimpleNamespace(**where, ax=0.0, ay=0.0, az=0.0)]

    def rates(self, y):
        vars(self.particles[0]).update(zip(("x", "y", "z", "vx", "vy", "vz"), y, strict=True))
        self.additional_forces(self)
        p = self.particles[0]
        return np.array([p.vx, p.vy, p.vz, p.ax, p.ay, p.az])

    def steps(self, n):
        p = self.particles[0]
        y = np.array([p.x, p.y, p.z, p.vx, p.vy, p.vz])
        for h in [self.dt] * n:
            a = self.rates(y)
            b = self.rates(y + h / 2 * a)
            c = self.rates(y + h / 2 * b)
            y = y + h / 6 * (a + 2 * b + 2 * c + self.rates(y + h * c))
            self.t += h
        self.rates(y)

    def integrate(self, end):
        self.dt = (end - self.t) / 16
        self.steps(16)
        self.t = end


@pytest.mark.parametrize("sign", [1, -1])
def test_the_axis_is_a_particle_to_rebound(monkeypatch, sign):
    """Its documented interface, played by another method: also where REBOUND is not installed."""
    monkeypatch.setitem(sys.modules, "rebound", SimpleNamespace(Simulation=OneParticle))
    monkeypatch.setattr("heavytop.comparison.methods.find_spec", lambda name: name)
    state, parameters = started()
    taken = make_stepper(IAS15, state, parameters, 1e-7, direction=sign, steps=50)
    end = taken.block(taken.block(taken.begin()))
    assert (end.steps, end.evaluations) == (100, 100 * 5)
    assert end.time[0] == pytest.approx(sign * 0.1)
    for t in (end.time[0], sign * 0.0777):
        seen = at(taken, t)[0]
        assert np.abs(seen[:3] - motion().at(t).axis).max() < 1e-9
        other = at(set_up("dop853-scipy", direction=sign), t)[0]
        assert np.abs(seen - other).max() < 1e-6  # the angular momentum too
    last = OneParticle.last
    assert (last.integrator, last.ri_ias15.epsilon) == ("ias15", 1e-7)
    assert last.force_is_velocity_dependent == 1


def test_two_programs_of_one_method_agree():
    one, other = set_up("dop853-scipy", 1e-9, steps=100), set_up("dop853-cyrk", 1e-9, steps=100)
    a, b = one.block(one.begin()), other.block(other.begin())
    assert abs(a.time[0] - b.time[0]) < 1e-6 * a.time[0]
    assert a.evaluations == b.evaluations
    t = 4.3 * motion().period
    assert np.abs(at(one, t)[0] - at(other, t)[0]).max() < 1e-11


# --- other formulations, and where they break --------------------------------------------------


@pytest.mark.parametrize("formulation", [f for f in FORMULATIONS if f != "axis"])
@pytest.mark.parametrize("solver", ["dop853-scipy", "dop853-cyrk"])
def test_any_formulation_can_be_integrated(solver, formulation):
    name = f"{solver}-{formulation}"
    state, t = at(set_up(name, 1e-10), 1.3 * motion().period)
    exact = motion().at(t)
    if formulation == "cubic":
        measured, true = state[0], exact.one_minus_u
    elif formulation == "attitude":
        a, b, c, d = state[:4]
        measured, true = a * a - b * b - c * c + d * d, exact.u
    else:
        measured, true = state[0], exact.theta
    assert abs(measured - true) < 1e-7


@pytest.mark.parametrize("solver", [name for name in ADAPTIVE if name != IAS15])
def test_a_pole_of_euler_angles_stops_every_solver_in_words(solver, capfd):
    name = f"{solver}-lagrange"
    needed(name)
    top = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456}
    taken = make_stepper(name, [0.0, 0.0, 0.0, 1.0, 0.0, 140.0], top, 1e-8)
    with pytest.raises(IntegrationFailed, match=r"singular|finite|gave up"):
        taken.block(taken.begin())
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["gauss8", "implicit-midpoint"])
def test_steps_too_long_for_the_iteration_stop_it_in_words(name):
    taken = set_up(name, 1)
    with pytest.raises(IntegrationFailed, match="does not converge"):
        taken.block(taken.begin())


@pytest.mark.parametrize("name", METHODS)
def test_numbers_that_overflow_stop_a_method_in_words(name, capfd):
    needed(name)
    setting = 1 if METHODS[name].fixed else None
    taken = make_stepper(
        name, [0.0, 0.6, 0.8, 1e200, 1e200], {"g": 1e200, "l_z": 1e200}, setting, 1.0
    )
    with pytest.raises(IntegrationFailed, match=r"finite|converge|gave up|overflow"):
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


def test_blocks_of_fixed_steps_are_short_and_not_too_short():
    assert all(512 <= METHODS[name].block <= 2**16 for name in FIXED)
