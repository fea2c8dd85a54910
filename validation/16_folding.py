"""A motion folded onto half a nutation: its errors a million million periods away, and its cost."""

import subprocess
import sys
from time import perf_counter

import numpy as np
from claim import claim, finish, most

import heavytop as ht
from heavytop.numbers import Exact
from heavytop.scene.scene import shipped_scenes

PARTS = (0.3, 1e3 + 0.1, 1e6 + 0.2, 1e9 + 0.3, 1e12 + 0.45, -1e12 - 0.33)
NEVER = ("separatrix", "planar-asymptotic")
BARE = ['want.quantities=["theta", "phi", "psi"]', "want.events=[]", "want.samples=5"]
FRESH = """
from time import perf_counter
began = perf_counter()
import heavytop as ht
ht.fold(ht.load_scene("sicm-kicked", ["span.periods=1e12"])).end
print(perf_counter() - began)
"""


def off(sample, exact, ctx):
    """Return the errors of the axis, and of phi and psi with all their turns."""
    axis = most(abs(float(x - y)) for x, y in zip(sample.axis, exact.axis, strict=True))
    turned = (
        2 * ctx.pi * int(getattr(sample, f"{a}_turns")) + ctx.mpf(getattr(sample, f"{a}_mod"))
        for a in ("phi", "psi")
    )
    return axis, *(abs(float(x - y)) for x, y in zip(turned, (exact.phi, exact.psi), strict=True))


def far(name):
    """Return the largest errors of a scene, and of its period, relative."""
    scene = ht.load_scene(name)
    motion, folded = ht.Motion(scene.top, scene.start), ht.fold(scene)
    form, period = motion.form(60), folded.period or 1
    errors = [off(folded(p * period), form(p * period), form.ctx) for p in PARTS]
    late = abs(float(folded.period / form.period - 1)) if folded.period else 0.0
    return np.max(errors, axis=0), late


def best(program, repeats=5):
    """Return the best time of a program [s]."""
    spent = []
    for _ in range(repeats):
        began = perf_counter()
        program()
        spent.append(perf_counter() - began)
    return min(spent)


found = [far(name) for name in shipped_scenes() if name not in NEVER]
axis, phi, psi = np.max([errors for errors, _ in found], axis=0)
claim("axis, up to 1e12 periods", axis, 1e-13)
claim("phi, its turns and its rest", phi, 1e-13)
claim("psi, its turns and its rest", psi, 1e-13)
claim("period, relative", most(late for _, late in found), 1e-28)

scene = ht.load_scene("sicm-kicked", ["span.time=1000000000.1"])
form = ht.Motion(scene.top, scene.start).form(60)
exact = form(Exact.of("1000000000.1"))
late = off(ht.fold(scene).end, exact, form.ctx)[1]
claim("phi at 1000000000.1 s, which is no double", late, 1e-13)

fresh = [float(subprocess.check_output([sys.executable, "-c", FRESH])) for _ in range(3)]
claim("seconds to fold 1e12 periods in a fresh process, all included", min(fresh), 1.0)
book = ht.fold(ht.load_scene("sicm-kicked"))
times = np.random.default_rng(1).uniform(-1e12, 1e12, 100_000)
claim("microseconds per time, in an array", best(lambda: book(times)) * 1e6 / times.size, 5.0)
claim("microseconds for one time, as a text", best(lambda: book("987654321.1"), 50) * 1e6, 1000.0)

folding = best(lambda: ht.fold(ht.load_scene("sicm-kicked", ["span.periods=1e12"])))
print(f"     folding again, in the same process: {folding:.3f} s")
for digits, counts in ((12, (100, 1000, 10_000, 100_000)), (30, (10, 30))):
    for count in counts:
        scene = ht.load_scene(
            "sicm-kicked", [f"span.periods={count}.3", f"want.digits={digits}", *BARE]
        )
        plan = ht.plan(scene)
        spent = best(lambda scene=scene: ht.propagate(scene), 2)
        how = f"{plan.precision}{', projected' * plan.projected}"
        print(f"     {count} periods to {digits} digits, integrated in {how}: {spent:.3f} s")
finish()
