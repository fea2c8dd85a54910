"""Who falls and who pays: stability three ways, and steps in a period against the spin.

The sleeping top grows or does not, by theory, by the Floquet multipliers of variational equations
that heyoka integrates, and by perturbed runs; steady precessions by their multipliers, in the frame
that turns with them, and by perturbed runs. Then steps of every form in a period, against the spin
rate at the same p_psi.
"""

import math
from functools import cache
from itertools import product

import numpy as np
from tools import main, most

import heavytop as ht
from heavytop.claims import proof
from heavytop.equations.registry import FORMULATIONS
from heavytop.scene.quantities import Need

TOP = ht.Top(1, "0.5", 1)  # p_psi^2/4A gMR = omega3^2/16
TILT, GROWN = 1e-8, 8.0  # of a perturbed run: the start, and growth rate times time at its end


def spin_at(ratio):
    return 4 * math.sqrt(ratio)


def run(start, time, samples=2):
    """The axis form, without events."""
    wants = {"quantities": ("axis",), "events": (), "samples": samples}
    return ht.propagate(ht.Scene(TOP, start, time=time, **wants), formulation="axis")


@cache
def varied():
    """heyoka's integrator of the axis form with its variational equations; g = 1."""
    import heyoka as hy

    x, y, z, lx, ly, lz = states = hy.make_vars("x", "y", "z", "lx", "ly", "lz")  # axis, L/A
    turned = ly * z - lz * y, lz * x - lx * z, lx * y - ly * x
    equations = list(zip(states, (*turned, -y, x, 0.0 * z), strict=True))
    return hy.taylor_adaptive(hy.var_ode_sys(equations, states), [0.0] * 6, compact_mode=True)


def state_transition(start, time):
    now = ht.Motion(TOP, start).at(0.0)
    momentum = now.omega + (float(TOP.C / TOP.A) - 1) * now.omega3 * now.axis
    moving = varied()
    moving.time, moving.state[:] = 0.0, [*now.axis, *momentum, *np.eye(6).ravel()]
    moving.propagate_until(time)
    return moving.state[6:].reshape(6, 6).copy()


def growth_by_multipliers(ratio, time=5.0):
    matrix = state_transition(ht.State(0, omega3=spin_at(ratio)), time)
    return math.log(abs(np.linalg.eigvals(matrix)).max()) / time


def growth_by_a_run(ratio, growth):
    """At rest in the frame that turns with p_psi/2A a tilt grows as cosh."""
    omega3 = spin_at(ratio)
    start = ht.State(TILT, phidot=omega3 / 4, omega3=omega3)
    time = GROWN / growth
    return math.acosh(float(run(start, time)(time).theta) / TILT) / time


def growth_of(omega3):
    """The rate at which the sleeping top falls, by theory."""
    return ht.facts(TOP, ht.State(0, omega3=omega3)).growth_rate


BESIDE = {1: 1e-9, 2: 1e-9, 4: 1e-9, 6: 1e-7, 8: 1e-7, 10: 1e-5, 12: 1e-3}


@proof
def sleeping():
    """Growth of a tilt by theory, by multipliers and by runs; beside the threshold too."""
    floquet_off, runs_off = [], []
    for ratio in (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99):
        growth = growth_of(spin_at(ratio))
        floquet_off.append(abs(growth_by_multipliers(ratio) / growth - 1))
        runs_off.append(abs(growth_by_a_run(ratio, growth) / growth - 1))
    yield "growth of the sleeping top, multipliers off theory, relative", most(floquet_off), 1e-9
    yield "growth of the sleeping top, perturbed runs off theory, relative", most(runs_off), 1e-9
    stable = most(abs(growth_by_multipliers(ratio)) for ratio in (1.05, 1.2, 1.5, 1.9))
    yield "stable sleeping: growth by multipliers", stable, 1e-12
    for power in BESIDE:
        spins = [4 * (1 + sign * 10.0**-power) for sign in (-1, 1)]
        below, above = (growth_by_multipliers((spin / 4) ** 2) for spin in spins)
        exact = growth_of(spins[0])
        off = abs(below - exact)  # a growth of 1e-6 is known as a rounding lets it
        yield f"spin 1 - 1e-{power}: growth off theory, relative", off / exact, BESIDE[power]
        yield f"spin 1 -+ 1e-{power}: growth off theory [1/s]", most(off, abs(above)), 1e-9
    push = 1e-6
    tip = run(ht.State(0, thetadot=push, omega3=4), 4000, samples=4001).theta.max()
    # where V is back at E'
    turn = 2 * math.asin(math.sqrt(2 * push / (push + math.hypot(4, push))))
    yield "marginal: tilt after a push, off theory", abs(tip / turn - 1), 1e-5


@proof
def steady():
    """Multipliers in the frame that turns with the precession, and perturbed runs."""
    circle_off, frequency_off, strayed = [], [], []
    spins = (0.05, 0.35, 0.75, 1.05, 1.4, 1.9)
    cases = product((0.2, 0.5, 0.8, 1.1, 1.4, 1.7, 2.2, 2.8), spins, ("slow", "fast"))
    for tilt, ratio, branch in cases:
        if ratio <= 1.02 * math.cos(tilt):
            continue
        omega3 = spin_at(ratio)
        known = ht.facts(TOP, ht.State.steady(TOP, tilt, omega3, branch))
        rate, nod = known.mean_precession_rate, known.small_nutation_frequency
        multiplier, time = nodding_multiplier(tilt, rate, omega3, nod)
        circle_off.append(abs(abs(multiplier) - 1))
        frequency_off.append(abs(np.angle(multiplier) / time / nod - 1))
        pushed = ht.State(tilt + 1e-6, phidot=rate, omega3=omega3)
        tilts = run(pushed, 50 * math.tau / nod, samples=1001).theta
        swing = 2e-6 * (rate * math.sin(tilt) / nod) ** 2  # it is never more than 2e-6
        strayed.append(abs(np.ptp(tilts) / swing - 1))
    yield f"{len(strayed)} steady precessions: multipliers off the circle", most(circle_off), 1e-12
    yield "their angle against the nutation frequency, relative", most(frequency_off), 1e-11
    yield "pushed by 1e-6, swing in 50 nutations, off the small one, relative", most(strayed), 1e-3


def nodding_multiplier(tilt, rate, omega3, nod):
    """The multiplier that is not 1, of phase and constants, and the time in which it is gained."""
    time = 0.382 * math.tau / nod
    back = np.eye(6)
    c, s = math.cos(rate * time), math.sin(rate * time)
    back[:2, :2] = back[3:5, 3:5] = [[c, s], [-s, c]]
    start = ht.State(tilt, phidot=rate, omega3=omega3)
    found = np.linalg.eigvals(back @ state_transition(start, time))
    return found[np.argmax(found.imag)], time


SPINS = [10.0**power for power in range(2, 8)]
COUNT = 20.618  # periods


@proof
def spins():
    """Steps in a period against the spin rate, at the same p_psi."""
    steps = {form: [] for form in FORMULATIONS}
    for spin in SPINS:
        top = ht.Top(1, f"4/{spin:.0f}", 1)
        start = ht.State("0.5", phidot=1, omega3=spin)
        for form, entry in FORMULATIONS.items():
            wanted = "axis" if entry.gives >= Need.AXIS else "theta"
            one = ht.Scene(top, start, periods=COUNT, quantities=(wanted,), events=(), samples=2)
            taken = ht.propagate(one, formulation=form).statistics.steps
            steps[form].append(taken / COUNT)
    for name, points in steps.items():
        print(f"     {name:20}", " ".join(f"{n:8.1f}" for n in points))
    for form in ("axis", "attitude", "cubic", "routh"):
        ratio = max(steps[form]) / min(steps[form])
        yield f"{form}: steps in a period, greatest over least", ratio, 1.02


if __name__ == "__main__":
    main()
