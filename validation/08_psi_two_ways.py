"""psi two ways: the attitude form with its turns counted, and the axis form with a quadrature.

Time per nutation period (best of interleaved repeats, compile time apart), steps, and the largest
errors against the closed form over 1000 periods: of phi and psi, and of the attitude as a
quaternion. Then tops aimed ever closer past the lowest point and past the top, with psi wanted
and with phi alone; and the pass through both poles.
"""

from dataclasses import replace

import numpy as np
from claim import claim, finish, most

import heavytop as ht
from heavytop.run.own_motion import own_motion

FORMS = ("axis", "attitude")
REPEATS = 15
PERIODS = 1000
ALL = ("theta", "phi", "psi")
SHIPPED = ("sicm-kicked", "sicm-dropped", "simo-wong", "spherical-pendulum", "lie-group-benchmark")
FAST = ht.Scene(ht.Top(A=1, C="1e-6", gMR=1), ht.State(theta=1, psidot="1e6"), time=1)


def long(scene, samples=2, quantities=ALL):
    """Return a scene over many periods, and a part of one, without events."""
    span = {"time": None, "periods": ht.Exact.of(PERIODS + 0.25), "samples": samples}
    return replace(scene, quantities=quantities, events=(), **span)


def past_the_bottom(miss):
    """Return a top that starts level and swings past its lowest point; p_phi + p_psi = 2 miss."""
    start = ht.State.kicked(theta="pi/2", phidot=2 * miss - 1.5, omega3=3)
    return ht.Scene(ht.Top(A=1, C="0.5", gMR=1), start, time=1)


def past_the_top(kick):
    """Return the book's top kicked forward: at 15.695837998... rad/s it passes the top."""
    start = ht.State(theta="0.1", phidot=kick, psidot=140)
    return ht.Scene(ht.Top(A="3.28e-4", C="6.60e-5", gMR="0.0456"), start, time=1)


def attitude_error(run, exact):
    half = exact.theta / 2
    plus, minus = (exact.phi_mod + exact.psi_mod) / 2, (exact.phi_mod - exact.psi_mod) / 2
    c, s = np.cos(half), np.sin(half)
    parts = (c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus))
    truth, ours = np.stack(parts, axis=-1), run.samples.quaternion
    off = [np.linalg.norm(ours - sign * truth, axis=-1) for sign in (1, -1)]
    return float(np.max(np.minimum(*off)))


def errors_of(scene, formulation):
    """Return steps a period and the errors of phi, psi and the attitude at 200 samples."""
    run = ht.propagate(long(scene, 200), formulation=formulation)
    exact = own_motion(run).at(run.t)
    away = np.sin(exact.theta) > 1e-3  # near a pole neither angle has its digits alone
    phi, psi = (np.max(np.abs(getattr(run, x) - getattr(exact, x))[away]) for x in ("phi", "psi"))
    return run.statistics.steps / PERIODS, float(phi), float(psi), attitude_error(run, exact)


def times(scenes, quantities):
    """Return the best time a period [us] of every scene in either form."""
    wanted = {name: long(scene, quantities=quantities) for name, scene in scenes.items()}
    best = {(name, form): np.inf for name in scenes for form in FORMS}
    for _ in range(REPEATS):
        for name, form in best:
            spent = ht.propagate(wanted[name], formulation=form).statistics.integrate_s
            best[name, form] = min(best[name, form], spent / PERIODS * 1e6)
    return best


def compared(scenes):
    """Print what either form takes and gives; return the attitude form's ratio and errors."""
    best, found = times(scenes, ALL), {}
    print("| motion | form | µs a period | steps a period | error of φ | of ψ | of the attitude |")
    print("|---|---|--:|--:|--:|--:|--:|")
    for name, scene in scenes.items():
        for form in FORMS:
            steps, *errors = errors_of(scene, form)
            figures = " | ".join(f"{error:.0e}" for error in errors)
            print(f"| {name} | {form} | {best[name, form]:.1f} | {steps:.1f} | {figures} |")
        found[name] = best[name, "attitude"] / best[name, "axis"], *errors
    return found


def refused(scene, formulation):
    try:
        ht.propagate(scene, formulation=formulation)
    except ht.BadScene:
        return True
    return False


scenes = {name: ht.load_scene(name) for name in SHIPPED} | {"fast spin": FAST}
found = compared(scenes)
for name, (ratio, phi, psi, attitude) in found.items():
    size = float(np.abs(ht.Motion(scenes[name].top, scenes[name].start).spin)) * PERIODS
    claim(f"{name}: error of phi", phi, 1e-9)
    claim(f"{name}: error of psi over its size", psi / max(1.0, size), 1e-12)
    claim(f"{name}: error of the attitude", attitude, 1e-9)
    print(f"     {name}: {ratio:.2f} of the axis form's time")
claim("lie-group-benchmark: time over the axis form's", found["lie-group-benchmark"][0], 3.0)
claim("sicm-kicked: time over the axis form's", found["sicm-kicked"][0], 3.0)

print()
levels = [past_the_bottom(miss) for miss in 3.0 ** -np.arange(0, 15, 2)]
kicks = [past_the_top(15.695837998 - off) for off in 3.0 ** -np.arange(-1, 13, 2)]
for pole, tops in (("lowest point", levels), ("top", kicks)):
    motions = [ht.Motion(each.top, each.start) for each in tops]
    distances = [m.from_top if pole == "top" else m.from_bottom for m in motions]
    near = {f"{far:.1e} rad": each for far, each in zip(distances, tops, strict=True)}
    spent = [times(near, quantities) for quantities in (ALL, ("theta", "phi"))]
    for name in near:
        psi, phi = (best[name, "attitude"] / best[name, "axis"] for best in spent)
        print(f"     past the {pole} by {name}: {psi:.2f} of the axis form's time", end="")
        print(f", {phi:.2f} for phi alone")
    farthest, *_, closest = (spent[0][name, "axis"] for name in near)
    claim(f"closest past the {pole}: the axis form's time over the first's", closest / farthest, 3)

print()
both = ht.load_scene("planar-rotating", ['want.quantities=["theta", "phi", "psi"]'])
errors = ht.run_errors(ht.propagate(both, formulation="attitude"))
claim("through both poles, error of phi and psi", most(errors.phi, errors.psi), 1e-12)
print(f"     the axis form, with psi, is refused there: {refused(both, 'axis')}")
finish()
