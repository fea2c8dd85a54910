"""What is known of a scene without integrating it: its motion, and how it would be integrated."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Final

from heavytop.analytic.facts import Facts, facts
from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.errors import Unseparated
from heavytop.results import run_texts
from heavytop.results.base import Fact, Result
from heavytop.scene.quantities import QUANTITIES
from heavytop.scene.scene import Scene
from heavytop.scene.state import State

if TYPE_CHECKING:
    from heavytop.run.planning import Plan

COURSE: Final = ("theta_min", "theta_max", "period", "precession", "spin")
POLAR: Final = (Kind.PLANAR_PENDULUM, Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM)
"""Kinds whose axis does not go round the vertical but through it."""
ENCLOSED: Final = ("roots", *COURSE)
DIGITS: Final = 18  # of the balls around them
SHOWN: Final = 22  # significant digits of the decimals around a ball


def motion_summary(motion: Motion, known: Facts | None = None) -> dict[str, Any]:
    """Kind, tags, whether they are proved and why, range of tilt, and means per period.

    `round` is the time [s] in which the axis goes once round, `amplitude` that of nutation [rad];
    `estimates` are what textbooks give for a fast top, with their errors.
    """
    verdict = motion.verdict
    return {
        "kind": str(verdict.kind),
        "tags": [str(tag) for tag in verdict.tags],
        "certified": verdict.certified,
        **{name: getattr(motion, name) for name in COURSE},
        "why": verdict.why,
        "round": None if verdict.kind in POLAR else motion.round,
        "amplitude": motion.amplitude,
        "estimates": (known or facts(motion)).estimates,
    }


def plan_summary(chosen: Plan) -> dict[str, Any]:
    """How a scene is integrated, and why; ``cost_s`` is expected, not measured."""
    names = ("formulation", "precision", "tolerance", "states", "projected", "tried")
    return {
        **{name: getattr(chosen, name) for name in names},
        "events": chosen.watched,
        "reasons": chosen.reasons,
        "warnings": chosen.warnings,
        "cost_s": chosen.seconds,
    }


@dataclass(frozen=True, kw_only=True, repr=False)
class Classification(Result):
    """What can be said of a scene without integrating it.

    Attributes
    ----------
    scene : mapping
    motion : mapping
        With the reasons for its kind, which tags are open, and to which bound.
    constants : mapping from str to float
        E, E_prime, p_phi and p_psi.
    motion_facts : mapping
        Those of `heavytop.Facts`.
    enclosure : mapping
        ``roots`` (cos θ), ``theta_min``, ``theta_max``, ``period``, ``precession`` and ``spin``,
        each as two decimals with the true value between them; None where there is no such value,
        or none could be enclosed.
    warnings : tuple of str
        What no rigid body can be, a θ that was folded, what another kick would do.
    """

    schema: ClassVar = "heavytop/classify/1"
    heading: ClassVar = "Classification"
    left_out: ClassVar = ("files", "versions")

    scene: Any
    motion: Any
    constants: Any
    motion_facts: Any
    enclosure: Any
    warnings: tuple[str, ...] = ()

    def document(self) -> dict[str, Any]:
        """Return the document heavytop/classify/1: the facts of the motion are ``facts``."""
        found = super().document().items()
        return {"facts" if name == "motion_facts" else name: x for name, x in found}

    def facts(self) -> Iterator[Fact]:
        """Kind and why, range of tilt and means per period, constants, rates."""
        yield from run_texts.verdict_facts(self.motion)
        yield from run_texts.course_facts(self.motion, self.enclosure)
        yield from run_texts.numbers(self.constants, *run_texts.CONSTANTS)
        yield from run_texts.rate_facts(self.motion_facts)
        yield from run_texts.estimate_facts(self.motion["estimates"])
        yield from (("note", text) for text in self.warnings)


@dataclass(frozen=True, kw_only=True, repr=False)
class Planned(Result):
    """How a scene would be integrated; nothing is."""

    schema: ClassVar = "heavytop/plan/1"
    heading: ClassVar = "Plan"
    left_out: ClassVar = ("files", "versions")

    scene: Any
    plan: Any

    def facts(self) -> Iterator[Fact]:
        """The equations, their precision, why, and what is expected."""
        yield from run_texts.plan_facts(self.plan)
        yield from run_texts.forecast_facts(self.plan)


def classified(scene: Scene) -> Classification:
    """Find and prove the kind of motion of a scene.

    Nothing is integrated.

    Parameters
    ----------
    scene : Scene
        Its top and its start; span and wants play no part.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> motion = classified(load_scene("sicm-dropped")).motion
    >>> motion.kind, round(motion.period, 6)
    ('cusps', 0.401406)
    """
    motion = Motion(scene.top, scene.start)
    verdict, known = motion.verdict, facts(motion)
    return Classification(
        scene=scene.document(),
        motion=motion_summary(motion, known)
        | {"open_tags": verdict.open_tags, "bound": verdict.bound},
        constants=motion.constants._asdict(),
        motion_facts=known.document(),
        enclosure={name: _bounds(motion, name) for name in ENCLOSED},
        warnings=warnings_of(scene),
    )


def warnings_of(scene: Scene) -> tuple[str, ...]:
    """What is to be said of a scene before anything is computed."""
    notices = (scene.top.warning, *scene.start.notices, _kick(scene))
    return tuple(filter(None, notices))


def _kick(scene: Scene) -> str:
    """What a kick would do that holds ω₃, where it is ψ̇ that is held."""
    top, start = scene.top, scene.start
    kicked = start.held == "psidot" and "steady" not in dict(start.given)
    signs = start.spin.sign() and top.C.sign() and start.phidot.sign()
    if not (kicked and signs) or float(start.theta) in (0.0, math.pi):
        return ""
    rates = {name: getattr(start, name) for name in ("theta", "thetadot", "phidot")}
    motion, other = (Motion(top, each) for each in (start, State(**rates, omega3=start.spin)))
    ranges = [each.theta_max - each.theta_min for each in (motion, other)]
    times = f", {ranges[0] / ranges[1]:.2g} times less" if 0 < ranges[1] < ranges[0] else ""
    tilts = other.theta_min, other.theta_max
    bounds = QUANTITIES["theta"].with_unit(*tilts, form=".6g")
    spin = f"{float(start.spin):.6g}"
    change = f"moves theta from {bounds}{times}"
    return f"psidot = {spin} is held: a kick that holds omega3 = {spin} {change}"


def planned(scene: Scene, *, formulation: str = "auto", digits: int | None = None) -> Planned:
    """Show how a scene would be integrated, why, and at what cost.

    Nothing is integrated.

    Parameters
    ----------
    scene : Scene
    formulation : str
        Equations to integrate, such as axis; auto: the fewest.
    digits : int, optional
        Correct digits at the end of the span, such as 30; default: the scene's.

    Raises
    ------
    BadScene
        The scene wants what the formulation cannot give.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> planned(load_scene("sicm-kicked", ['want.quantities=["theta"]'])).plan.states
    2
    """
    from heavytop.run.planning import plan

    if digits is not None:
        scene = replace(scene, digits=digits)
    return Planned(scene=scene.document(), plan=plan_summary(plan(scene, formulation)))


def _bounds(motion: Motion, name: str) -> list[Any] | None:
    try:
        found = motion.interval(name, digits=DIGITS)
    except Unseparated:
        return None
    if isinstance(found, tuple):
        return [list(ball.bounds(SHOWN)) for ball in found]
    return None if found is None else list(found.bounds(SHOWN))
