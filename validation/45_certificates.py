"""Certificates: how sharp the proved bounds are, on random runs, long runs, and all scenes.

    python validation/45_certificates.py [runs] [periods] [times]

Random runs: tops, starts, forms and lengths drawn at random. The error is looked for at many random
times with the closed form in doubles, and taken to 30 digits where it is largest: it never exceeds
the bound. A long run of the kicked top: the bound, the largest error, and the time that it takes.
"""

import sys
import time
import warnings
from dataclasses import replace

import numpy as np
from claim import claim, finish, most

import heavytop as ht
from heavytop.analytic.closed_form import ClosedForm
from heavytop.errors import NotCertified
from heavytop.run.own_motion import closed_form, own_motion

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 40
PERIODS = float(sys.argv[2]) if len(sys.argv) > 2 else 1e4
TIMES = int(float(sys.argv[3])) if len(sys.argv) > 3 else 100_000
PART = 20_000
WORST = 8  # times of each quantity at which its error is taken to 30 digits
NAMES = ("axis", "theta", "phi", "psi")


def drawn(seed: int) -> ht.Trajectory:
    """Return a run of a top drawn at random, in a form drawn at random."""
    rng = np.random.default_rng([45, seed])
    top = ht.Top(*rng.uniform((1, 0.2, -3), (3, 2, 3)).tolist())
    theta, thetadot, phidot, psidot = rng.uniform((0.05, -2, -3, -20), (3.0, 2, 3, 20)).tolist()
    start = ht.State(theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    form = ("axis", "attitude", "cubic")[seed % 3]
    quantities = ("theta",) if form == "cubic" else ("theta", "phi", "psi")
    periods = float(10 ** rng.uniform(0, 2.5))
    scene = ht.Scene(top, start, periods=periods, quantities=quantities)
    return ht.propagate(scene, formulation=form, projected=bool(seed % 2))


def worst_times(run: ht.Trajectory, rng: np.random.Generator) -> dict[str, list[float]]:
    """Return the times, of many, at which each error is largest in doubles."""
    known, form = {name: [] for name in NAMES}, closed_form(run)
    for _ in range(0, TIMES, PART):
        times = np.sort(run.orbit.end * rng.uniform(0, 1, min(PART, TIMES)))
        seen, true = run(times), form(times)
        for name in NAMES:
            apart = np.abs(getattr(seen, name) - getattr(true, name))
            apart = np.sqrt((apart**2).sum(axis=-1)) if name == "axis" else apart
            order = np.argsort(-np.nan_to_num(apart, nan=-1.0))[:WORST]
            known[name] += [(float(apart[k]), float(times[k])) for k in order]
    return {
        name: [t for _, t in sorted(each, reverse=True)[:WORST]] for name, each in known.items()
    }


def exceeded(run: ht.Trajectory, found: ht.Certificate, rng: np.random.Generator) -> float:
    """Return the largest error at random times, relative to its bound."""
    exact, worst = ClosedForm(own_motion(run), 30), 0.0
    ctx = exact.ctx
    for name, times in worst_times(run, rng).items():
        bound, seen = found.bound[name], run(np.array(times))
        for k, t in enumerate(times):
            mine, true = getattr(seen, name)[k], getattr(exact(t), name)
            if bound is None or np.isnan(mine).any():
                continue
            if name == "axis":
                parts = (ctx.mpf(float(a)) - b for a, b in zip(mine, true, strict=True))
                error = float(ctx.sqrt(sum(x * x for x in parts)))
            else:
                error = abs(float(ctx.mpf(float(mine)) - true))
            worst = most(worst, error / bound)
    return worst


def main() -> None:
    """Print what was measured."""
    warnings.simplefilter("ignore")
    worst, ratios, proved = 0.0, [], 0
    for seed in range(RUNS):
        run = drawn(seed)
        try:
            found = ht.certify(run)
        except NotCertified as why:
            print(f"run {seed}: {why}")
            continue
        proved += found.proved
        worst = most(worst, exceeded(run, found, np.random.default_rng(seed)))
        if found.formulation != "cubic":  # at a pole its heights tell little of tilts
            ratios.append(found.bound["theta"] / found.observed["theta"])
    print(f"{proved} of {RUNS} random runs proved; bound of theta over the largest error found: "
          f"median {np.median(ratios):.2f}, largest {most(ratios):.2f}")  # fmt: skip
    claim("an error at random times, relative to its proved bound", worst, 1.0)
    scene = replace(ht.load_scene("sicm-kicked"), time=None, periods=ht.Exact.of(PERIODS))
    began = time.process_time()
    run = ht.propagate(replace(scene, samples=2), formulation="axis")
    integrated = time.process_time() - began
    found = ht.certify(run)
    spent = time.process_time() - began
    print(f"{PERIODS:g} periods of sicm-kicked, {found.steps} steps: {spent:.1f} s of CPU, "
          f"{integrated:.1f} of them integration")  # fmt: skip
    for name, bound in found.bound.items():
        print(f"  {name:6} bound {bound:.3e}, found {found.observed[name]:.3e}, "
              f"ratio {bound / found.observed[name]:.3f}")  # fmt: skip
    if PERIODS >= 1e5:
        claim("CPU time of a million periods, integration included [min]",
              spent / 60 * 1e6 / PERIODS, 5)  # fmt: skip
    claim("bound of the axis over the largest error found, long run",
          found.bound["axis"] / found.observed["axis"], 1.5)  # fmt: skip


if __name__ == "__main__":
    main()
    finish()
