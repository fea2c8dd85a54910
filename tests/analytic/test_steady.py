"""Steady precession in doubles, against values from outside and the exact start."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic import facts, steady
from heavytop.classification.reduced import FromScene
from heavytop.numbers.intervals import working

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")
CONE = ht.Top("6.375e-3", "7.5e-4", "0.73575")
BITS = 4096


def test_the_books_top_at_a_tenth():
    """SICM exercise 2.13: the closed form at 50 digits by another program (14 digits printed)."""
    assert steady.slow(BOOK, "0.1", 140) == pytest.approx(6.3668390938832, rel=2e-14)
    assert steady.fast(BOOK, "0.1", 140) == pytest.approx(21.945335558617, rel=3e-14)
    assert steady.slow_limit(BOOK, 140) == pytest.approx(4.93506, abs=5e-6)
    low = 1 - steady.slow_limit(BOOK, 140) / steady.slow(BOOK, "0.1", 140)
    assert round(100 * low) == 22
    assert steady.least_spin(BOOK, 0) == pytest.approx(117.194006935969, rel=1e-14)


def test_the_cone_of_betsch():
    """Betsch & Steinmann 2002: precession 10 rad/s at p_psi/C = 140.6, exactly."""
    assert steady.slow(CONE, "pi/3", 140.6) == pytest.approx(10, rel=1e-15)
    assert steady.fast(CONE, "pi/3", 140.6) == pytest.approx(23.082352941176471, rel=1e-15)
    nodding = steady.nutation_frequency(CONE, "pi/3", 10)
    assert nodding == pytest.approx(10.852971464966503, rel=1e-15)
    assert 2 * np.pi / nodding == pytest.approx(0.57893686788560806, rel=1e-15)


@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
@pytest.mark.parametrize("theta", ["0.1", "1", "pi/2", "2", "3"])
@pytest.mark.parametrize("omega3", [150, -150, 1e4, 1e9])
def test_the_exact_start_has_the_same_rates(gMR, theta, omega3):
    top = ht.Top("3.28e-4", "6.60e-5", gMR)
    for name in ("slow", "fast"):
        if (name, theta) == ("fast", "pi/2"):
            continue
        exact = float(ht.State.steady(top, theta, omega3, name).phidot)
        assert getattr(steady, name)(top, theta, omega3) == pytest.approx(exact, rel=2e-15)


@pytest.mark.parametrize("gMR", ["0.0456", "-0.0456"])
@pytest.mark.parametrize("theta", ["0.3", "1", "2", "2.8"])
@pytest.mark.parametrize("name", ["slow", "fast"])
def test_a_small_nodding_has_the_frequency(gMR, theta, name):
    """The period of the closed form, when theta is pushed by 1e-6 at unchanged rates."""
    top = ht.Top("3.28e-4", "6.60e-5", gMR)
    rate = getattr(steady, name)(top, theta, 150.0)
    pushed = ht.State(theta, thetadot="1e-6", phidot=rate, omega3=150)
    period = ht.Motion(top, pushed).period
    expected = 2 * np.pi / steady.nutation_frequency(top, theta, rate)
    assert period == pytest.approx(expected, rel=1e-9)


def test_an_array_of_spins_gives_an_array_of_rates():
    spins = np.array([118.0, 140.0, 500.0])
    rates = steady.slow(BOOK, "0.1", spins)
    assert rates.shape == (3,)
    assert rates[1] == steady.slow(BOOK, "0.1", 140)
    assert np.all(steady.fast(BOOK, "0.1", spins) > rates)


def test_the_limits_are_first_orders():
    spin = np.array([1e4, 1e5])
    for exact, limit in (
        (steady.slow(BOOK, 1, spin), steady.slow_limit(BOOK, spin)),
        (steady.fast(BOOK, 1, spin), steady.fast_limit(BOOK, 1, spin)),
    ):
        off = abs(limit / exact - 1)
        assert off[0] < 1e-4
        assert off[0] / off[1] == pytest.approx(100, rel=1e-3)


def test_no_gravity_no_slow_precession():
    assert steady.slow(ht.Top(1, 1, 0), 1, 10) == 0


def test_too_slow_a_spin_is_refused_with_the_least():
    with pytest.raises(ht.ImpossibleStart, match="at least 117"):
        steady.slow(BOOK, 0, [140, 117])
    assert np.isfinite(steady.slow(BOOK, 0, np.nextafter(steady.least_spin(BOOK, 0), 200)))
    assert steady.least_spin(BOOK, 2) == 0
    with pytest.raises(ht.ImpossibleStart, match="no fast rate"):
        steady.fast(BOOK, "pi/2", 140)
    with pytest.raises(ht.ImpossibleStart, match="not 0"):
        steady.slow(BOOK, "pi/2", 0)


def pair_and_frequencies(top, theta, **rates):
    """The two rates of one motion, and the frequencies of small nodding about them."""
    with working(BITS):
        start = FromScene(top, ht.State(theta, **rates)).reduced(BITS)
        pair = facts.steady_pair(start)
        nodding = [None if rate is None else facts.small_nutation(start, rate) for rate in pair]
        return [[None if x is None else float(x.mid()) for x in each] for each in (pair, nodding)]


def test_the_pair_of_one_motion():
    """The cone of Betsch: 10 and 23.082352941176471 rad/s, nodding with 10.852971464966503."""
    (slow, fast), nodding = pair_and_frequencies(CONE, "pi/3", phidot=10, omega3="140.6")
    assert slow == 10
    assert fast == pytest.approx(23.082352941176471, rel=1e-16)
    assert nodding[0] == pytest.approx(10.852971464966503, rel=1e-16)
    pair, _ = pair_and_frequencies(BOOK, "0.1", omega3=140)
    assert pair == pytest.approx([6.3668390938832, 21.945335558617], rel=3e-14)


@pytest.mark.parametrize(
    ("top", "start", "rates"),
    [
        (BOOK, {"theta": "0.1", "omega3": 100}, (None, None)),
        (BOOK, {"theta": "pi/2", "omega3": 140}, (0.0456 / (6.6e-5 * 140), None)),
        (ht.Top(1, 1, 1), {"theta": "pi/3", "omega3": "sqrt(2)"}, (np.sqrt(2), None)),
        (ht.Top(1, 1, 1), {"theta": "2*pi/3", "omega3": 0}, (np.sqrt(2), -np.sqrt(2))),
        (ht.Top(1, 1, 1), {"theta": "pi/2", "omega3": 0}, (None, None)),
        (ht.Top(1, 1, 0), {"theta": "pi/3", "omega3": 3}, (0.0, 6.0)),
        (ht.Top(1, 1, -4), {"theta": "pi/3", "omega3": 1}, (-2.0, 4.0)),
    ],
    ids=["too slow", "level", "double", "no spin", "nothing holds", "no weight", "inverted"],
)
def test_which_rates_there_are(top, start, rates):
    found, _ = pair_and_frequencies(top, **start)
    for rate, expected in zip(found, rates, strict=True):
        assert (rate is None) == (expected is None)
        assert rate is None or rate == pytest.approx(expected, rel=1e-15)


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
    (slow, fast), frequencies = pair_and_frequencies(ht.Top(A, A, gMR), theta, omega3=omega3)
    assert fast is None or abs(slow) <= abs(fast) * (1 + 1e-15)
    for rate, nodding in zip((slow, fast), frequencies, strict=True):
        if rate is not None and abs(rate) < 1e3:
            values = linearised(float(gMR / A), float(omega3), float(theta), rate)
            scale = 1 + abs(rate) + abs(float(omega3))
            assert np.min(np.abs(values - 1j * nodding)) < 1e-6 * scale or nodding < 0.1
            assert np.max(np.abs(values)) == pytest.approx(nodding, abs=1e-3 * scale)
