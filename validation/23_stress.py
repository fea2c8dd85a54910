"""Where methods fail: every method at every case, and whether auto is ever silently wrong.

The document and the chart are kept in out/; with the word `write`, table and chart go to
docs/where-methods-fail.md.
"""

import math
import shutil
from pathlib import Path
from time import perf_counter

from page import DOCS, rewrite
from tools import main, most

import heavytop as ht
from heavytop.claims import proof
from heavytop.results.stress import UNTOLD, UNTOLD_RULE, StressOutcome

FOLDER = Path("out") / "stress"
OURS = ("auto", "taylor-axis", "taylor-attitude")
EULER = ("taylor-subsystem", "taylor-lagrange")
IN_TABLE = ("auto", "taylor-cubic", "taylor-routh", "taylor-lagrange", "dop853-scipy-lagrange",
            "blanes-moan-rkn6", "gauss8")  # fmt: skip
CASES = ("through-top", "through-bottom", "start-at-top", "near-top-1e-6", "near-top-1e-12",
         "near-bottom-1e-6", "sleeping-1+1e-1", "sleeping-1-1e-8", "falling-1e-6", "separatrix-40",
         "separatrix-80", "near-separatrix", "kick-1e-15", "spin-1e7", "steady+1e-9",
         "1e5-periods")  # fmt: skip
NO_DIGITS, _, WHY = UNTOLD_RULE.partition(": ")


def table(found):
    """Some methods at some cases, what the marks mean, and how often each method ends ok."""
    [every] = found.tables()
    rows = [row for row in every.rows if row["case"] in CASES]
    some = every._replace(rows=rows, columns=[n for n in ("case", *IN_TABLE) if n in every.columns])
    marks = [f"- {word.mark} **{word}**: {word.rule}." for word in StressOutcome]
    marks.append(f"- {UNTOLD} **{NO_DIGITS}**: {WHY}.")
    counted = ", ".join(f"`{name}` {each['ok']}" for name, each in found.counts().items())
    notes = f"Ended ok, of {len(found.hard)} cases: {counted}."
    return "\n\n".join([some.markdown, "\n".join(marks), notes, measured(found)])


def measured(found):
    """What the sentences below the table rest on."""
    top, bottom = ([r.energy_error for r in found.cases if r.method in EULER and r.energy_error
                    is not None and r.case.startswith(near)]
                   for near in ("near-top-", ("near-bottom-", "lie-group")))  # fmt: skip
    return (
        f"Energy error of the subsystem's and the textbook's form in near passes: at most "
        f"{max(top, default=math.nan):.0e} at the top, {min(bottom, default=math.nan):.0e} to "
        f"{max(bottom, default=math.nan):.0e} at the bottom."
    )


@proof
def stress(budget=240.0, write=False):
    from heavytop.report.files import write_result

    began = perf_counter()
    found = ht.stress(budget=budget)
    took = perf_counter() - began
    write_result(found, FOLDER)
    print(table(found))
    for run in found.cases:
        if run.outcome != "ok":
            print(f"{run.case}, {run.method}: {run.outcome}: {run.note}")
    for each in found.skipped:
        print(f"skipped: {each.case}, {each.method}: {each.reason}")
    if write and not found.skipped:
        rewrite("where-methods-fail.md", "stress", table(found))
        shutil.copyfile(FOLDER / "stress.svg", DOCS / "images" / "stress.svg")
    yield "time of the whole test [s]", took, budget + 5
    yield "runs whose process was lost", sum(each.lost for each in found.skipped), 0
    left = sum(not each.lost for each in found.skipped)
    yield "runs that the budget or a package did not allow", left, 0
    if not found.skipped:
        yield from what_fails(found)


def what_fails(found):
    wrong = [run.case for run in found.silently_wrong]
    yield f"cases at which auto is silently wrong {wrong or ''}", len(wrong), 0
    unnamed = [run for run in found.cases if run.formulation == "auto" and not run.named]
    lost = most(run.digits_lost for run in unnamed)
    yield "digits auto loses beyond what conditioning allows, unless it says so", lost, 2.0
    turned = sum(any(run.turns or ()) for run in unnamed)
    yield "cases at which auto is wrong by whole turns, unless it says so", turned, 0
    near = [r for r in found.cases if r.method in OURS and r.case.startswith(("near-", "through-"))]
    lost = most(run.digits_lost for run in near)
    yield "near passes and exact ones: digits that auto, axis and attitude lose", lost, 1.0
    tops = [r for r in found.cases if r.method in EULER and r.case.startswith("near-top-")]
    energy = most(run.energy_error for run in tops)
    yield "near the top the energy of forms that lose the axis is off by", energy, 1e-14
    hung = found["start-at-top", "lsoda-scipy-lagrange"].outcome
    yield "LSODA does not return from theta = 0, not", hung != "time-limit", 0
    loose = abs(found["ten-periods", "solve-ivp-defaults"].error / 5e-2 - 1)
    yield "solve_ivp's defaults lose 5e-2 in ten periods, off by a factor", loose, 0.2


if __name__ == "__main__":
    main()
