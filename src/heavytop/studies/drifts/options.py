"""The options of a drift study: what may be given for each, and what is asked of the scene."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from heavytop.errors import Fault
from heavytop.run.planning import closed_form_of
from heavytop.scene.arguments import Range, shown
from heavytop.scene.scene import Scene

NUMBERS: Final = {
    "periods": Range(1, 1e12),
    "ensemble": Range(1, 10_000, whole=True),
    "samples": Range(2, 10_000, whole=True),
    "seed": Range(0, 2**63 - 1, whole=True),
}
JOBS: Final = {"jobs": Range(1, 1024, whole=True)}


def no_nutation(file: str, scene: object, study: str) -> Iterator[Fault]:
    """Yield why a scene has no nutation periods to be counted.

    Parameters
    ----------
    file : str
        What the fault names.
    scene : object
    study : str
        What would count them, for the hint: ``a drift study``.
    """
    if not isinstance(scene, Scene):
        rule, hint = "a Scene", "load_scene gives one by its name"
        yield Fault(file, None, "scene", shown(scene), rule, hint)
        return
    motion = closed_form_of(scene)
    if motion.period is None:
        rule = f"no nutation period to count: {motion.kind}"
        yield Fault(file, None, "start", "", rule, f"{study} takes a top that nutates")
