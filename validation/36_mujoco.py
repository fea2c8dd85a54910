"""MuJoCo: a body on a ball joint, its fourth-order integrator with small steps.

The simulator sees a rigid body, its inertia and gravity; it resolves every turn of the spin. Its
quaternion is compared as a whole, and its own error is told by halving the step.
"""

import numpy as np
from claim import claimed, finish

import heavytop as ht

MODEL = """
<mujoco>
  <option timestep="{step}" integrator="RK4" gravity="0 0 -1">
    <flag contact="disable" constraint="disable"/>
  </option>
  <worldbody><body>
    <joint type="ball"/>
    <inertial pos="0 0 {arm}" mass="{mass}" diaginertia="{across} {across} {axial}"/>
  </body></worldbody>
</mujoco>
"""
STEPS = 20_000
TOP = {"A": 1.3, "C": 0.7, "gMR": 2.1}
START = {"theta": 0.8, "phi": 0.1, "psi": -0.4, "thetadot": 0.6, "phidot": -0.5, "psidot": 4.0}
END = 2.0


def turned(theta, phi, psi):
    half, plus, minus = theta / 2, (phi + psi) / 2, (phi - psi) / 2
    c, s = np.cos(half), np.sin(half)
    return np.array([c * np.cos(plus), s * np.cos(minus), s * np.sin(minus), c * np.sin(plus)])


def simulated(steps=STEPS):
    """Quaternion (scalar first) and angular velocity in the body at the end."""
    import mujoco

    arm = 0.3  # of any length: with g = 1 the mass is gMR/arm, and A_cm + mass arm^2 = A
    mass = TOP["gMR"] / arm
    across = TOP["A"] - mass * arm**2
    text = MODEL.format(
        step=repr(END / steps), arm=arm, mass=repr(mass), across=repr(across), axial=TOP["C"]
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    theta, psi = START["theta"], START["psi"]
    data.qpos[:] = turned(theta, START["phi"], psi)
    lift, tilt = START["phidot"] * np.sin(theta), START["thetadot"]
    data.qvel[:] = (
        lift * np.sin(psi) + tilt * np.cos(psi),
        lift * np.cos(psi) - tilt * np.sin(psi),
        START["phidot"] * np.cos(theta) + START["psidot"],
    )
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return data.qpos.copy(), data.qvel.copy()


def apart(a, b):
    return float(min(np.max(np.abs(a - b)), np.max(np.abs(a + b))))


def ours():
    return ht.Top(**TOP), ht.State(**START)


@claimed("mujoco-closed-form")
def _():
    at = ht.Motion(*ours()).at(END)
    return apart(turned(float(at.theta), float(at.phi), float(at.psi)), simulated()[0])


@claimed("mujoco-run")
def _():
    scene = ht.Scene(*ours(), time=END, quantities=("theta", "phi", "psi", "attitude"))
    return apart(np.asarray(ht.propagate(scene)(END).quaternion), simulated()[0])


@claimed("mujoco-order")
def _():
    at = ht.Motion(*ours()).at(END)
    truth = turned(float(at.theta), float(at.phi), float(at.psi))
    coarse, fine = (apart(truth, simulated(steps)[0]) for steps in (500, 1000))
    return abs(np.log2(coarse / fine) - 4)


finish()
