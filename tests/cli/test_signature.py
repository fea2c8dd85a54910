"""Commands are their functions: what is read from the source is what Python itself says."""

from importlib import import_module
from inspect import signature

import pytest

from heavytop.cli import app
from heavytop.cli.signature import read_function

PLACES = sorted({place for places in app.verbs.values() for place in places.split()})


@pytest.mark.parametrize("place", PLACES)
def test_parameters_and_their_defaults_are_those_of_the_function(place):
    module, _, name = place.partition(":")
    known = signature(getattr(import_module(f"heavytop.{module}"), name)).parameters
    found = signature(read_function(place)).parameters
    assert [(x.name, x.kind, x.annotation) for x in found.values()] == [
        (x.name, x.kind, x.annotation) for x in known.values()
    ]
    for name, each in found.items():
        assert each.default in (None, known[name].default)
