"""Pages of plain Markdown, executed: what a page shows is what it prints.

A ```python block becomes a code cell. The ```text block behind it, if there is one, is what it is
to print, number by number to the last digit shown; on the built page stands what was printed.
"""

from __future__ import annotations

import importlib.util
import logging as stdlib_logging
import os
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from docutils import nodes
from jupyter_cache import get_cache
from sphinx.util import logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx

AGREEMENT = Path(__file__).parents[2] / "tests" / "docs" / "pages_agree.py"
HEADER = "---\nfile_format: mystnb\nkernelspec: {name: python3}\n---\n"
SHOWN = "heavytop_shown"

logger = logging.getLogger(__name__)


def agreement():
    """The rule by which the tests compare pages too."""
    spec = importlib.util.spec_from_file_location("pages_agree", AGREEMENT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


RULE = agreement()


def to_cells(app: Sphinx, docname: str, source: list[str]) -> None:
    """Turn the blocks of one page into cells, and keep what they are to print."""
    if Path(app.env.doc2path(docname)).suffix == ".ipynb":
        return  # it has cells, and no outputs beside which to hold what they print
    blocks = list(RULE.BLOCK.finditer(source[0]))
    app.env.temp_data[SHOWN] = [block[2] or "" for block in blocks]
    if blocks:
        source[0] = HEADER + RULE.BLOCK.sub(as_cell, source[0])


def as_cell(block: re.Match[str]) -> str:
    """One cell, and as many lines as there were, so that warnings name the right one."""
    cell = f"```{{code-cell}}\n{block[1]}```\n"
    return cell + "\n" * (block[0].count("\n") - cell.count("\n"))


def compare(app: Sphinx, doctree: nodes.document) -> None:
    """Hold what the cells of a page printed against what it shows."""
    if SHOWN not in app.env.temp_data:
        return
    shown = app.env.temp_data[SHOWN]
    cells = [each for each in doctree.findall(nodes.container) if is_part(each, "cell_code")]
    if len(cells) != len(shown):
        logger.warning("%d blocks, %d cells", len(shown), len(cells), location=doctree)
    for text, cell in zip(shown, cells, strict=False):
        if not RULE.agree(text, printed(cell)):
            message = "the page shows\n%s\nbut it prints\n%s"
            logger.warning(message, text, printed(cell), location=cell)


def printed(cell: nodes.container) -> str:
    """The text of all outputs of a cell."""
    outputs = (each for each in cell.findall(nodes.container) if is_part(each, "cell_code_output"))
    blocks = (block for each in outputs for block in each.findall(nodes.literal_block))
    return "".join(block.astext().rstrip("\n") + "\n" for block in blocks)


def is_part(container: nodes.container, name: str) -> bool:
    """Whether a container is a cell, or the output of one."""
    return container.get("nb_element") == name


# A kernel tells of errors only, and sends what a cell prints at its end, in one piece.
KERNEL = """c = get_config()
c.IPKernelApp.log_level = 40
from ipykernel.iostream import OutStream
OutStream.flush_interval = 3600.0
"""


def configure_kernels() -> None:
    """Write the kernels' configuration, and quieten those who start them."""
    profile = Path(os.environ["IPYTHONDIR"]) / "profile_default"
    profile.mkdir(parents=True, exist_ok=True)
    (profile / "ipython_kernel_config.py").write_text(KERNEL)
    stdlib_logging.getLogger("traitlets").setLevel(stdlib_logging.ERROR)


def open_cache(app: Sphinx) -> None:
    """Make the cache of this state of the code; drop those of others."""
    configure_kernels()
    here = Path(app.config.nb_execution_cache_path)
    for other in here.parent.glob("[0-9a-f]*"):
        if other != here:
            shutil.rmtree(other, ignore_errors=True)
    here.mkdir(parents=True, exist_ok=True)
    get_cache(str(here)).list_cache_records()


def setup(app: Sphinx) -> dict[str, object]:
    """Enter the extension."""
    app.connect("builder-inited", open_cache)
    app.connect("source-read", to_cells)
    app.connect("doctree-read", compare)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
