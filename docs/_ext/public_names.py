"""Every public name of the package stands on a page of the API, and nothing else does."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import groupby
from typing import TYPE_CHECKING

from sphinx.util import logging

import heavytop

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

SHARED = re.compile(r":(ivar|vartype) (\w+(?:, \w+)+):(.*)")

logger = logging.getLogger(__name__)


def compare(app: Sphinx, env: BuildEnvironment) -> None:
    """Hold the names that are documented against those of the package."""
    documented = set(env.domains["py"].objects)
    for name in heavytop.__all__:
        if f"heavytop.{name}" not in documented:
            logger.warning("heavytop.%s is public, and on no page of docs/api", name)


def without_substitutions(
    app: Sphinx, kind: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Let |x| in a docstring be a magnitude, not a substitution; examples stay as they are."""
    in_example = False
    for i, line in enumerate(lines):
        in_example = line.lstrip().startswith(">>>") or (in_example and bool(line.strip()))
        if not in_example:
            parts = line.split("``")
            parts[::2] = [part.replace("|", "\\|") for part in parts[::2]]
            lines[i] = "``".join(parts)


def one_by_one(
    app: Sphinx, kind: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Give every attribute a field of its own, where several share one description."""
    lines[:] = [line for field in fields(lines) for line in field]


def fields(lines: list[str]) -> Iterator[list[str]]:
    """The lines of a docstring, field by field; a field that several share once for each."""
    count = 0

    def number(line: str) -> int:
        nonlocal count
        count += not line.startswith(" ")
        return count

    for _, group in groupby(lines, number):
        first, *rest = group
        shared = SHARED.fullmatch(first)
        names = shared[2].split(", ") if shared else [""]
        for each in names:
            yield [f":{shared[1]} {each}:{shared[3]}" if shared else first, *rest]


def setup(app: Sphinx) -> dict[str, object]:
    """Enter the extension."""
    app.connect("autodoc-process-docstring", without_substitutions)
    app.connect("autodoc-process-docstring", one_by_one)
    app.connect("env-check-consistency", compare)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
