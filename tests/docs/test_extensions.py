"""What the build of the pages makes of them: commands, verbs, notebooks and formulas."""

import importlib
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from heavytop.cli import EXIT_CODES, app

EXTENSIONS = Path(__file__).parents[2] / "docs" / "_ext"
PAGE = """# A page

    heavytop run sicm-kicked
    .venv/bin/heavytop plan sicm-kicked # why
    u = cos θ

```sh
heavytop classify sicm-kicked \\
    --json
make run
```

```python
    heavytop run in-python
```

```text
heavytop run in-text
```

`heavytop run inline`, and heavytop run in a sentence

<!-- not run: it takes an hour -->
    heavytop run for-an-hour

    heavytop scenes
"""


@pytest.fixture
def extension(monkeypatch):
    pytest.importorskip("sphinx", reason="the pages are built with the extra docs")
    monkeypatch.syspath_prepend(EXTENSIONS)
    for name in ("commands", "verbs", "public_names", "notebooks", "formulas"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return importlib.import_module


@pytest.fixture
def commands(extension):
    return extension("commands")


def test_commands_are_found_where_they_are_shown_as_such(commands):
    words = [" ".join(commands.less(each)[1:]) for each in commands.shown(PAGE)]
    found = ["run sicm-kicked", "plan sicm-kicked", "classify sicm-kicked --json", "scenes"]
    assert words == found
    readme = EXTENSIONS.parents[1] / "README.md"
    assert len(list(commands.shown(readme.read_text("utf-8")))) >= 5


@pytest.mark.parametrize(
    ("said", "run"),
    [
        ("drift top --periods 1e6 --methods a,b", "drift top --periods 30 --methods a,b"),
        ("atlas top --x a=-20:20:2000", "atlas top --x a=-20:20:24"),
        ("reference top --times 0:2:0.01", "reference top --times 0:2:0.01"),
        ("resume study --scheduler tcp://192.168.0.2:8786  # later", "resume study"),
        ("validate --proofs", "validate 39_flint"),
        ("report my-scene.toml -o out/page.html", "report sicm-forward -o out/page.html"),
    ],
)
def test_hours_become_seconds_and_the_verb_stays(commands, said, run):
    assert " ".join(commands.less(f"heavytop {said}")[1:]) == run


def test_the_reference_has_every_verb_with_all_it_takes(extension):
    reference = extension("verbs").reference()
    sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", reference, re.MULTILINE | re.DOTALL))
    verbs = {name: app.get_command(None, name) for name in app.verbs}
    assert sections.keys() == verbs.keys()
    for name, verb in verbs.items():
        said = set(re.findall(r"`(-[-\w]+)", sections[name]))
        assert said == {option for each in verb.params for option in each.opts if option[0] == "-"}


def test_the_page_of_commands_has_the_reference_when_it_is_built(extension):
    source = [(EXTENSIONS.parent / "commands.md").read_text("utf-8")]
    extension("verbs").fill(None, "commands", source)
    assert extension("verbs").reference() in source[0]
    assert "make docs" not in source[0]


def test_the_page_has_the_exit_codes_of_the_command():
    page = (EXTENSIONS.parent / "commands.md").read_text("utf-8")
    shown = re.findall(r"^\| (\d+) \| ([^|]+) \|", page, re.MULTILINE)
    words = EXIT_CODES.removeprefix("Exit codes: ").rstrip(".").split("; ")
    told = dict(each.split(" ", 1) for each in words)
    assert {code: what.strip() for code, what in shown} == told


# --- notebooks and formulas ----------------------------------------------------------------------


def test_notebooks_are_copied_with_their_links_and_nothing_else_is_left(extension, tmp_path):
    notebooks = extension("notebooks")
    (tmp_path / "examples").mkdir()
    (tmp_path / "examples" / "gone.ipynb").touch()
    notebooks.copy(SimpleNamespace(srcdir=tmp_path))
    names = {path.name for path in notebooks.EXAMPLES.glob("*.ipynb")}
    assert names == {path.name for path in (tmp_path / "examples").iterdir()}
    copied = (tmp_path / "examples" / "2-cusps-loops-waves.ipynb").read_text("utf-8")
    assert "](../kicks.md)" in copied
    assert "](../docs/" not in copied


@pytest.mark.parametrize(
    ("written", "built"),
    [
        ("[a](../examples/1.ipynb)", "[a](examples/1.ipynb)"),
        ("[a](../../examples/1.ipynb)", "[a](../examples/1.ipynb)"),
        ("[a](kicks.md)", "[a](kicks.md)"),
    ],
)
def test_links_of_pages_lead_to_the_copies(extension, written, built):
    source = [written]
    extension("notebooks").lead(None, "page", source)
    assert source == [built]


@pytest.mark.parametrize(
    ("latex", "parts"),
    [
        (r"\tfrac12 M", ["<mn>1</mn><mn>2</mn>", "<mi>M</mi>"]),
        (r"\dot{\boldsymbol\ell} = g", ["<mover", "<mi>ℓ</mi><mo", "</mover><mo>=</mo><mi>g"]),
        (r"A\sin\theta", ['<mi>A</mi><mi class="function">sin</mi>']),
    ],
)
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
