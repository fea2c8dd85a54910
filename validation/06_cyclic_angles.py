"""Phase lost by an angle that grows in the state: the textbook form beside the axis form.

heyoka chooses its steps by the largest state. As phi and psi grow, the steps are chosen for them,
and theta loses digits: phase errors grow as the cube of the time, where the axis form, whose
states are bounded, has Brouwer's 3/2.
"""

import shutil
import sys

import numpy as np
from claim import claim, finish
from page import DOCS, rewrite

import heavytop as ht
from heavytop.report.files import write_study

FOLDER = "out/cyclic-angles"
found = ht.drift(
    ht.load_scene("sicm-kicked"),
    methods=("taylor-lagrange", "taylor-subsystem", "taylor-axis"),
    periods=1e5,
    ensemble=4,
    samples=31,
    folder=FOLDER,
)
write_study(found, FOLDER)


def power(method):
    """The power of time with which phase errors grow over the last decade."""
    n, errors = np.array(method.periods), np.array(method.phase_s)
    last = n > n[-1] / 10
    return float(np.polyfit(np.log(n[last]), np.log(errors[last]), 1)[0])


def row(method):
    errors = f"{method.phase_s[-1]:.1e} | {method.energy[-1]:.1e} | {power(method):.2f}"
    return f"| `{method.name}` | {errors} | {method.us_per_period:.3g} |"


head = "| | phase [s] | energy | phase grows as t^ | µs a period |\n|---|--:|--:|--:|--:|"
table = "\n".join([head, *map(row, found.methods)])
print(table)
if "write" in sys.argv:
    rewrite("drift.md", "cyclic angles", table)
    shutil.copyfile(f"{FOLDER}/drift.svg", DOCS / "images" / "cyclic-angles.svg")
lagrange, subsystem, axis = found.methods
claim("exponent of the textbook form's phase error, off 3", abs(power(lagrange) - 3), 0.5)
claim("exponent of the axis form's, off 3/2", abs(power(axis) - 1.5), 0.4)
claim("axis form's phase error over the textbook's", axis.phase_s[-1] / lagrange.phase_s[-1], 1e-4)
claim("the textbook form without phi and psi: over that with them",
      subsystem.phase_s[-1] / lagrange.phase_s[-1], 1e-3)  # fmt: skip
finish()
