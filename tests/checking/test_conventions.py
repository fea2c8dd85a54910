"""Conventions: each is named where it was planted, none where it was not, and no wrong one."""

import numpy as np
import pytest

from heavytop import Scene, State, check
from heavytop.checking.comparison import Comparison
from heavytop.checking.conventions import OMEGAS, TABLE
from heavytop.checking.headers import HEADER_UNITS
from heavytop.checking.reading import read
from heavytop.checking.search import FIRST_ERROR, Explanation, Undoing, judge, undo_names
from heavytop.scene.quantities import RATES

from .made import SCENE, TOP, exact, matrix

T = np.linspace(0, 1.5, 151)
NAMES = [row.name for row in TABLE]


@pytest.fixture
def plants(script):
    """The plants of the validation script, which share no code with the package."""
    return script("47_conventions")


TIMES = [(unit.convention, unit.factor) for unit in HEADER_UNITS if unit.kind == "time" and unit[3]]
ALONE = sorted({x for x in NAMES if "+" not in x} - {"time-origin", "another-number"})
ALONE += ["friction", "motor"]


@pytest.mark.parametrize("name", ALONE)
def test_a_convention_that_is_planted_alone_is_named(plants, name):
    assert name in plants.PLANTS, "validation/47_conventions.py: a row of PLANTS"
    rng = np.random.default_rng([3, *map(ord, name)])
    scene = plants.random_scene(rng)
    data, form = plants.planted(scene, "exact", (name,), rng)
    assert plants.verdict(data, scene, (name,))[0] == "named", form


@pytest.mark.parametrize("form", ["angles and rates", "attitude and ω"])
@pytest.mark.parametrize(("name", "seconds"), TIMES)
def test_times_and_rates_of_one_unit_of_time_are_that_unit_alone(plants, name, seconds, form):
    """Rates a minute are nearly rates in degrees: 60 is nearly 180/π."""
    scene = plants.random_scene(np.random.default_rng(8))
    every = plants.trajectory(scene, "exact")
    data = {"t": every["t"] / seconds} | {x: every[x] for x in plants.FORMS[form]}
    rates = {x: seconds * data[x] for x in data if x in (*RATES, *OMEGAS)}
    for some in (data | rates, data | rates | {"t": every["t"]}):
        assert plants.verdict(some, scene, (name,))[0] == "named"


@pytest.mark.slow
def test_of_pairs_and_in_good_data_no_wrong_name_is_sure(plants):
    for found in (plants.pairs(7, 4), plants.good(7, 4)):
        counts, wrong = plants.counted(found)
        assert wrong == []
        assert counts.total() == 4


@pytest.mark.parametrize(("seed", "form"), [(1, "angles and rates"), (7, "angles")])
def test_the_error_of_coarse_steps_is_no_convention(plants, monkeypatch, seed, form):
    """Which a fitted moment of inertia or another clock makes smaller in something."""
    for name, value in (("ROWS", 61), ("TIMES", np.linspace(0, plants.SPAN, 61))):
        monkeypatch.setattr(plants, name, value)
    scene = plants.random_scene(np.random.default_rng(seed))
    every = plants.columns(plants.integrate(scene, "", plants.euler, 1))
    data = {x: every[x] for x in ("t", *plants.FORMS[form])}
    assert plants.verdict(data, scene, ())[0] == "named"


OTHERS = ("gMR", "psidot", "phidot", "the first row", "a constant ψ̇", "everything")


def of_another_problem(plants, name, seed=11, names=()):
    """What is said of angles of another problem than the scene's; in degrees if that is named."""
    rng = np.random.default_rng([seed, *map(ord, name)])
    scene = plants.random_scene(rng)
    of = plants.random_scene(rng) if name == "everything" else scene
    every = plants.other(of, name, 0.1)
    angle = 180 / np.pi if names else 1
    data = {"t": every["t"]} | {x: angle * every[x] for x in ("theta", "phi", "psi")}
    return plants.verdict(data, scene, names)


# a spin that was held does the same, and so does another number: in degrees it is either
@pytest.mark.parametrize(("name", "sure"), [("psidot", ("degrees",)), *((x, ()) for x in OTHERS)])
def test_another_number_is_no_convention_also_beside_one_that_is_sure(plants, name, sure):
    assert of_another_problem(plants, name, names=sure)[0] == "named"


def test_another_start_would_be_origins_but_for_the_first_row(plants, monkeypatch):
    """Some would: a new convention may do the same as one of them, and none is sure then."""
    for first, said in ((FIRST_ERROR, {"named"}), (np.inf, {"named", "wrong"})):
        monkeypatch.setattr("heavytop.checking.search.FIRST_ERROR", first)
        assert {of_another_problem(plants, "everything", k)[0] for k in (1, 2, 5)} == said


def test_a_kick_the_other_way_may_be_that_beside_conventions_that_do_the_same():
    """A mirrored world and the other spin; the fit has to be exact to be as good as they."""
    mine, other = (State("0.4", phidot=x, psidot=150) for x in (9, -9))
    for names in (("axis",), ("theta", "phi")):
        data = {"t": 2 * T} | {x: getattr(exact(2 * T, start=mine), x) for x in names}
        found = check(data, Scene(TOP, other, time=3))
        said = (found.method["sentence"], *(each.sentence for each in found.alternatives))
        assert "another number explains the data: phidot = 9" in said
        assert found.conventions == ()


def explanation(misfit, *names):
    steps = tuple(Undoing(NAMES.index(name), 0, "", 1.0) for name in names)
    return Explanation(steps, np.array([misfit]))


@pytest.mark.parametrize(("found", "sure", "alike"), [
    ([explanation(-8.0, "y-up")], {"y-up"}, 0),
    ([explanation(-8.0, "y-up"), explanation(-7.9, "spin-sign")], set(), 2),
    ([explanation(-8.0, "y-up"), explanation(-8.2, "y-up", "degrees")], {"y-up"}, 0),
    ([explanation(-4.0, "y-up"), explanation(-8.0, "y-up", "rpm")], {"y-up", "rpm"}, 0),
    ([explanation(-4.0, "rpm", "y-up"), explanation(-4.2, "rpm", "degrees")], {"rpm"}, 2),
    ([explanation(-8.0, "y-up"), explanation(-8.0, "spin-held", "degrees")], {"y-up"}, 0),
    ([explanation(-0.5, "y-up")], set(), 0),  # better, and no good
    ([explanation(-0.3, "y-up")], set(), 0),
])  # fmt: skip
def test_only_what_all_good_explanations_share_is_sure(found, sure, alike):
    verdict = judge([explanation(0.0), *found])
    assert (verdict.sure, len(verdict.alike)) == (sure, alike)


def test_a_world_that_is_mirrored_or_upside_down_with_the_body_is_both():
    found = check({"t": T, "quaternion": exact(T).quaternion * [1, 1, -1, -1]}, SCENE)
    others = [set(each.names) for each in found.alternatives]
    assert (found.conventions, {"mirrored"} in others, {"z-down"} in others) == ((), True, True)
    assert set(found.assumed[-1].removeprefix("judged as ").split(" and ")) in others


def test_a_vertical_that_points_down_is_a_world_with_z_down():
    """As an accelerometer or Poisson's equations may have it."""
    R = matrix(exact(T))
    for more in ({}, {"omega_body": np.einsum("nji,nj->ni", R, exact(T).omega)}):
        found = check({"t": T, "gamma": -R[:, 2]} | more, SCENE)
        assert [each.name for each in found.conventions] == ["z-down"]


def test_a_part_of_a_tenth_of_a_radian_is_told_from_a_step():
    """The first row is off at once, by less than a coarse integrator is later."""
    moved = exact(T * 1.001)
    found = check({"t": T, "theta": moved.theta, "phi": moved.phi + 0.1}, SCENE)
    assert [each.name for each in found.conventions] == ["azimuth-origin"]


def test_names_are_undone_where_asked():
    data = read({"t": 1000 * T, "theta": np.degrees(exact(T).theta)})
    given = Comparison(data.values, SCENE.top, SCENE.start)
    undone = undo_names(given, ["degrees", "milliseconds"])
    assert abs(undone.arrays["theta"] - exact(T).theta).max() < 1e-14
