"""Cells of a notebook: facts and pictures without scripts, and the player."""

import json
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from base64 import b64decode
from html.parser import HTMLParser

import pytest

import heavytop as ht

from .browser import CHROMIUM, Browser

SCENE = ht.load_scene("sicm-kicked")
MOTION = ht.Motion(SCENE.top, SCENE.start)


class Cell(HTMLParser):
    """The texts of a cell, its tags and their attributes."""

    def __init__(self, thing):
        super().__init__()
        self.texts, self.tags, self.attributes = [], [], {}
        self.feed(thing._repr_html_())

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes |= dict(attributes)

    def handle_data(self, data):
        self.texts.append(data)

    @property
    def picture(self):
        return ET.fromstring(b64decode(self.attributes["src"].partition("base64,")[2]))


@pytest.fixture(scope="module")
def trajectory():
    return ht.propagate(SCENE)


@pytest.mark.parametrize(
    ("name", "words", "pictured"),
    [
        ("top", ["A", "3.28e-4 kg m²", "C/A"], False),
        ("start", ["θ", "0.1 rad", "φ̇", "-15 rad/s"], False),
        ("scene", ["SICM 2.10, kicked backwards: loops", "loops, proved", "time: 2"], True),
        ("motion", ["loops, proved", "0.542895518188 s"], True),
        ("verdict", ["loops, proved"], False),
        ("plan", ["axis, double, 6 states, tolerance 2.22e-16"], False),
        ("trajectory", ["8 turning, 7 reversal, 0 cusp", "event"], True),
        ("errors", ["θ [rad]", "energy"], False),
        ("check", ["digits", "phase"], True),
        ("atlas", ["loops", "boundaries"], True),
    ],
)
def test_a_cell_shows_facts_and_a_picture_without_scripts(name, words, pictured, trajectory):
    data = {name: getattr(trajectory, name) for name in ("t", "theta", "phi", "psi")}
    cell = Cell(
        {
            "top": lambda: SCENE.top, "start": lambda: SCENE.start, "scene": lambda: SCENE,
            "motion": lambda: MOTION, "verdict": lambda: MOTION.verdict,
            "plan": lambda: ht.plan(SCENE), "trajectory": lambda: trajectory,
            "errors": lambda: ht.run_errors(trajectory), "check": lambda: ht.check(data, SCENE),
            "atlas": lambda: ht.atlas(SCENE, "phidot=-9:9:9", "psidot=-9:9:9", jobs=1),
        }[name]()
    )  # fmt: skip
    assert [word for word in words if word not in cell.texts] == []
    assert not {"script", "iframe", "svg"} & set(cell.tags)
    assert ("img" in cell.tags) == pictured
    if pictured:
        assert cell.picture.tag.endswith("svg")


@pytest.mark.slow
def test_a_study_shows_its_tables_and_its_chart():
    cell = Cell(ht.drift(SCENE, periods=2, methods=["strang=50"]))
    assert any(text.startswith("strang") for text in cell.texts)
    assert cell.picture.tag.endswith("svg")


def test_numbers_are_shown_as_they_were_given_and_long_expressions_to_six_digits():
    cell = Cell(ht.Top(A=ht.Exact.of(178327) / 3000000000, C="6.60e-5", gMR="sqrt(2)/31"))
    assert {"5.94423e-05 kg m²", "6.60e-5 kg m²", "sqrt(2)/31 J"} <= set(cell.texts)
    assert "pi/4 rad" in Cell(ht.State(theta="pi/4", psidot=1)).texts


def test_what_a_scene_says_is_no_markup():
    scene = ht.load_scene("sicm-kicked", ["title='<script>alert(1)</script>'"])
    assert "script" not in Cell(scene).tags
    assert "script" not in Cell(ht.propagate(scene).play()).tags


def test_a_player_is_a_small_page_in_a_frame_that_asks_no_network(trajectory):
    for player in (trajectory.play(), MOTION.play()):
        cell = Cell(player)
        assert cell.tags == ["iframe"]
        assert cell.attributes["sandbox"] == "allow-scripts"
        assert cell.attributes["srcdoc"] == player.html
        assert len(player._repr_html_()) < 100_000
        assert not re.search(r"(src|href)=.?https?:", player.html)
    assert repr(trajectory.play()) == "<Player of 'sicm-kicked'>"


# --- the page that nbconvert makes of a notebook -------------------------------------------------

BEGIN = """import heavytop as ht

scene = ht.load_scene("sicm-kicked")
motion = ht.Motion(scene.top, scene.start)
"""
CELLS = (BEGIN, "motion", "ht.propagate(scene)", "motion.verdict", "motion.play()")
SHOWN = "[...document.querySelectorAll('.jp-OutputArea-output')]"  # by nbconvert
STATE = "document.querySelector('.player').player.state()"


def converted(place, name, cells):
    """The page that ``jupyter nbconvert`` makes of a notebook of these cells, when it has run."""
    code = {"cell_type": "code", "execution_count": None, "metadata": {}, "outputs": []}
    kernel = {"kernelspec": {"display_name": "Python 3", "name": "python3"}}
    book = {
        "cells": [code | {"id": f"cell-{k}", "source": text} for k, text in enumerate(cells)],
        "metadata": kernel, "nbformat": 4, "nbformat_minor": 5,
    }  # fmt: skip
    path = place / f"{name}.ipynb"
    path.write_text(json.dumps(book), "utf-8")
    of_its_own = {"IPYTHONDIR": str(place), "JUPYTER_RUNTIME_DIR": str(place)}
    command = [sys.executable, "-m", "nbconvert", "--to", "html", "--execute", str(path)]
    run = subprocess.run(command, env=os.environ | of_its_own, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return path.with_suffix(".html")


def opened(browser, html):
    """Open a page, and forget what was heard before."""
    browser.heard.clear()
    browser.ask("Page.navigate", url=html.as_uri())
    browser.until("document.readyState === 'complete'")


def heard(browser):
    """What the page asked of the network, and what there is to complain of besides."""
    asked = (each for each in browser.heard if each.get("method") == "Network.requestWillBeSent")
    away = {url for each in asked if (url := each["params"]["request"]["url"]).startswith("http")}
    return away, [text for text in browser.complaints() if not any(url in text for url in away)]


@pytest.mark.slow
@pytest.mark.processes
def test_what_nbconvert_makes_of_a_notebook_shows_all_of_it_and_plays(tmp_path):
    """Its template asks the network for MathJax and require.js: nothing of ours needs these."""
    pytest.importorskip("nbconvert")
    if CHROMIUM is None:
        pytest.skip("no Chromium is installed")
    empty, html = (converted(tmp_path, name, cells) for name, cells in (("0", ()), ("1", CELLS)))
    browser = Browser(tmp_path / "profile")
    try:
        opened(browser, empty)
        template = heard(browser)
        opened(browser, html)
        rows = browser.value(f"{SHOWN}.map(each => each.querySelectorAll('table tr').length)")
        assert [count > 1 for count in rows] == [True, True, True, False]
        assert "loops, proved" in browser.value(f"{SHOWN}[0].innerText")
        widths = browser.value("[...document.images].map(each => each.naturalWidth)")
        assert [width > 200 for width in widths] == [True, True]
        assert browser.value(f"new Blob([{SHOWN}[3].outerHTML]).size") < 400_000
        browser.value("document.querySelector('iframe').scrollIntoView()")
        first = browser.picture(tmp_path / "first.png")
        with browser.inside("about:srcdoc"):
            assert browser.value("document.documentElement.scrollHeight <= innerHeight")
            begun = browser.value(STATE)
            browser.until(f"{STATE}.at > {begun['at'] + 20}")
            assert browser.value(STATE)["axis"] != begun["axis"]
        second = browser.picture(tmp_path / "second.png")
        assert (abs(first - second).max(axis=2) > 0.2).sum() > 500  # of the screen's points
        assert heard(browser) == template
        assert not template[1]
    finally:
        browser.close()
