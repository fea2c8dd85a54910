"""Projection onto the invariants: phase, energy and time of the book's kicked top, 1e6 periods.

Phase errors are RMS over neighbouring starts, each against the closed form of its own doubles at
two thirds of a period past the mark; their growth exponent is fitted from 1e3 periods on. Energy
is that of the states in long double: formed in double it is rounded by half as much again.
"""

import sys

import numpy as np
from claim import claim, finish

import heavytop as ht
from heavytop.equations.lambdify import lambdified
from heavytop.run.own_motion import own_motion
from heavytop.run.verify import phase_error

MARKS = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
MOST = int(sys.argv[1]) if len(sys.argv) > 1 else MARKS[-1]  # fewer periods, for a quick look
STARTS = 8
ONLY_TILT = ('want.quantities=["theta"]', "want.events=[]")
marks = np.array([n for n in MARKS if n <= MOST])


def run(formulation, projected, start=0, periods=None):
    tilt = f"start.theta={0.1 + 0.001 * start:.3f}"
    wanted = (f"span.periods={(periods or MOST) + 1}", tilt, *ONLY_TILT)
    scene = ht.load_scene("sicm-kicked", overrides=wanted)
    return ht.propagate(scene, formulation=formulation, projected=projected)


def phases(trajectory):
    period = own_motion(trajectory).period
    return [phase_error(trajectory, (n + 2 / 3) * period) for n in marks]


def off_energy(trajectory):
    """Return how far E' is from its start at every sample, relative to E' at the start."""
    form, constants = trajectory.orbit.integrator.formulation, trajectory.orbit.parameters
    used = [p for p in form.parameters if p in form.invariants["energy"].free_symbols]
    function = lambdified([form.invariants["energy"]], [*form.states, *used], np.longdouble, {})
    columns = trajectory.orbit.samples.states.T.astype(np.longdouble)
    (energy,) = function(*columns, *(np.longdouble(constants[p.name]) for p in used))
    return (energy / energy[0] - 1).astype(float)  # E' of the kicked top is about gMR


def exponent(errors):
    return float(np.polyfit(np.log(marks), np.log(errors), 1)[0])


for formulation in ("axis", "cubic"):
    found = {}
    for projected in (False, True):
        runs = [run(formulation, projected, start) for start in range(STARTS)]
        each = np.array([phases(one) for one in runs])
        found[projected] = rms = np.sqrt(np.mean(each**2, axis=0))
        name = f"{formulation}, {'projected' if projected else 'plain'}"
        each_mark = zip(marks, rms, strict=True)
        print(f"     {name}: " + ", ".join(f"{n}: {e:.1e} s" for n, e in each_mark))
        print(f"     {name}: exponent {exponent(rms):.2f}, largest {abs(each).max():.1e} s")
        off = [off_energy(one) for one in runs]
        energy = max(float(np.sqrt(np.mean(x**2))) for x in off)
        print(f"     {name}: energy RMS {energy:.1e}, largest {np.abs(off).max():.1e}")
    claim(f"{formulation}: phase error of one projected run, largest [s]", abs(each).max(), 1e-11)
    claim(f"{formulation}: growth exponent of the phase error, projected", exponent(rms), 0.7)
    claim(f"{formulation}: RMS energy error of projected runs", energy, 1e-15)
    claim(f"{formulation}: largest energy error of projected runs", np.abs(off).max(), 1e-15)
    claim(f"{formulation}: phase error over that of plain runs", rms[-1] / found[False][-1], 0.1)

spent = {}
for _ in range(5):
    for formulation in ("axis", "cubic"):
        for projected in (False, True):
            one = run(formulation, projected, periods=100_000)
            times = spent.setdefault((formulation, projected), [])
            times.append(one.statistics.integrate_s / 100_000 * 1e6)
for formulation in ("axis", "cubic"):
    plain, projected = (min(spent[formulation, p]) for p in (False, True))
    print(f"     {formulation}: {plain:.2f} and {projected:.2f} us a period")
    claim(f"{formulation}: time of a projected run over a plain one", projected / plain, 1.5)
finish()
