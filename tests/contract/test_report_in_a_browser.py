"""In a browser without a network a report draws, its top moves, and nothing complains."""

from __future__ import annotations

import base64
import csv
import io
import json
import math
import os
import re
import select
import shutil
import subprocess
import sys
import time
from unittest.mock import patch

import pytest

from heavytop.files import write_document
from heavytop.plots.figures import FIGURES
from heavytop.report.pages.load import load_results
from heavytop.report.pages.page import page_of, write_page
from heavytop.report.run_files import write_results
from heavytop.results.energy_momentum import diagram_of
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--mute-audio",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--remote-debugging-pipe", "--window-size=1280,1000",
)  # fmt: skip
FIRST, SECOND = 30.0, 0.1  # how long is waited for something, and between looks [s]
# The browser reads from descriptor 3 and writes to 4.
START = """
import os, sys
for end, name in ((3, sys.argv[1]), (4, sys.argv[2])):
    os.dup2(int(name), end)
os.execv(sys.argv[3], sys.argv[3:])
"""

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed")


class Browser:
    """A Chromium that is told what to do through a pipe."""

    def __init__(self, home):
        theirs_in, self.out = os.pipe()
        self.inward, theirs_out = os.pipe()
        ends = [str(end) for end in (theirs_in, theirs_out)]
        words = [sys.executable, "-c", START, *ends, CHROMIUM, *FLAGS, f"--user-data-dir={home}"]
        self.process = subprocess.Popen(
            [*words, "about:blank"], pass_fds=(theirs_in, theirs_out),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(theirs_in)
        os.close(theirs_out)
        self.number, self.session, self.rest, self.heard = 0, {}, b"", []
        pages = self.ask("Target.getTargets")["targetInfos"]
        page = next(each["targetId"] for each in pages if each["type"] == "page")
        session = self.ask("Target.attachToTarget", targetId=page, flatten=True)
        self.session = {"sessionId": session["sessionId"]}
        for name in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{name}.enable")
        off = {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0}
        self.ask("Network.emulateNetworkConditions", **off)

    def ask(self, method, **params):
        self.number += 1
        message = {"id": self.number, "method": method, "params": params, **self.session}
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            found = self._read()
            if found.get("id") == self.number:
                assert "error" not in found, found
                return found["result"]
            assert found.get("method") != "Page.javascriptDialogOpening", "a title was run"
            self.heard.append(found)

    def _read(self):
        while b"\0" not in self.rest:
            assert select.select([self.inward], [], [], FIRST)[0], "the browser says nothing"
            part = os.read(self.inward, 1 << 20)
            assert part, "the browser has gone"
            self.rest += part
        message, _, self.rest = self.rest.partition(b"\0")
        return json.loads(message)

    def value(self, expression):
        found = self.ask(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def until(self, expression):
        last = time.monotonic() + FIRST
        while not (found := self.value(expression)):
            assert time.monotonic() < last, f"never: {expression}"
            time.sleep(SECOND)
        return found

    def complaints(self):
        for each in self.heard:
            method, params = each.get("method"), each.get("params", {})
            if method == "Runtime.exceptionThrown":
                yield params["exceptionDetails"]["text"]
            elif method == "Runtime.consoleAPICalled" and params["type"] in ("error", "assert"):
                yield str(params["args"])
            elif method == "Log.entryAdded" and params["entry"]["level"] == "error":
                yield params["entry"]["text"]
            elif method == "Network.requestWillBeSent":
                address = params["request"]["url"]
                if not address.startswith(("file:", "data:", "blob:")):
                    yield f"asked for {address}"

    def close(self):
        self.process.terminate()
        self.process.wait(10)
        os.close(self.out)
        os.close(self.inward)


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    place = tmp_path_factory.mktemp("results")
    title = 'title="<img src=x onerror=alert(1)><b>kicked"'
    for name, options in (("sicm-kicked", [title]), ("sicm-dropped", [])):
        (place / name).mkdir()
        scene = load_scene(name, overrides=options)
        write_results(propagate(scene), place / name, figures=False)
    claim = {"id": "c", "statement": "<script>alert(1)</script>", "authority": "a", "bound": 1.0,
             "measured": 0.5, "passed": True, "skipped": None, "numbers": "ours",
             "failure": None}  # fmt: skip
    failing = claim | {"id": "that-fails", "authority": "another", "passed": False}
    write_document(
        place / "sicm-kicked" / "validate.json",
        {"schema": "heavytop/validate/1", "claims": [claim, failing]},
    )
    thread = diagram_of(load_scene("sleeping-unstable"))
    thread.save(place / "sicm-kicked" / "energy_momentum.json")
    one = {"overview": FIGURES["overview"]}  # that one picture is drawn shows that all are
    with patch.dict(FIGURES, one, clear=True):
        write_page(page_of(load_results([place])), place / "report.html")
    return place / "report.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory, html):
    found = Browser(tmp_path_factory.mktemp("profile"))
    found.ask("Page.navigate", url=html.as_uri())
    found.until("document.readyState === 'complete'")
    found.until("Boolean(document.querySelector('#player-plot canvas'))")
    yield found
    found.close()


@pytest.fixture(scope="module")
def document(html):
    return json.loads(html.with_suffix(".json").read_text("utf-8"))


PLOT = "document.getElementById('player-plot')"
FRAME = "Number(document.getElementById('player-frame').value)"
WORDS = "document.getElementById('player-words').textContent"
AXIS = "JSON.stringify(document.getElementById('player-plot').data[1])"


def axis(browser):
    """Where the tip of the axis is drawn."""
    line = json.loads(browser.value(AXIS))
    return [line[name][1] for name in "xyz"]


def click(browser, name):
    browser.value(f"document.getElementById('player-{name}').click()")


def test_the_top_moves_when_it_is_played_and_rests_when_it_is_not(browser):
    before = axis(browser)
    click(browser, "play")
    browser.until("Number(document.getElementById('player-frame').value) > 3")
    click(browser, "play")
    resting = browser.value("document.getElementById('player-frame').value")
    time.sleep(3 * SECOND)
    assert browser.value("document.getElementById('player-frame').value") == resting
    after = axis(browser)
    assert before != after
    assert sum(x * x for x in after) == pytest.approx(1.0, abs=1e-4)


def test_the_first_tilt_is_seen_from_the_side(browser):
    eye = browser.value(f"{PLOT}.layout.scene.camera.eye")
    x, y, _ = axis(browser)
    across = abs(eye["x"] * x + eye["y"] * y) / math.hypot(eye["x"], eye["y"]) / math.hypot(x, y)
    assert across < 0.5  # 0 where the tilt is all seen, 1 where it is towards the eye, or away
    assert 0 < eye["z"] < math.hypot(eye["x"], eye["y"])


def test_what_is_drawn_is_told_apart_by_colours(browser):
    lines = browser.value(
        f"{PLOT}.data.filter((e) => e.type === 'scatter3d')"
        ".map((e) => [e.name, (e.line && e.line.color) || e.marker.color])"
    )
    seen = {name: colour for name, colour in lines if name not in ("sphere", "vertical")}
    assert {"axis", "path of the axis so far", "angular momentum", "path to come"} <= set(seen)
    assert len(set(seen.values())) == len(seen)


def test_it_says_by_how_much_time_is_slowed(browser):
    """600 frames take 20 s, and the run is one of 2 s."""
    assert "Time is slowed 10 times." in browser.value(WORDS)


def test_the_pace_that_is_told_is_the_one_that_is_kept(browser):
    """Whatever this machine manages: the run is one of 2 s in 600 frames."""
    click(browser, "play")
    browser.until(f"{FRAME} > 2")
    begun = browser.value(f"[performance.now(), {FRAME}]")
    time.sleep(25 * SECOND)
    ended = browser.value(f"[performance.now(), {FRAME}, {WORDS}]")
    click(browser, "play")
    shown = (ended[1] - begun[1]) * 2 / 599
    told = float(re.search(r"Time is slowed (\d+) times", ended[2])[1])
    assert told == pytest.approx((ended[0] - begun[0]) / 1000 / shown, rel=0.4)


def test_it_steps_forward_and_back_to_the_same_place(browser):
    before = axis(browser)
    click(browser, "forward")
    assert axis(browser) != before
    click(browser, "back")
    browser.until(f"{AXIS}.includes({json.dumps(str(before[0]))})")
    assert axis(browser) == before


def test_the_keys_step_too(browser):
    frame = "Number(document.getElementById('player-frame').value)"
    at = browser.value(frame)
    browser.value("document.getElementById('player-plot').focus()")
    browser.ask("Input.dispatchKeyEvent", type="keyDown", key="ArrowRight")
    assert browser.value(frame) == at + 1


def test_space_plays_and_pauses(browser):
    pressed = "document.getElementById('player-play').getAttribute('aria-pressed')"
    for state in ("true", "false"):
        browser.value(f"{PLOT}.focus()")
        browser.ask("Input.dispatchKeyEvent", type="keyDown", key=" ", text=" ")
        browser.ask("Input.dispatchKeyEvent", type="keyUp", key=" ")
        assert browser.value(pressed) == state


def test_where_less_motion_is_asked_for_it_goes_by_stills(browser):
    calm = {"name": "prefers-reduced-motion", "value": "reduce"}
    browser.ask("Emulation.setEmulatedMedia", features=[calm])
    browser.value("document.getElementById('player-back').click()")
    at = browser.value(FRAME)
    click(browser, "play")
    browser.until(f"{FRAME} > {at}")
    assert browser.value(FRAME) >= at + 25  # 30 frames, less what is between two pictures
    click(browser, "play")
    browser.ask("Emulation.setEmulatedMedia", features=[])


CAMERA = f"Object.values({PLOT}._fullLayout.scene._scene.getCamera().eye)"
FAR = f"Math.hypot(...{CAMERA})"


@pytest.fixture
def phone(browser):
    """The screen of a phone, and fingers."""
    on = {"deviceScaleFactor": 1, "mobile": True}
    browser.ask("Emulation.setDeviceMetricsOverride", width=390, height=844, **on)
    browser.ask("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
    browser.until(f"{PLOT}.querySelector('canvas').getBoundingClientRect().width < 390")
    yield browser
    browser.ask("Emulation.setTouchEmulationEnabled", enabled=False)
    browser.ask("Emulation.clearDeviceMetricsOverride")


def middle(browser):
    """Where the player is on the screen."""
    browser.value(f"{PLOT}.scrollIntoView({{ block: 'center' }})")
    box = browser.value(f"JSON.parse(JSON.stringify({PLOT}.getBoundingClientRect()))")
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
    (x, y, _), far = phone.value(CAMERA), phone.value(FAR)
    moved = f"Math.hypot({CAMERA}[0] - {x}, {CAMERA}[1] - {y}) > 0.3"
    again(phone, lambda: drag(phone, *([20 * k] for k in range(6))), moved)
    assert phone.value(FAR) == pytest.approx(far)


def test_two_fingers_zoom_it(phone):
    nearer = f"{FAR} < {0.7 * phone.value(FAR)}"
    again(phone, lambda: drag(phone, *([-20 * k, 20 * k] for k in (2, 3, 4))), nearer)


def test_rolling_over_it_rolls_the_page_until_it_is_clicked_on(browser):
    browser.value("document.activeElement.blur()")
    x, y = middle(browser)
    place, far = {"x": x, "y": y}, browser.value(FAR)

    def roll():
        browser.ask("Input.dispatchMouseEvent", type="mouseWheel", deltaX=0, deltaY=30, **place)

    again(browser, roll, f"scrollY > {browser.value('scrollY')}")
    assert browser.value(FAR) == pytest.approx(far)
    place["x"], place["y"] = middle(browser)
    for kind in ("mousePressed", "mouseReleased"):
        browser.ask("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)
    again(browser, roll, f"Math.abs({FAR} - {far}) > 0.01")


def test_another_run_can_be_chosen_and_its_events_are_marked(browser):
    names = "document.getElementById('player-plot').data.map((each) => each.name).join()"
    assert "cusp" in browser.value(names)
    browser.value(
        "(() => { const c = document.getElementById('player-run'); c.selectedIndex = 1;"
        " c.dispatchEvent(new Event('change')); })()"
    )
    browser.until(f"{names}.includes('precession reverses')")
    assert "cusp" not in browser.value(names)
    click(browser, "event")
    browser.until("document.getElementById('player-words').textContent.includes('Event: ')")


def test_the_critical_set_can_be_turned(browser):
    browser.value("document.querySelector('button.turn').click()")
    browser.until("document.querySelectorAll('.plot canvas').length >= 2")
    names = "[...document.querySelectorAll('.plot')].at(-1).data.map((each) => each.name).join()"
    assert browser.value(names).endswith("sleeping,thread,hanging")


def test_titles_are_texts(browser):
    shown = browser.value("document.getElementById('player-run').options[1].textContent")
    options = browser.value(
        "[...document.getElementById('player-run').options].map((o) => o.textContent).join('|')"
    )
    assert shown
    assert "<img src=x onerror=alert(1)><b>kicked" in options
    assert browser.value("document.querySelectorAll('main b').length") == 0


def test_claims_that_fail_are_open_and_named_at_the_top(browser):
    parts = "[...document.querySelectorAll('details.part')].map((e) => [e.open, e.innerText])"
    assert {said.split("\n")[0]: shown for shown, said in browser.value(parts)} == {
        "a": False, "another": True,
    }  # fmt: skip
    assert "FAIL: that-fails" in browser.value("document.querySelector('header').innerText")


def test_every_button_that_saves_saves_the_numbers(browser, document, tmp_path):
    browser.ask("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    buttons = "document.querySelectorAll('button.save')"
    assert browser.value(f"{buttons}.length") == 2 * len(document["figures"])
    browser.value(f"{buttons}.forEach((each) => each.click())")
    for figure in document["figures"]:
        name = f"{figure['id']}-data"
        assert json.loads(saved(tmp_path / f"{name}.json")) == figure["data"]
        rows = list(csv.DictReader(io.StringIO(saved(tmp_path / f"{name}.csv"))))
        lists = next(of for end, of in LISTED.items() if figure["id"].endswith(end))(figure["data"])
        for head, values in lists.items():
            assert [float(row[head]) for row in rows] == values


LISTED = {
    "overview": lambda data: data,
    "energy-momentum": lambda data: {"p_phi": data["edge"]["p_phi"]},
    "critical-set": lambda data: {
        "p_psi_2": [line[1] for sheet in data["sheets"] for line in sheet["p_psi"]]
    },
}
"""By the end of a figure's name, columns that its CSV must have."""


def saved(path):
    last = time.monotonic() + FIRST
    while not path.is_file():
        assert time.monotonic() < last, f"never: {path.name}"
        time.sleep(SECOND)
    return path.read_text("utf-8")


CONTRAST = """(() => {
  const parsed = (text) => text.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((x) => x / 255)
    .map((x) => (x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4))
    .reduce((sum, x, k) => sum + x * [0.2126, 0.7152, 0.0722][k], 0);
  const ground = (each) => {
    const found = parsed(getComputedStyle(each).backgroundColor);
    return found.length < 4 || found[3] > 0 || !each.parentElement ? found
      : ground(each.parentElement);
  };
  const texts = [...document.querySelectorAll("h1, h2, p, a, li, th, td, dt, dd, summary, code, "
    + "figcaption, button, select, label")].filter((each) => !each.closest(".plot, :disabled"));
  return Math.min(...texts.map((each) => {
    const [one, two] = [parsed(getComputedStyle(each).color), ground(each)].map(light);
    return (Math.max(one, two) + 0.05) / (Math.min(one, two) + 0.05);
  }));
})()"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_texts_can_be_told_from_their_ground(browser, scheme):
    """By the contrast of the WCAG, level AA."""
    wanted = {"name": "prefers-color-scheme", "value": scheme}
    browser.ask("Emulation.setEmulatedMedia", features=[wanted])
    assert browser.value(CONTRAST) >= 4.5
    browser.ask("Emulation.setEmulatedMedia", features=[])


@pytest.mark.parametrize("width", [1280, 390, 360])
def test_it_fits_the_screen_and_is_painted(browser, width, tmp_path):
    browser.value("document.querySelectorAll('details').forEach((each) => { each.open = true; })")
    browser.ask(
        "Emulation.setDeviceMetricsOverride", width=width, height=844, deviceScaleFactor=1,
        mobile=width < 500,
    )  # fmt: skip
    browser.value("document.getElementById('player').scrollIntoView()")
    time.sleep(5 * SECOND)
    assert browser.value("document.documentElement.scrollWidth") <= width
    assert browser.value(
        "[...document.images].every((each) => each.complete && each.naturalWidth > 0)"
    )
    picture = base64.b64decode(browser.ask("Page.captureScreenshot", format="png")["data"])
    (tmp_path / "page.png").write_bytes(picture)
    assert colours(tmp_path / "page.png") > 200  # the body is lit: a blank canvas has a few


def colours(path):
    """How many colours a picture has."""
    from matplotlib.image import imread

    rows = imread(path)[..., :3]
    return len({tuple(each) for each in (255 * rows.reshape(-1, 3)).astype(int)[::7].tolist()})


def test_nothing_complained_and_nothing_was_asked_for(browser):
    """The last of them: all that was heard before is judged."""
    browser.value("1")
    assert list(browser.complaints()) == []
