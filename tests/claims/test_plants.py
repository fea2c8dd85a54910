"""Claims can fail: an error planted in a copy of the sources is caught, a plain one by three."""

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


def of_the_page():
    """Claims as docs/validation.md shows them: statement, whose numbers, measured, bound."""
    page = Path(__file__).parents[2] / "docs" / "validation.md"
    found, origins = {}, set()
    for row in page.read_text("utf-8").split("<!-- begin claims -->")[1].splitlines():
        if authority := re.match(r"\|  \| \*\*.*\*\* \((.*)\) \|", row):
            origins = set(authority[1].split(", "))
        elif claim := re.match(r"\| `([\w.-]+)` \| (.+) \| (\S+) \| (\S+) \|$", row):
            name, statement, measured, bound = claim.groups()
            found[name] = (statement.replace("\\|", "|"), origins, float(measured), float(bound))
    return found


def test_the_page_shows_the_claims_of_the_register():
    page, claims = of_the_page(), {claim.id: claim for claim in load_register().claims}
    assert page.keys() == claims.keys()
    for name, (statement, origins, _, bound) in page.items():
        claim = claims[name]
        assert (statement, bound) == (claim.statement, claim.bound)
        assert claim.numbers in origins


def test_no_bound_is_above_a_hundred_times_what_was_measured():
    for name, (_, _, measured, bound) in of_the_page().items():
        assert 0 <= measured <= bound, name
        assert not measured or bound <= 100 * measured, name


def test_plants_are_caught_by_claims_that_are_registered():
    ids = {claim.id for claim in load_register().claims}
    assert all(set(plant.quick) <= ids for plant in EVERY)


@pytest.mark.parametrize("plant", plants.FINE[4:], ids=lambda plant: plant.name)
def test_a_plant_that_is_not_measured_here_still_fits(plant, tmp_path):
    plants.planted(plant, tmp_path)
