"""Derived facts of one motion: rates and their extremes, means, stability, fast-top errors.

Both rates are offset + ½ [P/(1 + u) + Q/(1 − u)]: φ̇ with P₊, P₋ and no offset, ψ̇ with P₊, −P₋
and κ. Where P and Q are of one sign the terms add up, and between the poles the rate has one
extreme,

    tan²(θ/2) = √(Q/P),   offset ± ¼ (√|P| + √|Q|)²;

where they are not, it is monotonic in θ, and vanishes at most once: the other root
x = tan²(θ/2) of P x² + (4 offset + P + Q) x + Q = 0 is negative. So of φ̇ and ψ̇ only one can have
an extreme between the turning points, φ̇ where |p_φ| > |p_ψ| and ψ̇ where |p_φ| < |p_ψ|, and the
other alone can vanish there. (That ψ̇ has no zeros besides its extreme is C ≤ 2A.)

For p_ψ² ≫ 4 A |gMR| textbooks give gMR/p_ψ for the mean precession or the slow steady rate,
p_ψ/(A cosθ) for the fast one, 2π A/p_ψ for the period of nutation, and 2 A gMR sin²θ₀/p_ψ² for
u₂ − u₁ of a top let go from rest at θ₀. Each comes with its error: at p_ψ²/(4 A gMR) = 6.25 the
amplitude is still 15 % too small.

A motion's facts are computed in balls, at rising precision, and rounded once.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal, NamedTuple, TypeAlias

from flint import arb, ctx

from heavytop.analytic.closed_form import midpoint
from heavytop.analytic.cubic import TooFewBits
from heavytop.analytic.motion import Motion
from heavytop.analytic.solution import Nutating, Solution, Steady
from heavytop.analytic.steady import sleeping_threshold
from heavytop.classification.reduced import Reduced
from heavytop.numbers.decimals import context
from heavytop.scene.arguments import expect, wrong_type
from heavytop.scene.state import State
from heavytop.scene.top import Top

Branch: TypeAlias = Literal["slow", "fast", "single"]
Known: TypeAlias = "dict[str, Any]"

_DIGITS: Final = 30  # of each fact, before it is rounded to a double
_ZERO_BITS: Final = 4096  # a ball of so many bits that contains 0 is taken for 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """What follows from the closed form of one motion; None where a fact does not exist.

    On the vertical φ and ψ are not defined apart, and nothing is said of their rates. A motion
    that tends to the vertical has its rates there as bounds, and no means.

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
        The tilt at which it does [rad]; for φ̇ that is cosθ = p_φ/p_ψ.
    mean_precession_rate, mean_spin_rate : float or None
        Δφ/T and Δψ/T, or the constant rates of a steady motion [rad/s].
    rotation_number : float or None
        Δφ/2π per nutation.
    nutation_frequency : float or None
        2π/T [rad/s].
    nutation_amplitude : float or None
        Greatest less least cosθ.
    steady_branch : {"slow", "fast", "single"} or None
        Which of the steady rates at its p_ψ and θ the motion has; "single" where there is one
        only, or both are of one magnitude.
    other_precession_rate : float or None
        The other of them [rad/s].
    small_nutation_frequency : float or None
        Of small nodding about a motion of constant θ [rad/s].
    other_nutation_frequency : float or None
        Of small nodding about the other steady precession [rad/s].
    stable : bool or None
        Whether small nodding about a motion of constant θ stays small.
    growth_rate : float or None
        At which a small θ grows, where sleeping is unstable [1/s].
    slow_cone_rate, fast_cone_rate : float or None
        Rates of precession of the smallest cones about an axis on the vertical [rad/s], the same
        twice where sleeping is marginal.
    sleeping_threshold : float or None
        The least |ω3| at which this top sleeps stably [rad/s]; None without gravity.
    fast_top_ratio : float or None
        p_ψ²/(4 A |gMR|); None without gravity.
    fast_top_precession_rate, fast_top_nutation_period, fast_top_amplitude : float or None
        What the formulas of the fast top give for the mean precession rate [rad/s], the period
        (of nutation or of small nodding) [s], and the amplitude of a top let go from rest.
    fast_top_precession_error, fast_top_period_error, fast_top_amplitude_error : float or None
        estimate/truth − 1.

    Notes
    -----
    Accuracy: ``tests/analytic/test_rates.py`` holds extremes of rates and their tilts to an ulp,
    ``tests/analytic/test_facts.py`` means to 1e-10 of sums over the motion.

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
    steady_branch: Branch | None = None
    other_precession_rate: float | None = None
    small_nutation_frequency: float | None = None
    other_nutation_frequency: float | None = None
    stable: bool | None = None
    growth_rate: float | None = None
    slow_cone_rate: float | None = None
    fast_cone_rate: float | None = None
    sleeping_threshold: float | None = None
    fast_top_ratio: float | None = None
    fast_top_precession_rate: float | None = None
    fast_top_precession_error: float | None = None
    fast_top_nutation_period: float | None = None
    fast_top_period_error: float | None = None
    fast_top_amplitude: float | None = None
    fast_top_amplitude_error: float | None = None

    def document(self) -> dict[str, float | bool | str | None]:
        """The facts by name, as JSON holds them: None for what does not exist or is no double."""
        too_large = (math.inf, -math.inf)
        return {name: None if fact in too_large else fact for name, fact in asdict(self).items()}


def facts(motion: Motion | Top, start: State | None = None) -> Facts:
    """The derived facts of a motion.

    Parameters
    ----------
    motion : Motion or Top
        What spins and how it starts; or the top alone, and then
    start : State
        how it starts.

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
    >>> round(known.fast_top_ratio, 2), round(known.fast_top_amplitude_error, 2)
    (1.43, -0.69)

    Notes
    -----
    Accuracy: ``tests/analytic/test_rates.py`` holds extremes of rates and their tilts to an ulp,
    ``tests/analytic/test_facts.py`` means to 1e-10 of sums over the motion.

    References
    ----------
    Landau & Lifshitz, *Mechanics*, section 35; Goldstein, *Classical Mechanics*, section 5.7.
    """
    if isinstance(motion, Top):
        motion, start = Motion(motion, start), None  # type: ignore[arg-type]  # it refuses None
    expect("motion", motion, Motion, "Motion(scene.top, scene.start) is one")
    if start is not None:
        raise wrong_type("start", "only with a top, as a motion has its own", start)
    cusps = motion.rising.cusps
    known = motion.rising.settled(
        "a fact", lambda found, _: _known(found, cusps), _DIGITS,
        size=lambda x: abs(x.mid()), of=_balls,
    )  # fmt: skip
    plain = {name: _plain(value) for name, value in known.items()}
    threshold = sleeping_threshold(motion.top)
    return Facts(omega3=float(motion.start.omega3), sleeping_threshold=threshold, **plain)


def _known(found: Solution, cusps: bool) -> Known:
    """The facts by name, in balls of the working precision; what is 0 is exactly 0."""
    start, path = found.start, found.path
    if isinstance(path, Steady) and start.sin2.is_zero():
        return _with_fast_top(start, _vertical(start))
    phidot, psidot = _rates(found, cusps)
    known = _extremes("phidot", phidot) | _extremes("psidot", psidot)
    if isinstance(path, Nutating):
        known = _with_fast_top(start, known | _nutation(found, path))
        return known if phidot.cusp is None else known | _let_go(start, phidot.cusp, path)
    if isinstance(path, Steady):
        known |= _precession(start, phidot(phidot.lower), psidot(psidot.lower))
    return _with_fast_top(start, known)


class Tilt(NamedTuple):
    """A tilt by √(1 − u) and √(1 + u), each to its own digits."""

    from_top: arb
    from_bottom: arb

    @property
    def theta(self) -> arb:
        """θ [rad]."""
        return 2 * arb.atan2(self.from_top, self.from_bottom)

    def above(self, other: Tilt) -> bool:
        """Whether it is nearer to θ = 0."""
        return bool(self.from_top * other.from_bottom < other.from_top * self.from_bottom)


class _Rate(NamedTuple):
    """One of the rates φ̇ and ψ̇ [rad/s], as a function of the tilt between two tilts.

    `offset`, `plus` and `minus` are 0 and P±, or κ and ±P± [s⁻¹]; `lower` is the smaller θ; at
    `cusp` the rate is known to be 0.
    """

    offset: arb
    plus: arb
    minus: arb
    lower: Tilt
    upper: Tilt
    steady: bool
    cusp: Tilt | None = None

    def __call__(self, tilt: Tilt) -> arb:
        """The rate at one tilt; at a pole that is passed its limit, which both sides share."""
        if tilt is self.cusp:
            return arb(0)
        rise = arb(0) if self.plus.is_zero() else self.plus / (2 * tilt.from_bottom**2)
        fall = arb(0) if self.minus.is_zero() else self.minus / (2 * tilt.from_top**2)
        return _or_zero(self.offset + rise + fall)

    @property
    def constant(self) -> bool:
        """Whether it is the same at all times."""
        return self.steady or (self.plus.is_zero() and self.minus.is_zero())

    @property
    def extremes(self) -> tuple[Tilt, Tilt]:
        """Where the rate is least and where it is greatest; if taken twice, at its smaller θ."""
        least = greatest = self.lower
        tilts = [self.upper]
        if self.plus * self.minus > 0:
            p, q = abs(self.plus).sqrt(), abs(self.minus).sqrt()
            turning = Tilt((2 * q / (p + q)).sqrt(), (2 * p / (p + q)).sqrt())
            if self.lower.above(turning) and turning.above(self.upper):
                tilts = [turning, self.upper]
        for tilt in tilts:
            if self(tilt) < self(least):
                least = tilt
            if self(tilt) > self(greatest):
                greatest = tilt
        return least, greatest

    @property
    def reversal(self) -> arb | None:
        """The θ [rad] at which it changes its sign; None where it keeps it, cusps included."""
        P, Q = self.plus, self.minus
        if not self(self.lower) * self(self.upper) < 0:
            return None
        half = (4 * self.offset + P + Q) / 2
        root = (half * half - P * Q).sqrt()  # P Q ≤ 0: nothing cancels
        larger = -half - (root if half > 0 else -root)
        x = Q / larger if Q * larger > 0 else larger / P
        return 2 * x.sqrt().atan()


def _rates(found: Solution, cusps: bool) -> tuple[_Rate, _Rate]:
    """The rates φ̇ and ψ̇, on an axis that tends to the vertical up to their limits there."""
    start, regime, mirrored = found.start, found.regime, found.side < 0
    passes_top = not (regime.misses_bottom if mirrored else regime.misses_top)
    passes_bottom = not (regime.misses_top if mirrored else regime.misses_bottom)
    plus = arb(0) if passes_bottom else _or_zero(start.P_plus)
    minus = arb(0) if passes_top else _or_zero(start.P_minus)
    lower, upper = (Tilt(*place) for place in reversed(found.path.turnings))
    if mirrored:
        lower, upper = Tilt(*reversed(upper)), Tilt(*reversed(lower))
    steady, kappa = isinstance(found.path, Steady), _or_zero(start.kappa)
    highest = upper if mirrored else lower
    return (
        _Rate(arb(0), plus, minus, lower, upper, steady, highest if cusps else None),
        _Rate(kappa, plus, -minus, lower, upper, steady),
    )


def _extremes(name: str, rate: _Rate) -> Known:
    """Extremes and reversal of one rate."""
    least, greatest = rate.extremes
    theta = rate.reversal
    return {
        f"{name}_min": rate(least),
        f"{name}_min_theta": None if rate.constant else least.theta,
        f"{name}_max": rate(greatest),
        f"{name}_max_theta": None if rate.constant else greatest.theta,
        f"{name}_reverses": theta is not None,
        f"{name}_reversal_theta": theta,
    }


def _nutation(found: Solution, path: Nutating) -> Known:
    """Means over a period, jumps at passes through a pole included, and the nutation itself."""
    plus, minus = path.turns
    turned = _or_zero(plus + minus)
    spun = _or_zero(found.start.kappa * path.period + found.side * (plus - minus))
    circle = 2 * arb.pi()
    return {
        "mean_precession_rate": turned / path.period,
        "mean_spin_rate": spun / path.period,
        "rotation_number": turned / circle,
        "nutation_frequency": circle / path.period,
        "nutation_amplitude": path.roots.delta,
    }


def _precession(start: Reduced, own: arb, spin: arb) -> Known:
    """What belongs to a steady tilt off the vertical."""
    slow, fast = steady_pair(start)
    branch: Branch | None = None  # free, and nothing spins: any rate is steady, or none but rest
    other = None
    if slow is not None:
        branch = "single"
        if fast is not None:
            is_slow = abs(own - slow) < abs(own - fast)
            other = fast if is_slow else slow
            if not _or_zero(start.b).is_zero():  # else they are opposite
                branch = "slow" if is_slow else "fast"
    frequency = small_nutation(start, own)
    return {
        "mean_precession_rate": own,
        "mean_spin_rate": spin,
        "steady_branch": branch,
        "other_precession_rate": other,
        "small_nutation_frequency": frequency,
        "other_nutation_frequency": None if other is None else small_nutation(start, other),
        "stable": bool(frequency > 0),
    }


def _vertical(start: Reduced) -> Known:
    """What belongs to an axis on the vertical, sleeping or hanging."""
    slow, fast = steady_pair(start)
    if slow is None:
        growth = _or_zero(4 * abs(start.g) - start.b * start.b).sqrt() / 2
        return {"stable": False, "growth_rate": None if growth.is_zero() else growth}
    return {
        "stable": True,
        "small_nutation_frequency": small_nutation(start, slow),
        "slow_cone_rate": slow,
        "fast_cone_rate": slow if fast is None else fast,
    }


def steady_pair(start: Reduced) -> tuple[arb | None, arb | None]:
    """The slow and the fast rate Ω [rad/s] at the tilt and the p_ψ of a motion, in balls.

    Both None where p_ψ² < 4 A gMR cosθ; one rate and None where there is one only, at θ = π/2 or
    where both are the same. At p_ψ = 0 they are equal and opposite.
    """
    b, u = _or_zero(start.b), _or_zero(start.u0)
    square = _or_zero(b * b - 4 * start.g * u)
    if square < 0:
        return None, None
    larger = b + (-square.sqrt() if b < 0 else square.sqrt())  # no cancellation
    if larger.is_zero():
        return None, None
    one = square.is_zero() or u.is_zero()
    return 2 * start.g / larger, None if one else larger / (2 * u)


def small_nutation(start: Reduced, rate: arb) -> arb:
    """The frequency ω [rad/s] of small nodding about a steady precession, or about the vertical.

    ω² = Ω² + r² − 2 (gMR/A) cosθ as a sum of squares, with r = gMR/AΩ taken from the steady
    equation as p_ψ/A − Ω cosθ, which serves without gravity and without precession as well.
    """
    pull = start.b - rate * start.u0
    from_highest = start.one_plus_u0 if start.g < 0 else start.one_minus_u0
    apart = abs(rate) - abs(pull)
    return _or_zero(apart * apart + 2 * abs(start.g) * from_highest).sqrt()


def _with_fast_top(start: Reduced, known: Known) -> Known:
    """The facts, and the estimates of precession and period where they estimate something."""
    g, b = start.g, _or_zero(start.b)
    if g.is_zero():
        return known
    known = known | {"fast_top_ratio": b * b / (4 * abs(g))}
    if b.is_zero():
        return known
    if (rate := known.get("mean_precession_rate")) is not None:
        fast = known.get("steady_branch") == "fast"
        value = b / start.u0 if fast else g / b
        known |= _estimate("precession_rate", "precession_error", value, rate)
    frequency = known.get("nutation_frequency", known.get("small_nutation_frequency"))
    if frequency is not None and not frequency.is_zero():
        circle = 2 * arb.pi()
        known |= _estimate("nutation_period", "period_error", circle / abs(b), circle / frequency)
    return known


def _let_go(start: Reduced, highest: Tilt, path: Nutating) -> Known:
    """The estimate of the amplitude, for a top that is at rest where it is highest."""
    b = _or_zero(start.b)
    if start.g.is_zero() or b.is_zero():
        return {}
    value = 2 * abs(start.g) * (highest.from_top * highest.from_bottom / b) ** 2
    return _estimate("amplitude", "amplitude_error", value, path.roots.delta)


def _estimate(name: str, error: str, value: arb, true: arb) -> Known:
    """An estimate, and its error estimate/truth − 1; None where the truth is 0."""
    off = None if true.is_zero() else _or_zero(value / true - 1)
    return {f"fast_top_{name}": value, f"fast_top_{error}": off}


def _or_zero(x: arb) -> arb:
    """A ball without 0 in it, or 0 itself; TooFewBits where so many bits cannot tell."""
    if not x.contains(0):
        return x
    if not x.is_zero() and (ctx.prec < _ZERO_BITS or not x.is_finite()):
        raise TooFewBits("a fact and 0", x)
    return arb(0)


def _balls(known: Known) -> tuple[arb, ...]:
    return tuple(value for value in known.values() if isinstance(value, arb))


def _plain(value: Any) -> Any:
    """A ball as the nearest float; anything else as it is."""
    return float(midpoint(context(_DIGITS), value)) if isinstance(value, arb) else value
