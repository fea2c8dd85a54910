"""The claims on a page: whose numbers they are held against, and the command for just these."""

from __future__ import annotations

import json

import pytest

from heavytop.claims.register import NUMBERS
from heavytop.errors import ForeignFile
from heavytop.report.pages.claims import WHOSE, claims_section
from heavytop.report.pages.findings import findings


def section(tmp_path, **document):
    """The section of a document that has what it needs, and more."""
    claim = {"id": "x", "statement": "s", "authority": "a", "bound": 1, "measured": 0.5}
    claim |= {"passed": True, "skipped": None} | document.pop("claim", {})
    found = {"schema": "heavytop/validate/1", "claims": [claim], **document}
    (tmp_path / "validate.json").write_text(json.dumps(found), "utf-8")
    return claims_section(findings([tmp_path]).results[0], "claims")


@pytest.mark.parametrize(
    ("said", "command"),
    [
        ({}, "heavytop validate -o out/claims"), ({"asked": []}, "heavytop validate -o out/claims"),
        ({"proofs": False}, "heavytop validate -o out/claims"),
        ({"asked": ["x", "y z"], "proofs": False}, "heavytop validate x 'y z' -o out/claims"),
        ({"asked": [], "proofs": True}, "heavytop validate --proofs -o out/claims"),
        ({"asked": ["x"], "proofs": True}, "heavytop validate x --proofs -o out/claims"),
    ],
)  # fmt: skip
def test_the_command_makes_exactly_this(tmp_path, said, command):
    assert section(tmp_path, **said).command == command


@pytest.mark.parametrize("asked", ["x", [3], {"x": 1}, ["--debug"], ["x"] * 2001])
def test_what_nobody_can_have_asked_is_refused(tmp_path, asked):
    with pytest.raises(ForeignFile, match=r"validate\.json: asked"):
        section(tmp_path, asked=asked)


@pytest.mark.parametrize(
    ("claim", "shown"),
    [({"numbers": "ours"}, "its equations, integrated by us"), ({"numbers": "else"}, "else"),
     ({"numbers": "printed"}, "printed by the authority"), ({}, "–")],
)  # fmt: skip
def test_it_says_whose_numbers(tmp_path, claim, shown):
    table = section(tmp_path, claim=claim).table
    assert table.rows[0][table.head.index("whose numbers")] == shown


@pytest.mark.parametrize(
    "claim",
    [
        {"measured": 1e9, "bound": 1e-15}, {"measured": None}, {"bound": None},
        {"measured": "0.5"}, {"bound": "1"}, {"passed": False, "skipped": "no time"},
        {"passed": True, "skipped": "no time"}, {"passed": None}, {"passed": None, "skipped": ""},
    ],
)  # fmt: skip
def test_a_verdict_against_its_own_numbers_is_refused(tmp_path, claim):
    with pytest.raises(ForeignFile, match=r"validate\.json: claims: \[0\]"):
        section(tmp_path, claim=claim)


@pytest.mark.parametrize(
    ("claim", "shown"),
    [({}, "hold"), ({"measured": 1}, "hold"), ({"passed": False, "measured": 2}, "FAIL"),
     ({"passed": False, "measured": None}, "FAIL"),
     ({"passed": None, "measured": None, "skipped": "no time"}, "skipped: no time")],
)  # fmt: skip
def test_what_has_a_verdict_shows_it(tmp_path, claim, shown):
    table = section(tmp_path, claim=claim).table
    assert table.rows[0][table.head.index("verdict")] == shown


def test_it_has_words_for_all_kinds_of_numbers():
    assert list(WHOSE) == list(NUMBERS)
