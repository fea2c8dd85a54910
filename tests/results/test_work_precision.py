"""A diagram names the cheapest, the next of the other side, and what was left out."""

from heavytop.results.table import Row
from heavytop.results.work_precision import summaries

from .made import AUTO, POINT, diagram_of


def cells(table):
    return [dict(zip(table.columns, row, strict=True)) for row in table.texts()]


def test_it_names_the_cheapest_the_next_and_what_was_left_out():
    ours = Row(AUTO, us_per_period=3.0)
    left = [{"method": "gauss8", "reason": "no time", "setting": {"tolerance": 1e-9}}] * 2
    found = diagram_of(POINT, ours, skipped=left)
    _, front, leaders = found.tables()
    assert [row["method"] for row in cells(front)] == ["auto"]
    wanted = {"to": "1e-6", "method": "auto", "next": "strang", "ratio": "3"}
    assert wanted.items() <= cells(leaders)[0].items()
    assert dict(found.facts())["left out"] == "no time: gauss8 (2)"
    assert [*found.problems()] == []
    names = ["axis", "theta", "phase", "energy"]
    assert [*found.charts()] == [*names, *(f"{name}-evaluations" for name in names)]
    assert [*diagram_of(Row(POINT, measures="theta")).charts()][:2] == ["theta", "phase"]
    assert [code for code, _ in diagram_of(skipped=left).problems()] == [4]


def test_a_method_is_summed_up_by_its_cheapest_and_its_best():
    best = ((1e-7, 4.0), (1e-6, 3.0), (1e-10, 1234.0))
    points = [Row(POINT, error=error, us_per_period=us, setup_s=us) for error, us in best]
    [one] = summaries(points)
    assert [one[target] for target in ("1e-6", "1e-9", "1e-12")] == [3.0, 1234.0, None]
    assert (one["method"], one["error"], one["setup_s"]) == ("strang", 1e-10, 1234.0)
    [row] = cells(next(diagram_of(*points).tables()))
    assert (row["1e-9"], row["error"], row["of"]) == ("1230", "1.0e-10", "axis")
