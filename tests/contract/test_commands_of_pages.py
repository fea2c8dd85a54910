"""What the build of the pages takes for a command, and what it runs in the stead of a long one."""

import sys
from pathlib import Path

import pytest

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
def commands(monkeypatch):
    pytest.importorskip("sphinx", reason="the pages are built with the extra docs")
    monkeypatch.syspath_prepend(EXTENSIONS)
    monkeypatch.delitem(sys.modules, "commands", raising=False)
    import commands

    return commands


def test_commands_are_found_where_they_are_shown_as_such(commands):
    words = [commands.less(each) for each in commands.shown(PAGE)]
    assert [" ".join(each[1:]) for each in words] == [
        "run sicm-kicked",
        "plan sicm-kicked",
        "classify sicm-kicked --json",
        "scenes",
    ]


@pytest.mark.parametrize(
    ("said", "run"),
    [
        ("drift top --periods 1e6 --methods a,b", "drift top --periods 30 --methods a,b"),
        ("atlas top --x a=-20:20:2000", "atlas top --x a=-20:20:24"),
        ("resume study --scheduler tcp://192.168.0.2:8786  # later", "resume study"),
        ("run top --set 'want.quantities=[\"theta\"]'", 'run top --set want.quantities=["theta"]'),
        ("validate --proofs", "validate 39_flint"),
        ("stress --list", "stress --list"),
    ],
)
def test_hours_become_seconds_and_the_verb_stays(commands, said, run):
    assert " ".join(commands.less(f"heavytop {said}")[1:]) == run


def test_the_readme_shows_commands(commands):
    readme = EXTENSIONS.parents[1] / "README.md"
    assert len(list(commands.shown(readme.read_text("utf-8")))) >= 10
