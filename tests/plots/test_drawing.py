"""`plot`: the axes given, the data of the thing, the keywords of its user, clear errors."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.errors import Impossible
from heavytop.plots.figures import PICTURES
from heavytop.results.table import Row

from ..motions import shipped
from ..results.made import POINT, RUN, diagram_of, stress_of

SCENE = ht.load_scene("sicm-kicked")
MOTION = ht.Motion(SCENE.top, SCENE.start)
NAMED = {"taylor-axis": "axis", "gauss8": "gauss8"}
AXIS = Row(POINT, method="taylor-axis", theta_error=1e-6)
POINTS = [AXIS, Row(AXIS, error=1e-9, us_per_period=10.0),
          Row(AXIS, method="taylor-routh", measures="theta", us_per_period=2.0)]  # fmt: skip
STYLE = {"color": "#123456", "linewidth": 3.5, "ls": "--", "label": "mine"}


@pytest.fixture(scope="module")
def run():
    return ht.propagate(SCENE)


@pytest.fixture(scope="module")
def things(run):
    """One of everything that can be drawn, small."""
    return {
        "Motion": MOTION,
        "Trajectory": run,
        "Drift": ht.drift(SCENE, methods=["taylor-axis", "taylor-cubic"], periods=10),
        "Atlas": ht.atlas(SCENE, x="phidot=-30:40:9", y="theta=0.1:1.5:7", jobs=1),
        "WorkPrecision": diagram_of(*POINTS),
        "Stress": stress_of(*(Row(RUN, method=x) for x in NAMED), methods=NAMED),
        "Check": ht.check({name: getattr(run, name) for name in ("t", "theta", "phi")}, SCENE),
        "Sweep": ht.sweep(SCENE, "start.psidot=100:200:3", ["round", "theta_max"]),
    }


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture
def shown():
    """Figures that pyplot holds are those of a test alone."""
    yield pyplot
    pyplot.close("all")


def mine(ax):
    return [line for line in ax.lines if line.get_label() == "mine"]


@pytest.mark.parametrize("name", ["theta", "phi", "psi", "thetadot", "phidot", "psidot"])
@pytest.mark.parametrize("kind", ["Motion", "Trajectory"])
def test_what_is_drawn_over_time_is_the_motion_then(name, kind, things, ax):
    thing = things[kind]
    assert thing.plot(name, ax=ax, **STYLE) is ax
    [line] = mine(ax)
    t, drawn = line.get_data()
    at = thing.at if kind == "Motion" else thing
    np.testing.assert_array_equal(drawn, getattr(at(t), name))
    assert t[-1] == (2.0 if kind == "Trajectory" else 3 * MOTION.period)
    assert line.get_color() == "#123456"
    assert (line.get_linewidth(), line.get_linestyle()) == (3.5, "--")


def test_the_default_is_the_tilt_against_the_precession(things, ax):
    for kind, at in (("Motion", MOTION.at), ("Trajectory", things["Trajectory"])):
        phi, theta = mine(things[kind].plot(ax=ax, label="mine"))[-1].get_data()
        end = 3 * MOTION.period if kind == "Motion" else 2.0
        exact = at(np.linspace(0.0, end, phi.size))
        np.testing.assert_array_equal([phi, theta], [exact.phi, exact.theta])
    assert ax.yaxis_inverted()  # still, after two
    assert (ax.child_axes, ax.get_title()) == ([], "")
    labels = [x for x in ax.get_legend_handles_labels()[1] if x != "mine"]
    assert len(labels) == len(set(labels)) > 1


def drawn(thing, *what, **how):
    return thing.plot(*what, ax=Figure().subplots(), **how)


def test_a_title_stays_and_events_may_be_left_out(run, ax):
    ax.set_title("my own")
    for name in set(PICTURES) - {"errors"}:
        run.plot(name, ax=ax, events=False)
    drawn(run, "errors", events=False)
    assert ax.get_title() == "my own"
    assert not any("turning" in label for label in ax.get_legend_handles_labels()[1])


def test_what_is_drawn_may_be_in_degrees_and_milliseconds(things, run):
    other = drawn(run, "phi", unit="deg,ms", label="mine", events=False)
    t, phi = mine(other)[0].get_data()
    np.testing.assert_allclose(phi, np.degrees(run(t / 1000).phi), rtol=1e-9)
    assert (other.get_xlabel(), other.get_ylabel()) == ("t [ms]", "φ [deg]")
    marked = drawn(run, "loop", unit="deg")
    highest = next(x for x in marked.lines if "highest" in x.get_label()).get_ydata()
    assert highest[0] == pytest.approx(np.degrees(run.events.of("turning").theta.min()), rel=1e-9)
    for name in ("phase", "potential"):
        wide, narrow = (drawn(run, name, **how).get_xlim() for how in ({"unit": "deg"}, {}))
        np.testing.assert_allclose(wide, np.degrees(narrow), rtol=1e-12)
    off, turned = drawn(run, "errors"), drawn(run, "errors", unit="ms,deg")
    assert turned.lines[0].get_xdata()[-1] == 2000.0
    largest = [max(ax.lines[0].get_ydata()) for ax in (off, turned)]
    assert largest[1] == pytest.approx(np.rad2deg(largest[0]))
    assert all((" deg" in x) != ("axis" in x) for x in turned.get_legend_handles_labels()[1])
    ends = [drawn(things["Drift"], "phase_s", unit=unit).lines[0].get_ydata()[-1]
            for unit in ("s", "ms")]  # fmt: skip
    assert ends[1] == 1000 * ends[0] > 0
    assert "θ [rad]" in drawn(things["Check"], unit="deg").get_legend_handles_labels()[1]
    with pytest.raises(Impossible, match="unit: furlong: units are"):
        run.plot(unit="furlong")


def test_the_sphere_has_the_path_of_the_axis_in_one_view_for_all(run, ax):
    other = ht.propagate(ht.load_scene("sicm-dropped"))
    run.plot("sphere", ax=ax, **STYLE)
    other.plot("sphere", ax=ax, label="mine", alpha=0.5)
    wide, narrow = mine(ax)
    assert narrow.get_alpha() == 0.5
    for line, axis in ((narrow, other), (wide, run)):  # from straight above, both of them
        seen = line.get_xydata()
        np.testing.assert_allclose(seen, axis(np.linspace(0.0, 2.0, len(seen))).axis[:, :2])
    assert ax.get_xlim()[1] > np.abs(wide.get_xydata()).max()
    around = drawn(shipped("spherical-pendulum"), "sphere", **STYLE)
    assert len(mine(around)) == 1  # of two parts, before and behind the sphere


def test_of_studies_what_is_asked_for_is_drawn(things, ax):
    drift, atlas, check = (things[kind] for kind in ("Drift", "Atlas", "Check"))
    drift.plot(ax=ax, lw=5)
    for method, line in zip(drift.methods, ax.lines, strict=False):
        known = [(n, e) for n, e in zip(method.periods, method.energy, strict=True) if e]
        assert line.get_xydata().tolist() == [list(point) for point in known]
        assert (line.get_label(), line.get_linewidth()) == (method.name, 5)
    assert drawn(drift, "phase_s").get_ylabel() == "error of phase [s]"
    [mesh] = drawn(atlas, alpha=0.25).collections
    np.testing.assert_array_equal(mesh.get_array(), atlas["kind"])
    assert mesh.get_alpha() == 0.25
    _, line = drawn(things["WorkPrecision"]).lines  # the front, and the method
    assert line.get_label() == "taylor-axis"
    tilts = drawn(things["WorkPrecision"], "theta")
    assert things["WorkPrecision"].plot("theta", ax=tilts).xaxis_inverted()  # still, after two
    assert (len(tilts.lines), tilts.get_xlabel()) == (2 * 3, "error of θ [rad]")
    assert drawn(check, "phase").lines[0].get_ydata().tolist() == [*check.curves["phase"]]
    assert drawn(check).get_yscale() == "log"
    tilts, sweep = drawn(things["Sweep"], "theta_max", unit="deg"), things["Sweep"]
    [(speed, tilt), *_] = tilts.lines[0].get_xydata().tolist()
    first = sweep.rows[0]
    assert (speed, tilt) == (first["start.psidot"], pytest.approx(np.degrees(first["theta_max"])))
    assert [*sweep.charts()] == ["round", "theta_max"]


@pytest.mark.parametrize(
    "kind", ["Motion", "Drift", "Atlas", "WorkPrecision", "Stress", "Check", "Sweep"]
)
def test_without_axes_there_is_a_new_figure_that_pyplot_shows(kind, things, shown):
    other = shown.figure()
    ax = things[kind].plot()
    assert ax.figure is shown.gcf() is not other
    assert other.axes == []
    labels = [text.get_text() for legend in ax.figure.legends for text in legend.get_texts()]
    assert set(labels) == set(ax.get_legend_handles_labels()[1])
    ax.figure.draw_without_rendering()
    for legend in ax.figure.legends:
        assert legend.get_window_extent().width < ax.figure.bbox.width


def test_what_cannot_be_drawn_is_refused_by_name(things, run, shown):
    drift = things["Drift"]
    for thing, options, said in (
        (MOTION, {"what": "phases"}, r'one of loop, .*, phase.* \(did you mean "phase"\?\)'),
        (MOTION, {"what": "errors"}, "one of loop, (?!.*errors)"),  # there are none
        (drift, {"what": "loop"}, "one of energy, phase_s"),
        (replace(drift, methods=()), {}, "there is nothing to draw"),
        (run, {"ax": Figure()}, r"ax: an Axes \(of matplotlib\), not a Figure"),
    ):
        with pytest.raises(ht.HeavyTopError, match=said):
            thing.plot(**options)
    assert shown.get_fignums() == []


@pytest.mark.parametrize("kind", ["Motion", "Drift"])
def test_a_keyword_that_matplotlib_has_not_is_its_own_error(kind, things, shown):
    for ax, wrong in product((None, Figure().subplots()), ("colour", "name")):
        with pytest.raises(AttributeError, match=f"unexpected keyword argument '{wrong}'"):
            things[kind].plot(ax=ax, **{wrong: "red"})
    with pytest.raises(TypeError, match="aliases of one another"):
        things[kind].plot(lw=1, linewidth=2)
    assert shown.get_fignums() == []
