"""Claims can fail: an error planted in a copy of the sources is caught, a plain one by three."""

import csv
import sys
from importlib import import_module
from pathlib import Path

import pytest

from heavytop.claims import load_claims, validate

sys.path.insert(0, str(Path(__file__).parents[2] / "validation"))
plants = import_module("plants")
sys.path.pop(0)


EVERY = (*plants.PLANTS, *plants.FINE)


# of the fine ones, those caught soonest
@pytest.mark.slow
@pytest.mark.parametrize("plant", [*plants.PLANTS, *plants.FINE[:4]], ids=lambda each: each.name)
def test_an_error_is_caught(plant):
    assert set(plants.catch(plant, plant.quick)) == set(plant.quick)


def test_a_plain_error_is_caught_by_three_claims_and_a_fine_one_by_some():
    assert all(len(plant.quick) >= 3 for plant in plants.PLANTS)
    assert all(plant.quick for plant in plants.FINE)


@pytest.mark.slow
def test_without_an_error_the_same_claims_hold():
    found = validate(sorted({name for plant in EVERY for name in plant.quick}))
    assert found.counts["passed"] == len(found.claims)


def test_a_plant_that_no_longer_fits_is_no_plant(tmp_path):
    plant = plants.Plant("nothing", "equations/lagrangian.py", {"no such text": ""}, "")
    with pytest.raises(ValueError, match="0 times"):
        plants.planted(plant, tmp_path)


@pytest.fixture
def known():
    return {claim.id: claim for claim in load_claims().values() if not claim.is_proof}


@pytest.fixture
def found():
    """What claims measured, by the file beside the register."""
    with (Path(plants.__file__).with_name("measured.csv")).open(encoding="utf-8") as file:
        return {row["claim"]: float(row["measured"]) for row in csv.DictReader(file)}


def test_the_page_has_every_authority_with_what_was_measured(known, found, script):
    page = Path(__file__).parents[2] / "docs" / "validation.md"
    rows = [known[name].judge(value) for name, value in found.items() if name in known]
    table = script("page").claims_table({"claims": rows})
    how = "heavytop validate --json | python validation/page.py writes docs/validation.md"
    assert table in page.read_text("utf-8"), how


def test_no_bound_is_above_a_hundred_times_what_was_measured(known, found):
    """And plants are caught by claims that are registered."""
    unlike = sorted(found.keys() ^ known.keys())
    how = "heavytop validate NAME --json | python validation/page.py writes measured.csv"
    assert not unlike, f"{how}, which lacks, or has in vain, {', '.join(unlike)}"
    for name, value in found.items():
        bound = known[name].bound
        assert 0 <= value <= bound, name
        assert not value or bound <= 100 * value, f"{name}: a bound {bound:g} for {value:g}"
    assert {name for plant in EVERY for name in plant.quick} <= known.keys()


@pytest.mark.parametrize("plant", plants.FINE[4:], ids=lambda plant: plant.name)
def test_a_plant_that_is_not_measured_here_still_fits(plant, tmp_path):
    plants.planted(plant, tmp_path)
