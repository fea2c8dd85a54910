"""Simo and Wong's fast top: the energy that is published, and ten seconds by Euler's equations.

Euler's equations also hold the closed form where it is easily wrong by a sign: upside down, and
after an odd number of passes through the vertical, at each of which phi and psi jump.
"""

from functools import cache

from rigid import Body, attitudes_apart, body_rates, farthest, from_angles, mp, mpf
from tools import EULER, HUNDRED_STEPS, STATE, angles, most, motion_of, state

import heavytop as ht
from heavytop.claims import Authority, claim

SOLFEC = Authority("Solfec's page on Simo & Wong's top", "printed")


DROPS = "rigid.py drops 2^-140 = 7e-43"
PUBLISHED = "1269.975"  # Solfec's page, for a tilt of 0.05
TILTS = ("0.05", "0.3")
END = 10
DIGITS = 45  # asked of the closed form


def scene_of(tilt):
    return ht.load_scene("simo-wong", [f"start.theta={tilt}", f"span.time={END}"])


@cache
def exact(tilt):
    """theta, phi and psi after ten seconds, phi and psi followed."""
    body = Body(
        (5, 5, 1), 20, (0, 0, 1), from_angles(tilt), body_rates(tilt, 0, 0, 0, 50), longest=0.05
    )
    return next(body.at([END])).angles


@claim(SOLFEC, 0.0005, "half a unit of the last digit that is printed", "constants")
def simo_wong_energy():
    """energy vs the published 1269.975 [J]."""
    return abs(float(motion_of(scene_of(TILTS[0])).constants.E) - float(PUBLISHED))


@claim(EULER, 2e-39, f"{DROPS} in each of some two hundred steps", "closed form")
def simo_wong_closed_form():
    """θ, φ and ψ after 10 s at two tilts vs Euler's equations [rad]."""
    ends = {tilt: motion_of(scene_of(tilt)).at(END, DIGITS) for tilt in TILTS}
    return most(farthest(angles(end), exact(tilt)) for tilt, end in ends.items())


def apart(top, start, t):
    """How far the closed form's attitude is from Euler's."""
    theta, phi, psi, *rates = (getattr(start, name).mpf(mp) for name in STATE)
    A, C, gMR = (x.mpf(mp) for x in (top.A, top.C, top.gMR))
    omega = body_rates(theta, psi, *rates)
    body = Body((A, A, C), gMR, (0, 0, 1), from_angles(theta, phi, psi), omega)
    found = from_angles(*angles(ht.Motion(top, start).at(t, DIGITS)))
    return attitudes_apart(found, next(body.at([t])).q)


@claim(EULER, 8e-43, f"{DROPS} in each step; 45 digits are requested", "closed form")
def euler_upside_down():
    """quaternion of a top with gMR < 0 after 2 s at 45 digits vs Euler's equations."""
    start = state("2.1", "0.1", "-0.4", "0.3", "0.7", "-5")  # that of 37_dop853.py
    return apart(ht.Top(A="1.3", C="0.7", gMR="-2.1"), start, 2)


@claim(EULER, 8e-42, f"{DROPS} in each of a few steps, ten times", "closed form")
def euler_through():
    """quaternion at 1 s, after three passes through the top and three through the bottom, vs
    Euler's equations.

    Three passes each in a second.
    """
    scenes = (ht.load_scene(f"through-{end}") for end in ("top", "bottom"))
    return most(apart(scene.top, scene.start, 1) for scene in scenes)


SPUN = "rounding of 496 rad, ten times"
TILTED = "rounding of 0.3 rad over some hundred steps"


@claim(EULER, 1e-12, SPUN, "integrator", name="simo-wong-psi-run", of=("ψ",))
@claim(EULER, 1e-13, HUNDRED_STEPS, "integrator", name="simo-wong-phi-run", of=("φ",))
@claim(EULER, 2e-15, TILTED, "integrator", name="simo-wong-theta-run", of=("θ",))
def turns_of_the_run(angle):
    """{0} of the run, all turns counted, vs Euler's equations [rad]."""
    index = "θφψ".index(angle)
    ends = {tilt: angles(ht.propagate(scene_of(tilt))(float(END))) for tilt in TILTS}
    return most(abs(mpf(float(end[index])) - exact(tilt)[index]) for tilt, end in ends.items())
