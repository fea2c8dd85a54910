"""The explorer on a phone of 390 × 844 px, with a finger; and what is typed and read there."""

import math
import time

import pytest

import heavytop as ht
from heavytop.plots.style import PATH
from heavytop.report.explorer import explore
from heavytop.scene.scene import read_scene

from ..motions import SCENES, shipped
from .browser import SECOND
from .explorer_page import SHOWN, chosen, opened, put, state, text

pytestmark = pytest.mark.slow
SLIDERS = ("theta", "phidot", "thetadot", "spin", "shape", "pull")
CANVAS = "document.querySelector('.player > canvas')"
KINDS = {  # of kicks and tilts: sliders are moved through all of these
    "loops": {"theta": "5.73", "phidot": "-15"},
    "waves": {"theta": "5.73", "phidot": "40"},
    "cusps": {"theta": "5.73", "phidot": "0"},
    "hanging": {"theta": "180"},
    "sleeping": {"theta": "0"},
}


@pytest.fixture
def phone(browser, html):
    """The page on the phone, without motion of its own."""
    screen = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    browser.ask("Emulation.setDeviceMetricsOverride", **screen)
    browser.ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    yield opened(browser, html, prefers_reduced_motion="reduce")
    browser.ask("Emulation.setTouchEmulationEnabled", enabled=False)


def middle(phone, what, across=0.5, down=0.5):
    """Where a part of an element is, once that is in the lower half of the screen."""
    return phone.value(
        f"(() => {{ const e = {what}; e.scrollIntoView({{ block: 'end' }});"
        "scrollBy(0, Math.min(60, document.documentElement.scrollHeight - innerHeight - scrollY));"
        f"const r = e.getBoundingClientRect(); return {{ x: r.x + {across} * r.width,"
        f"y: r.y + {down} * r.height }}; }})()"
    )


def swipe(phone, place, dx=0, dy=0):
    """Draw a finger over the screen."""
    for kind, part in (("touchStart", 0), *(("touchMove", k / 8) for k in range(1, 9))):
        point = {"x": place["x"] + part * dx, "y": place["y"] + part * dy, "id": 0}
        phone.ask("Input.dispatchTouchEvent", type=kind, touchPoints=[point])
        time.sleep(SECOND / 5)
    phone.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    time.sleep(SECOND)
    phone.until(SHOWN)


def test_a_swipe_up_or_down_scrolls_and_changes_nothing(phone):
    for name in (*SLIDERS, "plane"):
        what = f"document.getElementById('{name}{'' if name == 'plane' else '-slider'}')"
        before, place = state(phone), middle(phone, what, 0.8)
        scrolled = phone.value("scrollY")
        swipe(phone, place, dy=-200)
        assert phone.value("scrollY") > scrolled + 50, name
        swipe(phone, middle(phone, what, 0.2), dy=150)
        assert state(phone) == before, name
        for _ in range(3):  # a busy machine may lose a touch
            swipe(phone, middle(phone, what, 0.3), dx=120, dy=10)
            if state(phone) != before:
                break
        assert state(phone) != before, name


def test_the_body_is_tilted_by_a_drag_up_or_down(phone):
    before, scrolled = state(phone), phone.value("scrollY")
    phone.until("document.querySelector('.player').player.state().body")  # once it is drawn
    place = phone.value(
        f"(() => {{ const r = {CANVAS}.getBoundingClientRect();"
        "const { foot, head } = document.querySelector('.player').player.state().body;"
        "return { x: r.x + (foot[0] + head[0]) / 2, y: r.y + (foot[1] + head[1]) / 2 }; })()"
    )
    swipe(phone, place, dy=80)
    after = state(phone)
    assert after["theta"] > before["theta"] + 0.3
    assert {name for name in after if after[name] != before[name]} == {"theta"}
    assert phone.value("scrollY") == scrolled
    swipe(phone, {"x": 370, "y": place["y"]}, dy=-100)  # beside the body the page is scrolled
    assert state(phone) == after
    assert phone.value("scrollY") > scrolled + 50


HEIGHTS = """(async () => {
  const root = document.querySelector('.player'), seen = new Set(), words = new Set();
  const all = [...document.querySelectorAll('section, .player > *, .control, canvas')];
  const count = root.player.state().count;
  const frames = Array.from({ length: 12 }, (_, k) => (k * count) / 12);
  for (const frame of [...frames, ...Array(8).fill(null)]) {
    if (frame === null) root.querySelector('[data-do=event]').click();
    else root.player.to(frame);
    await new Promise(requestAnimationFrame);
    seen.add(all.map((e) => e.getBoundingClientRect().height).join());
    words.add(root.querySelector('output').textContent.length);
  }
  return [seen.size, words.size];
})()"""


def test_what_moves_while_it_plays_keeps_its_height(phone):
    for name in ("sicm-kicked", "sicm-dropped"):
        chosen(phone, name)
        heights, lengths = phone.value(HEIGHTS)
        assert heights == 1
        assert lengths > 2  # the words under the picture come and go


def test_no_slider_moves_away_under_a_finger(phone):
    places = set()
    for kind, typed in KINDS.items():
        middle(phone, "document.getElementById('phidot-slider')")
        for name, value in typed.items():  # as a slider moves them, without a box in focus
            phone.value(
                f"(() => {{ const e = document.getElementById('{name}-slider'); e.step = 'any';"
                f"e.value = {value}; e.dispatchEvent(new Event('input')); }})()"
            )
        assert text(phone, "kind").startswith(kind)
        places.add(
            phone.value(
                "[...document.querySelectorAll('[type=range]')].map((e) =>"
                "e.getBoundingClientRect().top + scrollY).join()"
            )
        )
    assert len(places) == 1


def test_what_a_finger_touches_is_44_px_high_and_what_is_typed_is_16_px(phone):
    small = phone.value(
        "[...document.querySelectorAll('button, select, a, [type=range], .boxes input,"
        " .choice label')]"
        ".filter((e) => { const { width, height } = e.getBoundingClientRect();"
        "return e.offsetParent && Math.min(width, height) < 44; }).map((e) => e.outerHTML)"
    )
    assert small == []
    boxes = phone.value(
        "[...document.querySelectorAll('input[type=text], #scene')].map((e) =>"
        "[e.dataset.of || e.id, parseFloat(getComputedStyle(e).fontSize), e.inputMode || 'text'])"
    )
    names = {*SLIDERS, "A", "mass", "distance", "scene"}
    assert sorted(name for name, *_ in boxes) == sorted(names)
    assert all(size >= 16 and mode == "text" for _, size, mode in boxes)  # decimal has no minus


def visible(phone, what):
    """Whether nothing covers the middle of an element."""
    return phone.value(
        f"(() => {{ const e = {what}, r = e.getBoundingClientRect();"
        "const at = document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2);"
        "return e.contains(at); })()"
    )


def test_the_top_is_in_view_while_a_slider_is_moved(phone):
    ends = f"(({{ top, bottom }}) => [top, bottom])({CANVAS}.getBoundingClientRect())"
    for name in SLIDERS:
        slider = f"document.getElementById('{name}-slider')"
        place = middle(phone, slider)
        top, bottom = phone.value(ends)
        assert 0 <= top < bottom - 200 < place["y"] - 200, name
        for what in (slider, CANVAS, "document.getElementById('kind')"):
            assert visible(phone, what), (name, what)


DRAWN = """(async () => {
  const paper = CanvasRenderingContext2D.prototype;
  const box = document.querySelector('.player > canvas');
  const { lineTo, beginPath, stroke, fillText } = paper, found = { path: [], words: [] };
  let line = [];
  paper.beginPath = function () { line = []; beginPath.call(this); };
  paper.lineTo = function (x, y) { line.push([x, y]); lineTo.call(this, x, y); };
  paper.stroke = function (...all) {
    if (this.canvas === box && this.strokeStyle === COLOUR) found.path.push(...line);
    stroke.apply(this, all);
  };
  paper.fillText = function (text, x, y) {
    const wide = this.measureText(text).width, left = x - (this.textAlign === 'right' ? wide : 0);
    if (this.canvas === box) found.words.push([left, y - 6], [left + wide, y + 6]);
    fillText.call(this, text, x, y);
  };
  const player = document.querySelector('.player').player;
  player.to(player.state().count - 1);
  await new Promise(requestAnimationFrame);
  await new Promise(requestAnimationFrame);
  Object.assign(paper, { lineTo, beginPath, stroke, fillText });
  const inside = ([x, y]) => x >= 0 && y >= 0 && x <= box.clientWidth && y <= box.clientHeight;
  const { path, words } = found;
  return [path.length, words.length, path.every(inside), words.every(inside)];
})()""".replace("COLOUR", repr(PATH.lower()))


def test_labels_and_path_are_inside_the_picture(phone):
    for name in ("sicm-kicked", "sleeping", "separatrix", "planar-pendulum"):
        chosen(phone, name)
        path, words, *inside = phone.value(DRAWN)
        assert path > 100, name
        assert words >= 2, name
        assert inside == [True, True], name


# --- what is typed ---------------------------------------------------------------------------


TYPED = [
    ("spin", "260 rpm", "spin", 260 * math.pi / 30),
    ("spin", "2*pi*25", "spin", 50 * math.pi),
    ("spin", "157,08", "spin", 157.08),
    ("spin", "−3^2 + sqrt(4)*(1 - 2/4)", "spin", -8.0),
    ("spin", "2*-3", "spin", -6.0),
    ("spin", "30 deg/s", "spin", math.pi / 6),
    ("theta", "0,5", "theta", math.radians(0.5)),
    ("theta", "0.5 rad", "theta", 0.5),
    ("theta", "180", "theta", math.pi),
    ("A", "3.28 g cm²", "A", 3.28e-7),
    ("mass", "75 g", "mass", 0.075),
]


def test_a_number_is_understood_as_people_write_it(phone):
    for name, typed, key, value in TYPED:
        put(phone, name, typed)
        assert state(phone)[key] == pytest.approx(value, rel=1e-15), typed
        assert text(phone, f"{name}-fault") == "", typed


def test_the_scene_has_the_numbers_as_they_were_typed(phone):
    for name, typed in {"spin": "260 rpm", "theta": "20,5", "phidot": "2*pi/3"}.items():
        put(phone, name, typed)
    toml = text(phone, "toml")
    for line in ('psidot = "260 rpm"', 'theta = "20.5 deg"', 'phidot = "2*pi/3"'):
        assert line in toml
    for name in ("theta", "phidot"):
        given = float(getattr(read_scene(toml).start, name))
        assert given == pytest.approx(state(phone)[name], rel=1e-15)


FAULTS = [
    ("theta", "200", "from 0 to 180 °"),
    ("theta", "4 rad", "from 0 to 3.14159 rad"),
    ("spin", "1e8 rpm", "from −9549300 to 9549300 rpm"),
    ("shape", "3", "from 0.000001 to 2"),
    ("A", "1e-12", "gMR/A is then to be from −1000000000 to 1000000000"),
    ("phidot", "seven", "a number, such as −12.5, 2*pi*25 or 260 rpm"),
]


def test_a_fault_stands_beside_its_box_in_the_unit_that_was_typed(phone):
    before = state(phone)
    for name, typed, says in FAULTS:
        box = f"document.querySelector('input[data-of={name}]')"
        phone.value(f"{box}.value = '{typed}'; {box}.dispatchEvent(new Event('input'))")
        assert text(phone, f"{name}-fault") == says
        assert state(phone) == before
        gap = phone.value(
            f"document.getElementById('{name}-fault').getBoundingClientRect().top"
            f"- {box}.getBoundingClientRect().bottom"
        )
        assert 0 <= gap < 60, name
        assert phone.value(f"{box}.getAttribute('aria-describedby')") == f"{name}-fault"
        phone.value(f"{box}.dispatchEvent(new Event('blur'))")
        assert text(phone, f"{name}-fault") == ""


def test_a_top_is_given_by_its_moment_mass_and_distance(phone):
    """A textbook's top: 0.5 kg, 0.05 m."""
    for name, typed in {"A": "12e-4", "shape": "0.375", "mass": "0.5", "distance": "5 cm"}.items():
        put(phone, name, typed)
    seen = state(phone)
    assert (seen["A"], seen["C"], seen["mass"]) == (12e-4, 4.5e-4, 0.5)
    assert seen["gMR"] == pytest.approx(0.5 * 9.81 * 0.05, rel=1e-15)
    energy = phone.value("heavytop.constants(explorer.shown().own).E_prime")
    scene = read_scene(text(phone, "toml"))
    exact = ht.Motion(scene.top, scene.start).constants.floats["E_prime"]
    assert energy == pytest.approx(exact, rel=1e-12)
    assert f"{energy:.6g}".rstrip("0") in text(phone, "facts")
    put(phone, "mass", "1")  # the distance was given: it stays
    assert state(phone)["gMR"] == pytest.approx(9.81 * 0.05, rel=1e-15)
    assert phone.value("document.querySelector('input[data-of=distance]').value") == "0.05"


def test_numbers_of_a_scene_in_doubles_are_spelled_as_they_were_given(browser, tmp_path):
    top, start = ht.Top(3.28e-4, 6.6e-5, 0.0456), ht.State(0.1, phidot=-15.25, psidot=140.3)
    opened(browser, explore(ht.Scene(top, start, time=1), tmp_path / "x.html"))
    toml = text(browser, "toml")
    for line in ("theta = 0.1", "phidot = -15.25", "psidot = 140.3", "gMR = 0.0456"):
        assert f"{line}\n" in toml
    assert not any(len(line) > 60 for line in toml.splitlines())


# --- what it says ----------------------------------------------------------------------------


def test_why_a_top_sleeps_is_said_in_numbers(phone):
    for spin, mark, detail in ((140, ">", "stable"), (100, "<", "unstable")):
        for name, typed in {"theta": "0", "phidot": "0", "spin": str(spin)}.items():
            put(phone, name, typed)
        scene = read_scene(text(phone, "toml"))
        least = ht.facts(scene.top, scene.start).sleeping_threshold
        assert text(phone, "kind") == f"sleeping, {detail}"
        has, _, needs = text(phone, "reason").partition(f" {mark} 4A gMR = ")
        assert has.startswith("pψ² = ")
        assert float(has[5:]) == pytest.approx((6.6e-5 * spin) ** 2, rel=1e-5)
        assert float(needs.split()[0]) == pytest.approx(4 * 3.28e-4 * 0.0456, rel=1e-5)
        assert f"ω₃ = {least:.6g} rad/s = {least * 30 / math.pi:.5g} rpm" in needs


def test_the_map_shows_where_a_top_begins_to_sleep(phone):
    assert "4A gMR" in text(phone, "plane-legend")
    lines = phone.value(
        "(() => { const paper = CanvasRenderingContext2D.prototype, { setLineDash } = paper;"
        "let n = 0; paper.setLineDash = function (dash) {"
        "if (this.canvas.id === 'plane' && dash.length) n += 1; setLineDash.call(this, dash); };"
        "document.getElementById('phidot-slider').dispatchEvent(new Event('input'));"
        "return new Promise((done) => setTimeout(() => {"
        "paper.setLineDash = setLineDash; done(n); }, 300)); })()"
    )
    assert lines >= 2


def test_a_round_stands_beside_the_textbooks_and_the_amplitude(phone):
    held = 0
    for name in SCENES:
        chosen(phone, name)
        facts = ht.facts(shipped(name))
        seen = phone.value(
            "Object.fromEntries([...document.querySelectorAll('#facts dt')].map((e) =>"
            "[e.textContent.slice(0, 22), e.nextSibling.textContent]))"
        )
        rounds, book = (seen[key] for key in ("One round", "One round, by the text"))
        if "round" in facts.estimates and rounds != "–":
            held += 1
            estimate = facts.estimates["round"]
            for each, seconds in ((rounds, estimate["exact"]), (book, estimate["estimate"])):
                assert float(each.partition(" ")[0]) == pytest.approx(abs(seconds), rel=1e-5), name
        if facts.nutation_amplitude and seen["Amplitude of nutation"] != "–":
            drop = float(seen["Amplitude of nutation"].split("end, ")[1].split()[0])
            assert drop == pytest.approx(facts.nutation_amplitude, rel=1e-4), name
    assert held > 8


def test_an_arrow_at_the_edge_of_the_map_says_where_the_point_is(phone, tmp_path):
    middle(phone, "document.getElementById('plane')")

    def dark():
        place = phone.value(
            "(({ x, y, width, height }) => [x, y, width, height])"
            "(document.getElementById('plane').getBoundingClientRect())"
        )
        picture = phone.picture(tmp_path / "page.png")
        x, y, width, height = map(int, place)
        edge = picture[y + 12 : y + height - 44, x + width - 26 : x + width - 12]
        return (edge.max(axis=2) < 0.2).sum()

    before = dark()
    put(phone, "phidot", "80")  # the map ends at 50
    time.sleep(3 * SECOND)
    assert dark() > before + 60


def test_the_body_has_the_shape_of_the_top(phone):
    for typed in ("0.05", "0.2", "1", "1.8"):
        put(phone, "shape", typed)
        profile = phone.value("document.querySelector('.player').player.state().profile")
        r = max(radius for radius, _ in profile)
        h = sum(height for radius, height in profile if radius == r) / 2
        assert 2 * r**2 / (r**2 + 4 * h**2) == pytest.approx(float(typed), rel=1e-6)
    put(phone, "pull", "-50")
    profile = phone.value("document.querySelector('.player').player.state().profile")
    assert min(height for _, height in profile) < 0


def test_its_symbols_are_explained(phone):
    words = phone.value("document.querySelector('.symbols').innerText")
    for sign in ("θ", "φ", "ψ", "A", "C", "gMR", "E′", "ω₃", "V"):
        assert f"{sign}\n" in words
