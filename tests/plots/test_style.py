"""Saving a figure: text taken as text, whole or not at all."""

import pytest
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.text import Text

from heavytop.plots.style import literal, save

HOSTILE = ("$x$ and $\\frac{$", "costs 5$", "_gone", "two\nlines", "", "\\", "\\$", "x" * 5000)


def test_a_text_is_drawn_as_it_is():
    for text in HOSTILE:
        drawn, plain = Text(text=literal(text))._preprocess_math(literal(text))
        assert plain is False
        assert not is_math_text(literal(text))
        words = " ".join(text.split()) or "–"
        assert drawn.strip() == (words if len(words) <= 90 else words[:89] + "…")


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_a_figure_is_saved_by_the_name_of_a_file(suffix, tmp_path):
    for name in "ab":
        save(Figure(), str(tmp_path / f"{name}.{suffix}"))
    one, other = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in "ab")
    assert one == other != b""
    assert b"CreationDate" not in one  # which two of one second share
    with pytest.raises(ValueError, match=r"figure\.exe"):
        save(Figure(), tmp_path / "figure.exe")
