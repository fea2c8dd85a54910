"""Cells of a notebook: facts and pictures without scripts, and the player."""

import re
import xml.etree.ElementTree as ET
from base64 import b64decode

import pytest

import heavytop as ht

from .conftest import BREAKING, HOSTILE
from .seen import Seen

SCENE = ht.load_scene("sicm-kicked", HOSTILE)
MOTION = ht.Motion(SCENE.top, SCENE.start)


def cell_of(thing):
    return Seen(thing._repr_html_())


@pytest.fixture(scope="module")
def trajectory():
    return ht.propagate(SCENE)


CELLS = {
    "top": (lambda run: SCENE.top, ["A", "3.28e-4 kg m²", "C/A"], False),
    "start": (lambda run: SCENE.start, ["θ", "0.1 rad", "φ̇", "-15 rad/s"], False),
    "scene": (lambda run: SCENE, [BREAKING, "time: 2"], True),
    "motion": (lambda run: MOTION, ["loops, proved", "0.542895518188 s"], True),
    "verdict": (lambda run: MOTION.verdict, ["loops, proved"], False),
    "plan": (lambda run: run.plan, ["axis, double, 6 states, tolerance 2.22e-16"], False),
    "trajectory": (lambda run: run, ["8 turning, 7 reversal, 0 cusp", "event"], True),
    "errors": (ht.run_errors, ["θ [rad]", "energy"], False),
    "check": (lambda run: ht.check({"t": run.t, "theta": run.theta}, SCENE), ["digits"], True),
    "atlas": (lambda run: ht.atlas(SCENE, "phidot=-9:9:9", "psidot=-9:9:9", jobs=1),
              ["loops", "boundaries"], True),
}  # fmt: skip


@pytest.mark.parametrize("name", CELLS)
def test_a_cell_shows_facts_and_a_picture_without_scripts(name, trajectory):
    make, words, pictured = CELLS[name]
    cell = cell_of(make(trajectory))
    assert [word for word in words if word not in cell.texts] == []
    assert not {"script", "iframe", "svg"} & {tag for tag, _ in cell.tags}
    pictures = [each["src"].partition("base64,")[2] for each in cell.all("img")]
    assert len(pictures) == pictured
    assert all(each["alt"].startswith("picture of a") for each in cell.all("img"))
    assert all(ET.fromstring(b64decode(each)).tag.endswith("svg") for each in pictures)


def test_numbers_are_shown_as_they_were_given_and_long_expressions_to_six_digits():
    cell = cell_of(ht.Top(A=ht.Exact.of(178327) / 3000000000, C="6.60e-5", gMR="sqrt(2)/31"))
    assert {"5.94423e-05 kg m²", "6.60e-5 kg m²", "sqrt(2)/31 J"} <= set(cell.texts)
    assert "pi/4 rad" in cell_of(ht.State(theta="pi/4", psidot=1)).texts


def test_a_player_is_a_small_page_in_a_frame_that_asks_no_network(trajectory):
    for player in (trajectory.play(), MOTION.play()):
        [(tag, attributes)] = cell_of(player).tags
        assert (tag, attributes["sandbox"]) == ("iframe", "allow-scripts")
        assert attributes["srcdoc"] == player.html
        assert len(player._repr_html_()) < 100_000
        assert not re.search(r"(src|href)=.?https?:", player.html)
