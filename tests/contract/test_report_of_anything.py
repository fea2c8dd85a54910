"""Whatever lies in a folder, a report is a page, or one clear refusal that names the file."""

from __future__ import annotations

import copy
import errno
import json
import os
import random
import shutil
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from heavytop.analytic.motion import Motion
from heavytop.checking.judge import check
from heavytop.cli.command import app
from heavytop.errors import ForeignFile
from heavytop.files import write_document
from heavytop.plots.studies import drift_figure, stress_figure, workprec_figure
from heavytop.plots.style import literal
from heavytop.report.pages import page as pages
from heavytop.report.pages import quick, sections
from heavytop.report.pages.page import load_results, page_of
from heavytop.report.run_files import write_results
from heavytop.report.study_files import (
    write_atlas,
    write_check,
    write_drift,
    write_energy_momentum,
)
from heavytop.results.documents import FILES
from heavytop.results.energy_momentum import diagram_of
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene
from heavytop.studies.atlas import atlas
from heavytop.studies.drift import drift

MARKUP = "<script>alert(1)</script>"
FORMULA, UNPAIRED, HIDDEN = "$x$ and $\\frac{$", "costs 5$", "_gone"
HOSTILE = (FORMULA, UNPAIRED, HIDDEN, "two\nlines", "", "\\", "\\$", "x" * 5000)
INSTEAD = (
    None, "nan", 10**299, -(10**299), 1e-299, 0, -1, [], [[]], {}, MARKUP, FORMULA, HIDDEN, "",
    True, 0.5, "-o", "🎩\n\t",
)  # fmt: skip
MUTANTS = 10  # of each document


def validate():
    claim = {"id": "a", "statement": "s", "authority": "Euler", "numbers": "formula", "bound": 1.0,
             "measured": 0.5, "passed": True, "skipped": None, "failure": None}  # fmt: skip
    return {"schema": "heavytop/validate/1", "proofs": False, "claims": [claim]}


LEADER = {"method": "strang", "tolerance": None, "steps_a_period": 200, "rival": True,
          "us_per_period": 9.0, "error": 1e-6, "point": 0}  # fmt: skip


def workprec(scene):
    point = {
        "method": "strang", "formulation": "axis", "language": "numba", "tolerance": None,
        "steps_a_period": 200, "bits": 53, "measures": "axis", "rival": True, "us_per_period": 9.0,
        "rhs_evaluations": None, "error": 1e-6, "theta_error": 1e-7, "energy_error": 1e-8,
        "setup_s": 0.1, "us_spread": 0.1, "error_spread": 0.0, "starts": 8, "runs": 2,
        "periods": 99.0, "steps": 9,
    }  # fmt: skip
    auto = point | {"method": "auto", "stands_for": "taylor-axis", "wants": "axis", "digits": 9,
                    "missed": False, "error": 1e-12, "rival": False}  # fmt: skip
    return {
        "schema": "heavytop/workprec/1", "scene": scene, "periods": 100, "phase": 99.6, "budget": 4,
        "points": [point, auto], "front": [0, 1], "front_theta": [0], "files": {},
        "skipped": [{"method": "gauss8", "reason": "no time", "setting": {"tolerance": 1e-9}}],
        "cheapest": {"1e-6": LEADER | {"against": LEADER, "ratio": 2.0}, "best": LEADER},
        "cheapest_theta": {"1e-6": None}, "rivals": {"run": ["strang"], "left_out": []},
        "auto": [{"point": 1, "digits": 9, "wants": "axis", "error": 1e-12, "missed": False,
                  "ahead": ["strang"]}],
    }  # fmt: skip


def stress():
    run = {"case": "cusp", "method": "auto", "formulation": "auto", "outcome": "ok",
           "error": 1e-15, "digits_lost": 0.5,
           "note": "", "untold": False, "turns": None}  # fmt: skip
    return {
        "schema": "heavytop/stress/1", "limits": {"time_s": 3.0}, "hard": {"cusp": "it stops"},
        "methods": {"auto": "auto"}, "skipped": [],
        "cases": [run], "files": {}, "rules": {"ok": "it held"},
        "auto": {"run": True, "silently_wrong": []},
    }  # fmt: skip


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A result of every kind, each in a folder named as its document."""
    root = tmp_path_factory.mktemp("results")
    folders = {name: root / name.removesuffix(".json") for name in FILES}
    for folder in folders.values():
        folder.mkdir()
    scene = load_scene("sicm-kicked")
    write_results(propagate(scene), folders["run.json"], figures=False)
    there = folders["drift.json"]
    write_drift(drift(scene, methods=["strang"], periods=10, samples=4, folder=there), there,
                figures=False)  # fmt: skip
    there = folders["atlas.json"]
    found = atlas(scene, "phidot=-30:40:12", "theta=0.1:1.5:8", jobs=1, folder=there)
    write_atlas(found, there, figures=False)
    upright = diagram_of(load_scene("sleeping-unstable"))
    write_energy_momentum(upright, folders["energy_momentum.json"], figures=False)
    t = np.linspace(0, 2, 50)
    theta = np.degrees(Motion(scene.top, scene.start).at(t).theta)
    write_check(check({"t": t, "theta": theta, "note": t}, scene), folders["check.json"],
                figures=False)  # fmt: skip
    made = {"validate": validate(), "workprec": workprec(scene.document()), "stress": stress()}
    known = quick.traces_document()
    made["traces"] = known | {"traces": known["traces"][:2]}
    for name, document in made.items():
        write_document(root / name / f"{name}.json", document)
    return root


@pytest.fixture
def undrawn(monkeypatch):
    """Figures are made, and not drawn."""
    monkeypatch.setattr(sections, "_svg", lambda draw, *arguments: draw(*arguments) and "<svg/>")


def document(place, name):
    return json.loads((place / name / f"{name}.json").read_text("utf-8"))


def put(place, name, changed, folder):
    """A folder with a changed document, and what lay beside it."""
    folder.mkdir(parents=True)
    for file in (place / name).glob("*.nc"):
        shutil.copy(file, folder)
    (folder / f"{name}.json").write_text(json.dumps(changed), "utf-8")
    return folder


def leaves(value, at=()):
    """The place of everything in a document; of lists, the first and the last."""
    if at:
        yield at
    if isinstance(value, dict):
        for key, each in value.items():
            yield from leaves(each, (*at, key))
    elif isinstance(value, list) and value:
        for k in sorted({0, len(value) - 1}):
            yield from leaves(value[k], (*at, k))


def with_instead(whole, at, value):
    changed = copy.deepcopy(whole)
    inner = changed
    for key in at[:-1]:
        inner = inner[key]
    inner[at[-1]] = value
    return changed


def page_or_refusal(folder):
    try:
        return page_of(load_results([folder])).html()
    except ForeignFile as refused:
        return str(refused)


def report(*words):
    return CliRunner().invoke(app, ["report", *map(str, words)])


NAMES = [name.removesuffix(".json") for name in FILES]


@pytest.mark.parametrize("name", NAMES)
def test_a_document_with_anything_in_it_is_a_page_or_is_refused_by_name(
    place, undrawn, name, tmp_path
):
    whole, draw = document(place, name), random.Random(8)
    places = list(leaves(whole))
    for k in range(MUTANTS):
        at, value = draw.choice(places), draw.choice(INSTEAD)
        folder = put(place, name, with_instead(whole, at, value), tmp_path / str(k))
        said = page_or_refusal(folder)
        assert MARKUP not in said, (at, value)
        assert "<!doctype html>" in said or (str(folder) in said and "\n" not in said), (at, value)


@pytest.mark.parametrize("name", NAMES)
def test_keys_that_nobody_reads_are_not_on_the_page(place, undrawn, name, tmp_path):
    whole = document(place, name)
    whole["planted"] = "planted"
    for key in ("scene", "motion", "plan", "events", "critical_set"):
        if isinstance(whole.get(key), dict) and name != "check":  # which has events by their names
            whole[key]["planted"] = ["planted"]
    for key in ("methods", "points", "cases", "curves", "claims", "traces", "cusps", "skipped"):
        for each in whole[key] if isinstance(whole.get(key), list) else ():
            each["planted"] = {"planted": "planted"}
    found = load_results([put(place, name, whole, tmp_path / "a")])
    page = page_of(found)
    assert "planted" not in page.html()
    assert "planted" not in page.json()


# --- texts in pictures ---------------------------------------------------------------------


@pytest.mark.parametrize("text", HOSTILE)
def test_a_text_is_drawn_as_it_is(text):
    from matplotlib.cbook import is_math_text
    from matplotlib.text import Text

    drawn, plain = Text(text=literal(text))._preprocess_math(literal(text))
    assert plain is False
    assert not is_math_text(literal(text))
    words = " ".join(text.split()) or "–"
    assert drawn.strip() == (words if len(words) <= 90 else words[:89] + "…")


def legend(figure):
    return [text.get_text().strip() for each in figure.legends for text in each.get_texts()]


def test_every_method_is_in_the_legend_whatever_its_name(place):
    known = document(place, "drift")
    known["methods"] = [known["methods"][0] | {"name": name} for name in HOSTILE[:4]]
    assert legend(drift_figure(known)) == [literal(name).strip() for name in HOSTILE[:4]]
    timed = document(place, "workprec")
    timed["points"] = [timed["points"][0] | {"method": name} for name in HOSTILE[:4]]
    assert legend(workprec_figure(timed))[1:] == [literal(name).strip() for name in HOSTILE[:4]]


@pytest.mark.parametrize("text", [FORMULA, HIDDEN])
def test_no_name_in_a_picture_breaks_it(place, text, tmp_path):
    title = f"title={json.dumps(text)}"
    scene = load_scene("sicm-kicked", overrides=[title]).document()
    for name in ("drift", "workprec", "atlas", "energy_momentum"):
        changed = document(place, name)
        changed["scene"] = scene
        if name == "drift":
            changed["methods"][0] |= {"language": text, "invariants": {text: [1e-9] * 4}}
        if name == "workprec":
            changed["points"][0]["language"] = changed["points"][1]["stands_for"] = text
        if name == "atlas":
            changed["counts"] = {text: 96}
        if name == "energy_momentum":
            changed["start"]["kind"] = text
        put(place, name, changed, tmp_path / name)
    hard = document(place, "stress")
    hard |= {"hard": {"cusp": text}, "methods": {"auto": text}}
    hard["cases"][0]["note"] = text
    put(place, "stress", hard, tmp_path / "stress")
    moving = document(place, "traces")
    moving["traces"][0] |= {"title": text, "kind": text, "tags": [text]}
    put(place, "traces", moving, tmp_path / "traces")
    page = page_of(load_results([tmp_path]))
    assert len([p for section in page.sections for p in section.pictures]) == 7
    assert len(stress_figure(hard).axes[0].get_yticklabels()) == 1


# --- nothing to show -----------------------------------------------------------------------


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
    assert section.parts[0].startswith(("Nothing was measured", "There is no whole map",
                                        "trajectory.nc is not"))  # fmt: skip


# --- folders -------------------------------------------------------------------------------


def test_all_faults_of_all_folders_are_told_at_once(place, tmp_path):
    put(place, "stress", {"schema": "heavytop/stress/1"}, tmp_path / "a")
    put(place, "drift", {"schema": "other"}, tmp_path / "a" / "b")
    (tmp_path / "empty").mkdir()
    done = report(tmp_path / "a", tmp_path / "empty", place, "-o", tmp_path / "page")
    assert done.exit_code == 3
    (empty, drifted, hard) = done.stderr.splitlines()
    assert "empty: holds no results" in empty
    assert hard.endswith("a/stress.json: limits: Field required")
    assert drifted.endswith("drift.json: schema: Input should be 'heavytop/drift/1'")
    assert not (tmp_path / "page").exists()


def test_what_is_named_twice_is_shown_once(place, undrawn, tmp_path):
    done = report(place / "stress", f"{place}/stress/", "-o", tmp_path / "page")
    assert done.exit_code == 0, done.stderr
    assert done.stdout.endswith(": 1 result, 1 figure\n")


def test_two_studies_of_a_kind_are_told_apart(place, undrawn, tmp_path):
    for who, time in (("a", 1.0), ("b", 2.0)):
        changed = document(place, "stress") | {"limits": {"time_s": time}}
        put(place, "stress", changed, tmp_path / who / "out")
    page = page_of(load_results([tmp_path / "a" / "out", tmp_path / "b" / "out"]))
    names = ["a/out/stress.json", "b/out/stress.json"]
    assert [section.heading for section in page.sections] == [
        f"Where methods fail ({name})" for name in names
    ]
    assert [each["file"] for each in page.document()["results"]] == names


@pytest.mark.parametrize(
    ("here", "word"),
    [("x", "."), ("x", "./"), ("x", ".."), ("x", "../../out//"), ("", "x"), ("", "x/../x/")],
)
def test_files_are_named_by_their_folders(place, here, word, tmp_path, monkeypatch):
    put(place, "validate", document(place, "validate"), tmp_path / "out" / "x")
    monkeypatch.chdir(tmp_path / "out" / here)
    page = page_of(load_results([Path(word)]))
    assert page.document()["results"][0]["file"] == "x/validate.json"


ODD = [b"caf\xe9", b"a\nb\x1b[31m", b"'\"<>&$(x)`;", "\u202ex".encode()]


@pytest.mark.parametrize("name", ODD)
def test_a_folder_may_have_any_name(place, undrawn, name, tmp_path):
    folder = tmp_path / os.fsdecode(name)
    put(place, "stress", document(place, "stress"), folder)
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


# --- files ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("word", "file"),
    [("x.html", "x.html"), ("x.HTML", "x.HTML"), ("a/b", "a/b/report.html"),
     ("dir/", "dir/report.html"), ("x.html/", "x.html/report.html"), ("x.htm", "x.htm/report.html"),
     (".html", None), ("a/.HTML", None), ("", None)],
)  # fmt: skip
def test_a_page_is_where_it_is_said(place, undrawn, word, file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = report(place / "validate", "-o", word)
    made = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file())
    if file is None:
        assert done.exit_code == 2
        assert made == []
        return
    assert done.exit_code == 0, done.output
    assert made == sorted([file, str(Path(file).with_suffix(".json"))])


def test_a_pipe_in_the_place_of_a_page_is_left_alone(place, tmp_path):
    os.mkfifo(tmp_path / "report.html")
    assert report(place / "validate", "-o", tmp_path).exit_code == 2
    assert report("", "-o", tmp_path / "b").exit_code == 2


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
