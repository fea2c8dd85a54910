"""Nothing heavy is imported before it is needed; the order of layers is held by `lint-imports`."""

import pytest

from .processes import begin

COMMAND = """
import sys, tempfile, heavytop as ht
def cli(*words):
    from click.testing import CliRunner
    from heavytop.cli import app
    assert CliRunner().invoke(app, words).stdout
def plot():
    from matplotlib.figure import Figure
    scene = ht.load_scene('sicm-kicked')
    ht.Motion(scene.top, scene.start).plot(ax=Figure().subplots())
"""


@pytest.mark.parametrize(("done", "heavy"), {  # what is done, and what is not imported by it
    "import heavytop.cli": "numpy sympy heyoka matplotlib",
    "import heavytop.scene.scene": "flint",
    "x = ht.Exact.of('1.1'); float(x / 3); str((x.sign(), ht.Exact.of('pi') - x))": "flint mpmath",
    "import heavytop.comparison.methods": "numba scipy CyRK sympy",
    "ht.load_scene('lie-group-benchmark')": "numpy mpmath sympy heyoka scipy xarray matplotlib",
    "cli('classify', 'sicm-kicked')": "numpy heyoka sympy scipy matplotlib xarray",
    "cli('run', 'sicm-kicked', '-o', tempfile.mkdtemp(), '--no-figures')": "matplotlib xarray",
    "cli('doctor')": "heyoka sympy scipy matplotlib xarray",
    "import heavytop.run.propagation": "matplotlib xarray",
    "plot()": "matplotlib.pyplot",
}.items())  # fmt: skip
def test_nothing_heavy_is_imported_before_it_is_needed(done, heavy):
    program = f"{COMMAND}{done}; print(sorted(set(sys.modules) & {{*{heavy!r}.split()}}))"
    imported = begin("-c", program).communicate()[0].strip()
    assert imported == "[]", f"import {imported} inside the functions that need them"
