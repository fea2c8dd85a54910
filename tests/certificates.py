"""Runs, and the exact motion of their numbers, that tests of certificates look at."""

import heavytop as ht
from heavytop.certificate.run import binary_run


def run_of(name, form="axis", **asked):
    quantities = ("theta",) if form == "cubic" else ("theta", "phi", "psi")
    scene = ht.load_scene(name)
    scene = ht.Scene(scene.top, scene.start, quantities=quantities, **(asked or {"time": 2}))
    return ht.propagate(scene, formulation=form)


def flow_of(trajectory):
    own = binary_run(trajectory)
    last = trajectory.orbit.checkpoints[-1]
    steps, _ = own.steps(last, trajectory.orbit.steps - last.steps)
    return own, own.flow(steps)
