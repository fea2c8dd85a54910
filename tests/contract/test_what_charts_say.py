"""What charts and files say of themselves: nothing is clipped, nothing is without words."""

import os
import subprocess
import sys

import h5netcdf
import numpy as np
import pytest
from matplotlib.text import Text
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.plots.atlas import atlas_figure
from heavytop.plots.studies import stress_figure

SCENE = ht.load_scene("sicm-kicked", ["span.time=1"])


def inside(figure, texts):
    """Hold texts to the picture."""
    figure.draw_without_rendering()
    frame = figure.bbox
    for text in texts:
        box = text.get_window_extent()
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1, text
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1, text


@pytest.mark.parametrize("methods", [("taylor-axis",), ("auto", "taylor-axis", "lsoda-scipy")])
def test_a_chart_of_few_cases_is_whole(methods):
    chart = stress_figure(ht.stress(cases=("kick-1e-9",), methods=methods).document())
    texts = [each for each in chart.findobj(Text) if each.get_text().strip()]
    inside(chart, texts)
    assert "digits lost beyond" in chart.axes[0].get_xlabel()


@pytest.fixture(scope="module")
def atlas():
    return ht.atlas(SCENE, "phidot=-20:20:9", "psidot=-150:150:9", jobs=1)


def test_an_atlas_says_what_is_held_and_where_its_scene_is(atlas):
    chart = atlas_figure(atlas)
    left = chart.subfigs[0]
    inside(chart, [each for each in left.texts if "held" in each.get_text()])
    title = left.get_suptitle()
    assert "held: A = 0.000328, C = 6.6e-05, gMR = 0.0456, $\\theta$ = 0.1" in title
    assert "loops" not in title
    [mark] = [line for line in left.axes[0].lines if line.get_marker() == "P"]
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (-15, 140)


def test_a_scene_beside_the_map_is_not_marked():
    aside = ht.atlas(SCENE, "p_phi=0.1:0.2:5", "E=1:2:5", jobs=1)
    constants = ht.Motion(SCENE.top, SCENE.start).constants
    assert aside.plane.place == (float(constants.p_phi), float(constants.E))
    lines = atlas_figure(aside).subfigs[0].axes[0].lines
    assert [line for line in lines if line.get_marker() == "P"] == []


@pytest.mark.parametrize("digits", [12, 20])
def test_every_variable_of_a_run_says_what_it_is(digits, tmp_path):
    scene = ht.load_scene("sicm-kicked", ["span.time=1", f"want.digits={digits}"])
    ht.propagate(scene).save(tmp_path / "run.nc")
    described(tmp_path / "run.nc")


@pytest.mark.parametrize(
    "words",
    [
        ("atlas", "--x", "phidot=-20:20:5", "--y", "psidot=-150:150:5", "--integrate", "-j", "1"),
        ("drift", "--methods", "taylor-axis", "--periods", "5"),
    ],
    ids=["atlas", "drift"],
)
def test_every_variable_of_a_study_says_what_it_is(words, tmp_path):
    verb, *options = words
    done = CliRunner().invoke(app, [verb, "sicm-kicked", *options, "-q", "-o", str(tmp_path)])
    assert done.exit_code in (0, 5), done.output
    described(tmp_path / f"{verb}.nc")


def described(path):
    with h5netcdf.File(path, "r") as file:
        lacking = [
            (name, word)
            for name, variable in file.variables.items()
            for word in ("long_name", "units")
            if not variable.attrs.get(word)
        ]
    assert lacking == []


@pytest.mark.parametrize(
    "name", ["sicm-kicked", "sicm-dropped", "lie-group-benchmark", "simo-wong"]
)
@pytest.mark.parametrize("formulation", ["axis", "attitude", "lagrange"])
@pytest.mark.filterwarnings("ignore")
def test_the_first_sample_is_the_start(name, formulation):
    scene = ht.load_scene(name, ["span.time=0.1"])
    trajectory = ht.propagate(scene, formulation=formulation)
    for quantity in ("theta", "phi", "psi", "thetadot", "phidot", "psidot"):
        start = float(getattr(scene.start, quantity))
        assert getattr(trajectory.samples, quantity)[0] == start
        assert getattr(trajectory(0.0), quantity) == start
    assert trajectory.to_xarray().theta.values[0] == float(scene.start.theta)


def test_at_a_pole_rates_are_the_limits_still():
    first = ht.propagate(ht.load_scene("through-top", ["span.time=0.1"])).samples
    assert first.theta[0] == 0
    assert first.phidot[0] == pytest.approx(14.0853658536585, rel=1e-12)
    assert np.isfinite(first.psidot[0])


BEFORE = "import heyoka as hy; hy.llvm_state.set_diskcache_limit(12345); "
LIMIT = (
    "import heavytop.integration.compiled, heyoka as hy; print(hy.llvm_state.get_diskcache_limit())"
)


@pytest.mark.parametrize(("before", "bytes_"), [("", 256 * 2**20), (BEFORE, 12345)])
def test_what_is_compiled_has_a_bound_unless_the_user_set_one(before, bytes_, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", before + LIMIT], capture_output=True, text=True, check=True,
        env=dict(os.environ, HEYOKA_CACHE_DIR=str(tmp_path)),
    )  # fmt: skip
    assert int(done.stdout) == bytes_
