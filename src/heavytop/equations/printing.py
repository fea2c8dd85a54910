"""Expressions as a person reads them: in a terminal, and in LaTeX.

A rate is its coordinate with dots. An equation too wide for the page is folded between the terms
of its sum, never inside one of them.
"""

from __future__ import annotations

import re
from typing import Any

import sympy as sp
from sympy.printing.latex import LatexPrinter
from sympy.printing.pretty.pretty import PrettyPrinter
from sympy.printing.pretty.pretty_symbology import line_width, pretty_symbol
from sympy.printing.pretty.stringpict import prettyForm

LATEX_WIDTH = 48  # glyphs of a displayed formula that fit between the margins
INDENT = 4

_TERMINAL = {"E_prime": "E′"}
_LATEX = {"E_prime": "E'", "V_eff": r"V_{\mathrm{eff}}"}


class _Terminal(PrettyPrinter):  # type: ignore[misc]
    """sympy's own, with p_φ and p_ψ alike: only one of them has a subscript in Unicode."""

    def _print_Symbol(self, symbol: Any) -> Any:
        return prettyForm(_in_unicode(symbol.name), binding=prettyForm.ATOM)


class _Latex(LatexPrinter):  # type: ignore[misc]
    def _print_Symbol(self, symbol: Any, style: str = "plain") -> str:
        if symbol.name in _LATEX:
            return _LATEX[symbol.name]
        return re.sub(r"^(\\d*dot\{)?l(?=[}_])", r"\1\\ell", super()._print_Symbol(symbol, style))


def _in_unicode(name: str) -> str:
    base, _, index = name.partition("_")
    if name in _TERMINAL or not index or index.isdigit():
        return _TERMINAL.get(name) or str(pretty_symbol(name))
    return f"{pretty_symbol(base)}_{pretty_symbol(index)}".replace("l", "ℓ")


def in_terminal(lhs: Any, rhs: Any, width: int = 80) -> str:
    """Return an equation as lines of text, no wider than `width` where its terms allow.

    Examples
    --------
    >>> theta, rate = sp.symbols("theta thetadot")
    >>> print(in_terminal(sp.Symbol("p_theta"), sp.Symbol("A") * rate))
    p_θ = A⋅θ̇
    """
    printer = _Terminal({"use_unicode": True, "wrap_line": False})
    left = prettyForm(*printer._print(lhs).right(" = "))
    budget = width - left.width()
    first, *others = _folded(rhs, budget, lambda part: printer._print(part).width())
    blocks = [prettyForm(*left.right(printer._print(first)))]
    for part in others:
        sign, term = ("- ", -part) if _leads_with_minus(part) else ("+ ", part)
        start = prettyForm(" " * (left.width() - 2) + sign)
        blocks.append(prettyForm(*start.right(printer._print(term))))
    return "\n".join(_trimmed(str(block)) for block in blocks)


def _trimmed(block: str) -> str:
    return "\n".join(line.rstrip() for line in block.splitlines())


def columns(text: str) -> int:
    """Return how many columns the widest line of a text takes; a combining dot takes none."""
    return max((int(line_width(line)) for line in text.splitlines()), default=0)


def in_latex(lhs: Any, rhs: Any) -> str:
    r"""Return an equation as one or more rows of an ``align*``, without the last row's ``\\``.

    Examples
    --------
    >>> print(in_latex(sp.Symbol("p_theta"), sp.Symbol("A") * sp.Symbol("thetadot")))
    p_{\theta} &= A \dot{\theta}
    """
    printer = _Latex({"fold_func_brackets": True})
    first, *others = _folded(rhs, LATEX_WIDTH, lambda part: _glyphs(printer.doprint(part)))
    rows = [f"{printer.doprint(lhs)} &= {printer.doprint(first)}"]
    for part in others:
        shown = printer.doprint(part)
        rows.append(rf"&\quad {shown if shown.startswith('-') else '+ ' + shown}")
    return " \\\\\n".join(rows)


def _glyphs(latex: str) -> int:
    """Return about how many glyphs wide a formula is; of a fraction, the wider half."""
    spaced = re.sub(r"\\(left|right|dot|ddot|operatorname|mathrm)\b", "", latex)
    fraction = re.compile(
        r"\\frac\{([^{}]*(?:\{[^{}]*\}[^{}]*)*)\}\{([^{}]*(?:\{[^{}]*\}[^{}]*)*)\}"
    )
    while found := fraction.search(spaced):
        spaced = spaced.replace(found[0], max(found[1], found[2], key=_plain))
    return _plain(spaced)


def _plain(latex: str) -> int:
    functions = re.sub(r"\\(sin|cos)\b", "xxx", latex)
    return len(re.sub(r"[{}^_\s]", "", re.sub(r"\\[a-zA-Z]+", "x", functions)))


def _folded(expression: Any, width: int, measure: Any) -> list[Any]:
    """Return the sum in parts that fit, each as long as it can be."""
    terms = expression.as_ordered_terms() if expression.is_Add else [expression]
    parts = terms[:1]
    for term in terms[1:]:
        longer = sp.Add(parts[-1], term)
        if measure(longer) <= width:
            parts[-1] = longer
        else:
            parts.append(term)
    return parts


def _leads_with_minus(part: Any) -> bool:
    first = part.as_ordered_terms()[0] if part.is_Add else part
    return bool(first.could_extract_minus_sign())
