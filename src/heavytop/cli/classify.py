"""``heavytop classify``."""

from __future__ import annotations

from heavytop.cli.options import (
    Debug,
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


def classify(
    scene: SceneName,
    json: Json = False,
    changes: Set = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Say which kind of motion a scene is, with the proof.

    Nothing is integrated.
    """
    from heavytop.results.classification import classified
    from heavytop.scene.scene import load_scene

    voice = Voice(quiet, verbose)
    options = overrides(changes)
    with voice.warnings(), blaming(options):
        read = load_scene(scene, overrides=options)
    voice.note(f"classifying {read.name}")
    show(classified(read).document(), json)
