"""The book's kicked top: what every method costs for what it attains, timed in turn.

Times are worth something on a quiet machine alone. What heyoka compiled before is not taken from
its cache, so that setting up costs what it costs. The document and the chart are kept in out/;
with the word `write`, table and chart go to the documentation. A number is another budget [s].
"""

import os
import shutil
import sys
import tempfile
from time import perf_counter

from claim import claim, finish
from page import DOCS, rewrite

import heavytop as ht
from heavytop.report.workprec_table import HEADINGS, setting, summaries

BUDGET = next((float(x) for x in sys.argv[1:] if x != "write"), 240.0)
FOLDER = "out/work-precision"
LEAST = 1e-6  # errors from there down


def table(document):
    """A row for each method, and a line for each bound: who is cheapest, and who comes next."""
    rules = ["--" if name in (HEADINGS[0], HEADINGS[-1]) else "--:" for name in HEADINGS]
    rows = [HEADINGS, rules, *((f"`{name}`", *cells) for name, *cells in
                               summaries(document["points"]))]  # fmt: skip
    lines = [f"| {' | '.join(cell.strip() for cell in row)} |" for row in rows]
    return "\n".join([*lines, "", *leaders(document)])


def leaders(document):
    """Who is cheapest within each bound, and the best of the other side."""
    for words, name in (("the axis", "cheapest"), ("θ alone", "cheapest_theta")):
        for bound in ("1e-6", "1e-9", "1e-12"):
            first = document[name][bound]
            if first is None:
                continue
            line = f"- {words} to {bound}: {shown(first)}"
            if other := first["against"]:
                line += f"; then {shown(other)}, {first['ratio']:.2f} times as long"
            yield line
    six = next(p for p in found.auto if (p.trial.wants, p.trial.digits) == ("axis", 6))
    ratio = six.us_per_period / found.cheapest(1e-6).us_per_period
    yield f"- `auto`, asked for 6 digits of the axis: {ratio:.2f} times the cheapest to 1e-6"
    if names := dict.fromkeys(each["method"] for each in document["skipped"]):
        yield f"- left out at some settings, for want of time: {', '.join(names)}"


def shown(point):
    """A point in words."""
    return f"`{point['method']}` ({setting(point)}), {point['us_per_period']:.3g} µs"


cache = tempfile.TemporaryDirectory()
os.environ["HEYOKA_CACHE_DIR"] = cache.name  # heyoka, which is not loaded yet, reads it once
from heavytop.workprec_results import write_work_precision  # noqa: E402

began = perf_counter()
found = ht.work_precision(ht.load_scene("sicm-kicked"), budget=BUDGET)
took = perf_counter() - began
write_work_precision(found, FOLDER)
document = found.document()
print(table(document))
for each in document["skipped"]:
    print(f"skipped: {each['method']} {each['setting']}: {each['reason']}")
if "write" in sys.argv:
    rewrite("work-precision.md", "work-precision", table(document))
    shutil.copyfile(f"{FOLDER}/workprec.svg", DOCS / "images" / "workprec.svg")

claim("time of the whole diagram [s]", took, BUDGET + 2)
claim("points ahead of what auto chose", sum(len(found.ahead_of(p)) for p in found.auto), 0)
missed = [
    p for p in found.auto
    if (p.axis_error if p.trial.wants == "axis" else p.theta_error) > 10.0**-p.trial.digits
]  # fmt: skip
claim("choices of auto that miss the digits asked", len(missed), 0)
for words, name in (("axis", "cheapest"), ("theta", "cheapest_theta")):
    for bound in ("1e-6", "1e-9", "1e-12"):
        first = document[name][bound]
        ours = 1 / first["ratio"] if not first["rival"] else first["ratio"]
        claim(f"{words} to {bound}: our time over that of the best rival", ours, 1.0)
theirs = [
    found.points[i].trial.text
    for leaders, error in ((found.front, "axis_error"), (found.front_theta, "theta_error"))
    for i in leaders
    if found.points[i].is_rival and getattr(found.points[i], error) <= LEAST
]
claim(f"rivals on the front from {LEAST:g} down {theirs or ''}", len(theirs), 0)
finish()
