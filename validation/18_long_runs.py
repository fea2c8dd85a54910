"""The book's kicked top for a million nutation periods, by compiled methods; by others, 10 000.

Every run is held against the closed form of its own binary start. The study is kept in out/, so
that it can be killed and goes on. With the word `write`, table and chart go to the documentation.
"""

import sys
from dataclasses import replace

from claim import claim, finish
from page import DOCS, rewrite

import heavytop as ht
from heavytop.plots.style import save
from heavytop.report.files import write_study
from heavytop.results.drift import growth

PERIODS = next((float(x) for x in sys.argv[1:] if x != "write"), 1e6)  # fewer, for a look
FOLDER = f"out/long-runs-{PERIODS:g}"
COMPILED = (
    "taylor-axis", "taylor-axis-projected", "taylor-cubic", "taylor-attitude",
    "taylor-attitude-projected", "dop853-cyrk", "strang", "blanes-moan-rkn6",
    "sofroniou-spaletta10", "sofroniou-spaletta10=20", "implicit-midpoint", "gauss8",
    "bobenko-suris",
)  # fmt: skip
PYTHON = ("dop853-scipy", "lsoda-scipy", "radau-scipy")
DRAWN = (
    "taylor-axis", "taylor-axis-projected", "dop853-cyrk", "strang",
    "sofroniou-spaletta10=20", "gauss8", "bobenko-suris", "lsoda-scipy",
)  # fmt: skip
IN_TABLE = (
    "taylor-axis", "taylor-axis-projected", "taylor-cubic", "dop853-cyrk", "strang",
    "sofroniou-spaletta10=20", "gauss8", "bobenko-suris", "dop853-scipy", "lsoda-scipy",
)  # fmt: skip

scene = ht.load_scene("sicm-kicked")
found = ht.drift(scene, methods=(*COMPILED, *PYTHON), periods=PERIODS, folder=FOLDER)
write_study(found, FOLDER)
[whole] = found.tables()
print(whole.markdown)
table = whole._replace(rows=[row for row in whole.rows if row["name"] in IN_TABLE]).markdown
if "write" in sys.argv:
    rewrite("drift.md", "long runs", table)
    some = replace(found, methods=tuple(each for each in found.methods if each.name in DRAWN))
    save(some.figure(), DOCS / "images" / "drift.svg")

done = [m for m in found.methods if not m.skipped and m.name in COMPILED]
claim("compiled methods that went all the way, off 14", 14 - len(done), 0)
projected, composed = found["taylor-axis-projected"], found["sofroniou-spaletta10=20"]
claim("phase of the projected axis form [s]", projected.phase_s[-1], 1e-11)
coarse = found["sofroniou-spaletta10"]
early = [k for k, n in enumerate(coarse.periods) if n < 1e5]  # then rounding takes over
power = growth([coarse.periods[k] for k in early], [coarse.phase_s[k] for k in early])
claim(
    "Sofroniou-Spaletta: exponent of phase up to 1e5 periods, off 1", abs(power.exponent - 1), 0.15
)
claim("Sofroniou-Spaletta, 20 steps a period: axis", composed.axis[-1], 5e-7)
pair = found["dop853-cyrk"]
claim("DOP853 at 1e-12: exponent of energy, off 1", abs(pair.energy_exponent - 1), 0.1)
claim("DOP853 at 1e-12: exponent of phase, off 2", abs(pair.phase_exponent - 2), 0.2)
finish()
