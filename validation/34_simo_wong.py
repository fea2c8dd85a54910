"""Simo and Wong's fast top: the energy that is published, and ten seconds by Euler's equations.

Euler's equations also hold the closed form where it is easily wrong by a sign: upside down, and
after an odd number of passes through the vertical, at each of which phi and psi jump.
"""

from functools import cache

from claim import claimed, finish, most
from rigid import Body, body_rates, farthest, from_angles, mp, mpf

import heavytop as ht

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


@claimed("simo-wong-energy")
def _():
    scene = scene_of(TILTS[0])
    return abs(float(ht.Motion(scene.top, scene.start).constants.E) - float(PUBLISHED))


@claimed("simo-wong-energy-run")
def _():
    at = ht.propagate(scene_of(TILTS[0]))(float(END))
    across = at.thetadot**2 + (at.phidot**2) * (at.axis[0] ** 2 + at.axis[1] ** 2)
    spin = at.psidot + at.phidot * at.axis[2]
    return abs(2.5 * across + 0.5 * spin**2 + 20 * at.axis[2] - float(PUBLISHED))


@claimed("simo-wong-closed-form")
def _():
    worst = 0.0
    for tilt in TILTS:
        scene = scene_of(tilt)
        at = ht.Motion(scene.top, scene.start).at(END, digits=DIGITS)
        worst = most(worst, farthest((at.theta, at.phi, at.psi), exact(tilt)))
    return worst


def apart(top, start, t):
    """How far the closed form's attitude is from Euler's; a quaternion and its negative are one."""
    angles, rates = (
        (start.theta, start.phi, start.psi),
        (start.thetadot, start.phidot, start.psidot),
    )
    theta, phi, psi, *moving = (x.mpf(mp) for x in (*angles, *rates))
    A, C, gMR = (x.mpf(mp) for x in (top.A, top.C, top.gMR))
    turned = from_angles(theta, phi, psi)
    body = Body((A, A, C), gMR, (0, 0, 1), turned, body_rates(theta, psi, *moving))
    exact = next(body.at([t])).q
    at = ht.Motion(top, start).at(t, digits=DIGITS)
    found = from_angles(at.theta, at.phi, at.psi)
    other = farthest(found, [-x for x in exact])
    return min(farthest(found, exact), other) if other == other else other


@claimed("euler-upside-down")
def _():
    start = ht.State(
        theta="2.1", phi="0.1", psi="-0.4", thetadot="0.3", phidot="0.7", psidot="-5"
    )  # that of 37_dop853.py
    return apart(ht.Top(A="1.3", C="0.7", gMR="-2.1"), start, 2)


@claimed("euler-through")
def _():
    """Three passes each in a second."""
    scenes = (ht.load_scene(f"through-{end}") for end in ("top", "bottom"))
    return most(apart(scene.top, scene.start, 1) for scene in scenes)


def of_the_run(index):
    worst = 0.0
    for tilt in TILTS:
        at = ht.propagate(scene_of(tilt))(float(END))
        found = float((at.theta, at.phi, at.psi)[index])
        worst = most(worst, float(abs(mpf(found) - exact(tilt)[index])))
    return worst


for index, name in enumerate(("theta", "phi", "psi")):
    claimed(f"simo-wong-{name}-run")(lambda index=index: of_the_run(index))
finish()
