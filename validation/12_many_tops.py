"""Many tops at once, one nutation period each, on two threads: how many a second, and how right."""

from functools import partial

import numpy as np
from claim import claim, finish, interleaved

import heavytop as ht

TOPS = 200_000

random = np.random.default_rng(5)
A, C, gMR = 3.28e-4, 6.6e-5, 0.0456
theta, omega3 = random.uniform(0.05, 0.5, TOPS), random.uniform(120, 160, TOPS)
phidot = random.uniform(-10, 5, TOPS)
# T by a quarter of the steps of the arithmetic-geometric mean, from the cubic's roots in doubles
b, g, s2 = C * omega3 / A, gMR / A, np.sin(theta) ** 2
a, h = phidot * s2 + b * np.cos(theta), phidot**2 * s2 / 2 + g * np.cos(theta)
roots = np.sort(
    [np.roots([2 * g, -(2 * h[i] + b[i] ** 2), 2 * (a[i] * b[i] - g), 2 * h[i] - a[i] ** 2]).real
     for i in range(2000)], axis=1,
)  # fmt: skip
x, y = np.ones(2000), np.sqrt((roots[:, 2] - roots[:, 1]) / (roots[:, 2] - roots[:, 0]))
for _ in range(6):
    x, y = (x + y) / 2, np.sqrt(x * y)
period = np.resize(np.pi / x / np.sqrt(g * (roots[:, 2] - roots[:, 0]) / 2), TOPS)
theta, omega3, phidot = (np.resize(each[:2000], TOPS) for each in (theta, omega3, phidot))
start = {"A": A, "C": C, "gMR": gMR, "theta": theta, "phidot": phidot, "omega3": omega3}


def bare(jobs):
    """Every top for one period."""
    return ht.propagate_many(**start, time=period, jobs=jobs)


def watched(jobs):
    """Every top for one period and the starting turning point's other side, its turnings found."""
    return ht.propagate_many(**start, time=period, events=("turning",), jobs=jobs)


ways = {"bare": bare, "watched": watched}
programs = {f"{what} {jobs}": partial(f, jobs) for what, f in ways.items() for jobs in (1, 2)}
for program in programs.values():
    program()
best = interleaved(programs, repeats=5)
rates = {name: TOPS / seconds for name, seconds in best.items()}
for name, rate in rates.items():
    print(f"{name} thread(s): {rate:.3g} tops a second")
claim("5e5 over tops a second, two threads", 5e5 / rates["bare 2"], 1)
claim("6e4 over tops a second with their turning points", 6e4 / rates["watched 2"], 1)
one, two = bare(1), bare(2)
claim("tops that depend on the number of threads", np.sum(one.states != two.states), 0)
claim("theta after a period, off its start [rad]", np.abs(one.final.theta - theta).max(), 2e-13)
met = watched(2)
claim(
    "tops with a turning point missed or doubled", np.sum(abs(met.count("turning") - 2.5) > 0.6), 0
)
finish()
