"""Facts of a motion: published values, every kind, means against sums over the motion, JSON."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic.facts import Facts, facts
from heavytop.scene.scene import shipped_scenes

BOOK = ht.Top("3.28e-4", "6.60e-5", "0.0456")
TWO = ht.Top(2, 1, 3)
UPSIDE_DOWN = ht.Top(2, 1, -3)
WEIGHTLESS = ht.Top(2, 1, 0)


def of(top, **start):
    return facts(ht.Motion(top, ht.State(**start)))


def shipped(name):
    scene = ht.load_scene(name)
    return facts(ht.Motion(scene.top, scene.start))


def test_the_kicked_top():
    """SICM §2.10 at φ̇₀ = −15: T = 0.54289551818821995785, Δφ = 3.9741816546440002896."""
    known = shipped("sicm-kicked")
    T, turn = 0.54289551818821995785, 3.9741816546440002896
    assert known.nutation_frequency == pytest.approx(2 * np.pi / T, rel=1e-15)
    assert known.mean_precession_rate == pytest.approx(turn / T, rel=1e-15)
    assert known.rotation_number == pytest.approx(turn / 2 / np.pi, rel=1e-15)
    drop = np.cos(0.1) - np.cos(0.51723131823843479801)
    assert known.nutation_amplitude == pytest.approx(drop, rel=1e-14)
    assert known.phidot_reverses
    assert known.phidot_reversal_theta == pytest.approx(0.148027354547, abs=5e-13)
    assert known.psidot_min == pytest.approx(114.35023027, abs=5e-9)
    assert (known.phidot_min, known.psidot_max) == (-15, 140)
    assert known.sleeping_threshold == pytest.approx(117.194006935969, rel=1e-14)
    assert known.stable is known.steady_branch is known.growth_rate is None


def test_the_cone_in_steady_precession():
    """Betsch: 10 rad/s; the other rate 23.082352941176471, nodding 10.852971464966503 rad/s."""
    known = shipped("steady-betsch")
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
    one, two = (
        facts(ht.Motion(top, ht.State.steady(top, theta, 140, name))) for name in (which, other)
    )
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


def test_on_the_separatrix_nothing_repeats():
    known = shipped("separatrix")
    assert known.phidot_max == pytest.approx(2 / math.sqrt(3), rel=1e-15)
    assert known.phidot_min == pytest.approx(math.sqrt(3) / 2, rel=1e-15)
    assert known.mean_precession_rate is known.nutation_frequency is known.stable is None


def test_a_free_top_whose_precession_goes_to_and_fro_gets_nowhere():
    known = of(WEIGHTLESS, theta=1, phidot=1, psidot=20)
    assert known.phidot_reverses
    assert known.mean_precession_rate == known.rotation_number == 0
    assert known.sleeping_threshold is known.fast_top_ratio is None


def test_jumps_at_poles_are_part_of_the_means():
    """A swing through the bottom turns φ by half a turn, though φ̇ is nought all the time."""
    swing = of(TWO, theta=1)
    assert (swing.phidot_min, swing.phidot_max, swing.phidot_reverses) == (0, 0, False)
    assert swing.rotation_number == 0.5


numbers = st.fractions(-4, 4, max_denominator=1000)


@settings(max_examples=60, deadline=None)
@given(
    st.fractions("0.1", 4, max_denominator=100),
    st.fractions("0.01", 2, max_denominator=100),
    st.fractions("0.2", "2.9", max_denominator=1000),
    numbers, numbers, numbers, numbers,
)  # fmt: skip
def test_means_are_averages_over_the_motion(A, flat, theta, gMR, thetadot, phidot, psidot):
    """The mean of equidistant samples over a period, which is exact for what is smooth."""
    motion = ht.Motion(
        ht.Top(A, A * flat, gMR), ht.State(theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    )
    known = facts(motion)
    assert all(f is None or isinstance(f, bool | str) or math.isfinite(f) for f in values(known))
    assume(motion.period is not None)
    assume(min(motion.from_top, motion.from_bottom) > 0.2)
    assume(motion.exact.modulus[1] > 1e-3)
    at = motion.at(np.arange(1024) / 1024 * motion.period)
    rounding = 1e-12 * (1 + abs(known.omega3) + known.nutation_frequency)
    mean = np.mean(at.phidot)
    assert known.mean_precession_rate == pytest.approx(mean, rel=1e-10, abs=rounding)
    assert known.mean_spin_rate == pytest.approx(np.mean(at.psidot), rel=1e-10, abs=rounding)
    assert known.phidot_min <= known.mean_precession_rate <= known.phidot_max
    assert known.psidot_min <= known.mean_spin_rate <= known.psidot_max
    assert known.nutation_amplitude == pytest.approx(np.ptp(at.u), rel=1e-4)


def values(known):
    return known.document().values()


PAGE = (Path(__file__).parents[2] / "docs" / "facts.md").read_text("utf-8")
FACTS, PRINTED = PAGE.split("## What classify prints")
ROWS = re.findall(r"^\| (`.*?) \|", FACTS, re.MULTILINE)
NAMES = re.findall(r"`(\w+)`", " ".join(ROWS))
"""The facts that the page on them describes."""


def test_the_page_describes_every_fact_once():
    assert sorted(NAMES) == sorted(Facts(omega3=1.0).document())


def test_what_classify_prints_is_told_by_facts_that_there_are():
    told = {name for name in re.findall(r"`(\w+)`", PRINTED) if name.isascii() and "_" in name}
    assert told
    assert told <= set(NAMES)


@pytest.mark.parametrize("name", shipped_scenes())
def test_every_shipped_scene_has_a_flat_document(name):
    """The names are always the same, and the values numbers, true or false, one word, or null."""
    document = shipped(name).document()
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
