"""Whole processes, second time: help, and one run against importing the libraries alone."""

import subprocess
import sys

from claim import claim, finish, interleaved

PYTHON = sys.executable
MODULE = [PYTHON, "-m", "heavytop"]


def process(*arguments):
    return lambda: subprocess.run(arguments, check=True, capture_output=True)


programs = {
    "help": process(*MODULE, "--help"),
    "run": process(*MODULE, "run", "sicm-kicked", "--json", "--no-figures"),
    "libraries": process(PYTHON, "-c", "import heyoka, sympy"),
}
for program in programs.values():
    program()
best = interleaved(programs, 9)
claim("heavytop --help [s]", best["help"], 0.3)
claim("run over importing heyoka and sympy", best["run"] / best["libraries"], 2.5)
print("     " + ", ".join(f"{name}: {t:.3f} s" for name, t in best.items()))
finish()
