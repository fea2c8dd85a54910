"""Views of the unit sphere: right-handed, circles of equal tilt, one colour for a kind."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from heavytop.plots.sphere import View

VIEWS = [
    View.from_pole(1.0, 0.3),
    View.from_pole(-1.0, 0.9),
    View.from_horizon(np.array([0.8, -0.6, 0.0])),
    View.from_horizon(np.array([0.0, 1.0, -0.9])),
]


@pytest.mark.parametrize("z", [0.9, 0.0, -0.9])
def test_every_view_is_a_right_handed_frame_that_shows_its_path(z):
    axis = np.array([[np.sqrt(1 - z * z), 0.0, z], [-np.sqrt(1 - z * z), 0.0, z]])
    view = View.of(axis)
    np.testing.assert_allclose(np.cross(view.right, view.up), view.towards, atol=1e-15)
    seen, depth = view.project(axis)
    np.testing.assert_allclose(np.hypot(*seen.T) ** 2 + depth**2, 1.0, atol=1e-15)
    assert np.abs(seen).max() <= view.reach


@pytest.mark.parametrize("view", VIEWS)
def test_circles_of_equal_tilt_are_where_they_can_be_seen(view):
    """Put back onto the near side of the sphere, each is at one height, a multiple of the spacing;
    and each that has a near side is drawn.
    """
    ax = Figure().subplots()
    view.draw_graticule(ax)
    heights = []
    *circles, pole = ax.lines
    for circle in circles:
        x, y = circle.get_xydata()[np.isfinite(circle.get_xdata())].T
        depth = np.sqrt(np.maximum(0.0, 1 - x**2 - y**2))
        z = x * view.right[2] + y * view.up[2] + depth * view.towards[2]
        assert np.ptp(z) < 1e-6
        heights.append(z[len(z) // 2])
    tilts = np.degrees(np.arccos(heights))
    assert np.allclose(tilts, view.spacing * np.round(tilts / view.spacing), atol=1e-5)
    side = np.sign(view.towards[2])
    from_above = np.degrees(np.arcsin(min(view.reach, 1)))
    lowest = from_above if abs(view.towards[2]) == 1 else 155  # as far as is seen from 25 degrees
    from_pole = tilts if side > 0 else 180 - tilts
    inside = from_pole[from_pole < lowest - 0.1]  # the outline may be drawn twice
    assert sorted(np.round(inside)) == list(np.arange(view.spacing, lowest, view.spacing))
    words = {text.get_text(): text.get_position()[1] for text in ax.texts}
    assert words
    assert words.keys() <= {f"{tilt:.0f}°" for tilt in tilts}
    for circle, tilt in zip(circles, tilts, strict=True):  # words stand on their circles
        if (height := words.get(f"{tilt:.0f}°")) is not None:
            assert np.nanmin(np.hypot(circle.get_xdata(), circle.get_ydata() - height)) < 0.04
    assert pole.get_xydata()[0].tolist() == [0.0, pytest.approx(side * view.up[2])]


def test_what_runs_behind_the_sphere_is_paler():
    view = View.from_horizon(np.array([0.0, -1.0, 0.0]))
    ax = Figure().subplots()
    turn = np.linspace(0, 2 * np.pi, 101)
    view.draw_path(ax, np.column_stack((np.sin(turn), -np.cos(turn), 0 * turn)), "black")
    front, behind, start = ax.lines
    assert front.get_alpha() > behind.get_alpha()
    assert np.nanmax(front.get_ydata()) < 1e-9 < np.nanmax(behind.get_ydata())
    assert start.get_xydata()[0] == pytest.approx([0.0, -np.sin(np.radians(25))])
