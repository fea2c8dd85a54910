"""Charts of studies: nothing is clipped, and every method is named."""

import numpy as np
import pytest

from heavytop.plots.studies import drift_figure, stress_figure, workprec_figure
from heavytop.plots.style import literal
from heavytop.results.stress import StressOutcome
from heavytop.results.table import Row

from ..results.made import AUTO, METHOD, POINT, RUN, diagram_of, drift_of, stress_of

NAMES = ("$x$ and $\\frac{$", "costs 5$", "_gone", "two\nlines")


def legend(figure):
    return [text.get_text().strip() for each in figure.legends for text in each.get_texts()]


def test_a_failure_has_its_colour_and_its_mark_where_it_belongs():
    runs = [Row(RUN, case="a", method="m", digits_lost=0.0),
            Row(RUN, case="b", method="m", digits_lost=9.0, outcome="singular"),
            Row(RUN, case="b", method="n", digits_lost=None, untold=True)]  # fmt: skip
    ax = stress_figure(stress_of(*runs, hard={"a": "", "none": "", "b": ""})).axes[0]
    lost = ax.images[0].get_array().filled(np.nan)
    np.testing.assert_array_equal(lost, [[0, np.nan], [9, np.nan]])
    marks = {text.get_text(): (*text.get_position(), text.get_color()) for text in ax.texts}
    assert marks == {"sing": (0, 1, "white"), "?": (1, 1, "black")}
    names = [[x.get_text() for x in axis.get_ticklabels()] for axis in (ax.yaxis, ax.xaxis)]
    assert names == [["a", "b"], ["M 1e-9", "N"]]
    said = ax.get_xlabel().replace("\n", " ")
    assert all(f"{word.mark} {word}" in said for word in StressOutcome if word.mark)


ONE = Row(METHOD, energy=[1e-12, 0.0], axis=[], invariants={NAMES[0]: [1e-15, 1e-14]})


def test_every_method_of_a_drift_study_is_in_the_legend_and_no_two_look_alike():
    names = [*NAMES, *map(str, range(20))]
    figure = drift_figure(drift_of(*(Row(ONE, name=name) for name in names)))
    assert legend(figure) == [literal(name).strip() for name in names]
    panels = [ax for ax in figure.axes if ax.get_visible()]
    assert len(panels) == 3
    drawn = [line for line in panels[0].lines if line.get_marker() != "None"]
    looks = {(line.get_color(), line.get_marker(), line.get_linestyle()) for line in drawn}
    assert len(looks) == len(names)
    assert drawn[0].get_xydata().tolist() == [[1.0, 1e-12]]  # no zero, which a logarithm lacks


def test_guides_of_growth_have_their_slopes():
    _, *guides = drift_figure(drift_of(Row(ONE, energy=[1e-12, 1e-4]))).axes[0].lines
    for line, slope in zip(guides, (0.5, 1.0, 1.5, 2.0), strict=True):
        across, up = np.diff(np.log(line.get_xydata()), axis=0).T
        assert up / across == pytest.approx(slope)


def test_work_and_precision_has_a_panel_for_each_error_and_work_and_for_more_bits():
    cubic = Row(POINT, method="taylor-cubic", formulation="cubic", measures="theta", rival=False)
    faster = Row(cubic, phase_error=1e-13, us_per_period=20.0)
    longer = Row(cubic, method="taylor-cubic-mpfr", bits=128)
    counted = Row(POINT, method="gauss8", rhs_evaluations=990, error=1e-3)
    doubles = POINT, Row(AUTO, error=1e-12), cubic, faster, Row(POINT, method="a.py:rk4"), counted
    figure = workprec_figure(diagram_of(*doubles, longer))
    panels = np.reshape(figure.axes, (3, 3))
    names = {"strang", "auto", "taylor-cubic", "taylor-cubic-mpfr", "a.py:rk4", "gauss8"}
    assert set(legend(figure)) == {"front"} | names
    labels = ["error of axis", "error of phase [s]", "error of energy"]
    assert [ax.get_xlabel() for ax in panels[0]] == labels
    assert panels[0, 0].xaxis_inverted()

    def drawn(row, column, name):
        shown = {line.get_label(): line for line in panels[row, column].lines}
        return shown[name].get_xydata().tolist() if name in shown else None

    assert drawn(0, 0, "auto") == drawn(0, 0, "front") == [[1e-12, 9.0]]
    assert drawn(0, 1, "taylor-cubic") == drawn(0, 1, "front") == [[1e-9, 9.0], [1e-13, 20.0]]
    assert drawn(2, 1, "taylor-cubic-mpfr") == [[1e-9, 9.0]]
    assert drawn(0, 0, "taylor-cubic") is None  # it does not give the axis
    assert drawn(1, 0, "gauss8") == [[1e-3, 10.0]]
    assert drawn(1, 0, "strang") is None  # its evaluations are not counted
    alone = workprec_figure(diagram_of(Row(POINT, measures="theta"))).axes  # none gives the axis
    assert alone[0].get_xlabel() == "error of θ [rad]"
