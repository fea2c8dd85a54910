"""`to_pandas` of a run: the bits of `to_xarray`, times as the index, names of the fields, units."""

from __future__ import annotations

import numpy as np
import pytest

import heavytop as ht

SCENE = ht.load_scene("sicm-kicked", ["span.time=0.6"])


@pytest.fixture(scope="module")
def run():
    return ht.propagate(SCENE)


def same(column, values):
    """Bit for bit, nan where there is nan."""
    np.testing.assert_array_equal(column.to_numpy(), np.asarray(values))


def test_samples_are_those_of_the_run(run):
    table, data = run.to_pandas(), run.to_xarray()
    assert table.index.name == "t"
    same(table.index, run.t)
    for name in ("theta", "phi", "psi", "thetadot", "phidot", "psidot"):
        same(table[name], data[name])
        assert table.attrs["units"][name] == data[name].attrs["units"]
    for k, letter in enumerate("xyz"):
        same(table[f"axis_{letter}"], data["axis"][:, k])
        same(table[f"omega_{letter}"], data["omega"][:, k])
    for k, state in enumerate(data["state"].values):
        same(table[f"states_{state}"], data["states"][:, k])
    assert table.attrs["units"]["t"] == "s"
    assert table.attrs["long_name"]["theta"] == data["theta"].attrs["long_name"]
    assert table.attrs["scene"] == SCENE.to_toml()
    assert not [name for name in table if name.startswith("event")]


def test_events_are_those_of_the_run(run):
    table, events = run.to_pandas(events=True), run.events
    assert len(table) == len(events) > 3
    assert tuple(table["kind"]) == events.kind
    same(table.index, events.t)
    for name in ("theta", "phi", "phidot", "residual"):
        same(table[name], getattr(events, name))
    assert table.attrs["units"]["theta"] == "rad"
    assert ht.propagate(ht.load_scene("steady-fast")).to_pandas(events=True).empty


def test_a_run_in_more_digits_has_its_decimals_too():
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=20", "span.time=0.1"]))
    assert tuple(run.to_pandas()["theta_text"]) == tuple(run.to_xarray()["theta_text"].values)
