"""Commands are their functions: what is read from the source is what Python itself says."""

import inspect
from importlib import import_module

import pytest

from heavytop.cli import app
from heavytop.cli.signature import (
    REQUIRED,
    parameters_of,
    read_function,
)

PLACES = sorted({place for places in app.verbs.values() for place in places.split()})


@pytest.mark.parametrize("place", PLACES)
def test_parameters_and_their_defaults_are_those_of_the_function(place):
    module, _, name = place.partition(":")
    known = inspect.signature(getattr(import_module(f"heavytop.{module}"), name)).parameters
    kinds = inspect.Parameter
    known = {n: x for n, x in known.items() if x.kind is not kinds.VAR_KEYWORD}
    found = parameters_of(read_function(place))
    assert [*found] == [*known]
    for each, said in found.items():
        default, kind = known[each].default, known[each].kind
        assert (said.default is REQUIRED) == (default is kinds.empty)
        assert said.default in (REQUIRED, None, default)
        assert said.kind == known[each].annotation
        assert said.has_place == (each == next(iter(known)) and kind is not kinds.KEYWORD_ONLY)
