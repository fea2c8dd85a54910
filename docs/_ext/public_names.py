"""Every public name of the package stands on a page of the API, and nothing else does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sphinx.util import logging

import heavytop

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.environment import BuildEnvironment

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


def setup(app: Sphinx) -> dict[str, object]:
    """Enter the extension."""
    app.connect("autodoc-process-docstring", without_substitutions)
    app.connect("env-check-consistency", compare)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
