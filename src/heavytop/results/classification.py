"""Results that need no integration: the motion of a scene, and the plan of its integration."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self

from heavytop.analytic.facts import Facts, facts
from heavytop.analytic.motion import Motion
from heavytop.errors import Unseparated
from heavytop.results.base import Result
from heavytop.results.table import Fact
from heavytop.scene.quantities import quantity_of
from heavytop.scene.scene import Scene
from heavytop.scene.state import State
from heavytop.text import duration

if TYPE_CHECKING:
    from heavytop.run.plan import Plan

COURSE: Final = ("theta_min", "theta_max", "period", "precession", "spin")
TILTS: Final = re.compile(r"(?<=theta from )(\S+) to (\S+) rad")
"""The tilts in the warning of a kick."""
ENCLOSED: Final = ("roots", *COURSE)
BALL_DIGITS: Final = 18  # of the balls around them
BALL_DECIMALS: Final = 22  # significant digits of the decimals around a ball
OF_PARTS: Final = ("A", "C", "gMR", "mass", "distance")
CONSTANTS: Final = ("E", "E_prime", "p_phi", "p_psi")
SHOWN_FACTS: Final = (
    "mean_precession_rate", "mean_spin_rate", "phidot_reversal_theta", "psidot_reversal_theta",
    "nutation_frequency", "nutation_amplitude", "rotation_number", "small_nutation_frequency",
    "other_precession_rate", "other_nutation_frequency", "growth_rate", "slow_cone_rate",
    "fast_cone_rate", "sleeping_threshold", "fast_top_ratio",
)  # fmt: skip
"""The facts that a classification shows, in this order."""
ESTIMATED: Final = {"precession": "mean_precession_rate", "amplitude": "nutation_amplitude"}
"""The quantities of textbook estimates whose names mean something else elsewhere."""


def motion_summary(motion: Motion, known: Facts | None = None) -> dict[str, Any]:
    """Return kind, tags, whether they are proved and why, range of tilt, and means per period.

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
        "round": motion.round,
        "amplitude": motion.amplitude,
        "estimates": (known or facts(motion)).estimates,
    }


def plan_summary(chosen: Plan) -> dict[str, Any]:
    """Return a plan with the keys of its document; ``cost_s`` is expected, not measured."""
    kept = ("formulation", "precision", "tolerance", "states", "projected", "tried")
    more = {"events": "watched", "reasons": "reasons", "warnings": "warnings", "cost_s": "seconds"}
    names = dict(zip(kept, kept, strict=True)) | more
    return {key: getattr(chosen, name) for key, name in names.items()}


class MotionResult(Result):
    """The motion of a scene, as far as it follows from top and start alone.

    Attributes
    ----------
    scene : mapping
        As `heavytop.Scene.document` gives it.
    motion : mapping
        As `motion_summary` gives it.
    top : mapping from str to float
        A, C, gMR, mass and distance of a top made of solids, or of a mass; else empty.
    constants : mapping from str to float
        E, E_prime, p_phi and p_psi.
    warnings : tuple of str
        An impossible rigid body, a θ that was folded into [0, π], what another kick would do.
    """

    scene: Any
    motion: Any
    top: Mapping[str, float] = field(default_factory=dict)
    constants: Any
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(cls, scene: Scene, motion: Motion, summary: Mapping[str, Any], **more: Any) -> Self:
        """Return the result of a scene and its motion; `more` are further fields."""
        top = scene.top
        return cls(
            scene=scene.document(),
            motion=summary,
            top={} if top.mass is None else {name: float(getattr(top, name)) for name in OF_PARTS},
            constants=motion.constants._asdict(),
            warnings=tuple(filter(None, (top.warning, *scene.start.notices, _kick(scene)))),
            **more,
        )

    def notes(self) -> Iterator[Fact]:
        """Yield the warnings, with tilts, in rad in a document, in the units that are shown."""

        def shown(tilts: re.Match[str]) -> str:
            return quantity_of("theta").with_unit(*map(float, tilts.groups()), form=".6g")

        yield from (("note", TILTS.sub(shown, text)) for text in self.warnings)

    def facts(self) -> Iterator[Fact]:
        """Yield kind and why, range of tilt and means per period, the top, constants."""
        yield from verdict_facts(self.motion)
        yield from course_facts(self.motion)
        yield from numbers(self.top, *self.top)
        yield from numbers(self.constants, *CONSTANTS)


class Classification(MotionResult):
    """The classification of a scene, which integrates nothing.

    Attributes
    ----------
    scene, motion, top, constants, warnings
        As of `MotionResult`; `motion` has also the tags that are open, and the bound to which.
    motion_facts : mapping
        The fields of `heavytop.Facts`.
    enclosure : mapping
        ``roots`` (cos θ), ``theta_min``, ``theta_max``, ``period``, ``precession`` and ``spin``,
        each as two decimals with the true value between them; None where there is no such value,
        or none could be enclosed.
    """

    schema: ClassVar = "heavytop/classify/1"
    left_out: ClassVar = ("files", "versions")

    motion_facts: Any
    enclosure: Any

    def document(self) -> dict[str, Any]:
        """Return the document heavytop/classify/1: the facts of the motion are ``facts``."""
        found = super().document().items()
        return {"facts" if name == "motion_facts" else name: x for name, x in found}

    def facts(self) -> Iterator[Fact]:
        """Yield kind and why, range of tilt and means per period, constants, rates."""
        yield from super().facts()
        yield from rate_facts(self.motion_facts)
        yield from estimate_facts(self.motion["estimates"])
        yield from self.notes()


class Planned(Result):
    """How a scene would be integrated; nothing is integrated."""

    schema: ClassVar = "heavytop/plan/1"
    heading: ClassVar = "Plan"
    left_out: ClassVar = ("files", "versions")

    scene: Any
    plan: Any

    def facts(self) -> Iterator[Fact]:
        """Yield the equations, their precision, the reasons, warnings and the expected time."""
        yield from plan_facts(self.plan)
        yield from (("warning", warning) for warning in self.plan.warnings)
        if self.plan.cost_s is not None and self.plan.states:
            yield "expected", f"{duration(self.plan.cost_s)} of steps"


def classify_scene(scene: Scene) -> Classification:
    """Find and prove the kind of motion of a scene.

    Nothing is integrated.

    Parameters
    ----------
    scene : Scene
        Its top and its start; span and wants play no part.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> motion = classify_scene(load_scene("sicm-dropped")).motion
    >>> motion.kind, round(motion.period, 6)
    ('cusps', 0.401406)
    """
    motion = Motion(scene.top, scene.start)
    verdict, known = motion.verdict, facts(motion)
    summary = motion_summary(motion, known)
    summary |= {"open_tags": verdict.open_tags, "bound": verdict.bound}
    enclosure = {name: _bounds(motion, name) for name in ENCLOSED}
    more = {"motion_facts": asdict(known), "enclosure": enclosure}
    return Classification.of(scene, motion, summary, **more)


def _kick(scene: Scene) -> str:
    """Return the warning of a kick that holds ψ̇, with the tilts of one that holds ω₃; or ''."""
    top, start = scene.top, scene.start
    kicked = start.held == "psidot" and "steady" not in dict(start.given)
    spins = start.spin.sign() and top.C.sign() and start.phidot.sign()
    if not (kicked and spins) or float(start.theta) in (0.0, math.pi):
        return ""
    rates = {name: getattr(start, name) for name in ("theta", "thetadot", "phidot")}
    other = Motion(top, State(**rates, omega3=start.spin))
    spin = f"{float(start.spin):.6g}"
    tilts = f"theta from {other.theta_min:.9g} to {other.theta_max:.9g} rad"
    return f"psidot = {spin} is held: a kick that holds omega3 = {spin} moves {tilts}"


def plan_scene(scene: Scene, *, formulation: str = "auto", digits: int | None = None) -> Planned:
    """Show how a scene would be integrated, why, and how long it would take.

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
    >>> plan_scene(load_scene("sicm-kicked", ['want.quantities=["theta"]'])).plan.states
    2
    """
    from heavytop.run.planning import plan, read_options

    read_options(scene, formulation=formulation, digits=digits)
    if digits is not None:
        scene = replace(scene, digits=digits)
    return Planned(scene=scene.document(), plan=plan_summary(plan(scene, formulation)))


def _bounds(motion: Motion, name: str) -> list[Any] | None:
    """Return proved decimal bounds of a number of the motion, a list of them of several numbers."""
    try:
        found = motion.interval(name, digits=BALL_DIGITS)
    except Unseparated:
        return None
    if isinstance(found, tuple):
        return [list(ball.bounds(BALL_DECIMALS)) for ball in found]
    return None if found is None else list(found.bounds(BALL_DECIMALS))


# --- in words --------------------------------------------------------------------------------


def verdict_facts(motion: Mapping[str, Any]) -> Iterator[Fact]:
    """Yield the kind of a motion, its tags, and why."""
    yield "kind", f"{motion['kind']}, {'' if motion['certified'] else 'not '}proved"
    for label, name in (("tags", "tags"), ("tags undecided", "open_tags")):
        if motion.get(name):
            yield label, ", ".join(motion[name])
    yield "why", motion["why"]


def course_facts(motion: Mapping[str, Any]) -> Iterator[Fact]:
    """Yield range of tilt, period, and means per period, as far as there are any."""
    theta, ends = quantity_of("theta"), [motion["theta_min"], motion["theta_max"]]
    if None not in ends:
        steady = ends[0] == ends[1]
        degrees = " to ".join(f"{math.degrees(end):.2f}°" for end in ends[steady:])
        tilts = theta.with_unit(*ends[steady:], between=" and ")
        label, constant = ("θ", ", constant") if steady else ("θ between", "")
        beside = "" if theta.shown[0] == "deg" else f" ({degrees})"
        yield label, f"{tilts}{beside}{constant}"
    yield from numbers(motion, "period", "precession", "spin", "round", "amplitude")


def estimate_facts(estimates: Mapping[str, Any]) -> Iterator[Fact]:
    """Yield textbook estimates for a fast top, with their errors."""
    for name, known in estimates.items():
        off = "" if known["error"] is None else f", off by {100 * known['error']:+.3g} %"
        of = quantity_of(ESTIMATED.get(name, name))
        estimate = of.with_unit(known["estimate"], form=".3g")
        yield "", f"fast-top estimate: {of.symbol} {estimate}{off}"


def rate_facts(facts: Mapping[str, Any]) -> Iterator[Fact]:
    """Yield the rates of a motion and the facts of `SHOWN_FACTS`."""
    yield from numbers(facts, "omega3")
    for rate in ("phidot", "psidot"):
        if ends := {facts[f"{rate}_min"], facts[f"{rate}_max"]} - {None}:
            yield quantity_of(rate).symbol, quantity_of(rate).with_unit(*sorted(ends))
    yield from numbers(facts, *SHOWN_FACTS)


def plan_facts(plan: Mapping[str, Any]) -> Iterator[Fact]:
    """Yield a plan: the equations, their precision, and the reasons."""
    how = [plan["formulation"]]
    if plan["states"]:
        tolerance = f"tolerance {float(plan['tolerance']):.3g}"
        how += [plan["precision"], f"{plan['states']} states", tolerance]
    yield "plan", ", ".join(how + ["projected"] * bool(plan["projected"]))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def numbers(values: Mapping[str, Any], *names: str) -> Iterator[Fact]:
    """Yield those quantities that have a value, with symbols and units."""
    for name in names:
        if values[name] is not None:
            yield quantity_of(name).symbol, quantity_of(name).with_unit(values[name])
