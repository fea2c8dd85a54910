"""What a figure promises: the events where they are, text taken as text, the same bytes again."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from heavytop.files import as_json, write_whole
from heavytop.propagation import propagate
from heavytop.report.figures import View, axis_on_sphere, loop, nutation, overview, save
from heavytop.scene import load_scene


@pytest.fixture(scope="module")
def kicked():
    return propagate(load_scene("sicm-kicked"))


def lines(ax, label):
    return next(line for line in ax.lines if line.get_label() == label)


def test_loop_marks_every_turning_point_where_it_is(kicked):
    ax = Figure().subplots()
    loop(ax, kicked)
    events = kicked.events
    low = np.array([kind == "theta_max" for kind in events.kind])
    assert low.any()
    drawn = lines(ax, "turning point, axis lowest").get_xydata()
    np.testing.assert_array_equal(drawn, np.column_stack((events.phi, events.theta))[low])


def test_loop_stands_upright(kicked):
    ax = Figure().subplots()
    loop(ax, kicked)
    bottom, top = ax.get_ylim()
    assert top < bottom


def test_nutation_has_units(kicked):
    ax = Figure().subplots()
    nutation(ax, kicked)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("time t [s]", "tilt θ [rad]")


def test_sphere_marks_the_events_on_the_path(kicked):
    ax = Figure().subplots()
    axis_on_sphere(ax, kicked)
    drawn = lines(ax, "turning point, axis highest").get_xydata()
    assert len(drawn) == sum(kind == "theta_min" for kind in kicked.events.kind)
    assert np.hypot(*drawn.T).max() <= 1.0


@pytest.mark.parametrize("z", [0.9, 0.0, -0.9])
def test_every_view_is_a_right_handed_frame(z):
    axis = np.array([[np.sqrt(1 - z * z), 0.0, z], [-np.sqrt(1 - z * z), 0.0, z]])
    view = View.of(axis)
    np.testing.assert_allclose(np.cross(view.right, view.up), view.towards, atol=1e-15)
    seen, depth = view.project(axis)
    np.testing.assert_allclose(np.hypot(*seen.T) ** 2 + depth**2, 1.0, atol=1e-15)
    assert np.abs(seen).max() <= view.reach


def test_the_same_trajectory_gives_the_same_bytes(kicked, tmp_path):
    for name in ("one", "two"):
        for suffix in (".svg", ".png"):
            save(overview(kicked), tmp_path / f"{name}{suffix}")
    for suffix in (".svg", ".png"):
        one, two = ((tmp_path / f"{name}{suffix}").read_bytes() for name in ("one", "two"))
        assert one == two


@pytest.mark.parametrize("title", ["$\\frac{", "--><script>x</script>", "日本", "x" * 500])
def test_a_title_is_only_text(title, tmp_path):
    scene = load_scene("sicm-kicked", overrides=[f"title={title}"])
    save(overview(propagate(scene)), tmp_path / "figure.svg")
    assert "<script" not in (tmp_path / "figure.svg").read_text("utf-8")


def test_a_figure_is_svg_or_png(tmp_path):
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


def test_json_holds_no_nan():
    with pytest.raises(ValueError, match="JSON"):
        as_json({"period": float("nan")})
