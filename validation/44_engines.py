"""MuJoCo and EXUDYN, two engines of multibody dynamics.

MuJoCo's fourth-order integrator with small steps is an authority: it sees a rigid body, its inertia
and gravity, and resolves every turn of the spin. Both are judged by `ht.check` on three scenes with
the settings that their documentation gives; there the claims are the orders at which their errors
fall with the step. `write`, on a quiet machine, puts the table of errors and times into the docs.
"""

from functools import cache
from importlib.util import find_spec
from math import log2
from time import perf_counter
from typing import NamedTuple

import numpy as np
from page import markdown, rewrite
from rigid import attitudes_apart, body_rates, from_angles
from scipy.spatial.transform import Rotation
from tools import angles, integrating, interleaved, main, most, motion_of, state

import heavytop as ht
from heavytop.claims import Authority, claim, proof
from heavytop.doctor import version

MUJOCO = Authority("MuJoCo's ball-jointed body", "program")
EXUDYN_PROGRAM = Authority("EXUDYN's rigid body", "program")
SCENES = ("sicm-kicked", "lie-group-benchmark", "simo-wong")
SHOWN = "sicm-kicked"  # in the table
GRAVITY = 9.81  # m/s^2
EVERY = 0.004  # s between two rows: a multiple of every step
REPEATS = 7  # runs, of which the time is the best
END_ALONE = ["want.events=[]", "want.samples=2", 'want.quantities=["attitude"]']

MODEL = """
<mujoco>
  <option timestep="{step!r}" integrator="{method}" gravity="0 0 -9.81"/>
  <worldbody><body>
    <joint type="ball"/>
    <inertial pos="0 0 {arm!r}" mass="{mass!r}" diaginertia="{across!r} {across!r} {axial!r}"/>
  </body></worldbody>
</mujoco>
"""


class Setting(NamedTuple):
    """A method of an engine, as it names it, and its step [s]."""

    engine: str
    method: str
    step: float
    words: str


# MuJoCo's chapter "Computation", Choosing timestep and integrator: implicit is for bodies that spin
# fast, RK4 for what conserves energy (implicitfast, for most other models, leaves the gyroscopic
# forces out of its derivatives); 2 ms is the default.
SETTINGS = (
    Setting("mujoco", "implicit", 2e-3, "implicit"),
    Setting("mujoco", "RK4", 2e-3, "RK4"),
    Setting("mujoco", "RK4", 2e-4, "RK4"),
    # EXUDYN's test models heavyTop.py (Euler parameters, 0.1 ms; generalised α is the default
    # solver) and explicitLieGroupIntegratorTest.py (rotation vectors, 1 ms; DOPRI5's tolerance).
    Setting("exudyn", "GeneralizedAlpha", 1e-4, "generalised α (ρ = 0.9), Euler parameters"),
    Setting("exudyn", "RK44", 1e-3, "RK44 on the Lie group"),
    Setting("exudyn", "DOPRI5", 1e-3, "DOPRI5 on the Lie group, tolerance 1e-10"),
)


SHOWS = "steps of 0.25 and 0.125 ms, where the next order still shows; twice what it shows"


@cache
def problem(name):
    return ht.load_scene(name), motion_of(name)


def body(A, gMR):
    """Arm and mass of a body whose moment is half its own, half that of its distance."""
    arm = GRAVITY * A / 2 / gMR
    return arm, gMR / GRAVITY / arm


def numbers(top):
    return float(top.A), float(top.C), float(top.gMR)


def rows(scene, every=EVERY):
    return np.arange(round(float(scene.time) / every) + 1) * every


def begin(motion):
    """The rotation at the start, and the angular velocity in space and in the body."""
    at = motion.at(0.0)
    turned = Rotation.from_quat(np.roll(at.quaternion, -1))
    return turned, at.omega, turned.inv().apply(at.omega)


def simulated(top, quaternion, omega, method, step, every, count):
    """Quaternions and angular velocities in the body by MuJoCo, and the seconds that it took."""
    import mujoco as engine

    A, C, gMR = top
    arm, mass = body(A, gMR)
    text = MODEL.format(step=step, method=method, arm=arm, mass=mass, across=A / 2, axial=C)
    model = engine.MjModel.from_xml_string(text)
    data = engine.MjData(model)
    data.qpos[:], data.qvel[:] = quaternion, omega
    found, began = [(*data.qpos, *data.qvel)], perf_counter()
    for _ in range(count):
        engine.mj_step(model, data, nstep=every)
        found.append((*data.qpos, *data.qvel))
    spent = perf_counter() - began
    return *np.split(np.array(found), [4], axis=1), spent


def mujoco(name, method, step, every):
    """What `ht.check` takes of a run of MuJoCo, and the seconds that it took."""
    scene, motion = problem(name)
    t, (_, _, own) = rows(scene, every), begin(motion)
    asked = numbers(scene.top), motion.at(0.0).quaternion, own, method, step, round(every / step)
    quaternion, omega, spent = simulated(*asked, t.size - 1)
    return {"t": t, "quaternion": quaternion, "omega_body": omega}, spent


def exudyn(name, method, step, every):
    """The same of EXUDYN: the body at its pivot, its weight at the arm, as in its examples."""
    import exudyn as engine
    from exudyn import itemInterface as items

    scene, motion = problem(name)
    A, C, gMR = numbers(scene.top)
    arm, mass = body(A, gMR)
    system = engine.SystemContainer().AddSystem()
    node = system.AddNode(exudyn_node(items, motion, method))
    top = system.AddObject(
        items.ObjectRigidBody(physicsMass=mass, physicsInertia=[A, A, C, 0, 0, 0], nodeNumber=node)
    )
    tip = system.AddMarker(items.MarkerBodyPosition(bodyNumber=top, localPosition=[0, 0, arm]))
    system.AddLoad(items.Force(markerNumber=tip, loadVector=[0, 0, -mass * GRAVITY]))
    ground = system.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=system.AddNode(items.PointGround()), coordinate=0)
    )
    for k in range(3):  # the pivot
        held = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))
        system.AddObject(items.CoordinateConstraint(markerNumbers=[ground, held]))
    outputs = engine.OutputVariableType
    sensors = [
        system.AddSensor(
            items.SensorNode(nodeNumber=node, outputVariableType=x, storeInternal=True)
        )
        for x in (outputs.RotationMatrix, outputs.AngularVelocity)
    ]
    system.Assemble()
    settings = engine.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = every
    settings.timeIntegration.endTime = float(scene.time)
    settings.timeIntegration.numberOfSteps = round(float(scene.time) / step)
    settings.timeIntegration.absoluteTolerance = 1e-10
    settings.timeIntegration.relativeTolerance = 0
    began = perf_counter()
    system.SolveDynamic(settings, solverType=getattr(engine.DynamicSolverType, method))
    spent = perf_counter() - began
    matrix, omega = (system.GetSensorStoredData(sensor) for sensor in sensors)
    return {"t": matrix[:, 0], "matrix": matrix[:, 1:], "omega": omega[:, 1:]}, spent


def exudyn_node(items, motion, method):
    """The body's coordinates: Euler parameters for implicit methods, else a rotation vector."""
    turned, omega, own = begin(motion)
    at_rest = [0.0, 0.0, 0.0]
    if method not in ("GeneralizedAlpha", "TrapezoidalIndex2"):
        return items.NodeRigidBodyRotVecLG(
            referenceCoordinates=at_rest + turned.as_rotvec().tolist(),
            initialVelocities=at_rest + own.tolist(),
        )
    q = motion.at(0.0).quaternion
    rates = 0.5 * np.concatenate([[-omega @ q[1:]], q[0] * omega + np.cross(omega, q[1:])])
    return items.NodeRigidBodyEP(
        referenceCoordinates=at_rest + q.tolist(), initialVelocities=at_rest + rates.tolist()
    )


ENGINES = {"mujoco": mujoco, "exudyn": exudyn}


def axis_error(engine, method, step, name):
    """What `check` says of a run: the largest error of the axis [rad]."""
    told, _ = ENGINES[engine](name, method, step, EVERY)
    return ht.check(told, problem(name)[0]).errors["axis"].max


def order(engine, method, step, expected):
    """By how much the order at which the axis error falls is another than it should be."""
    off = []
    for name in SCENES:
        coarse, fine = (axis_error(engine, method, h, name) for h in (step, step / 2))
        off.append(abs(log2(coarse / fine) - expected))
    return most(off)


def cells(error, seconds):
    """Axis error, and the µs of a nutation period."""
    scene, motion = problem(SHOWN)
    return f"{error:.1e}", f"{seconds * motion.period / float(scene.time) * 1e6:.3g}"


def engine_cells(engine, method, step, _):
    """The same of an engine, timed where no rows are kept."""
    end = float(problem(SHOWN)[0].time)
    program = {engine: lambda: ENGINES[engine](SHOWN, method, step, end)[1]}
    spent = interleaved(program, REPEATS)[engine]
    return cells(axis_error(engine, method, step, SHOWN), spent)


@claim(MUJOCO, 0.3, SHOWS, "check", needs="mujoco")
def mujoco_rk4_check():
    """order of MuJoCo's RK4 that check measures from the axis error on three scenes, vs 4."""
    return order("mujoco", "RK4", 2.5e-4, 4)


@claim(EXUDYN_PROGRAM, 0.3, SHOWS, "check", needs="exudyn")
def exudyn_rk44_check():
    """order of EXUDYN's RK44 on the Lie group that check measures from the axis error on three
    scenes, vs 4.
    """
    return order("exudyn", "RK44", 2.5e-4, 4)


@claim(EXUDYN_PROGRAM, 0.03, "a few times what the next order shows", "check", needs="exudyn")
def exudyn_trapezoidal_check():
    """order of EXUDYN's trapezoidal rule that check measures from the axis error on three scenes,
    vs 2.
    """
    return order("exudyn", "TrapezoidalIndex2", 2e-4, 2)


@proof
def errors_and_times(write=False):
    scene = ht.load_scene(SHOWN, END_ALONE)
    t = rows(scene)
    off = ht.check({"t": t, "axis": ht.propagate(scene)(t).axis}, scene).errors["axis"].max
    lines = [
        (f"{each.engine} {version(each.engine)}: {each.words}", f"{1000 * each.step:g} ms",
         *engine_cells(*each))
        for each in SETTINGS if find_spec(each.engine)
    ]  # fmt: skip
    spent = interleaved({"ours": integrating(scene)}, REPEATS)["ours"]
    lines.append(("heavytop: `auto`", "", *cells(off, spent)))
    table = markdown(("engine and method", "step", f"`{SHOWN}`", "µs"), lines)
    print(table)
    if write:
        rewrite("check-a-trajectory.md", "engines", table)
    yield "error of the axis by auto", off, 1e-13


# --- MuJoCo as an authority ------------------------------------------------------------------

STEPS = 20_000
TOP = (1.3, 0.7, 2.1)
START = (0.8, 0.1, -0.4, 0.6, -0.5, 4.0)
END = 2.0
ROUNDING = "20 000 roundings; MuJoCo's own error, of fourth order, is below them at this step"


def turned(*angles):
    return np.array([float(x) for x in from_angles(*map(float, angles))])


@cache
def mujocos(steps=STEPS):
    """Its quaternion (scalar first) at the end, from a start that is typed here."""
    theta, _, psi, *rates = START
    omega = [float(x) for x in body_rates(theta, psi, *rates)]
    return simulated(TOP, turned(*START[:3]), omega, "RK4", END / steps, steps, 1)[0][-1]


@cache
def exact():
    return turned(*angles(ht.Motion(ht.Top(*TOP), state(*START)).at(END)))


@claim(MUJOCO, 3e-13, ROUNDING, "closed form", needs="mujoco")
def mujoco_closed_form():
    """quaternion after 2 s vs MuJoCo's RK4 with 20 000 steps."""
    return attitudes_apart(exact(), mujocos())


@claim(MUJOCO, 3e-13, ROUNDING, "integrator", needs="mujoco")
def mujoco_run():
    """quaternion of the run after 2 s vs MuJoCo's RK4 with 20 000 steps."""
    wants = ("theta", "phi", "psi", "attitude")
    scene = ht.Scene(ht.Top(*TOP), state(*START), time=END, quantities=wants)
    return attitudes_apart(ht.propagate(scene)(END).quaternion, mujocos())


@claim(MUJOCO, 0.05, "both integrate the same top", "closed form", needs="mujoco")
def mujoco_order():
    """order at which MuJoCo's RK4 converges to the closed form, vs 4."""
    coarse, fine = (attitudes_apart(exact(), mujocos(steps)) for steps in (500, 1000))
    return abs(log2(coarse / fine) - 4)


if __name__ == "__main__":
    main()
