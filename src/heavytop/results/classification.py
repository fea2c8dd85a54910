"""What is known of a scene without integrating it: its motion, and how it would be integrated."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal, Self

from heavytop.analytic.enclosure import Enclosure, enclose
from heavytop.analytic.facts import Facts, facts
from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.errors import Unseparated
from heavytop.results.base import Answer, Part, SceneTables, Text, Value, Values, finite
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


@dataclass(frozen=True, kw_only=True)
class MotionSummary(Part):
    """Kind, tags, whether they are proved and why, range of tilt, and means per period.

    `round` is the time [s] in which the axis goes once round, `amplitude` that of nutation [rad];
    `estimates` are what textbooks give for a fast top, with their errors.
    """

    kind: Text
    tags: tuple[Text, ...]
    certified: bool
    theta_min: Value
    theta_max: Value
    period: Value
    precession: Value
    spin: Value
    why: Text = ""
    round: Value = None
    amplitude: Value = None
    estimates: Values = field(default_factory=dict)

    @classmethod
    def of(cls, motion: Motion, known: Facts | None = None, **more: Any) -> Self:
        """Return the summary of a motion, of which the facts may be known."""
        verdict = motion.verdict
        return cls(
            kind=str(verdict.kind),
            tags=tuple(str(tag) for tag in verdict.tags),
            certified=verdict.certified,
            **{name: finite(getattr(motion, name)) for name in COURSE},
            why=verdict.why,
            round=None if verdict.kind in POLAR else finite(motion.round),
            amplitude=finite(motion.amplitude),
            estimates=_estimates(known or facts(motion)),
            **more,
        )


def _estimates(known: Facts) -> dict[str, Value]:
    """What textbooks give for a fast top, where they estimate something, and estimate/truth − 1."""
    found = {
        name.removeprefix("fast_top_"): value
        for name, value in known.document().items()
        if name.startswith("fast_top_") and value is not None
    }
    return finite(found) if len(found) > 1 else {}  # the ratio p_ψ²/4A|gMR| alone is no estimate


@dataclass(frozen=True, kw_only=True)
class ClassifiedMotion(MotionSummary):
    """A motion with the tags that are open, and the bound of what is undecided."""

    open_tags: tuple[Text, ...]
    bound: Value


@dataclass(frozen=True, kw_only=True)
class Classification(Answer):
    """What can be said of a scene without integrating it.

    Attributes
    ----------
    scene : SceneTables
    motion : ClassifiedMotion
    constants : mapping from str to float
        E, E_prime, p_phi and p_psi.
    facts : mapping
        Those of `heavytop.Facts`.
    enclosure : mapping
        ``roots`` (cos θ), ``theta_min``, ``theta_max``, ``period``, ``precession`` and ``spin``,
        each as two decimals with the true value between them; None where there is no such value,
        or none could be enclosed.
    warnings : tuple of str
        What no rigid body can be, a θ that was folded, what another kick would do.
    """

    schema: Literal["heavytop/classify/1"] = "heavytop/classify/1"
    scene: SceneTables
    motion: ClassifiedMotion
    constants: Values
    facts: Mapping[Text, Any]
    enclosure: Mapping[Text, Any]
    warnings: tuple[Text, ...] = ()


@dataclass(frozen=True, kw_only=True)
class PlanSummary(Part):
    """How a scene is integrated, and why; ``cost_s`` and ``error`` are expected, not measured."""

    formulation: Text
    precision: Text
    tolerance: Value
    states: int
    projected: bool
    events: tuple[Text, ...]
    reasons: tuple[Text, ...]
    warnings: tuple[Text, ...]
    cost_s: Value
    error: Value

    @classmethod
    def of(cls, chosen: Plan) -> Self:
        """Return the summary of a plan."""
        names = ("formulation", "precision", "tolerance", "states", "projected")
        expected = chosen.estimate
        return cls(
            **{name: finite(getattr(chosen, name)) for name in names},
            events=tuple(chosen.watched),
            reasons=tuple(chosen.reasons),
            warnings=tuple(chosen.warnings),
            cost_s=finite(expected.seconds) if expected else None,
            error=finite(expected.error) if expected else None,
        )

    @property
    def asked(self) -> str:
        """The equations that were asked for, ``auto`` where it chose."""
        form = self.formulation
        return form if f"{form}: asked for by name" in self.reasons else "auto"


@dataclass(frozen=True, kw_only=True)
class Planned(Answer):
    """How a scene would be integrated; nothing is."""

    schema: Literal["heavytop/plan/1"] = "heavytop/plan/1"
    scene: SceneTables
    plan: PlanSummary


def classified(scene: Scene) -> Classification:
    """Return what can be said of a scene without integrating it.

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
        scene=SceneTables(**scene.document()),
        motion=ClassifiedMotion.of(
            motion,
            known,
            open_tags=tuple(verdict.open_tags),
            bound=finite(verdict.bound),
        ),
        constants=finite(dict(motion.constants.items())),
        facts=finite(known.document()),
        enclosure=_enclosure(scene),
        warnings=warnings_of(scene),
    )


def warnings_of(scene: Scene) -> tuple[str, ...]:
    """What is to be said of a scene before anything is computed."""
    said = (scene.top.warning, *scene.start.notices, _kick(scene))
    return tuple(filter(None, said))


def _kick(scene: Scene) -> str:
    """What a kick would do that holds ω₃, where it is ψ̇ that is held."""
    top, start = scene.top, scene.start
    held = start.held == "psidot" and start.spin.sign() and top.C.sign()
    if not held or not start.phidot.sign() or float(start.theta) in (0.0, math.pi):
        return ""
    rates = {name: getattr(start, name) for name in ("theta", "thetadot", "phidot")}
    motion, other = (Motion(top, each) for each in (start, State(**rates, omega3=start.spin)))
    ranges = [each.theta_max - each.theta_min for each in (motion, other)]
    times = f", {ranges[0] / ranges[1]:.2g} times less" if 0 < ranges[1] < ranges[0] else ""
    bounds = f"from {other.theta_min:.6g} to {other.theta_max:.6g} rad"
    spin = f"{float(start.spin):.6g}"
    return f"psidot = {spin} is held: a kick that holds omega3 = {spin} moves theta {bounds}{times}"


def planned(scene: Scene, formulation: str = "auto") -> Planned:
    """Return how a scene would be integrated, and why.

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
    >>> planned(load_scene("sicm-kicked", ['want.quantities=["theta"]'])).plan.states
    2
    """
    from heavytop.run.planning import plan

    chosen = plan(scene, formulation)
    return Planned(scene=SceneTables(**scene.document()), plan=PlanSummary.of(chosen))


def _enclosure(scene: Scene) -> dict[str, Any]:
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
