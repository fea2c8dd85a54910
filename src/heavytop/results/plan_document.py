"""The plan document, schema heavytop/plan/1: how a scene would be integrated, and why."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from heavytop.results.classification import finite
from heavytop.run.planning import Plan, plan
from heavytop.scene.scene import Scene

SCHEMA: Final = "heavytop/plan/1"


def plan_document(scene: Scene, formulation: str = "auto") -> dict[str, Any]:
    """Return the plan of a scene as plain values; nothing is integrated.

    Parameters
    ----------
    scene : Scene
    formulation : str
        ``auto`` or the name of a formulation.

    Raises
    ------
    BadScene
        The scene wants what the formulation cannot give.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> plan_document(load_scene("sicm-kicked", ['want.quantities=["theta"]']))["plan"]["states"]
    2
    """
    chosen = plan(scene, formulation)
    return {"schema": SCHEMA, "scene": scene.document(), "plan": chosen_document(chosen)}


def chosen_document(chosen: Plan) -> dict[str, Any]:
    """Return a plan as plain values: ``cost_s`` and ``error`` are expected, not measured."""
    names = ("formulation", "precision", "tolerance", "states", "projected", "folded")
    expected = chosen.estimate
    return {n: finite(getattr(chosen, n)) for n in names} | {
        "events": list(chosen.watched),
        "reasons": list(chosen.reasons),
        "warnings": list(chosen.warnings),
        "cost_s": None if expected is None else finite(expected.seconds),
        "error": None if expected is None else finite(expected.error),
    }


def asked_form(plan: Mapping[str, Any]) -> str:
    """Return the equations that were asked for, ``auto`` where it chose; of a plan's document."""
    form = str(plan["formulation"])
    return form if f"{form}: asked for by name" in plan["reasons"] else "auto"
