"""What calls cost in a process that has run once, and what a fresh process costs.

Every timed call has new numbers. All run in turn, a bare heyoka loop among them, and the best time
of each counts; fresh processes likewise, beside one that only imports heyoka and sympy. A profile
says where the time goes. With the word `write` both tables go to the documentation.
"""

import cProfile
import pstats
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import heyoka as hy
import numpy as np
from claim import claim, finish, interleaved
from page import rewrite

import heavytop as ht

REPEATS, PROFILED = 40, 20
TIME = 2.0
PAGE = "where-the-time-goes.md"
random = np.random.default_rng(29)


def numbers():
    """A top and a start that nobody has seen, within a few per cent of the book's, kicked."""
    A, C, gMR, theta, phidot, psidot = (
        float(x) for x in (3.28e-4, 6.6e-5, 0.0456, 0.1, -15, 140) * random.uniform(0.97, 1.03, 6)
    )
    top = {"A": A, "C": C, "gMR": gMR}
    return top, {"theta": theta, "phidot": phidot, "psidot": psidot}


def top_and_start():
    top, start = numbers()
    return ht.Top(**top), ht.State(**start)


def scene(quantities=("theta", "phi", "psi"), events=("turning", "reversal", "cusp"), samples=401):
    return ht.Scene(
        *top_and_start(), time=TIME, quantities=quantities, events=events, samples=samples
    )


def long_scene(digits):
    return ht.Scene(
        *top_and_start(), periods=10_000, quantities=("axis",), events=(), samples=2, digits=digits
    )


def bare_loop():
    """A step function of the axis form, and the state it is started from."""
    x, y, z, lx, ly = hy.make_vars("x", "y", "z", "lx", "ly")
    g, lz = hy.par[0], hy.par[1]
    rates = ly * z - lz * y, lz * x - lx * z, lx * y - ly * x, -g * y, g * x
    loop = hy.taylor_adaptive(list(zip((x, y, z, lx, ly), rates, strict=True)), np.zeros(5))

    def run(given):
        top, start = given
        sin, cos = np.sin(start["theta"]), np.cos(start["theta"])
        b = top["C"] / top["A"] * (start["psidot"] + start["phidot"] * cos)
        across = start["phidot"] * sin
        loop.time = 0.0
        loop.state[:] = 0.0, -sin, cos, 0.0, across * cos - b * sin
        loop.pars[:] = top["gMR"] / top["A"], across * sin + b * cos
        loop.propagate_until(TIME)

    return run


# name: what is called, what makes its argument outside of the timing, how many at once, and the
# most that it may take [s]
CALLS = {
    "a bare heyoka loop of the axis form, 2 s": (bare_loop(), numbers, 20, None),
    "`propagate`, 2 s: θ, φ, ψ and all events": (ht.propagate, scene, 1, 2e-3),
    "`propagate`, 2 s: the axis alone": (
        ht.propagate, lambda: scene(("axis",), (), 2), 1, 1e-3,
    ),
    "`run_errors` of 401 samples": (ht.run_errors, lambda: ht.propagate(scene()), 1, 3e-3),
    "`Motion(top, start).at(t)`, all built anew": (
        lambda given: ht.Motion(ht.Top(**given[0]), ht.State(**given[1])).at(1.0),
        numbers, 5, 0.5e-3,
    ),
    "`classify(top, start)`, both built anew": (
        lambda given: ht.classify(ht.Top(**given[0]), ht.State(**given[1])), numbers, 20, 1e-4,
    ),
    "`plan` of 1e4 periods, 12 digits": (ht.plan, lambda: long_scene(12), 1, None),
    "`Top` and `State`": (
        lambda given: (ht.Top(**given[0]), ht.State(**given[1])), numbers, 20, None,
    ),
}  # fmt: skip


def batch(call, arguments, count):
    """A program that makes some calls, each with the next of the arguments."""
    left = iter(arguments)
    return lambda: [call(next(left)) for _ in range(count)]


def warm():
    """The best time of each call [s]."""
    programs = {
        name: batch(call, [make() for _ in range((REPEATS + 1) * count)], count)
        for name, (call, make, count, _) in CALLS.items()
    }
    for program in programs.values():
        program()
    best = interleaved(programs, REPEATS)
    return {name: best[name] / CALLS[name][2] for name in CALLS}


def shares(call, make):
    """Where the time of a call goes, by folders of the package and by libraries."""
    arguments, profile = [make() for _ in range(PROFILED + 1)], cProfile.Profile()
    call(arguments.pop())
    profile.enable()
    for each in arguments:
        call(each)
    profile.disable()
    spent = Counter()
    for (file, _, name), (*_, own, _, _) in pstats.Stats(profile).stats.items():
        parts = Path(file).parts
        if "heavytop" in parts[:-1]:
            spent[parts[parts.index("heavytop", -4) + 1].removesuffix(".py")] += own
        else:
            known = [each for each in ("heyoka", "numpy", "flint") if each in file + name]
            spent[known[0] if known else "Python and C"] += own
    whole = spent.total()
    return ", ".join(f"{what} {t / whole:.0%}" for what, t in spent.most_common(3))


MODULE = [sys.executable, "-m", "heavytop"]
FRESH = {
    "importing heyoka and sympy": [sys.executable, "-c", "import heyoka, sympy"],
    "`heavytop run sicm-kicked --no-figures`": [*MODULE, "run", "sicm-kicked", "--no-figures"],
    "`heavytop classify sicm-kicked`": [*MODULE, "classify", "sicm-kicked"],
    "`heavytop --help`": [*MODULE, "--help"],
}
LIBRARIES, RUN, CLASSIFY, HELP = FRESH


def fresh():
    """The best time of each process [s], with what heyoka keeps."""
    programs = {
        name: lambda command=command: subprocess.run(command, check=True, capture_output=True)
        for name, command in FRESH.items()
    }
    for program in programs.values():
        program()
    return interleaved(programs, 9)


def table(times, processes, profiles):
    rows = ["| call | time | goal | where it goes |", "| -- | --: | --: | -- |"]
    for name, t in times.items():
        goal = f"{1e3 * CALLS[name][3]:g} ms" if CALLS[name][3] else "–"
        rows.append(f"| {name} | {1e3 * t:.3g} ms | {goal} | {profiles[name]} |")
    rows += ["", "| process | time | beside the imports | goal |", "| -- | --: | --: | --: |"]
    goals = {RUN: "1.7 of the imports", CLASSIFY: "0.75 of the imports", HELP: "0.12 s"}
    for name, t in processes.items():
        over = t / processes[LIBRARIES]
        rows.append(f"| {name} | {t:.2g} s | {over:.2f} | {goals.get(name, '–')} |")
    return "\n".join(rows)


if __name__ == "__main__":
    times, processes = warm(), fresh()
    for name, t in times.items():  # three times the goals, most of which are not reached
        if goal := CALLS[name][3]:
            claim(f"{name} [ms]", 1e3 * t, 3e3 * goal)
    claim(f"{RUN}, over the imports", processes[RUN] / processes[LIBRARIES], 1.9)
    claim(f"{CLASSIFY}, over the imports", processes[CLASSIFY] / processes[LIBRARIES], 0.75)
    with tempfile.TemporaryDirectory() as folder:
        for form, most in (("gif", 15.0), ("webp", 15.0)):
            begun = time.perf_counter()
            ht.film(ht.load_scene("sicm-kicked"), f"{folder}/top.{form}")
            claim(f"a film of 10 s, 800×600, {form} [s]", time.perf_counter() - begun, most)
    claim(f"{HELP} [s]", processes[HELP], 0.15)
    told = table(
        times, processes, {name: shares(call, make) for name, (call, make, *_) in CALLS.items()}
    )
    print(told)
    if "write" in sys.argv:
        rewrite(PAGE, "time", told)
    finish()
