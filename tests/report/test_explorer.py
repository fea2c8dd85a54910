"""The explorer: what the page computes, in a browser, against the package; and how it is used."""

import json
import math

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.potential import Potential
from heavytop.plots.style import KIND_STYLES
from heavytop.report.explorer import PLAIN_LIMITS, POLAR
from heavytop.scene.scene import read_scene

from ..commands import document, refused
from ..motions import FURTHER, MOTIONS, SCENES, named, shipped
from ..starts import regular, top_and_state
from .conftest import HOSTILE

pytestmark = pytest.mark.slow
SHOWN = "Boolean(window.explorer?.shown() && window.explorer.settled())"
NAMES = ("theta", "phi", "psi", "thetadot", "phidot")
BESIDE = {"within 1e-9 of the separatrix", "1e-9 off uniform", "1e-20 past the top",
          "1e-20 off uniform", "1e-30 beyond the separatrix"}  # doubles cannot tell  # fmt: skip
APART = 1e-9  # of a boundary, and of an angle [rad]
STILL = ("at-rest", "sleeping", "hanging")  # φ and ψ of a vertical axis are not told apart


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    return ht.explore(path=tmp_path_factory.mktemp("page") / "explore.html")


@pytest.fixture
def page(browser, html):
    """The page at its start."""
    return opened(browser, html)


def opened(browser, html, fragment=""):
    browser.ask("Page.navigate", url="about:blank")
    browser.ask("Page.navigate", url=html.as_uri() + fragment)
    browser.until(f"document.readyState === 'complete' && {SHOWN}")
    return browser


def box(name):
    """The first box of a number."""
    return f"document.querySelector('input[data-of={name}]')"


def put(page, name, text, leave=True):
    """Type a text into the first box of a number, and leave it."""
    page.value(f"{box(name)}.value = {json.dumps(text)}")
    for event in ("input", "blur")[: 1 + leave]:
        page.value(f"{box(name)}.dispatchEvent(new Event('{event}'))")
    page.until(SHOWN)


def text(page, name):
    page.until(SHOWN)
    return page.value(f"document.getElementById('{name}').textContent")


def state(page):
    page.until(SHOWN)
    return page.value("explorer.state()")


def chosen(page, name):
    of = "document.getElementById('scene')"
    page.value(f"{of}.value = {json.dumps(name)}; {of}.dispatchEvent(new Event('change'))")
    page.until(SHOWN)


# --- what it computes ------------------------------------------------------------------------


def random_motions(beside_poles):
    """Tops of every shape, either sign of gravity, and starts that make every generic kind."""
    draw, n = np.random.default_rng(5), 320
    numbers = regular(draw, n) | {name: draw.uniform(-3, 3, n) for name in ("phi", "psi")}
    for name in ("thetadot", "phidot"):  # turning points, reversals and cusps at the start, too
        numbers[name] *= draw.choice((0, 1, 1, 1), n)
    if beside_poles:
        near = 10 ** draw.uniform(-9, -1, n)
        numbers["theta"] = draw.choice((near, math.pi - near))
    for row in zip(*numbers.values(), strict=True):
        yield ht.Motion(*top_and_state(dict(zip(numbers, row, strict=True))))


def numbers(motion):
    top, start = motion.top, motion.start
    known = {name: float(getattr(top, name)) for name in ("A", "C", "gMR")}
    return known | {name: float(getattr(start, name)) for name in (*NAMES, "omega3")}


def times(motion):
    length = motion.period or 2 * math.pi / max(1.0, abs(motion.mean_angle_rates[0]))
    return [0.31 * length, 0.53 * length, 1.07 * length, 2.9 * length]


def computed(page, motions):
    tops = [{"top": numbers(each), "t": times(each)} for each in motions]
    return page.value(
        f"{json.dumps(tops)}.map(({{ top, t }}) => {{ const m = heavytop.motion(top, t);"
        "return { ...explorer.classify(top), ...heavytop.reach(top), theta: [...m.theta],"
        "phi: [...m.phi], psi: [...m.psi] }; })"
    )


def hold_kinds(motions, found):
    assert [each["kind"] for each in found] == [str(motion.kind) for motion in motions]
    for motion, each in zip(motions, found, strict=True):
        assert each["detail"] is None or each["detail"] in motion.tags, motion


def hold_angles(motion, found, upto=None):
    there = motion.at(times(motion))
    for name in NAMES[:3]:
        exact = getattr(there, name)[:upto]
        assert found[name][:upto] == pytest.approx(exact, rel=0, abs=APART), motion


@pytest.mark.parametrize("beside_poles", [False, True])
def test_random_tops_have_the_kinds_and_the_angles_of_the_package(page, beside_poles):
    motions = list(random_motions(beside_poles))
    found = computed(page, motions)
    for motion, each in zip(motions, found, strict=True):
        assert each["ends"] == pytest.approx([motion.theta_min, motion.theta_max], abs=1e-6)
        assert each["period"] == pytest.approx(motion.period, rel=1e-12)
    if not beside_poles:
        hold_kinds(motions, found)
        assert min(each["margin"] for each in found) > APART
        for motion, each in zip(motions, found, strict=True):
            hold_angles(motion, each)


def test_special_tops_have_the_kinds_and_the_angles_of_the_package(page):
    """Cusps, steady, sleeping, asymptotic, passing: their exact numbers as doubles."""
    motions = [*map(named, (MOTIONS | FURTHER).keys() - BESIDE), *map(shipped, SCENES)]
    found = computed(page, motions)
    assert {each["kind"] for each in found} == {str(kind) for kind in ht.Kind} - {"undecided"}
    hold_kinds(motions, found)
    held = 0
    for motion, each in zip(motions, found, strict=True):
        kind = str(motion.kind)
        if kind in STILL or "near-separatrix" in motion.tags:
            continue
        creeping = kind == "separatrix" or "asymptotic" in motion.tags
        hold_angles(motion, each, 1 if creeping else None)  # errors grow there as exp(λt)
        held += 1
    assert held > 45


def test_the_effective_potential_and_the_energy_are_those_of_the_package(page):
    top = json.dumps(numbers(shipped("sicm-kicked")))
    V = page.value(f"[0.2, 0.5, 1.5].map(heavytop.potential({top}))")
    potential = Potential(shipped("sicm-kicked"))
    assert pytest.approx(3.28e-4 * potential(np.array([0.2, 0.5, 1.5])), rel=1e-12) == V
    E = page.value(f"heavytop.constants({top}).E_prime")
    assert pytest.approx(shipped("sicm-kicked").constants.floats["E_prime"], rel=1e-12) == E


# --- what it says ----------------------------------------------------------------------------


def test_every_shipped_scene_is_explained_and_copied_as_the_package_has_it(page):
    for name in SCENES:
        chosen(page, name)
        motion = shipped(name)
        label, *detail = text(page, "kind").split(", ")
        assert label == KIND_STYLES[str(motion.kind)].label
        assert set(detail) <= set(motion.tags)
        assert text(page, "plain") == PLAIN_LIMITS[motion.kind]
        assert text(page, "reason")
        copied = read_scene(text(page, "toml"))
        assert (repr(copied.top), copied.start) == (repr(motion.top), motion.start)
        goes_round = motion.kind not in POLAR and motion.round
        assert bool(page.value("explorer.shown().rate")) == bool(goes_round) or motion.kind in STILL


def test_a_scene_is_copied_as_it_was_typed(page):
    for name, typed in {"theta": "33,3", "spin": "260 rpm", "phidot": "2*pi/3"}.items():
        put(page, name, typed)
    put(page, "shape", "1.3")
    seen, toml = state(page), text(page, "toml")
    for line in (f'{seen["held"]} = "260 rpm"', 'theta = "33.3 deg"', 'phidot = "2*pi/3"'):
        assert line in toml
    copied = read_scene(toml)
    for name in ("theta", "phidot", "spin"):
        assert float(getattr(copied.start, name)) == pytest.approx(seen[name], rel=1e-15)
    assert (copied.start.held, float(copied.top.C)) == (seen["held"], seen["C"])
    kind = page.value("explorer.shown().verdict.kind")
    assert str(ht.classify(copied.top, copied.start).kind) == kind


def test_a_link_brings_every_state_back(page, html):
    for name, typed in {"theta": "71", "spin": "-55", "phidot": "3.125", "pull": "-20"}.items():
        put(page, name, typed)
    page.value("document.querySelector('input[value=omega3]').click()")
    before = state(page)
    assert before["held"] == "omega3"
    link = page.value("document.getElementById('link').href")
    page.until(f"location.href === {json.dumps(link)}")  # the address of the page follows
    opened(page, html, "#" + link.partition("#")[2])
    assert state(page) == before
    page.value("location.hash = '#theta=0.5&psidot=9'")
    page.until("explorer.state().theta === 0.5")
    assert state(page) | {"theta": 0.5, "spin": 9, "held": "psidot"} == state(page)


NO_LINKS = ["#theta=<img src=x onerror=alert(1)>", "#theta=7", "#gMR=NaN", "#theta=", "#%"]


@pytest.mark.parametrize("fragment", NO_LINKS)
def test_a_link_that_cannot_be_leaves_the_scene_of_the_page(page, html, fragment):
    opened(page, html, fragment)
    assert (state(page)["phidot"], page.value("document.images.length")) == (-15, 0)
    assert ("The link cannot be followed" in text(page, "refused")) == (fragment != "#%")


def test_what_is_no_number_is_refused_beside_its_box(page):
    put(page, "phidot", "7")
    invalid = f"{box('phidot')}.getAttribute('aria-invalid')"
    for typed in ("<b>1</b>", "", "1e99", "1,500", "2 kg", "alert(1)", "2**"):
        put(page, "phidot", typed, leave=False)
        assert (page.value(invalid), state(page)["phidot"]) == ("true", 7)
        assert text(page, "phidot-fault")
    put(page, "phidot", "20 turns a second", leave=False)
    assert "rps" in text(page, "phidot-fault")
    put(page, "phidot", "2**")
    assert (page.value(invalid), page.value(f"{box('phidot')}.value")) == (None, "7")


# --- what is typed ---------------------------------------------------------------------------


def test_a_number_is_understood_as_people_write_it(page):
    for name, typed, key, value in (
        ("spin", "260 rpm", "spin", 260 * math.pi / 30),
        ("spin", "157,08", "spin", 157.08),
        ("spin", "−3^2 + sqrt(4)*(1 - 2/4)", "spin", -8.0),
        ("spin", "2*-3", "spin", -6.0),
        ("theta", "0.5 rad", "theta", 0.5),
        ("spin", "30 deg/s", "spin", math.pi / 6),
        ("theta", "0,5", "theta", math.radians(0.5)),
        ("A", "3.28 g cm²", "A", 3.28e-7),
    ):
        put(page, name, typed)
        assert state(page)[key] == pytest.approx(value, rel=1e-15), typed
        assert text(page, f"{name}-fault") == "", typed


def test_a_top_is_given_by_its_moment_mass_and_distance(page):
    """A textbook's top: 0.5 kg, 0.05 m."""
    for name, typed in {"A": "12e-4", "shape": "0.375", "mass": "0.5", "distance": "5 cm"}.items():
        put(page, name, typed)
    seen = state(page)
    assert (seen["A"], seen["C"], seen["mass"]) == (12e-4, 4.5e-4, 0.5)
    assert seen["gMR"] == pytest.approx(0.5 * 9.81 * 0.05, rel=1e-15)
    put(page, "mass", "1")  # the distance was given: it stays
    assert state(page)["gMR"] == pytest.approx(9.81 * 0.05, rel=1e-15)
    assert page.value(f"{box('distance')}.value") == "0.05"


def test_mass_and_distance_are_those_of_a_scene_and_out_of_sight_where_it_has_none(page):
    for scene, value in (("spherical-pendulum", "1"), ("sicm-kicked", "")):
        chosen(page, scene)
        for name in ("mass", "distance"):
            assert page.value(f"{box(name)}.value") == value
            assert page.value(f"{box(name)}.checkVisibility()") == (value != "")


# --- how it is used --------------------------------------------------------------------------


EDGES = """new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
  const c = document.querySelector('.player canvas'), pen = c.getContext('2d');
  done([0, c.height - 1].map((y) => pen.getImageData(0, y, c.width, 1).data.filter((x, i) =>
    i % 4 === 3 && x > 200).length / c.width)); })))"""


def test_a_wheel_is_in_sight_of_a_phone(browser, html):
    """Of the highest and lowest pixels few are drawn: lines cross the edges, the wheel does not."""
    phone = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": False}
    browser.ask("Emulation.setDeviceMetricsOverride", **phone)
    page = opened(browser, html)
    for name, typed in {"theta": "80", "shape": "1.3"}.items():
        put(page, name, typed)
    page.value("document.querySelector('[data-do=side]').click()")
    page.until(SHOWN)
    assert max(page.value(EDGES)) < 0.1
    browser.ask("Emulation.clearDeviceMetricsOverride")


def test_the_page_is_small_and_may_load_nothing(html):
    page = html.read_text("utf-8")
    assert len(page) < 200_000
    assert "default-src" in page


def test_texts_of_a_scene_are_no_markup(browser, tmp_path):
    scene = ht.load_scene("sicm-dropped", overrides=HOSTILE)
    opened(browser, ht.explore(scene, tmp_path / "x.html"))
    assert (state(browser)["phidot"], browser.value("document.images.length")) == (0, 0)


# --- the verb --------------------------------------------------------------------------------


def test_the_command_writes_the_page_of_a_scene(tmp_path):
    page = tmp_path / "x.html"
    assert document("explore", "sleeping", "-o", page)["file"] == str(page)
    refused(2, "explore", "sleeping", "-o", tmp_path / "x.txt")
