"""In a browser without a network a report draws, its top moves, and nothing complains."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import time
from unittest.mock import patch

import pytest

from heavytop.energy_momentum_document import energy_momentum_document
from heavytop.files import write_document
from heavytop.pages.findings import findings
from heavytop.pages.page import page_of, write_page
from heavytop.propagation import propagate
from heavytop.report.figures import FIGURES
from heavytop.results import write_results
from heavytop.scene import load_scene

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--mute-audio",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--remote-debugging-pipe", "--window-size=1280,1000",
)  # fmt: skip
FIRST, SECOND = 60.0, 0.1  # how long is waited for something, and between looks [s]
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
             "measured": 0.5, "passed": True, "skipped": None}  # fmt: skip
    write_document(
        place / "sicm-kicked" / "validate.json",
        {"schema": "heavytop/validate/1", "claims": [claim]},
    )
    thread = energy_momentum_document(load_scene("sleeping-unstable"))
    write_document(place / "sicm-kicked" / "energy_momentum.json", thread)
    one = {"overview": FIGURES["overview"]}  # that one picture is drawn shows that all are
    with patch.dict(FIGURES, one, clear=True):
        write_page(page_of(findings([place])), place / "report.html")
    return place / "report.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory, html):
    found = Browser(tmp_path_factory.mktemp("profile"))
    found.ask("Page.navigate", url=html.as_uri())
    found.until("document.readyState === 'complete'")
    found.until("Boolean(document.querySelector('#player-plot canvas'))")
    yield found
    found.close()


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


@pytest.mark.parametrize("width", [1280, 390, 360])
def test_it_fits_the_screen_and_is_painted(browser, width, tmp_path):
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
