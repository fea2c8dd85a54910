"""The classify document, schema heavytop/classify/1: what is known without integrating."""

from __future__ import annotations

import math
from typing import Any, Final

from heavytop.analytic.enclosure import Enclosure, enclose
from heavytop.analytic.facts import facts
from heavytop.analytic.motion import Motion
from heavytop.errors import Unseparated
from heavytop.scene.scene import Scene

SCHEMA: Final = "heavytop/classify/1"
COURSE: Final = ("theta_min", "theta_max", "period", "precession", "spin")
ENCLOSED: Final = ("roots", *COURSE)
DIGITS: Final = 18  # of the balls around them
SHOWN: Final = 22  # significant digits of the decimals around a ball


def classify_document(scene: Scene) -> dict[str, Any]:
    """Return what can be said of a scene without integrating it.

    Parameters
    ----------
    scene : Scene
        Its top and its start; span and wants play no part.

    Returns
    -------
    dict
        ``scene``, ``motion`` and ``constants`` as in a run's document; the motion has ``why``,
        ``margin_enclosure``, ``open_tags`` and ``bound`` besides. ``facts`` are those of
        `heavytop.Facts`. ``enclosure`` has ``roots`` (cos θ), ``theta_min``, ``theta_max``,
        ``period``, ``precession`` and ``spin``, each as two decimals with the true value between
        them; None where there is no such value, or none could be enclosed.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> document = classify_document(load_scene("sicm-dropped"))
    >>> document["motion"]["kind"], round(document["motion"]["period"], 6)
    ('cusps', 0.401406)
    """
    motion = Motion(scene.top, scene.start)
    verdict = motion.verdict
    reasons = {
        "why": verdict.why,
        "margin_enclosure": [finite(bound) for bound in verdict.margin_enclosure],
        "open_tags": list(verdict.open_tags),
        "bound": finite(verdict.bound),
    }
    return {
        "schema": SCHEMA,
        "scene": scene.document(),
        "motion": motion_document(motion) | reasons,
        "constants": constants_document(motion),
        "facts": finite(facts(motion).document()),
        "enclosure": _enclosure_document(scene),
    }


def _enclosure_document(scene: Scene) -> dict[str, Any]:
    try:
        enclosure = enclose(scene.top, scene.start, digits=DIGITS)
    except Unseparated:
        return dict.fromkeys(ENCLOSED)
    return {name: _bounds(enclosure, name) for name in ENCLOSED}


def _bounds(enclosure: Enclosure, name: str) -> list[Any] | None:
    try:
        found = getattr(enclosure, name)
    except Unseparated:
        return None
    if isinstance(found, tuple):
        return [list(ball.bounds(SHOWN)) for ball in found]
    return None if found is None else list(found.bounds(SHOWN))


def motion_document(motion: Motion) -> dict[str, Any]:
    """Return kind, tags, whether they are proved, margin, range of tilt, and means per period."""
    verdict = motion.verdict
    return {
        "kind": str(verdict.kind),
        "tags": [str(tag) for tag in verdict.tags],
        "certified": verdict.certified,
        "margin": finite(verdict.margin),
    } | {name: finite(getattr(motion, name)) for name in COURSE}


def constants_document(motion: Motion) -> dict[str, Any]:
    """Return E, E_prime, p_phi and p_psi."""
    return {name: finite(value) for name, value in motion.constants.items()}


def finite(value: Any) -> Any:
    """Return a value as JSON holds it: None for what is not a finite number."""
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, dict):
        return {name: finite(each) for name, each in value.items()}
    number = float(value)
    return number if math.isfinite(number) else None
