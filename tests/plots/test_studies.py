"""Charts of studies: nothing is clipped, and every method is named."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.text import Text

import heavytop as ht
from heavytop.plots.studies import drift_figure, stress_figure, workprec_figure
from heavytop.plots.style import literal
from heavytop.plots.theory import Cone, stability_figure
from heavytop.results.stress import MARKS, UNTOLD, Outcome, Run, Stress
from heavytop.studies.methods import stress_methods

from ..report.conftest import POINT, workprec

NAMES = ("$x$ and $\\frac{$", "costs 5$", "_gone", "two\nlines")


def legend(figure):
    return [text.get_text().strip() for each in figure.legends for text in each.get_texts()]


@pytest.mark.slow
@pytest.mark.parametrize("methods", [("taylor-axis",), ("auto", "taylor-axis", "lsoda-scipy")])
def test_a_chart_of_few_cases_is_whole(methods):
    chart = stress_figure(ht.stress(cases=("kick-1e-9",), methods=methods).document())
    chart.draw_without_rendering()
    frame = chart.bbox
    for text in (each for each in chart.findobj(Text) if each.get_text().strip()):
        box = text.get_window_extent()
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1, text
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1, text
    assert "digits lost beyond" in chart.axes[0].get_xlabel()


def test_a_failure_has_its_colour_and_its_mark_where_it_belongs():
    run = {"digits_lost": 0.0, "outcome": "ok", "untold": False}
    runs = [run | {"case": "a", "method": "m"},
            run | {"case": "b", "method": "m", "digits_lost": 9.0, "outcome": "singular"},
            run | {"case": "b", "method": "n", "digits_lost": None, "untold": True}]  # fmt: skip
    document = {"cases": runs, "hard": {"a": "", "none": "", "b": ""},
                "methods": {"m": "M", "unused": "U", "n": "N"}}  # fmt: skip
    ax = stress_figure(document).axes[0]
    np.testing.assert_array_equal(
        ax.images[0].get_array().filled(np.nan), [[0, np.nan], [9, np.nan]]
    )
    marks = {text.get_text(): (*text.get_position(), text.get_color()) for text in ax.texts}
    assert marks == {"sing": (0, 1, "white"), "?": (1, 1, "black")}
    assert [each.get_text() for each in ax.get_yticklabels()] == ["a", "b"]


def test_every_method_of_a_drift_study_is_in_the_legend_and_no_two_look_alike():
    method = {"periods": [1.0, 10.0], "energy": [1e-12, 0.0], "phase_s": [None, 1e-9], "axis": [],
              "p_phi": [], "p_psi": [], "invariants": {"length": [1e-15, 1e-14]}}  # fmt: skip
    names = [*NAMES, *map(str, range(20))]
    known = {"scene": {"title": "t", "name": "n"}, "periods": 10, "ensemble": 3,
             "methods": [method | {"name": name} for name in names]}  # fmt: skip
    figure = drift_figure(known)
    assert legend(figure) == [literal(name).strip() for name in names]
    panels = [ax for ax in figure.axes if ax.get_visible()]
    assert len(panels) == 3
    drawn = [line for line in panels[0].lines if line.get_marker() != "None"]
    looks = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in drawn}
    assert len(looks) == len(names)
    assert drawn[0].get_xydata().tolist() == [[1.0, 1e-12]]  # no zero, which a logarithm lacks


def test_guides_of_growth_have_their_slopes():
    periods = [1.0, 10.0, 100.0]
    method = {"name": "m", "periods": periods, "energy": [1e-12, 1e-10, 1e-4], "phase_s": [],
              "axis": [], "p_phi": [], "p_psi": [], "invariants": {}}  # fmt: skip
    known = {"scene": {"title": "t", "name": "n"}, "periods": 100, "ensemble": 1,
             "methods": [method]}  # fmt: skip
    _, *guides = drift_figure(known).axes[0].lines
    slopes = [
        np.diff(np.log(line.get_ydata())) / np.diff(np.log(line.get_xdata())) for line in guides
    ]
    assert np.ravel(slopes) == pytest.approx([0.5, 1.0, 1.5, 2.0])


def test_work_and_precision_has_a_panel_for_each_error_and_for_more_bits():
    document = workprec(ht.load_scene("sicm-kicked").document())
    document["points"] = [POINT | {"method": name} for name in NAMES] + document["points"]
    document["points"] += [POINT | {"method": "more", "bits": 113, "measures": "theta"}]
    document["front"], document["front_theta"] = [4, 5], [4]
    figure = workprec_figure(document)
    assert set(legend(figure)) == {"front", "auto", "strang", "more"} | {
        literal(name).strip() for name in NAMES
    }
    above, theta, below, more = figure.axes
    assert (above.get_xlabel(), theta.get_xlabel()) == ("error of the axis", "error of θ [rad]")
    [star] = [
        line for line in above.lines if line.get_marker() == "*" and line.get_markersize() > 9
    ]
    assert star.get_xydata().tolist() == [[1e-12, 9.0]]
    assert len(below.lines) == 1  # an empty front: the method with more bits gives only θ
    assert [line.get_xydata().tolist() for line in more.lines[1:]] == [[[1e-7, 9.0]]]
    assert above.get_xlim()[0] > above.get_xlim()[1]
    document["points"], document["front"] = [POINT | {"measures": "theta"}], [0]
    document["front_theta"] = [0]
    [alone] = workprec_figure(document).axes  # no method gives the axis
    assert alone.get_xlabel() == "error of θ [rad]"


FEW = ("auto", "taylor-axis=1e-9", "taylor-axis", "taylor-cubic=1e-6", "taylor-cubic-longdouble",
       "strang=50", "kahan-li8=32")  # fmt: skip


def test_the_chart_of_stress_has_the_marks_of_the_table():
    methods = [stress_methods()[f"{name}"] for name in ("auto", "taylor-axis", "taylor-cubic")]
    outcomes = ({"outcome": Outcome.OK}, {"outcome": Outcome.STALLED},
                {"outcome": Outcome.OK, "digits_lost": 0.0, "untold": True})  # fmt: skip
    runs = [
        Run(case="cusp", method=each.name, formulation=each.formulation, **outcome)
        for each, outcome in zip(methods, outcomes, strict=True)
    ]
    shown = {each.name: f"{each.short} {each.set_to}".rstrip() for each in methods}
    found = Stress(hard={"cusp": "why"}, methods=shown, cases=tuple(runs), skipped=(),
                   limits={"budget_s": 1.0, "time_s": 1.0, "steps": 1})  # fmt: skip
    figure = stress_figure(found.document())
    assert [text.get_text() for text in figure.axes[0].texts] == [MARKS["stalled"], UNTOLD]
    said = figure.axes[0].get_xlabel()
    assert all(f"{mark} {word}" in said.replace("\n", " ") for word, mark in MARKS.items())
    heads = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert heads == ["auto", "axis 2.2e-16", "cubic 2.2e-16"]


def test_the_chart_of_stability_reads_moduli_and_runs():
    def labels(*cones):
        line = [(0.1, 0.9), (1.0, 0.0)]
        return stability_figure(cones, line, line, line).axes[0].get_legend_handles_labels()[1]

    good, bad = Cone(1.2, 0.5, False, 1e-15, 1e-6), Cone(0.9, 1.4, True, 1e-3, 1.0)
    assert "slow: multipliers on the circle" in labels(good)
    assert not {"multipliers off the circle", "pushed runs that leave it"} & set(labels(good))
    assert {"multipliers off the circle", "pushed runs that leave it"} <= set(labels(good, bad))
    assert "fast: multipliers on the circle" not in labels(good, bad)


def test_every_method_stands_in_the_chart_of_work_and_so_does_the_front():
    found = ht.work_precision(ht.load_scene("sicm-kicked"), methods=FEW, periods=5, budget=60)
    document = found.document()
    left, right, _, more = workprec_figure(document).axes  # doubles above, more bits below
    shown = [{line.get_label(): line for line in ax.lines} for ax in (left, right, more)]
    precise = {"taylor-cubic-longdouble"}
    names = {point["method"] for point in document["points"]} - precise
    assert set(shown[2]) == precise | {"front"}
    assert set(shown[1]) == names | {"front"}
    assert set(shown[0]) == (names | {"front"}) - {"taylor-cubic"}
    for name, lines, error in (
        ("front", shown[0], "error"),
        ("front_theta", shown[1], "theta_error"),
    ):
        front = [p for i in document[name] if (p := document["points"][i])["bits"] == 53]
        assert lines["front"].get_xdata().tolist() == [p[error] for p in front]
        assert lines["front"].get_ydata().tolist() == [p["us_per_period"] for p in front]
    for name in names - {"auto"}:
        points = [p for p in document["points"] if p["method"] == name]
        assert shown[1][name].get_xdata().tolist() == [p["theta_error"] for p in points]
    for lines, wants, error in ((shown[0], "axis", "error"), (shown[1], "theta", "theta_error")):
        chosen = [p for p in document["points"] if p.get("wants") == wants]
        assert lines["auto"].get_xdata().tolist() == [p[error] for p in chosen]
    assert left.get_xscale() == left.get_yscale() == "log"
    told = {text.get_text() for ax in (left, right) for text in ax.texts}
    assert told == {"auto: 6, 9, 12 digits"}
    colour = {name: shown[1][name].get_color() for name in names - {"auto"}}
    assert colour["taylor-cubic"] == shown[2]["taylor-cubic-longdouble"].get_color()
    assert len({colour[name] for name in ("taylor-cubic", "taylor-axis", "strang")}) == 3
