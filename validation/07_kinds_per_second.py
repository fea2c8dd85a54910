"""Certified kinds of motion per second and core: whole arrays, and one at a time.

Random tops of both signs of gMR, with omega3 and with psidot held; and the book's top over a grid
of kicks, as a map of kinds is drawn. All verdicts are certified; how many were sent to balls is
told. Tags take longer and have no bound.
"""

import sys
from itertools import islice
from time import process_time

import numpy as np
from claim import claim, finish, interleaved

import heavytop as ht
from heavytop.classification.many import classify_many

TOPS = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
ALONE = 500


def drawn(random, n, held):
    """Tops and starts all over."""
    A = np.exp(random.uniform(-2, 2, n))
    return {
        "A": A,
        "C": A * random.uniform(0.05, 1.95, n),
        "gMR": np.exp(random.uniform(-2, 2, n)) * random.choice((-1, 1), n),
        "theta": random.uniform(0.0, np.pi, n),
        "thetadot": random.normal(size=n),
        "phidot": random.normal(size=n),
        held: 4 * random.normal(size=n),
    }


def kicked(n):
    """The book's top over tilts and kicks, psidot = 140 held."""
    side = round(n**0.5)
    tilt, kick = np.linspace(0, 3.14, side)[:, None], np.linspace(-20, 20, side)
    return {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456} | {
        "theta": tilt, "phidot": kick, "psidot": 140.0,
    }  # fmt: skip


def one_by_one(numbers):
    """Mean processor time of a certified verdict alone, from doubles to tags [s]."""
    names = list(numbers)
    rows = list(islice(zip(*(x.tolist() for x in numbers.values()), strict=True), ALONE))
    began = process_time()
    for row in rows:
        ht.classify(ht.Top(*row[:3]), ht.State(**dict(zip(names[3:], row[3:], strict=True))))
    return (process_time() - began) / ALONE


random = np.random.default_rng(2026)
maps = {
    "random tops, omega3 held": drawn(random, TOPS, "omega3"),
    "random tops, psidot held": drawn(random, TOPS, "psidot"),
    "the book's top, tilts and kicks": kicked(TOPS),
}
for name, numbers in maps.items():
    best = interleaved(
        {
            "kinds": lambda n=numbers: classify_many(**n),
            "tags too": lambda n=numbers: classify_many(**n, tags=True),
        },
        3,
    )
    found = classify_many(**numbers)
    size = found.kind.size
    print(f"     {name}: {found.counts}, {found.sent} of {size} sent to balls")
    print(
        f"     {size / best['kinds']:.3g} kinds per second, {size / best['tags too']:.3g} with tags"
    )
    claim(f"{name}: not certified", size - found.certified.sum(), 0)
    claim(f"{name}: seconds for 1e6 kinds", 1e6 * best["kinds"] / size, 1.0)

alone = min(one_by_one(maps["random tops, psidot held"]) for _ in range(20))
print(f"     {1 / alone:.4g} verdicts per second of one core, one at a time")
claim("seconds for 2000 verdicts, one at a time", 2000 * alone, 1.0)
finish()
