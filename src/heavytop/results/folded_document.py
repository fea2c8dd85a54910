"""The run document of a scene whose span is folded onto one nutation, schema heavytop/run/1."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from heavytop.integration.bits import named
from heavytop.numbers.decimals import Context, Number
from heavytop.results.classification import finite
from heavytop.results.document import known_document
from heavytop.results.final import NUMBER_DIGITS, final_document
from heavytop.run.periodic import Folded
from heavytop.run.planning import Plan, closed_form_of

SPARE_DIGITS = 10  # of the closed form at the end, beyond those of the number of periods


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
        Of the schema of a run. Beyond 15 digits its numbers at the end are decimal texts, one
        digit longer than what is wanted. ``errors`` are theirs, of theta, of what phi and psi are
        beyond their whole turns, and of the axis.
    """
    final, cost = _final(folded), folded.cost
    errors = _errors(folded, final)
    bound = 10.0**-folded.scene.digits
    document = known_document(folded.scene, _made(folded, chosen))
    return document | {
        "final": final,
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


def _made(folded: Folded, chosen: Plan) -> Plan:
    """The plan with the bits that it took in the end; where theta is constant, as it was."""
    bits = folded.cost.bits
    return replace(chosen, precision=named(bits), tolerance=2.0 ** (1 - bits)) if bits else chosen


def _final(folded: Folded) -> dict[str, Any]:
    end: Any = folded.end
    many = folded.scene.digits > NUMBER_DIGITS
    if many:
        end = folded.decimals(folded.span)
    digits = folded.scene.digits + 1  # the last one is rounded

    def text(x: Number, whole: int = 0) -> str:
        return str(folded.span.context.nstr(x, digits + len(str(abs(whole))) - 1))

    def turned(angle: str) -> tuple[int, Any]:
        return int(getattr(end, f"{angle}_turns")), getattr(end, f"{angle}_mod")

    final = final_document(end, text if many else finite, turned, attitude=True)
    angles = {name: getattr(end, name) for name in ("phi", "psi")}
    return final | {name: text(x, int(x)) for name, x in angles.items()} if many else final


def _errors(folded: Folded, final: dict[str, Any]) -> dict[str, float]:
    """How far what the document says is off the closed form."""
    digits = folded.scene.digits + SPARE_DIGITS + len(str(int(abs(folded.span))))
    truth: Any = closed_form_of(folded.scene).at(folded.span, digits=digits)
    ctx = folded.span.context
    said = {name: ctx.mpf(final[name]) for name in ("theta", "phi_mod", "psi_mod")}
    turned = {
        name: abs(_principal(ctx, getattr(truth, name) - said[f"{name}_mod"]))
        for name in ("phi", "psi")
    }
    axis = (ctx.mpf(a) - b for a, b in zip(final["axis"], truth.axis, strict=True))
    return {
        "theta": float(abs(said["theta"] - truth.theta)),
        **{name: float(error) for name, error in turned.items()},
        "axis": float(ctx.sqrt(sum(x * x for x in axis))),
    }


def _principal(ctx: Context, angle: Number) -> Number:
    """An angle in (−π, π]: whole turns apart."""
    return angle - 2 * ctx.pi * ctx.nint(angle / (2 * ctx.pi))
