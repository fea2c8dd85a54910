"""Random tops: certified verdicts against integrated events, and auto against every formulation."""

import random
import warnings
from collections import Counter
from dataclasses import replace
from statistics import median

import numpy as np
from tools import main

import heavytop as ht
from heavytop.claims import proof

# --- verdicts --------------------------------------------------------------------------------

ROUNDING = 1e-12  # of phidot sin^2, beside p/A: zero as far as an integration can see


def random_top(draw):
    """A top and a start, as the doubles of A, C, gMR, theta, thetadot, phidot, omega3."""
    A = np.exp(draw.uniform(-2, 2))
    C = A * draw.uniform(0.05, 1.95)
    gMR = np.exp(draw.uniform(-2, 2)) * draw.choice((-1, 1))
    theta, thetadot = draw.uniform(0.05, 3.09), draw.normal()
    omega3 = 4 * draw.normal() * np.sqrt(A * abs(gMR)) / C
    phidot = draw.normal() * np.sqrt(abs(gMR) / A)
    family = draw.integers(4)
    if family == 0:  # released from rest
        thetadot = phidot = 0.0
    elif family == 1:  # beside a cusp
        thetadot, phidot = 0.0, draw.choice((-1, 1)) * 10.0 ** draw.uniform(-9, -3)
    return A, C, gMR, theta, thetadot, phidot, omega3


def seen(taylor, A, C, gMR, theta, thetadot, phidot, omega3):
    """The kind of motion as its events over one period show it."""
    b, s, c = C * omega3 / A, np.sin(theta), np.cos(theta)
    e = np.array([0.0, -s, c])  # at phi = 0
    l = b * e + np.array([thetadot, phidot * s * c, phidot * s * s])  # noqa: E741
    state = np.array([*e, l[0], l[1]])
    taylor.load({"g": gMR / A, "l_z": l[2], "n": b})
    signs = [] if thetadot else [l[2] * (s * s) - c * (l[0] * e[0] + l[1] * e[1])]
    while len(signs) < 4:
        block = taylor.block(state, 20, 1e9)
        (turning,) = block.hits
        for t, x in zip(turning.t, turning.states, strict=True):
            if len(signs) < 4 and t > 1e-9 * block.elapsed[0]:
                signs.append(l[2] * (x[0] ** 2 + x[1] ** 2) - x[2] * (x[3] * x[0] + x[4] * x[1]))
        state = block.state
    small = ROUNDING * (abs(b) + abs(l[2]))
    at_turning = np.array(signs[-2:])
    if np.any(np.abs(at_turning) <= small):
        return "cusps"
    return "loops" if at_turning[0] * at_turning[1] < 0 else "waves"


@proof(minutes=2)
def verdicts(tops=100_000):
    """The certified verdict against the events of the integrated axis over a period.

    The integration knows no closed form: it runs until the axis has turned three times, one period,
    and looks whether phidot has two signs at the last two turns, or vanished at one. The tops are
    drawn all over, of both signs of gMR, some released from rest (cusps), some beside a cusp.
    """
    from heavytop.integration.compiled import Compiled

    from heavytop.equations.euler_poisson import axis_form

    draw = np.random.default_rng(2026)
    taylor = Compiled(axis_form(None), ("turning",), 2.0**-52)
    wrong, uncertain, blurred = [], 0, 0
    for _ in range(tops):
        numbers = random_top(draw)
        A, C, gMR, theta, thetadot, phidot, omega3 = map(float, numbers)
        start = ht.State(theta, thetadot=thetadot, phidot=phidot, omega3=omega3)
        verdict = ht.classify(ht.Top(A, C, gMR), start)
        uncertain += not verdict.certified
        observed = seen(taylor, A, C, gMR, theta, thetadot, phidot, omega3)
        if observed == verdict.kind:
            continue
        if observed == "cusps":  # phidot is too small at a turn for doubles to tell its sign
            blurred += 1
        else:
            wrong.append((numbers, str(verdict.kind), observed, verdict.why))
    print(*wrong[:10], sep="\n")
    yield f"{tops} random tops: wrong certified verdicts", len(wrong), 0
    yield f"{tops} random tops: not certified", uncertain, 0
    yield "verdicts of loops or waves where doubles see a cusp", blurred, tops // 1000


# --- auto ------------------------------------------------------------------------------------

REPEATS, LONG_S = 3, 1.0
ROUND = (10, 100, 1000, 2000)
WANTS = (("theta",), ("theta", "phi"), ("axis",), ("phi", "psi"), ("theta", "psi"), ("attitude",))


def random_scene(draw, number):
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
            except ht.HeavyTopError:
                continue
            spent = run.statistics.integrate_s
            best[form], runs[form] = min(best.get(form, spent), spent), run
    return best, runs


@proof(minutes=3)
def auto(scenes=200):
    """Varied scenes, run by every formulation and by auto: is auto right, and is it cheap?

    A run has met its digits when it is within 10^-digits max(1, |x|) of the closed form of its own
    start. Time is that of the integration, best of interleaved repeats, or of one if that takes a
    second; a formulation that cannot give what is wanted, or start there, is left out.
    """
    from heavytop.equations.formulation import FORMULATIONS
    from heavytop.run.verify import missed_digits, run_errors

    warnings.simplefilter("ignore")
    draw = random.Random(7)
    chosen, ratios, too_far = Counter(), [], []
    for number in range(scenes):
        scene = random_scene(draw, number)
        best, runs = timed(scene, ("auto", *FORMULATIONS))
        form = runs["auto"].plan.formulation
        chosen[form] += 1
        missed = {name: missed_digits(run, run_errors(run)) for name, run in runs.items()}
        if missed["auto"]:
            too_far.append((number, form, scene.digits, missed["auto"]))
        elif met := [best[name] for name in FORMULATIONS if name in runs and not missed[name]]:
            ratios.append(best["auto"] / min(met))
    print(chosen, *too_far, sep="\n")
    yield f"{scenes} scenes: auto misses the digits asked", len(too_far), 0
    yield "time of auto over that of the cheapest that met them, median", median(ratios), 1.3


if __name__ == "__main__":
    main()
