"""Figures are the same bytes wherever they are drawn."""

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from heavytop.plots.style import STYLE, save


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
