"""What the build of the pages makes of them: commands, verbs and formulas."""

import importlib
import re
import sys
from pathlib import Path

import pytest

from heavytop.cli import EXIT_CODES, app

EXTENSIONS = Path(__file__).parents[2] / "docs" / "_ext"
PAGE = {  # its pieces, and the command in each
    "    heavytop run sicm-kicked\n": "run sicm-kicked",
    "    .venv/bin/heavytop plan sicm-kicked # why\n": "plan sicm-kicked",
    "```sh\nheavytop classify sicm-kicked \\\n    --json\n```\n": "classify sicm-kicked --json",
    "```text\nheavytop run in-text\n```\n": None,
    "`heavytop run inline`, and heavytop run in a sentence\n": None,
    "<!-- not run: it takes an hour -->\n    heavytop run for-an-hour\n": None,
    "    heavytop scenes\n": "scenes",
}


@pytest.fixture
def extension(monkeypatch):
    pytest.importorskip("sphinx", reason="the pages are built with the extra docs")
    monkeypatch.syspath_prepend(EXTENSIONS)
    for name in ("commands", "verbs", "public_names", "formulas"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return importlib.import_module


def test_commands_are_found_where_they_are_shown_as_such(extension):
    commands = extension("commands")
    words = [" ".join(commands.less(each)[1:]) for each in commands.shown("\n".join(PAGE))]
    assert words == [command for command in PAGE.values() if command]


def test_the_reference_has_every_verb_with_all_it_takes(extension):
    source = [(EXTENSIONS.parent / "commands.md").read_text("utf-8")]
    extension("verbs").fill(None, "commands", source)
    sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", source[0], re.MULTILINE | re.DOTALL))
    verbs = {name: app.get_command(None, name) for name in app.verbs}
    assert sections.keys() == verbs.keys()
    for name, verb in verbs.items():
        [page] = re.findall(r"\[More\]\((.+?)\)", sections[name])
        assert (EXTENSIONS.parent / page).exists(), (
            f"docs/{page}, or a row of PAGES in docs/_ext/verbs.py"
        )
        said = set(re.findall(r"`(-[-\w]+)", sections[name]))
        assert said == {option for each in verb.params for option in each.opts if option[0] == "-"}


def test_the_page_has_the_exit_codes_of_the_command():
    page = (EXTENSIONS.parent / "commands.md").read_text("utf-8")
    shown = re.findall(r"^\| (\d+) \| ([^|]+) \|", page, re.MULTILINE)
    words = EXIT_CODES.removeprefix("Exit codes: ").rstrip(".").split("; ")
    known = dict(each.split(" ", 1) for each in words)
    assert {code: what.strip() for code, what in shown} == known


# --- formulas ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("latex", "parts"), [
    (r"\tfrac12 M", ["<mn>1</mn><mn>2</mn>", "<mi>M</mi>"]),
    (r"\dot{\boldsymbol\ell} = g", ["<mover", "<mi>ℓ</mi><mo", "</mover><mo>=</mo><mi>g"]),
])  # fmt: skip
def test_formulas_are_drawn_as_they_are_meant(extension, latex, parts):
    formulas = extension("formulas")
    node = importlib.import_module("docutils.nodes").math(latex, latex)
    drawn = re.sub(r">\s+<", "><", formulas.mathml(node, as_block=False))
    assert all(part in drawn for part in parts), drawn


def test_a_formula_that_cannot_be_drawn_is_a_warning(extension, monkeypatch):
    formulas, said = extension("formulas"), []
    monkeypatch.setattr(formulas.logger, "warning", lambda *words, **_: said.append(words))
    node = importlib.import_module("docutils.nodes").math("", r"\nosuchthing x")
    assert formulas.mathml(node, as_block=False) == r"<code>\nosuchthing x</code>"
    assert len(said) == 1
