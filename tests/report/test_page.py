"""A page asks nothing of a network, says what its results say, and takes no text for markup."""

from __future__ import annotations

import errno
import json
import os
import re
import shlex
import shutil
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from typer.testing import CliRunner

from heavytop.cli.command import app
from heavytop.errors import ForeignFile
from heavytop.files import write_document
from heavytop.report import page as pages
from heavytop.report import quick
from heavytop.report.files import write_results
from heavytop.report.page import LoadedResult, Page, Section, address, load_results, page_of
from heavytop.results.documents import FILES
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene, read_scene

from .conftest import BREAKING, CLOSING, HOSTILE, POINT, validate

NAMES = [name.removesuffix(".json") for name in FILES]


def report(*words):
    return CliRunner().invoke(app, ["report", *map(str, words)])


@pytest.fixture(scope="module")
def page(place):
    return page_of(load_results([place]))


@pytest.fixture(scope="module")
def written(page, tmp_path_factory):
    html = tmp_path_factory.mktemp("page") / "report.html"
    pages.write_page(page, html)
    return html


class Seen(HTMLParser):
    """What a browser would find on a page."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.tags, self.open, self.texts, self.scripts = [], [], [], {}
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self.open.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        while self.open and self.open.pop()[0] != tag:
            pass

    def handle_data(self, data):
        tag, attrs = self.open[-1] if self.open else ("", {})
        if tag == "script":
            self.scripts[attrs.get("id", f"code-{len(self.scripts)}")] = data
        elif tag != "style":
            self.texts.append(data)

    def all(self, tag):
        return [attrs for name, attrs in self.tags if name == tag]


@pytest.fixture(scope="module")
def seen(written):
    return Seen(written.read_text("utf-8"))


@pytest.mark.slow
def test_nothing_is_asked_of_a_network(written, seen):
    assert not [tag for tag, _ in seen.tags if tag in ("link", "iframe", "object", "embed", "base")]
    for _, attrs in seen.tags:
        for name in ("src", "href", "srcset", "data", "action", "poster"):
            assert attrs.get(name, "#").startswith(("#", "data:image/svg+xml,"))
    (style,) = re.findall(r"<style>(.*?)</style>", written.read_text("utf-8"), re.DOTALL)
    assert "url(" not in style
    assert "@import" not in style
    policy = [m["content"] for m in seen.all("meta") if "http-equiv" in m]
    assert policy[0].startswith("default-src 'none'")
    assert "script-src 'sha256-" in policy[0]


def test_no_text_is_taken_for_markup(page, seen, written):
    assert not [attrs for _, attrs in seen.tags for name in attrs if name.startswith("on")]
    assert not seen.all("svg")
    assert len(seen.all("img")) == sum(len(section.pictures) for section in page.sections)
    # of the sections their numbers; headings and the player's data; two scripts that run
    assert len(seen.all("script")) == len([each for each in page.sections if each.data]) + 4
    said = "".join(seen.texts)
    assert BREAKING in said
    assert CLOSING in said
    assert "alert(4)" not in written.read_text("utf-8")  # a picture that lay in the folder


def test_names_are_unique_and_links_lead_somewhere(seen):
    names = [attrs["id"] for _, attrs in seen.tags if "id" in attrs]
    assert len(names) == len(set(names))
    targets = {attrs["href"][1:] for attrs in seen.all("a")}
    assert targets
    assert targets <= set(names)


def test_it_can_be_read_without_eyes_and_on_a_phone(seen):
    assert all(len(attrs["alt"]) > 20 for attrs in seen.all("img"))
    assert seen.all("html")[0]["lang"] == "en"
    assert len(seen.all("h1")) == 1
    viewport = {"name": "viewport", "content": "width=device-width, initial-scale=1"}
    assert viewport in seen.all("meta")
    for tag in ("select", "input", "canvas"):
        assert all("aria-label" in attrs for attrs in seen.all(tag))


def test_every_figure_has_its_numbers_which_stand_on_the_page_once(page, seen, written):
    document = json.loads(written.with_suffix(".json").read_text("utf-8"))
    assert document["schema"] == "heavytop/report/1"
    idents = [f"{s.ident}-{p.name}" for s in page.sections for p in s.pictures]
    assert [fig["id"] for result in document["results"] for fig in result["figures"]] == idents
    assert {"run-1-overview", "drift-1-drift", "workprec-1-workprec", "stress-1-stress",
            "atlas-1-map", "traces-1-traces", "energy-momentum-1-energy-momentum",
            "energy-momentum-1-critical-set"} <= set(idents)  # fmt: skip
    for result in document["results"]:
        named = {name for figure in result["figures"] for name in figure["data"]}
        assert named == set(result["data"])
        if named:
            assert json.loads(seen.scripts[f"{result['id']}-data"]) == result["data"]
    shown = {(d["data-of"], *d["data-keys"].split()) for d in seen.all("details") if "data-of" in d}
    assert ("run-1-data", "motion") in shown
    assert len(shown) == len(idents) - 2  # three pictures of a run are of its motion


def test_shares_and_boundaries_of_an_atlas_are_those_of_its_map(page):
    section = next(each for each in page.sections if each.ident == "atlas-1")
    counts, curves = (section.result.document[name] for name in ("counts", "curves"))
    table, _ = section.parts
    shares = [float(share.removesuffix("%")) for _, _, share in table.rows]
    kinds = [kind for kind, _, _ in table.rows]
    whole = sum(counts.values())
    assert shares == pytest.approx([100 * counts[kind] / whole for kind in kinds], abs=0.006)
    assert (len(kinds), shares) == (len(counts), sorted(shares, reverse=True))
    (picture,) = section.pictures
    assert picture.title == "kinds of motion over φ̇ [rad/s] and θ [rad], and their boundaries"
    assert picture.data[0] == "curves"
    assert section.data["curves"] == curves != []


def test_claims_that_fail_are_counted_and_their_table_is_open(page, seen):
    [(section, words, failing)] = page.verdicts
    assert (section.ident, words, failing) == ("validate-1", "1 holds, 1 fails", ["that-fails"])
    _, holding, table, reasons, last = section.parts
    assert [each.rows[0][0] for each in (holding, table)] == ["ok", "FAIL"]
    assert (reasons.rows, last) == ((("that-fails", "out of its bound"),), "1 holds, 1 fails")
    assert len([attrs for attrs in seen.all("details") if "open" in attrs]) == 1


def test_a_scene_is_given_as_a_file(page):
    assert read_scene(page.sections[0].scene_file) == load_scene("sicm-kicked", overrides=HOSTILE)


def test_a_small_picture_is_the_same_picture():
    """Every text is there; marks and curves are off by less than a hundredth of a point."""
    svg = """<?xml version="1.0"?><!DOCTYPE svg><svg width="10pt"><!-- a comment -->
        <path d="M 123.456789 0.123456 L 2 3" style="fill: none; stroke: #0072b2"/>
        <use x="1.239" y="20.5" style="fill: none; stroke: #0072b2"/>
        <text style="font: 9px 'DejaVu Sans'">1.23456789 &lt;b> &amp; #</text></svg>"""
    html = address(svg)
    assert unquote(html.removeprefix("data:image/svg+xml,")) == (
        "<svg width=\"10pt\"> <path d='M 123.45 0.123456 L 2 3' class='c0'/> "
        "<use x='1.23' y='20.5' class='c0'/> "
        "<text style=\"font: 9px 'DejaVu Sans'\">1.23456789 &lt;b> &amp; #</text>"
        "<style>.c0{fill: none; stroke: #0072b2}</style></svg>"
    )
    assert not set(html) & set('"<>&#')


@pytest.mark.slow
def test_four_runs_and_all_traces_leave_the_studies_a_megabyte_of_three(tmp_path):
    for name in quick.BOOK:
        (tmp_path / name).mkdir()
        write_results(propagate(load_scene(name)), tmp_path / name, figures=False)
    (tmp_path / "traces").mkdir()
    write_document(tmp_path / "traces" / "traces.json", quick.traces_document())
    html = page_of(load_results([tmp_path])).html()
    assert html.count("<figure") == 21
    assert len(html.encode("utf-8")) < 2_000_000


def section(study, ident, **document):
    path = Path("folder") / f"{study}.json"
    document["schema"] = f"heavytop/{study}/1"
    return Section(LoadedResult(path, path.name, document, "0"), ident, ident)


def test_the_head_lists_results_by_scene_and_counts_claims():
    book, other = {"name": "book", "title": "The book's"}, {"name": "other", "title": ""}
    claims = [{"id": str(k), "passed": passed} for k, passed in enumerate((True, False, None))]
    page = Page((
        section("run", "run-1", scene=book, versions={"heyoka": "7", "cpu": None}),
        section("run", "run-2", scene=other), section("drift", "drift-1", scene=book),
        section("drift", "drift-2", scene=book, versions={"heyoka": "8", "cpu": "a processor"}),
        section("stress", "stress-1"), section("validate", "validate-1", claims=claims),
    ))  # fmt: skip
    assert page.title == "6 results"
    links = {title: [each.ident for each in some] for title, some in page.contents.items()}
    assert links == {
        "The book's": ["run-1", "drift-1", "drift-2"], "other": ["run-2"],
        "All tops": ["stress-1", "validate-1"],
    }  # fmt: skip
    assert [(each.ident, *rest) for each, *rest in page.verdicts] == [
        ("validate-1", "1 holds, 1 fails, 1 skipped", ["1"])
    ]
    assert page.machine == ["cpu a processor", "heyoka 7 and 8"]
    assert Page((section("run", "run-1", scene=book),)).title == "run-1"


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are made, and not drawn."""
    monkeypatch.setattr(pages, "_svg", lambda figure: "<svg/>")


def test_a_result_has_the_command_that_made_it_and_the_page_shows_it(tmp_path, page, undrawn):
    folder = tmp_path / "a $(touch x) <b>"
    words = ["run", "sicm-kicked", "--set", "start.phidot=-14", "--no-figures", "-o", str(folder)]
    assert CliRunner().invoke(app, words).exit_code == 0
    command = json.loads((folder / "run.json").read_text())["command"]
    assert shlex.split(command) == ["heavytop", *words]
    typed = page_of(load_results([folder]))
    assert (typed.sections[0].command, typed.command) == (command, None)
    assert command in Seen(typed.html()).texts
    assert {section.command for section in page.sections} == {""}  # what Python made has none


# --- results that are not what was written -----------------------------------------------------


def document(place, name):
    return json.loads((place / name / f"{name}.json").read_text("utf-8"))


def put(place, name, changed, folder):
    """A folder with a changed document, and what lay beside it."""
    folder.mkdir(parents=True)
    for file in (place / name).glob("*.nc"):
        shutil.copy(file, folder)
    text = changed if isinstance(changed, str) else json.dumps(changed)
    (folder / f"{name}.json").write_text(text, "utf-8")
    return folder


FORMULA, HIDDEN = "$x$ and $\\frac{$", "_gone"


WRONG = [
    "", "[" * 100_000, "\x00", '{"schema": "heavytop/run/1"}',
    '{"schema": "heavytop/validate/1", "claims": [{"id": 3}]}',
    json.dumps(validate()).replace("1e-09", "1e999"),
    json.dumps(validate()).replace("1e-09", "NaN"),
]  # fmt: skip


@pytest.mark.parametrize("text", WRONG, ids=range(len(WRONG)))
def test_a_damaged_document_is_refused_by_name(place, tmp_path, text):
    put(place, "validate", text, tmp_path / "a")
    done = report(tmp_path / "a", "-o", tmp_path / "page")
    assert done.exit_code == 3, done.output
    assert "validate.json" in done.stderr
    assert not (tmp_path / "page").exists()


@pytest.mark.parametrize(
    ("name", "change", "file"),
    [
        (
            "workprec",
            {"points": [POINT | {"us_per_period": 0}, POINT | {"rival": False}]},
            "workprec.json",
        ),
        ("stress", {"hard": {}}, "stress.json"),
        ("atlas", {"shape": [24, 24]}, "atlas.nc"),
        ("run", {"plan": None}, "run.json"),
        ("run", {"scene": {**load_scene("sicm-dropped").document()}}, "trajectory.nc"),
    ],
)
def test_a_result_that_is_not_what_was_written_is_refused(
    place, tmp_path, undrawn, name, change, file
):
    folder = put(place, name, document(place, name) | change, tmp_path / "a")
    with pytest.raises(ForeignFile, match=file.replace(".", r"\.")):
        page_of(load_results([folder]))


@pytest.mark.slow
@pytest.mark.parametrize("text", [FORMULA, HIDDEN])
def test_no_name_in_a_picture_breaks_it(place, text, tmp_path):
    scene = load_scene("sicm-kicked", overrides=[f"title={json.dumps(text)}"]).document()
    whole = {name: document(place, name) for name in NAMES}
    for name in ("drift", "workprec", "atlas", "energy_momentum"):
        whole[name]["scene"] = scene
    whole["drift"]["methods"][0] |= {"invariants": {text: [1e-9] * 4}}
    whole["workprec"]["points"][1]["stands_for"] = text
    whole["atlas"]["counts"] = {text: 384}
    whole["energy_momentum"]["start"]["kind"] = text
    whole["stress"] |= {"hard": {"cusp": text}, "methods": {"auto": text}}
    whole["traces"]["traces"][0] |= {"title": text, "kind": text, "tags": [text]}
    for name in set(NAMES) - {"run", "validate"}:
        put(place, name, whole[name], tmp_path / name)
    page = page_of(load_results([tmp_path]))
    assert sum(len(section.pictures) for section in page.sections) == 8


@pytest.mark.parametrize(
    ("name", "nothing"),
    [
        ("workprec", {"points": [], "front": [], "front_theta": [], "auto": []}),
        ("drift", {"methods": []}),
        ("stress", {"cases": [], "hard": {}, "methods": {}}),
        ("atlas", {"counts": {}, "curves": [], "uncertified": 0, "files": {}}),
        ("run", {"files": {}}),
    ],
)
def test_a_result_with_nothing_in_it_has_a_section_that_says_so(place, name, nothing, tmp_path):
    folder = put(place, name, document(place, name) | nothing, tmp_path / "a")
    (section,) = page_of(load_results([folder])).sections
    assert not section.pictures
    assert section.parts[0].startswith("No figures")


# --- folders and files -------------------------------------------------------------------------


def test_an_empty_folder_is_refused(tmp_path):
    done = report(tmp_path)
    assert done.exit_code == 3
    assert "holds no results" in done.stderr


def test_what_is_named_twice_is_shown_once(place, undrawn, tmp_path):
    done = report(place / "stress", f"{place}/stress/", "-o", tmp_path / "page")
    assert done.exit_code == 0, done.stderr
    assert done.stdout.endswith(": 1 result, 1 figure\n")


def test_results_of_one_heading_are_told_apart_everywhere(place, undrawn, tmp_path):
    for who, phidot in (("a", 3), ("b", 4)):
        scene = load_scene("sicm-kicked", overrides=[f"start.phidot={phidot}", 'title="one"'])
        (tmp_path / who / "out").mkdir(parents=True)
        write_results(propagate(scene), tmp_path / who / "out", figures=False)
    page = page_of(load_results([tmp_path / "a" / "out", tmp_path / "b" / "out"]))
    names = ["Run: one (a/out/run.json)", "Run: one (b/out/run.json)"]
    player = json.loads(Seen(page.html()).scripts["code-0"])
    assert [top["title"] for top in player["runs"]] == names
    assert [section.heading for section in page.sections] == names
    assert [*page.contents] == ["one"]
    assert page.machine[0].startswith("heavytop ")  # a run names no processor


@pytest.mark.parametrize(("here", "word"), [("x", "."), ("x", "../../out//"), ("", "x/../x/")])
def test_files_are_named_by_their_folders(place, here, word, tmp_path, monkeypatch):
    put(place, "validate", document(place, "validate"), tmp_path / "out" / "x")
    monkeypatch.chdir(tmp_path / "out" / here)
    page = page_of(load_results([Path(word)]))
    assert json.loads(page.json())["results"][0]["file"] == "x/validate.json"


@pytest.mark.parametrize("name", [b"caf\xe9", b"a\nb\x1b[31m", b"'\"<>&$(x)`;", "\u202ex".encode()])
def test_a_folder_may_have_any_name(place, undrawn, name, tmp_path):
    folder = put(place, "stress", document(place, "stress"), tmp_path / os.fsdecode(name))
    done = report(folder, "-o", folder / "page.html")
    assert done.exit_code == 0, done.output
    assert "\x1b" not in done.output
    told = json.loads((folder / "page.json").read_text("utf-8"))
    assert told["results"][0]["file"].isprintable()
    assert told["command"].isprintable()
    put(place, "drift", {"schema": "heavytop/drift/1"}, folder / "b")
    done = report(folder, "-o", tmp_path / "page")
    assert done.exit_code == 3
    assert done.stderr.count("\n") == 1
    assert "\x1b" not in done.stderr


@pytest.mark.parametrize(
    ("word", "file"),
    [("x.HTML", "x.HTML"), ("a/b", "a/b/report.html"), ("x.html/", "x.html"),
     (".html", ".html/report.html"), ("", None)],
)  # fmt: skip
def test_a_page_is_where_it_is_said(place, undrawn, word, file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = report(place / "validate", "-o", word)
    made = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    assert done.exit_code == (0 if file else 2), done.output
    assert made == (sorted([file, str(Path(file).with_suffix(".json"))]) if file else [])


@pytest.mark.parametrize("made", [os.mkfifo, lambda path: path.write_text("<h1>My notes</h1>")])
@pytest.mark.parametrize("name", ["report.html", "report.json"])
def test_a_report_replaces_nothing_but_a_report(place, undrawn, made, name, tmp_path):
    made(tmp_path / name)
    before = (tmp_path / name).stat().st_mtime_ns
    assert report(place / "validate", "-o", tmp_path).exit_code == 2
    assert (tmp_path / name).stat().st_mtime_ns == before
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(("number", "code"), [(errno.ENOSPC, 4), (errno.EACCES, 2)])
def test_where_the_document_cannot_be_written_the_page_is_not(
    place, undrawn, number, code, tmp_path, monkeypatch
):
    def full(path, text):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(pages, "write_text", full)
    done = report(place / "validate", "-o", tmp_path / "page")
    assert done.exit_code == code
    assert os.strerror(number) in " ".join(done.stderr.split())
    assert not (tmp_path / "page").exists()


def test_a_map_of_a_study_is_read_thinned(place):
    kind, names = pages.stored_map(place / "atlas" / "atlas.nc", [16, 24])
    whole = document(place, "atlas")["counts"]
    counts = {names[k]: int(n) for k, n in enumerate(np.bincount(kind.ravel())) if n}
    assert counts == {name: n for name, n in whole.items() if n}
