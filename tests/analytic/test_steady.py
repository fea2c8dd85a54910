"""Steady precession in doubles, against values from outside and the exact start."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.theory import steady

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")
CONE = ht.Top("6.375e-3", "7.5e-4", "0.73575")


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
