"""Every claim can fail: an error planted in a copy of the sources is caught by three or more."""

import re
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


def of_the_page():
    """Claims as docs/validation.md shows them: name, numbers, measured, bound."""
    page = Path(__file__).parents[2] / "docs" / "validation.md"
    rows = re.findall(r"^\| `([\w.-]+)` \| (.+) \|$", page.read_text("utf-8"), re.M)
    cells = [(name, rest.split(" | ")) for name, rest in rows]
    return {name: (each[-3], float(each[-2]), float(each[-1])) for name, each in cells}


def test_the_page_shows_the_claims_of_the_register():
    claims = {claim.id: (claim.numbers, claim.bound) for claim in load_register().claims}
    assert {name: (found[0], found[2]) for name, found in of_the_page().items()} == claims


def test_no_bound_is_above_a_hundred_times_what_was_measured():
    for name, (_, measured, bound) in of_the_page().items():
        assert 0 <= measured <= bound, name
        assert not measured or bound <= 100 * measured, name


def test_plants_are_caught_by_claims_that_are_registered():
    ids = {claim.id for claim in load_register().claims}
    assert all(set(plant.quick) <= ids for plant in plants.PLANTS)
