"""``heavytop plan``."""

from __future__ import annotations

from heavytop.cli.options import (
    Debug,
    Digits,
    Form,
    Json,
    Quiet,
    SceneName,
    Set,
    Verbose,
    blaming,
    overrides,
)
from heavytop.cli.output import show
from heavytop.cli.voice import Voice


def plan(
    scene: SceneName,
    json: Json = False,
    changes: Set = None,
    formulation: Form = "auto",
    digits: Digits = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Say how a scene would be integrated, why, and at what cost.

    Nothing is integrated.
    """
    from heavytop.results.classification import planned
    from heavytop.scene.scene import load_scene

    options = overrides(changes, digits)
    with Voice(quiet, verbose).warnings(), blaming(options):
        found = planned(load_scene(scene, overrides=options), formulation)
    show(found.document(), json)
