"""The least model that gives what a scene wants, and why."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

from heavytop.errors import BadScene, Fault
from heavytop.scene import Scene
from heavytop.theory.motion import Motion
from heavytop.top import State, Top

EPSILON = 2.0**-52
MOST_DIGITS = 13  # what double precision can promise at the end of a short run
LONG_FOR_LAGRANGE = 100  # nutation periods
FORMULATIONS = ("axis", "lagrange")
NEEDS_PHI = frozenset({"phi", "psi", "attitude"})
NEEDS_PSI = frozenset({"psi", "attitude"})


@dataclass(frozen=True, slots=True)
class Plan:
    """What will be integrated, and how.

    Attributes
    ----------
    formulation : str
    psi : str or None
        The quadrature that carries psi in the axis form, ``sigma`` or ``delta``.
    follows_phi : bool
        Whether the winding of phi is counted.
    frame_rate : float
        Rate subtracted from the quadrature, to keep it bounded [rad/s].
    watched : tuple of str
        Event functions in the integrator's loop.
    states : int
    precision : str
    tolerance : float
    reasons, warnings : tuple of str
    """

    formulation: str
    psi: str | None
    follows_phi: bool
    frame_rate: float
    watched: tuple[str, ...]
    states: int
    precision: str = "double"
    tolerance: float = EPSILON
    projected: bool = False
    folded: bool = False
    reasons: tuple[str, ...] = ()
    warnings: tuple[str, ...] = field(default=())


def plan(scene: Scene, formulation: str = "auto") -> Plan:
    """Return the plan for a scene.

    Parameters
    ----------
    scene : Scene
    formulation : str
        ``auto``, ``axis`` or ``lagrange``.

    Raises
    ------
    BadScene
        The scene wants what the formulation, or double precision, cannot give.

    Examples
    --------
    >>> from heavytop.scene import load_scene
    >>> plan(load_scene("sicm-kicked")).formulation
    'axis'
    """
    motion = closed_form_of(scene)
    chosen = "axis" if formulation == "auto" else formulation
    _check(scene, chosen)
    watched, why_events = _watched(scene, motion)
    if chosen == "lagrange":
        return _lagrange(scene, motion, watched, why_events)
    return _axis(scene, motion, watched, why_events)


def closed_form_of(scene: Scene) -> Motion:
    """Return the closed form of a scene's motion; the last few are remembered."""
    return _motion(scene.top, scene.start)


@lru_cache(maxsize=8)
def _motion(top: Top, start: State) -> Motion:
    return Motion(top, start)


def _check(scene: Scene, formulation: str) -> None:
    faults = []
    if formulation not in FORMULATIONS:
        rule = f"one of auto, {', '.join(FORMULATIONS)}"
        faults.append(Fault(scene.name, None, "formulation", formulation, rule))
    if scene.digits > MOST_DIGITS:
        rule = f"at most {MOST_DIGITS}: the integration is in double precision"
        faults.append(Fault(scene.name, None, "want.digits", str(scene.digits), rule))
    if formulation == "lagrange" and float(scene.start.theta) in (0.0, _PI):
        rule = "the lagrange form cannot start at a pole; the axis form can"
        faults.append(Fault(scene.name, None, "start.theta", str(scene.start.theta), rule))
    if faults:
        raise BadScene(tuple(faults))


_PI = 3.141592653589793


def _watched(scene: Scene, motion: Motion) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if not scene.events:
        return (), ("no events are wanted: the loop is not slowed by any",)
    if not motion.nutates:
        return (), (f"{motion.kind}: theta is constant, and constant theta has no events",)
    watched = ("turning", "reversal") if "reversal" in scene.events else ("turning",)
    return watched, (f"watched in the loop: {', '.join(watched)}",)


def _lagrange(scene: Scene, motion: Motion, watched: tuple[str, ...], why: tuple[str, ...]) -> Plan:
    periods = abs(span(scene, motion)) / motion.period if motion.period else 0.0
    warnings: tuple[str, ...] = ()
    if periods > LONG_FOR_LAGRANGE:
        warnings = (
            f"{periods:.0f} nutation periods with phi and psi in the state: they grow, the step "
            "control follows them, and phase is lost as the cube of the time; use the axis form",
        )
    return Plan(
        formulation="lagrange",
        psi=None,
        follows_phi=False,
        frame_rate=0.0,
        watched=watched,
        states=6,
        reasons=("lagrange: asked for by name", *why),
        warnings=warnings,
    )


def _axis(scene: Scene, motion: Motion, watched: tuple[str, ...], why: tuple[str, ...]) -> Plan:
    wants = frozenset(scene.quantities)
    reasons = ["axis: quadratic, regular at the poles, and no angle grows in the state"]
    psi = None
    if wants & NEEDS_PSI:
        psi, reason = _quadrature(motion)
        reasons.append(reason)
    follows_phi = bool(wants & NEEDS_PHI)
    if follows_phi:
        reasons.append("phi from the axis, its turns counted between bounds of its rate")
    return Plan(
        formulation="axis",
        psi=psi,
        follows_phi=follows_phi,
        frame_rate=motion.mean_rate(psi) if psi else 0.0,
        watched=watched,
        states=6 if psi else 5,
        reasons=(*reasons, *why),
    )


def _quadrature(motion: Motion) -> tuple[str, str]:
    if motion.from_bottom >= motion.from_top:
        return "sigma", "psi by quadrature of (phi + psi)', regular at the top, less its mean"
    return "delta", "psi by quadrature of (phi - psi)', regular at the bottom, less its mean"


def span(scene: Scene, motion: Motion) -> float:
    """Return the end time of a scene [s].

    Raises
    ------
    BadScene
        The span is in nutation periods, and nothing nutates.
    """
    if scene.time is not None:
        return float(scene.time)
    if motion.period is None:
        rule = f"no nutation period to count: {motion.kind}; give span.time in seconds"
        raise BadScene((Fault(scene.name, None, "span.periods", str(scene.periods), rule),))
    assert scene.periods is not None
    return float(scene.periods) * motion.period
