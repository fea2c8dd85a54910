"""A report is one page that asks nothing of a network, says what its data say, and takes no
text in them for markup."""

from __future__ import annotations

import base64
import json
import re
import shlex
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from typer.testing import CliRunner

from heavytop.analytic.motion import Motion
from heavytop.cli.command import app
from heavytop.files import write_document
from heavytop.report.pages import quick as studies
from heavytop.report.pages.markup import address
from heavytop.report.pages.page import load_results, page_of, write_page
from heavytop.report.pages.player import frames, player_html, tops
from heavytop.report.parts import Table
from heavytop.report.run_files import write_results
from heavytop.report.study_files import write_atlas, write_drift, write_energy_momentum
from heavytop.results.energy_momentum import diagram_of
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene, read_scene, shipped_names
from heavytop.studies.atlas import atlas
from heavytop.studies.drift import drift

BREAKING = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> $\\frac{"
CLOSING = "</script></title></style><svg onload=alert(3)>&amp;<!--"
HOSTILE = [f"title={json.dumps(BREAKING)}", f"source={json.dumps(CLOSING)}"]
POINT = {
    "method": "dop853-scipy", "formulation": "axis", "language": BREAKING, "tolerance": 1e-16,
    "steps_a_period": None, "bits": 53, "measures": "axis", "rival": True, "us_per_period": 9.0,
    "rhs_evaluations": None, "error": 1e-12, "theta_error": 1e-12, "energy_error": 1e-14,
    "setup_s": 0.1, "us_spread": 0.1, "error_spread": 0.0, "starts": 8, "runs": 2, "periods": 99.0,
    "steps": 9,
}  # fmt: skip


def workprec(scene):
    return {
        "schema": "heavytop/workprec/1", "scene": scene, "periods": 100, "phase": 99.6, "budget": 4,
        "points": [POINT, {**POINT, "error": 1e-9, "us_per_period": 3.0}], "front": [1, 0],
        "front_theta": [0], "cheapest": {"1e-6": None}, "cheapest_theta": {"1e-6": None},
        "auto": [], "rivals": {"run": ["dop853-scipy"], "left_out": ["strang"]}, "files": {},
        "skipped": [{"method": "strang", "setting": {"steps": 9}, "reason": BREAKING}],
    }  # fmt: skip


def stress():
    run = {"case": "cusp", "method": "auto", "formulation": "auto", "outcome": "ok",
           "error": 1e-15, "digits_lost": 0.5,
           "note": BREAKING, "untold": False, "turns": None}  # fmt: skip
    return {
        "schema": "heavytop/stress/1", "limits": {"time_s": 3.0}, "hard": {"cusp": BREAKING},
        "methods": {"auto": CLOSING}, "cases": [run], "skipped": [],
        "rules": {}, "auto": {"run": True, "silently_wrong": []},
    }  # fmt: skip


def validate():
    claim = {"id": CLOSING, "statement": BREAKING, "authority": BREAKING, "numbers": "formula",
             "bound": 1e-9, "measured": 2e-13, "passed": True, "skipped": None,
             "failure": None}  # fmt: skip
    failing = claim | {"id": "other", "passed": False, "measured": 1.0}
    return {"schema": "heavytop/validate/1", "claims": [claim, failing]}


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Results of every kind, about a scene whose texts would break out of a page."""
    root = tmp_path_factory.mktemp("results")
    scene = load_scene("sicm-kicked", overrides=HOSTILE)
    folders = {name: root / name for name in
               ("run", "drift", "workprec", "stress", "atlas", "momenta", "claims")}  # fmt: skip
    for folder in folders.values():
        folder.mkdir()
    write_results(propagate(scene), folders["run"], figures=False)
    (folders["run"] / "overview.svg").write_text("<svg onload='alert(4)'/>")
    found = drift(scene, methods=["taylor-axis"], periods=10, samples=4, folder=folders["drift"])
    write_drift(found, folders["drift"], figures=False)
    found = atlas(scene, "phidot=-30:40:24", "theta=0.1:1.5:16", jobs=1, folder=folders["atlas"])
    write_atlas(found, folders["atlas"], figures=False)
    write_energy_momentum(diagram_of(scene), folders["momenta"], figures=False)
    write_document(folders["workprec"] / "workprec.json", workprec(scene.document()))
    write_document(folders["stress"] / "stress.json", stress())
    write_document(folders["claims"] / "validate.json", validate())
    return root


@pytest.fixture(scope="module")
def page(place):
    return page_of(load_results([place]))


@pytest.fixture(scope="module")
def written(page, tmp_path_factory):
    html = tmp_path_factory.mktemp("page") / "report.html"
    write_page(page, html)
    return html


class Seen(HTMLParser):
    """What a browser would find on a page."""

    def __init__(self, text):
        super().__init__(convert_charrefs=True)
        self.tags, self.open, self.texts, self.scripts = [], [], [], {}
        self.commands = []
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
        if "pre" in [name for name, _ in self.open]:
            self.commands.append(data)

    def all(self, tag):
        return [attrs for name, attrs in self.tags if name == tag]


@pytest.fixture(scope="module")
def seen(written):
    return Seen(written.read_text("utf-8"))


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


def test_no_text_is_taken_for_markup(page, seen):
    assert not [attrs for _, attrs in seen.tags for name in attrs if name.startswith("on")]
    assert not seen.all("svg")
    pictures = [p for section in page.sections for p in section.pictures]
    assert len(seen.all("img")) == len(pictures)
    with_data = [section for section in page.sections if section.data]
    # of the sections their numbers; headings and the player's data; two scripts that run
    assert len(seen.all("script")) == len(with_data) + 4
    said = "".join(seen.texts)
    assert BREAKING in said
    assert CLOSING in said


def test_a_script_in_the_folder_is_not_on_the_page(written):
    assert "alert(4)" not in written.read_text("utf-8")


def test_names_are_unique_and_links_lead_somewhere(seen):
    names = [attrs["id"] for _, attrs in seen.tags if "id" in attrs]
    assert len(names) == len(set(names))
    targets = [attrs["href"][1:] for attrs in seen.all("a")]
    assert targets
    assert set(targets) <= set(names)


def test_it_can_be_read_without_eyes_and_on_a_phone(seen):
    assert all(len(attrs["alt"]) > 20 for attrs in seen.all("img"))
    assert seen.all("html")[0]["lang"] == "en"
    assert len(seen.all("h1")) == 1
    assert {"name": "viewport", "content": "width=device-width, initial-scale=1"} in seen.all(
        "meta"
    )
    for tag in ("select", "input", "canvas"):
        assert all("aria-label" in attrs for attrs in seen.all(tag))


def test_every_figure_has_its_numbers_which_stand_on_the_page_once(page, seen, written):
    document = json.loads(written.with_suffix(".json").read_text("utf-8"))
    assert document["schema"] == "heavytop/report/1"
    idents = [f"{s.ident}-{p.name}" for s in page.sections for p in s.pictures]
    figures = [figure["id"] for result in document["results"] for figure in result["figures"]]
    assert figures == idents
    assert {"run-1-overview", "drift-1-drift", "workprec-1-workprec", "stress-1-stress",
            "atlas-1-map", "energy-momentum-1-energy-momentum",
            "energy-momentum-1-critical-set"} <= set(idents)  # fmt: skip
    for result in document["results"]:
        named = {name for figure in result["figures"] for name in figure["data"]}
        assert named == set(result["data"])
        if named:
            assert json.loads(seen.scripts[f"{result['id']}-data"]) == result["data"]
    shown = {(d["data-of"], *d["data-keys"].split()) for d in seen.all("details") if "data-of" in d}
    assert ("run-1-data", "motion") in shown
    assert len(shown) == len(idents) - 2  # three pictures of a run are of its motion


def test_numbers_behind_a_picture_are_the_trajectorys(page):
    columns = page.sections[0].data["motion"]
    trajectory = propagate(load_scene("sicm-kicked"))
    there = trajectory(np.array(columns["t"]))
    for name in ("theta", "phi", "psi", "psidot"):
        assert columns[name] == pytest.approx(getattr(there, name), rel=1e-11)


def test_shares_and_boundaries_of_an_atlas_are_those_of_its_map(page):
    section = next(each for each in page.sections if each.ident == "atlas-1")
    counts, curves = (section.result.document[name] for name in ("counts", "curves"))
    table, _ = section.shown
    shares = [float(share.removesuffix("%")) for _, _, share in table.rows]
    kinds = [kind for kind, _, _ in table.rows]
    whole = sum(counts.values())
    assert shares == pytest.approx([100 * counts[kind] / whole for kind in kinds], abs=0.006)
    assert (len(kinds), shares) == (len(counts), sorted(shares, reverse=True))
    (picture,) = section.pictures
    assert picture.title == "kinds of motion over φ̇ [rad/s] and θ [rad], and their boundaries"
    assert picture.data[0] == "curves"
    assert section.data["curves"] == curves != []


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


def test_four_runs_and_all_traces_leave_the_studies_a_megabyte_of_three(tmp_path):
    for name in studies.BOOK:
        (tmp_path / name).mkdir()
        write_results(propagate(load_scene(name)), tmp_path / name, figures=False)
    (tmp_path / "traces").mkdir()
    write_document(tmp_path / "traces" / "traces.json", studies.traces_document())
    html = page_of(load_results([tmp_path])).html()
    assert html.count("<figure") == 21
    assert len(html.encode("utf-8")) < 2_000_000


def test_runs_of_one_title_are_told_apart_everywhere(place, tmp_path):
    for number in (3, 4):
        scene = load_scene("sicm-kicked", overrides=[f"start.phidot={number}", 'title="one"'])
        (tmp_path / f"at-{number}").mkdir()
        write_results(propagate(scene), tmp_path / f"at-{number}", figures=False)
    page = page_of(load_results([tmp_path]))
    names = ["Run: one (at-3/run.json)", "Run: one (at-4/run.json)"]
    player = json.loads(Seen(page.html()).scripts["code-0"])
    assert [top["title"] for top in player["runs"]] == names
    assert [section.heading for section in page.sections] == names
    assert [*page.contents] == ["one"]
    assert page.machine[0].startswith("heavytop ")  # a run names no processor


def test_claims_that_fail_are_counted_and_their_table_is_open(page, seen):
    [(section, words, failing)] = page.verdicts
    assert (section.ident, words, failing) == ("claims-1", "1 holds, 1 fails", ["other"])
    _, table, reasons, last = section.shown
    assert [row[0] for row in table.rows] == ["ok", "FAIL"]
    assert (reasons.rows, last) == ((("other", "out of its bound"),), "1 holds, 1 fails")
    assert [attrs for attrs in seen.all("details") if "open" in attrs]


def test_a_scene_is_given_as_a_file(page):
    assert read_scene(page.sections[0].scene_file) == load_scene("sicm-kicked", overrides=HOSTILE)


# --- the command -----------------------------------------------------------------------------


TYPED = {
    "run.json": "run sicm-kicked --set start.phidot=-14 --no-figures",
    "drift.json": "drift sicm-kicked --periods 5 --methods strang --samples 3 --no-figures",
    "atlas.json": "atlas sicm-kicked --x phidot=-30:40:6 --y theta=0.1:1.5:4 --no-figures",
    "energy_momentum.json": "atlas sicm-kicked --energy-momentum --no-figures",
    "stress.json": "stress --cases cusp --methods auto --no-figures",
}


@pytest.mark.parametrize("name", TYPED)
def test_a_result_has_the_command_that_made_it_and_the_page_shows_it(name, tmp_path):
    folder = tmp_path / "a $(touch x) <b>"
    words = [*shlex.split(TYPED[name]), "-o", str(folder)]
    assert CliRunner().invoke(app, words).exit_code == 0
    command = json.loads((folder / name).read_text())["command"]
    assert shlex.split(command) == ["heavytop", *words]
    page = page_of(load_results([folder]))
    assert (page.sections[0].command, page.command) == (command, None)
    assert command in Seen(page.html()).commands
    again = [*shlex.split(command)[1:-1], str(tmp_path / "again")]
    assert CliRunner().invoke(app, again).exit_code == 0
    first, second = (json.loads((f / name).read_text()) for f in (folder, tmp_path / "again"))
    for each in (first, second):
        for key in ("command", "cost"):
            each.pop(key, None)
    assert first == second


def test_what_python_made_has_no_command(page):
    assert {section.command for section in page.sections} == {""}


def test_what_is_printed_has_its_command():
    done = CliRunner().invoke(app, ["classify", "sicm-kicked", "--json"])
    assert json.loads(done.stdout)["command"] == "heavytop classify sicm-kicked --json"


# --- the player ------------------------------------------------------------------------------


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


@pytest.mark.parametrize("quantities", [["theta"], ["theta", "phi"], ["axis"], ["attitude"]])
def test_momentum_keeps_what_is_conserved_whatever_a_run_follows(quantities):
    """L·z = p_φ and L·e = p_ψ, and e is where the quaternion takes the body's axis."""
    wanted = f"want.quantities={json.dumps(quantities)}"
    scene = load_scene("sicm-kicked", overrides=[wanted])
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
    followed = quantities == ["attitude"]
    assert followed == ("closed form" not in " ".join(played["notes"]))


def test_events_are_marked_where_they_are():
    trajectory = propagate(load_scene("sicm-kicked"))
    player = tops([frames(trajectory)])
    (played,) = player["runs"]
    for event in played["events"]:
        assert event["axis"] == pytest.approx(trajectory(event["t"]).axis, abs=1e-5)
    assert {event["kind"] for event in played["events"]} == {"theta_min", "theta_max", "reversal"}
    assert {event["kind"] for event in played["events"]} < set(player["marks"])


@pytest.mark.parametrize("name", ["at-rest", "sleeping", "sleeping-unstable", "hanging"])
def test_a_top_that_rests_is_shown_as_it_moves_when_it_is_touched(name):
    played = frames(propagate(load_scene(name)))
    axis = 1 - 2 * np.sum(columns(played["quaternion"], 4)[:, 1:3] ** 2, axis=1)
    assert abs(axis[0]) == pytest.approx(1.0)
    assert np.ptp(axis) > 1e-3
    assert played["notes"][0].startswith("Untouched it stays as it is")


@pytest.mark.parametrize("name", shipped_names())
def test_the_player_alone_is_a_small_page_that_asks_for_nothing(name):
    html = player_html(propagate(load_scene(name, overrides=HOSTILE)))
    seen = Seen(html)
    assert len(html) < 100_000
    assert not [attrs for _, attrs in seen.tags for key in attrs if key in ("src", "href")]
    assert len(seen.all("script")) == 2
    assert "default-src 'none'" in seen.all("meta")[-1]["content"]
    assert json.loads(seen.scripts["code-0"])["runs"][0]["title"] == BREAKING


# --- what is refused -------------------------------------------------------------------------


def refused(tmp_path, name, text):
    """The message about a file, from the command line."""
    path = tmp_path / name
    path.write_text(text if isinstance(text, str) else json.dumps(text), "utf-8")
    done = CliRunner().invoke(app, ["report", str(tmp_path), "-o", str(tmp_path / "page")])
    assert done.exit_code == 3, done.output
    assert name in done.stderr
    assert not (tmp_path / "page").exists()
    return done.stderr


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", "{", '{"schema": NaN}', "[" * 100_000, '{"schema": "heavytop/run/1"}', "\x00",
        '{"schema": "heavytop/validate/2", "claims": []}',
        '{"schema": "heavytop/validate/1"}', '{"schema": "heavytop/validate/1", "claims": {}}',
        '{"schema": "heavytop/validate/1", "claims": [{"id": 3}]}',
        json.dumps(validate()).replace("1e-09", "1e999"),
        json.dumps(validate()).replace("1e-09", "NaN"),
    ],
    ids=lambda text: text[:40].replace("\x00", "null"),
)  # fmt: skip
def test_a_damaged_document_is_refused_by_name(tmp_path, text):
    refused(tmp_path, "validate.json", text)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("workprec", {"points": [POINT | {"us_per_period": 0}, POINT | {"rival": False}]}),
        ("workprec", {"points": [{"method": "auto"}]}),
        ("stress", {"cases": [{"case": "x"}]}),
        ("stress", {"hard": {}}),
        ("atlas", {"axes": {"x": {"name": "phidot"}}}),
        ("atlas", {"shape": [24, 24]}),
        ("drift", {"methods": [{"name": "strang"}]}),
        ("run", {"plan": None}),
        ("run", {"events": {"turning": 1, "table": [{"kind": 5, "t": 0.0}]}}),
    ],
)
def test_a_document_without_what_a_page_needs_is_refused(place, tmp_path, name, change):
    for file in (place / name).iterdir():
        if file.is_file():
            (tmp_path / file.name).write_bytes(file.read_bytes())
    own = json.loads((tmp_path / f"{name}.json").read_text("utf-8"))
    refused_file = {"shape": "atlas.nc"}.get(next(iter(change)), f"{name}.json")
    (tmp_path / f"{name}.json").write_text(json.dumps(own | change), "utf-8")
    done = CliRunner().invoke(app, ["report", str(tmp_path), "-o", str(tmp_path / "page")])
    assert done.exit_code == 3, done.output
    assert refused_file in done.stderr


def test_the_trajectory_of_another_scene_is_refused(place, tmp_path):
    own = json.loads((place / "run" / "run.json").read_text("utf-8"))
    (tmp_path / "trajectory.nc").write_bytes((place / "run" / "trajectory.nc").read_bytes())
    own["scene"]["start"]["phidot"] = 3
    (tmp_path / "run.json").write_text(json.dumps(own), "utf-8")
    done = CliRunner().invoke(app, ["report", str(tmp_path), "-o", str(tmp_path / "page")])
    assert done.exit_code == 3
    assert "trajectory.nc: the trajectory of another scene" in done.stderr


def test_an_empty_folder_is_refused(tmp_path):
    done = CliRunner().invoke(app, ["report", str(tmp_path)])
    assert done.exit_code == 3
    assert "holds no results" in done.stderr


# --- the verb --------------------------------------------------------------------------------


@pytest.fixture
def quickly(monkeypatch):
    """Quick studies that are quicker still: the claims are there at once, and nothing else is."""

    def ended(words, place, limit_s):
        if words[0] == "validate":
            (place / words[-1]).mkdir()
            write_document(place / words[-1] / "validate.json", validate())
            return 0, ""
        return None if words[0] == "drift" else 3, f"{words[-1]}: no <b>"

    monkeypatch.setattr(studies, "run", ended)
    monkeypatch.setattr(studies, "traces_document", lambda: {"schema": "heavytop/traces/1",
                                                            "traces": [TRACE]})  # fmt: skip


TRACE = {"name": "x", "title": "x", "kind": "loops", "tags": [], "seconds": 1.0,
         "axis": [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]]}  # fmt: skip


def report(*words):
    return CliRunner().invoke(app, ["report", *map(str, words)])


def test_without_anything_the_studies_are_run_and_what_was_not_is_said(
    quickly, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    done = report()
    assert done.exit_code == 0, done.output
    assert sorted(p.name for p in tmp_path.iterdir()) == ["report.html", "report.json"]
    page = Seen((tmp_path / "report.html").read_text("utf-8"))
    said = [" ".join(text.split()) for text in page.texts]
    drifting = f"--periods 1000 --methods {','.join(studies.DRIFTING)}"
    command = f"heavytop drift sicm-kicked {drifting} --no-figures -o drift"
    assert any(re.fullmatch(rf"drift: not done in \d+ s \({command}\)", text) for text in said)
    assert "atlas: atlas: no <b> (heavytop atlas sicm-kicked --x phidot=-30:40:300" in str(said)
    assert report().exit_code == 0  # a report may be replaced


def test_as_json_nothing_is_written(quickly, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = report("sicm-kicked", "--set", "start.phidot=-14", "--json")
    document = json.loads(done.stdout)
    missing = {each["study"]: each["reason"] for each in document["missing"]}
    assert list(missing) == ["run", "drift", "workprec", "stress", "atlas", "energy_momentum"]
    own = "heavytop run sicm-kicked --set start.phidot=-14 --no-figures -o run"
    assert missing["run"] == f"run: no <b> ({own})"
    assert document["command"] == "heavytop report sicm-kicked --set start.phidot=-14 --json"
    assert not list(tmp_path.iterdir())


def test_a_file_that_is_no_report_is_left_alone(quickly, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("report.html").write_text("my own")
    assert report().exit_code == 2
    assert Path("report.html").read_text() == "my own"


def test_the_page_can_be_named(quickly, tmp_path):
    assert report("-o", tmp_path / "some" / "page.html").exit_code == 0
    assert (tmp_path / "some" / "page.json").is_file()


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["no-such-scene"], 3),
        (["{place}", "no-such-folder"], 2),
        (["sicm-kicked", "sicm-dropped"], 2),
        (["{place}", "--set", "start.phidot=3"], 2),
        (["--set", "start.phidot=3"], 2),
        (["sicm-kicked", "--set", "start.phidot=x"], 2),
    ],
)
def test_what_makes_no_sense_is_refused(quickly, place, words, code, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert report(*(word.format(place=place) for word in words)).exit_code == code
    assert not list(tmp_path.iterdir())


def test_long_tables_are_thinned_evenly():
    table = Table.of([{"k": k} for k in range(1000)], most=60)
    assert (len(table.rows), table.more) == (59, 941)
    assert table.rows[:2] == (("0",), ("17",))
