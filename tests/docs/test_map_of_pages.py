"""Where a page stands, and where it says that something is: the parts of docs/, and the files."""

import importlib.util
import pkgutil
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SOURCE = ROOT / "src" / "heavytop"
TREE = re.compile(r"^```\{toctree\}\n(?::[^\n]*\n)*\n(.*?)^```", re.MULTILINE | re.DOTALL)


def test_no_page_is_in_two_parts():
    """That every page is in one, Sphinx sees to."""
    pages = []
    for index in DOCS.rglob("*.md"):
        for names in TREE.findall(index.read_text("utf-8")):
            pages += [(index.parent / name).resolve() for name in names.split()]
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


def test_the_picture_of_the_layers_has_those_of_the_package():
    spec = importlib.util.spec_from_file_location("draw", DOCS / "draw.py")
    draw = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(draw)
    drawn = [{folder for folder, *_ in row} for row in draw.LAYERS]
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    contract = tools["importlinter"]["contracts"][0]["layers"][1:-1]  # without __main__, the tools
    kept = [set(re.findall(r"\w+", row)) for row in contract]
    assert drawn == kept
