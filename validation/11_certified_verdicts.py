"""1e5 random tops: the certified verdict against the events of the integrated axis over a period.

The integration knows no closed form: it runs until the axis has turned three times, one period,
and looks whether phidot has two signs at the last two turns, or vanished at one. The tops
are drawn all over, of both signs of gMR, some released from rest (cusps), some beside a cusp,
1e-3 ... 1e-9 off.
"""

import sys
from collections import Counter

import numpy as np
from claim import claim, finish

import heavytop as ht
from heavytop.equations.euler_poisson import axis_form
from heavytop.integration.engine import Compiled

TOPS = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
ROUNDING = 1e-12  # of phidot sin^2, beside p/A: zero as far as an integration can see


def drawn(random):
    """A top and a start, as the doubles of A, C, gMR, theta, thetadot, phidot, omega3."""
    A, C = np.exp(random.uniform(-2, 2)), 0.0
    C = A * random.uniform(0.05, 1.95)
    gMR = np.exp(random.uniform(-2, 2)) * random.choice((-1, 1))
    theta, thetadot = random.uniform(0.05, 3.09), random.normal()
    omega3 = 4 * random.normal() * np.sqrt(A * abs(gMR)) / C
    phidot = random.normal() * np.sqrt(abs(gMR) / A)
    family = random.integers(4)
    if family == 0:  # released from rest
        thetadot = phidot = 0.0
    elif family == 1:  # beside a cusp
        thetadot, phidot = 0.0, random.choice((-1, 1)) * 10.0 ** random.uniform(-9, -3)
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


random = np.random.default_rng(2026)
taylor = Compiled(axis_form(None), ("turning",), 2.0**-52)
kinds, wrong, uncertain, blurred = Counter(), [], 0, 0
for _ in range(TOPS):
    numbers = drawn(random)
    A, C, gMR, theta, thetadot, phidot, omega3 = map(float, numbers)
    verdict = ht.classify(
        ht.Top(A, C, gMR), ht.State(theta, thetadot=thetadot, phidot=phidot, omega3=omega3)
    )
    kinds[str(verdict.kind)] += 1
    uncertain += not verdict.certified
    observed = seen(taylor, A, C, gMR, theta, thetadot, phidot, omega3)
    if observed == verdict.kind:
        continue
    if observed == "cusps":  # phidot is too small at a turn for doubles to tell its sign
        blurred += 1
    else:
        wrong.append((numbers, str(verdict.kind), observed, verdict.why))
print(dict(kinds))
for case in wrong[:10]:
    print(case)
claim(f"{TOPS} random tops: wrong certified verdicts", len(wrong), 0)
claim(f"{TOPS} random tops: not certified", uncertain, 0)
claim("verdicts of loops or waves where doubles see a cusp", blurred, TOPS // 1000)
finish()
