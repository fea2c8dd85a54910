"""The book's kicked top: what every method costs for what it attains, timed in turn.

Times are worth something on a quiet machine alone. What heyoka compiled before is not taken from
its cache, so that setting up costs what it costs. The document and the chart are kept in out/; with
the word `write`, table and chart go to the documentation.
"""

import os
import shutil
import tempfile
from collections import Counter
from pathlib import Path
from time import perf_counter

from page import DOCS, markdown, rewrite
from tools import main

import heavytop as ht
from heavytop.claims import proof
from heavytop.results import work_precision as results
from heavytop.results.base import group
from heavytop.scene.quantities import QUANTITIES

FOLDER = Path("out") / "work-precision"
LEAST = 1e-6  # errors from there down
HEADINGS = ("method", *results.TARGETS, "best", "set-up [s]")
FASTEST = ("axis to", "fastest", "the best of Taylor", "times as long")
IN_TABLE = ("auto", "taylor-cubic", "taylor-axis", "taylor-attitude", "taylor-lagrange",
            "taylor-axis-projected", "blanes-moan-rkn6", "sofroniou-spaletta10",
            "gauss8", "bobenko-suris", "dop853-cyrk", "dop853-scipy",
            "lsoda-scipy", "taylor-axis-mpfr")  # fmt: skip


def table(document):
    """A row for some methods; then where others lead."""
    every = group(document["points"], "method", "measures").values()
    rows = [row(points) for points in every if points[0]["method"] in IN_TABLE]
    leading = markdown(FASTEST, where_rivals_lead(document["points"]), left=4)
    return "\n\n".join([markdown(HEADINGS, rows), leading, "\n".join(others(document))])


def row(points):
    """The cells of a method: times with the settings that they were taken at."""
    best = min(points, key=lambda p: p["error"])
    mark = " θ" if best["measures"] == "theta" else ""
    within = [results.fastest(points, "error", bound) for bound in results.TARGETS.values()]
    return (
        f"`{best['method']}`",
        *(timed(point) if point else "–" for point in within),
        f"{best['error']:.1e}{mark} in {timed(best)}",
        f"{max(point['setup_s'] for point in points):.2g}",
    )


def time(point):
    """The time of a period [µs]."""
    return QUANTITIES["us_per_period"].text(point["us_per_period"])


def timed(point):
    """A time, and the tolerance or the steps a period in brackets."""
    steps = point["steps_a_period"]
    words = f"{point['tolerance']:.2g}" if steps is None else f"{steps:g}"
    return f"{time(point)} ({words})"


def by_side(points, error, bound):
    """The fastest method of others, and ours, with an error of at most a bound."""
    sides = ([p for p in points if p["rival"] is side] for side in (True, False))
    return [results.fastest(side, error, bound) for side in sides]


def where_rivals_lead(points):
    """The decades of error of the axis at which somebody else's method is the cheapest."""
    led = {}
    for k in range(16):
        first, ours = by_side(points, results.ERROR_KEYS["axis"], 10.0**-k)
        if first and ours:
            ratio = ours["us_per_period"] / first["us_per_period"]
            cells = shown(first), shown(ours), f"{ratio:.2f}"
            if ratio > 1:
                led.setdefault(cells, []).append(f"1e-{k}" if k else "1")
    for cells, bounds in led.items():
        yield ", ".join(bounds), *cells


def others(document):
    """What the budget left out."""
    if names := dict.fromkeys(each["method"] for each in document["skipped"]):
        yield f"- Left out at some settings: {', '.join(names)}."


def shown(point):
    """A point in words."""
    return f"`{point['method']}` ({results.setting(point)}), {time(point)} µs"


@proof
def work_precision(budget=240.0, write=False):
    cache = tempfile.TemporaryDirectory()
    os.environ["HEYOKA_CACHE_DIR"] = cache.name  # heyoka, which is not loaded yet, reads it once
    from heavytop.report.files import write_result

    began = perf_counter()
    found = ht.work_precision(ht.load_scene("sicm-kicked"), budget=budget)
    took = perf_counter() - began
    write_result(found, FOLDER)
    document = found.document()
    print(table(document))
    reasons = Counter((each["method"], each["reason"]) for each in document["skipped"])
    for (name, reason), count in reasons.items():
        print(f"left out: {name}, {count} settings: {reason}")
    if write:
        rewrite("work-precision.md", "work-precision", table(document))
        shutil.copyfile(FOLDER / "workprec.svg", DOCS / "images" / "workprec.svg")
    yield "time of the whole diagram [s]", took, budget + 2
    leading = []
    for words in ("axis", "theta"):
        error = results.ERROR_KEYS[words]
        for bound, most in results.TARGETS.items():
            first, ours = by_side(found.points, error, most)
            if first and ours:
                ratio = ours["us_per_period"] / first["us_per_period"]
                yield f"{words} to {bound}: our time over that of the best rival", ratio, 1.0
        every = (found.points[i] for i in results.front(found.points, error))
        leading += [point for point in every if results.error_of_point(point, error) <= LEAST]
    theirs = [f"{p.method} {results.setting(p)}" for p in leading if p.rival]
    yield f"rivals on the front from {LEAST:g} down {theirs or ''}", len(theirs), 0


if __name__ == "__main__":
    main()
