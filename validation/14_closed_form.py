"""The closed form on every shipped scene: digits of doubles, tilts a second, a thousand digits."""

from time import perf_counter

import numpy as np
from claim import claim, finish, interleaved, most

import heavytop as ht
from heavytop.scene.scene import shipped_scenes

NOTHING = 1e-29  # what a zero may come out as
COURSES = ("sicm-kicked", "lie-group-benchmark", "near-separatrix", "separatrix", "steady-betsch")


def motion_of(name):
    """The motion of a scene, and its span [s]."""
    scene = ht.load_scene(name)
    motion = ht.Motion(scene.top, scene.start)
    return motion, float(scene.time or scene.periods * motion.period)


worst = dict.fromkeys(("theta", "phi", "psi", "one_minus_u", "one_plus_u"), (0.0, ""))
for name in shipped_scenes():
    motion, end = motion_of(name)
    t = np.linspace(0.0, end, 2001)
    double, exact = motion.at(t), motion.at(t, 50)
    for quantity, (largest, _) in worst.items():
        want, found = [getattr(at, quantity) for at in exact], getattr(double, quantity)
        off = [abs(float(x - y)) for x, y in zip(found, want, strict=True)]
        least = 1.0 if quantity in ("phi", "psi") else 0.0  # what they are relative to at least
        error = most(
            0.0 if d <= NOTHING else d / max(least, abs(float(y)))
            for d, y in zip(off, want, strict=True)
        )
        if largest == largest and not error <= largest:  # what is no number stays
            worst[quantity] = error, name
for quantity, (largest, name) in worst.items():
    beside = "max(1, |x|)" if quantity in ("phi", "psi") else "itself"
    claim(f"{quantity} off by, relative to {beside} (worst: {name})", largest, 1e-14)

t = np.linspace(-3.0, 40.0, 10**6)
forms = {name: motion_of(name)[0].at for name in COURSES}
for name, best in interleaved({n: lambda f=f: f(t).theta for n, f in forms.items()}, 7).items():
    claim(f"seconds for a million tilts, {name}", best, 1.0)
WHOLE = ("theta", "phi", "psi", "thetadot", "phidot", "psidot", "axis")
records = interleaved(
    {
        n: lambda f=f: [getattr(at, name) for at in (f(t),) for name in WHOLE]
        for n, f in forms.items()
    },
    2,
)
print("     whole records, s per million: " + ", ".join(f"{n} {s:.2f}" for n, s in records.items()))

for name in COURSES:
    began = perf_counter()
    motion_of(name)[0].at(2, digits=1000)
    claim(f"seconds for a state at 1000 digits, {name}", perf_counter() - began, 2.0)
finish()
