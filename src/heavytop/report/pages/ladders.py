"""The methods and settings of a work–precision diagram, in as few words as ask for them again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from heavytop.report.pages.commands import exactly

Known = Mapping[str, Any]


def methods_asked(document: Known) -> tuple[str, ...]:
    """Return the option ``--methods`` of a diagram; nothing where it is the usual one.

    Parameters
    ----------
    document : mapping
        Its points, and what it skipped, are what was asked for.
    """
    from heavytop.studies.work_precision import DEFAULT

    tried: dict[str, dict[str, None]] = {}
    for name, setting in _settings(document):
        tried.setdefault(name, {})[setting] = None
    words = [word for name, settings in tried.items() for word in _words(name, settings)]
    return () if not words or set(words) == set(DEFAULT) else ("--methods", ",".join(words))


def _settings(document: Known) -> Iterator[tuple[str, str]]:
    for point in document["points"]:
        known = (point.get(name) for name in ("digits", "tolerance", "steps_a_period"))
        yield point["method"], _spelt(next((x for x in known if x is not None), None))
    for each in document["skipped"]:
        yield each["method"], _spelt(next(iter(each.get("setting", {}).values()), None))


def _spelt(setting: Any) -> str:
    return exactly(setting) if isinstance(setting, int | float) else ""


def _words(name: str, settings: Mapping[str, None]) -> list[str]:
    """The name, where all its settings were tried; else each of them."""
    if settings.keys() in ({""}, set(_ladder(name))):
        return [name]
    return [f"{name}={setting}" for setting in settings if setting]


def _ladder(name: str) -> list[str]:
    """All settings of a method; none of what is no method any more."""
    from heavytop.studies.methods import NoMethod, method
    from heavytop.studies.work_precision import auto_digits, grid

    try:
        if digits := auto_digits(name):
            return [str(each) for each in digits]
        return [exactly(setting) for setting in grid(method(name))]
    except NoMethod:
        return []
