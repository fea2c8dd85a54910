"""Certificates: how sharp the proved bounds are, on random runs, all scenes, and a long run.

Random runs: tops, starts, forms and lengths drawn at random. The error is looked for at many random
times with the closed form in doubles, and taken in 128 bits where it is largest, and at some random
times: it never exceeds the bound. The same for every shipped scene in both forms. A long run
of the kicked top: the bound, the largest error, and the time that it takes; then one projected; and
a hundred million periods, whose certificate is kept.
"""

from __future__ import annotations

import json
import resource
import time
import warnings
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
from page import markdown, rewrite
from tools import Digits, main, most

import heavytop as ht
from heavytop.claims import proof
from heavytop.errors import NotCertified
from heavytop.scene.quantities import QUANTITIES
from heavytop.scene.scene import shipped_names

PART = 20_000
WORST = 8  # times of each quantity at which its error is taken in 128 bits
DIGITS = 38
NAMES = ("axis", "theta", "phi", "psi")


def drawn(seed: int) -> ht.Trajectory:
    """Return a run of a top drawn at random, in a form drawn at random."""
    rng = np.random.default_rng([45, seed])
    top = ht.Top(*rng.uniform((1, 0.2, -3), (3, 2, 3)).tolist())
    theta, thetadot, phidot, psidot = rng.uniform((0.05, -2, -3, -20), (3.0, 2, 3, 20)).tolist()
    start = ht.State(theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    form = ("axis", "attitude")[seed % 2]
    periods = float(10 ** rng.uniform(0, 2.5))
    scene = ht.Scene(top, start, periods=periods, quantities=("theta", "phi", "psi"))
    return ht.propagate(scene, formulation=form, projected=seed % 4 < 2)


def run_motion(run: ht.Trajectory) -> ht.Motion:
    """Return the exact motion of a run's own binary start."""
    from heavytop.run.own_motion import own_motion

    return own_motion(run)


def times_to_look_at(
    run: ht.Trajectory, rng: np.random.Generator, times: int, taken: int
) -> set[float]:
    """Return the times, of many, at which errors in doubles are largest, and some random ones."""
    known, form = {name: [] for name in NAMES}, run_motion(run).at
    for _ in range(0, times, PART):
        some = np.sort(run.orbit.end * rng.uniform(0, 1, min(PART, times)))
        seen, true = run(some), form(some)
        for name in NAMES:
            apart = np.abs(getattr(seen, name) - getattr(true, name))
            apart = np.sqrt((apart**2).sum(axis=-1)) if name == "axis" else apart
            order = np.argsort(-np.nan_to_num(apart, nan=-1.0))[:WORST]
            known[name] += [(float(apart[k]), float(some[k])) for k in order]
    worst = {t for each in known.values() for _, t in sorted(each, reverse=True)[:WORST]}
    return worst | set((run.orbit.end * rng.uniform(0, 1, taken)).tolist())


def largest_errors(run: ht.Trajectory, seed: int, **look: int) -> dict[str, float]:
    """Return the largest errors found, in 128 bits."""
    exact, found = Digits(run_motion(run), DIGITS), dict.fromkeys(NAMES, 0.0)
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


class Ratios:
    """Bounds over the largest errors found, of each quantity in short and in long runs."""

    def __init__(self, times: int, taken: int) -> None:
        """Begin without any; errors are looked for at so many times, of which some are taken."""
        self.look = {"times": times, "taken": taken}
        self.known: dict[tuple[str, bool], list[float]] = {}
        self.worst = 0.0  # an error over its bound

    def add(self, run: ht.Trajectory, found: ht.Certificate, seed: int) -> None:
        """Look for the errors of a run, and keep how they compare with its bounds."""
        period = run.motion.period
        short = period is None or abs(run.orbit.end) < 10 * float(period)
        for name, error in largest_errors(run, seed, **self.look).items():
            bound = found.bound[name]
            if bound is not None and bound > 0:
                self.worst = most(self.worst, error / bound)
                if error > 0:
                    self.known.setdefault((name, short), []).append(bound / error)

    def tell(self) -> None:
        """Print them."""
        for (name, short), each in sorted(self.known.items()):
            runs = f"{'below' if short else 'from '} ten periods, {len(each):3} runs"
            print(f"  {name:6} {runs}: median {np.median(each):.2f}, "
                  f"nine of ten below {np.quantile(each, 0.9):.2f}")  # fmt: skip


@proof(minutes=4)
def random_runs(runs=40, times=100_000, taken=200):
    """Certify runs drawn at random."""
    warnings.simplefilter("ignore")
    ratios, proved = Ratios(times, taken), 0
    for seed in range(runs):
        run = drawn(seed)
        try:
            found = ht.certify(run)
        except NotCertified as why:
            print(f"run {seed}: {why}")
            continue
        proved += found.proved
        ratios.add(run, found, seed)
    print(f"{proved} of {runs} random runs proved; bounds over the largest errors found:")
    ratios.tell()
    yield "an error at random times, relative to its proved bound", ratios.worst, 1.0


@proof(minutes=5)
def scenes(times=100_000, taken=200):
    """Certify every shipped scene in both forms."""
    warnings.simplefilter("ignore")
    ratios, refused = Ratios(times, taken), []
    names = shipped_names()
    for name in names:
        for form in ("axis", "attitude"):
            try:
                run = ht.propagate(ht.load_scene(name), formulation=form)
                found = ht.certify(run)
            except ht.HeavyTopError as why:
                refused.append(f"{name}, {form}: {why}")
                continue
            if not found.proved:
                refused.append(f"{name}, {form}: {'; '.join(found.why)}")
            ratios.add(run, found, 0)
    print(f"{len(names)} scenes in two forms; bounds over the largest errors found:")
    ratios.tell()
    for each in refused:
        print(f"  not proved: {each}")
    yield f"scenes and forms that are not proved, of {2 * len(names)}", len(refused), 0
    yield "an error of a shipped scene, relative to its proved bound", ratios.worst, 1.0


@proof(minutes=0.3)
def long_runs(periods=1e4):
    """Certify a long run of the kicked top with its events, and a projected one without."""
    warnings.simplefilter("ignore")
    for projected in (False, True):
        yield from long_run(periods, projected)


def long_run(periods, projected):
    scene = replace(ht.load_scene("sicm-kicked"), time=None, periods=ht.Exact.of(periods))
    if projected:
        scene = replace(scene, events=())
    began = time.process_time()
    run = ht.propagate(replace(scene, samples=2), formulation="axis", projected=projected)
    integrated = time.process_time() - began
    found = ht.certify(run)
    spent = time.process_time() - began
    how = "projected, without events" if projected else "with its events"
    print(f"{periods:g} periods of sicm-kicked, {how}, {found.steps} steps: {spent:.1f} s of CPU, "
          f"{integrated:.1f} of them integration")  # fmt: skip
    for name, bound in found.bound.items():
        if bound is None:
            continue
        print(f"  {name:6} bound {bound:.3e}, found {found.observed[name]:.3e}, "
              f"ratio {bound / found.observed[name]:.3f}")  # fmt: skip
    if periods >= 1e5:
        yield (
            "CPU time of a million periods, integration included [min]",
            spent / 60 * 1e6 / periods,
            5,
        )
    if periods >= 1e6 or not projected:
        yield (
            "bound of the axis over the largest error found, long run",
            found.bound["axis"] / found.observed["axis"],
            1.5,
        )


# --- a hundred million periods ---------------------------------------------------------------
# It took hours; the result is kept. Here its claims are read from that file, and the first periods
# are integrated and certified again. With the word `again` everything is: the run is kept in out/,
# and so is the certificate, so that what was stopped goes on.

KEPT = Path(__file__).with_name("data") / "certified-hundred-million.json"
FOLDER = Path("out/certified-hundred-million")
FIRST = 10_000  # periods that are done again
HEADS = {"axis": "axis", "theta": "θ [rad]", "phi": "φ [rad]"}


def run_of(periods: int) -> ht.Trajectory:
    """Integrate so many periods, without events: those of a hundred million fill the memory."""
    scene = replace(ht.load_scene("sicm-kicked"), time=None, periods=ht.Exact.of(periods))
    wanted = replace(scene, samples=2, quantities=("theta", "phi"), events=())
    return ht.propagate(wanted, formulation="axis", projected=True)


def cpu_s() -> float:
    """CPU time of this process and of those that have ended, which it began [s]."""
    own, others = (resource.getrusage(x) for x in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(x.ru_utime + x.ru_stime for x in (own, others))


def certify_again() -> None:
    """Integrate and certify a hundred million periods."""
    stored = FOLDER.with_suffix(".nc")
    if not stored.exists():
        run_of(10**8).save(stored)
    integrated = cpu_s()
    found = ht.certify(ht.load_trajectory(stored), jobs=2, folder=FOLDER)
    cost = {"integration_h": integrated / 3600, "certificate_h": (cpu_s() - integrated) / 3600}
    made = {"cpu": cost, "date": str(date.today())}
    KEPT.write_text(json.dumps(found.document() | made, indent=1) + "\n", "utf-8")


def at_most(bound: float) -> str:
    """A proved bound, rounded up."""
    return QUANTITIES["bound"].text(bound)


HEAD = ("", "proved bound", "part from adding turns", "largest error without it")


@proof(minutes=0.3)
def hundred_million(again=False, write=False):
    if again:
        certify_again()
    kept = json.loads(KEPT.read_text("utf-8"))
    bound, rounding, seen = (kept[name] for name in ("bound", "rounding", "observed"))
    rows = [
        (head, at_most(bound[name]), at_most(rounding[name]) if rounding[name] else "–",
         f"{seen[name]:.1e}")
        for name, head in HEADS.items()
    ]  # fmt: skip
    print(markdown(HEAD, rows))
    if write:
        rewrite("certificates.md", "certified hundred million", markdown(HEAD, rows))
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
