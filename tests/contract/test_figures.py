"""What a figure promises: the events where they are, text taken as text, the same bytes again."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure

from heavytop.analytic.motion import Motion
from heavytop.files import as_json, write_whole
from heavytop.plots.atlas import map_figure
from heavytop.plots.figures import (
    FIGURES,
    View,
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
from heavytop.plots.sphere import TINT, kind_panel
from heavytop.plots.style import KINDS
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
DEGENERATE = {
    "sleeping": AT_POLE,
    "sleeping, unstable": (*AT_POLE, "start.psidot=60"),
    "hanging": ("start.theta=pi", "start.phidot=0"),
    "at rest": ("top.gMR=0", "start.phidot=0", "start.psidot=0"),
    "force-free": ("top.gMR=0",),
    "swinging": ("start.theta=2", "start.phidot=0", "start.psidot=0"),
    "rotating": ("start.theta=2", "start.thetadot=40", "start.phidot=0", "start.psidot=0"),
    "through the top": (*AT_POLE, "start.thetadot=3"),
    "over an unstable top": (*AT_POLE, "start.thetadot=3", "start.psidot=60"),
    "inverted": ("top.gMR=-0.0456", "start.theta=2"),
    "backwards": ("span.time=-2",),
    "theta alone": ('want.quantities=["theta"]',),
    "no events": ("want.events=[]",),
    "two samples": ("want.samples=2",),
}


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


def test_angles_have_degrees_on_the_other_side(kicked):
    for draw, sides in ((loop, "yx"), (nutation, "y"), (effective_potential, "x")):
        ax = drawn(draw, kicked)
        ax.figure.draw_without_rendering()
        assert len(ax.child_axes) == len(sides)
        for side, other in zip(sides, ax.child_axes, strict=True):
            ends = (getattr(each, f"get_{side}lim")() for each in (ax, other))
            np.testing.assert_allclose(*(sorted(x) for x in (np.degrees(next(ends)), next(ends))))
            assert getattr(other, f"get_{side}label")() == "[°]"


@pytest.mark.parametrize("name", ["sleeping", "sleeping, unstable", "hanging", "at rest"])
def test_a_top_that_stands_still_is_drawn_as_it_goes_when_it_is_touched(name):
    run = changed(*DEGENERATE[name])
    tilt = lines(drawn(nutation, run), "after a push of 1 rad/s").get_ydata()
    assert np.ptp(tilt) > 0.01
    ax = drawn(axis_on_sphere, run)
    path = next(line for line in ax.lines if len(line.get_xdata()) > 100)
    assert np.nanmax(np.abs(path.get_xydata() - path.get_xydata()[0])) > 0.1 * ax.get_xlim()[1]
    assert "after a push of 1 rad/s" in ax.get_title()


def test_a_kind_has_one_colour_on_maps_and_spheres():
    for kind in ("loops", "cusps"):
        ax = Figure().subplots()
        kind_panel(ax, np.eye(3), View.from_pole(1.0, 0.5), kind)
        tint = 1 - TINT * (1 - np.array(to_rgb(KINDS[kind].colour)))
        np.testing.assert_allclose(ax.patches[0].get_facecolor()[:3], tint)
    counts = {"loops": 3, "cusps": 1}
    axis = {"name": "phidot", "low": 0.0, "high": 1.0, "log": False}
    document = {"axes": {"x": axis, "y": axis | {"name": "psidot"}}, "counts": counts,
                "curves": [], "scene": {"title": "", "name": "x"}}  # fmt: skip
    figure = map_figure(document, np.zeros((2, 2), np.uint8), list(counts))
    [legend] = figure.legends
    words = [text.get_text() for text in legend.get_texts()]
    assert words == ["loops 75.00%", "cusps 25.00%"]
    shown = [patch.get_facecolor() for patch in legend.get_patches()]
    assert shown == [to_rgba(KINDS[kind].colour) for kind in counts]


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
    for name, draw in FIGURES.items():
        for copy in ("one", "two"):
            for suffix in (".svg", ".png"):
                save(draw(kicked), tmp_path / f"{copy}{suffix}")
        for suffix in (".svg", ".png"):
            one, two = ((tmp_path / f"{copy}{suffix}").read_bytes() for copy in ("one", "two"))
            assert one == two, name


@pytest.mark.parametrize("title", ["$\\frac{", "--><script>x</script>", "日本", "x" * 500])
def test_a_title_is_only_text(title, tmp_path):
    scene = load_scene("sicm-kicked", overrides=[f"title={title}"])
    save(overview(propagate(scene)), tmp_path / "figure.svg")
    assert "<script" not in (tmp_path / "figure.svg").read_text("utf-8")


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


class TestPotential:
    def test_is_that_of_the_book(self, kicked):
        theta, V = lines(drawn(effective_potential, kicked), "V$").get_xydata().T
        top = kicked.scene.top
        A, gMR = float(top.A), float(top.gMR)
        c = {n: float(x) for n, x in Motion(top, kicked.scene.start).constants.items()}
        along = c["p_phi"] - c["p_psi"] * np.cos(theta)
        book = along**2 / (2 * A * np.sin(theta) ** 2) + gMR * np.cos(theta)
        np.testing.assert_allclose(V, book, rtol=1e-11)

    def test_meets_the_energy_at_the_turning_points(self, kicked):
        ax = drawn(effective_potential, kicked)
        (energy,) = set(lines(ax, "energy").get_ydata())
        assert energy == pytest.approx(0.0457399615755, rel=1e-11)  # the E' of the README
        for kind, label in (("theta_min", "axis highest"), ("theta_max", "axis lowest")):
            [[theta, height]] = lines(ax, f"turning point, {label}").get_xydata()
            found = kicked.events.theta[kicked.events.kind.index(kind)]
            assert theta == pytest.approx(found, abs=1e-12)
            assert height == energy
        shown = ax.get_xlim()
        assert shown[0] < kicked.theta.min() < kicked.theta.max() < shown[1]


class TestPhasePlane:
    def test_the_motion_is_on_its_curve(self, kicked):
        theta, rate = lines(drawn(phase_plane, kicked), "the motion").get_xydata().T
        half = theta.size // 2
        samples = kicked.samples
        speed = np.interp(samples.theta, theta[:half], rate[:half])
        # the curve is a chain of straight lines; its worst error is at the steep ends
        away = np.minimum(samples.theta - theta[0], theta[half - 1] - samples.theta) > 0.01
        np.testing.assert_allclose(np.abs(samples.thetadot)[away], speed[away], atol=1e-3)
        np.testing.assert_array_equal(rate[half + 1 :], -rate[:half])

    def test_is_a_family(self, kicked):
        ax = drawn(phase_plane, kicked)
        loops = [line for line in ax.lines if len(line.get_xdata()) > 100]
        assert len(loops) == 6
        widths = sorted(float(np.nanmax(line.get_xdata())) for line in loops)
        assert widths[3] == pytest.approx(kicked.theta.max(), abs=1e-4)
        assert len(set(widths)) == 6

    def test_the_dot_is_the_start(self, kicked):
        [[theta, rate]] = lines(drawn(phase_plane, kicked), "start").get_xydata()
        assert (theta, rate) == (kicked.samples.theta[0], kicked.samples.thetadot[0])

    def test_a_separatrix_is_drawn_where_there_is_one(self, kicked):
        labels = [line.get_label() for line in drawn(phase_plane, kicked).lines]
        assert "separatrix" not in labels
        over = lines(drawn(phase_plane, changed(*DEGENERATE["over an unstable top"])), "separatrix")
        assert over.get_xydata()[0].tolist() == [0.0, 0.0]

    def test_a_separatrix_can_be_the_motion_itself(self):
        run = propagate(load_scene("separatrix"))
        theta, rate = lines(drawn(phase_plane, run), "separatrix, and the motion").get_xydata().T
        half = theta.size // 2
        speed = np.interp(run.theta, theta[:half], rate[:half])
        inside = run.theta < theta[half - 1] - 0.01
        np.testing.assert_allclose(np.abs(run.samples.thetadot)[inside], speed[inside], atol=1e-4)


class TestErrors:
    def test_are_those_of_the_run(self, kicked):
        ax = drawn(errors, kicked)
        document = run_errors(kicked)
        for label, name in (("tilt", "theta"), ("precession", "phi"), ("spin", "psi")):
            largest = lines(ax, label).get_ydata()
            largest = largest[np.isfinite(largest)]  # from the first error on
            assert (np.diff(largest) >= 0).all()
            # the document looks at seven times more than the samples
            assert 0 < largest[-1] <= getattr(document, name) < 10 * largest[-1]

    def test_zeros_stand_on_the_lower_edge(self, kicked):
        ax = drawn(errors, kicked)
        floor = ax.get_ylim()[0]
        marks = [line.get_ydata() for line in ax.lines if line.get_linestyle() == "None"]
        assert len(marks) == 4
        assert marks[1][0] == floor  # the first sample is the start, exact in phi
        positive = [y[y > floor] for y in marks]
        assert all((y > 2 * floor).all() for y in positive)

    def test_one_tiny_error_does_not_set_the_scale(self):
        ax = drawn(errors, propagate(load_scene("steady-betsch")))
        low, high = ax.get_ylim()
        assert low > 1e-11 * high
        assert any(text.get_text() == "zero, or smaller" for text in ax.texts)

    def test_of_a_top_that_stands_still_are_none(self):
        ax = drawn(errors, changed(*DEGENERATE["sleeping"]))
        assert "none" in lines(ax, "tilt").get_label()

    def test_of_a_long_table_are_looked_at_sparsely(self):
        ax = drawn(errors, changed("want.samples=5000"))
        assert 500 < len(lines(ax, "tilt").get_xdata()) <= 1000


@pytest.mark.parametrize("name", DEGENERATE)
def test_every_motion_can_be_drawn(name, tmp_path):
    run = changed(*DEGENERATE[name])
    for figure, draw in FIGURES.items():
        save(draw(run), tmp_path / f"{figure}.svg")
        assert "nan" not in (tmp_path / f"{figure}.svg").read_text("utf-8").lower()


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_shipped_scene_can_be_drawn(name, tmp_path):
    run = propagate(load_scene(name))
    for figure, draw in FIGURES.items():
        save(draw(run), tmp_path / f"{figure}.svg")
        assert (tmp_path / f"{figure}.svg").stat().st_size > 5_000


def test_the_page_of_the_figures_runs_and_names_them_all(tmp_path, monkeypatch):
    page = (Path(__file__).parents[2] / "docs" / "figures.md").read_text("utf-8")
    assert re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE) == list(FIGURES)
    [program] = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(program, "figures.md", "exec"), {})
    assert (tmp_path / "kicked.svg").exists()


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


@pytest.mark.parametrize(
    "view",
    [
        View.from_pole(1.0, 0.3),
        View.from_pole(-1.0, 0.9),
        View.from_horizon(np.array([0.8, -0.6, 0.0])),
        View.from_horizon(np.array([0.0, 1.0, -0.9])),
    ],
)
def test_circles_of_equal_tilt_are_where_they_can_be_seen(view):
    """Put back onto the near side of the sphere, each is at one height, a multiple of the spacing;
    and each that has a near side is drawn.
    """
    ax = Figure().subplots()
    view.draw_graticule(ax)
    heights = []
    for arc in (patch.get_path() for patch in ax.patches[1:]):
        x, y = arc.vertices[::3].T  # the others are handles of the curves
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
    words = {text.get_text() for text in ax.texts}
    assert words
    assert words <= {f"{tilt:.0f}°" for tilt in tilts}
