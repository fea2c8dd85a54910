"""What a report says in words and cells is what its numbers are: counts, ends, digits and units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from heavytop.analytic.motion import Motion
from heavytop.analytic.potential import Potential
from heavytop.plots.figures import MOST_PERIODS
from heavytop.report.pages.page import LoadedResult, Page
from heavytop.report.pages.sections import Section, run_data
from heavytop.report.parts import MISSING, SYMBOLS, Fitting, Table, cell, given, headed
from heavytop.report.run import events
from heavytop.report.studies import drift_parts, summary
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene
from heavytop.studies.atlas_plane import ROLES


@pytest.mark.parametrize("name", ["sicm-kicked", "simo-wong", "steady-betsch", "sleeping-unstable"])
def test_the_numbers_beside_a_potential_are_those_of_the_motion(name):
    scene = load_scene(name)
    motion = Motion(scene.top, scene.start)
    columns = run_data(propagate(scene))["potential"]
    potential = Potential(motion.rising.source)
    energies = float(scene.top.A) * potential(np.array(columns["theta"]))
    assert columns["potential"] == pytest.approx(energies, rel=1e-9)
    assert columns["E_prime"] == pytest.approx(float(motion.constants.E_prime), rel=1e-11)
    ends = [columns[name] for name in ("theta_min", "theta_max")]
    assert ends == pytest.approx([float(motion.theta_min), float(motion.theta_max)], abs=1e-11)
    inside = [ends[0] < tilt < ends[1] for tilt in columns["theta"]]
    assert sum(inside) > 50 or not motion.nutates


def test_a_long_run_without_events_is_shown_for_so_long_as_its_turns_are_seen():
    long = load_scene("sicm-kicked", overrides=["span.time=60", "want.events=[]"])
    columns = run_data(propagate(long))["motion"]
    period = Motion(long.top, long.start).period
    assert columns["t"][-1] == pytest.approx(MOST_PERIODS * period)


def test_what_is_given_is_shown_with_signs_and_units():
    assert given({"A": 0.000328, "C": "6.60e-5"}) == "A = 0.000328 kg m², C = 6.60e-5 kg m²"
    assert given({"theta": "pi/2", "phi": 0, "omega3": 140}) == "θ = pi/2 rad, ω₃ = 140 rad/s"
    assert given({"theta": 0}) == "all zero"


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0472636, 2, "0.047"), (1.5e-16, 3, "1.5e-16"), (5280, 2, "5280"), (True, 6, "yes"),
        (None, 6, MISSING), ("0.33333333333333333333", 6, "0.33333333333333333333"),
        ([], 6, MISSING),
    ],
)  # fmt: skip
def test_cells_have_sensible_digits(value, digits, text):
    assert cell(value, digits) == text


def test_columns_are_headed_with_symbols_and_units():
    assert headed("phidot") == "φ̇ [rad/s]"
    assert (headed("digits_lost"), headed("from p_φ [J]")) == ("digits lost", "from p_φ [J]")


def test_a_table_leaves_out_columns_in_which_there_is_nothing():
    table = Table.of([{"t": 0, "why": None}, {"t": 1, "why": None}])
    assert (table.head, table.rows, table.more) == (("t [s]",), (("0",), ("1",)), 0)


def test_the_best_form_of_events_has_all_digits_and_the_rest_fewer():
    row = {"kind": "cusp", "t": 1 / 3, "theta": 0.1, "phi": None, "phidot": 1e-17, "residual": 0}
    found = events([row, row | {"phidot": 5.0}], omitted=7)
    assert isinstance(found, Fitting)
    (best,), *_, (last,) = found.forms
    assert best.rows[0] == ("cusp", "0.333333333333", "0.1", MISSING, "0", "0")
    assert last.rows[0][1] == "0.333"
    assert best.more == 7


def test_a_phase_that_is_lost_is_said_to_be_and_a_skipped_method_has_its_reason():
    known = {
        "name": "strang", "skipped": None, "periods": [1.0, 10.0], "energy": [1e-9, 2e-9],
        "phase_s": [1e-3, None], "axis": [1e-9, 3e-2], "energy_exponent": 0.5,
        "phase_exponent": None, "stderr": {"energy": 0.031, "phase": None}, "ended": {},
    }  # fmt: skip
    other = known | {"name": "gauss8", "skipped": "no package"}
    document = {"periods": 10, "ensemble": 1, "spread": 0, "seed": 0, "methods": [known, other]}
    _, table, notes = drift_parts(document)
    assert table.rows == (("strang", MISSING, "2.0e-09", "0.50(3)", "lost", MISSING, "3.0e-02"),)
    assert notes.rows == (("gauss8", "skipped: no package"),)


BOOK = {"name": "book", "title": "The book's", "source": "SICM", "top": {"A": 1}, "start": {}}


def section(study, ident, **document):
    path = Path("folder") / f"{study}.json"
    document["schema"] = f"heavytop/{study}/1"
    return Section(LoadedResult(path, path.name, document, "0"), ident, ident, ())


def test_the_head_lists_results_by_scene_and_counts_claims():
    other = BOOK | {"title": "", "name": "other"}
    claims = [{"id": str(k), "passed": passed} for k, passed in enumerate((True, False, None))]
    page = Page((
        section("run", "run-1", scene=BOOK, versions={"heyoka": "7", "cpu": None}),
        section("run", "run-2", scene=other), section("drift", "drift-1", scene=BOOK),
        section("drift", "drift-2", scene=BOOK, versions={"heyoka": "8", "cpu": "a processor"}),
        section("stress", "stress-1"), section("validate", "claims-1", claims=claims),
    ))  # fmt: skip
    assert page.title == "6 results"
    links = {title: [each.ident for each in some] for title, some in page.contents.items()}
    assert links == {
        "The book's": ["run-1", "drift-1", "drift-2"], "other": ["run-2"],
        "All tops": ["stress-1", "claims-1"],
    }  # fmt: skip
    assert [(each.ident, *rest) for each, *rest in page.verdicts] == [
        ("claims-1", "1 holds, 1 fails, 1 skipped", ["1"])
    ]
    assert page.machine == ["cpu a processor", "heyoka 7 and 8"]
    assert Page((section("run", "run-1", scene=BOOK),)).title == "run-1"


def test_every_axis_of_an_atlas_has_a_sign_and_a_unit():
    bare = {name: unit.replace(" s⁻¹", "/s") for name, (_, unit, _) in ROLES.items()}
    assert {name: SYMBOLS[name][1] for name in ROLES} == bare | {"gMR": "J"}


def test_claims_are_counted():
    def of(*passed):
        return summary([{"passed": each} for each in passed])

    assert of(*[True] * 82, *[None] * 3) == "82 hold, none fails, 3 skipped"
    assert of(False, False) == "0 hold, 2 fail"
