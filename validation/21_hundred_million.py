"""A hundred million nutation periods of the book's kicked top, plain and projected.

The study took minutes; its result is kept in data/hundred-million.json. Here its claims are read
from that file, and the beginning of the runs is done again: the same marks, the same errors. With
the word `again` everything is done again (`out/hundred-million` is taken up if it was begun).
"""

import json
import sys
from pathlib import Path

from claim import claim, finish, most
from page import rewrite

import heavytop as ht
from heavytop.report.files import write_study
from heavytop.studies.drift import advance, drift_parameters

KEPT = Path(__file__).with_name("data") / "hundred-million.json"
FIRST = 1e5  # periods that are done again
METHODS = ("taylor-axis", "taylor-axis-projected")
ASKED = {"methods": METHODS, "periods": 1e8, "samples": 33}
scene = ht.load_scene("sicm-kicked")
PERIOD = float(ht.Motion(scene.top, scene.start).period)

if "again" in sys.argv:
    found = ht.drift(scene, **ASKED, jobs=2, folder="out/hundred-million")
    write_study(found, "out/hundred-million")
    KEPT.write_bytes(Path("out/hundred-million/drift.json").read_bytes())

kept = {each["name"]: each for each in json.loads(KEPT.read_text())["methods"]}
parameters = drift_parameters(scene, **ASKED, ensemble=1, seed=0, jobs=1)[0]
worst = 0.0
table = [
    "| | periods | steps | phase [s] | axis | energy | phase grows as t^ |",
    "|---|--:|--:|--:|--:|--:|--:|",
]
for name in METHODS:
    method, rows = kept[name], []
    for chunk in advance(parameters, f"{name}/0000", None):
        rows += chunk.rows
        if chunk.checkpoint["periods"] > FIRST:
            break
    again = [abs(row["phase_s"]) for row in rows]
    worst = most(worst, *(abs(a - b) for a, b in zip(again, method["phase_s"], strict=False)))
    error, exponent = method["phase_s"][-1], method["phase_exponent"]
    table.append(
        f"| `{name}` | {method['periods'][-1]:.9g} | {method['steps']:.4g} | {error:.2e} | "
        f"{method['axis'][-1]:.1e} | {method['energy'][-1]:.1e} | {exponent:.2f} |"
    )
print("\n".join(table))
if "write" in sys.argv:
    rewrite("drift.md", "hundred million", "\n".join(table))
claim(f"phase errors up to {FIRST:g} periods, done again, off the kept ones [s]", worst, 1e-10)
plain, projected = (kept[name] for name in METHODS)
claim("projected: phase after 1e8 periods [s]", projected["phase_s"][-1], 1e-9)
late, times = projected["phase_s"], projected["periods"]
a_period = (late[-1] - late[-9]) / (times[-1] - times[-9])  # over the last factor of ten
print(f"     projected, from {times[-9]:.3g} periods on: {a_period:.2g} s a period")
claim("projected: phase gained in a period, over its length", a_period / PERIOD, 2e-18)
claim("projected: phase over the plain one", projected["phase_s"][-1] / plain["phase_s"][-1], 1e-3)
finish()
