"""The constants and the start of half a nutation: exact numbers, straight from a scene's.

They are those of the attitude form, written out, as its derivation would take longer than the
integration.
"""

from __future__ import annotations

from heavytop.numbers import Exact, cos, sin
from heavytop.scene.scene import Scene


def constants(scene: Scene) -> dict[str, Exact]:
    """Return the constants of the attitude form, by symbol name."""
    top, start = scene.top, scene.start
    c, s = cos(start.theta), sin(start.theta)
    n = top.C * start.omega3 / top.A
    across = start.phidot * s**2
    return {
        "g": top.gMR / top.A,
        "l_z": across + n * c,
        "n": n,
        "kappa": start.omega3 - n,
        "P_plus": across + n * (c + 1),
        "P_minus": across + n * (c - 1),
        "omega3": start.omega3,
        "phi_0": start.phi,
        "psi_0": start.psi,
    }


def state(scene: Scene) -> tuple[Exact, ...]:
    """Return the states of the attitude form at the start: q_0, q_1, q_2, q_3, l_x, l_y."""
    top, start = scene.top, scene.start
    c, s = cos(start.theta / 2), sin(start.theta / 2)
    plus, minus = (start.phi + start.psi) / 2, (start.phi - start.psi) / 2
    across = top.C * start.omega3 / top.A - start.phidot * cos(start.theta)
    across = across * sin(start.theta)
    return (
        c * cos(plus),
        s * cos(minus),
        s * sin(minus),
        c * sin(plus),
        start.thetadot * cos(start.phi) + across * sin(start.phi),
        start.thetadot * sin(start.phi) - across * cos(start.phi),
    )
