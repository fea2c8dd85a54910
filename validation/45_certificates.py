"""Certificates: how sharp the proved bounds are, on random runs, all scenes, and a long run.

    python validation/45_certificates.py [runs] [periods] [times] [taken]

Random runs: tops, starts, forms and lengths drawn at random. The error is looked for at many random
times with the closed form in doubles, and taken in 128 bits where it is largest, and at some random
times: it never exceeds the bound. The same for every shipped scene in both forms. A long run
of the kicked top: the bound, the largest error, and the time that it takes; then one projected.
"""

import sys
import time
import warnings
from dataclasses import replace

import numpy as np
from claim import claim, finish, most
from digits import Digits

import heavytop as ht
from heavytop.errors import NotCertified
from heavytop.run.own_motion import own_motion
from heavytop.scene.scene import shipped_names

RUNS = int(sys.argv[1]) if len(sys.argv) > 1 else 40
PERIODS = float(sys.argv[2]) if len(sys.argv) > 2 else 1e4
TIMES = int(float(sys.argv[3])) if len(sys.argv) > 3 else 100_000
TAKEN = int(float(sys.argv[4])) if len(sys.argv) > 4 else 200
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


def times_to_look_at(run: ht.Trajectory, rng: np.random.Generator) -> set[float]:
    """Return the times, of many, at which errors in doubles are largest, and some random ones."""
    known, form = {name: [] for name in NAMES}, own_motion(run).at
    for _ in range(0, TIMES, PART):
        times = np.sort(run.orbit.end * rng.uniform(0, 1, min(PART, TIMES)))
        seen, true = run(times), form(times)
        for name in NAMES:
            apart = np.abs(getattr(seen, name) - getattr(true, name))
            apart = np.sqrt((apart**2).sum(axis=-1)) if name == "axis" else apart
            order = np.argsort(-np.nan_to_num(apart, nan=-1.0))[:WORST]
            known[name] += [(float(apart[k]), float(times[k])) for k in order]
    worst = {t for each in known.values() for _, t in sorted(each, reverse=True)[:WORST]}
    return worst | set((run.orbit.end * rng.uniform(0, 1, TAKEN)).tolist())


def largest_errors(run: ht.Trajectory, rng: np.random.Generator) -> dict[str, float]:
    """Return the largest errors found, in 128 bits."""
    exact, found = Digits(own_motion(run), DIGITS), dict.fromkeys(NAMES, 0.0)
    times = sorted(times_to_look_at(run, rng))
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

    def __init__(self) -> None:
        """Begin without any."""
        self.known: dict[tuple[str, bool], list[float]] = {}
        self.worst = 0.0  # an error over its bound

    def add(self, run: ht.Trajectory, found: ht.Certificate, seed: int) -> None:
        """Look for the errors of a run, and keep how they compare with its bounds."""
        period = run.motion.period
        short = period is None or abs(run.orbit.end) < 10 * float(period)
        for name, error in largest_errors(run, np.random.default_rng(seed)).items():
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


def random_runs() -> None:
    """Certify runs drawn at random."""
    ratios, proved = Ratios(), 0
    for seed in range(RUNS):
        run = drawn(seed)
        try:
            found = ht.certify(run)
        except NotCertified as why:
            print(f"run {seed}: {why}")
            continue
        proved += found.proved
        ratios.add(run, found, seed)
    print(f"{proved} of {RUNS} random runs proved; bounds over the largest errors found:")
    ratios.tell()
    claim("an error at random times, relative to its proved bound", ratios.worst, 1.0)


def scenes() -> None:
    """Certify every shipped scene in both forms."""
    ratios, refused = Ratios(), []
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
    claim("scenes and forms that are not proved, of 52", len(refused), 0)
    claim("an error of a shipped scene, relative to its proved bound", ratios.worst, 1.0)


def long_run(*, projected: bool) -> None:
    """Certify a long run of the kicked top."""
    scene = replace(ht.load_scene("sicm-kicked"), time=None, periods=ht.Exact.of(PERIODS))
    if projected:
        scene = replace(scene, events=())
    began = time.process_time()
    run = ht.propagate(replace(scene, samples=2), formulation="axis", projected=projected)
    integrated = time.process_time() - began
    found = ht.certify(run)
    spent = time.process_time() - began
    how = "projected, without events" if projected else "with its events"
    print(f"{PERIODS:g} periods of sicm-kicked, {how}, {found.steps} steps: {spent:.1f} s of CPU, "
          f"{integrated:.1f} of them integration")  # fmt: skip
    for name, bound in found.bound.items():
        if bound is None:
            continue
        print(f"  {name:6} bound {bound:.3e}, found {found.observed[name]:.3e}, "
              f"ratio {bound / found.observed[name]:.3f}")  # fmt: skip
    if PERIODS >= 1e5:
        claim("CPU time of a million periods, integration included [min]",
              spent / 60 * 1e6 / PERIODS, 5)  # fmt: skip
    if PERIODS >= 1e6 or not projected:
        claim("bound of the axis over the largest error found, long run",
              found.bound["axis"] / found.observed["axis"], 1.5)  # fmt: skip


def main() -> None:
    """Print what was measured."""
    warnings.simplefilter("ignore")
    if RUNS:
        random_runs()
        scenes()
    for projected in (False, True):
        long_run(projected=projected)


if __name__ == "__main__":
    main()
    finish()
