"""The paper: its citations, and that its numbers stand in the README or the pages."""

import re
from pathlib import Path

import pytest

import heavytop as ht

ROOT = Path(__file__).parents[2]
PAPER = (ROOT / "paper" / "paper.md").read_text("utf-8")
_, FRONT, TEXT = PAPER.split("---\n", 2)
CITED = list(dict.fromkeys(re.findall(r"@([\w-]+)", TEXT)))
REFERENCES = (ROOT / "docs" / "references.bib").read_text("utf-8").rstrip("\n").split("\n\n")
ENTRIES = {re.match(r"@\w+\{(.*),\n", entry)[1]: entry for entry in REFERENCES}


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
    readme = (ROOT / "README.md").read_text("utf-8")
    numbers = re.findall(r"\b\d[\d.]*e-?\d+\b|\b[\d.]+(?= µs)", TEXT)
    assert len(numbers) >= 10
    assert [number for number in numbers if number not in readme] == []
