"""Every public name says what it takes, returns and raises, in which units, and how good it is."""

import inspect
import re
from functools import cached_property
from importlib import import_module
from pathlib import Path

import pytest

import heavytop as ht

ROOT = Path(__file__).parents[2]
HEADING = re.compile(r"^([A-Z]\w+)\n-{3,}$", re.MULTILINE)
ENTRY = re.compile(r"^(\w+(?:, \w+)*) : (.+)\n((?:    .*\n|\n)*)", re.MULTILINE)
NOTE = re.compile(r"^Accuracy: (?:.+\n?)+", re.MULTILINE)
UNPACKED = re.compile(r"Unpack\[(\w+)\]")  # a typed dictionary: each of its keys is a keyword
FILE = re.compile(r"``((?:tests|validation)/[\w/.]+)``")

FUNCTIONS = [name for name in ht.__all__ if inspect.isfunction(getattr(ht, name))]
CLASSES = [name for name in ht.__all__ if inspect.isclass(getattr(ht, name))]
RAISED = [name for name in CLASSES if issubclass(getattr(ht, name), (Exception, Warning))]
VALUES = [name for name in CLASSES if name not in RAISED]
PLAIN = {"Exact", "Kind"}  # a number with its operations, and an enumeration

NO_UNIT = {  # numbers that count, compare or have the unit of what they are of
    "Check": {"digits"},
    "Circuit": {"s", "turns", "spin_turns"},
    "Drift": {"periods", "spread"},
    "Errors": {"energy", "invariants", "input_rounding"},
    "Facts": {"rotation_number", "nutation_amplitude", "fast_top_ratio", "fast_top_amplitude_error",
              "fast_top_precession_error", "fast_top_period_error"},
    "Plan": {"tolerance"},
    "Sample": {"quaternion", "states"},
    "Scene": {"periods"},
    "Sensitivities": {"error"},
    "Transition": {"states", "matrix", "by_parameters"},
    "Verdict": {"margin", "margin_enclosure"},
    "WorkPrecision": {"periods", "phase"},
    "Method": {"setting"},
    "drift": {"periods"},
    "work_precision": {"periods"},
}  # fmt: skip
# What the pages of the API show beside the public names: what these return, and makers of parts.
PAGES = "".join(path.read_text("utf-8") for path in (ROOT / "docs" / "api").glob("*.md"))
BESIDE = re.findall(r"auto(?:class|function):: heavytop\.(\w+[.\w]*\.\w+)$", PAGES, re.MULTILINE)

NUMERIC = re.compile(r"\b(float|number|ndarray|array_like|mpf|array)\b")
MANY = re.compile(r"\bndarray\b")
SHAPED = re.compile(r"shape|of the length")


def said(thing):
    return inspect.getdoc(thing) or ""


def sections(thing):
    """Return the sections of a docstring, by heading."""
    parts = HEADING.split(said(thing))
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def entries(text):
    """Return (names, type, description) of every entry of a section."""
    for names, kind, described in ENTRY.findall(f"{text}\n"):
        yield names.split(", "), kind, described


def named(text):
    return {name for names, _, _ in entries(text) for name in names}


def taken(function):
    """Return the names of what a function takes, with those of a typed ``**``."""
    names = []
    for name, each in inspect.signature(function).parameters.items():
        if typed := UNPACKED.fullmatch(str(each.annotation)):
            names += function.__globals__[typed[1]].__annotations__
        elif name not in {"self", "cls"}:
            names.append(name)
    return names


def told(thing):
    """Return the names that a docstring describes, those of what a class inherits among them."""
    every = thing.__mro__[:-1] if inspect.isclass(thing) else (thing,)
    found = [sections(each) for each in every if each.__doc__]
    return set().union(*(named(each.get(part, "")) for each in found
                         for part in ("Attributes", "Parameters")))  # fmt: skip


def plain(member):
    """Return the function behind a method, a property or a class method."""
    found = getattr(member, "fget", None) or getattr(member, "func", member)
    return getattr(found, "__func__", found)


def members(thing):
    """Return the public methods and properties that a class itself defines, by name."""
    for name, member in vars(thing).items():
        if not name.startswith("_") and inspect.isfunction(plain(member)):
            yield name, plain(member)


def method(name):
    owner, _, each = name.partition(".")
    return plain(vars(getattr(ht, owner))[each])


METHODS = [f"{name}.{each}" for name in CLASSES for each, _ in members(getattr(ht, name))]
TAKING = [name for name in METHODS if taken(method(name))]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_says_what_it_takes_returns_and_raises(name):
    found = sections(getattr(ht, name))
    assert named(found["Parameters"]) == set(taken(getattr(ht, name)))
    assert {"Returns", "Raises", "Examples"} <= found.keys()


@pytest.mark.parametrize("name", [name for name in VALUES if name not in PLAIN])
def test_a_value_says_what_it_holds(name):
    thing = getattr(ht, name)
    held = told(thing)
    fields = getattr(thing, "__dataclass_fields__", {})
    public = {field for field, each in fields.items() if field[0] != "_" and each.repr}
    assert public <= held
    assert held


@pytest.mark.parametrize("name", RAISED)
def test_what_is_raised_says_when(name):
    thing = getattr(ht, name)
    assert said(thing) not in {said(Exception), said(Warning), ""}
    if "__init__" in vars(thing):
        held = vars(thing)["__init__"].__code__.co_names
        kept = {each for each in held if each in taken(thing)}
        assert kept <= named(sections(thing).get("Attributes", "")), kept


@pytest.mark.parametrize("name", METHODS)
def test_every_method_is_described(name):
    first = said(method(name)).partition("\n")[0]
    assert first
    owner, _, each = name.partition(".")
    if isinstance(vars(getattr(ht, owner))[each], (property, cached_property)):
        assert ":" not in first, "of a property, Sphinx takes what is before a colon for its type"


@pytest.mark.parametrize("name", TAKING)
def test_a_method_says_what_it_takes(name):
    assert named(sections(method(name)).get("Parameters", "")) == set(taken(method(name)))


@pytest.mark.parametrize("name", FUNCTIONS + [name for name in VALUES if name not in PLAIN])
def test_numbers_have_units_and_arrays_shapes(name):
    thing = getattr(ht, name)
    found = sections(thing)
    for heading in ("Parameters", "Attributes", "Returns"):
        for names, kind, described in entries(found.get(heading, "")):
            if NUMERIC.search(kind) and not set(names) <= NO_UNIT.get(name, set()):
                assert "[" in described + kind, (names, "unit")
            if MANY.search(kind):
                assert SHAPED.search(kind + described + said(thing).split("\n\n")[0]), (
                    names,
                    "shape",
                )


@pytest.mark.parametrize("name", FUNCTIONS + VALUES)
def test_a_note_on_accuracy_names_a_test_or_a_script_that_is_there(name):
    thing = getattr(ht, name)
    for text in (said(thing), *(said(each) for _, each in members(thing))):
        for note in NOTE.findall(text):
            files = FILE.findall(note)
            assert files, note
            assert all((ROOT / each).exists() for each in files), note


@pytest.mark.parametrize("path", BESIDE)
def test_what_stands_beside_them_says_what_it_is(path):
    module, _, name = path.rpartition(".")
    thing = getattr(import_module(f"heavytop.{module}"), name)
    found = sections(thing)
    held = told(thing)
    if inspect.isclass(thing):
        fields = getattr(thing, "__dataclass_fields__", None) or getattr(thing, "_fields", ())
        asked = {each for each in fields if each[0] != "_"}
        for each, function in members(thing):
            assert set(taken(function)) <= named(sections(function).get("Parameters", "")), each
    else:
        asked = set(taken(thing))
        assert {"Returns", "Yields"} & found.keys()
    assert asked <= held
