"""Facts of a motion: published values, extremes of rates, means, the fast top's formulas."""

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht

from ..by_hand import ByHand
from ..motions import BOOK, INVERTED, MARGINAL, SIMO_WONG, TWO, shipped

approx = pytest.approx
UNIT = ht.Top(1, "0.5", 1)
DISC = ht.Top(1, 2, 1)
T, TURN, LOWEST = 0.54289551818821995785, 3.9741816546440002896, 0.51723131823843479801
A, C, G = 3.28e-4, 6.6e-5, 0.0456
SLEEPING = math.sqrt((C * 140) ** 2 - 4 * A * G) / A


def of(top, **start):
    return ht.facts(top, ht.State(**start))


# SICM section 2.10 and exercise 2.13; Betsch & Steinmann 2002; what follows from formulas by hand.
KNOWN = {
    "kicked": ("sicm-kicked", {
        "nutation_frequency": approx(2 * np.pi / T, rel=1e-15),
        "mean_precession_rate": approx(TURN / T, rel=1e-15),
        "rotation_number": approx(TURN / 2 / np.pi, rel=1e-15),
        "nutation_amplitude": approx(np.cos(0.1) - np.cos(LOWEST), rel=1e-14),
        "phidot_reverses": True, "phidot_reversal_theta": approx(0.148027354547, abs=5e-13),
        "psidot_reversal_theta": None, "sleeping_threshold": approx(117.194006935969, rel=1e-14),
    }),
    "dropped": ("sicm-dropped", {
        "phidot_min": 0.0, "phidot_max": 760 / 77, "stable": None,  # 2 gMR/p_ψ
        "psidot_min": approx(130.291539463, abs=5e-10), "phidot_reversal_theta": None,
    }),
    "a cone": ("steady-betsch", {
        "phidot_min": 10, "phidot_min_theta": None, "mean_precession_rate": 10,
        "mean_spin_rate": 135.6, "steady_branch": "slow", "stable": True, "rotation_number": None,
        "other_precession_rate": approx(23.082352941176471, rel=1e-15),
        "small_nutation_frequency": approx(10.852971464966503, rel=1e-15),
    }),
    "from 2/√3 to p_ψ/2A = √3/2, never arriving": ("separatrix", {
        "phidot_min": approx(math.sqrt(3) / 2, rel=1e-15), "phidot_min_theta": 0.0,
        "phidot_max": approx(2 / math.sqrt(3), rel=1e-15),
        "phidot_max_theta": approx(np.pi / 3, rel=1e-15), "mean_precession_rate": None,
    }),
    "two alike": ((ht.Top(2, 1, -2), {"theta": "pi/3", "phidot": "sqrt(2)", "omega3": 0}),
        {"steady_branch": "single", "other_precession_rate": approx(-math.sqrt(2), rel=1e-15)}),
    "sleeping, stable": ((BOOK, {"theta": 0, "psidot": 140}), {
        "stable": True, "growth_rate": None, "phidot_min": None, "mean_spin_rate": None,
        "small_nutation_frequency": approx(SLEEPING, rel=1e-14),
        "slow_cone_rate": approx((C * 140 / A - SLEEPING) / 2, rel=1e-14),
        "fast_cone_rate": approx((C * 140 / A + SLEEPING) / 2, rel=1e-14),
    }),
    "sleeping, unstable": ((BOOK, {"theta": 0, "psidot": 100}), {"slow_cone_rate": None}),
    "sleeping, marginal": ((MARGINAL, {"theta": 0, "psidot": 4}), {
        "small_nutation_frequency": 0, "slow_cone_rate": 1, "fast_cone_rate": 1}),
    "hanging: (p_ψ ± √(p_ψ² + 4 A |gMR|))/2A": ((TWO, {"theta": "pi", "omega3": 1}),
        {"stable": True, "slow_cone_rate": 1.0, "fast_cone_rate": -1.5}),
    "through the top φ̇ is p_ψ/2A": ((TWO, {"theta": 0, "thetadot": 2, "psidot": 3}),
        {"phidot_min": 0.75, "phidot_min_theta": 0.0}),
    "a disc whose ψ̇ touches zero": ((DISC, {"theta": 1, "phidot": 1, "psidot": 0}),
        {"psidot_min": 0.0, "psidot_reverses": False, "psidot_reversal_theta": None}),
    "no spin": ((BOOK, {"theta": 1}), {"fast_top_ratio": 0, "estimates": {}}),
    "a ratio of 1e400/4 is no double": ((ht.Top(1, 1, 1), {"theta": 1, "psidot": "1e200"}),
        {"fast_top_ratio": np.inf, "phidot_max": 2e-200}),
}  # fmt: skip


@pytest.mark.parametrize("name", KNOWN)
def test_facts_that_are_known(name):
    motion, facts = KNOWN[name]
    known = ht.facts(shipped(motion)) if isinstance(motion, str) else of(motion[0], **motion[1])
    assert {fact: getattr(known, fact) for fact in facts} == facts


@pytest.mark.reference
@pytest.mark.parametrize(("names", "percent"), [("slow fast", -22.488), ("fast slow", 29.012)])
@pytest.mark.parametrize("top", [BOOK, INVERTED])
def test_each_steady_precession_names_the_other(names, percent, top):
    """And at ω₃ = 140 the book's run precesses 22.488 % faster, and 29.012 % slower (2.13)."""
    one, two = (ht.facts(top, ht.State.steady(top, "0.1", 140, name)) for name in names.split())
    assert f"{one.steady_branch} {two.steady_branch}" == names
    assert one.other_precession_rate == approx(two.mean_precession_rate, rel=1e-15)
    assert one.other_nutation_frequency == approx(two.small_nutation_frequency, rel=1e-15)
    assert one.mean_spin_rate == approx(140 - one.mean_precession_rate * math.cos(0.1), rel=1e-14)
    period = A * one.small_nutation_frequency / (C * 140)
    assert one.estimates["period"]["error"] == approx(period - 1, rel=1e-12)
    error = one.estimates["precession"]["error"]
    assert top is INVERTED or 100 * error == approx(percent, abs=5e-4)


# --- extremes and reversals of rates -------------------------------------------------------------


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

    def at_ends(rate, quadratic):
        inner = [u for u in real_roots(*quadratic) if low < u < high]
        values = [(rate(u), ctx.acos(u)) for u in (low, high, *inner)]
        return min(values), max(values)

    return {
        "phidot": at_ends(lambda u: (a - b * u) / (1 - u * u), [b, -2 * a, b]),
        "psidot": at_ends(lambda u: kappa + (b - a * u) / (1 - u * u), [a, -2 * b, a]),
    }


STARTS = {
    "loops": (BOOK, {"theta": "0.1", "phidot": -15, "psidot": 140}),
    "near the top": (UNIT, {"theta": 1, "thetadot": -2, "phidot": "0.6", "psidot": 1}),
    "the spin turns back": (UNIT, {"theta": 2, "phidot": 3, "psidot": "-0.1"}),
    "upside down": (ht.Top(1, "0.5", -1), {"theta": 1, "phidot": 1, "psidot": 3}),
    "a disc": (DISC, {"theta": 1, "thetadot": "0.1", "phidot": 1, "psidot": 2}),
    "a fast spin": (UNIT, {"theta": 1, "phidot": "1e-9", "psidot": "1e9"}),
    "next to a cusp": (UNIT, {"theta": 1, "phidot": "-1e-20", "psidot": 5}),
}


@pytest.mark.reference
@pytest.mark.parametrize("name", STARTS)
def test_the_textbooks_extremes_to_the_last_digit(name):
    """Values to 2⁻⁵² of themselves, and the tilts at which they are."""
    motion = ht.Motion(STARTS[name][0], ht.State(**STARTS[name][1]))
    known = ht.facts(motion)
    for rate, expected in textbook(motion).items():
        for end, (value, theta) in zip(("min", "max"), expected, strict=True):
            found, tilt = getattr(known, f"{rate}_{end}"), getattr(known, f"{rate}_{end}_theta")
            assert found == approx(float(value), rel=2.3e-16, abs=0)
            assert tilt == approx(float(theta), rel=2.3e-16)


fractions = partial(st.fractions, max_denominator=1000)
exact = fractions(-4, 4)


@st.composite
def motions(draw):
    A = draw(fractions("0.1", 4))
    C, theta = A * draw(fractions("0.01", 2)), draw(fractions("0.01", "3.13"))
    start = ht.State(theta, thetadot=draw(exact), phidot=draw(exact), psidot=draw(exact))
    return ht.Motion(ht.Top(A, C, draw(exact)), start)


@settings(max_examples=60, deadline=None)
@given(motions())
def test_every_motion_turns_back_as_its_kind_says_and_has_its_means(motion):
    """The kinds, told without the roots, say which turn back.

    Means are those of equidistant samples over a period, which is exact for what is smooth.
    """
    known = ht.facts(motion)
    assume(known.phidot_min is not None)
    assert known.psidot_reverses == ("spin-reversal" in motion.tags)
    assert known.psidot_reverses == (known.psidot_reversal_theta is not None)
    if motion.kind != "force-free":
        assert known.phidot_reverses == (motion.kind == "loops")
    if known.phidot_reverses:
        a, b = float(motion.reduced.a), float(motion.reduced.b)
        assert np.cos(known.phidot_reversal_theta) == approx(a / b)
    near = min(motion.from_top, motion.from_bottom) < 0.2
    if motion.period is None or near or motion.modulus[1] < 1e-3:
        return
    at = motion.at(np.arange(1024) / 1024 * motion.period)
    rounding = 1e-12 * (1 + abs(known.omega3) + known.nutation_frequency)
    assert known.mean_precession_rate == approx(np.mean(at.phidot), rel=1e-10, abs=rounding)
    assert known.mean_spin_rate == approx(np.mean(at.psidot), rel=1e-10, abs=rounding)
    assert known.nutation_amplitude == approx(np.ptp(at.u), rel=1e-4)


# --- about the vertical --------------------------------------------------------------------------


def highest(top, omega3=1):
    """The facts of a top that stands where V is highest."""
    return ht.facts(top, ht.State(0 if top.gMR.sign() == 1 else "pi", omega3=omega3))


@settings(max_examples=100, deadline=None)
@given(fractions("0.1", 4), fractions("0.05", 2), exact, fractions(-9, 9))
def test_rates_are_eigenvalues(A, flat, gMR, omega3):
    """Real parts are the growth, and the imaginary parts differ by the frequency of θ.

    About the vertical where V is highest, e = (x, y, ±1) with x, y ≪ 1. There Newton's equations,
    in the axis form, are ë_x = −s b ė_y + |g| e_x and ë_y = s b ė_x + |g| e_y, where s = ±1 says
    which vertical it is.
    """
    assume(gMR or omega3)  # else a tilt grows as time
    top = ht.Top(A, A * flat, gMR)
    b, g = float(top.C * omega3 / top.A), float(top.gMR / top.A)
    s, pull = (-1 if g < 0 else 1), abs(g)
    rows = [0, 0, 1, 0], [0, 0, 0, 1], [pull, 0, 0, -s * b], [0, pull, s * b, 0]
    values = np.linalg.eigvals(np.array(rows))
    known = highest(top, omega3=omega3)
    growth, frequency = known.growth_rate, known.small_nutation_frequency
    assert (growth is None) == known.stable == (frequency is not None)
    assert np.max(values.real) == pytest.approx(growth or 0, rel=1e-5, abs=1e-5)
    if growth is None:
        assert np.ptp(np.abs(values.imag)) == pytest.approx(frequency, rel=1e-6, abs=1e-6)


def test_with_a_last_digit_less_than_the_threshold_something_grows():
    below = highest(MARGINAL, omega3=np.nextafter(4, 0))
    assert below.growth_rate == pytest.approx(np.sqrt(2**-51 / 2), rel=1e-9)
    assert below.small_nutation_frequency is None


# --- the fast top's formulas ---------------------------------------------------------------------


# In percent, from the closed form of another program at 50 digits.
@pytest.mark.reference
@pytest.mark.parametrize(("top", "start", "ratio", "percent"), [
    (SIMO_WONG, {"theta": "0.3", "omega3": 50}, 6.25, [-4, -8, -15]),
    (BOOK, {"theta": "0.1", "psidot": 140}, 1.43, [-22, -44, -69]),
    (BOOK, {"theta": "0.1", "omega3": 125}, 1.14, [-31, -62, -86]),
])  # fmt: skip
def test_how_far_off_a_top_let_go_is(top, start, ratio, percent):
    known = of(top, **start)
    assert round(known.fast_top_ratio, 2) == ratio
    errors = [known.estimates[name]["error"] for name in ("precession", "period", "amplitude")]
    assert [round(100 * error) for error in errors] == percent
