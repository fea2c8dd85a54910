"""The figures of a run: events where they are, the curves of the book, every motion drawn."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import heavytop as ht
from heavytop.analytic.potential import Potential
from heavytop.errors import Impossible
from heavytop.plots.figures import run_figures
from heavytop.plots.style import save

from ..motions import SCENES
from ..trajectories import run_of


@pytest.fixture(scope="module")
def kicked():
    return run_of()


def lines(ax, label):
    return next(line for line in ax.lines if line.get_label().startswith(label))


def drawn(name, trajectory):
    return trajectory.plot(name, ax=Figure().subplots())


DRAWN = {name: (name,) for name in SCENES} | {
    "weightless": ("sicm-kicked", "top.gMR=0", "start.phidot=0", "start.psidot=0"),
    "backwards": ("sicm-kicked", "span.time=-2", "want.events=[]"),
    "theta alone": ("sicm-kicked", 'want.quantities=["theta"]', "want.samples=2"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", DRAWN)
def test_every_motion_can_be_drawn(name, tmp_path):
    scene, *changes = DRAWN[name]
    for figure, _, draw in run_figures(run_of(*changes, name=scene)):
        save(draw(), tmp_path / f"{figure}.svg")
        assert "nan" not in (tmp_path / f"{figure}.svg").read_text("utf-8").lower()


def test_loop_marks_every_turning_point_where_it_is_and_stands_upright(kicked):
    ax = drawn("loop", kicked)
    events = kicked.events
    low = np.array([kind == "theta_max" for kind in events.kind])
    assert low.any()
    marks = lines(ax, "turning point, axis lowest").get_xydata()
    np.testing.assert_array_equal(marks, np.column_stack((events.phi, events.theta))[low])
    bottom, top = ax.get_ylim()
    assert top < bottom


def test_a_long_run_is_drawn_for_twelve_nutations_and_says_so(kicked):
    ax = drawn("theta", run_of("span.time=60"))
    period = kicked.motion.period
    last = lines(ax, "turning point, axis lowest").get_xdata()[-1]
    assert ax.lines[0].get_xdata()[-1] == pytest.approx(12 * period)
    assert last == pytest.approx(11.5 * period)
    assert ax.get_title() == f"the first {12 * period:.4g} s of 60 s"


@pytest.mark.parametrize("name", ["sleeping-unstable", "hanging", "at-rest"])
def test_a_top_that_stands_still_is_drawn_as_it_goes_when_it_is_touched(name):
    run = run_of(name=name)
    assert np.ptp(lines(drawn("theta", run), "after a push of 1 rad/s").get_ydata()) > 0.01
    ax = drawn("sphere", run)
    path = next(line for line in ax.lines if len(line.get_xdata()) > 100)
    assert np.nanmax(np.abs(path.get_xydata() - path.get_xydata()[0])) > 0.1 * ax.get_xlim()[1]
    assert "after a push of 1 rad/s" in ax.get_title()


def test_what_needs_phi_says_so():
    with pytest.raises(Impossible, match="phi"):
        drawn("phi", run_of('want.quantities=["theta"]', "want.events=[]"))


def test_the_potential_meets_the_energy_at_the_turning_points(kicked):
    ax = drawn("potential", kicked)
    theta, V = lines(ax, "V$").get_xydata().T
    A = float(kicked.scene.top.A)
    np.testing.assert_allclose(V, A * Potential(kicked.motion)(theta), rtol=1e-12)
    (energy,) = set(lines(ax, "energy").get_ydata())
    assert energy == kicked.motion.constants.floats["E_prime"]
    for side, label in (("min", "highest"), ("max", "lowest")):
        [[tilt, height]] = lines(ax, f"turning point, axis {label}").get_xydata()
        end = getattr(kicked.motion, f"theta_{side}")
        assert (tilt, height) == (pytest.approx(end, abs=1e-12), energy)


def off_curve(run, curve, away):
    """By how much a run leaves a curve of the phase plane, away from its steep ends."""
    theta, rate = curve.get_xydata().T
    half = theta.size // 2
    np.testing.assert_array_equal(rate[half + 1 :], -rate[:half])
    speed = np.interp(run.theta, theta[:half], rate[:half])
    inside = (run.theta > theta[0] + away) & (run.theta < theta[half - 1] - 0.01)
    return np.abs(np.abs(run.samples.thetadot) - speed)[inside].max()


def test_in_the_phase_plane_the_motion_is_on_its_curve_in_a_family(kicked):
    ax = drawn("phase", kicked)
    # the curve is a chain of straight lines; its worst error is at the steep ends
    assert off_curve(kicked, lines(ax, "the motion"), 0.01) < 1e-3
    loops = [line for line in ax.lines if len(line.get_xdata()) > 100]
    widths = sorted(float(np.nanmax(line.get_xdata())) for line in loops)
    assert (len(set(widths)), widths[3]) == (6, pytest.approx(kicked.theta.max(), abs=1e-4))
    for theta, rate in (line.get_xydata()[: len(line.get_xdata()) // 2].T for line in loops):
        assert np.ptp(rate**2 / 2 + Potential(kicked.motion)(theta)) < 1e-6 * rate.max() ** 2
    assert (lines(ax, "start").get_xydata() == [kicked.theta[0], kicked.samples.thetadot[0]]).all()
    ax = drawn("phase", ht.Motion(kicked.scene.top, ht.State(0, thetadot="1e-6", omega3=140)))
    assert np.ptp(ax.dataLim.intervalx) > 0.1


def test_a_separatrix_is_drawn_where_there_is_one_and_can_be_the_motion_itself(kicked):
    assert "separatrix" not in [line.get_label() for line in drawn("phase", kicked).lines]
    over = run_of("start.theta=0", "start.phidot=0", "start.thetadot=3", "start.psidot=60")
    assert not lines(drawn("phase", over), "separatrix").get_xydata()[0].any()
    run = run_of(name="separatrix")
    assert off_curve(run, lines(drawn("phase", run), "separatrix, and the motion"), -1) < 1e-4


def test_errors_are_those_of_the_run_and_zeros_stand_on_the_lower_edge(kicked):
    ax, known = drawn("errors", kicked), ht.run_errors(kicked)
    for label, name in (("θ", "theta"), ("φ", "phi"), ("ψ", "psi")):
        largest = lines(ax, label).get_ydata()
        largest = largest[np.isfinite(largest)]  # from the first error on
        assert (np.diff(largest) >= 0).all()
        # the document looks at seven times more than the samples
        assert 0 < largest[-1] <= getattr(known, name) < 10 * largest[-1]
    floor = ax.get_ylim()[0]
    marks = [line.get_ydata() for line in ax.lines if line.get_linestyle() == "None"]
    assert len(marks) == 4
    assert marks[1][0] == floor  # the first sample is the start, exact in phi
    assert all((y[y > floor] > 2 * floor).all() for y in marks)
