"""The page of the commands: what each verb takes, from the command line itself.

Between `<!-- verbs -->` and `<!-- end verbs -->` the built page has every verb with its arguments
and options, in place of what stands there for those who read it unbuilt. At `<!-- studies -->` it
has the function of every study, and its result.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from heavytop.cli import app as heavytop
from heavytop.results.registry import RESULTS

if TYPE_CHECKING:
    from sphinx.application import Sphinx

MARK = re.compile(r"<!-- verbs -->.*?<!-- end verbs -->", re.DOTALL)
STUDIES = "<!-- studies -->"
TYPED = re.compile(r"--[a-z][-a-z]*(?: [\w.]+=[-\w.]*\w)?|(?<=\s)-o\b")

# Where what a verb puts out is told, if not on the page of its name.
PAGES = {
    "run": "results.md",
    "classify": "what-a-top-can-do.md",
    "plan": "formulations.md",
    "resume": "keeping.md",
    "stress": "where-methods-fail.md",
    "certify": "certificates.md",
    "workprec": "work-precision.md",
    "validate": "validation.md",
    "reference": "closed-form.md",
    "check": "check-a-trajectory.md",
    "film": "figures.md",
    "explore": "explorer.md",
    "derive": "theory/lagrangian.md",
    "doctor": "quickstart.md",
}


def reference() -> str:
    """All verbs, in the order of `heavytop -h`, as Markdown."""
    verbs = {name: heavytop.get_command(None, name) for name in heavytop.verbs}
    return "\n".join(line for name, verb in verbs.items() for line in section(name, verb))


def section(name: str, verb: Any) -> Iterator[str]:
    """One verb: what it does, how it is typed, what it takes."""
    page = PAGES.get(name, f"{name}.md")
    yield from (f"## {name}", "", f"{sentence(verb.help)} [More]({page}).", "")
    yield from ("```text", f"heavytop {name} {' '.join(usage(verb))}", "```", "")
    yield from ("| | what it is | left out |", "|---|---|---|")
    yield from map(row, verb.params)
    yield ""


def sentence(text: str) -> str:
    """A help text in a line, with what is typed set as such."""
    return TYPED.sub(r"`\g<0>`", " ".join(text.split()))


def usage(verb: Any) -> Iterator[str]:
    """The arguments of a verb, in brackets where they may be left out, and a word for options."""
    for each in verb.params:
        if each.param_type_name == "argument":
            named = word(each)
            optional = not each.required and not named.startswith("[")
            yield f"[{named}]" if optional else named
    yield "[OPTION…]"


def row(each: Any) -> str:
    """One argument or option, what it is, and what it is where it is left out."""
    text = sentence(each.help or "").replace("|", "\\|")
    return f"| {spelled(each)} | {text} | {fallback(each)} |"


def spelled(each: Any) -> str:
    """How it is typed: `-o DIR`, `--output DIR`."""
    if each.param_type_name == "argument":
        return f"`{word(each)}`".replace("|", "\\|")
    value = "" if each.is_flag else f" {word(each)}"
    return ", ".join(f"`{option}{value}`" for option in sorted(each.opts, key=len))


def word(each: Any) -> str:
    """The word that stands for a value, or for any number of them."""
    argument = each.param_type_name == "argument"
    named = (each.name if argument else each.metavar or each.type.name).upper()
    return f"{named}…" if each.nargs == -1 else named


def fallback(each: Any) -> str:
    """What holds where it is left out."""
    if each.required:
        return "needed"
    if not getattr(each, "show_default", False) or each.default is None:
        return ""
    return f"`{each.default:g}`" if isinstance(each.default, float) else f"`{each.default}`"


def studies() -> str:
    """The function and the result of every study, for autodoc."""
    entries = [x for x in RESULTS.values() if x.function.startswith("studies.")]
    pairs = ((x.function.partition(":")[2], x.result.partition(":")[2]) for x in entries)
    texts = (
        f".. autofunction:: heavytop.{function}\n\n.. autoclass:: heavytop.{result}\n   :members:\n"
        for function, result in pairs
    )
    return "\n".join(["```{eval-rst}", *texts, "```"])


def fill(app: Sphinx, docname: str, source: list[str]) -> None:
    """Put the verbs, or the studies, where a page asks for them."""
    source[0] = MARK.sub(lambda _: reference(), source[0]).replace(STUDIES, studies())


def setup(app: Sphinx) -> dict[str, object]:
    """Enter the extension."""
    app.connect("source-read", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
