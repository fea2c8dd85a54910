"""What a study says in words and cells is what its numbers are."""

import pytest
from rich.console import Console

from heavytop.report.studies import parts_of, rendered, summaries, summary
from heavytop.report.tables import MISSING, SYMBOLS, Fitting, Table, at_most, given, headed
from heavytop.scene.scene import load_scene
from heavytop.studies.atlas_plane import ROLES

from .conftest import LEADER, POINT, stress, validate, workprec


def said(document):
    """All rows of a document, by their labels; of tables the first column."""
    tables = [each for part in parts_of(document) if not isinstance(part, str)
              for each in (part.forms[0] if isinstance(part, Fitting) else [part])]  # fmt: skip
    return {row[0]: row[1:] for table in tables for row in table.rows}


def printed(part, width):
    console = Console(width=width)
    with console.capture() as found:
        console.print(part)
    return found.get()


def test_drift_says_what_is_lost_skipped_and_ended_early():
    known = {
        "name": "strang", "skipped": None, "periods": [1.0, 10.0], "energy": [1e-9, 2e-9],
        "phase_s": [1e-3, None], "axis": [1e-9, 3e-2], "energy_exponent": 0.5,
        "phase_exponent": None, "stderr": {"energy": 0.031, "phase": None}, "ended": {},
    }  # fmt: skip
    short = known | {"name": "short", "periods": [1.0, 4.0], "ended": {"3": "it diverged"},
                     "phase_exponent": 12.3, "stderr": {"energy": None, "phase": 2.0}}  # fmt: skip
    other = known | {"name": "gauss8", "skipped": "no package"}
    document = {"schema": "heavytop/drift/1", "periods": 10, "ensemble": 4, "spread": 0.01,
                "seed": 7, "methods": [known, short, other], "files": {"a": "x", "b": "y"},
                }  # fmt: skip
    asked, table, notes = parts_of(document)
    assert asked.rows[0][1] == "10 nutation periods, 4 starts within 1% (seed 7), RMS"
    assert table.rows == (
        ("strang", MISSING, "2.0e-09", "0.50(3)", "lost", MISSING, "3.0e-02"),
        ("short", MISSING, "2.0e-09", "0.50(1)", "lost", "12(2)", "3.0e-02"),
    )
    assert notes.rows == (
        ("short", "to 4 periods"), ("short", "start 3 ended early: it diverged"),
        ("gauss8", "skipped: no package"), ("files", "x, y"),
    )  # fmt: skip


def test_work_and_precision_names_the_cheapest_the_next_and_what_was_left_out():
    found = said(workprec(load_scene("sicm-kicked").document()))
    leader = "strang (200 steps a period), 9 µs, error 1.0e-06"
    assert found["axis to 1e-6"] == (
        f"{leader}; the best other integrator, strang (200 steps a period), takes 2 times as long",
    )
    assert found["axis, best"] == (leader,)
    assert found["θ alone to 1e-6"] == (MISSING,)
    assert found["rivals"] == ("only these were run: strang",)
    assert found["left out"][0].endswith(": gauss8 (1 setting from 1e-09)")
    alone = workprec(load_scene("sicm-kicked").document())
    alone |= {"points": [POINT | {"measures": "theta"}], "front": [0],
              "cheapest": {"1e-6": LEADER | {"against": LEADER | {"rival": False}, "ratio": 3.0}},
              "rivals": {"run": [], "left_out": ["strang"]}}  # fmt: skip
    found = said(alone)
    assert "the Taylor integrator's best" in found["θ to 1e-6"][0]
    assert found["rivals"][0].startswith("NO OTHER INTEGRATOR WAS RUN")


def test_a_method_is_summed_up_by_its_cheapest_and_its_best():
    points = [POINT | {"error": error, "us_per_period": us, "setup_s": us}
              for error, us in ((1e-7, 4.0), (1e-6, 3.0), (1e-10, 1234.0))]  # fmt: skip
    (one,) = summaries(points)
    assert [p and p["us_per_period"] for p in one.within] == [3.0, 1234.0, None]
    assert (one.name, one.best["error"], one.setup_s) == ("strang", 1e-10, 1234.0)


def test_stress_explains_the_marks_that_occur_and_what_failed():
    document = stress()
    bad = {**document["cases"][0], "method": "m", "outcome": "singular", "note": "stopped"}
    chance = {**bad, "method": "n", "untold": True, "digits_lost": None}
    document |= {
        "cases": [*document["cases"], bad, chance], "methods": {"auto": "A", "m": "M", "n": "N"},
        "rules": {"singular": "no numbers", "stalled": "vanished", "ok": "it held"},
        "skipped": [{"case": "x", "method": "y", "reason": "no time"}],
        "auto": {"run": True, "silently_wrong": ["z"]},
    }  # fmt: skip
    _, tables, notes = parts_of(document)
    assert [table.rows for table in tables.forms[0]] == [(("cusp", "0.5", "0.5 sing", "?"),)]
    assert [[t.rows[0][1:] for t in form] for form in tables.forms][-1] == [
        ("0.5",), ("0.5 sing",), ("?",)
    ]  # fmt: skip
    rows = dict(notes.rows)
    assert rows["sing singular"] == "no numbers"
    assert rows["?"].startswith("undetermined")
    assert rows["cusp"] == "singular: m, n: stopped"
    assert rows["skipped"] == "no time: x/y"
    assert rows["auto"] == "was silently wrong: z"
    assert len(rows) == 6


def test_an_atlas_shows_its_kinds_axes_and_boundaries():
    axis = {"name": "phidot", "low": 0.0, "high": 1.0, "count": 4, "log": True}
    document = {"schema": "heavytop/atlas/1", "counts": {"waves": 1, "loops": 3},
                "curves": [{"name": "cusps"}, {"name": "cusps"}, {"name": "through-top"}],
                "details": {"loops, slow": 2},
                "axes": {"x": axis}, "scene": {"top": {"A": 1.0}, "start": {"phidot": 3}},
                "uncertified": 0, "sent": 5}  # fmt: skip
    kinds, facts = parts_of(document)
    assert kinds.rows == (
        ("loops, slow", "2", "50.000%"), ("waves", "1", "25.000%"), ("loops", "1", "25.000%"),
    )  # fmt: skip
    rows = dict(facts.rows)
    assert rows["x"] == "phidot = 0 … 1 rad/s, 4 values, logarithmic"
    assert (rows["held"], rows["decided by intervals"]) == ("A = 1 kg m²", "5")
    assert rows["boundaries"] == "cusps (2 lines), through-top (1 line)"


def test_what_others_wrote_is_no_markup_at_a_terminal():
    document = validate()
    document["claims"][0] |= {"statement": "[red]x[/red] \\[bold]", "skipped": "[link=x]y"}
    shown = printed(rendered(document), 200)
    assert "[red]x[/red] \\[bold]" in shown
    assert "skipped: [link=x]y" in shown


@pytest.mark.parametrize(
    ("passed", "words"),
    [([True] * 82 + [None] * 3, "82 hold, none fails, 3 skipped"), ([False] * 2, "0 hold, 2 fail"),
     ([True, False], "1 holds, 1 fails")],
)  # fmt: skip
def test_claims_are_counted(passed, words):
    assert summary([{"passed": each} for each in passed]) == words


# --- values as texts ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("bound", "text"),
    [(1.41e-15, "1.5e-15"), (1.7e-15, "1.8e-15"), (0.5, "5.0e-01"), (9.91e-9, "1.0e-08")],
)
def test_a_bound_is_never_rounded_down(bound, text):
    """The double 1.7e-15 is above its decimals."""
    assert at_most(bound) == text


def test_what_is_given_is_shown_with_signs_and_units():
    assert given({"A": 0.000328, "C": "6.60e-5"}) == "A = 0.000328 kg m², C = 6.60e-5 kg m²"
    assert given({"theta": "pi/2", "phi": 0, "omega3": 140}) == "θ = pi/2 rad, ω₃ = 140 rad/s"
    assert given({"theta": 0}) == "all zero"
    assert (headed("phidot"), headed("digits_lost")) == ("φ̇ [rad/s]", "digits lost")


def test_every_axis_of_an_atlas_has_a_sign_and_a_unit():
    bare = {name: unit.replace(" s⁻¹", "/s") for name, (_, unit, _) in ROLES.items()}
    assert {name: SYMBOLS[name][1] for name in ROLES} == bare | {"gMR": "J"}


@pytest.mark.parametrize(("width", "form"), [(60, "wide"), (20, "mid"), (3, "narrow")])
def test_the_best_form_that_fits_is_shown(width, form):
    forms = {"wide": 50, "mid": 15, "narrow": 5}
    found = Fitting(tuple((Table((name,), (("x" * wide,),)),) for name, wide in forms.items()))
    assert printed(found, width).startswith(form[:width])
