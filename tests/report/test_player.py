"""The frames of a top are its motion; in a browser without a network it plays and can be turned."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import re
import time
from html import escape, unescape
from unittest.mock import patch

import numpy as np
import pytest

from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential
from heavytop.plots.figures import FIGURES, MOST_PERIODS
from heavytop.report.files import write_results
from heavytop.report.page import load_results, page_of, player_html, write_page
from heavytop.report.player import frames, run_data, tops
from heavytop.results.energy_momentum import diagram_of
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene

from .browser import CHROMIUM, FIRST, SECOND, Browser
from .conftest import BREAKING, HOSTILE


def columns(text, size):
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, size)


@pytest.mark.parametrize("name", ["sicm-kicked", "lie-group-benchmark", "through-top"])
def test_the_body_that_is_played_is_the_runs(name):
    trajectory = propagate(load_scene(name, overrides=['want.quantities=["attitude"]']))
    played = frames(trajectory)
    found = columns(played["quaternion"], 4)
    seen = trajectory(np.linspace(0.0, played["end"], len(found)))
    assert found == pytest.approx(seen.quaternion, abs=1e-6)
    assert played["notes"] == []
    assert played["spin"] == seen.psi[-1] - seen.psi[0]


@pytest.mark.parametrize("quantities", [["theta"], ["theta", "phi"], ["axis"], ["attitude"]])
def test_momentum_keeps_what_is_conserved_whatever_a_run_follows(quantities):
    """L·z = p_φ and L·e = p_ψ, and e is where the quaternion takes the body's axis."""
    scene = load_scene("sicm-kicked", overrides=[f"want.quantities={json.dumps(quantities)}"])
    played = frames(propagate(scene))
    w, x, y, z = columns(played["quaternion"], 4).T
    axis = np.stack((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)), axis=-1)
    momentum = columns(played["momentum"], 3)
    constants = Motion(scene.top, scene.start).constants.floats
    along = np.sum(momentum * axis, axis=1)
    assert momentum[:, 2] == pytest.approx(momentum[0, 2], abs=1e-6)
    assert along == pytest.approx(along[0], abs=1e-6)
    ratio = constants["p_phi"] / constants["p_psi"]
    assert momentum[0, 2] / along[0] == pytest.approx(ratio, abs=1e-6)
    assert np.linalg.norm(momentum, axis=1).max() == pytest.approx(1.0)
    followed = quantities == ["attitude"]
    assert followed == ("closed form" not in " ".join(played["notes"]))


def test_events_are_marked_where_they_are():
    trajectory = propagate(load_scene("sicm-kicked"))
    player = tops([frames(trajectory)])
    (played,) = player["runs"]
    assert len(played["events"]) == len(trajectory.events.t)
    for event in played["events"]:
        assert event["axis"] == pytest.approx(trajectory(event["t"]).axis, abs=1e-5)
    assert {event["kind"] for event in played["events"]} < set(player["marks"])


def test_a_long_run_is_played_for_so_long_as_its_spin_can_be_followed():
    played = frames(propagate(load_scene("sicm-kicked", overrides=["span.time=60"])))
    assert abs(played["spin"]) == pytest.approx(360, rel=0.02)
    assert played["notes"] == [f"The first {played['end']:.3g} s of 60 s are shown."]
    assert max(event["t"] for event in played["events"]) <= played["end"]


@pytest.mark.parametrize("name", ["at-rest", "sleeping", "sleeping-unstable", "hanging"])
def test_a_top_that_rests_is_shown_as_it_moves_when_it_is_touched(name):
    played = frames(propagate(load_scene(name)))
    axis = 1 - 2 * np.sum(columns(played["quaternion"], 4)[:, 1:3] ** 2, axis=1)
    assert abs(axis[0]) == pytest.approx(1.0)
    assert np.ptp(axis) > 1e-3
    assert played["notes"][0].startswith("Untouched it stays as it is")


@pytest.mark.parametrize("name", ["sicm-kicked", "sleeping", "lie-group-benchmark"])
def test_the_player_alone_is_a_small_page_that_asks_for_nothing(name):
    html = player_html(propagate(load_scene(name, overrides=HOSTILE)))
    assert len(html) < 100_000
    assert not re.findall(
        r"<[^>]*\s(src|href)=", re.sub("<script.*?</script>", "", html, flags=re.DOTALL)
    )
    assert html.count("<script") == html.count("</script>") == 2
    assert "default-src 'none'" in unescape(html)
    found = re.search(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    assert json.loads(found[1])["runs"][0]["title"] == BREAKING


@pytest.mark.parametrize("name", ["sicm-kicked", "simo-wong", "steady-betsch", "sleeping-unstable"])
def test_the_numbers_beside_pictures_are_those_of_the_run_and_of_the_motion(name):
    scene = load_scene(name)
    run, motion = propagate(scene), Motion(scene.top, scene.start)
    _, data = run_data(run)
    there = run(np.array(data["motion"]["t"]))
    for column in ("theta", "phi", "psi", "psidot"):
        assert data["motion"][column] == pytest.approx(getattr(there, column), rel=1e-11)
    beside = data["potential"]
    energies = float(scene.top.A) * Potential(motion.rising.source)(np.array(beside["theta"]))
    assert beside["potential"] == pytest.approx(energies, rel=1e-9)
    assert beside["E_prime"] == pytest.approx(float(motion.constants.E_prime), rel=1e-11)
    ends = [beside[name] for name in ("theta_min", "theta_max")]
    assert ends == pytest.approx([float(motion.theta_min), float(motion.theta_max)], abs=1e-11)
    inside = [ends[0] < tilt < ends[1] for tilt in beside["theta"]]
    assert sum(inside) > 50 or not motion.nutates


def test_a_long_run_without_events_is_shown_for_so_long_as_its_turns_are_seen():
    long = load_scene("sicm-kicked", overrides=["span.time=60", "want.events=[]"])
    period = Motion(long.top, long.start).period
    assert run_data(propagate(long))[1]["motion"]["t"][-1] == pytest.approx(MOST_PERIODS * period)


def test_a_run_in_many_digits_is_drawn_in_doubles():
    run = propagate(load_scene("sicm-kicked", overrides=["want.digits=25", "span.time=0.1"]))
    assert run.decimals is not None
    assert run_data(run)[0].decimals is None


# --- in a browser ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    place = tmp_path_factory.mktemp("results")
    title = 'title="<img src=x onerror=alert(1)><b>kicked"'
    runs = (("sicm-kicked", [title]), ("sicm-dropped", []), ("sleeping", []))
    for k, (name, options) in enumerate(runs):
        (place / f"{k}-{name}").mkdir()
        scene = load_scene(name, overrides=options)
        write_results(propagate(scene), place / f"{k}-{name}", figures=False)
    thread = diagram_of(load_scene("sleeping-unstable"))
    thread.save(place / "0-sicm-kicked" / "energy_momentum.json")
    one = {"overview": FIGURES["overview"]}  # that one picture is drawn shows that all are
    with patch.dict(FIGURES, one, clear=True):
        write_page(page_of(load_results([place])), place / "report.html")
    return place / "report.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory, html):
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed")
    found = Browser(tmp_path_factory.mktemp("profile"))
    found.ask("Page.navigate", url=html.as_uri())
    found.until("document.readyState === 'complete'")
    found.until(f"Boolean({PLAYER})")
    yield found
    found.close()


@pytest.fixture(scope="module")
def document(html):
    return json.loads(html.with_suffix(".json").read_text("utf-8"))


PLAYER = "document.querySelector('.player').player"
STATE = f"{PLAYER}.state()"
CANVAS = "document.querySelector('.player > canvas')"
WORDS = "document.querySelector('.player output').textContent"
LEGEND = "document.querySelector('.player .legend').innerText"
PRESSED = "document.querySelector('[data-do=play]').getAttribute('aria-pressed')"


def click(browser, name):
    browser.value(f"document.querySelector('[data-do={name}]').click()")


def key(browser, name):
    browser.value(f"{CANVAS}.focus()")
    text = {"text": name} if len(name) == 1 else {}
    browser.ask("Input.dispatchKeyEvent", type="keyDown", key=name, **text)
    browser.ask("Input.dispatchKeyEvent", type="keyUp", key=name)


def camera(browser):
    return browser.value(STATE)["camera"]


@pytest.fixture
def resting(browser):
    """The first run at its start, at rest, in the middle of a large screen, as it is first seen."""
    browser.media()
    browser.value(f"{CANVAS}.scrollIntoView({{ block: 'center' }})")
    browser.value(f"{PLAYER}.choose(0)")
    browser.value(f"{PLAYER}.to(0)")
    return browser


def opened(browser, html, **features):
    """The page as somebody with these preferences opens it; the browser is at its top."""
    browser.media(**features)
    browser.ask("Page.navigate", url=html.as_uri() + f"?{time.monotonic()}")
    browser.until("document.readyState === 'complete'")
    browser.until(f"Boolean({PLAYER})")


LOW = "document.querySelector('#player').style.marginTop = '3000px'"


def test_it_starts_when_it_is_scrolled_to_and_waits_while_it_is_out_of_sight(browser, html):
    opened(browser, html)
    browser.value(f"{PLAYER}.to(0)")  # whatever was on the screen at first
    opened(browser, html)
    browser.value(LOW)
    browser.value("scrollTo(0, 0)")
    browser.until(f"!{STATE}.playing")
    at = browser.value(STATE)["at"]
    time.sleep(5 * SECOND)
    assert browser.value(STATE)["at"] == at
    browser.value(f"{CANVAS}.scrollIntoView({{ block: 'center' }})")
    browser.until(f"{STATE}.playing && {STATE}.at > {at}")
    assert browser.value(PRESSED) == "true"
    browser.value("scrollTo(0, 0)")
    browser.until(f"!{STATE}.playing")


def test_where_less_motion_is_asked_for_it_starts_when_it_is_told_to(browser, html):
    opened(browser, html, prefers_reduced_motion="reduce")
    browser.value(f"{CANVAS}.scrollIntoView({{ block: 'center' }})")
    time.sleep(5 * SECOND)
    assert browser.value(STATE)["at"] == 0
    click(browser, "play")
    browser.until(f"{STATE}.at > 1")
    click(browser, "play")


def test_what_it_says_is_where_the_top_is(resting, document):
    motion = document["results"][0]["data"]["motion"]
    resting.until(f"{WORDS}.startsWith('t = 0.0000 s, θ = 5.73° = 0.1000 rad')")
    last = resting.value(f"{STATE}.count - 1")
    resting.value(f"{PLAYER}.to({last})")
    resting.until(f"{WORDS}.startsWith('t = 2.0000 s')")
    theta = motion["theta"][-1]
    assert f"θ = {math.degrees(theta):.2f}° = {theta:.4f} rad" in resting.value(WORDS)
    # the run is one of 2 s in which the spin is 236.6 rad, played at 9 rad a second
    assert "Time is slowed 13 times." in resting.value(
        "document.querySelector('.player').innerText"
    )


def test_above_side_and_reset_are_where_they_say(resting):
    first, (x, y, _) = camera(resting), resting.value(STATE)["axis"]
    turn = first["turn"]
    across = abs(math.cos(turn) * x + math.sin(turn) * y) / math.hypot(x, y)
    assert across < 0.5  # 0 where the tilt is all seen, 1 where it is towards the eye, or away
    click(resting, "above")
    assert camera(resting)["lift"] == pytest.approx(math.pi / 2)
    click(resting, "side")
    assert camera(resting) == first
    for name in ("+", "ArrowLeft", "ArrowUp"):
        key(resting, name)
    changed = camera(resting)
    assert changed["zoom"] > 1
    assert changed["turn"] > first["turn"]
    assert changed["lift"] > first["lift"]
    click(resting, "reset")
    assert camera(resting) == first


def test_everything_can_be_done_with_keys(resting):
    before = resting.value(STATE)["axis"]
    key(resting, " ")
    assert resting.value(PRESSED) == "true"
    resting.until(f"{STATE}.at > 20")
    key(resting, " ")
    after = resting.value(STATE)
    time.sleep(3 * SECOND)
    assert resting.value(STATE) == after
    assert before != after["axis"]
    key(resting, "Home")
    key(resting, ".")
    assert resting.value(STATE)["at"] == 1
    key(resting, ",")
    assert resting.value(STATE)["at"] == 0
    key(resting, "e")
    assert resting.value(STATE)["at"] > 0
    key(resting, "End")
    assert resting.value(f"{STATE}.at === {STATE}.count - 1")
    first = camera(resting)["zoom"]
    key(resting, "-")
    assert camera(resting)["zoom"] < first
    key(resting, "a")
    assert camera(resting)["lift"] == pytest.approx(math.pi / 2)


PAINTED = f"""(() => {{
  const pixels = {CANVAS}.getContext('2d').getImageData(0, 0, {CANVAS}.width, {CANVAS}.height).data;
  let [count, left, right, low, high] = [0, 1e9, -1, 1e9, -1];
  for (let k = 3; k < pixels.length; k += 4) {{
    if (!pixels[k]) continue;
    const at = (k - 3) / 4, x = at % {CANVAS}.width, y = Math.floor(at / {CANVAS}.width);
    count += 1;
    [left, right, low, high] = [Math.min(left, x), Math.max(right, x), Math.min(low, y),
      Math.max(high, y)];
  }}
  return [count / ({CANVAS}.width * {CANVAS}.height), (right - left) / {CANVAS}.width,
    (high - low) / {CANVAS}.height];
}})()"""


def test_no_frame_of_any_run_from_any_side_is_empty(resting):
    for k in range(3):
        resting.value(f"{PLAYER}.choose({k})")
        for view in ("above", "side"):
            click(resting, view)
            time.sleep(2 * SECOND)
            share, wide, high = resting.value(PAINTED)
            assert share > 0.03
            assert min(wide, high) > 0.5


@pytest.fixture
def phone(resting):
    """The screen of a phone, and fingers."""
    on = {"deviceScaleFactor": 1, "mobile": True}
    resting.ask("Emulation.setDeviceMetricsOverride", width=390, height=844, **on)
    resting.ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    resting.until(f"{CANVAS}.getBoundingClientRect().width < 390")
    yield resting
    resting.ask("Emulation.setTouchEmulationEnabled", enabled=False)
    resting.ask("Emulation.clearDeviceMetricsOverride")


def middle(browser, what=CANVAS):
    """Where something is on the screen."""
    browser.value(f"{what}.scrollIntoView({{ block: 'center' }})")
    box = browser.value(f"JSON.parse(JSON.stringify({what}.getBoundingClientRect()))")
    return box["left"] + box["width"] / 2, box["top"] + box["height"] / 2


def drag(browser, *steps):
    """Fingers put down, moved, and taken away: of each step, how far they are from the middle."""
    x, y = middle(browser)
    for k, fingers in enumerate(steps):
        points = [{"x": x + far, "y": y, "id": n} for n, far in enumerate(fingers)]
        kind = "touchMove" if k else "touchStart"
        browser.ask("Input.dispatchTouchEvent", type=kind, touchPoints=points)
    browser.ask("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])


def again(browser, act, expression):
    """Do it until something is so: a browser that is busy may not see it at once."""
    for _ in range(20):
        act()
        time.sleep(5 * SECOND)
        if browser.value(expression):
            return
    raise AssertionError(f"never: {expression}")


def test_a_finger_turns_it(phone):
    first = camera(phone)
    moved = f"Math.abs({STATE}.camera.turn - {first['turn']}) > 0.3"
    again(phone, lambda: drag(phone, *([20 * k] for k in range(6))), moved)
    assert camera(phone)["zoom"] == first["zoom"]


def rolling(browser, what):
    place = dict(zip("xy", middle(browser, what), strict=True))
    return place, lambda: browser.ask(
        "Input.dispatchMouseEvent", type="mouseWheel", deltaX=0, deltaY=-30, **place
    )


def press(browser, place, count=1):
    for kind in ("mousePressed", "mouseReleased"):
        browser.ask("Input.dispatchMouseEvent", type=kind, button="left", clickCount=count, **place)


def test_rolling_over_it_rolls_the_page_until_it_is_clicked_on(resting):
    resting.value("document.activeElement.blur()")
    place, roll = rolling(resting, CANVAS)
    again(resting, roll, f"scrollY < {resting.value('scrollY')}")
    assert camera(resting)["zoom"] == 1
    place, roll = rolling(resting, CANVAS)
    press(resting, place)
    again(resting, roll, f"{STATE}.camera.zoom > 1.01")


def test_a_chart_zooms_once_it_is_clicked_on_and_a_double_click_puts_it_back(browser):
    chart = "document.querySelector('.chart')"
    wide = f"{chart}.firstElementChild.getBoundingClientRect().width"
    first = browser.value(wide)
    place, roll = rolling(browser, chart)
    press(browser, place)
    again(browser, roll, f"{wide} > {1.05 * first}")
    assert browser.value("document.documentElement.scrollWidth <= innerWidth")
    place["x"], place["y"] = middle(browser, chart)
    press(browser, place)
    press(browser, place, 2)
    browser.until(f"Math.abs({wide} - {first}) < 1")


def test_another_run_can_be_chosen_and_its_events_are_marked(browser):
    browser.value(
        "(() => { const c = document.querySelector('.player select');"
        " c.selectedIndex = [...c.options].findIndex((o) => o.text.includes('cusps'));"
        " c.dispatchEvent(new Event('change')); })()"
    )
    assert "cusp" in browser.value(LEGEND)
    assert "reversal" not in browser.value(LEGEND)
    browser.value(f"{PLAYER}.choose(0)")
    assert "reversal of precession" in browser.value(LEGEND)
    assert "cusp" not in browser.value(LEGEND)
    click(browser, "event")
    browser.until(f"{WORDS}.includes('reversal of precession')")


def test_every_button_that_saves_saves_the_numbers(browser, document, tmp_path):
    browser.ask("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    buttons = "document.querySelectorAll('button[data-as]')"
    figures = [(each, result) for result in document["results"] for each in result["figures"]]
    assert browser.value(f"{buttons}.length") == 2 * len(figures)
    browser.value(f"{buttons}.forEach((each) => each.click())")
    for figure, result in figures:
        name = f"{figure['id']}-data"
        own = {key: result["data"][key] for key in figure["data"]}
        assert json.loads(saved(tmp_path / f"{name}.json")) == own
        rows = list(csv.DictReader(io.StringIO(saved(tmp_path / f"{name}.csv"))))
        lists = next(of for end, of in LISTED.items() if figure["id"].endswith(end))(own)
        for head, values in lists.items():
            assert [float(row[head]) for row in rows] == values


LISTED = {
    "overview": lambda data: data["motion"],
    "energy-momentum": lambda data: {"p_phi": data["edge"]["p_phi"]},
    "critical-set": lambda data: {
        "p_psi_2": [line[1] for sheet in data["critical_set.sheets"] for line in sheet["p_psi"]]
    },
}
"""By the end of a figure's name, columns that its CSV must have."""


def test_the_table_of_numbers_has_signs_and_units_and_says_what_it_leaves_out(browser):
    part = "document.querySelector('#run-1-overview details')"
    browser.value(f"{part}.open = true")
    browser.until(f"{part}.querySelector('table').rows.length > 0")
    heads = browser.value(f"[...{part}.querySelectorAll('th')].map((e) => e.textContent)")
    assert heads[:3] == ["t [s]", "θ [rad]", "φ [rad]"]
    rows = browser.value(f"{part}.querySelectorAll('tbody tr').length")
    assert browser.value(f"{part}.querySelector('caption').textContent") == (
        f"{401 - rows} more rows are in the files."
    )


def saved(path):
    last = time.monotonic() + FIRST
    while not path.is_file():
        assert time.monotonic() < last, f"never: {path.name}"
        time.sleep(SECOND)
    return path.read_text("utf-8")


@pytest.mark.parametrize("width", [1280, 390, 360])
def test_it_fits_the_screen_and_is_painted(browser, width, tmp_path):
    browser.value("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    browser.ask(
        "Emulation.setDeviceMetricsOverride", width=width, height=844, deviceScaleFactor=1,
        mobile=width < 500,
    )  # fmt: skip
    browser.value("document.getElementById('player').scrollIntoView()")
    browser.value("document.querySelectorAll('.chart').forEach((e) => { e.scrollLeft = 9999; })")
    time.sleep(5 * SECOND)
    assert browser.value("document.documentElement.scrollWidth") <= width
    assert browser.value(
        "[...document.images].every((each) => each.complete && each.naturalWidth > 0)"
    )
    colours = (255 * browser.picture(tmp_path / "page.png").reshape(-1, 3)).astype(int)[::7]
    assert len(np.unique(colours, axis=0)) > 200  # the body is lit: a blank canvas has a few


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_figures_and_the_player_are_on_the_ground_of_the_page(browser, scheme, tmp_path):
    """The mean lightness of what is on the screen when a figure fills it."""
    browser.ask("Emulation.clearDeviceMetricsOverride")
    browser.media(prefers_color_scheme=scheme)
    for what in ("document.querySelector('.chart img')", CANVAS):
        browser.value(f"{what}.scrollIntoView({{ block: 'center' }})")
        time.sleep(3 * SECOND)
        light = float(browser.picture(tmp_path / "page.png").mean())
        assert light < 0.3 if scheme == "dark" else light > 0.8
    browser.media()


def test_the_player_alone_plays_in_a_frame_of_a_notebook(browser, html, tmp_path):
    run = player_html(propagate(load_scene("sicm-dropped")))
    page = tmp_path / "notebook.html"
    page.write_text(f'<iframe srcdoc="{escape(run)}" width="600" height="700"></iframe>', "utf-8")
    browser.ask("Page.navigate", url=page.as_uri())
    inside = "document.querySelector('iframe')?.contentDocument"
    browser.until(f"{inside}?.querySelector('.player')?.player?.state().at > 1")
    assert browser.value(f"{inside}.documentElement.scrollWidth") <= 600
    opened(browser, html)


def test_nothing_complained_and_nothing_was_asked_for(browser):
    """The last of them: all that was heard before is judged."""
    browser.value("1")
    assert list(browser.complaints()) == []
