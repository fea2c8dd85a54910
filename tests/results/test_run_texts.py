"""What a run and a classification say: numbers with their digits and units, at any width."""

import re

import pytest
from click.testing import CliRunner

from heavytop.cli import app
from heavytop.results.run import event_table
from heavytop.results.table import Row
from heavytop.scene.quantities import MISSING


def printed(*words):
    found = CliRunner().invoke(app, [str(word) for word in words])
    assert found.exit_code == 0, found.output
    return found.stdout


def line(text, start):
    return next(line for line in text.splitlines() if line.startswith(start))


@pytest.fixture(scope="module")
def two_periods():
    return printed("run", "sicm-kicked", "--set", "span.periods=2")


def test_numbers_of_a_run_have_units_and_digits(two_periods):
    headings = re.split(r"\s{2,}", line(two_periods, "event  ").strip())
    assert headings == ["event", "t [s]", "θ [rad]", "φ [rad]", "φ̇ [rad/s]", "residual [rad/s]"]
    words = " ".join(two_periods.split("closed form: ")[1].split("cost")[0].split())
    named = re.findall(r"([a-z ]+) [\d.e+-]+( rad| s|)(?:, |$)", words)
    assert {name.strip(): unit.strip() for name, unit in named} == {
        "theta": "rad", "phi": "rad", "psi": "rad", "axis": "", "energy": "",
        "event time": "s", "input rounding": "rad",
    }  # fmt: skip
    shown = line(two_periods, "t  ").split()[1]
    assert shown == f"{2 * 0.542895518188230:.12g}"
    assert "loops, proved" in line(two_periods, "kind")
    assert "0.1 and 0.517231318238 rad (5.73° to 29.64°)" in line(two_periods, "θ between")
    assert line(two_periods, "events").split()[1:3] == ["5", "turning,"]
    costs = r"cost +\d+ steps, derive .* ms, compile .* ms, integrate .* ms, .* µs a period"
    assert re.search(costs, two_periods)


def test_a_run_through_a_pole_says_which_way_phi_is_counted_and_a_plan_what_is_expected(
    two_periods,
):
    assert "jumps by π: the value" not in two_periods
    text = printed("run", "through-top", "--set", "span.time=1")
    assert "φ jumps by π: the value before or after it is given" in text
    text = printed("plan", "sicm-kicked")
    assert re.search(r"expected +[\d.e-]+ \w+ of steps", text)


def test_events_have_all_digits_and_where_it_is_narrow_fewer():
    row = {"kind": "cusp", "t": 1 / 3, "theta": 0.1, "phi": None, "phidot": 1e-17, "residual": 0}
    rows = Row(table=[Row(row), Row(row, phidot=5.0)], omitted=7)
    table = event_table(rows)
    assert table.texts()[0] == ["cusp", "0.333333333333", "0.1", MISSING, "0", "0"]
    assert table.texts(3)[0][1] == "0.333"
    assert (table.more, table.head[1]) == (7, "t [s]")
