"""How long calls, processes, runs and maps take, each beside what it is measured against.

Times are worth something on a quiet machine alone; ratios are of best times of programs that run in
turn in one process, compile time apart. With the word `write` tables go to the documentation.
"""

import cProfile
import pstats
import subprocess
import sys
import tempfile
from collections import Counter
from functools import partial
from itertools import product
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from time import perf_counter

import numpy as np
from page import markdown, rewrite
from tools import angles_of, integrating, interleaved, main, motion_of

import heavytop as ht
from heavytop.claims import proof

BOOK = {"A": 3.28e-4, "C": 6.6e-5, "gMR": 0.0456}
KICKED = ht.load_scene("sicm-kicked")

# --- the driver beside a bare loop -----------------------------------------------------------

MODEST, LONG = 1000, 10_000  # periods: of the driver, and of the whole of `propagate`
PLAIN = {"formulation": "axis", "projected": False}  # auto would project
WANTS = {  # samples in 1000 periods, events, and at most so many times the bare loop
    "unsampled, without events": (2, "[]", 1.15),
    "every turning point with its full state": (2, '["turning"]', 3.5),
    "401 samples in 1000 periods": (401, "[]", 1.5),
}


def bare_loop():
    """heyoka's integrator of the axis form; a function that integrates from a state."""
    import heyoka as hy

    x, y, z, lx, ly = hy.make_vars("x", "y", "z", "lx", "ly")
    g, lz = hy.par[0], hy.par[1]
    rates = ly * z - lz * y, lz * x - lx * z, lx * y - ly * x, -g * y, g * x
    loop = hy.taylor_adaptive(list(zip((x, y, z, lx, ly), rates, strict=True)), np.zeros(5))

    def run(state, g, l_z, end):
        loop.time, loop.state[:], loop.pars[:] = 0.0, state, (g, l_z)
        loop.propagate_until(end)

    return run


def wanting(periods, samples, events):
    count = samples if samples == 2 else (samples - 1) * periods // MODEST + 1
    wants = (f"want.samples={count}", 'want.quantities=["theta", "axis"]', f"want.events={events}")
    return ht.load_scene("sicm-kicked", [f"span.periods={periods}", *wants])


@proof
def overhead():
    first = ht.propagate(wanting(MODEST, 2, "[]"), **PLAIN)
    p, loop = first.orbit.parameters, bare_loop()
    bare = partial(loop, first.orbit.checkpoints[0].state, p["g"], p["l_z"])
    drivers, wholes = {}, {}
    for name, (*want, _) in WANTS.items():
        drivers[name] = integrating(wanting(MODEST, *want), **PLAIN)
        wholes[name] = partial(ht.propagate, wanting(LONG, *want), **PLAIN)
    end = first.orbit.end
    best = interleaved({"bare": lambda: bare(end), **drivers}, 25)
    whole = interleaved({"bare": lambda: bare(end * LONG / MODEST), **wholes}, 5)
    for name, (*_, bound) in WANTS.items():
        yield f"driver, {name}, over bare", best[name] / best["bare"], bound
        yield f"propagate, {name}, over bare", whole[name] / whole["bare"], bound
    print(f"     bare: {best['bare'] / MODEST * 1e6:.2f} us a period")


# --- every formulation -----------------------------------------------------------------------

PERIODS, ANGLES = 100, "θ, φ, ψ"
WANTED = {"θ": 'want.quantities=["theta"]', ANGLES: 'want.quantities=["theta", "phi", "psi"]'}
COSTS = ("formulation", "wants", "operations", "steps a period", "µs a period", "error of θ",
         "of ψ")  # fmt: skip


@proof
def formulations(write=False):
    """Every formulation on the book's kicked top: operations, steps, time, error."""
    import sympy as sp

    from heavytop.equations.formulation import FORMULATIONS

    span = f"span.periods={PERIODS + 0.3}", "want.events=[]", "want.samples=100"
    cases = {
        (form, wants): ht.load_scene("sicm-kicked", [*span, words])
        for form, (wants, words) in product(FORMULATIONS, WANTED.items())
        if wants != ANGLES or "psi" in angles_of(form)
    }
    timed = {case: integrating(scene, formulation=case[0]) for case, scene in cases.items()}
    best, rows = interleaved(timed, 20), []
    for (form, wants), scene in cases.items():
        run = ht.propagate(scene, formulation=form)
        replaced, reduced = sp.cse(run.plan.equations.derivatives)
        operations = sum(map(sp.count_ops, [*(x for _, x in replaced), *reduced]))
        errors, steps = ht.run_errors(run), run.statistics.steps
        rows.append((form, wants, str(operations), f"{steps / PERIODS:.0f}",
                     f"{best[form, wants] / PERIODS * 1e6:.1f}", f"{errors.theta:.0e}",
                     f"{errors.psi:.0e}" if wants == ANGLES else ""))  # fmt: skip
        bound = 1e-10 if FORMULATIONS[form].grows else 1e-11
        yield f"{form}: error of theta after {PERIODS} periods", errors.theta, bound
    print(markdown(COSTS, rows, left=2))
    if write:
        last = {form: (form, *costs) for form, _, *costs in rows}.values()  # with all its angles
        rewrite("formulations.md", "costs", markdown((COSTS[0], *COSTS[2:]), last), signed=False)


# --- kinds, rows and the closed form ---------------------------------------------------------


def drawn(seed, n, held="psidot"):
    """Tops and starts all over, of both signs of gMR."""
    random = np.random.default_rng(seed)
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


def plane(n, **axes):
    """The book's top over two numbers of its start, as a map is drawn."""
    (x, ends), (y, others) = axes.items()
    side = round(n**0.5)
    return {x: np.linspace(*ends, side)[:, None], y: np.linspace(*others, side)}


@proof
def kinds(tops=1_000_000):
    """Certified kinds per second of one core."""
    tilts = plane(tops, theta=(0, 3.14), phidot=(-20, 20))
    maps = {
        "random tops, omega3 held": drawn(2026, tops, "omega3"),
        "random tops, psidot held": drawn(2027, tops),
        "the book's top, tilts and kicks": BOOK | tilts | {"psidot": 140.0},
    }
    for name, numbers in maps.items():
        best = interleaved({"kinds": lambda n=numbers: ht.classify_many(**n)}, 3)["kinds"]
        found = ht.classify_many(**numbers)
        size = found.kind.size
        print(f"     {name}: {found.counts}, {found.sent} of {size} sent to balls")
        yield f"{name}: not certified", size - found.certified.sum(), 0
        yield f"{name}: seconds for 1e6 kinds", 1e6 * best / size, 1.0


@proof
def rows(count=1_000_000):
    """Turning points, periods and turns: how many a second."""
    kicks = plane(count, phidot=(-20, 20), psidot=(-150, 150))
    for name, numbers in {
        "the book's top, kicks": BOOK | {"theta": 0.1} | kicks,
        "random tops": drawn(25, count),
    }.items():
        best = interleaved({"rows": lambda n=numbers: ht.motions_many(**n)}, 5)["rows"]
        found = ht.motions_many(**numbers)
        yield f"{name}: seconds for 2e6 rows, one core", 2e6 * best / found.period.size, 1.0
        yield f"{name}: share sent to Motion", found.sent / found.period.size, 3e-4


COURSES = ("sicm-kicked", "lie-group-benchmark", "near-separatrix", "separatrix", "steady-betsch")


@proof
def closed_form():
    """Tilts a second, and a thousand digits."""
    t, motions = np.linspace(-3.0, 40.0, 10**6), {name: motion_of(name) for name in COURSES}
    tilts = {name: lambda motion=motion: motion.at(t).theta for name, motion in motions.items()}
    for name, best in interleaved(tilts, 7).items():
        yield f"seconds for a million tilts, {name}", best, 1.0
    for name, motion in motions.items():
        began = perf_counter()
        at = motion.at(2, digits=1000)
        at.theta, at.phi, at.psi, at.quaternion  # noqa: B018 (each is computed when asked for)
        yield f"seconds for a state at 1000 digits, {name}", perf_counter() - began, 2.0


# --- many tops, and maps ---------------------------------------------------------------------


@proof
def many_tops(tops=200_000):
    """One nutation period each, on one thread and on two."""
    random = np.random.default_rng(5)
    start = BOOK | {
        "theta": random.uniform(0.05, 0.5, tops),
        "omega3": random.uniform(120, 160, tops),
        "phidot": random.uniform(-10, 5, tops),
    }
    period = ht.motions_many(**start).period
    ways = {"bare": {}, "watched": {"events": ("turning",)}}
    programs = {
        f"{name} {jobs}": partial(ht.propagate_many, **start, time=period, jobs=jobs, **how)
        for name, how in ways.items() for jobs in (1, 2)
    }  # fmt: skip
    found = {name: program() for name, program in programs.items()}
    best = interleaved(programs, repeats=5)
    print("".join(f"     {name} thread(s): {tops / s:.3g} a second\n" for name, s in best.items()))
    one, two = found["bare 1"], found["bare 2"]
    yield "5e5 over tops a second, two threads", 5e5 * best["bare 2"] / tops, 1
    yield "6e4 over tops a second with turning points", 6e4 * best["watched 2"] / tops, 1
    yield "tops that depend on the number of threads", np.sum(one.states != two.states), 0
    back = np.abs(one.final.theta - start["theta"]).max()
    yield "theta after a period, off its start [rad]", back, 2e-13
    missed = np.sum(abs(found["watched 2"].count("turning") - 2.5) > 0.6)
    yield "tops with a turning point missed or doubled", missed, 0


MAPS = {  # pixels along an axis, and at least so many a second
    "kinds alone": (4000, {"only": "kind"}, 5e6),
    "all quantities": (1500, {}, 2e5),
}
MAPPED = ("map", "pixels", "pixels a second, in the workers", "whole time [s]")


@proof
def maps(write=False, side=10_000):
    """Pixels a second of an atlas, its memory, and a map of a hundred million pixels."""

    def axes(side):
        return f"phidot=-20:20:{side}", f"psidot=-150:150:{side}"

    table = []
    for name, (many, options, least) in MAPS.items():
        began = perf_counter()
        found = ht.atlas(KICKED, *axes(many), jobs=2, **options)
        spent, rate = perf_counter() - began, found.kinds_per_s or found.rows_per_s
        table.append((name, f"{many**2:.3g}", f"{rate:.3g}", f"{spent:.1f}"))
        yield f"{name}: pixels that are not proved", found.uncertified, 0
        yield f"{name}: {least:g} over pixels a second, two cores", least / rate, 1
        memory = getrusage(RUSAGE_CHILDREN).ru_maxrss / 1e6
        yield f"memory of a worker, {name} [GB]", memory, 0.5
    with tempfile.TemporaryDirectory() as place:
        huge = ht.atlas(KICKED, *axes(side), only="kind", jobs=2, folder=f"{place}/huge")
        huge.save_data(Path(place))
        yield f"{side**2} pixels: not proved", huge.uncertified, 0
    print(markdown(MAPPED, table))
    if write:
        rewrite("atlas.md", "atlas", markdown(MAPPED, table))


# --- warm calls and fresh processes ----------------------------------------------------------

REPEATS, PROFILED = 40, 20
TIME = 2.0
random = np.random.default_rng(29)


def numbers():
    """A top and a start that nobody has seen, within a few per cent of the book's, kicked."""
    A, C, gMR, theta, phidot, psidot = (
        float(x) for x in (*BOOK.values(), 0.1, -15, 140) * random.uniform(0.97, 1.03, 6)
    )
    return {"A": A, "C": C, "gMR": gMR}, {"theta": theta, "phidot": phidot, "psidot": psidot}


def made(given):
    return ht.Top(**given[0]), ht.State(**given[1])


def scene(quantities=("theta", "phi", "psi"), events=("turning", "reversal", "cusp"), samples=401):
    return ht.Scene(
        *made(numbers()), time=TIME, quantities=quantities, events=events, samples=samples
    )


def long_scene():
    wants = {"quantities": ("axis",), "events": (), "samples": 2, "digits": 12}
    return ht.Scene(*made(numbers()), periods=10_000, **wants)


def bare_program():
    loop = bare_loop()

    def bare(given):
        top, start = given
        sin, cos = np.sin(start["theta"]), np.cos(start["theta"])
        b = top["C"] / top["A"] * (start["psidot"] + start["phidot"] * cos)
        across = start["phidot"] * sin
        state = 0.0, -sin, cos, 0.0, across * cos - b * sin
        loop(state, top["gMR"] / top["A"], across * sin + b * cos, TIME)

    return bare


def timed_calls():
    """What is called, what makes its argument, and the most it may take [s]."""
    return {
        "a bare heyoka loop of the axis form, 2 s": (bare_program(), numbers, None),
        "`propagate`, 2 s: θ, φ, ψ and all events": (ht.propagate, scene, 2e-3),
        "`propagate`, 2 s: the axis alone": (ht.propagate, lambda: scene(("axis",), (), 2), 1e-3),
        "`run_errors` of 401 samples": (ht.run_errors, lambda: ht.propagate(scene()), 3e-3),
        "`Motion(top, start).at(t)`, all built anew": (
            lambda given: ht.Motion(*made(given)).at(1.0), numbers, 0.5e-3,
        ),
        "`classify(top, start)`, both built anew": (
            lambda given: ht.classify(*made(given)), numbers, 1e-4,
        ),
        "`plan` of 1e4 periods, 12 digits": (ht.plan, long_scene, None),
        "`Top` and `State`": (made, numbers, None),
    }  # fmt: skip


MODULE = [sys.executable, "-m", "heavytop"]
HELP, IMPORTING = "`heavytop --help`", "importing heyoka and sympy"
RUN = [*MODULE, "run", "sicm-kicked", "--no-figures"]
FRESH = {  # and at most so many times the imports, if anything
    IMPORTING: ([sys.executable, "-c", "import heyoka, sympy"], None),
    "`heavytop run sicm-kicked --no-figures`": (RUN, 1.9),
    "the same with `-o`": ([*RUN, "--force", "-o", f"{tempfile.gettempdir()}/run"], 2.3),
    "`heavytop classify sicm-kicked`": ([*MODULE, "classify", "sicm-kicked"], 0.75),
    HELP: ([*MODULE, "--help"], None),
}  # fmt: skip


def calling(call, make, count):
    """A program that makes so many calls, each with another argument, which was made before."""
    left = iter([make() for _ in range((REPEATS + 1) * count)])
    return lambda: [call(next(left)) for _ in range(count)]


def at_once(goal):
    """How many calls are timed together: one that takes long, several of one that does not."""
    return 1 if goal and goal >= 1e-3 else 20


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


@proof
def calls(write=False):
    """What calls with new numbers cost in a process that has run once; and fresh processes."""
    known = timed_calls()
    warm = {name: calling(*each, at_once(goal)) for name, (*each, goal) in known.items()}
    start = partial(subprocess.run, check=True, capture_output=True)
    fresh = {name: partial(start, command) for name, (command, _) in FRESH.items()}
    for program in (warm | fresh).values():
        program()
    times, processes = interleaved(warm, REPEATS), interleaved(fresh, 9)
    calls, beside = [], []
    for name, (call, make, goal) in known.items():
        shown = f"{1e3 * goal:g} ms" if goal else "–"
        each = 1e3 * times[name] / at_once(goal)
        calls.append((name, f"{each:.3g} ms", shown, shares(call, make)))
        if goal:  # three times the goals, most of which are not reached
            yield f"{name} [ms]", each, 3e3 * goal
    for name, (_, goal) in FRESH.items():
        ratio = processes[name] / processes[IMPORTING]
        beside.append((name, f"{processes[name]:.2g} s", f"{ratio:.2f}"))
        if goal:
            yield f"{name}, over the imports", ratio, goal
    yield f"{HELP} [s]", processes[HELP], 0.15
    with tempfile.TemporaryDirectory() as folder:
        for form in ("gif", "webp"):
            began = perf_counter()
            ht.film(KICKED, f"{folder}/top.{form}")
            yield f"a film of 10 s, 800×600, {form} [s]", perf_counter() - began, 15.0
    tables = (
        markdown(("call", "time", "goal", "where it goes"), calls),
        markdown(("process", "time", "beside the imports"), beside),
    )
    print("\n\n".join(tables))
    if write:
        rewrite("where-the-time-goes.md", "time", "\n\n".join(tables))


if __name__ == "__main__":
    main()
