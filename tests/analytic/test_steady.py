"""Steady precession: its rates in doubles, and its facts, against values from outside."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic import steady
from heavytop.numbers import Exact, cos

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")
CONE = ht.Top("6.375e-3", "7.5e-4", "0.73575")


def rates(top, theta, omega3):
    """The slow and the fast rate at θ, in doubles."""
    return steady.rates(top, float(top.C) * np.asarray(omega3), float(cos(Exact.of(theta))))


def known(top, theta, omega3, which="slow"):
    """The facts of a steady precession."""
    return ht.facts(top, ht.State.steady(top, theta, omega3, which))


def test_the_books_top_at_a_tenth():
    """SICM exercise 2.13: the closed form at 50 digits by another program (14 digits printed)."""
    slow, fast = rates(BOOK, "0.1", 140)
    assert slow == pytest.approx(6.3668390938832, rel=2e-14)
    assert fast == pytest.approx(21.945335558617, rel=3e-14)
    assert steady.least_spin(BOOK, 0) == pytest.approx(117.194006935969, rel=1e-14)


def test_the_cone_of_betsch():
    """Betsch & Steinmann 2002: precession 10 rad/s at p_psi/C = 140.6, exactly."""
    slow, fast = rates(CONE, "pi/3", 140.6)
    assert slow == pytest.approx(10, rel=1e-15)
    assert fast == pytest.approx(23.082352941176471, rel=1e-15)
    nodding = known(CONE, "pi/3", "140.6").small_nutation_frequency
    assert nodding == pytest.approx(10.852971464966503, rel=1e-15)
    assert 2 * np.pi / nodding == pytest.approx(0.57893686788560806, rel=1e-15)


@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
@pytest.mark.parametrize("theta", ["0.1", "1", "pi/2", "2", "3"])
@pytest.mark.parametrize("omega3", [150, -150, 1e4, 1e9])
def test_the_exact_start_has_the_same_rates(gMR, theta, omega3):
    top = ht.Top("3.28e-4", "6.60e-5", gMR)
    for name, rate in zip(("slow", "fast"), rates(top, theta, omega3), strict=True):
        if (name, theta) == ("fast", "pi/2"):
            assert np.isinf(rate)
            continue
        exact = float(ht.State.steady(top, theta, omega3, name).phidot)
        assert rate == pytest.approx(exact, rel=2e-15)


@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
@pytest.mark.parametrize("theta", ["0.3", "1", "2", "2.8"])
@pytest.mark.parametrize("name", ["slow", "fast"])
def test_a_small_nodding_has_the_frequency(gMR, theta, name):
    """The period of the closed form, when theta is pushed by 1e-6 at unchanged rates."""
    top = ht.Top("3.28e-4", "6.60e-5", gMR)
    start = ht.State.steady(top, theta, 150, name)
    pushed = ht.State(theta, thetadot="1e-6", phidot=start.phidot, omega3=150)
    period = ht.Motion(top, pushed).period
    expected = 2 * np.pi / ht.facts(top, start).small_nutation_frequency
    assert period == pytest.approx(expected, rel=1e-9)


def test_an_array_of_spins_gives_an_array_of_rates():
    spins = np.array([118.0, 140.0, 500.0])
    slow, fast = rates(BOOK, "0.1", spins)
    assert slow.shape == (3,)
    assert slow[1] == rates(BOOK, "0.1", 140)[0]
    assert np.all(fast > slow)


def test_no_gravity_no_slow_precession():
    assert rates(ht.Top(1, 1, 0), 1, 10)[0] == 0


def test_below_the_least_spin_there_is_no_rate():
    assert np.isnan(rates(BOOK, 0, [140, 117])).tolist() == [[False, True], [False, True]]
    least = steady.least_spin(BOOK, 0)
    assert np.all(np.isfinite(rates(BOOK, 0, np.nextafter(least, 200))))
    assert np.all(np.isnan(rates(BOOK, 0, least * (1 - 1e-14))))
    assert steady.least_spin(BOOK, 2) == 0
    assert not np.any(np.isfinite(rates(BOOK, "pi/2", 0)))  # nothing holds it up


def test_the_facts_of_a_cone():
    """The cone of Betsch: 10 and 23.082352941176471 rad/s, nodding with 10.852971464966503."""
    cone = known(CONE, "pi/3", "140.6")
    assert cone.mean_precession_rate == 10
    assert cone.other_precession_rate == pytest.approx(23.082352941176471, rel=1e-16)
    assert cone.small_nutation_frequency == pytest.approx(10.852971464966503, rel=1e-16)


@pytest.mark.parametrize(
    ("top", "start", "expected"),
    [
        (BOOK, {"theta": "pi/2", "omega3": 140}, (0.0456 / (6.6e-5 * 140), None)),
        (ht.Top(1, 1, 1), {"theta": "pi/3", "omega3": "sqrt(2)"}, (np.sqrt(2), None)),
        (ht.Top(1, 1, 1), {"theta": "2*pi/3", "omega3": 0}, (np.sqrt(2), -np.sqrt(2))),
        (ht.Top(1, 1, 0), {"theta": "pi/3", "omega3": 3}, (0.0, 6.0)),
        (ht.Top(1, 1, -4), {"theta": "pi/3", "omega3": 1}, (-2.0, 4.0)),
    ],
    ids=["level", "double", "no spin", "no weight", "inverted"],
)
def test_which_rates_there_are(top, start, expected):
    found = known(top, **start)
    pair = found.mean_precession_rate, found.other_precession_rate
    for rate, value in zip(pair, expected, strict=True):
        assert rate == (None if value is None else pytest.approx(value, rel=1e-15))


def linearised(g, b, theta, precession):
    """Eigenvalues of small motions about a steady one, in the frame that precesses with it.

    There the axis form ė = ℓ × e, ℓ̇ = g (−e_y, e_x, 0) is e′ = (ℓ − Ωẑ) × e,
    ℓ′ = −Ωẑ × ℓ + g (−e_y, e_x, 0), and stands still.
    """

    def cross(v):
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    z = np.array([0.0, 0.0, 1.0])
    e = np.array([np.sin(theta), 0.0, np.cos(theta)])
    moment = b * e + np.cross(e, precession * np.cross(z, e))
    pull = g * np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 0]])
    rest = np.concatenate(
        [np.cross(moment - precession * z, e), pull @ e - precession * np.cross(z, moment)]
    )
    assert np.max(np.abs(rest)) < 1e-9 * (1 + b * b + abs(g) + precession**2)
    jacobian = np.block(
        [[cross(moment - precession * z), -cross(e)], [pull, -precession * cross(z)]]
    )
    return np.linalg.eigvals(jacobian)


def fractions(low, high):
    return st.fractions(low, high, max_denominator=1000)


@settings(max_examples=100, deadline=None)
@given(fractions(-4, 4), fractions(-8, 8), fractions("0.05", "3.09"), fractions("0.1", 4))
def test_nodding_is_an_eigenvalue_of_the_linearised_motion(gMR, omega3, theta, A):
    """Of six, four are zero (|e|, e·ℓ, ℓ_z and where φ starts) and two are ± i ω."""
    assume(omega3**2 > 4 * gMR / A * Fraction(np.cos(float(theta))))
    found = known(ht.Top(A, A, gMR), theta, omega3)
    slow, fast = found.mean_precession_rate, found.other_precession_rate
    frequencies = found.small_nutation_frequency, found.other_nutation_frequency
    assert fast is None or abs(slow) <= abs(fast) * (1 + 1e-15)
    for rate, nodding in zip((slow, fast), frequencies, strict=True):
        if rate is not None and abs(rate) < 1e3:
            values = linearised(float(gMR / A), float(omega3), float(theta), rate)
            scale = 1 + abs(rate) + abs(float(omega3))
            assert np.min(np.abs(values - 1j * nodding)) < 1e-6 * scale or nodding < 0.1
            assert np.max(np.abs(values)) == pytest.approx(nodding, abs=1e-3 * scale)
