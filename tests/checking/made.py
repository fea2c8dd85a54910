"""Trajectories to be judged: of the closed form, and of a Runge–Kutta integrator of our own."""

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.scene.scene import Scene
from heavytop.scene.state import State
from heavytop.scene.top import Top

NAMES = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")
TOP = Top("3.28e-4", "6.6e-5", "0.0456")
START = State("0.4", thetadot="0.3", phi="0.7", phidot=5, psi="0.2", psidot=100)
SCENE = Scene(TOP, START, time=3)
TIMES = np.linspace(0, 3, 601)


def exact(t=TIMES, top=TOP, start=START):
    return Motion(top, start).at(t)


def angles(record, t=TIMES):
    return {"t": t} | {name: getattr(record, name) for name in NAMES}


def vectors(record, t=TIMES):
    return {"t": t, "quaternion": record.quaternion, "omega": record.omega}


def matrix(record):
    """Rz(φ) Rx(θ) Rz(ψ), from the angles."""

    def about(axis, angle):
        c, s, zero = np.cos(angle), np.sin(angle), np.zeros_like(angle)
        rows = np.array([[c, -s, zero], [s, c, zero], [zero, zero, zero + 1]])
        return np.moveaxis(np.roll(rows, axis + 1, axis=(0, 1)), -1, 0)

    return about(2, record.phi) @ about(0, record.theta) @ about(2, record.psi)


def random_scene(rng):
    """A top and a start of ordinary size."""
    A = rng.uniform(0.5, 2)
    top = Top(A, A * rng.uniform(0.1, 1.9), rng.uniform(0.5, 5))
    rates = {name: rng.uniform(-3, 3) for name in ("thetadot", "phidot", "psi")}
    start = State(rng.uniform(0.2, 2.8), phi=rng.uniform(-3, 3), psidot=rng.uniform(2, 9), **rates)
    return Scene(top, start, time=6)


def runge_kutta(t, top=TOP, start=START):
    """The axis and the angular velocity by ė = ℓ × e, ℓ̇ = (gMR/A)(−e_y, e_x, 0), order 4."""
    A, C, gMR = (float(x) for x in (top.A, top.C, top.gMR))
    theta, phi, thetadot, phidot, omega3 = (
        float(getattr(start, name)) for name in ("theta", "phi", "thetadot", "phidot", "omega3")
    )
    s, c = np.sin(theta), np.cos(theta)
    e = np.array([s * np.sin(phi), -s * np.cos(phi), c])
    moving = thetadot * np.array([c * np.sin(phi), -c * np.cos(phi), -s])
    moving += phidot * np.array([-e[1], e[0], 0])
    y = np.concatenate([e, np.cross(e, moving) + C * omega3 / A * e])

    def rate(y):
        return np.concatenate([np.cross(y[3:], y[:3]), gMR / A * np.array([-y[1], y[0], 0])])

    rows = [y]
    for h in np.diff(t):
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        k4 = rate(y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        rows.append(y)
    found = np.array(rows)
    e, turning = found[:, :3], found[:, 3:]
    return {"t": t, "axis": e, "omega": turning + (omega3 - C * omega3 / A) * e}
