"""Around the focus–focus point of tops too slow to sleep, Δφ comes back a whole turn more.

Steady precession against the bottom of the effective potential; kinds told from the place in the
diagram against certified verdicts; the turn by following Δφ and by adding up its derivatives;
loops of other shapes; the threshold approached.
Writes docs/images/energy-momentum.svg and critical-set.svg with the word `write`.
"""

import math
import sys
from pathlib import Path

import numpy as np
from claim import claim, finish, most

import heavytop as ht
from heavytop.analytic.energy_momentum import energy_momentum
from heavytop.analytic.monodromy import ellipse
from heavytop.numbers.decimals import context
from heavytop.plots.figures import save
from heavytop.plots.theory import critical_set_figure, energy_momentum_figure
from heavytop.results.energy_momentum import diagram_of

IMAGES = Path(__file__).parents[1] / "docs" / "images"
BOOK = ("3.28e-4", "6.60e-5", "0.0456")
UNIT, WEIGHT = math.sqrt(3.28e-4 * 0.0456), 0.0456
DRAWN = ht.Scene(
    ht.Top(*BOOK), ht.State(2, thetadot=8, phidot=6, omega3="60"), time=1,
    title="The book's top, spinning too slowly to sleep",
)  # fmt: skip


def diagram(p_psi, sign=1):
    return energy_momentum(ht.Top(*BOOK[:2], sign * ht.Exact.of(BOOK[2])), p_psi)


def added_up(found, places=96):
    """Rates of change along the default loop, at evenly spaced places, times its length."""
    ctx, size, gained = context(60), found.maximal_loop / 2, np.zeros(2)
    radii = [ctx.mpf(size * scale) for scale in (UNIT, WEIGHT)]
    step = ctx.mpf("1e-15")

    def at(s):
        p = found.standing.p_phi + radii[0] * ctx.cos(s)
        return found.advance(p, found.standing.E_prime + radii[1] * ctx.sin(s), digits=40)

    for k in range(places):
        s = 2 * ctx.pi * (k + ctx.mpf("0.1")) / places
        one, other = at(s - step), at(s + step)
        for i, name in enumerate(("precession", "spin")):
            change = getattr(other, name) - getattr(one, name)
            gained[i] += float(change / (2 * step)) * math.tau / places
    return gained


# Steady precession: no motion is below it, and one is on it
rng = np.random.default_rng(27)
theta = np.linspace(1e-4, math.pi - 1e-4, 200_001)
off, below = [], []
for p_psi in (0.0, 0.3, 1.2, 1.98, 2.4, -0.7):
    for sign in (1, -1):
        found = diagram(p_psi * UNIT, sign)
        p_phi = rng.uniform(-3, 3, 40) * UNIT
        edge = found.edge(p_phi)
        for p, least in zip(p_phi, edge.E_prime, strict=True):
            u, s = np.cos(theta), np.sin(theta)
            V = (p - p_psi * UNIT * u) ** 2 / (2 * 3.28e-4 * s**2) + sign * WEIGHT * u
            off.append((V.min() - least) / WEIGHT)
        drift = p_phi - p_psi * UNIT * np.cos(edge.theta)
        rate = drift / (3.28e-4 * np.sin(edge.theta) ** 2)
        below.append(np.max(abs(rate / edge.rate - 1)))
claim("480 valleys of V, on 2e5 tilts, below the edge, over gMR", -min(off), 1e-12)
claim("... and above it", most(off), 1e-7)
claim("phidot at the tilt of the edge, off its rate, relative", max(below), 1e-9)

# Kinds, each by a certified verdict from a start with exactly these constants
wrong = count = 0
for p_psi, sign in ((0.5, 1), (1.9, 1), (2.3, 1), (-1.1, 1), (0.8, -1), (0, 1)):
    found = diagram(p_psi * UNIT, sign)
    for p in rng.uniform(-2.5, 2.5, 60) * UNIT:
        energy = float(found.least(p)) + WEIGHT * rng.uniform(0.01, 2.5)
        verdict = ht.classify(found.top, found.start(energy, p))
        wrong += not verdict.certified or str(verdict.kind) != str(found.kinds(energy, p))
        count += 1
claim(f"{count} places whose kind is not the certified one", wrong, 0)

# The turn
for p_psi, sign in ((0.25, 1), (1, 1), (1.6, 1), (-1, 1), (1, -1), (0, 1)):
    found = diagram(p_psi * UNIT, sign)
    circuit = found.circuit()
    spin = -sign * math.tau
    gained = circuit.precession[-1] - circuit.precession[0]
    words = f"beta = {p_psi}, gMR {'>' if sign > 0 else '<'} 0"
    claim(f"{words}: Δφ followed, off 2 pi", abs(gained - math.tau), 1e-12)
    by_rates = added_up(found)
    claim(f"{words}: derivatives of Δφ added up, off 2 pi", abs(by_rates[0] - math.tau), 1e-12)
    claim(f"{words}: those of Δψ, off -+2 pi", abs(by_rates[1] - spin), 1e-12)
    claim(f"{words}: largest step, in quarter turns", circuit.largest_step / (math.pi / 2), 1)
    assert circuit.monodromy == ((1, 0, 0), (0, 1, 0), (-1, sign, 1))

# Loops: the winding of Δφ is that of the loop around the focus–focus point
misses = tried = 0
while tried < 40:
    centre = found.standing.p_phi + UNIT * rng.uniform(-0.6, 0.6), WEIGHT * rng.uniform(0.8, 2.5)
    radii = UNIT * rng.uniform(0.05, 0.6), WEIGHT * rng.uniform(0.05, 1.0)
    angles = np.linspace(0, math.tau, 361)
    p = centre[0] + radii[0] * np.cos(angles)
    if np.any(centre[1] + radii[1] * np.sin(angles) <= found.least(p) + 0.02 * WEIGHT):
        continue
    inside = math.hypot((found.standing.p_phi - centre[0]) / radii[0],
                        (found.standing.E_prime - centre[1]) / radii[1])  # fmt: skip
    if abs(inside - 1) < 0.05:
        continue
    circuit = found.circuit(ellipse(centre, radii), points=32)
    misses += (circuit.winding, circuit.spin_winding) != ((1, -1) if inside < 1 else (0, 0))
    tried += 1
claim("of 40 ellipses, those whose winding is not that around the focus–focus point", misses, 0)

# Towards the threshold the focus–focus point comes down to the edge, as (2 - beta)^2/2
for power in (1, 2, 3):
    beta = 2 - 10.0**-power
    found = diagram(beta * UNIT)
    circuit = found.circuit(points=64)
    print(f"     beta = {beta:.3f}: depth {found.depth / WEIGHT:.2e} gMR, largest loop "
          f"{found.maximal_loop:.2e}, {len(circuit.s)} places")  # fmt: skip
    above = found.standing.E_prime - float(found.least(found.standing.p_phi))
    claim(f"beta = {beta:.3f}: depth off (2 - beta)^2/2, over gMR",
          abs(above / WEIGHT - 10.0 ** (-2 * power) / 2), 1e-13)  # fmt: skip
    claim(f"beta = {beta:.3f}: windings off 1 and -1",
          abs(circuit.winding - 1) + abs(circuit.spin_winding + 1), 0)  # fmt: skip
circuit = diagram(2.2 * UNIT).circuit(ellipse((0.0, 5 * WEIGHT), (1.5 * UNIT, 2.5 * WEIGHT)))
claim("above the threshold: winding", abs(circuit.winding) + abs(circuit.spin_winding), 0)

if "write" in sys.argv:
    document = diagram_of(DRAWN).document()
    save(energy_momentum_figure(document), IMAGES / "energy-momentum.svg")
    save(critical_set_figure(document), IMAGES / "critical-set.svg")
finish()
