"""The explorer: what the page computes, in a browser, against the package; and how it is used."""

import json
import math
import random
import re
import subprocess
import sys
import time

import numpy as np
import pytest

import heavytop as ht
from heavytop.plots.style import KINDS
from heavytop.report.explorer import LIMITS, PLAIN
from heavytop.scene.scene import read_scene

from ..motions import FURTHER, MOTIONS, SCENES, named, shipped
from .browser import SECOND
from .conftest import HOSTILE
from .explorer_page import chosen, opened, put, state, text

pytestmark = pytest.mark.slow
RANDOM, SEED = 320, 5
NAMES = ("theta", "phi", "psi", "thetadot", "phidot")
BESIDE = {
    "within 1e-9 of the separatrix",
    "1e-9 off uniform",
    "1e-20 past the top",
    "1e-20 off uniform",
    "1e-30 beyond the separatrix",
}  # of another kind: doubles cannot tell
APART = 1e-9  # of a boundary, and of an angle [rad]
STILL = ("at-rest", "sleeping", "hanging")  # φ and ψ of a vertical axis are not told apart


def random_motions(beside_poles=False):
    """Tops of every shape, either sign of gravity, and starts that make every generic kind."""
    draw = random.Random(SEED)
    for _ in range(RANDOM):
        A, pull = 10 ** draw.uniform(-4, 1), draw.choice((1, 1, 1, -1)) * 10 ** draw.uniform(0, 2.5)
        C, rate = A * draw.uniform(0.01, 2), math.sqrt(abs(pull))
        start = {
            "phi": draw.uniform(-3, 3),
            "psi": draw.uniform(-3, 3),
            "thetadot": draw.choice((0, draw.uniform(-2, 2) * rate)),
            "phidot": draw.choice((0, 1, 1)) * draw.uniform(-4, 4) * rate,
            draw.choice(("psidot", "omega3")): draw.uniform(-6, 6) * rate * A / C,
        }
        tilt = draw.uniform(0.02, 3.12)
        if beside_poles:
            near = 10 ** draw.uniform(-6, -1)
            tilt = draw.choice((near, math.pi - near))
        yield ht.Motion(ht.Top(A, C, pull * A), ht.State(tilt, **start))


def numbers(motion):
    top, start = motion.top, motion.start
    known = {name: float(getattr(top, name)) for name in ("A", "C", "gMR")}
    return known | {name: float(getattr(start, name)) for name in (*NAMES, "omega3")}


def times(motion):
    length = motion.period or 2 * math.pi / max(1.0, abs(motion.mean_angle_rates[0]))
    return [0.31 * length, 0.53 * length, 1.07 * length, 2.9 * length]


# --- what it computes ------------------------------------------------------------------------


def asked(page, motions):
    tops = [{"top": numbers(each), "t": times(each)} for each in motions]
    return page.value(
        f"{json.dumps(tops)}.map(({{ top, t }}) => {{ const m = heavytop.motion(top, t);"
        "return { ...explorer.classify(top), complete: m.complete, theta: [...m.theta],"
        "phi: [...m.phi], psi: [...m.psi], quaternion: [...m.quaternion],"
        "momentum: [...m.momentum], ...heavytop.reach(top) }; })"
    )


def hold_kinds(motions, found):
    for motion, each in zip(motions, found, strict=True):
        assert each["kind"] == str(motion.kind), motion
        assert each["detail"] is None or each["detail"] in motion.tags, motion


def test_random_tops_have_the_kinds_and_the_angles_of_the_package(page):
    motions = list(random_motions())
    found = asked(page, motions)
    hold_kinds(motions, found)
    assert min(each["margin"] for each in found) > APART
    worst = 0.0
    for motion, each in zip(motions, found, strict=True):
        there = motion.at(times(motion))
        for name in NAMES[:3]:
            worst = max(worst, np.abs(np.array(each[name]) - getattr(there, name)).max())
    assert worst < APART


def test_special_tops_have_the_kinds_and_the_angles_of_the_package(page):
    """Cusps, steady, sleeping, asymptotic, passing: their exact numbers as doubles."""
    motions = [*map(named, (MOTIONS | FURTHER).keys() - BESIDE), *map(shipped, SCENES)]
    found = asked(page, motions)
    assert {each["kind"] for each in found} == {str(kind) for kind in ht.Kind} - {"undecided"}
    hold_kinds(motions, found)
    held = 0
    for motion, each in zip(motions, found, strict=True):
        tags, kind, there = motion.tags, str(motion.kind), motion.at(times(motion))
        if kind in STILL or "near-separatrix" in tags:
            continue
        creeping = kind == "separatrix" or "asymptotic" in tags
        upto = 1 if creeping else len(there.t)  # errors grow there as exp(λt)
        held += 1
        for name in NAMES[:3]:
            exact = getattr(there, name)[:upto]
            assert each[name][:upto] == pytest.approx(exact, abs=APART), motion
    assert held > 45


@pytest.mark.parametrize("beside_poles", [False, True])
def test_tilts_and_periods_that_it_tells_are_those_of_the_package(page, beside_poles):
    motions = list(random_motions(beside_poles))
    for motion, each in zip(motions, asked(page, motions), strict=True):
        assert each["ends"] == pytest.approx([motion.theta_min, motion.theta_max], abs=1e-6)
        assert each["period"] == pytest.approx(motion.period, rel=1e-12)


def test_the_attitude_and_the_momentum_that_are_drawn_are_those_of_the_package(page):
    motions = list(random_motions())[:40]
    for motion, each in zip(motions, asked(page, motions), strict=True):
        there = motion.at(times(motion))
        found = np.array(each["quaternion"]).reshape(-1, 4)
        assert np.abs(np.sum(found * there.quaternion, axis=1)) == pytest.approx(1.0, abs=1e-12)
        momentum = float(motion.top.A) * np.array(each["momentum"]).reshape(-1, 3)
        known = motion.constants.floats
        size = np.linalg.norm(momentum, axis=1).max()
        assert momentum[:, 2] == pytest.approx(known["p_phi"], abs=1e-12 * size)
        along = np.sum(momentum * there.axis, axis=1)
        assert along == pytest.approx(known["p_psi"], abs=1e-9 * size)


def test_the_effective_potential_and_the_energy_are_those_of_the_package(page):
    top = json.dumps(numbers(shipped("sicm-kicked")))
    V = page.value(f"[0.2, 0.5, 1.5].map(heavytop.potential({top}))")
    potential = ht.analytic.potential.Potential(shipped("sicm-kicked"))
    assert pytest.approx(3.28e-4 * potential(np.array([0.2, 0.5, 1.5])), rel=1e-12) == V
    E = page.value(f"heavytop.constants({top}).E_prime")
    assert pytest.approx(shipped("sicm-kicked").constants.floats["E_prime"], rel=1e-12) == E


# --- what it says ----------------------------------------------------------------------------


def test_every_shipped_scene_is_named_and_explained_as_the_package_does(page):
    for name in SCENES:
        chosen(page, name)
        motion = shipped(name)
        label, *detail = text(page, "kind").split(", ")
        assert label == KINDS[str(motion.kind)].label
        assert set(detail) <= set(motion.tags)
        assert text(page, "plain") == PLAIN[motion.kind]
        reason = text(page, "reason")
        assert reason
        if motion.kind == "sleeping":  # in numbers, below
            continue
        assert not re.search(r"theta|phi|psi|dot|\^|'", reason)
        letters = re.sub(r"[^A-Zabcdefghijklmnoqrtuvwxyz]", "", reason)  # those that stay
        assert set(letters) <= set(motion.verdict.why)


def test_the_axis_goes_round_at_its_mean_rate_over_whole_nutations(page):
    held = 0
    for name in SCENES:
        chosen(page, name)
        motion, rate = shipped(name), page.value("explorer.shown().rate")
        if str(motion.kind) == "separatrix" or "asymptotic" in motion.tags:
            assert rate is None  # it has no mean
        elif str(motion.kind) not in STILL:
            held += 1
            assert rate == pytest.approx(motion.mean_angle_rates[0], rel=1e-8, abs=1e-12), name
    assert held > 15
    chosen(page, "sicm-kicked")
    assert "0.858318 s, 7.32034 rad/s on average" in text(page, "facts")


def test_what_is_nothing_but_rounding_is_zero(page):
    for name, typed in {"theta": "90", "phidot": "0", "spin": "140"}.items():
        put(page, name, typed)
    facts = text(page, "facts")
    assert "pφ, pψ0, 0.00924 kg m²/s" in facts
    assert "E′0 J" in facts
    for name, typed in {"phidot": "9", "spin": "0"}.items():
        put(page, name, typed)
    assert "0 and 0 rad/s" in text(page, "facts")


def test_the_scene_that_is_copied_is_the_top_that_is_seen(page):
    for name in SCENES:
        chosen(page, name)
        copied, scene = read_scene(text(page, "toml")), ht.load_scene(name)
        assert copied.start == scene.start
        assert (copied.top.A, copied.top.C) == (scene.top.A, scene.top.C)
        assert copied.top.gMR == scene.top.gMR
    for name, typed in {"theta": "33.3", "spin": "1e2", "phidot": "-0.7", "shape": "1.3"}.items():
        put(page, name, typed)
    seen, copied = state(page), read_scene(text(page, "toml"))
    assert 'theta = "33.3 deg"' in text(page, "toml")  # as it was typed
    assert float(copied.start.theta) == pytest.approx(seen["theta"], rel=1e-15)
    assert seen["theta"] == math.radians(33.3)
    assert float(copied.start.phidot) == seen["phidot"] == -0.7
    assert float(copied.start.spin) == seen["spin"] == 100
    assert copied.start.held == seen["held"]
    assert float(copied.top.C) == seen["C"]
    assert str(ht.classify(copied.top, copied.start).kind) == page.value(
        "explorer.shown().verdict.kind"
    )


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


@pytest.mark.parametrize(
    "fragment",
    ["#theta=<img src=x onerror=alert(1)>", "#theta=7", "#A=0", "#C=1", "#gMR=NaN", "#phidot=1e99",
     "#psidot=Infinity", "#theta=", "#%"],
)  # fmt: skip
def test_a_link_that_cannot_be_leaves_the_scene_of_the_page(page, html, fragment):
    opened(page, html, fragment)
    assert state(page)["phidot"] == -15
    told = text(page, "refused")
    assert ("The link cannot be followed" in told) == (fragment != "#%")
    assert page.value("document.images.length") == 0


def test_what_is_no_number_is_refused_beside_its_box(page):
    put(page, "phidot", "7")
    of = "document.querySelector('input[data-of=phidot]')"
    for typed in ("<b>1</b>", "", "1e99", "1,500", "2 kg", "alert(1)", "2**"):
        page.value(f"{of}.value = {json.dumps(typed)}; {of}.dispatchEvent(new Event('input'))")
        assert page.value(f"{of}.getAttribute('aria-invalid')") == "true"
        assert text(page, "phidot-fault")
        assert state(page)["phidot"] == 7
    page.value(f"{of}.dispatchEvent(new Event('blur'))")
    assert page.value(f"{of}.value") == "7"
    assert page.value(f"{of}.getAttribute('aria-invalid')") is None


def test_what_a_kick_holds_can_be_changed_and_the_top_stays(page):
    before = page.value("explorer.shown().own.omega3")
    page.value("document.querySelector('input[value=omega3]').click()")
    assert state(page)["spin"] == pytest.approx(before)
    assert page.value("explorer.shown().own.omega3") == pytest.approx(before, rel=1e-15)


# --- how it is used --------------------------------------------------------------------------


def key(page, name):
    code = {"ArrowRight": 39, "ArrowLeft": 37, "End": 35}[name]
    for kind in ("keyDown", "keyUp"):
        page.ask("Input.dispatchKeyEvent", type=kind, key=name, code=name,
                 windowsVirtualKeyCode=code)  # fmt: skip


def test_sliders_are_moved_with_keys_and_the_kind_follows_at_once(page):
    page.value("document.getElementById('phidot-slider').focus()")
    before = state(page)["phidot"]
    key(page, "ArrowRight")
    page.until(f"explorer.state().phidot > {before}")
    key(page, "End")
    page.until("explorer.state().phidot === 50")
    assert state(page)["theta"] == 0.1  # the others keep all their digits
    page.value("document.getElementById('theta-slider').focus()")
    key(page, "End")
    page.until(f"explorer.state().theta === {math.pi}")
    assert text(page, "kind") == "hanging"
    assert text(page, "plain").startswith("The axis hangs")
    assert 'theta = "pi"' in text(page, "toml")


@pytest.mark.parametrize("tilt", ["15", "25", "60"])
def test_a_cusp_is_no_reversal(page, tilt):
    for name, typed in {"theta": tilt, "phidot": "0", "spin": "140"}.items():
        put(page, name, typed)
    assert text(page, "kind") == "cusps"
    seen = page.value("document.body.innerText")
    assert "cusp" in seen
    assert "reversal of precession" not in seen


def test_a_click_on_the_plane_of_kicks_moves_the_top_there(page):
    place = page.value(
        "(() => { const e = document.getElementById('plane'); e.scrollIntoView();"
        "const r = e.getBoundingClientRect(); return { x: r.x + 0.8 * r.width,"
        "y: r.y + 0.2 * r.height }; })()"
    )
    for kind in ("mousePressed", "mouseReleased"):
        page.ask("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)
    page.until("explorer.state().phidot > 20 && explorer.state().spin > 200")
    kind = page.value("explorer.shown().verdict.kind")
    assert kind == str(
        ht.classify(*(lambda s: (s.top, s.start))(read_scene(text(page, "toml")))).kind
    )


def test_every_control_has_a_name_and_the_kind_is_told(page):
    tree = page.ask("Accessibility.getFullAXTree")["nodes"]
    roles = ("slider", "textbox", "button", "combobox", "radio", "link", "image")
    nodes = [each for each in tree if each.get("role", {}).get("value") in roles]
    assert len(nodes) > 25
    assert all(each.get("name", {}).get("value") for each in nodes)
    assert page.value("document.getElementById('answer').getAttribute('aria-live')") == "polite"
    for name in ("tilt", "potential", "plane"):
        assert page.value(
            f"document.getElementById('{name}').getAttribute('aria-label').length > 40"
        )
    assert "°" in page.value(
        "document.getElementById('theta-slider').getAttribute('aria-valuetext')"
    )


PLAYING = "document.querySelector('.player').player.state().playing"


def test_it_plays_by_itself_but_where_less_motion_is_asked_for(browser, html):
    browser.ask("Emulation.clearDeviceMetricsOverride")
    opened(browser, html)
    browser.until(PLAYING)
    opened(browser, html, prefers_reduced_motion="reduce")
    put(browser, "phidot", "5")
    time.sleep(3 * SECOND)
    assert not browser.value(PLAYING)


@pytest.mark.parametrize("width", [1280, 390, 360])
def test_it_fits_the_screen(browser, html, width):
    browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=844,
                deviceScaleFactor=1, mobile=width < 500)  # fmt: skip
    opened(browser, html)
    assert browser.value("document.documentElement.scrollWidth") <= width
    inside = (
        "[...document.querySelectorAll('section')].every((e) => e.scrollWidth <= e.clientWidth)"
    )
    assert browser.value(inside)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_as_light_as_is_asked_for(browser, html, scheme, tmp_path):
    browser.ask("Emulation.clearDeviceMetricsOverride")
    opened(browser, html, prefers_color_scheme=scheme)
    browser.value("document.getElementById('tilt').scrollIntoView({ block: 'center' })")
    time.sleep(3 * SECOND)
    rect = "document.getElementById('tilt').getBoundingClientRect()"
    left, top, height = browser.value(f"(({{ x, y, height }}) => [x, y, height])({rect})")
    down, across = slice(int(top), int(top + height)), slice(int(left), int(left) + 50)
    picture = browser.picture(tmp_path / "page.png")
    letters = picture[down, across]  # of the axis, on its ground
    if scheme == "dark":
        assert picture.mean() < 0.3
        assert letters.max() > 0.5
    else:
        assert picture.mean() > 0.8
        assert letters.min() < 0.5


def test_the_page_is_small_and_loads_nothing(html):
    page = html.read_text("utf-8")
    assert html.stat().st_size < 200_000
    assert not re.findall(r"<[^>]*\ssrc=", re.sub("<script.*?</script>", "", page, flags=re.DOTALL))
    assert page.count("<script") == page.count("</script>") == 5
    assert "default-src" in page


def test_texts_of_a_scene_are_no_markup(browser, tmp_path):
    scene = ht.load_scene("sicm-dropped", overrides=HOSTILE)
    opened(browser, ht.explore(scene, tmp_path / "x.html"))
    assert state(browser)["phidot"] == 0
    assert browser.value("document.images.length") == 0


def test_nothing_complained_and_nothing_was_asked_for(browser):
    """The last in a browser: all that was heard before is judged."""
    browser.value("1")
    assert list(browser.complaints()) == []


# --- the verb --------------------------------------------------------------------------------


def test_a_top_that_the_page_does_not_take_is_refused_whole(tmp_path):
    fast = ht.Scene(ht.Top(1, "1e-7", 1), ht.State(1, psidot="1e7"), time=1)
    with pytest.raises(ht.BadScene) as refused:
        ht.explore(fast, tmp_path / "x.html")
    assert {fault.key for fault in refused.value.faults} == {"psidot", "C/A"} <= set(LIMITS)
    assert not any(tmp_path.iterdir())


@pytest.mark.processes
def test_the_command_writes_the_page_of_a_scene(tmp_path):
    words = [sys.executable, "-m", "heavytop", "explore", "sleeping", "-o", "x.html"]
    found = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert found.stdout.startswith("x.html: 0.")
    wrong = [*words[:-1], "x.txt"]
    assert subprocess.run(wrong, cwd=tmp_path, capture_output=True, check=False).returncode == 2
