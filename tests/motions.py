"""Tops, and motions of every kind, that many tests look at."""

from fractions import Fraction

import heavytop as ht
from heavytop.exact import Exact, cos
from heavytop.scene.scene_file import shipped_scenes

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")  # SICM, section 2.10
INVERTED = ht.Top("3.28e-4", "6.60e-5", "-0.0456")
KICKED = ht.State("0.1", phidot=-15, psidot=140)
CONE = ht.Top("6.375e-3", "7.5e-4", "0.73575")  # Betsch & Steinmann
LIE = ht.Top("15.234375", "0.46875", "147.15")  # the Lie-group benchmark
LIE_START = ht.State("pi/2", phi="pi", phidot="-4.61538", psidot=150)
SIMO_WONG = ht.Top(5, 1, 20)
TWO = ht.Top(2, 1, 3)
MARGINAL = ht.Top(2, 1, 2)  # at ω3 = 4
WEIGHTLESS = ht.Top(2, 1, 0)
SCENES = sorted(shipped_scenes())

# A, C, gMR, θ, φ, ψ, θ̇, φ̇, ψ̇
MOTIONS = {
    "loops": (2, 1, 3, "0.5", "0.3", "-0.7", 0, -2, 5),
    "rising": (2, 1, 3, "1.5", "0.3", "-0.7", -1, "0.5", 3),
    "falling": (2, "1.5", 3, "1.5", "0.3", "-0.7", 1, "0.5", 3),
    "cusps": (2, 1, 3, "0.5", 0, 0, 0, 0, 7),
    "prolate to the limit": (1, 2, 3, 1, 1, 2, "0.5", 1, 3),
    "spherical top": (2, 2, 3, 1, 1, 2, "0.5", 1, 3),
    "slender": (1, "0.001", 3, 1, 1, 2, "0.5", 1, 300),
    "spherical pendulum": (2, 1, 3, 1, "0.2", "0.1", "0.4", "1.25", cos(1) * Exact.of("-1.25")),
    "past the bottom": (2, 1, 3, "2.5", 0, 0, 1, "0.01", "0.02"),
    "past the top": (2, 1, 3, "0.01", 0, 0, 2, "0.5", "0.7"),
    "hanging upside down": (2, 1, -3, "0.5", "0.3", "-0.7", "0.25", -2, 5),
    "upside down, from its lower turning point": (2, 1, -3, "0.5", "0.3", "-0.7", 0, 3, 5),
    "reversing at the start, rising": (2, 1, 3, "0.8", "0.3", "-0.7", -1, 0, 5),
    "reversing at the start, falling": (2, 1, 3, "0.8", "0.3", "-0.7", 1, 0, 5),
    "force-free": (2, 1, 0, "0.5", "0.3", "-0.7", "0.25", -2, 5),
    "through the top": (2, 1, 3, 0, "0.3", "-0.7", 3, 0, 2),
    "through the top, backwards": (2, 1, 3, 0, "0.3", "-0.7", -3, 0, 2),
    "through the top, upside down": (2, 1, -3, 0, "0.3", "-0.7", 1, 0, 2),
    "through the top, from its side": (2, 1, 3, "pi/3", "0.3", "-0.7", 2, 2, 5),
    "through the bottom, from its side": (2, 1, 3, "pi/3", "0.3", "-0.7", 2, 2, -3),
    "through the bottom, upside down": (2, 1, -3, "pi/3", "0.3", "-0.7", -3, 2, -3),
    "planar swing": (2, 1, 3, "2.5", "0.3", "-0.7", "0.5", 0, 0),
    "planar from rest": (2, 1, 3, "0.5", "0.3", "-0.7", 0, 0, 0),
    "planar rotation": (2, 1, 3, "2.5", "0.3", "-0.7", 5, 0, 0),
    "planar rotation, backwards": (2, 1, 3, "2.5", "0.3", "-0.7", -5, 0, 0),
    "planar separatrix": (2, 1, 2, "pi/2", "0.3", "-0.7", "sqrt(2)", 0, 0),
    "sleeping": (2, 1, 3, 0, "0.3", "-0.7", 0, 0, 2),
    "at rest": (2, 1, 3, "pi", "0.3", 0, 0, 0, 0),
    "separatrix": (2, 1, 2, "pi/3", "0.3", "-0.7", 0, "2/sqrt(3)", "5/sqrt(3)"),
    "separatrix, leaving": (2, 1, 2, "pi/3", "0.3", "-0.7", "0.5", 1, "2.5"),
    "separatrix, arriving": (2, 1, 2, "pi/3", "0.3", "-0.7", "-0.5", 1, "2.5"),
    "separatrix, upside down": (2, 1, -2, "2*pi/3", "0.3", "-0.7", "0.5", 1, "-2.5"),
    "within 1e-9 of the separatrix": (2, 1, 2, "pi/3", "0.3", "-0.7", "0.5", 1, "2.499999999"),
    "uniform": ("6.375e-3", "7.5e-4", "0.73575", "pi/3", "0.3", "-0.7", 0, 10, "135.6"),
    "1e-9 off uniform": ("6.375e-3", "7.5e-4", "0.73575", "pi/3", 0, 0, "1e-9", 10, "135.6"),
}
# published, and closer to special motions than a series of their own follows them
FURTHER = {
    "kicked": ("3.28e-4", "6.6e-5", "0.0456", "0.1", 0, 0, 0, -15, 140),
    "dropped": ("3.28e-4", "6.6e-5", "0.0456", "0.1", 0, 0, 0, 0, 140),
    "lie": ("15.234375", "0.46875", "147.15", "pi/2", "pi", 0, 0, "-4.61538", 150),
    "negative momenta": (2, 1, 3, "1.2", "0.3", "-0.7", "0.4", -2, -5),
    "spherical pendulum, almost": (2, 1, 3, 1, "0.2", "0.1", "0.4", "1.25", "1e-3"),
    "1e-3 past the bottom": (2, 1, 3, "2.5", 0, 0, 1, "0.001", "0.002"),
    "1e-20 past the top": (2, 1, 3, "1e-20", 0, 0, 2, "0.5", "0.7"),
    "1e-20 off uniform": ("6.375e-3", "7.5e-4", "0.73575", "pi/3", 0, 0, "1e-20", 10, "135.6"),
    "1e-30 beyond the separatrix": (
        2, 1, 2, "pi/3", 0, 0, "0.5", 1, Fraction(5, 2) + Fraction(1, 10**30)
    ),
    "1e-9 of weight": (2, 1, "1e-9", "0.7", 0, 0, "0.3", 2, 5),
    "slender and fast": (1, "0.001", 3, 1, 1, 2, "0.5", 1, 3000),
}  # fmt: skip


def named(name):
    """One of the motions above."""
    return motion(*(MOTIONS | FURTHER)[name])


def motion(A, C, gMR, theta, phi=0, psi=0, thetadot=0, phidot=0, psidot=0):
    """The motion of a top from its angles and their rates."""
    rates = {"thetadot": thetadot, "phidot": phidot, "psidot": psidot}
    return ht.Motion(ht.Top(A, C, gMR), ht.State(theta, phi=phi, psi=psi, **rates))


def shipped(name):
    """The motion of a shipped scene."""
    scene = ht.load_scene(name)
    return ht.Motion(scene.top, scene.start)


def product(p, q):
    """The product of two quaternions, scalar first."""
    a, (x, y, z), b, (u, v, w) = p[0], p[1:], q[0], q[1:]
    return (
        a * b - x * u - y * v - z * w,
        a * u + b * x + y * w - z * v,
        a * v + b * y + z * u - x * w,
        a * w + b * z + x * v - y * u,
    )
