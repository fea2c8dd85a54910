"""The pages of docs/ and the README, beside what ``make docs`` executes: what they say elsewhere.

``make docs`` runs all Python and all commands of the pages, finds what a link or a picture lacks,
and runs the commands of the README.
"""

import pkgutil
import re
import subprocess
import sys
import tomllib
from itertools import pairwise
from pathlib import Path
from textwrap import dedent

import mpmath
import numpy as np
import pytest
from click.testing import CliRunner

import heavytop as ht
from heavytop.checking.conventions import TABLE
from heavytop.cli import app
from heavytop.comparison import METHODS
from heavytop.equations.registry import FORMULATIONS
from heavytop.plots.figures import PICTURES
from heavytop.results.run import FIGURES
from heavytop.scene.quantities import wanted
from heavytop.scene.scene import read_scene

from .pages_agree import last_digit
from .test_first_ten_minutes import follows

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
README = (ROOT / "README.md").read_text("utf-8")
SOURCE = ROOT / "src" / "heavytop"
VARIES = ("cost", "errors", "event time")  # of the machine, or in the last digit
TREE = re.compile(r"^```\{toctree\}\n(?::[^\n]*\n)*\n(.*?)^```", re.MULTILINE | re.DOTALL)
SMALL = re.compile(r"-?\d(\.\d+)?e-1\d|-?0(?=\s|$)")


@pytest.mark.slow
@pytest.mark.processes
def test_the_pictures_are_those_that_the_script_draws(tmp_path):
    command = [sys.executable, "-W", "error", str(DOCS / "draw.py"), str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True)
    assert (tmp_path / "kicks.svg").stat().st_size > 10_000
    covers = {path.name for path in tmp_path.glob("notebook-*.svg")}
    assert covers == {path.name for path in (DOCS / "images").glob("notebook-*.svg")}


def test_the_chart_of_long_runs_has_the_methods_of_their_table():
    table, _ = (DOCS / "drift.md").read_text("utf-8").split("<!-- end long runs -->")
    chart = re.findall(r"<!-- ([a-z]\S+) -->", (DOCS / "images" / "drift.svg").read_text("utf-8"))
    assert {*re.findall(r"^\| `(\S+)`", table, re.MULTILINE)} == {*chart}


@pytest.mark.parametrize(("page", "names"), {
    "figures.md": PICTURES | FIGURES,
    "formulations.md": FORMULATIONS,
    "rivals.md": METHODS,
    "scenes.md": wanted(),
    "check-a-trajectory.md": [name for row in TABLE for name in row.name.split("+")],
}.items())  # fmt: skip
def test_a_page_lists_every_name_of_a_table(page, names):
    text = (DOCS / page).read_text("utf-8")
    missing = [name for name in names if f"`{name}`" not in text]
    assert not missing, f"docs/{page} has no line for {', '.join(missing)}"


# --- the map of pages -----------------------------------------------------------------------------


def test_no_page_is_in_two_parts():
    """That every page is in one, Sphinx sees to."""
    trees = [(index, TREE.findall(index.read_text("utf-8"))) for index in DOCS.rglob("*.md")]
    pages = [(index.parent / x).resolve() for index, tree in trees for x in " ".join(tree).split()]
    assert len(pages) > 30
    assert sorted(pages) == sorted({*pages})


@pytest.mark.parametrize("page", ["CONTRIBUTING.md", "docs/architecture.md"])
def test_the_files_that_a_page_for_developers_names_exist(page):
    for name in re.findall(r"`([\w./-]+/[\w.-]+\.\w+)`", (ROOT / page).read_text("utf-8")):
        made_by_the_reader = name.endswith("scenes/half-tilted.toml")
        assert made_by_the_reader or (SOURCE / name).exists() or (ROOT / name).exists(), name


def test_the_tests_and_the_names_that_are_given_in_full_exist():
    for text in [*ROOT.glob("*.md"), *DOCS.rglob("*.md"), *SOURCE.rglob("*.py")]:
        said = text.read_text("utf-8")
        for name in re.findall(r"\b(?:tests|validation)/[\w/]+\.py\b", said):
            assert (ROOT / name).exists(), (text, name)
        for name in re.findall(r"`(heavytop\.[\w.]+\.[A-Z_]+)`", said):
            assert pkgutil.resolve_name(name), (text, name)


def test_the_picture_of_the_layers_has_those_of_the_package(script):
    drawn = [{folder for folder, *_ in row} for row in script("draw").LAYERS]
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    contract = tools["importlinter"]["contracts"][0]["layers"][1:-1]  # without __main__, the tools
    assert drawn == [set(re.findall(r"\w+", row)) for row in contract]


# --- the ladder of kicks -------------------------------------------------------------------------
# theta0 = 0.1, thetadot0 = 0, the book's top, 140 rad/s held: roots found at 50 digits by another
# program, printed here as far as they were printed there.
@pytest.mark.reference
@pytest.mark.parametrize(("name", "exact_row"), {
    "through the bottom": ("-137.2775191107837", "-5638.8438"),
    "slow precession": ("5.925768", "6.3668390938832"),
    "cusp again": ("9.26062465343216", "9.87012987012987"),
    "through the vertical": ("15.695837998076", "14.1206380405683"),
    "fast precession": ("29.51848", "21.945335558617"),
}.items())  # fmt: skip
def test_the_ladder_of_kicks(name, exact_row):
    """What the page shows of it, which ``make docs`` holds to what is computed."""
    [row] = re.findall(rf"^{name} +(\S+) +(\S+)$", (DOCS / "kicks.md").read_text("utf-8"), re.M)
    for shown, exact in zip(row, exact_row, strict=True):
        assert abs(float(shown) - float(exact)) <= 0.51 * max(map(last_digit, (shown, exact)))


# --- the page of Taylor's method: its steps a period, and those that the singularities predict ---

TAYLOR = (DOCS / "theory" / "taylor.md").read_text("utf-8")
ROWS = re.findall(r"^\| `([\w-]+)` \|(.*)\|$", TAYLOR, re.MULTILINE)
missed = pytest.mark.filterwarnings("ignore::UserWarning")  # of digits that are not met


def scene_of(name, periods):
    return ht.load_scene(name, overrides=[f"span.periods={periods}", "want.events=[]"])


def steps_a_period(scene, formulation):
    """In every block but the first, whose steps are bounded by those at the start."""
    period = ht.Motion(scene.top, scene.start).period
    blocks = pairwise(ht.propagate(scene, formulation=formulation).orbit.checkpoints[1:])
    return [(b.steps - a.steps) * period / (b.time[0] - a.time[0]) for a, b in blocks]


def expected(motion, poles_of_angles):
    """e^(2 + 0.7/(p − 1)) ∮dt/ρ, with ρ the distance from the nearest singularity of the page."""
    (u1, u2, u3), (m, mc) = motion.roots, motion.modulus
    quarter, other = float(mpmath.ellipk(m)), float(mpmath.ellipk(mc))
    ends = (1 + u1) / (u2 - u1), (1 - u2) * (u3 - u1) / ((u2 - u1) * (u3 - 1))
    v = [float(mpmath.ellipf(mpmath.atan(mpmath.sqrt(x)), mc)) for x in ends]
    x = np.linspace(-quarter, quarter, 20_000)
    rho = np.hypot(x, other)
    if poles_of_angles:
        rho = np.minimum(np.minimum(rho, np.hypot(x, v[0])), np.hypot(quarter - abs(x), v[1]))
    return np.exp(2 + 0.7 / 19) * 2 * quarter * np.mean(1 / rho)


@missed
@pytest.mark.parametrize(("name", "cells"), ROWS)
def test_steps_are_as_many_as_the_page_says(name, cells):
    scene = scene_of(name, 700)
    motion = ht.Motion(scene.top, scene.start)
    taken, angles = (steps_a_period(scene, form)[-1] for form in ("axis", "subsystem"))
    found = [taken, expected(motion, False), angles, expected(motion, True)]
    assert [float(cell) for cell in cells.split("|")] == pytest.approx(found, abs=0.06)


@missed
def test_steps_lengthen_where_an_angle_grows():
    assert len(ROWS) == 3
    [shown] = re.findall(r"from ([\d.]+) to ([\d.]+) steps a period", " ".join(TAYLOR.split()))
    growing, kept = (steps_a_period(scene_of("sicm-kicked", 1000), form)
                     for form in ("lagrange", "subsystem"))  # fmt: skip
    assert [float(x) for x in shown] == pytest.approx([growing[0], growing[-1]], abs=0.06)
    assert {f"keeps its {each:.0f}." in TAYLOR for each in kept} == {True}


# --- the README ----------------------------------------------------------------------------------


def stable(text):
    """The lines that do not vary, with numbers that are rounding left out."""
    lines = (re.sub(r"\s+", " ", SMALL.sub("~", line)).strip() for line in text.splitlines())
    return [line for line in lines if line and not line.startswith(VARIES)]


@pytest.mark.slow
def test_the_readme_shows_what_a_command_prints(tmp_path):
    printed = stable(CliRunner().invoke(app, ["run", "sicm-kicked", "-o", str(tmp_path)]).stdout)
    shown = README.split("<!-- begin run sicm-kicked -->")[1].split("<!-- end")[0]
    shown = stable(shown.replace("```text", "").replace("```", ""))
    assert follows(shown, printed)
    assert set(shown) <= {"…", *printed}  # to the last digit


def test_the_python_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    [program] = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
    exec(compile(program, "README.md", "exec"), {"__name__": "readme"})
    assert capsys.readouterr().out.startswith("loops 0.542895518188")
    assert (tmp_path / "kicked.nc").exists()


def test_every_link_of_the_readme_leads_somewhere():
    for link in re.findall(r"(?:\]\(|src=\")([^)#\"]+)", README):
        assert link.startswith("https://") or (ROOT / link).exists(), link
    for link, place in re.findall(r"\]\((docs/[^)#]+)#([^)]+)\)", README):
        headings = re.findall(r"^#+ (.*)$", (ROOT / link).read_text("utf-8"), re.MULTILINE)
        assert place in {re.sub(r"[^\w -]", "", x).lower().replace(" ", "-") for x in headings}


# What else the README says in numbers, and where the package has them from.
@pytest.mark.parametrize(("page", "figures"), {
    "tests/analytic/test_published.py": ("1e-12", "5e-15", "5e-13"),
    "docs/theory/rounding.md": ("3.1e-13 s", "9.6e-08 s"),
    "docs/check-a-trajectory.md": ("1.1e-15", "285", "1.1e-07", "1.53e+04", "2.2e-09", "8.62e+03"),
    "docs/drift.md": ("7.2e-05", "2.5e-09", "| 3.5 |", "| 5.31 |"),
    "docs/validation.md": ("3.6e-15",),
}.items())  # fmt: skip
def test_the_figures_of_the_readme_are_those_of_the_pages(page, figures):
    for figure in figures:
        assert figure in (ROOT / page).read_text("utf-8"), figure
        assert figure.strip("| ").replace("e-0", "e-").replace("e+0", "e") in README, figure


def test_the_first_change_of_contributing_is_a_scene_of_the_kind_it_says():
    scene = re.search(r"^```toml\n(.*?)^```", (DOCS / "scenes.md").read_text("utf-8"), re.M | re.S)
    assert read_scene(scene[1]).start.held == "omega3"
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    [text] = re.findall(r"^ +```toml\n(.*?)^ +```", page, re.MULTILINE | re.DOTALL)
    scene = read_scene(dedent(text))
    verdict = ht.Motion(scene.top, scene.start).verdict
    assert f'("{verdict.kind}", {verdict.tags!r})'.replace("'", '"') in page


def test_every_verb_is_named_in_the_readme():
    for verb in app.verbs:
        assert f"heavytop {verb}" in README, "README.md: Other commands"


# --- the environment, and the paper ---------------------------------------------------------------

CONDA = {"heyoka": "heyoka.py", "matplotlib": "matplotlib-base"}  # under other names there


def requirement(text):
    """Return the name and the bounds of a requirement, written in whichever way, for any system."""
    text, _, _ = text.partition(";")
    name, bounds = re.fullmatch(r"([\w.-]+?)\s*([<>=!~].*)?", text.strip()).groups()
    return name, frozenset(filter(None, re.split(r"[,\s]+", bounds or "")))


def test_conda_installs_what_pip_does():
    """Every dependency stands in environment.yml, with the same bounds."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    wanted = dict(map(requirement, project["dependencies"]))
    lines = re.findall(r"^  - ([a-z][^:\n]*)$", (ROOT / "environment.yml").read_text("utf-8"), re.M)
    there = dict(map(requirement, lines))
    wanted |= dict([requirement(f"python {project['requires-python']}")])
    renamed = {CONDA.get(name, name): bounds for name, bounds in wanted.items()}
    assert renamed.items() <= there.items()


_, FRONT, TEXT = (ROOT / "paper" / "paper.md").read_text("utf-8").split("---\n", 2)
CITED = list(dict.fromkeys(re.findall(r"@([\w-]+)", TEXT)))
REFERENCES = (ROOT / "docs" / "references.bib").read_text("utf-8").rstrip("\n").split("\n\n")
ENTRIES = {re.match(r"@\w+\{(.*),\n", entry)[1]: entry for entry in REFERENCES}


@pytest.mark.parametrize("method", METHODS.values(), ids=METHODS)
def test_the_references_have_the_source_of_every_method(method):
    year, names = re.findall(r"\b[12]\d{3}\b", method.source)[-1], r"(?:\b[A-Z]\. )+(\w[\w-]*)"
    authors = [line for entry in REFERENCES if f"year = {{{year}}}" in entry
               for line in entry.splitlines() if "author = " in line]  # fmt: skip
    found = {name for name in re.findall(names, method.source) if name in " ".join(authors)}
    assert found, f"docs/references.bib has no entry for {method.source}"


def test_its_front_is_what_is_to_be_cited():
    yaml = pytest.importorskip("yaml", reason="it comes with the extra docs")
    front = yaml.safe_load(FRONT)
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert front["title"] == cff["title"]
    names, cited = ([each["name"] for each in of["authors"]] for of in (front, cff))
    assert names == cited
    assert front["bibliography"] == "paper.bib"
    assert cff["version"] == ht.__version__
    assert f"version {ht.__version__}}}" in ENTRIES["heavytop"]
    for each, key in zip(cff["references"], ("heyoka", "sicm"), strict=True):
        assert each["title"] in ENTRIES[key]
        assert f"year = {{{each['year']}}}" in ENTRIES[key]


def test_its_bibliography_is_what_it_cites_as_the_references_have_it():
    """To write the file anew: the right side of the comparison."""
    written = (ROOT / "paper" / "paper.bib").read_text("utf-8")
    assert written == "\n\n".join(ENTRIES[key] for key in CITED) + "\n"


def test_its_numbers_are_those_of_the_readme():
    numbers = re.findall(r"\b\d[\d.]*e-?\d+\b|\b[\d.]+(?= µs)", TEXT)
    assert len(numbers) >= 10
    assert [number for number in numbers if number not in README] == []
