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


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import heavytop.cli", ("numpy", "sympy", "heyoka", "matplotlib")),
        ("import heavytop.scene.scene", ("flint",)),
        (
            "import heavytop; heavytop.load_scene('lie-group-benchmark')",
            ("numpy", "mpmath", "sympy", "heyoka", "scipy", "matplotlib", "xarray"),
        ),
        (
            "import heavytop as ht; from heavytop.results.classification import classified;"
            "classified(ht.load_scene('sicm-kicked')).document()",
            ("numpy", "heyoka", "sympy", "matplotlib"),
        ),
        ("import heavytop.run.propagation", ("matplotlib", "xarray")),
        (
            "import heavytop as ht; from matplotlib.figure import Figure;"
            "scene = ht.load_scene('sicm-kicked');"
            "ht.Motion(scene.top, scene.start).plot(ax=Figure().subplots())",
            ("matplotlib.pyplot",),
        ),
        (
            "from click.testing import CliRunner; from heavytop.cli import app;"
            "assert CliRunner().invoke(app, ['classify', 'sicm-kicked']).stdout;"
            "assert CliRunner().invoke(app, ['doctor']).stdout",
            ("heyoka", "sympy", "scipy", "matplotlib", "xarray"),
        ),
    ],
)
def test_nothing_heavy_is_imported_before_it_is_needed(statement, absent):
    program = f"{statement}; import sys; print(sorted(set(sys.modules) & set({absent!r})))"
    command = [sys.executable, "-c", program]
    result = subprocess.run(command, capture_output=True, text=True, env=QUIET, check=True)
    assert result.stdout.strip() == "[]"
