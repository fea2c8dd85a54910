"""The pictures of an atlas: kinds with their shares, what is held, and where the scene is."""

import numpy as np
import pytest
from matplotlib.colors import to_rgba

import heavytop as ht
from heavytop.plots.atlas import atlas_figure
from heavytop.plots.style import KIND_STYLES
from heavytop.scene.quantities import read_units, show_units

from .test_studies import legend

SCENE = ht.load_scene("sicm-kicked", ["span.time=1"])


def test_a_kind_has_its_colour_and_its_share_in_the_legend():
    atlas = ht.atlas(SCENE, "phidot=-20:20:41", "omega3=10:100:31:log", jobs=1, only="kind")
    figure = atlas_figure(atlas)
    shown = dict(zip(legend(figure), figure.legends[0].legend_handles, strict=True))
    own = shown[f"loops {atlas.counts['loops'] / (41 * 31):.2%}"]
    assert own.get_facecolor() == to_rgba(KIND_STYLES["loops"].colour)
    ax = figure.axes[0]  # the first and the last value are in the middle of their pixels
    assert (ax.get_xlim(), ax.get_yscale()) == ((-20.5, 20.5), "log")
    assert ax.get_ylim() == pytest.approx((10 ** (1 - 0.5 / 30), 10 ** (2 + 0.5 / 30)))


@pytest.fixture(scope="module")
def atlas():
    return ht.atlas(SCENE, "phidot=-20:20:9", "psidot=-150:150:9", jobs=1)


def test_an_atlas_says_what_is_held_and_where_its_scene_is(atlas):
    with show_units(read_units("rpm,g cm^2")):
        chart = atlas_figure(atlas)
    assert "A = 3280 g cm^2, C = 660 g cm^2, gMR = 0.0456 J, θ = 0.1 rad" in chart.get_suptitle()
    *curves, [mark] = (line.get_xydata() * np.pi / 30 for line in chart.axes[0].lines)
    assert np.vstack(curves).max(axis=0) == pytest.approx([20, 150], rel=0.01)
    assert (chart.axes[0].get_xlabel(), mark) == ("φ̇ [rpm]", pytest.approx([-15, 140]))


def test_a_line_has_no_share_and_is_once_in_the_legend(atlas):
    """Cusps are a column of pixels, at a kick of nothing, and a curve."""
    assert atlas.counts["cusps"] == 8
    words = legend(atlas_figure(atlas))
    assert [word for word in words if "cusps" in word] == ["cusps"]
    assert {word.split()[0] for word in words if "%" in word} == {"waves", "loops"}
