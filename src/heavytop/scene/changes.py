"""Changes to a scene, KEY=VALUE each: what is asked for by ``--set``, and by ``overrides``."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any, Final

from heavytop.errors import Fault
from heavytop.scene import text as scene_text
from heavytop.scene.arguments import told
from heavytop.scene.text import MAX_TITLE
from heavytop.spelling import harmless

CHANGES: Final = "--set"
RIVALS: Final = {  # a change to one takes the other's place
    "span.time": "periods",
    "span.periods": "time",
    "start.psidot": "omega3",
    "start.omega3": "psidot",
}
_LONGEST: Final = 120  # of changes, told in a title
_OF_THE_MOTION: Final = ("top.", "start.")


def overridden(raw: dict[str, Any], overrides: Sequence[str]) -> tuple[set[str], list[Fault]]:
    """Change `raw` as asked; the keys that were changed, and the changes that cannot be made."""
    changed: dict[str, str] = {}
    faults: list[Fault] = []
    if not _are_texts(overrides):
        rule = 'a list of texts, such as ["start.phidot=-14"]'
        value = (scene_text.shown if isinstance(overrides, list | tuple) else told)(overrides)
        return set(), [Fault("heavytop", None, "overrides", value, rule)]
    for change in overrides:
        key, equals, text = change.partition("=")
        key = key.strip()
        *tables, last = key.split(".")
        readable = bool(equals and last) and len(tables) < 2
        table = raw.setdefault(tables[0], {}) if tables and readable else raw
        if not readable or not isinstance(table, dict):
            rule = "a change is KEY=VALUE, such as start.phidot=-14"
            faults.append(Fault(CHANGES, None, harmless(change[:60]), "", rule))
            continue
        if key in RIVALS:
            table.pop(RIVALS[key], None)
        table[last] = _override_value(text)
        changed[key] = text.strip().strip("\"'")
    _retitle(raw, changed)
    return set(changed), faults


def _are_texts(overrides: object) -> bool:
    if isinstance(overrides, str | Mapping) or not isinstance(overrides, Collection):
        return False
    return all(isinstance(each, str) for each in overrides)


def _override_value(text: str) -> object:
    """A TOML value where it is one, else the text itself: no quotes needed around pi/3."""
    try:
        value = scene_text.parse(f"value = {text}")
    except ValueError:
        return text.strip()
    return value["value"] if value.keys() == {"value"} else text.strip()


def _retitle(raw: dict[str, Any], changes: Mapping[str, str]) -> None:
    """Say in title and source that top or start were changed, where these texts were not.

    Without it a scene goes on asserting what its changes may have undone.
    """
    told = [f"{k[:60]} = {v[:60]}" for k, v in changes.items() if k.startswith(_OF_THE_MOTION)]
    title, source = _of_a_scene(raw, "title"), _of_a_scene(raw, "source")
    if told and title and "title" not in changes:
        these = _cut(harmless(", ".join(told)), _LONGEST)
        raw["title"] = _cut(f"{title}; with {these}", MAX_TITLE)
    if told and source and "source" not in changes:
        raw["source"] = _cut(f"changed from {source}", MAX_TITLE)


def _of_a_scene(raw: Mapping[str, object], key: str) -> str:
    """A text of a scene that may be added to; empty where there is none, or a wrong one."""
    text = raw.get(key)
    return text if type(text) is str and len(text) <= MAX_TITLE else ""


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"
