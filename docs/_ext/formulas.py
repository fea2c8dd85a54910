"""Formulas as MathML, which browsers draw by themselves: a built page fetches nothing.

The converter from LaTeX is docutils' own; what it does not know is a warning, and fails the build.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx

# What the converter misreads, and how it is to be written: 12 is one number to it, and what
# follows a bold letter is bold, and under its accent.
CLEARER = (
    (re.compile(r"\\([dt]?frac) ?(\d)(\w)"), r"\\\1{\2}{\3}"),
    (re.compile(r"\\boldsymbol ?(\\[a-zA-Z]+|\{[^{}]*\})"), r"\\mathbf{\1}"),
)
FUNCTION = re.compile(r"<mi>(?=(?:arc)?(?:sin|cos|tan|cosh|sinh|tanh|exp|ln|log)</mi>)")

logger = logging.getLogger(__name__)


def mathml(node: nodes.Element, *, as_block: bool) -> str:
    """The MathML of one formula; its LaTeX where it cannot be converted."""
    latex = node.astext()
    for misread, clear in CLEARER:
        latex = misread.sub(clear, latex)
    try:
        found = tex2mathml(latex, as_block=as_block)
    except MathError as error:
        logger.warning("%s cannot be drawn: %s", latex, error, location=node)
        return f"<code>{latex}</code>"
    return FUNCTION.sub('<mi class="function">', found)


def inline(writer: Any, node: nodes.Element) -> None:
    """Write a formula within a sentence."""
    writer.body.append(mathml(node, as_block=False))
    raise nodes.SkipNode


def displayed(writer: Any, node: nodes.Element) -> None:
    """Write a formula on lines of its own, which a narrow window scrolls."""
    writer.body.append(f'<div style="overflow: auto hidden">{mathml(node, as_block=True)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, object]:
    """Enter the extension."""
    app.add_css_file("formulas.css")
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
