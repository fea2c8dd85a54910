"""What a report says in words and cells is what its numbers are: counts, ends, digits and units."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential
from heavytop.plots.figures import MOST_PERIODS
from heavytop.report.pages.behind import BEHIND
from heavytop.report.pages.claims import verdicts
from heavytop.report.pages.descriptions import GIVEN, described, given
from heavytop.report.pages.findings import Finding
from heavytop.report.pages.section import Picture, Section
from heavytop.report.pages.summary import Verdicts, summary_of
from heavytop.report.pages.tables import Table, cell, rounded
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene
from heavytop.studies.atlas_plane import ROLES

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
    theta = np.linspace(0.0, 2.0, 3)
    found = {"theta": list(theta), "potential_J": [1.0, 0.0, None], "E_prime_J": [0.25] * 3}
    ends = {"theta_min": [0.5] * 3, "theta_max": [1.5] * 3}
    assert described("potential", found | ends) == (
        "The potential is least, 0 J, at a tilt of 57.3°. "
        "The motion has the energy E′, 0.25 J, at tilts from 28.6° to 85.9°."
    )
    still = described("potential", found | {name: [1.0] * 3 for name in ends})
    assert still.endswith("0.25 J, and stays at a tilt of 57.3°.")


@pytest.mark.parametrize("name", ["sicm-kicked", "simo-wong", "steady-betsch", "sleeping-unstable"])
def test_the_tilts_beside_a_potential_are_those_of_the_motion(name):
    scene = load_scene(name)
    motion = Motion(scene.top, scene.start)
    columns = BEHIND["potential"][1](propagate(scene))
    potential = Potential(motion.rising.source)
    least = np.argmin([np.inf if v is None else v for v in columns["potential_J"]])
    assert columns["theta"][least] == pytest.approx(potential.bottom, abs=1e-7)  # flat there
    energy = float(scene.top.A) * float(potential.least)
    assert columns["potential_J"][least] == pytest.approx(energy, rel=1e-10)
    ends = [columns[name][0] for name in ("theta_min", "theta_max")]
    assert ends == pytest.approx([float(motion.theta_min), float(motion.theta_max)], abs=1e-11)
    inside = [ends[0] < tilt < ends[1] for tilt in columns["theta"]]
    assert sum(inside) > 50 or not motion.nutates


@pytest.mark.parametrize("name", ["sleeping", "sleeping-marginal", "through-top"])
def test_a_potential_that_is_least_upright_is_said_to_be_so(name):
    columns = BEHIND["potential"][1](propagate(load_scene(name)))
    assert " J, at a tilt of 0°. " in described("potential", columns)


def test_a_long_run_without_events_is_shown_for_so_long_as_its_turns_are_seen():
    long = load_scene("sicm-kicked", overrides=["span.time=60", "want.events=[]"])
    columns = BEHIND["overview"][1](propagate(long))
    period = Motion(long.top, long.start).period
    assert columns["t"][-1] == pytest.approx(MOST_PERIODS * period)
    assert f"It turns back {2 * MOST_PERIODS} times" in described("overview", columns)


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
        [("run-1", "run"), ("drift-1", "drift (drift.json)"), ("drift-2", "drift (drift.json)")],
        [("run-2", "run")],
    ]  # fmt: skip
    assert [link.ident for link in found.others] == ["stress-1", "claims-1"]
    assert found.claims == (("claims-1", 1, ("1",), 1),)
    assert found.machine == ("a processor", "heyoka 7 and 8")
    assert found.processor


def test_the_head_of_one_scene_is_its_title():
    assert summary_of([result("run", "run-1", scene=BOOK)]).title == "The book's"
    assert summary_of([result("validate", "c", claims=[])]).title == "claims"
    assert json.dumps(summary_of([]).title) == '"0 results"'


def test_results_of_one_name_go_by_their_files():
    def at(folder, study, ident, scene):
        finding, section = result(study, ident, scene=scene)
        return finding._replace(name=f"{folder}/{finding.name}"), section

    other = BOOK | {"start": {"theta": 1}}
    found = summary_of([at("a", "run", "run-1", BOOK), at("b", "run", "run-2", other),
                        at("c", "drift", "drift-1", BOOK)])  # fmt: skip
    assert [about.title for about in found.scenes] == [
        "The book's (a/run.json)", "The book's (b/run.json)",
    ]  # fmt: skip
    found = summary_of([at(folder, "run", folder, BOOK) for folder in "ab"])
    assert [link.words for link in found.scenes[0].links] == [
        "run (a/run.json)",
        "run (b/run.json)",
    ]
    assert found.scenes[0].title == "The book's"
    assert not found.processor


def test_every_axis_of_an_atlas_has_a_sign_and_a_unit():
    assert GIVEN.keys() >= ROLES.keys()
    bare = {name: unit.replace(" s⁻¹", "/s") for name, (_, unit, _) in ROLES.items()}
    assert {name: unit for name, (_, unit) in GIVEN.items() if name in ROLES} == bare | {"gMR": "J"}


def test_claims_are_counted_alike_everywhere():
    assert Verdicts("c", 82, (), 3).words == verdicts(82, 0, 3) == "82 hold, none fails, 3 skipped"
    assert verdicts(1, 1, 0) == "1 holds, 1 fails"
    assert verdicts(0, 2, 0) == "0 hold, 2 fail"
