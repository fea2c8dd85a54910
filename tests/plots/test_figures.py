"""Figures of runs: what is no run is not drawn, and a file has the form of its name."""

import pytest
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.plots.figures import FIGURES, effective_potential, phase_plane, save

SCENE = ht.load_scene("sicm-kicked")


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_a_figure_is_saved_by_the_name_of_a_file(suffix, tmp_path):
    for name in "ab":
        save(Figure(), str(tmp_path / f"{name}.{suffix}"))
    one, other = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in "ab")
    assert one == other != b""
    assert b"CreationDate" not in one  # which two of one second share


@pytest.mark.parametrize("draw", [effective_potential, phase_plane])
def test_what_is_no_run_is_not_drawn(draw):
    motion = ht.Motion(SCENE.top, SCENE.start)
    with pytest.raises(ht.WrongType, match=r"trajectory: a Trajectory .*, not a Motion"):
        draw(Figure().subplots(), motion)
    for page in FIGURES.values():
        with pytest.raises(ht.WrongType, match="trajectory: a Trajectory"):
            page(motion)


def test_the_dot_at_the_start_is_not_hidden_by_a_mark():
    for ax in FIGURES["overview"](ht.propagate(SCENE)).axes:
        [dot] = [line for line in ax.lines if line.get_markersize() == 3]
        marks = [line for line in ax.lines if line.get_label().startswith("turning point")]
        assert all(dot.get_zorder() > mark.get_zorder() for mark in marks)
        assert marks
