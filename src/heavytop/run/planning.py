"""The least model that gives what a scene wants, and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import log, tau

from heavytop.analytic.motion import Motion
from heavytop.equations.formulation import FORMULATIONS
from heavytop.errors import BadScene, Fault
from heavytop.integration.bits import DOUBLE, named
from heavytop.integration.projection import why_not
from heavytop.names import LONGEST, nearest
from heavytop.numbers import PI
from heavytop.run.choice import KNOWN, Choice, choice, least_formulation, patience
from heavytop.run.digits import MOST_BITS, MOST_TURNS, bits_for
from heavytop.run.estimates import Estimate, estimate
from heavytop.scene.arguments import expect, shown
from heavytop.scene.scene import Scene, no_scene
from heavytop.scene.state import State
from heavytop.scene.top import Top
from heavytop.spelling import harmless

EPSILON = 2.0**-52
MOST_RATE = 1e150  # rad/s, whose square is a double
LONG_FOR_LAGRANGE = 100  # nutation periods
REVERSING = frozenset({"loops", "cusps", "waves", "force-free", "undecided"})  # as phidot may
OWN_STATES = {"routh": 2, "subsystem": 4}  # phi and psi not counted
Why = tuple[str, ...]
NEEDS_PHI = frozenset({"phi", "psi", "attitude"})
NEEDS_PSI = frozenset({"psi", "attitude"})
NEEDS_ANGLES = NEEDS_PHI | {"axis"}


@dataclass(frozen=True, slots=True)
class Plan:
    """What will be integrated, and how.

    Attributes
    ----------
    formulation : str
        Name of the equations; ``none`` where nothing has to be integrated.
    variant : str or None
        How the formulation has phi and psi: in the axis form psi by ``sigma`` or ``delta``, in
        the subsystem, Routh's and the attitude form both as ``angles``; in the cubic form the
        pole from which heights are measured.
    follows_phi : bool
        Whether the winding of phi is counted.
    frame : tuple of (str, float)
        Rates subtracted from quadratures, by parameter, to keep them bounded [rad/s].
    watched : tuple of str
        Event functions in the integrator's loop.
    states : int
        How many are integrated.
    precision : str
        ``double``, ``long double``, or the bits of a significand, as in ``256 bits``.
    tolerance : float
        Relative error tolerance of a step; 0 where it is smaller than any double.
    projected : bool
        Whether the state is put back onto its invariants between blocks of steps.
    folded : bool
        Whether half a nutation is integrated, for any time.
    reasons, warnings : tuple of str
        Why it is so, and what may disappoint, each in words.
    estimate : Estimate or None
        The time and the error that are expected.
    """

    formulation: str
    variant: str | None
    follows_phi: bool
    frame: tuple[tuple[str, float], ...]
    watched: tuple[str, ...]
    states: int
    precision: str = "double"
    tolerance: float = EPSILON
    projected: bool = False
    folded: bool = False
    reasons: tuple[str, ...] = ()
    warnings: tuple[str, ...] = field(default=())
    estimate: Estimate | None = None


def plan(scene: Scene, formulation: str = "auto", *, projected: bool = False) -> Plan:
    """Return the plan for a scene.

    Parameters
    ----------
    scene : Scene
        What is to be run.
    formulation : str
        ``auto`` or the name of a formulation: axis, attitude, cubic, routh, subsystem, lagrange.
    projected : bool
        Whether the state is put back onto the invariants of the start, between blocks of steps.

    Returns
    -------
    Plan
        The formulation, its precision and tolerance, with the reasons.

    Raises
    ------
    BadScene
        The scene wants what the formulation, or double precision, cannot give.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> plan(load_scene("sicm-kicked")).formulation
    'axis'

    Notes
    -----
    Accuracy: ``tests/two_ways/test_auto.py`` runs what auto plans for tops drawn at random, and
    none misses its digits; ``validation/17_auto.py`` does more of them.
    """
    motion = closed_form_of(scene)
    if not isinstance(formulation, str):
        raise BadScene(tuple(_unknown(scene, formulation)))
    expect("projected", projected, bool)
    chosen, why_this = formulation, f"{formulation}: asked for by name"
    if formulation == "auto":
        wanted = set(scene.quantities) - KNOWN
        end = span(scene, motion) if wanted else 0.0
        chosen, why_this = least_formulation(scene, motion, end)
    if chosen == "none":
        return Plan(
            "none", None, False, (), (), 0, reasons=(why_this,), estimate=Estimate(0.0, 0.0)
        )
    _check(scene, chosen)
    _in_range(scene, motion)
    end = span(scene, motion)
    _countable(scene, motion, end)
    watched, why_events = _watched(scene, motion, end)
    makers = {"lagrange": _lagrange, "axis": _axis, "attitude": _attitude, "cubic": _cubic}
    found = makers.get(chosen, _with_angles)(scene, motion, chosen, watched, why_events)
    found = replace(found, reasons=(why_this, *found.reasons))
    if formulation == "auto" and not projected:
        return _refined(scene, found, choice(scene, motion, end, chosen))
    bits = bits_for(scene.digits, motion, end, growing=chosen == "lagrange")
    expected = estimate(scene, motion, end, chosen, projected=projected, bits=bits)
    found = replace(found, estimate=expected)
    if bits > DOUBLE:
        found = _precise(scene, found, bits)
    told = (*leaving(motion, end, bits), *patience(scene, motion, expected))
    found = replace(found, warnings=(*found.warnings, *told))
    return _projected(scene, found) if projected else found


def _refined(scene: Scene, found: Plan, how: Choice) -> Plan:
    """Return the plan with the precision, projection or folding that was chosen."""
    if how.folded:
        whole = Plan("attitude", None, False, (), (), 6, folded=True, estimate=how.estimate)
        tolerance = 2.0 ** (1 - how.bits)
        return replace(whole, precision=named(how.bits), tolerance=tolerance, reasons=how.reasons)
    found = replace(found, estimate=how.estimate, reasons=(*found.reasons, *how.reasons))
    motion, end = closed_form_of(scene), span(scene, closed_form_of(scene))
    if how.bits > DOUBLE:
        found = _precise(scene, found, how.bits)
    elif how.estimate.error > 10.0**-scene.digits:
        found = replace(found, warnings=(*found.warnings, f"digits: {how.reasons[-1]}"))
    told = (*leaving(motion, end, how.bits), *patience(scene, motion, how.estimate))
    found = replace(found, warnings=(*found.warnings, *told))
    return _projected(scene, found) if how.projected else found


def leaving(motion: Motion, end: float, bits: int) -> Iterator[str]:
    """Say when rounding, which grows as exp(wt), has carried off an axis that nears a pole."""
    if motion.exact.growth is None:
        return
    rate = float(motion.exact.growth)
    left = bits * log(2) / rate
    if left < abs(end):
        yield (
            f"separatrix: rounding grows with exp({rate:.3g} t), and by it the axis "
            f"leaves the vertical's neighbourhood at about t = {left:.3g} s; it never would"
        )


def _in_range(scene: Scene, motion: Motion) -> None:
    """Refuse rates whose squares no double holds."""
    r = motion.reduced
    fastest = max(abs(r.a), abs(r.b), motion.exact.ctx.sqrt(2 * (r.kinetic0 + abs(r.g))))
    if fastest > MOST_RATE:
        nstr = motion.exact.ctx.nstr
        rule = f"rates of {nstr(fastest, 3)} rad/s, and {MOST_RATE:g} are the most"
        raise BadScene((Fault(scene.name, None, "start", "", rule),))


def _countable(scene: Scene, motion: Motion, end: float) -> None:
    """Refuse a span with more turns than are counted."""
    nodding = tau / motion.period if motion.period else 0.0
    fastest = max(nodding, *map(abs, motion.mean_angle_rates))
    if abs(end) * fastest > MOST_TURNS * tau:
        key, value = ("time", scene.time) if scene.periods is None else ("periods", scene.periods)
        rule = f"at most {MOST_TURNS * tau / fastest:.3g} s: farther off, turns are not counted"
        raise BadScene((Fault(scene.name, None, f"span.{key}", str(value), rule),))


def _precise(scene: Scene, found: Plan, bits: int) -> Plan:
    if bits > MOST_BITS:
        rule = f"over this span they take {bits:.3g} bits, and {MOST_BITS} are the most"
        raise BadScene((Fault(scene.name, None, "want.digits", str(scene.digits), rule),))
    events = "events are looked for where the closed form has them"
    reason = f"{named(bits)}: for {scene.digits} digits at the end; {events}"
    precise = replace(found, precision=named(bits), tolerance=2.0 ** (1 - bits))
    return replace(precise, reasons=(*found.reasons, reason))


def _projected(scene: Scene, found: Plan) -> Plan:
    form = FORMULATIONS[found.formulation].build(found.variant)
    rule = why_not(form)
    if found.precision != "double":
        rule = f"only in double precision, and {scene.digits} digits take more"
    if rule:
        raise BadScene((Fault(scene.name, None, "projected", "", rule),))
    reason = f"projected onto {', '.join(form.invariants)} every few nutations"
    return replace(found, projected=True, reasons=(*found.reasons, reason))


def closed_form_of(scene: Scene) -> Motion:
    """Return the closed form of a scene's motion; the last few are remembered.

    Raises
    ------
    BadScene
        It is no `Scene`, but a name, say.
    """
    if not isinstance(scene, Scene):
        raise no_scene(scene, "heavytop")
    return _motion(scene.top, scene.start)


@lru_cache(maxsize=8)
def _motion(top: Top, start: State) -> Motion:
    return Motion(top, start)


def _check(scene: Scene, formulation: str) -> None:
    faults = [*_unknown(scene, formulation)]
    if not faults:
        faults += [*_not_given(scene, formulation), *_at_a_pole(scene, formulation)]
        faults += _through_both_poles(scene, formulation)
    if faults:
        raise BadScene(tuple(faults))


def _unknown(scene: Scene, formulation: object) -> Iterator[Fault]:
    if not isinstance(formulation, str) or formulation not in FORMULATIONS:
        rule = f"one of auto, {', '.join(FORMULATIONS)}"
        hint = nearest(formulation, ("auto", *FORMULATIONS))
        is_text = isinstance(formulation, str)
        told = harmless(str(formulation)[:LONGEST]) if is_text else shown(formulation)
        yield Fault(scene.name, None, "formulation", told, rule, hint)


def _not_given(scene: Scene, formulation: str) -> Iterator[Fault]:
    missing = [q for q in scene.quantities if q not in FORMULATIONS[formulation].gives]
    if missing:
        lacks = f"the {formulation} form does not give {', '.join(missing)}"
        rule = f"{lacks}; the axis and the attitude form do"
        yield Fault(scene.name, None, "want.quantities", ", ".join(scene.quantities), rule)


def _at_a_pole(scene: Scene, formulation: str) -> Iterator[Fault]:
    at_pole = scene.start.theta.sign() == 0 or (scene.start.theta - PI).sign() == 0
    if at_pole and not FORMULATIONS[formulation].starts_at_pole:
        rule = f"the {formulation} form cannot start at a pole; axis, attitude and cubic can"
        yield Fault(scene.name, None, "start.theta", str(scene.start.theta), rule)


def _through_both_poles(scene: Scene, formulation: str) -> Iterator[Fault]:
    """Refuse psi in the axis form where it jumps by whole turns that neither quadrature has."""
    motion = closed_form_of(scene)
    through_both = motion.nutates and motion.from_top == motion.from_bottom == 0
    if formulation == "axis" and through_both and frozenset(scene.quantities) & NEEDS_PSI:
        rule = "the axis form does not give psi of an axis that passes through both poles"
        wants = ", ".join(scene.quantities)
        yield Fault(scene.name, None, "want.quantities", wants, f"{rule}; the attitude form does")


def _watched(scene: Scene, motion: Motion, end: float) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if not scene.events:
        return (), ("no events are wanted: the loop is not slowed by any",)
    if motion.regime == "asymptotic":
        return _watched_once(scene, end)
    if not motion.nutates:
        return (), (f"{motion.kind}: theta is constant, and constant theta has no events",)
    if "reversal" in scene.events and motion.kind in REVERSING:
        return ("turning", "reversal"), ("watched in the loop: turning, reversal",)
    why: Why = ("watched in the loop: turning",)
    if "reversal" in scene.events:
        why = (f"{motion.kind}: phidot does not change its sign between poles", *why)
    return ("turning",), why


def _watched_once(scene: Scene, end: float) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Watch for the one turning point of a motion that tends to the vertical, if it is to come.

    It comes to the vertical in which V is highest, and from there, and turns in between.
    """
    no_period = "theta tends to the vertical: it has no period"
    leaving = (scene.start.thetadot.sign() or 0) * (scene.top.gMR.sign() or 0)
    if leaving * (1 if end >= 0 else -1) < 0:
        return (), (f"{no_period}, and no turning point is ahead",)
    return ("turning",), (f"{no_period}; watched in the loop: turning, of which there is one",)


def _lagrange(
    scene: Scene, motion: Motion, formulation: str, watched: tuple[str, ...], why: Why
) -> Plan:
    periods = abs(span(scene, motion)) / motion.period if motion.period else 0.0
    warnings: tuple[str, ...] = ()
    if periods > LONG_FOR_LAGRANGE:
        warnings = (
            f"{periods:.0f} nutation periods with phi and psi in the state: they grow, the step "
            "control follows them, and phase is lost as the cube of the time; use the axis form",
        )
    return Plan(
        formulation=formulation,
        variant=None,
        follows_phi=False,
        frame=(),
        watched=watched,
        states=6,
        reasons=why,
        warnings=warnings,
    )


def _with_angles(
    scene: Scene, motion: Motion, formulation: str, watched: tuple[str, ...], why: Why
) -> Plan:
    carried = bool(frozenset(scene.quantities) & NEEDS_ANGLES)
    variant = "angles" if carried else None
    reasons: list[str] = []
    frame: tuple[tuple[str, float], ...] = ()
    if carried:
        reasons.append("phi and psi by quadrature, each less its mean rate")
        frame = tuple(zip(("phi_rate", "psi_rate"), motion.mean_angle_rates, strict=True))
    return Plan(
        formulation=formulation,
        variant=variant,
        follows_phi=False,
        frame=frame,
        watched=watched,
        states=OWN_STATES[formulation] + 2 * carried,
        reasons=(*reasons, *why),
    )


def _cubic(
    scene: Scene, motion: Motion, formulation: str, watched: tuple[str, ...], why: Why
) -> Plan:
    pole = "top" if motion.from_top <= motion.from_bottom else "bottom"
    return Plan(
        formulation=formulation,
        variant=pole,
        follows_phi=False,
        frame=(),
        watched=watched,
        states=2,
        reasons=(f"heights from the {pole}, the nearer pole", *why),
    )


def _axis(
    scene: Scene, motion: Motion, formulation: str, watched: tuple[str, ...], why: Why
) -> Plan:
    wants = frozenset(scene.quantities)
    reasons: list[str] = []
    variant = None
    if wants & NEEDS_PSI:
        variant, reason = _quadrature(motion, scene.top)
        reasons.append(reason)
    follows_phi = bool(wants & NEEDS_PHI)
    if follows_phi:
        reasons.append("phi from the axis, its turns counted between bounds of its rate")
    return Plan(
        formulation=formulation,
        variant=variant,
        follows_phi=follows_phi,
        frame=(("frame_rate", motion.mean_rate(variant)),) if variant else (),
        watched=watched,
        states=6 if variant else 5,
        reasons=(*reasons, *why),
    )


def _attitude(
    scene: Scene, motion: Motion, formulation: str, watched: tuple[str, ...], why: Why
) -> Plan:
    reasons: list[str] = []
    counted = bool(frozenset(scene.quantities) & NEEDS_PHI)
    if counted:
        reasons.append("phi and psi from the quaternion, whose turns are counted")
    return Plan(
        formulation=formulation,
        variant="angles" if counted else None,
        follows_phi=False,
        frame=(),
        watched=watched,
        states=6,
        reasons=(*reasons, *why),
    )


def _quadrature(motion: Motion, top: Top) -> tuple[str, str]:
    """The quadrature regular at the pole that is passed; one where V is highest is only neared."""
    aside = motion.from_bottom > motion.from_top
    if aside or (motion.from_bottom == motion.from_top and (top.gMR.sign() or 0) <= 0):
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
