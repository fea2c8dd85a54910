"""Extremes and reversals of φ̇ and ψ̇, against the textbook's formulas, the motion, and a run."""

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic.facts import facts

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")
UNIT = ht.Top(1, "0.5", 1)
UPSIDE_DOWN = ht.Top(1, "0.5", -1)
DISC = ht.Top(1, 2, 1)


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
    known = facts(motion)
    return None if known.phidot_min is None else (Rate(known, "phidot"), Rate(known, "psidot"))


def of(top, **start):
    motion = ht.Motion(top, ht.State(**start))
    return motion, rates(motion)


def shipped(name):
    scene = ht.load_scene(name)
    motion = ht.Motion(scene.top, scene.start)
    return motion, rates(motion)


def test_the_spin_of_the_kicked_and_of_the_dropped_top():
    """ψ̇ runs 140 → 114.35023027 when kicked, 140 → 130.291539463 when let go (SICM §2.10)."""
    _, (_, kicked) = shipped("sicm-kicked")
    assert kicked.values == [pytest.approx(114.35023027, abs=5e-9), 140.0]
    assert kicked.places == [pytest.approx(0.51723131823843479801, rel=1e-15), 0.1]
    _, (_, dropped) = shipped("sicm-dropped")
    assert dropped.values == [pytest.approx(130.291539463, abs=5e-10), 140.0]


def test_a_top_let_go_precesses_at_most_at_twice_its_mean_pull():
    """φ̇ is 0 in the cusp and 2 gMR/p_ψ at the bottom: 760/77 for the book's top."""
    _, (dropped, _) = shipped("sicm-dropped")
    assert dropped.values == [0.0, 760 / 77]
    assert dropped.reversal is None


def test_where_the_kicked_top_turns_back():
    """φ̇ = 0 at θ = 0.148027354547, where cosθ = p_φ/p_ψ (SICM §2.10, figure 2.6)."""
    motion, (kicked, spin) = shipped("sicm-kicked")
    assert kicked.reversal == pytest.approx(0.148027354547, abs=5e-13)
    constants = motion.constants.floats
    cosine = constants["p_phi"] / constants["p_psi"]
    assert kicked.reversal == pytest.approx(np.arccos(cosine), rel=1e-13)
    assert spin.reversal is None


def test_a_near_pass_is_large_and_finite():
    """The Lie-group benchmark, u₁ = −0.99999999999973779144: there φ̇ peaks at 8.8e6 rad/s."""
    _, (passing, _) = shipped("lie-group-benchmark")
    assert passing.values[0] == -4.61538
    assert passing.values[1] == pytest.approx(8.8e6, rel=1e-3)
    miss = np.sqrt(2 * 2.6220856e-13)
    assert np.pi - passing.places[1] == pytest.approx(miss, rel=1e-7)


def textbook(motion):
    """Extremes from roots of polynomials at 200 digits, with nothing taken from the package.

    φ̇ = (a − b u)/(1 − u²) at u₁, u₂ or where b u² − 2 a u + b = 0; ψ̇ = κ + (b − a u)/(1 − u²) at
    the same or where a u² − 2 b u + a = 0.
    """
    ctx = mpmath.MPContext()
    ctx.dps = 200
    A, C, gMR = (each.mpf(ctx) for each in (motion.top.A, motion.top.C, motion.top.gMR))
    s = motion.start
    u0, sin2 = ctx.cos(s.theta.mpf(ctx)), ctx.sin(s.theta.mpf(ctx)) ** 2
    thetadot, phidot, psidot = (x.mpf(ctx) for x in (s.thetadot, s.phidot, s.psidot))
    g, b = gMR / A, C * (psidot + phidot * u0) / A
    a, kappa = phidot * sin2 + b * u0, psidot + phidot * u0 - b
    h = (thetadot**2 + phidot**2 * sin2) / 2 + g * u0

    def real_roots(*coefficients):
        leading = next(i for i, each in enumerate(coefficients) if each)
        roots = ctx.polyroots(coefficients[leading:], maxsteps=500, extraprec=2000)
        return sorted(ctx.re(root) for root in roots if abs(ctx.im(root)) < 1e-50)

    roots = real_roots(2 * g, -2 * h - b**2, 2 * a * b - 2 * g, 2 * h - a**2)
    low, high = roots[:2] if g >= 0 else roots[1:]

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
    "upside down": (UPSIDE_DOWN, {"theta": 1, "phidot": 1, "psidot": 3}),
    "without weight": (ht.Top(2, 1, 0), {"theta": 1, "phidot": 1, "psidot": 2}),
    "spherical pendulum": (UNIT, {"theta": 2, "phidot": 1, "omega3": 0}),
    "a disc": (DISC, {"theta": 1, "thetadot": "0.1", "phidot": 1, "psidot": 2}),
    "a fast spin": (UNIT, {"theta": 1, "phidot": "1e-9", "psidot": "1e9"}),
    "next to a cusp": (UNIT, {"theta": 1, "phidot": "-1e-20", "psidot": 5}),
}  # fmt: skip


@pytest.mark.parametrize("name", STARTS)
def test_the_textbooks_extremes_to_the_last_digit(name):
    """Values to 2⁻⁵² of themselves, and the tilts at which they are."""
    top, start = STARTS[name]
    motion, both = of(top, **start)
    for rate, expected in zip(both, textbook(motion), strict=True):
        told = zip(rate.values, rate.places, strict=True)
        for (found, tilt), (value, theta) in zip(told, expected, strict=True):
            assert found == pytest.approx(float(value), rel=2.3e-16, abs=0)
            assert tilt == pytest.approx(float(theta), rel=2.3e-16)


def seen(motion, name):
    """Least and greatest rate over a period of the closed form: sampled, and sampled again."""
    found = []
    for best in (np.argmin, np.argmax):
        low, high = 0.0, motion.period
        for _ in range(3):
            t = np.linspace(low, high, 2001)
            values = getattr(motion.at(t), name)
            i = int(best(values))
            low, high = t[max(i - 1, 0)], t[min(i + 1, 2000)]
        found.append(values[i])
    return found


@pytest.mark.parametrize("name", [n for n in STARTS if n != "nearer still"])
def test_extremes_are_what_the_motion_shows(name):
    top, start = STARTS[name]
    motion, both = of(top, **start)
    for rate, which in zip(both, ("phidot", "psidot"), strict=True):
        least, greatest = rate.values
        rounding = 1e-15 * max(abs(float(motion.start.omega3)), abs(least), abs(greatest))
        assert seen(motion, which) == pytest.approx([least, greatest], rel=1e-11, abs=rounding)


@pytest.mark.parametrize("name", ["sicm-kicked", "sicm-dropped", "spherical-pendulum"])
def test_extremes_are_what_a_run_shows(name):
    """The integrator's own φ̇ at its turning points, and where it sees φ̇ change its sign."""
    scene = ht.load_scene(name)
    _, (phidot, _) = shipped(name)
    events = ht.propagate(scene).events
    turning = events.phidot[events.is_turning]
    least, greatest = phidot.values
    assert [min(turning), max(turning)] == pytest.approx([least, greatest], rel=1e-11, abs=1e-11)
    reversals = events.theta[~events.is_turning]
    if phidot.reversal is None:
        assert reversals.size == 0
    else:
        assert reversals == pytest.approx(phidot.reversal, rel=1e-12)


def test_at_a_pole_that_is_passed_rates_have_limits():
    """Through the top φ̇ tends to p_ψ/2A; the closed form a moment before and after agrees."""
    motion, (phidot, psidot) = of(ht.Top(2, 1, 3), theta=0, thetadot=2, psidot=3)
    assert motion.kind == "through-top"
    assert (phidot.values[0], phidot.places[0]) == (0.75, 0.0)
    near = motion.at([-1e-9, 1e-9])
    assert near.phidot == pytest.approx(0.75, rel=1e-12)
    assert near.psidot == pytest.approx(psidot.values[0], rel=1e-12)
    motion, (phidot, _) = of(ht.Top(2, 1, 3), theta="pi", thetadot=2, psidot=3)
    assert motion.kind == "through-bottom"
    assert phidot.values[1] == -0.75
    assert motion.at([-1e-9, 1e-9]).phidot == pytest.approx(-0.75, rel=1e-12)


def test_on_the_way_to_the_vertical_the_limit_is_a_bound():
    """1/cosθ = 1 + sech t: φ̇ falls from 2/√3 to p_ψ/2A = √3/2, and never quite arrives."""
    motion, (phidot, _) = shipped("separatrix")
    assert phidot.values == pytest.approx([np.sqrt(3) / 2, 2 / np.sqrt(3)], rel=1e-15)
    assert phidot.places == [0.0, pytest.approx(np.pi / 3)]
    rate = motion.at(np.linspace(0, 12, 50)).phidot
    assert np.all(np.diff(rate) < 0)
    assert rate[-1] == pytest.approx(np.sqrt(3) / 2, rel=1e-4)


def test_constant_rates_have_no_place():
    for top, start in (
        (
            ht.Top("6.375e-3", "7.5e-4", "0.73575"),
            {"theta": "pi/3", "phidot": 10, "omega3": "140.6"},
        ),
        (UNIT, {"theta": 2}),
        (ht.Top(2, 1, 0), {"theta": 1, "psidot": 5}),
    ):
        _, both = of(top, **start)
        for rate in both:
            assert rate.values[0] == rate.values[1]
            assert rate.places == [None, None]
            assert rate.reversal is None


@pytest.mark.parametrize("start", [{"theta": 0, "psidot": 140}, {"theta": "pi", "psidot": 1}])
def test_on_the_vertical_there_are_no_rates(start):
    assert of(BOOK, **start)[1] is None


def test_a_disc_about_its_centre_stops_its_spin_and_does_not_turn_it_back():
    """At C = 2A a start with ψ̇ = 0 is the least ψ̇: zero is touched and not passed."""
    _, (_, psidot) = of(DISC, theta=1, phidot=1, psidot=0)
    assert psidot.values[0] == 0.0
    assert psidot.reversal is None


def test_rates_that_hardly_change_have_their_places():
    """A nutation of 5e-54 rad through the top: ψ̇ = 0 there, and κ + P₊/2(1 + u) at its end."""
    motion, (phidot, psidot) = of(
        ht.Top(1, 2, "1e-30"), theta=0, thetadot="1e-45", phidot="1e8", psidot="1e8"
    )
    tilt = motion.theta_max
    assert tilt == pytest.approx(5e-54, rel=1e-6)
    assert psidot.values == [0.0, pytest.approx(2e8 * tilt**2 / 4, rel=1e-14)]
    assert psidot.places == phidot.places == [0.0, tilt]
    motion, both = of(ht.Top(2, "0.25", 0), theta=0, thetadot="1e-45", omega3="1e8")
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
    """Nothing sampled lies outside, and at the tilts they name the rates are what they say."""
    both = rates(motion)
    assume(both is not None and motion.period is not None)
    assume(motion.from_top > 1e-3 and motion.from_bottom > 1e-3)
    at = motion.at(np.linspace(0, motion.period, 1001))
    a, b, kappa = (float(x) for x in (motion.reduced.a, motion.reduced.b, motion.reduced.kappa))
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


@pytest.mark.parametrize("gMR", ["3", "-3", 0])
@pytest.mark.parametrize("C", ["0.5", "1", "1.9"])
@pytest.mark.parametrize("theta0", ["1.2", "2"])
@pytest.mark.parametrize("side", [-1, 1])
def test_where_the_spin_turns_back(gMR, C, theta0, side):
    """κ (1 − u²) + b − a u = 0 has one root between the turning points."""
    start = {"theta": theta0, "thetadot": 3, "phidot": 2 * side, "psidot": -0.01 * side}
    motion, (_, psidot) = of(ht.Top(1, C, gMR), **start)
    theta = psidot.reversal
    a, b, kappa = (float(x) for x in (motion.reduced.a, motion.reduced.b, motion.reduced.kappa))
    found = [u.real for u in np.roots([-kappa, -a, kappa + b]) if abs(u.imag) < 1e-9]
    inside = [u for u in found if np.cos(motion.theta_max) < u < np.cos(motion.theta_min)]
    assert theta == pytest.approx(np.arccos(inside)[0], rel=1e-12)
    t = np.linspace(0, motion.period, 4001)
    at = motion.at(t)
    passes = np.flatnonzero(np.diff(np.sign(at.psidot)))
    assert passes.size == 2
    assert at.theta[passes] == pytest.approx(theta, abs=0.02)


@settings(max_examples=60, deadline=None)
@given(motions())
def test_one_rate_has_a_waist_and_only_the_other_can_turn_back(motion):
    """φ̇ may have an extreme inside where |p_φ| > |p_ψ|, ψ̇ where |p_φ| < |p_ψ|.

    The kinds, which are told without the roots, say which motions turn back.
    """
    both = rates(motion)
    assume(both is not None)
    phidot, psidot = wide, other = both
    if abs(motion.constants.p_phi) < abs(motion.constants.p_psi):
        wide, other = other, wide
    assert set(other.places) <= {None, motion.theta_min, motion.theta_max}
    assert wide.reversal is None
    assert (psidot.reversal is not None) == ("spin-reversal" in motion.tags)
    if (theta := phidot.reversal) is not None:
        assert np.cos(theta) == pytest.approx(float(motion.reduced.a / motion.reduced.b))
    if motion.kind != "force-free":
        assert (phidot.reversal is not None) == (motion.kind == "loops")
