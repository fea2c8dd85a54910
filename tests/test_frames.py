"""`to_pandas`: the bits of `to_xarray`, times as the index, names of the fields, and units."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht

SCENE = ht.load_scene("sicm-kicked", ["span.time=0.6"])


@pytest.fixture(scope="module")
def run():
    return ht.propagate(SCENE)


@pytest.fixture(scope="module")
def drift():
    methods = ["taylor-axis", "taylor-cubic"]
    return ht.drift(SCENE, methods=methods, periods=5, ensemble=2, samples=5)


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


def test_errors_of_a_drift_are_by_method_and_time(drift):
    table, data = drift.to_pandas(), drift.to_xarray()
    assert table.index.names == ["scheme", "periods"]
    assert set(table) == {n for n, x in data.items() if x.dims == ("scheme", "mark")} - {"periods"}
    for method in drift.methods:
        one = table.loc[method.name]
        same(one.index, method.periods)
        for name in table:
            same(one[name], data[name].sel(scheme=method.name)[: len(one)])
    assert table.attrs["units"]["phase_s"] == "s"


def test_errors_of_every_run_of_a_drift(drift):
    table = drift.to_pandas(members=True)
    assert table.index.names == ["scheme", "start", "periods"]
    for method in drift.methods:
        for k, member in enumerate(method.members):
            one = table.loc[method.name, k]
            same(one.index, member.periods)
            same(one["member_energy"], np.array(member.energy, float))


def test_a_run_that_ended_early_has_no_empty_rows(drift):
    short = replace(drift.methods[1], periods=drift.methods[1].periods[:2])
    table = replace(drift, methods=(drift.methods[0], short)).to_pandas()
    assert table.loc[short.name].index.tolist() == list(short.periods)


def test_pixels_of_an_atlas_are_rows():
    atlas = ht.atlas(SCENE, x="phidot=-30:40:4", y="theta=0.1:1.5:3", jobs=1)
    table = atlas.to_pandas()
    assert table.index.names == ["theta", "phidot"]
    for name in atlas.columns:
        assert table[name].dtype == atlas[name].dtype
        same(table[name], atlas[name].ravel())
    theta, phidot = (axis.values for axis in (atlas.plane.y, atlas.plane.x))
    assert table.loc[(theta[2], phidot[1]), "period"] == atlas["period"][2, 1]
    assert table.attrs["units"]["period"] == "s"
