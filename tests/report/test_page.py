"""A page asks nothing of a network, says what its results say, and takes no text for markup."""

import json
import os
import re
import shlex
import shutil

import pytest

from heavytop.plots import style
from heavytop.report import page as pages
from heavytop.report.page import Page, page_of
from heavytop.scene.quantities import read_units, show_units
from heavytop.scene.scene import load_scene, read_scene

from ..commands import document, printed, refused
from .conftest import BREAKING, CLOSING, HOSTILE
from .seen import Seen


@pytest.fixture(scope="module")
def page(place):
    return page_of([place])


@pytest.fixture(scope="module")
def text(page, tmp_path_factory):
    html = tmp_path_factory.mktemp("page") / "report.html"
    pages.write_page(page, html)
    return html.read_text("utf-8")


@pytest.fixture(scope="module")
def seen(text):
    return Seen(text)


@pytest.mark.slow
def test_nothing_is_asked_of_a_network_and_no_text_is_taken_for_markup(page, text, seen):
    outside = {"link", "iframe", "object", "embed", "base", "svg"}
    for tag, attrs in seen.tags:
        assert tag not in outside
        assert not [name for name in attrs if name.startswith("on")]
        for name in ("src", "href", "srcset", "data", "action", "poster"):
            assert attrs.get(name, "#").startswith(("#", "data:image/svg+xml;base64,"))
    (style,) = re.findall(r"<style>(.*?)</style>", text, re.DOTALL)
    assert not re.search(r"url\(|@import", style)
    policy = next(m["content"] for m in seen.all("meta") if "http-equiv" in m)
    assert re.match("default-src 'none'.*script-src 'sha256-", policy)
    assert len(seen.all("img")) == sum(len(section.pictures) for section in page.sections)
    # of the sections their documents; the player's data; two scripts that run
    assert len(seen.all("script")) == len(page.sections) + 3
    said = "".join(seen.texts)
    assert BREAKING in said
    assert CLOSING in said
    assert "alert(4)" not in text  # a picture that lay in the folder


def test_every_result_is_read_as_it_was_written_and_has_its_figures(place, page, seen):
    idents = {f"{s.ident}-{p.name}" for s in page.sections for p in s.pictures}
    charts = [f"{name}-1-{name}" for name in ("drift", "workprec", "stress", "atlas")]
    assert {"run-1-overview", *charts} <= idents
    for section in page.sections:
        result, name = section.result, section.ident.partition("-")[0]
        document = json.loads(json.dumps(result.document(), allow_nan=False))
        stored = json.loads((place / name / f"{name}.json").read_text("utf-8"))
        assert json.loads(seen.scripts[f"{section.ident}-data"]) == document
        assert {key: document[key] for key in stored} == stored
        assert len(result.numbers().to_pandas()) == len(result.numbers().rows)
    saved = [attrs["data-of"] for attrs in seen.all("button") if "data-of" in attrs]
    assert saved == [f"{section.ident}-data" for section in page.sections]


def test_claims_that_fail_are_named_in_the_head_and_their_table_is_read_first(page):
    section = next(each for each in page.sections if each.ident == "validate-1")
    [table] = section.first_tables
    assert table.fails
    assert "that-fails does not hold" in Page((section,)).html().partition("</header>")[0]


def test_every_number_of_a_run_is_in_the_units_that_were_asked_for(place):
    with show_units(read_units("deg,rpm,ms")):
        seen = Seen(page_of([place / "run"]).html())
    shown = " ".join(seen.texts)
    assert not re.search(r"\brad\b|\d s\b|\[s\]", shown)
    assert {"[deg]", "[ms]", "[rpm]"} <= set(re.findall(r"\[\w+\]", shown))
    assert "moves theta from" in shown
    top = json.loads(seen.scripts["code-0"])
    assert [unit for unit, _ in top["units"].values()] == ["ms", "deg"]


def test_every_table_stands_once_and_that_of_the_events_with_the_details(page):
    for section in page.sections:
        tables = [*section.first_tables, *section.other_tables]
        assert sorted(map(id, tables)) == sorted(id(x) for x in section.tables if x.rows)
        html = Page((section,)).html()
        assert html.count("<table>") == len(tables)
        if section.ident == "run-1":
            assert html.index("<table>") > html.index("<details>")


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are made, and not drawn."""
    monkeypatch.setattr(style, "svg_address", lambda figure: "data:image/svg+xml;base64,")


def test_a_result_has_its_scene_and_the_command_that_made_it(tmp_path, page, undrawn):
    folder = tmp_path / "a $(touch x) <b>"
    words = ["run", "sicm-kicked", "--set", "start.phidot=-14", "--no-figures", "-o", str(folder)]
    printed(*words)
    command = json.loads((folder / "run.json").read_text())["command"]
    assert shlex.split(command) == ["heavytop", *words]
    typed = page_of([folder])
    assert (typed.sections[0].result.command, typed.command) == (command, None)
    assert command in Seen(typed.html()).texts
    assert not any(section.result.command for section in page.sections)  # what Python made
    assert read_scene(page.sections[0].scene_file) == load_scene("sicm-kicked", overrides=HOSTILE)


def put(place, name, folder, **changed):
    """A copy of a result, its document changed in some places."""
    shutil.copytree(place / name, folder)
    path = folder / f"{name}.json"
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | changed), "utf-8")
    return folder


NOTHING = {"workprec": {"points": [], "front": []}, "run": {"files": {}}}
NOTHING["stress"] = {"cases": [], "hard": {}, "methods": {}}


@pytest.mark.parametrize("name", NOTHING)
def test_a_result_with_nothing_in_it_has_a_section_that_says_so(place, name, tmp_path):
    page = page_of([put(place, name, tmp_path / "a", **NOTHING[name])])
    assert not page.sections[0].pictures
    assert ("No figures" in page.html()) == (name != "run")


# --- folders and files -------------------------------------------------------------------------


def test_results_of_one_heading_are_told_apart_everywhere(place, undrawn, tmp_path):
    for who in ("a", "b"):
        shutil.copytree(place / "run", tmp_path / who / "out")
    page = page_of([tmp_path / "a" / "out", tmp_path / "b" / "out"])
    names = [f"Run: {BREAKING} ({who}/out/run.json)" for who in "ab"]
    assert [section.heading for section in page.sections] == names
    player = json.loads(Seen(page.html()).scripts["code-0"])
    assert [top["title"] for top in player["runs"]] == names


@pytest.mark.parametrize("name", [b"caf\xe9", b"a\nb\x1b[31m"])
def test_a_folder_may_have_any_name(place, undrawn, name, tmp_path):
    folder = put(place, "stress", tmp_path / os.fsdecode(name))
    written = document("report", folder, "-o", folder / "page.html")
    assert (written["file"] + written["results"][0]).isprintable()


WRITTEN = {"x.HTML": "x.HTML", "a/b": "a/b/report.html", "": None}


@pytest.mark.parametrize(("word", "file"), WRITTEN.items())
def test_a_page_is_where_it_is_said(place, undrawn, word, file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused(0 if file else 2, "report", place / "validate", "-o", word)
    made = [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()]
    assert made == ([file] if file else [])
