"""Sweep: rows are the motions of the scene, in the units that were asked for."""

import csv
import io
import math

import pytest

import heavytop as ht
from heavytop.scene.quantities import read_units, showing
from heavytop.scene.scene import read_scene

DROPPED = ht.load_scene("sicm-dropped")
FACTS = ["round", "theta_max", "round_estimate", "ratio"]


def test_rows_are_the_facts_of_each_motion_with_the_formula_beside():
    found = ht.sweep(DROPPED, "start.psidot=100:400:4", FACTS)
    assert [row["start.psidot"] for row in found.rows] == [100, 200, 300, 400]
    for row in found.rows:
        motion = ht.Motion(DROPPED.top, ht.State("0.1", psidot=row["start.psidot"]))
        assert row["kind"] == motion.kind
        assert (row["round"], row["theta_max"]) == (motion.round, motion.theta_max)
        p = 6.6e-5 * row["start.psidot"]
        by_formula = [2 * math.pi * p / 0.0456, p**2 / (4 * 3.28e-4 * 0.0456)]
        assert [row["round_estimate"], row["ratio"]] == pytest.approx(by_formula, rel=1e-14)
    assert found.document()["over"] == "start.psidot"


def test_csv_and_charts_are_in_the_units_asked_for():
    found = ht.sweep(DROPPED, "start.psidot=100:400:3", FACTS)
    units = read_units("deg, rpm,ms")
    assert found.to_csv().startswith("start.psidot [rad/s],kind,round [s]")
    with showing(units):
        header, *rows = csv.reader(io.StringIO(found.to_csv()))
        assert header == ["start.psidot [rpm]", "kind", "round [ms]", "theta_max [deg]",
                          "round_estimate [ms]", "ratio"]  # fmt: skip
        row, values = found.rows[0], [float(x) for x in (rows[0][0], *rows[0][2:4])]
        wanted = [100 * 30 / math.pi, 1000 * row["round"], math.degrees(row["theta_max"])]
        assert values == pytest.approx(wanted, rel=1e-15)
        axes = found.figure().axes
        assert [ax.get_ylabel() for ax in axes] == ["[ms]", "[deg]", "[1]"]
        assert axes[0].lines[0].get_xdata()[0] == pytest.approx(wanted[0], rel=1e-15)


def test_where_there_is_no_scene_a_row_says_so():
    steady = read_scene("format = 1\n[top]\nA = 1\nC = 1\ngMR = 1\n[start]\n"
                        'theta = 0.5\nsteady = "slow"\nomega3 = 9\n')  # fmt: skip
    slow, fast = ht.sweep(steady, "start.omega3=0.5:5:2", ["round"]).rows
    assert (slow["kind"], slow["round"]) == (None, None)
    assert fast["kind"] == "uniform-precession"
