"""Choose the least plan that gives what a scene wants, with reasons.

Nothing is integrated where the start alone gives the answer, or where the steps would take hours.
Otherwise the formulation follows from the angles that are wanted (`Need`) and from how near a pole
the axis comes. Plain doubles, projection or more bits follow from the digits and `CostModel`. After
a run that misses its digits `next_plan` goes one rung up.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import inf, log, log2, sqrt, tau
from typing import Any, Final

from heavytop.analytic.motion import Motion
from heavytop.equations.formulation import FORMULATIONS, why_not
from heavytop.errors import Fault, refuse
from heavytop.exact import PI
from heavytop.exact.decimals import DOUBLE, WORD, bits_of, least_bits, named
from heavytop.exact.pairs import EPSILON
from heavytop.run.estimates import DOUBLE_DIGITS, MOST_TURNS, PLAN_SPARE_BITS, CostModel
from heavytop.run.plan import Plan, Texts, closed_form_of, refusal, span, span_fault
from heavytop.scene.arguments import Range, Reader, drop_none, expect, one_of, parse_options
from heavytop.scene.quantities import QUANTITIES, Need, need_of
from heavytop.scene.scene import Scene
from heavytop.scene.scene_file import TABLES
from heavytop.text import duration

MOST_RATE: Final = 1e150  # rad/s, whose square is a double
MOST_BITS: Final = 131_072  # of the numbers that every step is taken in
LONG_FOR_LAGRANGE: Final = 100  # nutation periods
BESIDE_A_POLE: Final = 0.02  # rad, where a quadrature of psi takes shorter steps
PATIENCE_S: Final = 20.0  # the longest expected time of a run in more bits than doubles
ONTO: Final = "projected onto"
# Estimated errors, in units of the allowed one, at which a plan is tried all the same: most runs
# are better than the estimate.
PLAIN_HOPE: Final = 6.0  # in plain doubles; projection takes longer
HOPE: Final = 30.0  # projected; more bits take far longer
SURE_TURNS: Final = MOST_TURNS / 1000  # by the rates at the start, whatever the mean ones are
FEW_PERIODS: Final = 10  # periods, in which little phase is lost: projection does not help
LONG_S: Final = 60.0  # a longer run is warned of
MOST_S: Final = 3600.0  # of steps; beyond it nothing is integrated, and the closed form answers,
MANY_PERIODS: Final = 1e6  # if the span also has more periods than this

FORMULATION_OPTIONS: Final = {"auto": None, **FORMULATIONS}
PLAN_OPTIONS: Final[Mapping[str, Reader]] = {
    "formulation": one_of(FORMULATION_OPTIONS),
    "tolerance": Range(1e-20, 1e-2),  # of a step in doubles, relative
    "digits": TABLES["want"]["digits"],
}


def plan(
    scene: Scene,
    formulation: str = "auto",
    *,
    projected: bool = False,
    tolerance: float | None = None,
) -> Plan:
    """Return the plan for a scene.

    Parameters
    ----------
    scene : Scene
        What is to be run.
    formulation : str
        ``auto`` or the name of a formulation, as docs/formulations.md lists them.
    projected : bool
        Whether the state is put back onto the invariants of the start every few steps.
    tolerance : float, optional
        Relative error of a step in doubles, 1e-20 to 0.01; by default their rounding [1].

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
    Accuracy: ``tests/run/test_planning.py`` runs what auto plans for tops drawn at random, and
    none misses its digits; ``validation/11_random_tops.py`` does more of them.
    """
    return plan_motion(scene, closed_form_of(scene), formulation, projected, tolerance)


def plan_motion(
    scene: Scene,
    motion: Motion,
    formulation: str = "auto",
    projected: bool = False,
    tolerance: float | None = None,
) -> Plan:
    """Return the plan for a scene and its exact motion; the other parameters as in `plan`."""
    expect("projected", projected, bool)
    expect("formulation", formulation, str)
    options = read_options(scene, formulation=formulation, tolerance=tolerance)
    auto = formulation == "auto"
    if auto and need_of(scene.quantities) is Need.NOTHING:
        return _plan_nothing("class and period follow from it")
    expected = CostModel(scene, motion, span(scene, motion))
    name, why = formulation, f"{formulation}: asked for by name"
    if auto:
        name, why = _least_formulation(expected)
    refuse(_faults(expected, name))
    chosen = _choose_outputs(expected, name, why)
    if auto and not projected:
        chosen = choose_precision(expected, chosen)
        if expected.periods > MANY_PERIODS and chosen.seconds > MOST_S:
            time = duration(chosen.seconds)
            return _plan_nothing(f"the steps of {expected.periods:.3g} periods take {time}")
    else:
        bits = DOUBLE if scene.digits <= DOUBLE_DIGITS else expected.bits(name)
        chosen = _with_bits(expected, chosen, bits, projected)
    if tolerance is not None:
        if chosen.precision != "double":
            precision = f"{chosen.precision}, whose steps have their own tolerance"
            rule = f"{scene.digits} digits take {precision}"
            raise refusal(scene, "tolerance", str(options["tolerance"]), rule)
        reasons = (*chosen.reasons, f"tolerance {options['tolerance']:g}: asked for")
        chosen = replace(chosen, tolerance=options["tolerance"], reasons=reasons)
    return completed_plan(expected, chosen, auto=auto and not projected and tolerance is None)


def read_options(scene: Scene, **given: Any) -> dict[str, Any]:
    """Return the options of a plan, read from `given` (None left out), or raise BadScene."""
    known, wrong = parse_options(scene.name, drop_none(**given), PLAN_OPTIONS)
    refuse(wrong)
    return known


def completed_plan(expected: CostModel, chosen: Plan, **changes: Any) -> Plan:
    """Return a plan with changes, the reasons for its precision, and its warnings."""
    reasons = (*chosen.reasons, *_precision_reasons(expected.scene, chosen))
    warnings = (*chosen.warnings, *_warnings(expected, chosen))
    return replace(chosen, reasons=reasons, warnings=warnings, **changes)


def plan_steps(scene: Scene, formulation: str = "auto") -> Plan:
    """Return the plan for a scene that is integrated however long the steps take.

    Where auto would integrate nothing it is the least formulation, in doubles and projected.
    """
    chosen = plan(scene, formulation)
    return plan(scene, projected=True) if chosen.formulation == "none" else chosen


def _plan_nothing(why: str) -> Plan:
    """Return the plan that integrates nothing, because the closed form has the answer."""
    return Plan("none", reasons=(f"nothing is integrated, the closed form answers: {why}",))


# --- what a formulation cannot give ------------------------------------------------------------


def _faults(expected: CostModel, formulation: str) -> Iterator[Fault]:
    """Yield what the formulation or doubles cannot give: quantities, starts, rates, turns."""
    scene, motion, entry = expected.scene, expected.motion, FORMULATIONS[formulation]
    wants, massive = ", ".join(scene.quantities), scene.top.C != 0
    if missing := [q for q in scene.quantities if QUANTITIES[q].need > entry.gives]:
        rule = f"the {formulation} form does not give {', '.join(missing)}{_alternatives(expected)}"
        yield Fault(scene.name, None, "want.quantities", wants, rule)
    spun = [q for q in scene.quantities if QUANTITIES[q].need >= Need.PSI]
    if spun and not massive:
        rule = f"a point mass (C = 0) has no {' and no '.join(spun)}"
        yield Fault(scene.name, None, "want.quantities", wants, rule)
    if not (massive or entry.point_mass):
        rule = f"the {formulation} form divides by C, which is 0{_alternatives(expected)}"
        yield Fault(scene.name, None, "top.C", "0", rule)
    if not entry.starts_at_pole and _starts_at_pole(scene):
        rule = f"the {formulation} form cannot start at a pole{_alternatives(expected)}"
        yield Fault(scene.name, None, "start.theta", str(scene.start.theta), rule)
    through_both = motion.nutates and motion.from_top == motion.from_bottom == 0
    if "sigma" in entry.variants and through_both and expected.need >= Need.PSI:
        # psi jumps by whole turns that neither quadrature has
        rule = "the axis form does not give psi of an axis that passes through both poles"
        yield Fault(scene.name, None, "want.quantities", wants, f"{rule}; the attitude form does")
    r = expected.reduced
    rate = max(abs(r.a), abs(r.b), sqrt(2 * (r.kinetic0 + abs(r.g))))
    if rate > MOST_RATE:
        rule = f"rates of more than {MOST_RATE:g} rad/s, whose squares are not finite in doubles"
        yield Fault(scene.name, None, "start", "", rule)
    elif abs(expected.span) * (rate + abs(r.kappa)) > SURE_TURNS * tau:
        nodding = tau / motion.period if motion.period else 0.0
        fastest, most = max(nodding, *map(abs, motion.mean_angle_rates)), MOST_TURNS * tau
        if abs(expected.span) * fastest > most:
            most /= fastest
            yield span_fault(scene, f"at most {most:.3g} s: farther off, turns are not counted")


def _starts_at_pole(scene: Scene) -> bool:
    theta = scene.start.theta
    return 0 in (theta.sign(), (theta - PI).sign())


def _alternatives(expected: CostModel) -> str:
    """Return the end of a refusal: the formulations that can integrate the scene, if any can."""
    massive, upright = expected.scene.top.C != 0, _starts_at_pole(expected.scene)
    able = [
        name
        for name, each in FORMULATIONS.items()
        if each.gives >= expected.need and (massive or each.point_mass)
        if each.starts_at_pole or not upright
    ]
    return f": take {' or '.join(able)}" if able else ""


# --- the formulation ---------------------------------------------------------------------------


def _least_formulation(expected: CostModel) -> tuple[str, str]:
    """Return the least formulation that gives what a scene wants, and why."""
    scene, motion, near = expected.scene, expected.motion, expected.nearest
    wants, allowed = scene.quantities, 10.0**-scene.digits
    if expected.need <= FORMULATIONS["cubic"].gives:
        tilt = [name for name in wants if QUANTITIES[name].need is Need.TILT]
        only = f"only {' and '.join(tilt)} {'is' if tilt == ['theta'] else 'are'} wanted"
        height = min(near, near**2)  # whose error in the cubic is absolute: it sets the period
        if allowed * height >= expected.rounding:
            return "cubic", f"cubic: {only}, and it has two states and a quadratic right side"
        lost = f"{near:.1e} rad from a pole theta would lose digits in the cubic form"
        return "axis", f"axis: {only}, but {lost}"
    regular = scene.top.C != 0  # of a point mass there is no attitude
    beside_both = max(motion.nearest) < BESIDE_A_POLE
    if motion.nutates and expected.need >= Need.PSI and beside_both and regular:
        why = "beside both poles, and no quadrature of psi is smooth at both"
        return "attitude", f"attitude: {why}; its equations are regular there"
    if "attitude" in wants:
        begun = max(abs(float(x)) for x in (scene.start.phi, scene.start.psi))
        largest = begun + abs(expected.reduced.kappa * expected.span)
        if largest * EPSILON > allowed:
            return "attitude", f"attitude: it needs no angles, of up to {largest:.1e} rad"
    return "axis", "axis: quadratic, regular at the poles, and no angle grows in the state"


def _choose_outputs(expected: CostModel, name: str, why: str) -> Plan:
    """Return the plan of a formulation: its variant, mean rates, watched events and reasons."""
    scene, motion, need = expected.scene, expected.motion, expected.need
    entry, variant, reasons = FORMULATIONS[name], None, list[str]()
    rates: tuple[float, ...] = ()
    if "top" in entry.variants:
        variant = "top" if motion.from_top <= motion.from_bottom else "bottom"
        reasons = [f"heights from the {variant}, the nearer pole"]
    elif "angles" in entry.variants and entry.rates and need >= Need.AXIS:
        variant, rates = "angles", motion.mean_angle_rates
        reasons = ["phi and psi by quadrature, each less its mean rate"]
    elif "angles" in entry.variants and not entry.rates and need >= Need.PHI:
        variant = "angles"
        reasons = ["phi and psi from the quaternion, turns from the closed form"]
    elif "sigma" in entry.variants and need >= Need.PHI:
        variant, reasons = "phi", ["phi from the axis, its whole turns from the closed form"]
        if need >= Need.PSI:
            variant, reason = _quadrature(scene, motion)
            rates, reasons = (motion.mean_rates[variant == "delta"],), [reason, *reasons]
    watched, why_watched = _watched_events(scene, motion, expected.span)
    frame = tuple(zip(entry.rates, rates, strict=True)) if rates else ()
    states, reasons = entry.states + len(frame), [why, *reasons, *why_watched]
    return Plan(name, variant, frame, watched, states, reasons=(*reasons,))


def _quadrature(scene: Scene, motion: Motion) -> tuple[str, str]:
    """Return the quadrature of psi that is regular at the pole nearer to the axis, and why.

    Where both are equally near it is the one regular where V is lowest: a pole where V is highest
    may be approached without being passed.
    """
    aside = motion.from_bottom > motion.from_top
    if aside or (motion.from_bottom == motion.from_top and (scene.top.gMR.sign() or 0) <= 0):
        return "sigma", "psi: integral of (phi + psi)' minus its mean, regular at theta = 0"
    return "delta", "psi: integral of (phi - psi)', regular at the bottom, less its mean"


def _watched_events(scene: Scene, motion: Motion, end: float) -> tuple[Texts, Texts]:
    """Return the event functions that the integrator watches, and why these."""
    if not scene.events:
        return (), ("no events are requested, so none slow the loop",)
    if motion.regime.asymptotic:  # it comes from the vertical where V is highest, and returns
        no_period = "theta tends to the vertical: it has no period"
        leaving = (scene.start.thetadot.sign() or 0) * (scene.top.gMR.sign() or 0)
        if leaving * (1 if end >= 0 else -1) < 0:
            return (), (f"{no_period}, and no turning point is ahead",)
        return ("turning",), (f"{no_period}; found while integrating: the one turning point",)
    if not motion.nutates:
        return (), (f"{motion.kind}: theta is constant, and constant theta has no events",)
    regime, reason = motion.regime, "events found while integrating: turning"
    if "reversal" not in scene.events:
        return ("turning",), (reason,)
    if motion.doubt or regime.weightless or (regime.misses_top and regime.misses_bottom):
        return ("turning", "reversal"), (f"{reason}, reversal",)
    never = f"{motion.kind}: phidot does not change its sign between poles"
    return ("turning",), (never, reason)


# --- precision and projection ------------------------------------------------------------------


def choose_precision(expected: CostModel, chosen: Plan) -> Plan:
    """Return the plan with the least precision that is expected to give the scene's digits.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> ends = [CostModel(scene, Motion(scene.top, scene.start), t) for t in (2, 1e3)]
    >>> [choose_precision(expected, Plan("axis")).projected for expected in ends]
    [False, True]
    """
    digits, allowed = expected.scene.digits, 10.0**-expected.scene.digits
    if digits > DOUBLE_DIGITS:
        return _with_bits(expected, chosen, expected.bits(chosen.formulation))
    for projected, most in ((False, PLAIN_HOPE * allowed), (True, HOPE * allowed)):
        if expected.error(projected) <= most:
            return _with_bits(expected, chosen, DOUBLE, projected)
    return _raise_bits(expected, chosen, DOUBLE)


def next_plan(expected: CostModel, tried: Plan, factor: float, missed: str) -> Plan | None:
    """Return the plan one rung above one that missed its digits; None where there is none.

    Parameters
    ----------
    expected : CostModel
    tried : Plan
        What was run, of `completed_plan`.
    factor : float
        The error of its run in units of the allowed one; infinite where events are missed.
    missed : str
        What it missed, in words.
    """
    bits = bits_of(tried.precision)
    rung = "projected" if tried.projected else tried.precision
    kept = (x for x in tried.reasons if not x.startswith((ONTO, f"{tried.precision}:")))
    missed = f"{rung}: {missed}"
    better = replace(tried, tried=(*tried.tried, missed), warnings=(), reasons=(*kept,))
    if tried.formulation == "cubic" and bits == DOUBLE:  # its heights set the period
        regular = _choose_outputs(expected, "axis", "axis: the cubic form missed what is wanted")
        regular = choose_precision(expected, regular)
        return completed_plan(expected, regular, tried=better.tried, auto=True)
    projects = bits == DOUBLE and not (tried.projected or why_not(tried.equations))
    if projects and expected.periods > FEW_PERIODS:
        return completed_plan(expected, _with_bits(expected, better, DOUBLE, True))
    more = log2(factor) if 1 < factor < inf else WORD - PLAN_SPARE_BITS
    least = bits if bits == DOUBLE else bits + more + PLAN_SPARE_BITS
    further = _raise_bits(expected, better, least)
    return completed_plan(expected, further) if bits_of(further.precision) > bits else None


def _raise_bits(expected: CostModel, chosen: Plan, least: float) -> Plan:
    """Return the plan in as many bits as the digits take, but not fewer than `least`.

    Where that takes too long it is the plan in doubles, projected where that can be, and warned of.
    """
    lost = log2(expected.error(False)) + expected.scene.digits * log2(10)
    wanted = least_bits(max(DOUBLE + 1.0, DOUBLE + lost + PLAN_SPARE_BITS, least))
    seconds = expected.seconds(chosen.formulation, False, wanted)
    if seconds <= PATIENCE_S and wanted <= MOST_BITS:
        return _with_bits(expected, chosen, wanted)
    why = f"digits may be missed: {named(wanted)} would take {duration(seconds)}"
    kept = replace(chosen, warnings=(f"digits: {why}",))
    return _with_bits(expected, kept, DOUBLE, not why_not(chosen.equations))


def _with_bits(expected: CostModel, chosen: Plan, bits: int, projected: bool = False) -> Plan:
    """Return the plan in numbers of so many bits, with their tolerance and expected time."""
    return replace(
        chosen,
        precision=named(bits),
        tolerance=2.0 ** (1 - bits),
        projected=projected,
        seconds=expected.seconds(chosen.formulation, projected, bits),
    )


def _precision_reasons(scene: Scene, chosen: Plan) -> Iterator[str]:
    """Yield why a plan has more bits or projection; raise BadScene where it cannot have them."""
    bits = bits_of(chosen.precision)
    if bits > MOST_BITS:
        rule = f"over this span they take {bits:.3g} bits, and {MOST_BITS} are the most"
        raise refusal(scene, "want.digits", str(scene.digits), rule)
    if bits > DOUBLE:
        events = "events are looked for where the closed form has them"
        yield f"{chosen.precision}: for {scene.digits} digits at the end; {events}"
    if chosen.projected:
        rule = why_not(chosen.equations)
        if bits > DOUBLE:
            rule = f"only in double precision, and {scene.digits} digits take more"
        if rule:
            raise refusal(scene, "projected", "", rule)
        yield f"{ONTO} {', '.join(chosen.equations.invariants)} every few nutations"


def _warnings(expected: CostModel, chosen: Plan) -> Iterator[str]:
    """Yield what may go wrong: growing angles, rounding on a separatrix, a long integration."""
    motion, count = expected.motion, expected.periods
    if FORMULATIONS[chosen.formulation].grows and motion.nutates and count > LONG_FOR_LAGRANGE:
        yield (
            f"{count:.0f} nutation periods with phi and psi in the state: they grow, the step "
            "control follows them, and phase is lost as the cube of the time; use the axis form"
        )
    rate, bits = motion.growth, bits_of(chosen.precision)
    if rate is not None and (left := bits * log(2) / rate) < abs(expected.span):
        yield (
            f"separatrix: rounding errors grow as exp({rate:.3g} t) and carry the axis away from "
            f"the vertical at about t = {left:.3g} s; the exact axis never leaves it"
        )
    if chosen.seconds > LONG_S:
        yield f"long: about {duration(chosen.seconds)} in all"
