"""The kinds of study, and the module that does the tasks of each.

A file may name a kind, never a module: nothing on disk decides what code runs.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import cast

from heavytop.errors import ForeignFile
from heavytop.studies.ledger.piece import Follower
from heavytop.studies.ledger.study import Identity, Study

KINDS: Mapping[str, str] = {
    "drift": "heavytop.studies.drifts.follow",
}


def study_of(identity: Identity, kinds: Mapping[str, str] = KINDS) -> Study:
    """The study an identity stands for; its ``kind`` is looked up in the table.

    Raises
    ------
    ForeignFile
        The kind is unknown, or its tasks have names that no folder can have.
    """
    module = module_of(identity, kinds)
    try:
        return Study(identity, tuple(follower(module).tasks(identity)), module)
    except ValueError as fault:
        raise ForeignFile(f"kind = {identity['kind']!r}: {fault}") from None


def module_of(identity: Identity, kinds: Mapping[str, str] = KINDS) -> str:
    """The module that does the tasks of a study.

    Raises
    ------
    ForeignFile
        The kind is unknown.
    """
    kind = identity.get("kind")
    module = kinds.get(kind) if isinstance(kind, str) else None
    if module is None:
        known = ", ".join(sorted(kinds)) or "none"
        raise ForeignFile(f"kind = {kind!r}: not a kind of study known here ({known})")
    return module


def follower(module: str) -> Follower:
    """The module that does the tasks of a kind."""
    return cast(Follower, import_module(module))
