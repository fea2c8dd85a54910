"""Every claim can fail: an error planted in a copy of the sources is caught by three or more."""

import sys
from importlib import import_module
from pathlib import Path

import pytest

from heavytop.claims.register import load_register

sys.path.insert(0, str(Path(__file__).parents[2] / "validation"))
plants = import_module("plants")
sys.path.pop(0)


@pytest.mark.parametrize("plant", plants.PLANTS, ids=lambda plant: plant.name)
def test_an_error_is_caught(plant):
    assert len(plant.quick) >= 3
    assert set(plants.catch(plant, plant.quick)) == set(plant.quick)


def test_without_an_error_the_same_claims_hold():
    from heavytop.claims.validating import validate

    found = validate(sorted({name for plant in plants.PLANTS for name in plant.quick}))
    assert found.counts["passed"] == len(found.results)


def test_a_plant_that_no_longer_fits_is_no_plant(tmp_path):
    gone = plants.Plant("nothing", "models/lagrangian.py", (("no such text", ""),), ())
    with pytest.raises(ValueError, match="0 times"):
        plants.planted(gone, tmp_path)


def test_plants_are_caught_by_claims_that_are_registered():
    ids = {claim.id for claim in load_register().claims}
    assert all(set(plant.quick) <= ids for plant in plants.PLANTS)
