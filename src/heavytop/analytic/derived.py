"""Derived facts of one motion: rates and where they are extreme, means, stability, fast-top errors.

All are computed from the closed form at fifty digits or more, and rounded once.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeAlias

from heavytop.analytic.motion import Motion
from heavytop.analytic.theory import fast_top, sleeping, steady
from heavytop.analytic.theory.closed_form import Nodding, Steady
from heavytop.analytic.theory.fast_top import Estimate
from heavytop.analytic.theory.rates import Rate, Rates, means, rates
from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Number, vanishes
from heavytop.scene.arguments import expect, wrong_type
from heavytop.scene.state import State
from heavytop.scene.top import Top

Branch: TypeAlias = Literal["slow", "fast", "single"]

Known: TypeAlias = "dict[str, Any]"
"""Facts by name, in numbers of many digits."""


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
        What `theory.fast_top` estimates for the mean precession rate [rad/s], the period (of
        nutation or of small nodding) [s], and the amplitude of a top let go from rest.
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
    path = motion.exact.orbit
    reduced = motion.reduced.refined(path.ctx)
    both = rates(path, reduced)
    known: Known = {"omega3": motion.start.omega3}
    known |= {"sleeping_threshold": sleeping.threshold(motion.top)}
    if both is None:
        known |= _vertical(motion, reduced)
    else:
        known |= _rate("phidot", both.phidot) | _rate("psidot", both.psidot)
        if isinstance(path, Nodding):
            known |= _nutation(path, reduced)
        elif isinstance(path, Steady):
            known |= _precession(reduced, both)
    known |= _fast_top(reduced, known)
    if isinstance(path, Nodding) and both is not None:
        known |= _let_go(path, reduced, both.phidot)
    return Facts(**{name: _plain(value) for name, value in known.items()})


def _rate(name: str, rate: Rate) -> Known:
    """Extremes and reversal of one rate."""
    (least, below), (greatest, above) = rate.extremes
    theta = rate.reversal
    return {
        f"{name}_min": least,
        f"{name}_min_theta": below,
        f"{name}_max": greatest,
        f"{name}_max_theta": above,
        f"{name}_reverses": theta is not None,
        f"{name}_reversal_theta": theta,
    }


def _nutation(path: Nodding, reduced: Reduced) -> Known:
    """Means over a period, and the nutation itself."""
    precession, spin = means(path, reduced)
    circle = 2 * path.ctx.pi
    return {
        "mean_precession_rate": precession,
        "mean_spin_rate": spin,
        "rotation_number": precession * path.T / circle,
        "nutation_frequency": circle / path.T,
        "nutation_amplitude": path.roots.delta,
    }


def _precession(reduced: Reduced, both: Rates) -> Known:
    """What belongs to a steady tilt off the vertical."""
    own, spin = both.phidot(both.phidot.lower), both.psidot(both.psidot.lower)
    branch, other = _branch(reduced, own)
    nodding = steady.nodding(reduced, own)
    return {
        "mean_precession_rate": own,
        "mean_spin_rate": spin,
        "steady_branch": branch,
        "other_precession_rate": other,
        "small_nutation_frequency": nodding,
        "other_nutation_frequency": None if other is None else steady.nodding(reduced, other),
        "stable": bool(nodding > 0),
    }


def _branch(reduced: Reduced, own: Number) -> tuple[Branch | None, Number | None]:
    """Which of the steady rates the own one is, and the other."""
    slow, fast = steady.pair(reduced)
    if slow is None:  # free, and nothing spins: any rate is steady, or none but rest
        return None, None
    if fast is None:
        return "single", None
    is_slow = abs(own - slow) < abs(own - fast)
    other = fast if is_slow else slow
    if vanishes(reduced.ctx, abs(slow) - abs(fast), slow, fast):
        return "single", other
    return "slow" if is_slow else "fast", other


def _vertical(motion: Motion, reduced: Reduced) -> Known:
    """What belongs to an axis on the vertical, sleeping or hanging."""
    slow, fast = steady.pair(reduced)
    if slow is None:
        growth = sleeping.growth_rate(motion.top, motion.start.omega3)
        return {"stable": False, "growth_rate": growth}
    return {
        "stable": True,
        "small_nutation_frequency": steady.nodding(reduced, slow),
        "slow_cone_rate": slow,
        "fast_cone_rate": slow if fast is None else fast,
    }


def _fast_top(reduced: Reduced, known: Known) -> Known:
    """The estimates of precession and period, where there is something that they estimate."""
    found: Known = {"fast_top_ratio": fast_top.ratio(reduced)}
    if (rate := known.get("mean_precession_rate")) is not None:
        fast = known.get("steady_branch") == "fast"
        formula = fast_top.free_precession if fast else fast_top.precession
        names = "fast_top_precession_rate", "fast_top_precession_error"
        found |= _named(names, formula(reduced, rate))
    frequency = known.get("nutation_frequency") or known.get("small_nutation_frequency")
    if frequency:
        names = "fast_top_nutation_period", "fast_top_period_error"
        found |= _named(names, fast_top.period(reduced, 2 * reduced.ctx.pi / frequency))
    return found


def _let_go(path: Nodding, reduced: Reduced, phidot: Rate) -> Known:
    """The estimate of the amplitude, for a top that is at rest where it is highest."""
    tilt = phidot.upper if reduced.g < 0 else phidot.lower
    if phidot(tilt):
        return {}
    sin2 = tilt.above * tilt.below
    names = "fast_top_amplitude", "fast_top_amplitude_error"
    return _named(names, fast_top.amplitude(reduced, sin2, path.roots.delta))


def _named(names: tuple[str, str], estimate: Estimate | None) -> Known:
    return {} if estimate is None else dict(zip(names, estimate, strict=True))


def _plain(value: Any) -> Any:
    """A number of many digits as a float; anything else as it is."""
    return value if value is None or isinstance(value, bool | str) else float(value)
