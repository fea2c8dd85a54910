"""Brouwer's law, and how projection beats it: sixteen neighbours of the book's kicked top.

Rounding is a random walk of the energy, and of the frequency with it; phase is its integral.
"""

import sys

from claim import claim, finish

import heavytop as ht

PERIODS = float(sys.argv[1]) if len(sys.argv) > 1 else 1e6  # fewer, for a quick look
METHODS = ("taylor-axis", "taylor-axis-projected")

found = ht.drift(
    ht.load_scene("sicm-kicked"),
    methods=METHODS,
    periods=PERIODS,
    ensemble=16,
    samples=31,
    folder=f"out/brouwer-{PERIODS:g}",
)
for each in found.methods:
    print(
        f"     {each.name}: energy {each.energy[-1]:.2e}, grows {each.growth.energy} "
        f"+- {each.stderr.energy}; phase {each.phase_s[-1]:.2e} s, grows {each.growth.phase} "
        f"+- {each.stderr.phase}; {each.us_per_period:.2f} us a period"
    )
plain, projected = found.methods
claim("plain: exponent of energy, off 1/2", abs(plain.energy_exponent - 0.5), 0.15)
claim("plain: exponent of phase, off 3/2", abs(plain.phase_exponent - 1.5), 0.25)
bounded = projected.growth.phase == "bounded"  # an exponent below 1/4
claim("projected: exponent of phase", 0.25 if bounded else projected.phase_exponent, 0.7)
claim("projected: phase, RMS [s]", projected.phase_s[-1], 1e-11)
claim("projected: phase over that of plain runs", projected.phase_s[-1] / plain.phase_s[-1], 1e-2)
finish()
