"""The charts of studies show what their documents hold."""

import heavytop as ht
from heavytop.plots.studies import stress_figure, workprec_figure
from heavytop.plots.theory import Cone, stability_figure
from heavytop.results.stress import MARKS, UNTOLD, Outcome, Run, Stress
from heavytop.studies.methods import stress_methods

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
