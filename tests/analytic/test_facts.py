"""Facts of a motion: published values, extremes of rates, means, the fast top's formulas, JSON."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic.facts import Facts

from ..by_hand import ByHand
from ..motions import BOOK, CONE, SCENES, SIMO_WONG, TWO, WEIGHTLESS, shipped

UPSIDE_DOWN = ht.Top(2, 1, -3)
UNIT = ht.Top(1, "0.5", 1)
DISC = ht.Top(1, 2, 1)


def of(top, **start):
    return ht.facts(top, ht.State(**start))


def of_scene(name):
    motion = shipped(name)
    return ht.facts(motion.top, motion.start)


def test_the_kicked_and_the_dropped_top():
    """SICM §2.10: T = 0.54289551818821995785, Δφ = 3.9741816546440002896; ψ̇ 140 → 114.35."""
    known = of_scene("sicm-kicked")
    T, turn = 0.54289551818821995785, 3.9741816546440002896
    assert known.nutation_frequency == pytest.approx(2 * np.pi / T, rel=1e-15)
    assert known.mean_precession_rate == pytest.approx(turn / T, rel=1e-15)
    assert known.rotation_number == pytest.approx(turn / 2 / np.pi, rel=1e-15)
    drop = np.cos(0.1) - np.cos(0.51723131823843479801)
    assert known.nutation_amplitude == pytest.approx(drop, rel=1e-14)
    assert known.phidot_reverses
    assert known.phidot_reversal_theta == pytest.approx(0.148027354547, abs=5e-13)
    assert known.psidot_min == pytest.approx(114.35023027, abs=5e-9)
    assert known.psidot_min_theta == pytest.approx(0.51723131823843479801, rel=1e-15)
    assert (known.phidot_min, known.psidot_max, known.psidot_max_theta) == (-15, 140, 0.1)
    assert known.sleeping_threshold == pytest.approx(117.194006935969, rel=1e-14)
    assert known.stable is known.steady_branch is known.growth_rate is None
    assert known.psidot_reversal_theta is None
    dropped = of_scene("sicm-dropped")
    assert (dropped.phidot_min, dropped.phidot_max) == (0.0, 760 / 77)  # 2 gMR/p_ψ
    assert dropped.psidot_min == pytest.approx(130.291539463, abs=5e-10)
    assert dropped.phidot_reversal_theta is None


def test_the_cone_in_steady_precession():
    """Betsch: 10 rad/s; the other rate 23.082352941176471, nodding 10.852971464966503 rad/s."""
    known = of_scene("steady-betsch")
    assert known.phidot_min == known.phidot_max == known.mean_precession_rate == 10
    assert known.psidot_min == known.psidot_max == known.mean_spin_rate == 135.6
    assert known.phidot_min_theta is None
    assert known.steady_branch == "slow"
    assert known.other_precession_rate == pytest.approx(23.082352941176471, rel=1e-15)
    assert known.small_nutation_frequency == pytest.approx(10.852971464966503, rel=1e-15)
    assert known.stable is True
    assert known.nutation_frequency is known.rotation_number is known.nutation_amplitude is None


@pytest.mark.parametrize(("which", "other"), [("slow", "fast"), ("fast", "slow")])
@pytest.mark.parametrize("theta", ["0.1", "1", "2.5"])
@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
def test_each_steady_precession_names_the_other(which, other, theta, gMR):
    top = ht.Top("3.28e-4", "6.60e-5", gMR)
    one, two = (ht.facts(top, ht.State.steady(top, theta, 140, name)) for name in (which, other))
    assert (one.steady_branch, two.steady_branch) == (which, other)
    assert one.other_precession_rate == pytest.approx(two.mean_precession_rate, rel=1e-15)
    assert one.other_nutation_frequency == pytest.approx(two.small_nutation_frequency, rel=1e-15)
    spin = 140 - one.mean_precession_rate * math.cos(float(theta))
    assert one.mean_spin_rate == pytest.approx(spin, rel=1e-14)


def test_where_there_is_one_steady_rate_or_two_alike():
    level = of(ht.Top(1, 1, 2), theta="pi/2", phidot=1, psidot=2)
    assert (level.steady_branch, level.other_precession_rate) == ("single", None)
    cone = of(ht.Top(2, 1, -2), theta="pi/3", phidot="sqrt(2)", omega3=0)
    assert cone.steady_branch == "single"
    assert cone.other_precession_rate == pytest.approx(-np.sqrt(2), rel=1e-15)
    at_rest = of(WEIGHTLESS, theta=1)
    assert at_rest.steady_branch is at_rest.other_precession_rate is None
    assert at_rest.stable is False
    assert of(WEIGHTLESS, theta=1, psidot=5).stable is True


def test_sleeping():
    stable = of(BOOK, theta=0, psidot=140)
    assert stable.stable is True
    assert stable.growth_rate is None
    A, C, gMR = (float(x) for x in (BOOK.A, BOOK.C, BOOK.gMR))
    nodding = math.sqrt((C * 140) ** 2 - 4 * A * gMR) / A
    assert stable.small_nutation_frequency == pytest.approx(nodding, rel=1e-14)
    cones = stable.slow_cone_rate, stable.fast_cone_rate
    assert cones[1] - cones[0] == pytest.approx(stable.small_nutation_frequency, rel=1e-14)
    assert sum(cones) == pytest.approx(6.6e-5 * 140 / 3.28e-4, rel=1e-15)  # p_ψ/A
    unstable = of(BOOK, theta=0, psidot=100)
    assert unstable.stable is False
    growth = math.sqrt(4 * A * gMR - (C * 100) ** 2) / 2 / A
    assert unstable.growth_rate == pytest.approx(growth, rel=1e-14)
    assert unstable.small_nutation_frequency is unstable.slow_cone_rate is None
    marginal = of(ht.Top(2, 1, 2), theta=0, psidot=4)
    assert marginal.stable is True
    assert (marginal.small_nutation_frequency, marginal.growth_rate) == (0, None)
    assert marginal.slow_cone_rate == marginal.fast_cone_rate == 1
    for known in (stable, unstable, marginal):
        assert known.phidot_min is known.psidot_max is known.mean_spin_rate is None
        assert known.phidot_reverses is known.steady_branch is None


@pytest.mark.parametrize(
    ("top", "theta", "side"), [(TWO, "pi", -1), (UPSIDE_DOWN, 0, 1)], ids=["below", "above"]
)
def test_hanging_is_always_stable(top, theta, side):
    """Small motions go round with (± p_ψ ± √(p_ψ² + 4 A |gMR|))/2A: here (1 ± 5)/4 and mirrored."""
    known = of(top, theta=theta, omega3=1)
    assert known.stable is True
    assert (known.slow_cone_rate, known.fast_cone_rate) == (-side * 1.0, side * 1.5)
    assert known.small_nutation_frequency == 2.5
    tilt = "1e-7" if theta == 0 else "pi - 1e-7"
    period = ht.Motion(top, ht.State(tilt, omega3=1)).period
    assert 2 * np.pi / period == pytest.approx(2.5, rel=1e-12)


def test_a_pendulum_at_rest_below_swings_with_its_own_frequency():
    """√(gMR/A) to and fro, and cosθ with twice that; above it grows at that rate."""
    below, above = of(TWO, theta="pi"), of(TWO, theta=0)
    assert below.slow_cone_rate == -below.fast_cone_rate == pytest.approx(math.sqrt(1.5))
    assert below.small_nutation_frequency == pytest.approx(2 * math.sqrt(1.5), rel=1e-15)
    assert above.growth_rate == pytest.approx(math.sqrt(1.5), rel=1e-15)
    adrift = of(WEIGHTLESS, theta=0)
    assert (adrift.stable, adrift.growth_rate, adrift.sleeping_threshold) == (False, None, None)


def test_jumps_at_poles_are_part_of_the_means():
    """A swing through the bottom turns φ by half a turn, though φ̇ is nought all the time."""
    swing = of(TWO, theta=1)
    assert (swing.phidot_min, swing.phidot_max, swing.phidot_reverses) == (0, 0, False)
    assert swing.rotation_number == 0.5


# --- extremes and reversals of rates -------------------------------------------------------------


class Rate:
    """What the facts say of one rate."""

    def __init__(self, known, name):
        def told(fact):
            return getattr(known, f"{name}_{fact}")

        self.values = [told("min"), told("max")]
        self.places = [told("min_theta"), told("max_theta")]
        self.reversal = told("reversal_theta")
        assert told("reverses") == (self.reversal is not None)


def rates(motion):
    """What the facts say of φ̇ and of ψ̇."""
    known = ht.facts(motion.top, motion.start)
    return None if known.phidot_min is None else (Rate(known, "phidot"), Rate(known, "psidot"))


def rates_of(top, **start):
    motion = ht.Motion(top, ht.State(**start))
    return motion, rates(motion)


def textbook(motion):
    """Extremes from roots of polynomials at 200 digits, with nothing taken from the package.

    φ̇ = (a − b u)/(1 − u²) at u₁, u₂ or where b u² − 2 a u + b = 0; ψ̇ = κ + (b − a u)/(1 − u²) at
    the same or where a u² − 2 b u + a = 0.
    """
    by_hand = ByHand(motion.top, motion.start, 200)
    ctx, a, b, kappa = by_hand.mp, by_hand.a, by_hand.b, by_hand.omega3 - by_hand.b
    low, high = by_hand.roots[:2] if by_hand.g >= 0 else by_hand.roots[1:]

    def real_roots(*coefficients):
        leading = next(i for i, each in enumerate(coefficients) if each)
        roots = ctx.polyroots(coefficients[leading:], maxsteps=500, extraprec=2000)
        return sorted(ctx.re(root) for root in roots if abs(ctx.im(root)) < 1e-50)

    def extremes(rate, quadratic):
        inner = [u for u in real_roots(*quadratic) if low < u < high]
        values = [(rate(u), ctx.acos(u)) for u in (low, high, *inner)]
        return min(values), max(values)

    return (
        extremes(lambda u: (a - b * u) / (1 - u * u), [b, -2 * a, b]),
        extremes(lambda u: kappa + (b - a * u) / (1 - u * u), [a, -2 * b, a]),
    )


STARTS = {
    "loops": (BOOK, {"theta": "0.1", "phidot": -15, "psidot": 140}),
    "waves": (BOOK, {"theta": "0.1", "phidot": 15, "omega3": 140}),
    "waves with a waist": (UNIT, {"theta": 1, "thetadot": 2, "phidot": "1.5", "psidot": "0.3"}),
    "near the top": (UNIT, {"theta": 1, "thetadot": -2, "phidot": "0.6", "psidot": 1}),
    "near the bottom": (ht.Top("15.234375", "0.46875", "147.15"),
                        {"theta": "pi/2", "phidot": "-4.61538", "psidot": 150}),
    "nearer still": (ht.Top("15.234375", "0.46875", "147.15"),
                     {"theta": "pi/2", "phidot": "-4.6153846153", "psidot": 150}),
    "the spin turns back": (UNIT, {"theta": 2, "phidot": 3, "psidot": "-0.1"}),
    "upside down": (ht.Top(1, "0.5", -1), {"theta": 1, "phidot": 1, "psidot": 3}),
    "without weight": (ht.Top(2, 1, 0), {"theta": 1, "phidot": 1, "psidot": 2}),
    "spherical pendulum": (UNIT, {"theta": 2, "phidot": 1, "omega3": 0}),
    "a disc": (DISC, {"theta": 1, "thetadot": "0.1", "phidot": 1, "psidot": 2}),
    "a fast spin": (UNIT, {"theta": 1, "phidot": "1e-9", "psidot": "1e9"}),
    "next to a cusp": (UNIT, {"theta": 1, "phidot": "-1e-20", "psidot": 5}),
}  # fmt: skip


@pytest.mark.reference
@pytest.mark.parametrize("name", STARTS)
def test_the_textbooks_extremes_to_the_last_digit(name):
    """Values to 2⁻⁵² of themselves, and the tilts at which they are."""
    top, start = STARTS[name]
    motion, both = rates_of(top, **start)
    for rate, expected in zip(both, textbook(motion), strict=True):
        told = zip(rate.values, rate.places, strict=True)
        for (found, tilt), (value, theta) in zip(told, expected, strict=True):
            assert found == pytest.approx(float(value), rel=2.3e-16, abs=0)
            assert tilt == pytest.approx(float(theta), rel=2.3e-16)


def test_at_a_pole_rates_have_limits():
    """Through the top φ̇ tends to p_ψ/2A; the closed form a moment before and after agrees.

    On the separatrix it falls from 2/√3 to p_ψ/2A = √3/2, and never quite arrives.
    """
    motion, (phidot, psidot) = rates_of(TWO, theta=0, thetadot=2, psidot=3)
    assert (phidot.values[0], phidot.places[0]) == (0.75, 0.0)
    near = motion.at([-1e-9, 1e-9])
    assert near.phidot == pytest.approx(0.75, rel=1e-12)
    assert near.psidot == pytest.approx(psidot.values[0], rel=1e-12)
    motion, (phidot, _) = rates_of(TWO, theta="pi", thetadot=2, psidot=3)
    assert phidot.values[1] == -0.75
    motion = shipped("separatrix")
    phidot, _ = rates(motion)
    assert phidot.values == pytest.approx([np.sqrt(3) / 2, 2 / np.sqrt(3)], rel=1e-15)
    assert phidot.places == [0.0, pytest.approx(np.pi / 3)]
    rate = motion.at(np.linspace(0, 12, 50)).phidot
    assert np.all(np.diff(rate) < 0)
    assert rate[-1] == pytest.approx(np.sqrt(3) / 2, rel=1e-4)
    known = of_scene("separatrix")
    assert known.mean_precession_rate is known.nutation_frequency is known.stable is None


def test_constant_rates_have_no_place():
    for top, start in (
        (CONE, {"theta": "pi/3", "phidot": 10, "omega3": "140.6"}),
        (UNIT, {"theta": 2}),
        (WEIGHTLESS, {"theta": 1, "psidot": 5}),
    ):
        for rate in rates_of(top, **start)[1]:
            assert rate.values[0] == rate.values[1]
            assert rate.places == [None, None]
            assert rate.reversal is None
    for start in ({"theta": 0, "psidot": 140}, {"theta": "pi", "psidot": 1}):
        assert rates_of(BOOK, **start)[1] is None


def test_a_disc_about_its_centre_stops_its_spin_and_does_not_turn_it_back():
    """At C = 2A a start with ψ̇ = 0 is the least ψ̇: zero is touched and not passed."""
    _, (_, psidot) = rates_of(DISC, theta=1, phidot=1, psidot=0)
    assert psidot.values[0] == 0.0
    assert psidot.reversal is None


def test_rates_that_hardly_change_have_their_places():
    """A nutation of 5e-54 rad through the top: ψ̇ = 0 there, and κ + P₊/2(1 + u) at its end."""
    motion, (phidot, psidot) = rates_of(
        ht.Top(1, 2, "1e-30"), theta=0, thetadot="1e-45", phidot="1e8", psidot="1e8"
    )
    tilt = motion.theta_max
    assert tilt == pytest.approx(5e-54, rel=1e-6)
    assert psidot.values == [0.0, pytest.approx(2e8 * tilt**2 / 4, rel=1e-14)]
    assert psidot.places == phidot.places == [0.0, tilt]
    motion, both = rates_of(ht.Top(2, "0.25", 0), theta=0, thetadot="1e-45", omega3="1e8")
    assert [rate.places for rate in both] == [[0.0, motion.theta_max]] * 2


exact = st.fractions(-4, 4, max_denominator=1000)


@st.composite
def motions(draw):
    A = draw(st.fractions("0.1", 4, max_denominator=100))
    C = A * draw(st.fractions("0.01", 2, max_denominator=100))
    theta = draw(st.fractions("0.01", "3.13", max_denominator=1000))
    start = ht.State(theta, thetadot=draw(exact), phidot=draw(exact), psidot=draw(exact))
    return ht.Motion(ht.Top(A, C, draw(exact)), start)


@settings(max_examples=60, deadline=None)
@given(motions())
def test_every_motion_stays_within_its_extremes(motion):
    """Nothing sampled lies outside, and at the tilts they name the rates are what they say.

    φ̇ may have an extreme inside where |p_φ| > |p_ψ|, ψ̇ where |p_φ| < |p_ψ|. The kinds, which are
    told without the roots, say which motions turn back. Means are those of equidistant samples over
    a period, which is exact for what is smooth.
    """
    known, both = ht.facts(motion.top, motion.start), rates(motion)
    assume(both is not None)
    phidot, psidot = wide, other = both
    if abs(motion.constants.p_phi) < abs(motion.constants.p_psi):
        wide, other = other, wide
    assert set(other.places) <= {None, motion.theta_min, motion.theta_max}
    assert wide.reversal is None
    assert (psidot.reversal is not None) == ("spin-reversal" in motion.tags)
    if motion.kind != "force-free":
        assert (phidot.reversal is not None) == (motion.kind == "loops")
    a, b, kappa = (float(x) for x in (motion.reduced.a, motion.reduced.b, motion.reduced.kappa))
    if phidot.reversal is not None:
        assert np.cos(phidot.reversal) == pytest.approx(a / b)
    if motion.period is None or min(motion.from_top, motion.from_bottom) < 1e-3:
        return
    at = motion.at(np.arange(1024) / 1024 * motion.period)
    formulas = (lambda u: a - b * u), (lambda u: kappa * (1 - u * u) + b - a * u)
    for rate, sampled, formula in zip(both, (at.phidot, at.psidot), formulas, strict=True):
        least, greatest = rate.values
        margin = 1e-9 * max(abs(a), abs(b), abs(kappa), abs(least), abs(greatest))
        assert least - margin <= sampled.min()
        assert sampled.max() <= greatest + margin
        for value, theta in zip(rate.values, rate.places, strict=True):
            if theta is not None:
                assert motion.theta_min <= theta <= motion.theta_max
                there = formula(np.cos(theta)) / np.sin(theta) ** 2
                assert there == pytest.approx(value, rel=1e-9, abs=margin)
    if min(motion.from_top, motion.from_bottom) < 0.2 or motion.exact.modulus[1] < 1e-3:
        return
    rounding = 1e-12 * (1 + abs(known.omega3) + known.nutation_frequency)
    for mean, sampled in (
        (known.mean_precession_rate, at.phidot), (known.mean_spin_rate, at.psidot),
    ):  # fmt: skip
        assert mean == pytest.approx(np.mean(sampled), rel=1e-10, abs=rounding)
    assert known.nutation_amplitude == pytest.approx(np.ptp(at.u), rel=1e-4)


# --- the fast top's formulas ---------------------------------------------------------------------


def errors(known):
    return [
        known.fast_top_precession_error,
        known.fast_top_period_error,
        known.fast_top_amplitude_error,
    ]


# In percent, from the closed form of another program at 50 digits.


# In percent, from the closed form of another program at 50 digits.
@pytest.mark.reference
@pytest.mark.parametrize(
    ("top", "start", "ratio", "percent"),
    [
        (SIMO_WONG, {"theta": "0.3", "omega3": 50}, 6.25, [-4, -8, -15]),
        (BOOK, {"theta": "0.1", "psidot": 140}, 1.43, [-22, -44, -69]),
        (BOOK, {"theta": "0.1", "omega3": 125}, 1.14, [-31, -62, -86]),
    ],
)
def test_how_far_off_a_top_let_go_is(top, start, ratio, percent):
    known = of(top, **start)
    assert round(known.fast_top_ratio, 2) == ratio
    assert [round(100 * error) for error in errors(known)] == percent
    A, gMR, p_psi = float(top.A), float(top.gMR), float(top.C) * known.omega3
    theta = float(start["theta"])
    for found, formula in (
        (known.fast_top_precession_rate, gMR / p_psi),
        (known.fast_top_nutation_period, 2 * np.pi * A / p_psi),
        (known.fast_top_amplitude, 2 * A * gMR * np.sin(theta) ** 2 / p_psi**2),
    ):
        assert found == pytest.approx(formula, rel=1e-14)


@pytest.mark.parametrize("theta", ["0.3", "1.2", "2.5"])
@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
def test_errors_fall_as_the_inverse_of_the_ratio(theta, gMR):
    top = ht.Top("3.28e-4", "6.60e-5", gMR)
    slower, faster = (of(top, theta=theta, omega3=spin) for spin in (10**5, 10**6))
    ratio = (6.6e-5 * 1e6) ** 2 / (4 * 3.28e-4 * 0.0456)
    assert faster.fast_top_ratio == pytest.approx(ratio, rel=1e-12)
    assert slower.fast_top_ratio == pytest.approx(ratio / 100, rel=1e-12)
    for large, small in zip(errors(slower), errors(faster), strict=True):
        assert abs(large) < 1e-5
        assert large / small == pytest.approx(100, rel=1e-4)


def test_steady_precession_has_an_estimate_for_either_rate():
    """At ω₃ = 140 a run precesses 22.488 % faster, and 29.012 % slower (exercise 2.13)."""
    for which, percent in (("slow", -22.488), ("fast", 29.012)):
        start = ht.State.steady(BOOK, "0.1", 140, which)
        known = ht.facts(BOOK, start)
        assert 100 * known.fast_top_precession_error == pytest.approx(percent, abs=5e-4)
        b, rate = 6.6e-5 * 140 / 3.28e-4, float(start.phidot)
        nodding = np.hypot(b - 2 * rate * np.cos(0.1), rate * np.sin(0.1))
        period = 2 * np.pi * 3.28e-4 / (6.6e-5 * 140)
        assert known.fast_top_period_error == pytest.approx(period * nodding / 2 / np.pi - 1)
        assert known.fast_top_amplitude is None


def test_the_amplitude_is_that_of_a_top_at_rest_in_its_cusp():
    """A start elsewhere on the motion has the same one; a kicked top has none."""
    let_go = ht.Motion(BOOK, ht.State("0.1", psidot=140))
    from_below = of(BOOK, theta="0.1", phidot="2*0.0456/(6.6e-5*140)", omega3=140)
    assert from_below.fast_top_amplitude is not None
    assert from_below.nutation_amplitude < ht.facts(let_go.top, let_go.start).nutation_amplitude
    assert of(BOOK, theta="0.1", phidot=1, psidot=140).fast_top_amplitude is None
    upside_down = ht.Top("3.28e-4", "6.60e-5", "-0.0456")
    mirrored = of(upside_down, theta="pi - 0.1", psidot=-140)
    assert mirrored.fast_top_amplitude == pytest.approx(
        ht.facts(let_go.top, let_go.start).fast_top_amplitude, rel=1e-15
    )
    assert mirrored.fast_top_amplitude_error == pytest.approx(
        ht.facts(let_go.top, let_go.start).fast_top_amplitude_error, rel=1e-15
    )


@pytest.mark.parametrize(
    ("top", "start", "ratio"),
    [
        (BOOK, {"theta": 1}, 0),
        (BOOK, {"theta": 2, "phidot": 5, "omega3": 0}, 0),
        (BOOK, {"theta": "pi/12", "phidot": 2, "psidot": "-sqrt(2 + sqrt(3))"}, 0),
        (ht.Top(2, 1, 0), {"theta": 1, "phidot": 1, "psidot": 20}, None),
    ],
    ids=["pendulum", "spherical pendulum", "2 cos(pi/12) = sqrt(2 + sqrt(3))", "no weight"],
)
def test_no_estimate_without_spin_or_weight(top, start, ratio):
    known = of(top, **start)
    assert known.fast_top_ratio == (ratio if ratio is None else pytest.approx(ratio, abs=1e-50))
    document = known.document()
    estimates = [name for name in document if name.startswith("fast_top_")]
    assert [n for n in estimates if document[n] is not None] in ([], ["fast_top_ratio"])


# --- what is said of them ------------------------------------------------------------------------


PAGE = (Path(__file__).parents[2] / "docs" / "facts.md").read_text("utf-8")
FACTS, PRINTED = PAGE.split("## What classify prints")
ROWS = re.findall(r"^\| (`.*?) \|", FACTS, re.MULTILINE)
NAMES = re.findall(r"`(\w+)`", " ".join(ROWS))


def test_the_page_describes_every_fact_once():
    assert sorted(NAMES) == sorted(Facts(omega3=1.0).document())


def test_what_classify_prints_is_told_by_facts_that_there_are():
    told = {name for name in re.findall(r"`(\w+)`", PRINTED) if name.isascii() and "_" in name}
    assert told
    assert told <= set(NAMES)


@pytest.mark.parametrize("name", SCENES)
def test_every_shipped_scene_has_a_flat_document(name):
    """The names are always the same, and the values numbers, true or false, one word, or null."""
    document = of_scene(name).document()
    assert sorted(document) == sorted(NAMES)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert not any(isinstance(fact, dict | list) for fact in document.values())


def test_what_is_no_double_is_null():
    """p_ψ²/(4 A gMR) of a spin of 1e200 rad/s is 1e400/4."""
    known = of(ht.Top(1, 1, 1), theta=1, psidot="1e200")
    assert known.fast_top_ratio == math.inf
    assert known.document()["fast_top_ratio"] is None
    assert known.document()["phidot_max"] == 2e-200


def test_facts_are_values():
    known = of(BOOK, theta="0.1", psidot=140)
    assert known == of(BOOK, theta="0.1", psidot=140)
    with pytest.raises(AttributeError):
        known.omega3 = 0
    assert Facts(omega3=1.0).document() == dict.fromkeys(NAMES) | {"omega3": 1.0}
