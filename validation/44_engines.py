"""MuJoCo and EXUDYN, two engines of multibody dynamics, judged by `ht.check` on three scenes.

Each has the settings that its own documentation gives. The claims are the orders at which their
errors fall with the step; `write`, on a quiet machine, puts the table of errors and times into
docs/check-a-trajectory.md.
"""

import sys
from functools import cache
from math import log2
from time import perf_counter
from typing import NamedTuple

import numpy as np
from claim import claimed, finish, most
from page import rewrite

import heavytop as ht
from heavytop.doctor import version

SCENES = ("sicm-kicked", "lie-group-benchmark", "simo-wong")
SHOWN = ("sicm-kicked",)  # in the table
GRAVITY = 9.81  # m/s^2
EVERY = 0.004  # s between two rows: a multiple of every step
REPEATS = 7  # runs, of which the time is the best
END_ALONE = ["want.events=[]", "want.samples=2", 'want.quantities=["attitude"]']

MODEL = """
<mujoco>
  <option timestep="{step!r}" integrator="{method}" gravity="0 0 -{gravity}"/>
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
MUJOCO = (
    Setting("mujoco", "implicit", 2e-3, "implicit"),
    Setting("mujoco", "RK4", 2e-3, "RK4"),
    Setting("mujoco", "RK4", 2e-4, "RK4"),
)
# EXUDYN's test models heavyTop.py (Euler parameters, 0.1 ms; generalised α is the default solver)
# and explicitLieGroupIntegratorTest.py (rotation vectors, 1 ms; the tolerance of DOPRI5).
EXUDYN = (
    Setting("exudyn", "GeneralizedAlpha", 1e-4, "generalised α (ρ = 0.9), Euler parameters"),
    Setting("exudyn", "RK44", 1e-3, "RK44 on the Lie group"),
    Setting("exudyn", "DOPRI5", 1e-3, "DOPRI5 on the Lie group, tolerance 1e-10"),
)


@cache
def problem(name):
    scene = ht.load_scene(name)
    return scene, ht.Motion(scene.top, scene.start)


def body(top):
    """Arm and mass of a body whose moment is half its own, half that of its distance."""
    arm = GRAVITY * float(top.A) / 2 / float(top.gMR)
    return arm, float(top.gMR) / GRAVITY / arm


def rows(scene, every=EVERY):
    return np.arange(round(float(scene.time) / every) + 1) * every


def mujoco(name, method, step, every):
    """What `ht.check` takes of a run of MuJoCo, and the seconds that it took."""
    import mujoco as engine

    scene, motion = problem(name)
    start, (arm, mass) = motion.at(0.0), body(scene.top)
    text = MODEL.format(step=step, method=method, gravity=GRAVITY, arm=arm, mass=mass,
                        across=float(scene.top.A) / 2, axial=float(scene.top.C))  # fmt: skip
    model = engine.MjModel.from_xml_string(text)
    data = engine.MjData(model)
    data.qpos[:] = start.quaternion
    data.qvel[:] = rotation(start.quaternion).T @ start.omega
    t, found = rows(scene, every), [(*data.qpos, *data.qvel)]
    many, began = round(every / step), perf_counter()
    for _ in t[1:]:
        engine.mj_step(model, data, nstep=many)
        found.append((*data.qpos, *data.qvel))
    spent = perf_counter() - began
    quaternion, omega = np.split(np.array(found), [4], axis=1)
    return {"t": t, "quaternion": quaternion, "omega_body": omega}, spent


def rotation(q):
    w, v = q[0], np.asarray(q[1:])
    hat = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * hat + 2 * hat @ hat


def exudyn(name, method, step, every):
    """The same of EXUDYN: the body at its pivot, its weight at the arm, as in its examples."""
    import exudyn as engine
    from exudyn import itemInterface as items

    scene, motion = problem(name)
    start, (arm, mass) = motion.at(0.0), body(scene.top)
    A, C = float(scene.top.A), float(scene.top.C)
    system = engine.SystemContainer().AddSystem()
    implicit = method in ("GeneralizedAlpha", "TrapezoidalIndex2")
    at_rest = [0.0, 0.0, 0.0]
    q, omega = np.asarray(start.quaternion), np.asarray(start.omega)
    if implicit:
        rates = 0.5 * np.concatenate([[-omega @ q[1:]], q[0] * omega + np.cross(omega, q[1:])])
        node = system.AddNode(
            items.NodeRigidBodyEP(referenceCoordinates=at_rest + q.tolist(),
                                  initialVelocities=at_rest + rates.tolist())
        )  # fmt: skip
    else:
        turn = 2 * np.arctan2(np.linalg.norm(q[1:]), q[0]) * q[1:] / np.linalg.norm(q[1:])
        own = rotation(q).T @ omega
        node = system.AddNode(
            items.NodeRigidBodyRotVecLG(referenceCoordinates=at_rest + turn.tolist(),
                                        initialVelocities=at_rest + own.tolist())
        )  # fmt: skip
    top = system.AddObject(
        items.ObjectRigidBody(physicsMass=mass, physicsInertia=[A, A, C, 0, 0, 0], nodeNumber=node)
    )
    tip = system.AddMarker(items.MarkerBodyPosition(bodyNumber=top, localPosition=[0, 0, arm]))
    system.AddLoad(items.Force(markerNumber=tip, loadVector=[0, 0, -mass * GRAVITY]))
    ground = system.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=system.AddNode(items.PointGround()), coordinate=0)
    )
    for k in range(3):
        held = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))
        system.AddObject(items.CoordinateConstraint(markerNumbers=[ground, held]))
    kinds = engine.OutputVariableType.RotationMatrix, engine.OutputVariableType.AngularVelocity
    sensors = [
        system.AddSensor(
            items.SensorNode(nodeNumber=node, outputVariableType=kind, storeInternal=True)
        )
        for kind in kinds
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


def cells(setting):
    """Axis error, and the µs of a nutation period where no rows are kept, in the scenes shown."""
    engine, method, step, _ = setting
    for name in SHOWN:
        scene, motion = problem(name)
        end = float(scene.time)
        spent = min(ENGINES[engine](name, method, step, end)[1] for _ in range(REPEATS))
        yield f"{axis_error(engine, method, step, name):.1e}"
        yield f"{spent * motion.period / end * 1e6:.3g}"


def ours():
    for name in SHOWN:
        _, motion = problem(name)
        scene = ht.load_scene(name, END_ALONE)
        runs = [ht.propagate(scene) for _ in range(REPEATS)]
        t = rows(scene)
        off = ht.check({"t": t, "axis": runs[0](t).axis}, scene).errors["axis"].max
        spent = min(run.statistics.integrate_s for run in runs)
        yield f"{off:.1e}"
        yield f"{spent * motion.period / float(scene.time) * 1e6:.3g}"


def table():
    head = ["engine and method", "step", *(x for name in SHOWN for x in (f"`{name}`", "µs"))]
    lines = [head, ["--", "--:"] + ["--:"] * 2 * len(SHOWN)]
    titles = {"mujoco": "MuJoCo", "exudyn": "EXUDYN"}
    for each in (*MUJOCO, *EXUDYN):
        title = f"{titles[each.engine]} {version(each.engine)}: {each.words}"
        lines.append([title, f"{each.step * 1000:g} ms", *cells(each)])
    lines.append(["heavytop: `auto`", "", *ours()])
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


@claimed("mujoco-rk4-check")
def _():
    return order("mujoco", "RK4", 2.5e-4, 4)


@claimed("exudyn-rk44-check")
def _():
    return order("exudyn", "RK44", 2.5e-4, 4)


@claimed("exudyn-trapezoidal-check")
def _():
    return order("exudyn", "TrapezoidalIndex2", 2e-4, 2)


if "write" in sys.argv:
    rewrite("check-a-trajectory.md", "engines", table())
finish()
