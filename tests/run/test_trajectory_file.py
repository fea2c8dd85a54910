"""A stored trajectory is the run: in doubles and in more digits, asked again and continued."""

import pytest

import heavytop as ht

from ..trajectories import assert_same_run, run_of, same

MORE = ("want.digits=30", "span.time=4", 'want.quantities=["psi", "axis"]')


@pytest.mark.parametrize("changes", [(), MORE])
def test_a_stored_run_is_the_run(tmp_path, changes):
    whole = run_of(*changes)
    whole.save(tmp_path / "run.nc")
    run_of("start.phidot=-150")  # the loop is shared
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    assert_same_run(whole, loaded)
    assert (loaded.scene, loaded.plan) == (whole.scene, whole.plan)
    assert repr(loaded.events.own) == repr(whole.events.own)
    for name in whole.samples.__slots__:
        one, other = (getattr(run.in_mpmath(), name) for run in (loaded, whole))
        assert repr(one.tolist()) == repr(other.tolist())
    assert same(loaded([0.5, 1.7]).states, whole([0.5, 1.7]).states)


def test_a_stored_run_in_more_digits_has_its_decimals():
    whole = run_of(*MORE)
    data = whole.to_xarray()
    assert data["theta_text"].to_numpy()[-1] == whole.text(whole.end.theta)
    assert len(str(data["event_t_text"].to_numpy()[3])) > 30
