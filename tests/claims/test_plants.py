"""Claims can fail: an error planted in a copy of the sources is caught, a plain one by three."""

import csv
import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

from heavytop.claims.register import load_register

sys.path.insert(0, str(Path(__file__).parents[2] / "validation"))
plants = import_module("plants")
sys.path.pop(0)


EVERY = (*plants.PLANTS, *plants.FINE)
HELD = (*plants.PLANTS, *plants.FINE[:4])  # of the fine ones, those caught soonest


@pytest.mark.slow
@pytest.mark.parametrize("plant", HELD, ids=lambda plant: plant.name)
def test_an_error_is_caught(plant):
    assert set(plants.catch(plant, plant.quick)) == set(plant.quick)


def test_a_plain_error_is_caught_by_three_claims_and_a_fine_one_by_some():
    assert all(len(plant.quick) >= 3 for plant in plants.PLANTS)
    assert all(plant.quick for plant in plants.FINE)


@pytest.mark.slow
def test_without_an_error_the_same_claims_hold():
    from heavytop.claims.validate import validate

    found = validate(sorted({name for plant in EVERY for name in plant.quick}))
    assert found.counts["passed"] == len(found.claims)


def test_a_plant_that_no_longer_fits_is_no_plant(tmp_path):
    gone = plants.Plant("nothing", "equations/lagrangian.py", (("no such text", ""),), ())
    with pytest.raises(ValueError, match="0 times"):
        plants.planted(gone, tmp_path)


def measured():
    """What every claim measured, from the file beside the register."""
    with (Path(plants.__file__).with_name("measured.csv")).open(encoding="utf-8") as file:
        return {row["claim"]: float(row["measured"]) for row in csv.DictReader(file)}


def test_the_page_shows_of_every_authority_the_claim_that_takes_most_of_its_bound():
    found, by_authority = measured(), {}
    for claim in load_register().claims:
        by_authority.setdefault(claim.authority, []).append(claim)
    page = Path(__file__).parents[2] / "docs" / "validation.md"
    table = page.read_text("utf-8").split("<!-- begin claims -->")[1].split("<!-- end")[0]
    rows = re.findall(
        r"^\| (.+) \((.+?)\) \| (\d+) \| `(.+?)`: (.+) \| (\S+) \| (\S+) \|$", table, re.M
    )
    assert [row[0] for row in rows] == list(by_authority)
    for authority, origins, many, name, statement, value, bound in rows:
        claims = {claim.id: claim for claim in by_authority[authority]}
        shares = {each: found[each] / claims[each].bound for each in claims if claims[each].bound}
        assert int(many) == len(claims)
        assert set(origins.split(", ")) == {claim.numbers for claim in claims.values()}
        assert (statement.replace("\\|", "|"), float(bound)) == (
            claims[name].statement,
            claims[name].bound,
        )
        assert float(value) == found[name]
        assert shares[name] == max(shares.values())


def test_no_bound_is_above_a_hundred_times_what_was_measured():
    found = measured()
    claims = load_register().claims
    assert found.keys() == {claim.id for claim in claims}
    for claim in claims:
        value = found[claim.id]
        assert 0 <= value <= claim.bound, claim.id
        assert not value or claim.bound <= 100 * value, claim.id


def test_plants_are_caught_by_claims_that_are_registered():
    ids = {claim.id for claim in load_register().claims}
    assert all(set(plant.quick) <= ids for plant in EVERY)


@pytest.mark.parametrize("plant", plants.FINE[4:], ids=lambda plant: plant.name)
def test_a_plant_that_is_not_measured_here_still_fits(plant, tmp_path):
    plants.planted(plant, tmp_path)
