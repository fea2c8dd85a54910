"""Our layer over a bare loop of the same equations, and the axis form against the textbook's.

Ratios of best times, all programs run in turn in one process; compile time apart. The driver is
measured over 1000 nutation periods; over 10 000 the whole of `propagate` is, with its plan, its
exact start and its events.
"""

import heyoka as hy
from claim import claim, finish, interleaved

import heavytop as ht

MODEST = 1000
LONG = 10_000
PLAIN = {"formulation": "axis", "projected": False}  # auto would project: what that costs, 09 says


def scene(periods, *overrides):
    base = (f"span.periods={periods}", 'want.quantities=["theta", "axis"]', "want.events=[]")
    return ht.load_scene("sicm-kicked", overrides=[*base, *overrides])


first = ht.propagate(scene(MODEST, "want.samples=2"), **PLAIN)
start, p = first.orbit.checkpoints[0].state, first.orbit.parameters
period = first.orbit.end / MODEST
x, y, z, lx, ly = hy.make_vars("x", "y", "z", "lx", "ly")
g, lz = hy.par[0], hy.par[1]
bare = hy.taylor_adaptive(
    [
        (x, ly * z - lz * y),
        (y, lz * x - lx * z),
        (z, lx * y - ly * x),
        (lx, -g * y),
        (ly, g * x),
    ],
    start,
    pars=[p["g"], p["l_z"]],
)


def bare_loop(periods):
    bare.time = 0.0
    bare.state[:] = start
    bare.propagate_until(periods * period)


WANTS = {
    "unsampled, without events": (2, '["theta", "axis"]', "[]", 1.15),
    "every turning point with its full state": (2, '["theta", "axis"]', '["turning"]', 3.5),
    "401 samples in 1000 periods": (401, '["theta", "axis"]', "[]", 1.5),
    "every turning point, and phi": (2, '["theta", "phi"]', '["turning"]', None),
    "401 samples in 1000 periods, and phi": (401, '["theta", "phi"]', "[]", None),
    "401 samples in 1000 periods, phi and psi": (401, '["theta", "phi", "psi"]', "[]", None),
}


def wanting(periods, samples, quantities, events):
    count = samples if samples == 2 else (samples - 1) * periods // MODEST + 1
    wants = (f"want.samples={count}", f"want.quantities={quantities}", f"want.events={events}")
    return scene(periods, *wants)


def driver_ratios():
    """Best time inside the driver, over best bare time, 1000 periods."""
    scenes = {name: wanting(MODEST, *want[:3]) for name, want in WANTS.items()}
    best = dict.fromkeys(scenes, float("inf"))
    floor = float("inf")
    for _ in range(25):
        floor = min(floor, interleaved({"bare": lambda: bare_loop(MODEST)}, 1)["bare"])
        for name, each in scenes.items():
            best[name] = min(best[name], ht.propagate(each, **PLAIN).statistics.integrate_s)
    return {name: t / floor for name, t in best.items()}, floor


def whole_ratios():
    """Best time of all of `propagate`, over best bare time, 10 000 periods."""
    scenes = {name: wanting(LONG, *want[:3]) for name, want in WANTS.items()}
    programs = {name: (lambda s=s: ht.propagate(s, **PLAIN)) for name, s in scenes.items()}
    best = interleaved({"bare": lambda: bare_loop(LONG)} | programs, 5)
    return {name: best[name] / best["bare"] for name in scenes}


driver, floor = driver_ratios()
whole = whole_ratios()
for name, (*_, bound) in WANTS.items():
    for what, ratio in (("driver", driver[name]), ("propagate", whole[name])):
        if bound is None:
            print(f"     {what}, {name}: {ratio:.2f} of bare")
        else:
            claim(f"{what}, {name}, over bare", ratio, bound)

# a tenth of the span: over longer ones the textbook form loses its step control, and warns
short = scene(100, "want.samples=2")


def integrating(formulation):
    return ht.propagate(short, formulation=formulation).statistics.integrate_s


spent = {"axis": [], "lagrange": []}
for _ in range(30):
    for formulation, times in spent.items():
        times.append(integrating(formulation))
claim("axis form's time over the textbook's", min(spent["axis"]) / min(spent["lagrange"]), 0.2)
print(f"     bare: {floor / MODEST * 1e6:.2f} us a period")
print(f"     compiled, or fetched from heyoka's cache, in {first.statistics.compile_s:.2f} s")
finish()
