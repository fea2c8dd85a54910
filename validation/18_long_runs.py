"""The book's kicked top for up to a hundred million nutation periods: drift, Brouwer, projection.

Every run is held against the closed form of its own binary start. Studies are kept in out/, so that
what was killed goes on. With the word `write`, tables and charts go to the documentation.
"""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
from page import DOCS, markdown, rewrite
from tools import main, most, motion_of

import heavytop as ht
from heavytop.claims import proof

KICKED = ht.load_scene("sicm-kicked")


def study(name, methods, **asked):
    """A drift study of the kicked top, stored, and the folder where it is."""
    from heavytop.report.files import write_result

    folder = Path("out") / f"{name}-{asked['periods']:g}"
    if (folder / "drift.json").exists():  # it is whole, perhaps of another day's code
        shutil.rmtree(folder)
    found = ht.drift(KICKED, methods=methods, folder=folder, **asked)
    write_result(found, folder)
    return found, folder


def power(times, errors):
    """The power of time with which errors grow."""
    return float(np.polyfit(np.log(times), np.log(errors), 1)[0])


# --- every method ----------------------------------------------------------------------------

COMPILED = (
    "taylor-axis", "taylor-axis-projected", "taylor-cubic", "taylor-attitude",
    "taylor-attitude-projected", "dop853-cyrk", "strang", "blanes-moan-rkn6",
    "sofroniou-spaletta10", "sofroniou-spaletta10=20", "implicit-midpoint", "gauss8",
    "bobenko-suris",
)  # fmt: skip
PYTHON = ("dop853-scipy", "lsoda-scipy", "radau-scipy")  # these go 10 000 periods
SHOWN = (
    "taylor-axis", "taylor-axis-projected", "taylor-cubic", "dop853-cyrk", "strang",
    "sofroniou-spaletta10=20", "gauss8", "bobenko-suris", "dop853-scipy", "lsoda-scipy",
)  # fmt: skip


@proof
def methods(periods=1e6, write=False):
    from heavytop.plots.style import save

    found, _ = study("long-runs", (*COMPILED, *PYTHON), periods=periods)
    [every] = found.tables()
    print(every.markdown)
    if write:
        rows = [row for row in every.rows if row["name"] in SHOWN]
        rewrite("drift.md", "long runs", every._replace(rows=rows).markdown)
        some = replace(found, methods=tuple(each for each in found.methods if each.name in SHOWN))
        save(some.figure(), DOCS / "images" / "drift.svg")
    gone = [each.name for each in found.methods if not each.skipped]
    yield "compiled methods that did not go all the way", len({*COMPILED} - {*gone}), 0
    projected, composed = found["taylor-axis-projected"], found["sofroniou-spaletta10=20"]
    yield "phase of the projected axis form [s]", projected.phase_s[-1], 1e-11
    coarse = found["sofroniou-spaletta10"]
    early = sum(n < 1e5 for n in coarse.periods)  # then rounding takes over
    exponent = power(coarse.periods[:early], coarse.phase_s[:early])
    yield "Sofroniou-Spaletta: exponent of phase up to 1e5 periods, off 1", abs(exponent - 1), 0.15
    yield "Sofroniou-Spaletta, 20 steps a period: axis", composed.axis[-1], 5e-7
    pair = found["dop853-cyrk"]
    yield "DOP853 at 1e-12: exponent of energy, off 1", abs(pair.energy_exponent - 1), 0.1
    yield "DOP853 at 1e-12: exponent of phase, off 2", abs(pair.phase_exponent - 2), 0.2


# --- growth of rounding ----------------------------------------------------------------------


MARKS = ("1e3", "1e5", "1e6")  # periods
PHASES = ("nutation periods", "axis form", "projected", "cubic form", "projected")


@proof
def brouwer(periods=1e6, write=False):
    """Eight neighbours: rounding is a random walk of the energy, and phase its integral."""
    forms = [f"taylor-{form}{end}" for form in ("axis", "cubic") for end in ("", "-projected")]
    found, _ = study("brouwer", forms, periods=periods, ensemble=8, samples=31, jobs=2)
    times = np.array(found.methods[0].periods)
    marks = {n: int(np.argmin(abs(times - float(n)))) for n in MARKS}
    late = times > 999
    powers = [power(times[late], np.array(each.phase_s)[late]) for each in found.methods]
    rows = [(n, *(f"{each.phase_s[k]:.1e} s" for each in found.methods)) for n, k in marks.items()]
    table = markdown(PHASES, [*rows, ("grows as the power", *(f"{each:.2f}" for each in powers))])
    print(table)
    if write:
        rewrite("theory/rounding.md", "phases", table, signed=False)
    for k, form in ((0, "axis"), (2, "cubic")):
        plain, projected = found.methods[k : k + 2]
        yield f"{form}: exponent of phase, off 3/2", abs(powers[k] - 1.5), 0.35
        yield f"{form}, projected: exponent of phase", powers[k + 1], 0.7
        yield f"{form}, projected: phase, RMS [s]", projected.phase_s[-1], 1e-11
        yield f"{form}, projected: energy, RMS", projected.energy[-1], 1e-15
        ratio = projected.phase_s[-1] / plain.phase_s[-1]
        yield f"{form}, projected: phase over that of plain runs", ratio, 1e-2
    off = found["taylor-axis"].energy_exponent - 0.5
    yield "axis: exponent of energy, off 1/2", abs(off), 0.15


LOST = ("", "phase [s]", "energy", "phase grows as t^", "µs a period")


@proof
def cyclic_angles(periods=1e5, write=False):
    """Phase lost by angles that grow in the state, by the largest of which steps are chosen."""
    forms = ("taylor-lagrange", "taylor-subsystem", "taylor-axis")
    found, folder = study("cyclic-angles", forms, periods=periods, ensemble=4, samples=31)

    ends, powers, rows = [], [], []
    for each in found.methods:
        last = [k for k, n in enumerate(each.periods) if n > each.periods[-1] / 10]
        powers.append(power(*(np.array(x)[last] for x in (each.periods, each.phase_s))))
        ends.append(each.phase_s[-1])
        rows.append((f"`{each.name}`", f"{ends[-1]:.1e}", f"{each.energy[-1]:.1e}",
                     f"{powers[-1]:.2f}", f"{each.us_per_period:.3g}"))  # fmt: skip
    print(markdown(LOST, rows))
    if write:
        rewrite("drift.md", "cyclic angles", markdown(LOST, rows), signed=False)
        shutil.copyfile(folder / "drift.svg", DOCS / "images" / "cyclic-angles.svg")
    yield "exponent of the textbook form's phase error, off 3", abs(powers[0] - 3), 0.5
    yield "exponent of the axis form's, off 3/2", abs(powers[2] - 1.5), 0.4
    yield "axis form's phase error over the textbook's", ends[2] / ends[0], 1e-4
    yield "the textbook form without phi and psi: over that with them", ends[1] / ends[0], 1e-3


# --- a hundred million periods ---------------------------------------------------------------
# The study took minutes; its result is kept. Here its claims are read from that file, and the
# beginning of the runs is done again. With the word `again` everything is.

KEPT = Path(__file__).with_name("data") / "hundred-million.json"
FIRST = 1e5  # periods that are done again
LONGEST = {"periods": 1e8, "samples": 33}
HEAD = ("", "periods", "steps", "phase [s]", "axis", "energy", "phase grows as t^")


@proof
def hundred_million(anew=False, write=False):
    from heavytop.studies.drift import advance, drift_parameters

    names = ("taylor-axis", "taylor-axis-projected")
    if anew:
        _, folder = study("hundred-million", names, jobs=2, **LONGEST)
        KEPT.write_bytes((folder / "drift.json").read_bytes())
    kept = {each["name"]: each for each in json.loads(KEPT.read_text("utf-8"))["methods"]}
    asked = {"methods": names, **LONGEST, "ensemble": 1, "seed": 0, "jobs": 1}
    parameters, worst, rows = drift_parameters(KICKED, **asked)[0], 0.0, []
    for name in names:
        method, again = kept[name], {}
        for chunk in advance(parameters, f"{name}/0000", None):
            again |= {row["periods"]: abs(row["phase_s"]) for row in chunk.rows}
            if chunk.checkpoint["periods"] > FIRST:
                break
        phases = zip(method["periods"], method["phase_s"], strict=True)
        worst = most(worst, *(abs(again[n] - x) for n, x in phases if n <= FIRST))
        rows.append((f"`{name}`", f"{method['periods'][-1]:.9g}", f"{method['steps']:.4g}",
                     f"{method['phase_s'][-1]:.2e}", f"{method['axis'][-1]:.1e}",
                     f"{method['energy'][-1]:.1e}", f"{method['phase_exponent']:.2f}"))  # fmt: skip
    print(markdown(HEAD, rows))
    if write:
        rewrite("drift.md", "hundred million", markdown(HEAD, rows), signed=False)
    yield f"phase errors up to {FIRST:g} periods, done again, off the kept ones [s]", worst, 1e-10
    plain, projected = (kept[name] for name in names)
    late, times = projected["phase_s"], projected["periods"]
    yield "projected: phase after 1e8 periods [s]", late[-1], 1e-9
    a_period = (late[-1] - late[-9]) / (times[-1] - times[-9])  # over the last factor of ten
    period = float(motion_of(KICKED).period)
    yield "projected: phase gained in a period, over its length", a_period / period, 2e-18
    yield "projected: phase over the plain one", late[-1] / plain["phase_s"][-1], 1e-3


if __name__ == "__main__":
    main()
