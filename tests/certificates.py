"""Runs, and the exact motion of their numbers, that tests of certificates look at."""

import heavytop as ht
from heavytop.certificate.run import binary_run


def run_of(name, form="axis", **span):
    scene = ht.load_scene(name, ["start.psi=9"])
    wanted = ("theta", "phi", "psi")
    scene = ht.Scene(scene.top, scene.start, quantities=wanted, **(span or {"time": 2}))
    return ht.propagate(scene, formulation=form)


def flow_of(trajectory):
    own = binary_run(trajectory, trajectory.binary_motion.closed_form.period)
    return own, own.flow()
