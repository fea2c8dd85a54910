"""The notebooks of examples/ are pages too: a copy of each is executed in docs/examples.

Git ignores the copies. A link is written as it leads somewhere in the repository, on a page as
`../examples/NAME.ipynb` and in a notebook as `../docs/PAGE.md`; here it becomes that of the site.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

EXAMPLES = Path(__file__).parents[2] / "examples"
FROM_PAGE = re.compile(r"\]\(\.\./((?:\.\./)*)examples/")
FROM_NOTEBOOK = "](../docs/"


def copy(app: Sphinx) -> None:
    """Put a copy of every notebook where Sphinx looks for pages, and take away those of others."""
    folder = Path(app.srcdir) / EXAMPLES.name
    folder.mkdir(exist_ok=True)
    here = {path.name: path for path in EXAMPLES.glob("*.ipynb")}
    for old in folder.glob("*.ipynb"):
        if old.name not in here:
            old.unlink()
    for name, path in here.items():
        (folder / name).write_text(path.read_text("utf-8").replace(FROM_NOTEBOOK, "](../"), "utf-8")


def lead(app: Sphinx, docname: str, source: list[str]) -> None:
    """Let the links of a page lead to the copies."""
    source[0] = FROM_PAGE.sub(r"](\1examples/", source[0])


def setup(app: Sphinx) -> dict[str, object]:
    """Enter the extension."""
    app.connect("builder-inited", copy)
    app.connect("source-read", lead)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
