"""Certificates: how sharp the proved bounds are, on random runs, all scenes, and a long run.

Random runs: tops, starts, forms and lengths drawn at random. The error is looked for at many random
times with the closed form in doubles, and taken in 128 bits where it is largest, and at some random
times: it never exceeds the bound. The same for every shipped scene in both forms. A long run
of the kicked top: the bound, the largest error, and the time that it takes; and a hundred million
projected periods, whose certificate is kept.
"""

import json
import time
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from page import markdown, rewrite
from tools import Digits, main, most

import heavytop as ht
from heavytop.claims import proof
from heavytop.scene.quantities import QUANTITIES
from heavytop.scene.scene_file import shipped_names

PART = 20_000
WORST = 8  # times of each quantity at which its error is taken in 128 bits
DIGITS = 38
NAMES = ("axis", "theta", "phi", "psi")
KICKED = ht.load_scene("sicm-kicked")


def drawn(seed):
    """Return a run of a top drawn at random, in a form drawn at random."""
    rng = np.random.default_rng([45, seed])
    top = ht.Top(*rng.uniform((1, 0.2, -3), (3, 2, 3)).tolist())
    theta, thetadot, phidot, psidot = rng.uniform((0.05, -2, -3, -20), (3.0, 2, 3, 20)).tolist()
    periods = float(10 ** rng.uniform(0, 2.5))
    phi, psi = (rng.choice((-1, 1), 2) * 10 ** rng.uniform(-1, 6, 2)).tolist()  # which are rounded
    start = ht.State(theta, phi=phi, psi=psi, thetadot=thetadot, phidot=phidot, psidot=psidot)
    scene = ht.Scene(top, start, periods=periods, quantities=("theta", "phi", "psi"))
    return ht.propagate(scene, formulation=("axis", "attitude")[seed % 2], projected=seed % 4 < 2)


def times_to_look_at(run, rng, times, taken):
    """Return the times, of many, at which errors in doubles are largest, and some random ones."""
    known, form = {name: [] for name in NAMES}, run.binary_motion.closed_form.at
    for _ in range(0, times, PART):
        some = np.sort(run.orbit.end * rng.uniform(0, 1, min(PART, times)))
        seen, true = run(some), form(some)
        for name in NAMES:
            apart = np.abs(getattr(seen, name) - getattr(true, name))
            apart = np.linalg.norm(apart, axis=-1) if name == "axis" else apart
            order = np.argsort(-np.nan_to_num(apart, nan=-1.0))[:WORST]
            known[name] += zip(apart[order].tolist(), some[order].tolist(), strict=True)
    worst = {t for each in known.values() for _, t in sorted(each, reverse=True)[:WORST]}
    return worst | set((run.orbit.end * rng.uniform(0, 1, taken)).tolist())


def largest_errors(run, seed, **look):
    """Return the largest errors found, in 128 bits."""
    exact, found = Digits(run.binary_motion.closed_form, DIGITS), dict.fromkeys(NAMES, 0.0)
    times = sorted(times_to_look_at(run, np.random.default_rng(seed), **look))
    seen = run(np.array(times))
    for k, t in enumerate(times):
        true = exact(t)
        for name in NAMES:
            mine, right = np.atleast_1d(getattr(seen, name)[k]), getattr(true, name)
            if not np.isnan(mine).any():
                right = right if name == "axis" else [right]
                parts = (exact.ctx.mpf(float(a)) - b for a, b in zip(mine, right, strict=True))
                error = exact.ctx.sqrt(sum(x * x for x in parts))
                found[name] = most(found[name], float(error))
    return found


def certified(programs, refused):
    """Yield runs and their certificates, and keep why some are not proved."""
    warnings.simplefilter("ignore")
    for name, program in programs.items():
        try:
            run = program()
            found = ht.certify(run)
        except ht.HeavyTopError as why:
            refused.append(f"{name}: {why}")
            continue
        if not found.proved:
            refused.append(f"{name}: {'; '.join(found.why)}")
        yield run, found


def worst_share(found, **look):
    """Return the largest error found over its bound, and print the median."""
    shares = []
    for seed, (run, certificate) in enumerate(found):
        errors = largest_errors(run, seed, **look)
        bounds = certificate.bound.items()
        shares += [errors[name] / bound for name, bound in bounds if bound and name in errors]
    print(f"  the largest error over its bound: median {np.median(shares):.2f}")
    return most(shares)


@proof
def random_runs(runs=40, times=100_000, taken=200):
    """Certify runs drawn at random."""
    refused = []
    programs = {f"run {seed}": partial(drawn, seed) for seed in range(runs)}
    worst = worst_share(certified(programs, refused), times=times, taken=taken)
    print(f"{runs - len(refused)} of {runs} random runs proved", *refused, sep="\n  ")
    yield "an error at random times, relative to its proved bound", worst, 1.0


@proof
def scenes(times=100_000, taken=200):
    """Certify every shipped scene in both forms."""
    refused = []
    programs = {
        f"{name}, {form}": partial(ht.propagate, ht.load_scene(name), formulation=form)
        for name in shipped_names() for form in ("axis", "attitude")
    }  # fmt: skip
    worst = worst_share(certified(programs, refused), times=times, taken=taken)
    print(*refused, sep="\n")
    yield f"scenes and forms that are not proved, of {len(programs)}", len(refused), 0
    yield "an error of a shipped scene, relative to its proved bound", worst, 1.0


@proof
def long_runs(periods=1e4):
    """Certify a long run of the kicked top with its events."""
    scene = replace(KICKED, time=None, periods=periods, samples=2)
    began = time.process_time()
    found = ht.certify(ht.propagate(scene, formulation="axis"))
    spent = time.process_time() - began
    print(f"{periods:g} periods of sicm-kicked, {found.steps} steps: {spent:.1f} s of CPU")
    if periods >= 1e5:
        minutes = spent / 60 * 1e6 / periods
        yield "CPU time of a million periods, integration included [min]", minutes, 5
    ratio = found.bound["axis"] / found.observed["axis"]
    yield "bound of the axis over the largest error found, long run", ratio, 1.5


# --- a hundred million periods ---------------------------------------------------------------
# It took hours; its certificate is kept. Here its claims are read from that file, and the first
# periods are integrated and certified again. With the word `again` everything is: the run is kept
# in out/, and so is the certificate, so that what was stopped goes on.

KEPT = Path(__file__).with_name("data") / "certified-hundred-million.json"
FOLDER = Path("out/certified-hundred-million")
FIRST = 10_000  # periods that are done again
HEADS = {"axis": "axis", "theta": "θ [rad]", "phi": "φ [rad]"}


def run_of(periods):
    """Integrate so many periods, without events: those of a hundred million fill the memory."""
    wants = {"samples": 2, "quantities": ("theta", "phi"), "events": ()}
    scene = replace(KICKED, time=None, periods=periods, **wants)
    return ht.propagate(scene, formulation="axis", projected=True)


def certify_again():
    """Integrate and certify a hundred million periods."""
    stored = FOLDER.with_suffix(".nc")
    if not stored.exists():
        run_of(10**8).save(stored)
    found = ht.certify(ht.load_trajectory(stored), jobs=2, folder=FOLDER)
    KEPT.write_text(json.dumps(found.document(), indent=1) + "\n", "utf-8")


def at_most(bound):
    """A proved bound, rounded up; nothing of one that is not there."""
    return QUANTITIES["bound"].text(bound) if bound else "–"


HEAD = ("", "proved bound", "part from adding turns", "largest error without it")


@proof
def hundred_million(again=False, write=False):
    if again:
        certify_again()
    kept = json.loads(KEPT.read_text("utf-8"))
    bound, rounding, seen = (kept[name] for name in ("bound", "rounding", "observed"))
    rows = [
        (head, at_most(bound[name]), at_most(rounding[name]), f"{seen[name]:.1e}")
        for name, head in HEADS.items()
    ]
    print(markdown(HEAD, rows))
    if write:
        rewrite("certificates.md", "certified hundred million", markdown(HEAD, rows), signed=False)
    ratio = bound["axis"] / seen["axis"]
    yield "1e8 periods, axis: proved bound", bound["axis"], 1.1e-10
    yield "1e8 periods, axis: bound over the largest error found", ratio, 1.5
    yield "1e8 periods: what is not proved", len(kept["why"]) + (not kept["turns"]), 0
    found = ht.certify(run_of(FIRST))
    yield f"{FIRST} periods, axis: proved bound", found.bound["axis"], 1e-12
    for name in HEADS:
        ratio = found.bound[name] / bound[name]
        yield f"{FIRST} periods, {name}: bound over that of 1e8", ratio, 1.0


if __name__ == "__main__":
    main()
