"""The variational equations against differences of the closed form at sixty digits.

How the state-transition matrix of the axis form keeps its digits over many periods, and what
sharing the step control costs the state; the derivatives of T, Δφ and Δψ of every shipped scene
that nutates; Floquet multipliers and growth rates; and what it all costs.
"""

from functools import cache, partial
from operator import attrgetter
from time import perf_counter

import numpy as np
from claim import claim, finish, interleaved, most

import heavytop as ht
from heavytop.equations import gradients
from heavytop.equations.euler_poisson import axis_form
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import ImpossibleTop
from heavytop.run.planning import plan
from heavytop.run.sensitivities import at_start, sensitivities, state_transition
from heavytop.scene.scene import shipped_scenes

STEP = ht.Exact.of("1e-20")
NAMES = ("A", "C", "gMR", "theta", "thetadot", "phidot")


@cache
def forms(scene):
    """The closed form on either side of a scene, for each number that it gives."""
    given = {name: getattr(scene.top, name) for name in NAMES[:3]}
    given |= {name: getattr(scene.start, name) for name in (*NAMES[3:], scene.start.held)}
    found = {}
    for name in given:
        ends = [given | {name: given[name] + sign * STEP} for sign in (1, -1)]
        tops = [ht.Top(end.pop("A"), end.pop("C"), end.pop("gMR")) for end in ends]
        pairs = zip(tops, ends, strict=True)
        found[name] = [ht.Motion(top, ht.State(**end)).form(60) for top, end in pairs]
    return found


def slope(pair, value):
    """A central difference; whole turns, by which Δφ jumps at a pole, are left out."""
    ctx = pair[0].ctx
    rise = value(pair[0]) - value(pair[1])
    rise -= 2 * ctx.pi * ctx.nint(rise / (2 * ctx.pi))
    return float(rise / (2 * STEP.mpf(ctx)))


def off(found, scene):
    """The largest error of T, Δφ, Δψ, relative to the derivative or to its natural size."""
    T, errors = ht.Motion(scene.top, scene.start).period, []
    for name, pair in forms(scene).items():
        natural = T if name in ("thetadot", "phidot", "psidot", "omega3") else 1
        for what, size in (("period", T), ("precession", 1), ("spin", 1)):
            ours = getattr(found, what)[name]
            exact = slope(pair, attrgetter(what))
            errors.append(abs(ours - exact) / max(abs(exact), size * natural))
    return most(errors)


def component(t, i, form):
    return form(t).axis[i]


kicked = ht.load_scene("sicm-kicked", ['want.quantities=["theta"]'])
motion = ht.Motion(kicked.top, kicked.start)
gradient = gradients.start_gradient(axis_form(), (*NAMES, "psidot"))
start = at_start(kicked, plan(kicked, "axis"), [x for row in gradient for x in row]).reshape(
    len(gradient), -1
)
names = [p.name for p in axis_form().parameters]
for periods, bound in ((1.3, 1e-13), (10.3, 1e-12), (100.3, 1e-11)):
    t = periods * motion.period
    found = state_transition(kicked, t=[t])
    by = [start[5 + names.index(name)] for name in found.parameters]
    ours = (found.matrix[0] @ start[:5] + found.by_parameters[0] @ np.array(by))[:3]
    pairs = forms(kicked).values()
    exact = [[slope(pair, partial(component, t, i)) for pair in pairs] for i in range(3)]
    claim(
        f"d axis/dx after {periods} periods, relative",
        np.max(abs(ours - exact).max(axis=0) / np.abs(exact).max(axis=0)), bound,
    )  # fmt: skip
    truth = np.array([float(x) for x in motion.at(t, digits=30).axis])
    beside = abs(found.states[0, :3] - truth).max()
    alone = abs(ht.propagate(ht.Scene(kicked.top, kicked.start, time=t)).axis[-1] - truth).max()
    print(f"     largest entry {abs(found.matrix).max():.2g}; alone the axis is off by {alone:.1e}")
    claim(f"the axis itself, integrated beside its derivatives, after {periods}", beside, bound)

for name in sorted(shipped_scenes()):
    scene = ht.load_scene(name)
    if ht.Motion(scene.top, scene.start).period is None:
        continue
    try:
        forms(scene)
    except (ImpossibleTop, ht.ImpossibleStart) as wall:
        print(f"     {name}: at the edge of what is possible, no differences: {wall}")
        continue
    found = sensitivities(scene)
    bound = 1e-6 if name == "near-separatrix" else 1e-11
    print(f"     {name}: by its own estimate {found.error:.0e}")
    claim(f"derivatives of T, Δφ and Δψ of {name}", off(found, scene), bound)

for name in ("steady-betsch", "steady-fast", "steady-single"):
    scene = ht.load_scene(name, ['want.quantities=["theta"]'])
    rate = float(scene.start.phidot)
    turn = 2 * np.pi / abs(rate)
    omega = ht.facts(scene.top, scene.start).small_nutation_frequency
    found = state_transition(scene, t=[turn]).multipliers[0]
    pair = np.exp([1j * omega * turn, -1j * omega * turn])
    claim(
        f"Floquet multipliers exp(±iωT) of {name}",
        most(min(abs(found - each)) for each in pair), 1e-11,
    )  # fmt: skip
for omega3 in (40, 100, 117):
    scene = ht.load_scene("sleeping-unstable", [f"start.omega3={omega3}"])
    rate = ht.facts(scene.top, scene.start).growth_rate
    largest = most(abs(state_transition(scene, t=[3 / rate]).multipliers[0]))
    off_rate = abs(np.log(largest) / 3 - 1)
    claim(f"growth of the sleeping top at {omega3} rad/s, relative", off_rate, 1e-11)

for name in FORMULATIONS:
    began = perf_counter()
    state_transition(kicked, name, t=[0.0])
    print(f"     {name}: {perf_counter() - began:.2f} s to build")
times = {n: lambda n=n: state_transition(kicked, n, t=[100 * motion.period]) for n in FORMULATIONS}
for name, seconds in interleaved(times, 5).items():
    print(f"     {name}: {seconds / 100 * 1e6:.0f} µs a period")
finish()
