"""The book's kicked top: what every method costs for what it attains, timed in turn.

Times are worth something on a quiet machine alone. What heyoka compiled before is not taken from
its cache, so that setting up costs what it costs. The document and the chart are kept in out/
beside this file; with the word `write`, table and chart go to the documentation. A number is
another budget [s].
"""

import os
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path
from time import perf_counter

from claim import claim, finish
from page import DOCS, rewrite

import heavytop as ht
from heavytop.report.studies import TARGETS, error, setting, summaries, time
from heavytop.report.tables import Table

BUDGET = next((float(x) for x in sys.argv[1:] if x != "write"), 240.0)
FOLDER = Path(__file__).parent / "out" / "work-precision"
LEAST = 1e-6  # errors from there down
HEADINGS = ("method", *TARGETS, "best", "set-up [s]")
FASTEST = ("axis to", "fastest", "the best of Taylor", "times as long")
IN_TABLE = ("auto", "taylor-cubic", "taylor-axis", "taylor-attitude", "taylor-lagrange",
            "taylor-axis-projected", "blanes-moan-rkn6", "sofroniou-spaletta10",
            "gauss8", "bobenko-suris", "dop853-cyrk", "dop853-scipy",
            "lsoda-scipy", "taylor-axis-mpfr")  # fmt: skip


def table(document):
    """A row for some methods; then where others lead."""
    rows = tuple(row(each) for each in summaries(document["points"]) if each.name in IN_TABLE)
    tables = (Table(HEADINGS, rows), Table(FASTEST, tuple(where_rivals_lead(document)), left=4))
    return "\n\n".join([*(each.markdown for each in tables), "\n".join(others(document))])


def row(each):
    """The cells of a method: times with the settings that they were taken at."""
    best = each.best
    within = ["–" if point is None else timed(point) for point in each.within]
    return (
        f"`{each.name}`",
        *within,
        f"{error(best).strip()} in {timed(best)}",
        f"{each.setup_s:.2g}",
    )


def timed(point):
    """A time, and the tolerance or the steps a period in brackets."""
    steps = point["steps_a_period"]
    return f"{time(point)} ({point['tolerance']:.2g})" if steps is None else (
        f"{time(point)} ({steps:g})"
    )  # fmt: skip


def where_rivals_lead(document):
    """The decades of error of the axis at which somebody else's method is the cheapest."""
    of_axis = [p for p in document["points"] if p["measures"] == "axis"]
    led = {}
    for k in range(16):
        within = [p for p in of_axis if p["error"] <= 10.0**-k]
        sides = [[p for p in within if p["rival"] is side] for side in (True, False)]
        if not all(sides):
            continue
        first, ours = (min(side, key=lambda p: p["us_per_period"]) for side in sides)
        ratio = ours["us_per_period"] / first["us_per_period"]
        if ratio > 1:
            led.setdefault((shown(first), shown(ours), f"{ratio:.2f}"),
                           []).append(f"1e-{k}" if k else "1")  # fmt: skip
    for cells, bounds in led.items():
        yield ", ".join(bounds), *cells


def others(document):
    """What the budget left out."""
    if names := dict.fromkeys(each["method"] for each in document["skipped"]):
        yield f"- Left out at some settings: {', '.join(names)}."


def shown(point):
    """A point in words."""
    return f"`{point['method']}` ({setting(point)}), {time(point)} µs"


cache = tempfile.TemporaryDirectory()
os.environ["HEYOKA_CACHE_DIR"] = cache.name  # heyoka, which is not loaded yet, reads it once
from heavytop.report.files import write_study  # noqa: E402

began = perf_counter()
found = ht.work_precision(ht.load_scene("sicm-kicked"), budget=BUDGET)
took = perf_counter() - began
write_study(found, FOLDER)
document = found.document()
print(table(document))
reasons = Counter((each["method"], each["reason"]) for each in document["skipped"])
for (name, reason), count in reasons.items():
    print(f"left out: {name}, {count} settings: {reason}")
if "write" in sys.argv:
    rewrite("work-precision.md", "work-precision", table(document))
    shutil.copyfile(FOLDER / "workprec.svg", DOCS / "images" / "workprec.svg")

claim("time of the whole diagram [s]", took, BUDGET + 2)
for words, name in (("axis", "cheapest"), ("theta", "cheapest_theta")):
    for bound in TARGETS:
        first = document[name][bound]
        if first is None or first["against"] is None:
            continue
        ours = 1 / first["ratio"] if not first["rival"] else first["ratio"]
        claim(f"{words} to {bound}: our time over that of the best rival", ours, 1.0)
theirs = [
    found.points[i].label
    for leaders, name in ((found.front, "axis_error"), (found.front_theta, "theta_error"))
    for i in leaders
    if found.points[i].rival and getattr(found.points[i], name) <= LEAST
]
claim(f"rivals on the front from {LEAST:g} down {theirs or ''}", len(theirs), 0)
finish()
