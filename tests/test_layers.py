"""Layers point one way, and the closed form and the integrator do not see each other."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
QUIET = {**os.environ, "PYTHONPATH": str(ROOT / "src")}


def test_import_contracts_are_kept():
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=QUIET)
    assert result.returncode == 0, result.stdout + result.stderr


LIGHT = {  # what is done, and what is not imported by it
    "import heavytop.cli": "numpy sympy heyoka matplotlib",
    "import heavytop.scene.scene": "flint",
    "import heavytop.comparison.methods": "numba scipy CyRK sympy",
    "ht.load_scene('lie-group-benchmark')": "numpy mpmath sympy heyoka scipy xarray matplotlib",
    "cli('classify', 'sicm-kicked')": "numpy heyoka sympy scipy matplotlib xarray",
    "cli('doctor')": "heyoka sympy scipy matplotlib xarray",
    "import heavytop.run.propagation": "matplotlib xarray",
    "plot()": "matplotlib.pyplot",
}
COMMAND = """
import sys, heavytop as ht
def cli(*words):
    from click.testing import CliRunner
    from heavytop.cli import app
    assert CliRunner().invoke(app, words).stdout
def plot():
    from matplotlib.figure import Figure
    scene = ht.load_scene('sicm-kicked')
    ht.Motion(scene.top, scene.start).plot(ax=Figure().subplots())
"""


@pytest.mark.parametrize("done", LIGHT)
def test_nothing_heavy_is_imported_before_it_is_needed(done):
    program = f"{COMMAND}{done}; print(sorted(set(sys.modules) & {{*{LIGHT[done]!r}.split()}}))"
    command = [sys.executable, "-c", program]
    result = subprocess.run(command, capture_output=True, text=True, env=QUIET, check=True)
    assert result.stdout.strip() == "[]"
