"""Trajectories to be judged, of the closed form."""

import numpy as np
from scipy.spatial.transform import Rotation

from heavytop import Motion, Scene, State, Top

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
    angles = np.stack((record.phi, record.theta, record.psi), axis=1)
    return Rotation.from_euler("ZXZ", angles).as_matrix()
