"""The frames of a top are its motion; in a browser without a network it plays and can be turned."""

import base64
import json
from html import escape
from unittest.mock import patch

import numpy as np
import pytest

from heavytop.plots.drawn_run import DrawnRun
from heavytop.report.files import write_result
from heavytop.report.page import page_of, player_html, write_page
from heavytop.report.player import frames, tops
from heavytop.results.run import FIGURES, run_result

from ..processes import wait_for
from ..trajectories import run_of
from .conftest import BREAKING, HOSTILE


def columns(text, size):
    return np.frombuffer(base64.b64decode(text), "<f4").reshape(-1, size)


@pytest.mark.parametrize("name", ["sicm-kicked", "through-top"])
def test_the_body_and_the_events_that_are_played_are_the_runs(name):
    trajectory = run_of('want.quantities=["attitude"]', name=name)
    player = tops([frames(trajectory)])
    (played,) = player["runs"]
    found = columns(played["quaternion"], 4)
    seen = trajectory(np.linspace(0.0, played["end"], len(found)))
    assert found == pytest.approx(seen.quaternion, abs=1e-6)
    assert (played["notes"], played["spin"]) == ([], seen.psi[-1] - seen.psi[0])
    assert len(played["events"]) == len(trajectory.events.t)
    for event in played["events"]:
        assert event["axis"] == pytest.approx(trajectory(event["t"]).axis, abs=1e-5)
        assert event["kind"] in player["marks"]


@pytest.mark.parametrize("quantity", ["theta", "attitude"])
def test_momentum_keeps_what_is_conserved_whatever_a_run_follows(quantity):
    """L·z = p_φ and L·e = p_ψ, and e is where the quaternion takes the body's axis."""
    run = run_of(f'want.quantities=["{quantity}"]')
    played = frames(run)
    w, x, y, z = columns(played["quaternion"], 4).T
    axis = np.stack((2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)), axis=-1)
    momentum, constants = columns(played["momentum"], 3), run.motion.constants.floats
    assert np.linalg.norm(momentum, axis=1).max() == pytest.approx(1.0)
    for along, name in ((momentum[:, 2], "p_phi"), (np.sum(momentum * axis, axis=1), "p_psi")):
        assert along == pytest.approx(along[0], abs=1e-6)
        exact = constants[name] / constants["p_phi"] * momentum[0, 2]
        assert along[0] == pytest.approx(exact, abs=1e-6)
    assert (quantity == "theta") == ("closed form" in " ".join(played["notes"]))


def test_rounds_and_speed_and_a_push_are_those_of_the_clip():
    run = run_of()
    assert frames(run, rounds=1, speed=0.1)["seconds"] == pytest.approx(10 * run.motion.round)
    assert frames(run_of(name="sleeping-unstable"))["notes"][0].startswith("Without a push")


def test_a_run_in_many_digits_is_drawn_in_doubles():
    run = run_of("want.digits=25", "span.time=0.1")
    assert not run.in_doubles
    assert DrawnRun.of(run).path.t.dtype == float


# --- in a browser ------------------------------------------------------------------------------

PLAYER = "document.querySelector('.player').player"
LEGEND = "document.querySelector('.player .legend').innerText"


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    place = tmp_path_factory.mktemp("results")
    for k, (name, *options) in enumerate((("sicm-kicked", *HOSTILE), ("sicm-dropped",))):
        (place / str(k)).mkdir()
        write_result(run_result(run_of(*options, name=name)), place / str(k), figures=False)
    one = {"overview": FIGURES["overview"]}  # that one picture is drawn shows that all are
    with patch.dict(FIGURES, one, clear=True):
        return page_of([place])


@pytest.fixture(scope="module")
def reported(browser, page, tmp_path_factory):
    """The browser with the page of a report."""
    html = tmp_path_factory.mktemp("page") / "report.html"
    write_page(page, html)
    browser.ask("Page.navigate", url=html.as_uri())
    browser.until(f"document.readyState === 'complete' && Boolean({PLAYER})")
    return browser


CHOICE = "document.querySelector('.player select')"
CHOOSE = f"{CHOICE}.selectedIndex = 1; {CHOICE}.dispatchEvent(new Event('change'))"


def test_another_run_can_be_chosen_and_its_events_are_marked(reported):
    reported.value(f"{PLAYER}.to(0)")
    for choose, own, other in ((CHOOSE, "cusp", "rev"), (f"{PLAYER}.choose(0)", "rev", "cusp")):
        reported.value(choose)
        assert own in reported.value(LEGEND)
        assert other not in reported.value(LEGEND)
    reported.value("document.querySelector('[data-do=event]').click()")
    words = "document.querySelector('.player output').textContent"
    reported.until(f"{words}.includes('reversal of precession')")


def test_every_button_that_saves_saves_the_document_of_a_result(reported, page, tmp_path):
    reported.ask("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    buttons = "document.querySelectorAll('button[data-of]')"
    assert reported.value(f"{buttons}.length") == len(page.sections)
    reported.value(f"{buttons}.forEach((each) => each.click())")
    for section in page.sections:
        path = tmp_path / f"{section.ident}-data.json"
        wait_for(path.is_file)
        document = json.loads(json.dumps(section.result.document()))
        assert json.loads(path.read_text("utf-8")) == document


def test_the_player_alone_plays_in_a_frame_of_a_notebook(browser, tmp_path):
    alone = player_html(run_of(*HOSTILE, name="sicm-dropped"))
    assert len(alone) < 100_000
    page = tmp_path / "notebook.html"
    frame = f'<iframe srcdoc="{escape(alone)}" width="600" height="700"></iframe>'
    page.write_text(f"<style>:root {{ color-scheme: dark }}</style>{frame}", "utf-8")
    browser.ask("Page.navigate", url=page.as_uri())
    inside = "document.querySelector('iframe')?.contentDocument"
    browser.until(f"{inside}?.querySelector('.player')?.player?.state().at > 1")
    sizes = (f"{inside}.documentElement.scroll{x}" for x in ("Width", "Height"))
    width, height = map(browser.value, sizes)
    assert (width <= 600, height) == (True, 700)
    dark = "contentWindow.matchMedia('(prefers-color-scheme: dark)').matches"
    assert browser.value(f"document.querySelector('iframe').{dark}")
    data = f"{inside}.querySelector('script[type=\"application/json\"]').textContent"
    assert json.loads(browser.value(data))["runs"][0]["title"] == BREAKING
