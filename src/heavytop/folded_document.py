"""The run document of a scene whose span is folded onto one nutation, schema heavytop/run/1."""

from __future__ import annotations

from typing import Any

import numpy as np

from heavytop.classification import finite
from heavytop.document import known_document
from heavytop.folded import Folded
from heavytop.folds.sample import FoldedSample
from heavytop.planning import Plan, closed_form_of

DIGITS = 20  # of the closed form at the end, beyond those of the number of periods


def folded_document(folded: Folded, chosen: Plan) -> dict[str, Any]:
    """Return the document of a folded motion: the end, held against the closed form there.

    Parameters
    ----------
    folded : Folded
    chosen : Plan
        The scene's plan.

    Returns
    -------
    dict
        Of the schema of a run. ``errors`` are those at the end, of theta, of what phi and psi are
        beyond their whole turns, and of the axis.
    """
    end, cost = folded.end, folded.cost
    errors = _errors(folded, end)
    bound = 10.0**-folded.scene.digits
    document = known_document(folded.scene, chosen)
    return document | {
        "final": _final(end),
        "errors": document["errors"] | errors | {"why_not": ""},
        "missed_digits": {name: error for name, error in errors.items() if error > bound},
        "cost": {
            "steps": cost.steps,
            "derive_s": 0.0,
            "compile_s": cost.compile_s,
            "integrate_s": cost.integrate_s,
            "us_per_period": None,
        },
    }


def _final(end: FoldedSample) -> dict[str, Any]:
    numbers = ("t", "theta", "phi", "psi", "thetadot", "phidot", "psidot", "phi_mod", "psi_mod")
    vectors = ("axis", "omega", "quaternion")
    final: dict[str, Any] = {name: finite(getattr(end, name)) for name in numbers}
    final |= {name: int(getattr(end, name)) for name in ("phi_turns", "psi_turns")}
    return final | {name: [finite(x) for x in getattr(end, name)] for name in vectors}


def _errors(folded: Folded, end: FoldedSample) -> dict[str, float]:
    far = int(abs(float(folded.span)))
    truth: Any = closed_form_of(folded.scene).at(folded.span, digits=DIGITS + len(str(far)))
    ctx = folded.span.context
    turned = {
        name: abs(
            _principal(ctx, getattr(truth, name) - ctx.mpf(float(getattr(end, f"{name}_mod"))))
        )
        for name in ("phi", "psi")
    }
    axis = [float(ctx.mpf(float(a)) - b) for a, b in zip(end.axis, truth.axis, strict=True)]
    theta = abs(ctx.mpf(float(end.theta)) - truth.theta)
    return {
        "theta": float(theta),
        **{name: float(error) for name, error in turned.items()},
        "axis": float(np.linalg.norm(axis)),
    }


def _principal(ctx: Any, angle: Any) -> Any:
    """An angle in (−π, π]: whole turns apart."""
    return angle - 2 * ctx.pi * ctx.nint(angle / (2 * ctx.pi))
