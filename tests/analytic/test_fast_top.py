"""The fast top's formulas: published errors, how they fall, and where there are none."""

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.facts import facts

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")
SIMO_WONG = ht.Top(5, 1, 20)


def of(top, **start):
    return facts(ht.Motion(top, ht.State(**start)))


def errors(known):
    return [
        known.fast_top_precession_error,
        known.fast_top_period_error,
        known.fast_top_amplitude_error,
    ]


# In percent, from the closed form of another program at 50 digits.
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


def test_errors_are_those_of_the_published_period_and_precession():
    """SICM §2.10 let go: θ 0.1 … 0.18124330588605, T 0.40140587019470, Δφ 2.5447045765778."""
    known = of(BOOK, theta="0.1", psidot=140)
    T, turn = 0.40140587019470118608, 2.5447045765778085269
    drop = np.cos(0.1) - np.cos(0.18124330588605412758)
    p_psi = 6.6e-5 * 140
    assert known.fast_top_precession_rate == pytest.approx(0.0456 / p_psi, rel=1e-14)
    assert known.fast_top_nutation_period == pytest.approx(2 * np.pi * 3.28e-4 / p_psi, rel=1e-14)
    amplitude = 2 * 3.28e-4 * 0.0456 * np.sin(0.1) ** 2 / p_psi**2
    assert known.fast_top_amplitude == pytest.approx(amplitude, rel=1e-14)
    expected = [0.0456 / p_psi / (turn / T) - 1, 2 * np.pi * 3.28e-4 / p_psi / T - 1]
    assert errors(known) == pytest.approx([*expected, amplitude / drop - 1], rel=1e-12)


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
        known = facts(ht.Motion(BOOK, start))
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
    assert from_below.nutation_amplitude < facts(let_go).nutation_amplitude
    assert of(BOOK, theta="0.1", phidot=1, psidot=140).fast_top_amplitude is None
    upside_down = ht.Top("3.28e-4", "6.60e-5", "-0.0456")
    mirrored = of(upside_down, theta="pi - 0.1", psidot=-140)
    assert mirrored.fast_top_amplitude == pytest.approx(facts(let_go).fast_top_amplitude, rel=1e-15)
    assert mirrored.fast_top_amplitude_error == pytest.approx(
        facts(let_go).fast_top_amplitude_error, rel=1e-15
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
