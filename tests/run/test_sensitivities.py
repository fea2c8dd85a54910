"""The variational equations against differences of the closed form at sixty digits."""

from dataclasses import replace
from functools import cache
from importlib import import_module
from pathlib import Path

import mpmath
import numpy as np
import pytest

import heavytop as ht
from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import FORMULATIONS
from heavytop.equations.lambdify import lambdified
from heavytop.errors import BadScene, DoubtfulWarning, EndedEarly, Impossible, NotANumber, Outcome
from heavytop.run.planning import start_values
from heavytop.run.sensitivities import UNITS, sensitivities, state_transition

mp = mpmath.mp.clone()
mp.dps = 60
STEP = ht.Exact.of("1e-20")
GIVEN = (lag.A, lag.C, lag.gMR, *lag.COORDINATES, *lag.VELOCITIES)
MP = {"sin": mp.sin, "cos": mp.cos, "sqrt": mp.sqrt}
SICM = ht.Top("3.28e-4", "6.60e-5", "0.0456")


def scene_of(top, quantities=("theta",), **start):
    return ht.Scene(top, ht.State(**start), time=1, quantities=quantities, events=())


SCENES = {
    "loops, from a turning point": ht.load_scene("sicm-kicked"),
    "cusps, from rest": ht.load_scene("sicm-dropped"),
    "rising": scene_of(SICM, theta="0.4", thetadot=-2, phi="0.3", phidot=3, psi="-1.1", omega3=150),
    "gravity turned round": scene_of(
        ht.Top("0.7", "0.9", "-1.3"), theta="1.2", thetadot="0.4", phidot="0.8", psidot=-2
    ),
    "no gravity": scene_of(ht.Top(1, "1.5", 0), theta=1, thetadot="0.2", phidot="0.5", omega3=2),
    "a spherical pendulum": scene_of(ht.Top(1, "0.4", 1), theta=2, thetadot="0.1", phidot="0.6"),
}
FORMS = [(name, carried) for name in FORMULATIONS for carried in (False, True)]
FORMS = [each for each in FORMS if each not in (("cubic", True), ("attitude", True))]
every_form = pytest.mark.parametrize(("name", "carried"), FORMS)
every_scene = pytest.mark.parametrize("which", SCENES)


def wanting(scene, carried):
    return replace(scene, quantities=("theta", "phi", "psi")[: 3 if carried else 1], events=())


def form_of(scene, name):
    form = FORMULATIONS[name].build(ht.plan(scene, name).variant)
    return form.integrated or form


def moved(scene, symbol, step):
    """Return the exact numbers of a scene, one of them moved by a step."""
    values = start_values(scene)
    return values | {symbol.name: values[symbol.name] + step}


@cache
def closed_form(which, symbol, sign):
    v = moved(SCENES[which], symbol, sign * STEP)
    top = ht.Top(v.pop("A"), v.pop("C"), v.pop("gMR"))
    return ht.Motion(top, ht.State(**v)).form(60)


def period(which):
    return float(closed_form(which, lag.A, 1).period)


@cache
def record(which, symbol, sign, t):
    return closed_form(which, symbol, sign)(t)


@cache
def start_function(form):
    return lambdified([form.start, list(form.parameters.values())], GIVEN, mp.mpf, MP)


def exactly(form, values, at=None):
    """Return states and parameters at the start or, with a record of the closed form, later."""
    start = [v.mpf(mp) for v in values.values()]
    named = dict(zip(values, start, strict=True))
    now = dict(named)
    if at is not None:
        now |= {name: mp.mpf(getattr(at, name)) for name in list(values)[3:]}
    kappa = named["C"] * (now["psidot"] + now["phidot"] * mp.cos(now["theta"]))
    turned = kappa * (1 / named["C"] - 1 / named["A"]) * mp.mpf(at.t if at else 0)
    phi, psi = now["phi"] - named["phi"], now["psi"] - named["psi"]
    if form.name == "attitude":
        now["psi"] -= turned
    sigma = form.name == "axis" and "P_plus" in map(str, form.derivatives[-1].free_symbols)
    deviations = {
        "deviation": phi + psi - turned if sigma else phi - psi + turned,
        "phi_deviation": phi,
        "psi_deviation": psi,
    }
    states, _ = start_function(form)(*(now[s.name] for s in GIVEN))
    states = [deviations.get(s.name, x) for s, x in zip(form.states, states, strict=True)]
    _, parameters = start_function(form)(*start)
    return np.array(states), dict(zip((p.name for p in form.parameters), parameters, strict=True))


def differences(which, form, t, used):
    """Return d(state(0), parameters)/dx and d state(t)/dx for every number x of a scene."""
    columns = []
    for symbol in GIVEN:
        ends = []
        for sign in (1, -1):
            values = moved(SCENES[which], symbol, sign * STEP)
            state, parameters = exactly(form, values)
            later, _ = exactly(form, values, record(which, symbol, sign, t))
            ends.append(np.concatenate((state, [parameters[p] for p in used], later)))
        columns.append((ends[0] - ends[1]) / (2 * STEP.mpf(mp)))
    n = len(form.states)
    slopes = np.array(columns, dtype=float).T
    return slopes[:-n], slopes[-n:]


def gap(ours, theirs):
    """Return the largest difference in a column, in its largest entry."""
    return np.max(abs(ours - theirs).max(axis=0) / np.maximum(abs(theirs).max(axis=0), 1e-20))


@pytest.mark.slow
@every_scene
@every_form
def test_every_column_is_the_closed_forms(name, carried, which):
    """Forwards over a period and more, and backwards; each number of the scene is moved."""
    form, T = form_of(wanting(SCENES[which], carried), name), period(which)
    found = state_transition(wanting(SCENES[which], carried), name, t=[1.3 * T, -0.4 * T])
    for i, t in enumerate(found.times):
        start, later = differences(which, form, t, found.parameters)
        assert gap(np.hstack((found.matrix[i], found.by_parameters[i])) @ start, later) < 1e-12


HELD = "A", "C", "gMR", "theta", "thetadot", "phidot"


@cache
def of_the_closed_form(scene):
    """Return T, Δφ, Δψ by everything that a scene gives, from differences at sixty digits."""
    start, found = scene.start, {}
    given = {name: getattr(start, name) for name in (*HELD[3:], start.held)}
    given |= {name: getattr(scene.top, name) for name in HELD[:3]}
    for name in given:
        ends = []
        for sign in (1, -1):
            v = given | {name: given[name] + sign * STEP}
            top = ht.Top(v.pop("A"), v.pop("C"), v.pop("gMR"))
            form = ht.Motion(top, ht.State(**v)).form(60)
            ends.append((form.period, form.precession, form.spin))
        rise = [a - b for a, b in zip(*ends, strict=True)]
        rise[1:] = [x - 2 * mp.pi * mp.nint(x / (2 * mp.pi)) for x in rise[1:]]
        found[name] = [float(x / (2 * STEP.mpf(mp))) for x in rise]
    return found


def off(found, scene):
    """Return the largest error, relative to the derivative or to its natural size."""
    T, errors = ht.Motion(scene.top, scene.start).period, []
    for name, exact in of_the_closed_form(scene).items():
        for i, ours in enumerate((found.period, found.precession, found.spin)):
            if ours is not None:
                natural = (T, 1, 1)[i] * T ** (name in ("thetadot", "phidot", "psidot", "omega3"))
                errors.append(abs(ours[name] - exact[i]) / max(abs(exact[i]), natural))
    return max(errors)


@every_scene
@pytest.mark.parametrize("name", FORMULATIONS)
def test_sensitivities_are_the_closed_forms(name, which):
    found = sensitivities(SCENES[which], name)
    assert off(found, SCENES[which]) < 1e-12
    assert (found.precession is None) == (found.spin is None) == (name == "cubic")
    held = SCENES[which].start.held
    assert list(found.period) == list(found.units) == [*HELD, held]
    assert found.units == {x: UNITS[x] for x in found.period}


THROUGH_THE_TOP = ht.State.from_constants(SICM, E="0.8", p_phi="9.24e-3", p_psi="9.24e-3", theta=1)
REGULAR = ("axis", "attitude", "cubic")
HARD = {
    "starts beside the top": (ht.State("1e-6", thetadot=3, phidot=30, omega3=140), REGULAR),
    "passes beside the top": (ht.State("0.1", phidot="14.12063", omega3=140), REGULAR),
    "through the top": (THROUGH_THE_TOP, REGULAR),
    "1e-5 off a steady precession": (
        ht.State("0.1", phidot="6.3668490938832083838", omega3=140), ("axis", "routh", "attitude")
    ),
    # where the axis form in doubles has no digit of the angles' derivatives left
    "1e-9 and 3e-7 past the poles": (
        ht.State("0.1", thetadot=50, psidot="1e-4"), ("attitude",)
    ),
    "a sleeper's fall": (ht.State("1e-9", psidot=60), ("attitude",)),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "name"), [(which, name) for which, (_, names) in HARD.items() for name in names]
)
def test_hard_motions_keep_the_digits_that_are_promised(which, name):
    """Through the top the angles jump by 2 pi from one side to the other; derivatives do not."""
    scene = ht.Scene(SICM, HARD[which][0], time=1, quantities=("theta",), events=())
    found = sensitivities(scene, name)
    assert off(found, scene) < max(1e-12, 2 * found.error) < 2e-8


def test_a_pendulum_that_turns_over_has_a_period_alone():
    scene = ht.load_scene("planar-rotating", ["start.theta=2"])
    found = sensitivities(scene)
    assert off(found, scene) < 1e-12
    assert found.precession is found.spin is None


@pytest.mark.parametrize("name", ["lagrange", "routh"])
def test_lost_digits_are_refused(name):
    scene = scene_of(SICM, theta="1e-6", thetadot=3, phidot=30, omega3=140)
    lost = f"formulation = {name}: loses its digits here.*the attitude form keeps the most"
    with pytest.raises(BadScene, match=lost):
        sensitivities(scene, name)


@pytest.mark.parametrize("name", ["axis", "attitude"])
def test_lost_digits_of_the_matrix_are_told(name):
    """The fall of a sleeping top makes rounding grow; digits that are kept are not doubted."""
    scene = scene_of(SICM, theta="1e-6", psidot=60)
    kept = state_transition(scene, name, t=[0.5])
    assert kept.error[0] < 1e-8
    with pytest.warns(DoubtfulWarning, match="state_transition: digits are lost"):
        lost = state_transition(scene, name, t=[0.5, 9, 20])
    assert lost.error[0] < 1e-8 < lost.error[2]
    truth = ht.Motion(scene.top, scene.start).form(60)
    for i, t in enumerate(lost.times):
        states, _ = exactly(form_of(scene, name), start_values(scene), truth(t))
        exact = states.astype(float)
        assert abs(lost.states[i] - exact).max() <= 2 * lost.error[i] * abs(exact).max()


@pytest.mark.parametrize("omega3", [0, 40, 100, 117])
def test_growth_of_the_sleeping_top(omega3):
    scene = ht.load_scene("sleeping-unstable", [f"start.omega3={omega3}"])
    rate = ht.facts(scene.top, scene.start).growth_rate
    t = 3 / rate
    found = state_transition(scene, t=[t]).multipliers[0]
    assert np.log(max(abs(found))) / t == pytest.approx(rate, rel=1e-12)
    assert np.log(min(abs(found))) / t == pytest.approx(-rate, rel=1e-10)


def test_times_of_either_sign_in_any_order():
    scene, t = wanting(SCENES["rising"], False), [0.3, -0.2, 0.0, 0.3]
    found = state_transition(scene, t=t)
    assert found.times.tolist() == t
    for i, each in enumerate(t):
        assert state_transition(scene, t=each).matrix[0] == pytest.approx(
            found.matrix[i], abs=1e-14
        )
    assert found.matrix[2] == pytest.approx(np.eye(5), abs=0)
    assert not found.by_parameters[2].any()
    samples = state_transition(replace(scene, samples=11))
    assert samples.times == pytest.approx(np.linspace(0, 1, 11))


@pytest.mark.parametrize("wanted", [("class",), ("theta",)])
def test_auto_takes_a_formulation_whatever_is_wanted(wanted):
    scene = replace(scene_of(SICM, theta="1e-3", psidot=200), quantities=wanted)
    auto, axis = (state_transition(scene, name, t=[0.1]) for name in ("auto", "axis"))
    assert np.array_equal(auto.matrix, axis.matrix)
    far = replace(scene, time=ht.Exact.of("1e30"), digits=500)  # the span does not matter
    assert sensitivities(far, "auto").period == pytest.approx(sensitivities(scene).period)


SCENE = "sicm-kicked"
REFUSED = [
    (state_transition, SCENE, "axes", {}, BadScene, 'axes.*did you mean "axis"'),
    (sensitivities, SCENE, "axes", {}, BadScene, 'axes.*did you mean "axis"'),
    (state_transition, SCENE, "cubic", {}, BadScene, "the cubic form does not give phi"),
    (sensitivities, "through-top", "lagrange", {}, BadScene, "cannot start at a pole"),
    (state_transition, SCENE, "axis", {"t": [0.1, np.nan]}, NotANumber, "t: "),
    (state_transition, SCENE, "axis", {"t": [[0.1]]}, NotANumber, "t: "),
    (state_transition, SCENE, "axis", {"t": -(2.0**31)}, Impossible, "t: at most"),
    (sensitivities, "separatrix", "axis", {}, BadScene, "nothing nutates: separatrix"),
]


@pytest.mark.parametrize(("function", "scene", "name", "times", "error", "said"), REFUSED)
def test_what_cannot_be_varied_is_refused(function, scene, name, times, error, said):
    with pytest.raises(error, match=said):
        function(ht.load_scene(scene), name, **times)


@pytest.mark.parametrize("name", ["lagrange", "subsystem", "routh"])
def test_a_singularity_is_named(name):
    """A pendulum through a pole, in angles; what was reached comes with the error."""
    scene = ht.load_scene("planar-rotating", ["start.theta=2"])
    with pytest.raises(EndedEarly) as caught:
        state_transition(scene, name, t=[0.1, 2.5])
    assert caught.value.outcome is Outcome.SINGULAR
    assert caught.value.trajectory.times.tolist() == [0.1]
    with pytest.raises(EndedEarly):
        sensitivities(scene, name)


@pytest.mark.slow
def test_random_ones_are_no_farther_off_than_they_say_and_planted_errors_are_found(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "validation"))
    fuzz = import_module("fuzz_sensitivities")
    assert fuzz.misses(1, 8) == []
    assert fuzz.misses_of_matrices(1, 8, ("cubic", "axis", "attitude")) == []
    own, transition = ht.sensitivities, ht.state_transition

    def slightly_off(scene, form):
        found = own(scene, form)
        return replace(found, period=found.period | {"C": found.period["C"] * (1 + 1e-6)})

    def off_too(scene, form, t):
        found = transition(scene, form, t=t)
        return replace(found, matrix=found.matrix + 1e-6 * np.eye(len(found.names)))

    monkeypatch.setattr(ht, "sensitivities", slightly_off)
    monkeypatch.setattr(ht, "state_transition", off_too)
    assert any("dperiod/dC" in miss for miss in fuzz.misses(1, 1, ("attitude",)))
    assert fuzz.misses_of_matrices(1, 1, ("axis",)) != []
