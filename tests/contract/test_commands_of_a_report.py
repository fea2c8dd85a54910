"""The commands on a page make what it shows: typed one after another, they give the same results,
each in a folder of its own; and no name in a result makes of one another command."""

from __future__ import annotations

import json
import re
import shlex

import pytest
from typer.testing import CliRunner

from heavytop.cli.command import app
from heavytop.errors import ForeignFile
from heavytop.files import write_document
from heavytop.report.pages import diagrams, failures, maps, runs, studies
from heavytop.report.pages.commands import exactly
from heavytop.report.pages.findings import findings
from heavytop.report.pages.ladders import methods_asked
from heavytop.report.pages.page import page_of
from heavytop.scene.scene import load_scene, shipped_scenes
from heavytop.studies.methods import stress_methods
from heavytop.studies.stress_cases import cases
from heavytop.studies.work_precision import DEFAULT, settings

MADE = {
    "a": "run sicm-kicked --formulation lagrange",
    "b": "run sicm-kicked --set want.samples=11 --digits 9",
    "c": "drift sicm-kicked --periods 12.345678 --methods strang=50.5 --samples 3 --seed 3",
    "d": "drift sicm-kicked --periods 6 --methods taylor-axis=1e-9,strang --samples 4",
    "e": "workprec sicm-kicked --periods 2.3456789 --budget 60.125 --methods "
    "taylor-axis=1e-7,taylor-axis=1.5e-9,auto=7,taylor-cubic-longdouble",
    "f": "stress --cases cusp --methods auto --time-limit 2.5 --step-limit 1234567 --budget 31.25",
    "g": "atlas sicm-kicked --x phidot=-30:40:6 --y theta=0.02:1.5:4:log --integrate",
    "h": "atlas sicm-kicked --x phidot=-30:40:6 --y theta=0.1:1.5:4 --only kind",
    "i": "atlas sleeping-unstable --energy-momentum",
}
"""Studies that have what a command could lose."""

LEFT_OUT = ("cost", "files", "versions")
NAMED = ("name", "title")  # of a scene: the file that a page gives has another name


def typed(*words):
    done = CliRunner().invoke(app, [*words, "--no-figures"])
    assert done.exit_code == 0, done.output


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    root = tmp_path_factory.mktemp("made")
    for name, words in MADE.items():
        typed(*words.split(), "-o", str(root / name))
    with pytest.MonkeyPatch.context() as patch:
        for module in (runs, studies, failures, maps, diagrams):
            patch.setattr(module, "drawn", lambda figure: b"<svg/>")
        return page_of(findings([root]))


def lasting(document):
    """What of a document a second run has again: no times."""
    kept = {key: value for key, value in document.items() if key not in LEFT_OUT}
    kept["scene"] = {k: v for k, v in kept.get("scene", {}).items() if k not in NAMED}
    if document["schema"] == "heavytop/workprec/1":
        return {name: kept[name] for name in ("scene", "periods", "budget")} | tried(document)
    if "methods" in kept and "periods" in kept:
        methods = kept["methods"]
        kept["methods"] = [row | {"us_per_period": None} for row in methods]
    return kept


def tried(document):
    """What was to be timed, in any order: a busy machine leaves out some of it."""
    names = ("tolerance", "steps_a_period", "digits")
    points = {(row["method"], *filter(None, map(row.get, names))) for row in document["points"]}
    skipped = {(row["method"], *row["setting"].values()) for row in document["skipped"]}
    wrong = [row for row in document["skipped"] if "no time" not in row["reason"]]
    return {"tried": sorted(points | skipped), "wrong": wrong}


def test_commands_typed_one_after_another_make_the_same_results(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for section in page.sections:
        if section.scene:
            (tmp_path / f"{section.ident}.toml").write_text(section.scene, "utf-8")
        typed(*shlex.split(section.command)[1:])
    again = {each.path.parent.name: each for each in findings([tmp_path / "out"]).results}
    assert again.keys() == {section.ident for section in page.sections}
    for finding, section in page.results:
        made, asked = (
            json.loads(each.path.read_text()) for each in (again[section.ident], finding)
        )
        assert lasting(made) == lasting(asked), section.command
        assert {each.command for each in section.pictures} <= {section.command}


def test_every_option_is_in_its_command(page):
    said = {section.ident: section.command for section in page.sections}
    assert "--formulation lagrange -o out/run-1" in said["run-1"]
    assert "--formulation" not in said["run-2"]
    assert "--periods 12.345678 --methods strang=50.5 " in said["drift-1"]
    options = ["taylor-axis=1e-07", "taylor-axis=1.5e-09", "taylor-cubic-longdouble", "auto=7"]
    (methods,) = re.findall(
        r"--methods (\S+) --periods 2.3456789 --budget 60.125 ", said["workprec-1"]
    )
    assert sorted(methods.split(",")) == sorted(options)
    assert "--time-limit 2.5 --step-limit 1234567 --budget 31.25 " in said["stress-1"]
    assert ["--integrate" in said[f"atlas-{k}"] for k in (1, 2)] == [True, False]


def test_what_was_not_asked_for_is_in_no_command():
    tried = [{"method": name, "setting": {"tolerance": 1e-3}} for name in DEFAULT]
    assert methods_asked({"points": [], "skipped": []}) == ()
    assert methods_asked({"points": [], "skipped": tried}) != ()
    scene = load_scene("sicm-kicked")
    usual = [{"method": each.asked, "setting": setting(each), "reason": ""}
             for name in DEFAULT for each in settings(name, scene, 100)]  # fmt: skip
    assert methods_asked({"points": [], "skipped": usual}) == ()
    assert methods_asked({"points": [], "skipped": usual[:6]}) == ("--methods", "auto")
    assert methods_asked({"points": [], "skipped": usual[:2]}) == ("--methods", "auto=6,auto=9")


def setting(method):
    return {"as": method.setting if method.digits is None else method.digits}


def test_numbers_are_said_with_all_their_digits():
    for x in (1234567.0, 0.1, 1e6, 3, 1e15 / 3):
        assert float(exactly(x)) == x
    assert exactly(1234567.0) == "1234567"


# --- names that mean something else --------------------------------------------------------


HOSTILE = ("--", "-o", "a,b", "--scheduler=x", "", "a b", "x\n", "$(x)", "é", "x" * 101)


def spoilt(document, name):
    """The document with a name in every place of which a command is made."""
    schema = document["schema"]
    if "run" in schema:
        yield document | {"plan": document["plan"] | {"formulation": name}}
    if "drift" in schema:
        yield document | {"methods": [document["methods"][0] | {"name": name}]}
    if "workprec" in schema:
        yield document | {"points": [document["points"][0] | {"method": name}]}
        yield document | {"skipped": [{"method": name, "reason": "", "setting": {}}]}
    if "stress" in schema:
        yield document | {"hard": {name: ""}}
        yield document | {"methods": {name: ""}}
        yield document | {"cases": [document["cases"][0] | {"method": name}]}
        yield document | {"skipped": [{"case": name, "method": "auto", "reason": ""}]}
    if "atlas" in schema:
        axes = document["axes"]
        yield document | {"axes": axes | {"x": axes["x"] | {"name": name}}}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_that_means_something_else_is_refused(page, name, tmp_path):
    count = 0
    for finding, _ in page.results:
        own = json.loads(finding.path.read_text("utf-8"))
        for changed in spoilt(own, name):
            write_document(tmp_path / finding.path.name, changed)
            with pytest.raises(ForeignFile, match="is no name of a method, case or scene"):
                findings([tmp_path])
            (tmp_path / finding.path.name).unlink()
            count += 1
    assert count == 12
    trace = {"name": name, "title": "", "kind": "", "tags": [], "seconds": 1, "axis": []}
    write_document(tmp_path / "traces.json", {"schema": "heavytop/traces/1", "traces": [trace]})
    with pytest.raises(ForeignFile, match="is no name"):
        findings([tmp_path])


def test_every_name_that_is_written_is_one(tmp_path):
    names = [
        *shipped_scenes(),
        *cases(),
        *stress_methods(),
        *DEFAULT,
        "strang=50.5",
        "taylor-axis=1e+06",
    ]
    rows = [{"name": name, "title": "", "kind": "", "tags": [], "seconds": 1, "axis": []}
            for name in names]  # fmt: skip
    for k in range(0, len(rows), 100):
        document = {"schema": "heavytop/traces/1", "traces": rows[k : k + 100]}
        write_document(tmp_path / "traces.json", document)
        assert len(findings([tmp_path]).results[0].document["traces"]) == len(rows[k : k + 100])
