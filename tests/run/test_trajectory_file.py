"""A stored trajectory is the run: in doubles and in more digits, asked again and continued."""

import numpy as np
import pytest

import heavytop as ht

from .test_propagation import assert_same_run, same


@pytest.fixture(scope="module")
def whole():
    return ht.propagate(ht.load_scene("sicm-kicked", ["span.time=400"]))


def test_a_stored_run_is_the_run(whole, tmp_path):
    whole.save(tmp_path / "run.nc")
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    assert_same_run(whole, loaded)
    assert loaded.scene == whole.scene
    assert loaded.plan == whole.plan
    assert same(loaded.samples.states, whole.samples.states)
    between = np.linspace(0, 400, 77)
    assert same(loaded(between).states, whole(between).states)
    assert_same_run(ht.extend(whole, 800), ht.extend(loaded, 800))


def test_columns_say_what_they_are(whole):
    data = whole.to_xarray()
    assert data["theta"].attrs["units"] == "rad"
    assert data["omega"].dims == ("t", "space")
    assert data["event_axis"].attrs["long_name"].endswith("in space, at an event")
    assert data["psidot"].attrs["long_name"] == "rate of the spin angle"


def test_a_stored_run_in_more_digits_is_the_run(tmp_path):
    changes = ["want.digits=30", "span.time=7", "want.samples=15"]
    wanted = 'want.quantities=["theta", "phi", "psi", "axis"]'
    whole = ht.propagate(ht.load_scene("sicm-kicked", [wanted, *changes]))
    whole.save(tmp_path / "run.nc")
    ht.propagate(ht.load_scene("sicm-kicked", ["start.phidot=-150"]))  # the loop is shared
    loaded = ht.load_trajectory(tmp_path / "run.nc")
    assert repr(loaded.decimals.samples) == repr(whole.decimals.samples)
    assert repr(loaded.decimals.events) == repr(whole.decimals.events)
    assert loaded.decimals.longest == whole.decimals.longest
    assert loaded.events.t.tolist() == whole.events.t.tolist()
    assert loaded(3.3).theta == whole(3.3).theta
    assert loaded.statistics.steps == whole.statistics.steps
    data, last = whole.to_xarray(), whole.decimals.samples[-1]
    assert data["theta_text"].to_numpy()[-1] == whole.decimals.text(last.theta)
    assert len(str(data["event_t_text"].to_numpy()[3])) > 30
