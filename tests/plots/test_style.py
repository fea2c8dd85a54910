"""Saving a figure: the same bytes again, text taken as text, whole or not at all."""

from __future__ import annotations

import matplotlib as mpl
import pytest
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text

from heavytop.files import write_whole
from heavytop.plots.figures import FIGURES
from heavytop.plots.style import STYLE, legend, literal, save, svg
from heavytop.run.propagation import propagate
from heavytop.scene.scene import load_scene

HOSTILE = ("$x$ and $\\frac{$", "costs 5$", "_gone", "two\nlines", "", "\\", "\\$", "x" * 5000)


@pytest.mark.slow
def test_the_same_trajectory_gives_the_same_bytes(tmp_path):
    run = propagate(load_scene("sicm-kicked"))
    for name, draw in FIGURES.items():
        for suffix in ("svg", "png"):
            one, two = (tmp_path / f"{copy}.{suffix}" for copy in ("one", "two"))
            save(draw(run), one)
            save(draw(run), two)
            assert one.read_bytes() == two.read_bytes(), name


def test_a_title_is_only_text():
    title = "--><script>x</script> $\\frac{ 日本"
    run = propagate(load_scene("sicm-kicked", overrides=[f"title={title}", "span.time=0.1"]))
    assert "<script" not in svg(FIGURES["phase"](run))


def test_a_text_is_drawn_as_it_is():
    for text in HOSTILE:
        drawn, plain = Text(text=literal(text))._preprocess_math(literal(text))
        assert plain is False
        assert not is_math_text(literal(text))
        words = " ".join(text.split()) or "–"
        assert drawn.strip() == (words if len(words) <= 90 else words[:89] + "…")


def test_a_legend_names_once_what_stands_in_any_panel_in_the_order_that_is_given():
    figure = Figure()
    one, two = figure.subplots(2)
    one.plot([0, 1], label="a")
    for label in ("a", "b", literal("_gone")):
        two.plot([0, 1], label=label)
    legend(figure)
    legend(figure, order=["b", "absent", "a"])
    words = [[text.get_text().strip() for text in each.get_texts()] for each in figure.legends]
    assert words == [["a", "b", "_gone"], ["b", "a"]]


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_a_figure_is_saved_by_the_name_of_a_file(suffix, tmp_path):
    for name in "ab":
        save(Figure(), str(tmp_path / f"{name}.{suffix}"))
    one, other = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in "ab")
    assert one == other != b""
    assert b"CreationDate" not in one  # which two of one second share
    with pytest.raises(ValueError, match=r"figure\.exe"):
        save(Figure(), tmp_path / "figure.exe")


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "result"
    path.write_text("old")

    def half(part):
        part.write_text("ha")
        raise OSError("full")

    with pytest.raises(OSError, match="full"):
        write_whole(path, half)
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("result", "old")]


def test_a_layout_that_differs_in_its_last_digits_gives_the_same_bytes(tmp_path, monkeypatch):
    # matplotlib's solver finds one or another last digit, by where its variables lie in memory.
    settle = ConstrainedLayoutEngine.execute
    shift = [0.0]

    def shifted(engine, fig):
        settle(engine, fig)
        for ax in fig.axes:
            taking_part = ax.get_in_layout()
            x, y, width, height = ax.get_position(original=True).bounds
            ax.set_position((x + shift[0], y - shift[0], width, height))
            ax.set_in_layout(taking_part)

    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", shifted)
    for name, shift[0] in (("a.svg", 0.0), ("b.svg", 3e-16)):
        with mpl.rc_context(STYLE):
            figure = Figure(layout="constrained")
            for ax in figure.subplots(2, 2).flat:
                ax.plot([0.0, 1.0])
        save(figure, tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
