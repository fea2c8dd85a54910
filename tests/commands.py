"""The command in this process: what it says, and how it ends where its run fails."""

import json
from unittest.mock import Mock

from click.testing import CliRunner

import heavytop.run.propagation
from heavytop.cli import app


def heavytop_(*words):
    return CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "100"})


def printed(*words):
    """What a command says that ends well."""
    found = heavytop_(*words)
    assert found.exit_code == 0, found.output
    return found.stdout


def document(*words):
    """What a command says in JSON that ends well."""
    return json.loads(printed(*words, "--json"))


def refused(code, *words):
    """What a command says on stderr that ends with a code."""
    found = heavytop_(*words)
    assert found.exit_code == code, found.output
    return found.stderr


def names(folder):
    """What lies in a folder beside its journal."""
    return {path.name for path in folder.iterdir()} - {"study.jsonl", "lock"}


def fail_with(monkeypatch, error):
    """Let a run raise an error."""
    monkeypatch.setattr(heavytop.run.propagation, "integrate_plan", Mock(side_effect=error))


def done_with(monkeypatch, then):
    """Let a run be what a function makes of it."""
    whole = heavytop.run.propagation.integrate_plan

    def integrate_plan(*given, **named):
        return then(whole(*given, **named))

    monkeypatch.setattr(heavytop.run.propagation, "integrate_plan", integrate_plan)
