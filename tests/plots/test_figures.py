"""The figures of a run: events where they are, the curves of the book, every motion drawn."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.analytic.motion import Motion
from heavytop.plots.figures import (
    FIGURES,
    axis_on_sphere,
    effective_potential,
    errors,
    loop,
    nutation,
    overview,
    phase_plane,
    precession,
    save,
    spin_rate,
)
from heavytop.run.propagation import propagate
from heavytop.run.verify import run_errors
from heavytop.scene.scene import load_scene, shipped_scenes


@pytest.fixture(scope="module")
def kicked():
    return propagate(load_scene("sicm-kicked"))


def lines(ax, label):
    return next(line for line in ax.lines if line.get_label().startswith(label))


def drawn(draw, trajectory):
    ax = Figure().subplots()
    draw(ax, trajectory)
    return ax


def changed(*overrides):
    return propagate(load_scene("sicm-kicked", overrides=overrides))


AT_POLE = ("start.theta=0", "start.phidot=0")


STILL = {
    "sleeping": AT_POLE,
    "sleeping, unstable": (*AT_POLE, "start.psidot=60"),
    "hanging": ("start.theta=pi", "start.phidot=0"),
    "at rest": ("top.gMR=0", "start.phidot=0", "start.psidot=0"),
}


OVER = (*AT_POLE, "start.thetadot=3", "start.psidot=60")


DEGENERATE = STILL | {
    "swinging": ("start.theta=2", "start.phidot=0", "start.psidot=0"),
    "over an unstable top": OVER,
    "inverted": ("top.gMR=-0.0456", "start.theta=2"),
    "backwards": ("span.time=-2",),
    "theta alone": ('want.quantities=["theta"]',),
    "no events": ("want.events=[]",),
    "two samples": ("want.samples=2",),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", DEGENERATE)
def test_every_motion_can_be_drawn(name, tmp_path):
    run = changed(*DEGENERATE[name])
    for figure, draw in FIGURES.items():
        save(draw(run), tmp_path / f"{figure}.svg")
        assert "nan" not in (tmp_path / f"{figure}.svg").read_text("utf-8").lower()


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_scenes())
def test_every_shipped_scene_can_be_drawn(name, tmp_path):
    run = propagate(load_scene(name))
    for figure, draw in FIGURES.items():
        save(draw(run), tmp_path / f"{figure}.svg")
        assert (tmp_path / f"{figure}.svg").stat().st_size > 5_000


def test_loop_marks_every_turning_point_where_it_is_and_stands_upright(kicked):
    ax = drawn(loop, kicked)
    events = kicked.events
    low = np.array([kind == "theta_max" for kind in events.kind])
    assert low.any()
    marks = lines(ax, "turning point, axis lowest").get_xydata()
    np.testing.assert_array_equal(marks, np.column_stack((events.phi, events.theta))[low])
    bottom, top = ax.get_ylim()
    assert top < bottom


def test_an_event_at_the_end_has_its_mark():
    run = propagate(load_scene("sicm-dropped", overrides=["span.periods=7"]))
    for ax in overview(run).axes:
        assert len(lines(ax, "cusp").get_xdata()) == run.events.count("cusp")


def test_a_long_run_is_drawn_for_twelve_nutations_and_says_so(kicked):
    ax = drawn(nutation, changed("span.time=60"))
    period = Motion(kicked.scene.top, kicked.scene.start).period
    last = lines(ax, "turning point, axis lowest").get_xdata()[-1]
    assert ax.lines[0].get_xdata()[-1] == pytest.approx(12.5 * period)
    assert last == pytest.approx(12.5 * period)
    assert ax.get_title() == f"the first {12.5 * period:.4g} s of 60 s"


def test_angles_have_degrees_on_the_other_side(kicked):
    for draw, sides in ((loop, "yx"), (nutation, "y"), (effective_potential, "x")):
        ax = drawn(draw, kicked)
        ax.figure.draw_without_rendering()
        assert len(ax.child_axes) == len(sides)
        for side, other in zip(sides, ax.child_axes, strict=True):
            ends = (getattr(each, f"get_{side}lim")() for each in (ax, other))
            np.testing.assert_allclose(*(sorted(x) for x in (np.degrees(next(ends)), next(ends))))
            assert getattr(other, f"get_{side}label")() == "[°]"


@pytest.mark.parametrize("name", STILL)
def test_a_top_that_stands_still_is_drawn_as_it_goes_when_it_is_touched(name):
    run = changed(*STILL[name])
    tilt = lines(drawn(nutation, run), "after a push of 1 rad/s").get_ydata()
    assert np.ptp(tilt) > 0.01
    ax = drawn(axis_on_sphere, run)
    path = next(line for line in ax.lines if len(line.get_xdata()) > 100)
    assert np.nanmax(np.abs(path.get_xydata() - path.get_xydata()[0])) > 0.1 * ax.get_xlim()[1]
    assert "after a push of 1 rad/s" in ax.get_title()


def test_sphere_marks_the_events_on_the_path(kicked):
    marks = lines(drawn(axis_on_sphere, kicked), "turning point, axis highest").get_xydata()
    assert len(marks) == sum(kind == "theta_min" for kind in kicked.events.kind)
    assert np.hypot(*marks.T).max() <= 1.0


@pytest.mark.parametrize(("draw", "name"), [(precession, "phi"), (spin_rate, "psidot")])
def test_an_angle_is_drawn_against_time(draw, name, kicked):
    t, shown = drawn(draw, kicked).lines[0].get_xydata().T
    assert (t[0], t[-1]) == (0.0, 2.0)
    np.testing.assert_array_equal(shown, getattr(kicked(t), name))


def test_precession_needs_phi():
    with pytest.raises(ValueError, match="phi"):
        drawn(precession, changed('want.quantities=["theta"]', "want.events=[]"))


def test_the_panels_share_their_time(kicked):
    *above, last = FIGURES["angles"](kicked).axes
    assert [ax.get_ylabel() for ax in (*above, last)] == [
        "tilt θ [rad]", "precession φ [rad]", "spin rate ψ̇ [rad/s]",
    ]  # fmt: skip
    assert {ax.get_xlabel() for ax in above} == {""}
    assert last.get_xlabel() == "time t [s]"


def test_peaks_near_a_pole_leave_the_rest_to_see():
    ax = drawn(spin_rate, propagate(load_scene("lie-group-benchmark")))
    low, high = ax.get_ylim()
    assert 140 < low < 148
    assert 150 < high < 160
    assert ax.get_title(loc="right")


def test_the_potential_is_that_of_the_book_and_meets_the_energy_at_the_turning_points(kicked):
    ax = drawn(effective_potential, kicked)
    theta, V = lines(ax, "V$").get_xydata().T
    top = kicked.scene.top
    A, gMR = float(top.A), float(top.gMR)
    c = {n: float(x) for n, x in Motion(top, kicked.scene.start).constants.items()}
    along = c["p_phi"] - c["p_psi"] * np.cos(theta)
    book = along**2 / (2 * A * np.sin(theta) ** 2) + gMR * np.cos(theta)
    np.testing.assert_allclose(V, book, rtol=1e-11)
    (energy,) = set(lines(ax, "energy").get_ydata())
    assert energy == pytest.approx(0.0457399615755, rel=1e-11)  # the E' of the README
    for kind, label in (("theta_min", "axis highest"), ("theta_max", "axis lowest")):
        [[tilt, height]] = lines(ax, f"turning point, {label}").get_xydata()
        found = kicked.events.theta[kicked.events.kind.index(kind)]
        assert tilt == pytest.approx(found, abs=1e-12)
        assert height == energy
    shown = ax.get_xlim()
    assert shown[0] < kicked.theta.min() < kicked.theta.max() < shown[1]


class TestPhasePlane:
    def test_the_motion_is_on_its_curve_in_a_family(self, kicked):
        ax = drawn(phase_plane, kicked)
        theta, rate = lines(ax, "the motion").get_xydata().T
        half = theta.size // 2
        samples = kicked.samples
        speed = np.interp(samples.theta, theta[:half], rate[:half])
        # the curve is a chain of straight lines; its worst error is at the steep ends
        away = np.minimum(samples.theta - theta[0], theta[half - 1] - samples.theta) > 0.01
        np.testing.assert_allclose(np.abs(samples.thetadot)[away], speed[away], atol=1e-3)
        np.testing.assert_array_equal(rate[half + 1 :], -rate[:half])
        loops = [line for line in ax.lines if len(line.get_xdata()) > 100]
        widths = sorted(float(np.nanmax(line.get_xdata())) for line in loops)
        assert len(set(widths)) == 6
        assert widths[3] == pytest.approx(kicked.theta.max(), abs=1e-4)
        [[theta, rate]] = lines(ax, "start").get_xydata()
        assert (theta, rate) == (samples.theta[0], samples.thetadot[0])

    def test_a_separatrix_is_drawn_where_there_is_one(self, kicked):
        labels = [line.get_label() for line in drawn(phase_plane, kicked).lines]
        assert "separatrix" not in labels
        over = lines(drawn(phase_plane, changed(*OVER)), "separatrix")
        assert over.get_xydata()[0].tolist() == [0.0, 0.0]

    def test_a_separatrix_can_be_the_motion_itself(self):
        run = propagate(load_scene("separatrix"))
        theta, rate = lines(drawn(phase_plane, run), "separatrix, and the motion").get_xydata().T
        half = theta.size // 2
        speed = np.interp(run.theta, theta[:half], rate[:half])
        inside = run.theta < theta[half - 1] - 0.01
        np.testing.assert_allclose(np.abs(run.samples.thetadot)[inside], speed[inside], atol=1e-4)


class TestErrors:
    def test_are_those_of_the_run_and_zeros_stand_on_the_lower_edge(self, kicked):
        ax = drawn(errors, kicked)
        document = run_errors(kicked)
        for label, name in (("tilt", "theta"), ("precession", "phi"), ("spin", "psi")):
            largest = lines(ax, label).get_ydata()
            largest = largest[np.isfinite(largest)]  # from the first error on
            assert (np.diff(largest) >= 0).all()
            # the document looks at seven times more than the samples
            assert 0 < largest[-1] <= getattr(document, name) < 10 * largest[-1]
        floor = ax.get_ylim()[0]
        marks = [line.get_ydata() for line in ax.lines if line.get_linestyle() == "None"]
        assert len(marks) == 4
        assert marks[1][0] == floor  # the first sample is the start, exact in phi
        assert all((y[y > floor] > 2 * floor).all() for y in marks)

    def test_one_tiny_error_does_not_set_the_scale(self):
        ax = drawn(errors, propagate(load_scene("steady-betsch")))
        low, high = ax.get_ylim()
        assert low > 1e-11 * high
        assert any(text.get_text() == "zero, or smaller" for text in ax.texts)

    def test_of_a_top_that_stands_still_are_none(self):
        ax = drawn(errors, changed(*AT_POLE))
        assert "none" in lines(ax, "tilt").get_label()

    def test_of_a_long_table_are_looked_at_sparsely(self):
        ax = drawn(errors, changed("want.samples=5000"))
        assert 500 < len(lines(ax, "tilt").get_xdata()) <= 1000


def test_the_page_of_the_figures_names_them_all():
    page = (Path(__file__).parents[2] / "docs" / "figures.md").read_text("utf-8")
    assert re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE) == list(FIGURES)


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
