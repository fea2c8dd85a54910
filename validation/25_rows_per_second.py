"""Rows of a map per second and core: turning points, periods and turns, and how right they are.

Kinds and tags, which are told when they are asked for, are timed apart.

The book's top over kicks of phidot and psidot, as a map is drawn, and random tops; some rows are
held against Motion at 50 digits, and all against themselves in another order.
"""

import sys
from concurrent.futures import ProcessPoolExecutor
from time import perf_counter

import numpy as np
from claim import claim, finish, interleaved

import heavytop as ht
from heavytop.analytic.many import Motions, motions_many
from heavytop.analytic.motion import Motion

ROWS = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
HELD_AGAINST = 300


def kicked(n):
    """The book's top over phidot = -20 ... 20 and psidot = -150 ... 150."""
    side = round(n**0.5)
    phidot, psidot = np.linspace(-20, 20, side), np.linspace(-150, 150, side)
    return {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456, "theta": 0.1} | {
        "phidot": phidot[:, None], "psidot": psidot,
    }  # fmt: skip


def drawn(n):
    """Tops and starts all over."""
    random = np.random.default_rng(25)
    A = np.exp(random.uniform(-2, 2, n))
    return {
        "A": A,
        "C": A * random.uniform(0.05, 1.95, n),
        "gMR": np.exp(random.uniform(-2, 2, n)) * random.choice((-1, 1), n),
        "theta": random.uniform(0.0, np.pi, n),
        "thetadot": random.normal(size=n),
        "phidot": random.normal(size=n),
        "psidot": 4 * random.normal(size=n),
    }


def columns(found):
    return np.array([getattr(found, name).ravel() for name in Motions.columns])


def errors(numbers, found, places):
    """Largest errors: relative, of angles beside max(1, |x|)."""
    rows = {name: np.broadcast_to(each, found.period.shape) for name, each in numbers.items()}
    worst = np.zeros(5)
    for at in places:
        row = {name: float(each.flat[at]) for name, each in rows.items()}
        top = ht.Top(**{name: row.pop(name) for name in ("A", "C", "gMR")})
        motion = Motion(top, ht.State(**row))
        want = np.array([getattr(motion, name) for name in Motions.columns], float)
        scale = np.maximum(1, abs(want))
        scale[2] = want[2]
        worst = np.maximum(worst, abs(columns(found)[:, at] - want) / scale)
    return worst


def half(part):
    """Half of the map, in a process of its own."""
    numbers = kicked(ROWS)
    cut = numbers["phidot"].shape[0] // 2
    numbers["phidot"] = numbers["phidot"][part * cut : (part + 1) * cut]
    return motions_many(**numbers).period.size


def in_two_processes():
    """Rows per second of two processes at once, the best of five."""
    with ProcessPoolExecutor(2) as pool:
        best = 0.0
        for _ in range(5):
            began = perf_counter()
            done = sum(pool.map(half, (0, 1)))
            best = max(best, done / (perf_counter() - began))
    return best


if __name__ == "__main__":
    random = np.random.default_rng(1)
    for name, numbers in {
        "the book's top, kicks": kicked(ROWS),
        "random tops": drawn(ROWS),
    }.items():
        best = interleaved(
            {
                "rows": lambda n=numbers: motions_many(**n),
                "kinds and tags too": lambda n=numbers: motions_many(**n, tags=True).verdicts,
            },
            5,
        )
        found = motions_many(**numbers, tags=True)
        size = found.period.size
        print(f"     {name}: {found.verdicts.counts}")
        for what, t in best.items():
            print(f"     {size / t:.3g} {what} per second of one core")
        print(f"     {found.sent} of {size} sent to Motion, {found.verdicts.sent} to balls")
        claim(f"{name}: seconds for 2e6 rows, one core", 2e6 * best["rows"] / size, 1.0)
        claim(f"{name}: share sent to Motion", found.sent / size, 3e-4)
        places = random.integers(size, size=HELD_AGAINST).tolist()
        worst = errors(numbers, found, places)
        for column, error in zip(Motions.columns, worst.tolist(), strict=True):
            claim(f"{name}: error of {column}", error, 1e-13)
        order = random.permutation(size)
        mixed = {key: np.broadcast_to(each, found.period.shape).ravel()[order]
                 for key, each in numbers.items()}  # fmt: skip
        same = columns(motions_many(**mixed)).tobytes() == columns(found)[:, order].tobytes()
        claim(f"{name}: other bits in another order", not same, 0)
    both = in_two_processes()
    print(f"     {both:.3g} rows per second of two processes")
    claim("seconds for 3e6 rows, two processes", 3e6 / both, 1.0)
    finish()
