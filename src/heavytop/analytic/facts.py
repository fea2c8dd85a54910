"""Facts that follow from the closed form: extremes and means of rates, stability, fast-top errors.

Both rates are offset + ½ [P/(1 + u) + Q/(1 − u)]: φ̇ with P₊, P₋ and no offset, ψ̇ with P₊, −P₋
and κ. Where P and Q are of one sign the terms add up, and between the poles the rate has one
extreme,

    tan²(θ/2) = √(Q/P),   offset ± ¼ (√|P| + √|Q|)²;

where they are not, it is monotonic in θ, and vanishes at most once: the other root
x = tan²(θ/2) of P x² + (4 offset + P + Q) x + Q = 0 is negative. So of φ̇ and ψ̇ only one can have
an extreme between the turning points, φ̇ where |p_φ| > |p_ψ| and ψ̇ where |p_φ| < |p_ψ|, and the
other alone can vanish there. (Where C ≤ 2A, ψ̇ does not vanish
beside its extreme; where C > 2A it may twice, and a zero between the turning points is given.)

For p_ψ² ≫ 4 A |gMR| textbooks give gMR/p_ψ for the mean precession or the slow steady rate,
p_ψ/(A cosθ) for the fast one, 2π A/p_ψ for the period of nutation, and 2 A gMR sin²θ₀/p_ψ² for
u₂ − u₁ of a top let go from rest at θ₀. Each comes with its error: at p_ψ²/(4 A gMR) = 6.25 and
θ₀ = 0.3 the amplitude is still 15 % too small. Facts are computed in balls, and rounded once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Final, TypeAlias

from flint import arb, ctx

from heavytop.analytic.constants import Constants
from heavytop.analytic.form import map_balls
from heavytop.analytic.motion import Motion
from heavytop.analytic.roots import TooFewBits
from heavytop.classification.reduced import Reduced
from heavytop.exact import sqrt
from heavytop.scene.arguments import expect, wrong_type
from heavytop.scene.state import State
from heavytop.scene.top import Top

Balls: TypeAlias = "dict[str, Any]"
"""Facts by name: balls of the working precision, texts, bools, or None."""

FACT_DIGITS: Final = 30  # of each fact, before it is rounded to a double
ZERO_BITS: Final = 4096  # precision from which on a ball that contains 0 is taken for 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """Facts that follow from the closed form of one motion; None where a fact does not exist.

    On the vertical only φ ± ψ is defined, and there are no facts about the rates of φ and ψ. A
    motion that tends to the vertical has limits of its rates as extremes, and no means.

    Attributes
    ----------
    omega3 : float
        Spin about the body's own axis, constant [rad/s].
    phidot_min, phidot_max, psidot_min, psidot_max : float or None
        Least and greatest rates of precession and of spin [rad/s]; at an exact pass through a pole
        their limits there.
    phidot_min_theta, phidot_max_theta, psidot_min_theta, psidot_max_theta : float or None
        The tilt at which each is taken [rad]; None where the rate is constant.
    phidot_reverses, psidot_reverses : bool or None
        Whether the rate changes its sign; it does not in a cusp.
    phidot_reversal_theta, psidot_reversal_theta : float or None
        The tilt at which it changes its sign [rad]; for φ̇ that is cosθ = p_φ/p_ψ.
    mean_precession_rate, mean_spin_rate : float or None
        Δφ/T and Δψ/T, or the constant rates of a steady motion [rad/s].
    rotation_number : float or None
        Δφ/2π per nutation [1].
    nutation_frequency : float or None
        2π/T [rad/s].
    nutation_amplitude : float or None
        Greatest less least cosθ [1].
    steady_branch : {"slow", "fast", "single"} or None
        Which of the two steady rates at its p_ψ and θ the motion has; "single" where there is only
        one, or both have one magnitude.
    other_precession_rate : float or None
        The other steady rate [rad/s].
    small_nutation_frequency : float or None
        Frequency of small nutations about a motion of constant θ [rad/s].
    other_nutation_frequency : float or None
        Frequency of small nutations about the other steady precession [rad/s].
    stable : bool or None
        Whether small nutations about a motion of constant θ stay small.
    growth_rate : float or None
        The rate at which a small θ grows, where sleeping is unstable [1/s].
    slow_cone_rate, fast_cone_rate : float or None
        Rates of precession of the smallest cones about an axis on the vertical [rad/s], the same
        twice where sleeping is marginal.
    sleeping_threshold : float or None
        The least |ω3| at which this top sleeps stably [rad/s]; None without gravity.
    fast_top_ratio : float or None
        p_ψ²/(4 A |gMR|) [1]; None without gravity.
    estimates : dict
        Formulas of the fast top for the mean "precession" rate [rad/s], the "period" of nutation or
        of small nutations [s], the "amplitude" in cosθ of a top let go from rest, and the "round"
        of the axis [s], where they apply: "estimate", "exact" and "error", estimate/exact − 1.

    Notes
    -----
    Accuracy: ``tests/analytic/test_facts.py`` holds extremes of rates and their tilts to an ulp,
    and means to 1e-10 of sums over the motion.

    References
    ----------
    Landau & Lifshitz, *Mechanics*, section 35; Goldstein, *Classical Mechanics*, section 5.7.
    """

    omega3: float
    phidot_min: float | None = None
    phidot_min_theta: float | None = None
    phidot_max: float | None = None
    phidot_max_theta: float | None = None
    phidot_reverses: bool | None = None
    phidot_reversal_theta: float | None = None
    psidot_min: float | None = None
    psidot_min_theta: float | None = None
    psidot_max: float | None = None
    psidot_max_theta: float | None = None
    psidot_reverses: bool | None = None
    psidot_reversal_theta: float | None = None
    mean_precession_rate: float | None = None
    mean_spin_rate: float | None = None
    rotation_number: float | None = None
    nutation_frequency: float | None = None
    nutation_amplitude: float | None = None
    steady_branch: str | None = None
    other_precession_rate: float | None = None
    small_nutation_frequency: float | None = None
    other_nutation_frequency: float | None = None
    stable: bool | None = None
    growth_rate: float | None = None
    slow_cone_rate: float | None = None
    fast_cone_rate: float | None = None
    sleeping_threshold: float | None = None
    fast_top_ratio: float | None = None
    estimates: dict[str, dict[str, float | None]] = field(default_factory=dict)


def facts(motion: Motion | Top, start: State | None = None) -> Facts:
    """The derived facts of a motion.

    Parameters
    ----------
    motion : Motion or Top
        The motion; or the top alone, and then
    start : State
        its start.

    Returns
    -------
    Facts

    Raises
    ------
    WrongType
        It is no Motion; a top without a start, or a motion with one.

    Examples
    --------
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> dropped = Motion(Top("3.28e-4", "6.6e-5", "0.0456"), State("0.1", psidot=140))
    >>> known = facts(dropped)
    >>> round(known.phidot_max, 11), round(known.psidot_min, 9)
    (9.87012987013, 130.291539463)
    >>> round(known.fast_top_ratio, 2), round(known.estimates["amplitude"]["error"], 2)
    (1.43, -0.69)

    Notes
    -----
    Accuracy: ``tests/analytic/test_facts.py`` holds extremes of rates and their tilts to an ulp,
    and means to 1e-10 of sums over the motion.

    References
    ----------
    Landau & Lifshitz, *Mechanics*, section 35; Goldstein, *Classical Mechanics*, section 5.7.
    """
    if isinstance(motion, Top):
        motion, start = Motion(motion, start), None  # type: ignore[arg-type]  # it refuses None
    expect("motion", motion, Motion, "Motion(scene.top, scene.start) is one")
    if start is not None:
        raise wrong_type("start", "only with a top, as a motion has its own", start)
    top, cusps = motion.top, motion.cusps
    found = map_balls(float, motion.refine("a fact", lambda c: _facts(c, cusps), FACT_DIGITS))
    if side := top.gMR.sign():
        least = 2 * sqrt(side * top.A * top.gMR)
        found["sleeping_threshold"] = float(least / top.C) if top.C.sign() else math.inf
    return Facts(omega3=float(motion.start.omega3), **found)


def _facts(c: Constants, cusps: bool) -> Balls:
    """All facts but ω₃ and the threshold of sleeping; one that is 0 is exactly 0."""
    vertical = c.regime.steady and bool(c.start.sin2.is_zero())
    found = _vertical_facts(c.start) if vertical else _rate_facts(c, cusps)
    if c.period is not None:
        circle = 2 * arb.pi()
        found |= {
            "mean_precession_rate": c.precession / c.period,
            "mean_spin_rate": c.spin / c.period,
            "rotation_number": c.precession / circle,
            "nutation_frequency": circle / c.period,
            "nutation_amplitude": c.delta,
        }
    elif c.regime.steady and not vertical:
        found |= _steady_facts(c.start, found["phidot_min"], found["psidot_min"])
    exact: Balls = map_balls(_ball_or_zero, found)
    exact |= map_balls(_ball_or_zero, _fast_top_facts(c, exact, cusps))
    return exact


def _rate_facts(c: Constants, cusps: bool) -> Balls:
    """Extremes and reversals of φ̇ and ψ̇; at an exact pass through a pole P± is exactly 0."""
    plus, minus = map(_ball_or_zero, c.P[:: c.side])
    tilts = c.tilts
    ends = tilts[:1] if c.regime.steady else tilts[:: -c.side]
    phidot = _rate_range("phidot", arb(0), plus, minus, ends, cusp=tilts[1] if cusps else None)
    return phidot | _rate_range("psidot", c.start.kappa, plus, -minus, ends)


def _rate_range(
    name: str, offset: arb, P: arb, Q: arb, ends: tuple[arb, ...], cusp: arb | None = None
) -> Balls:
    """Extremes and reversal of offset + ½ [P/(1 + u) + Q/(1 − u)] between tilts θ; 0 in a cusp."""

    def rate(theta: arb) -> arb:
        rise = P if P.is_zero() else P / (2 * (theta / 2).cos()) ** 2
        fall = Q if Q.is_zero() else Q / (2 * (theta / 2).sin()) ** 2
        return arb(0) if theta is cusp else offset + rise + fall

    tilts, reversal = [*ends], None
    if P * Q > 0 and ends[0] < (turning := 2 * (Q / P).root(4).atan()) < ends[-1]:
        tilts.append(turning)
    least, greatest = min(tilts, key=rate), max(tilts, key=rate)
    constant = len(ends) == 1 or (P.is_zero() and Q.is_zero())
    if least is greatest and not constant:
        raise TooFewBits(f"least and greatest {name}", rate(ends[0]) - rate(ends[-1]))
    if rate(least) < 0 < rate(greatest):
        half = (4 * offset + P + Q) / 2
        root = (half * half - P * Q).sqrt()
        x = -Q / (2 * half) if P.is_zero() else ((root if P > 0 else -root) - half) / P
        reversal = 2 * x.sqrt().atan()
        if P * Q > 0 and not ends[0] < reversal < ends[-1]:  # it vanishes twice, where C > 2A
            reversal = 2 * (Q / (P * x)).sqrt().atan()
    return {
        f"{name}_min": rate(least),
        f"{name}_min_theta": None if constant else least,
        f"{name}_max": rate(greatest),
        f"{name}_max_theta": None if constant else greatest,
        f"{name}_reverses": reversal is not None,
        f"{name}_reversal_theta": reversal,
    }


def _steady_facts(start: Reduced, own: arb, spin: arb) -> Balls:
    """Facts of a steady tilt off the vertical; the two rates at its tilt add up to b/u."""
    b, u = _ball_or_zero(start.b), _ball_or_zero(start.u0)
    free = b.is_zero() and start.g.is_zero()  # then every rate is steady, or rest alone
    other = None if free or u.is_zero() else b / u - own
    excess = arb(0) if other is None else _ball_or_zero(abs(own) - abs(other))
    if excess.is_zero() and not b.is_zero():  # one rate twice, not two opposite ones
        other = None
    branch = "slow" if excess < 0 else "fast" if excess > 0 else "single"
    frequency = _small_nutation(start, own)
    return {
        "mean_precession_rate": own,
        "mean_spin_rate": spin,
        "steady_branch": None if free else branch,
        "other_precession_rate": other,
        "small_nutation_frequency": frequency,
        "other_nutation_frequency": None if other is None else _small_nutation(start, other),
        "stable": bool(frequency > 0),
    }


def _small_nutation(start: Reduced, rate: arb) -> arb:
    """The frequency of small nutations, with gMR/AΩ by the steady equation as b − Ω u."""
    pull = start.b - rate * start.u0
    return _ball_or_zero(rate * rate + pull * pull - 2 * start.g * start.u0).sqrt()


def _vertical_facts(start: Reduced) -> Balls:
    """Facts of an axis on the vertical, sleeping or hanging."""
    b, g, u = _ball_or_zero(start.b), start.g, start.u0
    square = _ball_or_zero(b * b - 4 * g * u)
    if square < 0:
        return {"stable": False, "growth_rate": (-square).sqrt() / 2}
    if square.is_zero() and b.is_zero():
        return {"stable": False}
    root = square.sqrt()
    fast = (b + (-root if b < 0 else root)) / (2 * u)
    return {
        "stable": True,
        "small_nutation_frequency": root,
        "slow_cone_rate": b / u - fast,
        "fast_cone_rate": fast,
    }


def _fast_top_facts(c: Constants, exact: Balls, cusps: bool) -> Balls:
    """The textbooks' estimates, where they apply, each with the exact value and relative error."""
    g, b, circle = c.start.g, _ball_or_zero(c.start.b), 2 * arb.pi()
    if g.is_zero():
        return {}
    ratio = b * b / (4 * abs(g))
    if b.is_zero():
        return {"fast_top_ratio": ratio}
    rate = b / c.start.u0 if exact.get("steady_branch") == "fast" else g / b
    frequency = exact.get("nutation_frequency", exact.get("small_nutation_frequency"))
    precession = exact.get("mean_precession_rate")
    drop = 2 * abs(g) * (c.tilts[1].sin() / b) ** 2
    rows = (
        ("precession", rate, precession),
        ("period", circle / abs(b), _round_time(circle, frequency)),
        ("amplitude", drop, exact.get("nutation_amplitude") if cusps else None),
        ("round", circle / abs(rate), _round_time(circle, precession)),
    )
    estimates = {
        name: {"estimate": x, "exact": y, "error": None if y.is_zero() else x / y - 1}
        for name, x, y in rows
        if y is not None
    }
    return {"fast_top_ratio": ratio, "estimates": estimates}


def _round_time(circle: arb, rate: arb | None) -> arb | None:
    """The time of one turn at a rate; None without a rate, or at 0."""
    return None if rate is None or rate.is_zero() else circle / abs(rate)


def _ball_or_zero(x: arb) -> arb:
    """A ball without 0 in it, or exactly 0; `TooFewBits` where more bits can decide."""
    if not x.contains(0):
        return x
    if not x.is_zero() and (ctx.prec < ZERO_BITS or not x.is_finite()):
        raise TooFewBits("a fact and 0", x)
    return arb(0)
