"""A trajectory at any time, by any thread, and as a table: the same bits, in more digits too."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import heavytop as ht
from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import EndedEarly, Impossible, NotANumber

from ..trajectories import run_of, same

ANGLES_AND_RATES = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")
ALL = 'want.quantities=["theta", "phi", "psi", "axis"]'


@pytest.fixture(scope="module")
def whole():
    return run_of("span.time=400")


@pytest.fixture(scope="module")
def precise():
    return run_of(ALL, "want.digits=30", "span.time=7", "want.samples=15")


def test_dense_output_is_the_samples(whole):
    shuffled = np.random.default_rng(7).permutation(whole.t)
    again, order = whole(shuffled), np.argsort(shuffled)
    for name in again.COLUMNS:
        assert same(getattr(again, name)[order], getattr(whole.samples, name)), name
    for name in ("phidot", "omega", "quaternion"):
        assert np.array_equal(getattr(whole, name), getattr(whole.samples, name))


def test_a_run_that_takes_no_step_has_its_start():
    """The quadrature of psi divides by how far the axis is from the top, which rounds to 0."""
    with pytest.raises(EndedEarly) as early:
        run_of("start.theta=1e-9", 'want.quantities=["psi"]', name="at-rest", formulation="axis")
    assert early.value.trajectory(0.0).theta == 1e-9
    with pytest.raises(Impossible, match="inf more samples"):
        ht.extend(early.value.trajectory, 1)


def test_dense_output_in_more_digits_is_the_same_run_rounded(precise):
    samples = precise.in_mpmath()
    again = precise.in_mpmath(samples.t[::-1])
    assert (again.states[::-1] == samples.states).all()
    assert (again.phi[::-1] == samples.phi).all()
    assert precise.theta.tolist() == [float(theta) for theta in samples.theta]
    assert precise(precise.t[3]).theta == precise.theta[3]
    assert abs(precise.in_mpmath("1/3").phi - precise.motion.at("1/3", digits=50).phi) < 1e-29


def test_what_a_formulation_does_not_give_is_nan_as_in_doubles():
    changes = ("want.digits=40", "span.time=1", 'want.quantities=["theta"]', "want.samples=7")
    run = run_of(*changes, formulation="cubic")
    end = run.end
    for number in (end.phi, end.psi, *end.axis[:2], *end.omega, *end.quaternion):
        assert number != number
        assert run.text(number) is None
    assert abs(end.axis[2] - run.ctx.cos(end.theta)) < 1e-45
    assert run.phi is run.psi is None
    assert run.to_xarray()["phi_text"].to_numpy().tolist() == [""] * 7


@pytest.mark.parametrize("form", FORMULATIONS)
def test_an_angle_without_its_turns_is_not_there(form):
    run = run_of('want.quantities=["theta"]', formulation=form)
    exact = run.motion.at(run.t)
    for name in ("phi", "psi"):
        found = getattr(run, name)
        assert found is None or abs(found - getattr(exact, name)).max() < 1e-9, name


def test_times_that_are_refused_and_none(whole, precise):
    for trajectory in (whole, precise):
        one, none = trajectory(np.array([0.5])), trajectory(np.empty(0))
        for name in one.COLUMNS:
            assert getattr(none, name).shape == (0, *getattr(one, name).shape[1:])
        for t in (-1e-9, trajectory.t[-1] + 1e-6):
            for ask in (trajectory, trajectory.in_mpmath):
                with pytest.raises(Impossible, match="where the trajectory was integrated"):
                    ask(t)
        for t in ("soon", np.nan, [0.0, np.inf], [[1.0]], None, [1, "a"]):
            with pytest.raises(NotANumber, match="a finite time"):
                trajectory(t)
            with pytest.raises(NotANumber):
                trajectory.in_mpmath([t])


@pytest.mark.parametrize("name", ["sicm-kicked", "lie-group-benchmark"])
@pytest.mark.parametrize("formulation", ["axis", "attitude", "lagrange"])
@pytest.mark.filterwarnings("ignore")
def test_the_first_sample_is_the_start(name, formulation):
    trajectory = run_of("span.time=0.1", name=name, formulation=formulation)
    for quantity in ANGLES_AND_RATES:
        start = float(getattr(trajectory.scene.start, quantity))
        assert getattr(trajectory.samples, quantity)[0] == start
        assert getattr(trajectory(0.0), quantity) == start


def test_threads_do_not_share_an_integrator():
    scenes = [ht.Scene(ht.Top(1, 1, 1), ht.State(1, psidot=k), time=20) for k in (1, 5)] * 3
    runs, t = [ht.propagate(scene) for scene in scenes], np.linspace(0, 20, 50)
    expected = [run(t).states for run in runs]

    def same_again(run, states):
        return all(np.array_equal(run(t).states, states) for _ in range(40))

    with ThreadPoolExecutor(6) as pool:
        assert all(pool.map(same_again, runs, expected, timeout=300))


@pytest.mark.parametrize(("projected", "periods"), [(False, -30_000), (True, 30_000)])
def test_just_before_a_checkpoint_the_motion_is_not_yet_there(projected, periods):
    """The double of its time may be before its start by what the axis moves 1e-12 in."""
    wants = ("want.digits=6", 'want.quantities=["axis", "phi"]', "want.events=[]", "want.samples=2")
    run = run_of(f"span.periods={periods}", *wants, formulation="axis", projected=projected)
    late = [c for c in run.orbit.checkpoints if c.time[1] * np.sign(periods) > 3e-13]
    assert late
    (high, low), begun = np.transpose([c.time for c in late]), np.array([c.state[:3] for c in late])
    there, low = run(high), low[:, None]
    moved = -low * np.cross(there.omega, begun)
    off = there.axis - begun - moved
    assert np.all(np.linalg.norm(off, axis=1) < 0.3 * np.linalg.norm(moved, axis=1))


# --- as a table ----------------------------------------------------------------------------------


def test_a_table_has_the_samples_of_the_run_and_their_units():
    """Those of `to_xarray`, bit for bit; times are the index, parts of vectors have letters."""
    run = run_of("span.time=0.6")
    table, data = run.to_pandas(), run.to_xarray()
    columns = {name: data[name] for name in ANGLES_AND_RATES}
    for name in ("axis", "omega"):
        columns |= {f"{name}_{x}": data[name].sel(space=x) for x in "xyz"}
    columns |= {f"states_{x}": data["states"][:, k] for k, x in enumerate(data["state"].values)}
    for name, values in columns.items():
        assert same(table[name], values), name
        assert "state" in name or table.attrs["units"][name] == values.attrs["units"]
    assert (table.index.name, table.attrs["units"]["t"]) == ("t", "s")
    assert same(table.index, run.t)
    assert table.attrs["long_name"]["theta"] == data["theta"].attrs["long_name"]
    assert table.attrs["scene"] == run.scene.to_toml()
    assert not [name for name in table if name.startswith("event")]


def test_a_table_has_the_events_of_the_run(whole):
    table, events = whole.to_pandas(events=True), whole.events
    assert tuple(table["kind"]) == events.kind
    assert same(table.index, events.t)
    assert all(same(table[x], getattr(events, x)) for x in ("theta", "phi", "phidot", "residual"))
    assert table.attrs["units"]["theta"] == "rad"
    assert run_of(name="steady-fast").to_pandas(events=True).empty


def test_tables_of_a_run_in_more_digits_have_its_decimals_too(precise):
    table, data = precise.to_pandas(), precise.to_xarray()
    assert table["theta_text"].tolist() == data["theta_text"].values.tolist()
    assert data["theta_text"].values[-1] == precise.text(precise.end.theta)
    assert len(str(data["event_t_text"].values[3])) > 30
