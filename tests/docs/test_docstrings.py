"""Every public name says what it takes, returns and raises, in which units, and how good it is."""

import dataclasses
import inspect
import re
from functools import cached_property

import pytest

import heavytop as ht

ENTRY = re.compile(r"^(\w+(?:, \w+)*) : (.+)\n((?:    .*\n|\n)*)", re.MULTILINE)
FILE = re.compile(r"``((?:tests|validation)/[\w/.]+)``")
NUMERIC = re.compile(r"\b(float|number|ndarray|array_like|mpf|array)\b")
FUNCTIONS = [name for name in ht.__all__ if inspect.isfunction(getattr(ht, name))]
CLASSES = [name for name in ht.__all__ if inspect.isclass(getattr(ht, name))]
RAISED = [name for name in CLASSES if issubclass(getattr(ht, name), (Exception, Warning))]
VALUES = [name for name in CLASSES if name not in {*RAISED, "Exact", "Kind"}]


def said(thing):
    return inspect.getdoc(thing) or ""


def sections(thing):
    """The sections of a docstring, by heading."""
    parts = re.split(r"^([A-Z]\w+)\n-{3,}$", said(thing), flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def named(text):
    return {name for names, _, _ in ENTRY.findall(f"{text}\n") for name in names.split(", ")}


def taken(function):
    """The names of what a function takes, with those of a typed ``**``."""
    names = []
    for name, each in inspect.signature(function).parameters.items():
        if typed := re.fullmatch(r"Unpack\[(\w+)\]", str(each.annotation)):
            names += function.__globals__[typed[1]].__annotations__
        elif name not in {"self", "cls"}:
            names.append(name)
    return set(names)


def members(thing):
    """The public methods and properties that a class itself defines, as functions."""
    for name, member in vars(thing).items():
        found = getattr(member, "fget", None) or getattr(member, "func", member)
        found = getattr(found, "__func__", found)
        if not name.startswith("_") and inspect.isfunction(found):
            yield member, found


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_returns_and_raises(name):
    found = sections(getattr(ht, name))
    assert named(found["Parameters"]) == taken(getattr(ht, name))
    assert {"Returns", "Raises", "Examples"} <= found.keys()


@pytest.mark.parametrize("name", CLASSES)
def test_a_class_says_what_it_holds_and_its_methods_what_they_take(name):
    thing = getattr(ht, name)
    assert said(thing) not in {said(Exception), said(Warning), ""}
    every = [sections(each) for each in thing.__mro__[:-1] if each.__doc__]
    parts = ("Attributes", "Parameters")
    held = set().union(*(named(found.get(part, "")) for found in every for part in parts))
    fields = dataclasses.fields(thing) if name in VALUES and dataclasses.is_dataclass(thing) else ()
    assert {each.name for each in fields if each.name[0] != "_" and each.repr} <= held
    assert held or name not in VALUES
    for member, function in members(thing):
        first = said(function).partition("\n")[0]
        assert first, function
        if isinstance(member, (property, cached_property)):
            assert ":" not in first, "Sphinx takes what is before a colon for its type"
        elif takes := taken(function):
            assert named(sections(function).get("Parameters", "")) == takes, function


@pytest.mark.parametrize("name", FUNCTIONS + VALUES)
def test_numbers_have_units_arrays_shapes_and_notes_a_test(name):
    thing = getattr(ht, name)
    found = sections(thing)
    for heading in ("Parameters", "Attributes", "Returns"):
        for names, kind, described in ENTRY.findall(found.get(heading, "") + "\n"):
            if NUMERIC.search(kind) and names != "periods":
                assert "[" in described + kind, (names, "unit")
            if "ndarray" in kind:
                words = kind + described + said(thing).split("\n\n")[0]
                assert re.search(r"shape|of the length", words), (names, "shape")
    for text in (said(thing), *(said(each) for _, each in members(thing))):
        for note in re.findall(r"^Accuracy: (?:.+\n?)+", text, re.MULTILINE):
            # That it exists, test_pages.py sees.
            assert FILE.search(note), f"{note}  names no ``tests/…`` or ``validation/…``"
