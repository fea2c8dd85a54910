"""200 varied scenes, run by every formulation and by auto: is auto right, and is it cheap?

Each scene wants something, to some digits, over some span. A run has met them when it is within
10^-digits max(1, |x|) of the closed form of its own start. Time is that of the integration, best
of interleaved repeats, or of one if that takes a second; a formulation that cannot give what is
wanted, or start there, is left out.
"""

import random
import sys
import warnings
from dataclasses import replace
from statistics import median

from claim import claim, finish

import heavytop as ht
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import HeavyTopError
from heavytop.run.verify import missed_digits

SCENES = int(sys.argv[1]) if len(sys.argv) > 1 else 200
REPEATS, LONG_S = 3, 1.0
ROUND = (10, 100, 1000, 2000)
WANTS = (("theta",), ("theta", "phi"), ("axis",), ("phi", "psi"), ("theta", "psi"), ("attitude",))


def drawn(draw, number):
    """A scene: any top, start, want, digits and span; some pass close to a pole.

    Every third one starts at a turning point and ends a round number of periods later, with
    samples a whole number of periods apart: there every rate of theta is zero.
    """
    A = draw.choice((1.0, 3.28e-4))
    C, gMR = A * draw.uniform(0.1, 1.9), A * draw.uniform(0.5, 200) * draw.choice((1, 1, 1, -1))
    rate, sleeps = abs(gMR / A) ** 0.5, 2 * (A * abs(gMR)) ** 0.5 / C
    near = draw.random() < 0.25
    start = ht.State(
        10 ** draw.uniform(-6, -1) if near else draw.uniform(0.05, 3.0),
        thetadot=draw.choice((0.0, draw.uniform(-1, 1) * rate)) * (number % 3 > 0),
        phidot=0.0 if near else draw.uniform(-2, 2) * rate,
        omega3=sleeps * draw.uniform(-3, 3),
    )
    scene = ht.Scene(
        ht.Top(A, C, gMR), start, periods=round(10 ** draw.uniform(0, 3.3), 3),
        quantities=draw.choice(WANTS), events=draw.choice(((), ("turning",))),
        samples=draw.choice((2, 33, 401)), digits=draw.randint(5, 12),
    )  # fmt: skip
    if number % 3:
        return scene
    count, each = draw.choice(ROUND), draw.choice((1, 2, 5))
    return replace(scene, periods=ht.Exact.of(count), samples=count // each + 1)


def timed(scene, forms):
    """Best integration time of each formulation that runs [s], and its last trajectory."""
    best, runs = {}, {}
    for _ in range(REPEATS):
        for form in forms:
            if best.get(form, 0.0) > LONG_S:
                continue
            try:
                run = ht.propagate(scene, formulation=form)
            except HeavyTopError:
                continue
            spent = run.statistics.integrate_s
            best[form], runs[form] = min(best.get(form, spent), spent), run
    return best, runs


warnings.simplefilter("ignore")
draw = random.Random(7)
chosen, ratios, too_far, slower = {}, [], [], []
for number in range(SCENES):
    scene = drawn(draw, number)
    best, runs = timed(scene, ("auto", *FORMULATIONS))
    auto = runs["auto"]
    chosen[auto.plan.formulation] = chosen.get(auto.plan.formulation, 0) + 1
    missed = {form: missed_digits(run) for form, run in runs.items()}
    if missed["auto"]:
        too_far.append((number, auto.plan.formulation, scene.digits, missed["auto"]))
        continue
    met = {form: best[form] for form in FORMULATIONS if form in runs and not missed[form]}
    if met:
        cheapest = min(met, key=met.get)
        ratios.append(best["auto"] / met[cheapest])
        if ratios[-1] > 3:
            slower.append((number, auto.plan.formulation, cheapest, ratios[-1], scene.quantities))
print("chosen:", chosen)
for case in too_far + slower[:5]:
    print(case)
claim(f"{SCENES} scenes: auto misses the digits asked", len(too_far), 0)
claim("time of auto over that of the cheapest that met them, median", median(ratios), 1.3)

finish()
