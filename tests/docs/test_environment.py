"""The conda environment has what pip installs, the integrator too where pip has none."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
CONDA = {"heyoka": "heyoka.py", "matplotlib": "matplotlib-base"}  # under other names there


def requirement(text):
    """Return the name and the bounds of a requirement, written in whichever way, for any system."""
    text, _, _ = text.partition(";")
    name, bounds = re.fullmatch(r"([\w.-]+?)\s*([<>=!~].*)?", text.strip()).groups()
    return name, frozenset(filter(None, re.split(r"[,\s]+", bounds or "")))


def test_conda_installs_what_pip_does():
    """Every dependency stands in environment.yml, with the same bounds."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    wanted = dict(map(requirement, project["dependencies"]))
    lines = re.findall(r"^  - ([a-z][^:\n]*)$", (ROOT / "environment.yml").read_text("utf-8"), re.M)
    there = dict(map(requirement, lines))
    wanted |= dict([requirement(f"python {project['requires-python']}")])
    renamed = {CONDA.get(name, name): bounds for name, bounds in wanted.items()}
    assert renamed.items() <= there.items()
