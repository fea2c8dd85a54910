"""What is known of a scene without integrating it: its motion, and how it would be integrated."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any, ClassVar, Final

from heavytop.analytic.facts import Facts, facts
from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.errors import Unseparated
from heavytop.results.base import Fact, Result
from heavytop.scene.quantities import QUANTITIES, Quantity, quantity_of
from heavytop.scene.scene import Scene
from heavytop.scene.state import State
from heavytop.text import duration

if TYPE_CHECKING:
    from heavytop.run.plan import Plan

COURSE: Final = ("theta_min", "theta_max", "period", "precession", "spin")
POLAR: Final = (Kind.PLANAR_PENDULUM, Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM)
"""Kinds whose axis does not go round the vertical but through it."""
ENCLOSED: Final = ("roots", *COURSE)
BALL_DIGITS: Final = 18  # of the balls around them
BALL_DECIMALS: Final = 22  # significant digits of the decimals around a ball
ENCLOSED_DIGITS: Final = 17  # of what is enclosed, for people
CONSTANTS: Final = ("E", "E_prime", "p_phi", "p_psi")
IN_RADIANS_A_SECOND, IN_SECONDS, WITHOUT_UNIT = (
    Quantity("", "rad/s"),
    Quantity("", "s"),
    Quantity("", ""),
)
FACTS: Final = (
    ("nutation", IN_RADIANS_A_SECOND, "{nutation_frequency}"),
    ("", WITHOUT_UNIT, "range of cos θ {nutation_amplitude}"),
    ("", WITHOUT_UNIT, "turns of φ per nutation: {rotation_number}"),
    ("small nutation", IN_RADIANS_A_SECOND, "{small_nutation_frequency} about this motion"),
    ("the other rate", IN_RADIANS_A_SECOND, "{other_precession_rate}{nods}"),
    ("a small tilt", IN_SECONDS, "grows by e in {growth_time}"),
    (
        "a small tilt",
        IN_RADIANS_A_SECOND,
        "precesses between {slow_cone_rate} and {fast_cone_rate}",
    ),
    ("sleep stable", IN_RADIANS_A_SECOND, "from |ω₃| = {sleeping_threshold} on"),
    ("p_ψ²/4A|gMR|", WITHOUT_UNIT, "{fast_top_ratio}"),
)
"""Of a classification: labels, what the numbers are, and words with the names of facts."""
ESTIMATE_WORDS: Final = {
    "precession": (IN_RADIANS_A_SECOND, "mean φ̇"),
    "period": (IN_SECONDS, "period"),
    "amplitude": (WITHOUT_UNIT, "range of cos θ"),
    "round": (IN_SECONDS, "once round in"),
}
"""Of a fast top: what textbooks estimate, and what it is."""


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
        yield from verdict_facts(self.motion)
        yield from course_facts(self.motion, self.enclosure)
        yield from numbers(self.constants, *CONSTANTS)
        yield from rate_facts(self.motion_facts)
        yield from estimate_facts(self.motion["estimates"])
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
        yield from plan_facts(self.plan)
        yield from (("warning", warning) for warning in self.plan.warnings)
        if self.plan.cost_s is not None and self.plan.states:
            yield "expected", f"{duration(self.plan.cost_s)} of steps"


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
        motion_facts=asdict(known),
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
        found = motion.interval(name, digits=BALL_DIGITS)
    except Unseparated:
        return None
    if isinstance(found, tuple):
        return [list(ball.bounds(BALL_DECIMALS)) for ball in found]
    return None if found is None else list(found.bounds(BALL_DECIMALS))


# --- in words --------------------------------------------------------------------------------


def verdict_facts(motion: Mapping[str, Any]) -> Iterator[Fact]:
    """The kind of a motion, its tags, and why."""
    yield "kind", f"{motion['kind']}, {'' if motion['certified'] else 'not '}proved"
    for label, name in (("tags", "tags"), ("tags undecided", "open_tags")):
        if motion.get(name):
            yield label, ", ".join(motion[name])
    yield "why", motion["why"]


def course_facts(
    motion: Mapping[str, Any], enclosure: Mapping[str, Any] | None = None
) -> Iterator[Fact]:
    """Range of tilt, period, and means per period, of those there are; as enclosed, if it is."""
    proved = {name: between(*x) for name, x in (enclosure or {}).items() if x and name != "roots"}
    values = {**motion, **proved}
    theta, ends = quantity_of("theta"), [values["theta_min"], values["theta_max"]]
    if None not in ends:
        steady = ends[0] == ends[1]
        degrees = " to ".join(f"{math.degrees(float(end)):.2f}°" for end in ends[steady:])
        aside = f" ({degrees})" if theta.shown[0] != "deg" else ""
        if steady:
            yield "θ", f"{theta.with_unit(ends[0])}{aside}, constant"
        else:
            yield "θ between", f"{theta.with_unit(*ends, between=' and ')}{aside}"
    yield from numbers(values, "period")
    if motion["kind"] == "planar-pendulum" and "swinging" in motion["tags"]:
        twice = IN_SECONDS.with_unit(2 * float(values["period"]))
        yield "", f"the swing there and back {twice}; φ jumps by π at the vertical"
    yield from numbers(values, "precession", "spin", "round", "amplitude")


def estimate_facts(estimates: Mapping[str, Any]) -> Iterator[Fact]:
    """What textbooks give for a fast top, with their errors."""
    for name, known in estimates.items():
        off = "" if known["error"] is None else f", off by {100 * known['error']:+.3g} %"
        quantity, words = ESTIMATE_WORDS[name]
        estimate = quantity.with_unit(known["estimate"], form=".3g")
        yield "", f"fast-top estimate: {words} {estimate}{off}"


def rate_facts(facts: Mapping[str, Any]) -> Iterator[Fact]:
    """The rates of a motion and what else follows from its closed form, in the words of `FACTS`."""
    yield from numbers(facts, "omega3")
    yield from _range(facts, "phidot", "mean_precession_rate")
    yield from _range(facts, "psidot", "mean_spin_rate")
    growth, about = facts["growth_rate"], facts["other_nutation_frequency"]
    known = {**facts, "growth_time": 1 / growth if growth else None}
    if facts["steady_branch"] is None:
        known["small_nutation_frequency"] = None
    nods = (
        ""
        if about is None
        else f", with a small nutation of {IN_RADIANS_A_SECOND.with_unit(about)}"
    )
    for label, quantity, words in FACTS:
        needed = {name: known[name] for name in known if f"{{{name}}}" in words}
        if None not in needed.values():
            texts = {name: quantity.with_unit(x) for name, x in needed.items()}
            yield label, words.format(**texts, nods=nods)


def _range(facts: Mapping[str, Any], name: str, mean: str) -> Iterator[Fact]:
    label, (low, high) = QUANTITIES[name].symbol, (facts[f"{name}_{end}"] for end in ("min", "max"))
    if low is None or high is None:
        return
    if low == high:
        yield label, IN_RADIANS_A_SECOND.with_unit(low)
        return
    text = IN_RADIANS_A_SECOND.with_unit(low, high)
    if facts[mean] is not None:
        text += f", mean {IN_RADIANS_A_SECOND.with_unit(facts[mean])}"
        if not low <= facts[mean] <= high:  # the angle jumps in passing a pole, and is counted so
            text += " with its jumps by π at the pole"
    yield label, text
    if facts[f"{name}_reverses"]:
        tilt = QUANTITIES["theta"].with_unit(facts[f"{name}_reversal_theta"])
        yield "", f"reverses at θ = {tilt}"


def between(low: str, high: str) -> str:
    """A number between two bounds, of 17 digits or as many as are certain to a unit of the last.

    Examples
    --------
    >>> between("0.09999999999999999999", "0.10000000000000000001"), between("0.1234", "0.1240")
    ('0.1', '0.124')
    """
    least, most = Decimal(low), Decimal(high)
    middle, radius = (least + most) / 2, (most - least) / 2
    last = middle.adjusted() - ENCLOSED_DIGITS + 1
    if radius:
        last = max(last, radius.adjusted() + 1)
    text = round(middle, -last).normalize()
    return f"{text:f}" if -6 < text.adjusted() < ENCLOSED_DIGITS else f"{text:e}"


def plan_facts(plan: Mapping[str, Any]) -> Iterator[Fact]:
    """A plan: the equations, their precision, and why."""
    how = [plan["formulation"]]
    if plan["states"]:
        tolerance = f"tolerance {float(plan['tolerance']):.3g}"
        how += [plan["precision"], f"{plan['states']} states", tolerance]
    yield "plan", ", ".join(how + ["projected"] * bool(plan["projected"]))
    for reason in plan["reasons"]:
        yield "", f"· {reason}"


def numbers(values: Mapping[str, Any], *names: str) -> Iterator[Fact]:
    """Quantities that have a value, by their symbols, with their units."""
    for name in names:
        if values[name] is not None:
            yield QUANTITIES[name].symbol, QUANTITIES[name].with_unit(values[name])
