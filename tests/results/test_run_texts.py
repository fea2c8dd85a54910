"""What a run and a classification say: numbers with their digits and units, at any width."""

import re

import pytest

from heavytop.results.run import event_table
from heavytop.results.table import Row
from heavytop.scene.quantities import MISSING

from ..commands import printed


@pytest.fixture(scope="module")
def two_periods():
    return printed("run", "sicm-kicked", "--set", "span.periods=2")


def test_errors_of_a_run_have_units(two_periods):
    words = " ".join(two_periods.split("closed form: ")[1].split("cost")[0].split())
    named = re.findall(r"([a-z ]+) [\d.e+-]+( rad| s|)(?:, |$)", words)
    assert {name.strip(): unit.strip() for name, unit in named} == {
        "theta": "rad", "phi": "rad", "psi": "rad", "axis": "", "energy": "",
        "event time": "s", "input rounding": "rad",
    }  # fmt: skip


def test_a_run_through_a_pole_says_that_phi_jumps(two_periods):
    jump = "φ jumps by π: the value before or after it is given"
    assert jump not in two_periods
    assert jump in printed("run", "through-top", "--set", "span.time=1")


def test_events_have_all_digits_and_where_it_is_narrow_fewer():
    row = {"kind": "cusp", "t": 1 / 3, "theta": 0.1, "phi": None, "phidot": 1e-17, "residual": 0}
    rows = Row(table=[Row(row), Row(row, phidot=5.0)], omitted=7)
    table = event_table(rows)
    assert table.texts()[0] == ["cusp", "0.333333333333", "0.1", MISSING, "0", "0"]
    assert table.texts(3)[0][1] == "0.333"
    assert (table.more, table.head[1]) == (7, "t [s]")
