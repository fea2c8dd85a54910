"""Every public name says what it takes, returns and raises: the pages of the API rest on it."""

import inspect
import re

import pytest

import heavytop as ht

HEADING = re.compile(r"^(\w+)\n-{3,}$", re.MULTILINE)
FUNCTIONS = [name for name in ht.__all__ if inspect.isfunction(getattr(ht, name))]
CLASSES = [name for name in ht.__all__ if inspect.isclass(getattr(ht, name))]
RAISES_NOTHING = {"classify", "run_errors"}
PLAIN = {"Exact", "Kind"}  # a number with its operations, and an enumeration


def sections(thing):
    """Return the sections of a docstring, by heading."""
    parts = HEADING.split(inspect.getdoc(thing) or "")
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_returns_and_raises(name):
    function = getattr(ht, name)
    found = sections(function)
    assert "Returns" in found
    assert "Raises" in found or name in RAISES_NOTHING
    for parameter in inspect.signature(function).parameters:
        assert re.search(rf"^(\w+, )*{parameter}\b.* : ", found["Parameters"], re.MULTILINE), (
            parameter
        )


@pytest.mark.parametrize("name", CLASSES)
def test_a_class_says_what_it_holds(name):
    thing = getattr(ht, name)
    said = inspect.getdoc(thing)
    assert said != inspect.getdoc(Exception)
    if not issubclass(thing, Exception) and name not in PLAIN:
        assert {"Attributes", "Parameters"} & set(sections(thing))


def members(thing):
    """Return the public methods and properties that a class itself defines, by name."""
    for name, member in vars(thing).items():
        plain = getattr(member, "fget", None) or getattr(member, "func", member)
        plain = getattr(plain, "__func__", plain)
        if not name.startswith("_") and inspect.isfunction(plain):
            yield name, plain


@pytest.mark.parametrize("name", CLASSES)
def test_every_method_is_described(name):
    assert not [each for each, plain in members(getattr(ht, name)) if not inspect.getdoc(plain)]
