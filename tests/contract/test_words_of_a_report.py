"""What a report says in words and cells is what its numbers are: counts, ends, digits and units."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from heavytop.pages.descriptions import described, given
from heavytop.pages.findings import Finding
from heavytop.pages.section import Picture, Section
from heavytop.pages.summary import summary_of
from heavytop.pages.tables import Table, cell, rounded

WAVE = np.sin(np.linspace(0.0, 4 * np.pi, 201))


def test_the_words_of_an_overview_are_its_numbers():
    phi = np.linspace(0.0, 4 * np.pi, 201) - 2.0 * WAVE  # it turns back where 2 cos > 1, twice
    words = described("overview", {"theta": list(0.5 + 0.1 * WAVE), "phi": list(phi)})
    assert words == (
        "The tilt goes from 22.9° to 34.4°. The axis goes 2 turns about the vertical. "
        "It turns back 4 times on the way."
    )  # at the ends it is on its way back


def test_rounding_is_no_turning_and_a_jump_at_a_pole_neither():
    still = [1.0, 1.0 + 2e-16, 1.0] * 9
    assert "It never turns back." in described("overview", {"phi": still})
    phi = np.linspace(0.0, 6.0, 601)
    phi[300:] -= np.pi
    assert "It never turns back." in described("overview", {"phi": list(phi)})


def test_what_stays_is_said_to_stay():
    assert described("phase", {"theta": [0.2, 0.2, None]}) == "The tilt stays at 11.5°."


def test_the_words_of_a_potential_are_its_tilts():
    theta = np.radians(np.arange(1, 180))
    found = {"theta": list(theta), "potential_J": list((theta - 1.0) ** 2), "E_prime_J": [0.25]}
    words = described("potential", found)
    assert "least" in words
    assert "at a tilt of 57°." in words  # 57.3 on the grid of degrees
    assert "E′, 0.25 J, allows tilts of about 29° to 85°." in words  # 28.6 to 85.9


def test_the_words_of_errors_are_the_largest():
    words = described("errors", {"t": [9.0, 9.0], "theta": [1.23e-15, None], "axis": [0.0, 4e-16]})
    assert words == "The error of theta is at most 1.2e-15 rad. The error of axis is at most 4e-16."


def test_a_picture_without_numbers_says_so():
    assert described("errors", {"t": []}) == "There is nothing in it."


def test_what_is_given_is_shown_with_signs_and_units():
    assert given({"A": 0.000328, "C": "6.60e-5"}) == "A = 0.000328 kg m², C = 6.60e-5 kg m²"
    assert given({"theta": "pi/2", "phi": 0, "omega3": 140}) == "θ = pi/2 rad, ω₃ = 140 rad/s"
    assert given({"theta": 0}) == "all zero"


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0472636, 2, "0.047"), (533.943173, 2, "530"), (1.5e-16, 3, "1.5e-16"), (-0.0, 2, "0"),
        (5280, 2, "5280"), (123456789.5, 6, "123457000"), (2e300, 2, "2e300"), (10**12, 3, "1e12"),
        (True, 6, "yes"), (float("nan"), 6, "–"), ("x" * 400, 6, "x" * 299 + "…"),
    ],
)  # fmt: skip
def test_cells_have_sensible_digits(value, digits, text):
    assert cell(value, digits) == text


def test_decimals_that_were_asked_for_are_not_cut():
    assert rounded({"a": 1 / 3, "b": "0.33333333333333333333", "c": None}) == {
        "a": 0.333333, "b": "0.33333333333333333333", "c": None,
    }  # fmt: skip


def test_a_table_in_parts_loses_no_row():
    whole = Table.of({"verdict": ["FAIL", "hold", "hold", "skipped: x"], "whose": list("abba")})
    parts = dict(whole.parted("whose"))
    assert {name: part.counted for name, part in parts.items()} == {
        "a": "1 FAIL, 1 skipped", "b": "2 hold",
    }  # fmt: skip
    assert [part.fails for part in parts.values()] == [True, False]
    assert sum(len(part.rows) for part in parts.values()) == whole.all_rows


def test_a_picture_is_as_wide_as_its_drawing():
    assert Picture("a", "a", "a", b'<svg height="1pt" width="75pt">', TABLE, {}, "").width == 100
    assert Picture("a", "a", "a", b"<svg>", TABLE, {}, "").width == 640


TABLE = Table.of({})
BOOK = {"name": "book", "title": "The book's", "source": "SICM", "top": {"A": 1}, "start": {}}


def result(study, ident, **document):
    path = Path("folder") / f"{study}.json"
    finding = Finding(path, f"heavytop/{study}/1", document, "0", 1, path.name)
    return finding, Section(ident, ident)


def test_the_head_lists_results_by_scene_and_counts_claims():
    other = BOOK | {"start": {"theta": 1}}
    claims = [{"id": str(k), "passed": passed} for k, passed in enumerate((True, False, None))]
    found = summary_of([
        result("run", "run-1", scene=BOOK, versions={"heyoka": "7", "cpu": None}),
        result("run", "run-2", scene=other), result("drift", "drift-1", scene=BOOK),
        result("drift", "drift-2", scene=BOOK, versions={"heyoka": "8", "cpu": "a processor"}),
        result("stress", "stress-1"), result("validate", "claims-1", claims=claims),
    ])  # fmt: skip
    assert found.title == "6 results about 2 scenes"
    links = [[(link.ident, link.words) for link in about.links] for about in found.scenes]
    assert links == [
        [("run-1", "run"), ("drift-1", "drift"), ("drift-2", "drift 2")], [("run-2", "run")],
    ]  # fmt: skip
    assert [link.ident for link in found.others] == ["stress-1", "claims-1"]
    assert found.claims == (("claims-1", 1, ("1",), 1),)
    assert found.machine == ("a processor", "heyoka 7 and 8")


def test_the_head_of_one_scene_is_its_title():
    assert summary_of([result("run", "run-1", scene=BOOK)]).title == "The book's"
    assert summary_of([result("validate", "c", claims=[])]).title == "claims"
    assert json.dumps(summary_of([]).title) == '"0 results"'
