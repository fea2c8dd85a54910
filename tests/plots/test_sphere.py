"""Views of the unit sphere: right-handed, circles of equal tilt, one colour for a kind."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from heavytop.plots.sphere import View


@pytest.mark.parametrize("z", [0.9, 0.0, -0.9])
def test_every_view_is_a_right_handed_frame_that_shows_its_path(z):
    axis = np.array([[0.0, np.sqrt(1 - z * z), z], [0.0, -np.sqrt(1 - z * z), z]])
    view = View.of(axis)
    np.testing.assert_allclose(np.cross(view.right, view.up), view.towards, atol=1e-15)
    seen, depth = view.project(axis)
    np.testing.assert_allclose(np.hypot(*seen.T) ** 2 + depth**2, 1.0, atol=1e-15)
    assert np.abs(seen).max() <= view.reach < 2 * (abs(z) or np.ptp(seen[:, 0]))


def test_what_runs_behind_the_sphere_is_paler():
    view = View.from_horizon(np.array([0.0, -1.0, 0.0]))
    ax = Figure().subplots()
    turn = np.linspace(0, 2 * np.pi, 101)
    view.draw_path(ax, np.column_stack((np.sin(turn), -np.cos(turn), 0 * turn)), "black")
    front, behind, start = ax.lines
    assert front.get_alpha() > behind.get_alpha()
    assert np.nanmax(front.get_ydata()) < 1e-9 < np.nanmax(behind.get_ydata())
    assert start.get_xydata()[0] == pytest.approx([0.0, -np.sin(np.radians(25))])
