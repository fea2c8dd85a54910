"""The usual slips: each is named where it was planted, and none where it was not."""

import numpy as np
import pytest

from heavytop.analytic.motion import Motion
from heavytop.checking.data import Data
from heavytop.checking.judge import check
from heavytop.checking.problem import Comparison
from heavytop.checking.slips import WORLDS, find_slip
from heavytop.errors import ForeignFile
from heavytop.scene.state import State
from heavytop.scene.top import Top

from .made import NAMES, matrix, random_scene, runge_kutta

T = np.linspace(0, 6, 301)


def moved(scene, top=None, start=None):
    return Motion(top or scene.top, start or scene.start).at(T)


def vectors(record, space=None, body=None):
    space, body = (np.eye(3) if x is None else x for x in (space, body))
    return {"matrix": space @ matrix(record) @ body, "omega": record.omega @ space.T}


def world(spelled):
    """What makes the data's x, y, z of the package's."""
    x, y, z = np.eye(3)
    named = {"x": x, "y": y, "z": z, "-x": -x, "-y": -y, "-z": -z}
    return np.array([named[word] for word in spelled.split()])


def about(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def held(scene):
    values = {name: getattr(scene.start, name) for name in NAMES[:5]}
    return moved(scene, start=State(**values, omega3=scene.start.psidot))


def centre(scene):
    A, C = float(scene.top.A), float(scene.top.C)
    return moved(scene, Top(max(0.7 * A, 0.51 * C), C, scene.top.gMR))


def flipped(scene):
    return moved(scene, Top(scene.top.A, scene.top.C, -scene.top.gMR))


PLANTED = {
    "degrees": lambda s: {n: np.degrees(getattr(moved(s), n)) for n in NAMES},
    "milliseconds": lambda s: vectors(moved(s)) | {"t": 1000 * T},
    "quaternion-xyzw": lambda s: {"quaternion": np.roll(moved(s).quaternion, -1, axis=1)},
    "inverse-rotation": lambda s: {"quaternion": moved(s).quaternion * [1, -1, -1, -1]},
    "spin-held": lambda s: vectors(held(s)),
    "azimuth-origin": lambda s: vectors(moved(s), about(0.5)),
    "gravity-sign": lambda s: vectors(flipped(s)),
    "inertia-about-centre": lambda s: vectors(centre(s)),
    **{
        name: lambda s, spelled=spelled: {"axis": moved(s).axis @ world(spelled).T}
        for name, spelled in WORLDS.items()
        if name != "z-up"
    },
}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("slip", PLANTED)
def test_a_planted_slip_is_named(slip, seed):
    scene = random_scene(np.random.default_rng(seed))
    found = check({"t": T} | PLANTED[slip](scene), scene).slip
    assert found.name == slip
    assert found.error_before is None or found.error_before > 100 * found.error_after
    assert found.error_after < 1e-9


@pytest.mark.parametrize("name", [name for name in WORLDS if name != "z-up"])
def test_a_world_may_be_turned_about_its_vertical_and_have_a_body_of_its_own(name):
    scene, space = random_scene(np.random.default_rng(11)), world(WORLDS[name])
    for body in (None, space.T):
        found = check({"t": T} | vectors(moved(scene), space @ about(-0.5), body), scene).slip
        assert found.name == name
        assert "turned by 28.6° about the vertical" in found.sentence
        assert f"package's {', '.join(WORLDS[name].replace('-', '−').split())}" in found.sentence


def test_a_sentence_has_its_numbers():
    scene = random_scene(np.random.default_rng(5))
    found = check({"t": T} | PLANTED["inertia-about-centre"](scene), scene)
    A, C = float(scene.top.A), float(scene.top.C)
    other = max(0.7 * A, 0.51 * C)
    assert f"A is {other:.6g}, not {A:.6g}" in found.slip.sentence
    assert f"mass times distance squared is {A - other:.4g}" in found.slip.sentence
    assert f"{found.slip.name}: {found.slip.sentence}; undoing it makes the error" in str(found)


@pytest.mark.parametrize("slip", ["milliseconds", "inverse-rotation", "gravity-sign"])
def test_a_slip_is_named_where_only_the_top_is_known(slip):
    """From the data alone gravity that points up and z that points down are one."""
    scene = random_scene(np.random.default_rng(2))
    told = {"t": T, "omega": moved(scene).omega} | PLANTED[slip](scene)
    assert check(told, scene.top).slip.name == slip.replace("gravity-sign", "z-down")


def test_a_slip_is_named_where_the_first_row_is_no_start():
    scene = random_scene(np.random.default_rng(2))
    with pytest.raises(ForeignFile, match="it would fit if the angles are in degrees"):
        check({"t": T} | PLANTED["degrees"](scene), scene.top)


def good(seed):
    """Good data, some far from exact: a phase that runs away, noise, a coarse integrator."""
    rng = np.random.default_rng(1000 + seed)
    scene, t = random_scene(rng), np.linspace(0, 6, 121)
    motion, kind = Motion(scene.top, scene.start), seed % 4
    told = {"axis": motion.at(t * (1 + (kind == 1) * rng.normal(0, 3e-3))).axis}
    if kind == 2:
        told["axis"] = told["axis"] + rng.normal(0, 1e-3, (t.size, 3))
    if kind == 3:
        told = runge_kutta(t, scene.top, scene.start)
    told.pop("t", None)
    return Comparison(Data("mine", t, told), scene.top, scene.start)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(200))
def test_no_slip_is_named_in_good_data(seed):
    problem = good(seed)
    assert problem.misfit < 0.3
    assert find_slip(problem) is None
