"""Motion: what a user asks of one top and one start, at the ends of what a scene may say too."""

from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import NoClosedForm
from heavytop.exact.decimals import context

from ..motions import BOOK, CONE, KICKED, MARGINAL, product, shipped

RATES = ("thetadot", "phidot", "psidot")
CTX = context(50)


def test_digits_and_many_times():
    """at(t, digits) gives numbers; many times a tuple; without digits arrays."""
    motion = ht.Motion(BOOK, KICKED)
    one = motion.at(2, digits=40)
    assert abs(one.theta - motion.at(2, 60).theta) < 1e-40
    assert motion.at([Fraction(1, 3), 2], digits=40)[1].phi == one.phi
    assert motion.at([0.0, 1.0, 2.0]).theta.shape == (3,)
    assert motion.from_top == 0.1
    assert motion.from_bottom == pytest.approx(np.pi - motion.theta_max, rel=1e-15)
    assert ht.classify(BOOK, KICKED) == motion.verdict
    for late in (1e19, "1e40"):
        assert abs(motion.at(late, digits=20).theta - motion.at(late, 50).theta) < 1e-20
    with pytest.raises(NoClosedForm, match="ask for digits"):
        motion.at(1e30)
    for digits in (0, 10_001, "20"):
        with pytest.raises(ValueError, match="a whole number from 1 to 10000"):
            motion.at(1, digits=digits)


# --- attitude, angular velocity and energy -------------------------------------------------------

NAMES = ("sicm-kicked", "lie-group-benchmark", "through-top", "inverted-gravity", "spin-reversal")
TIMES = ("0", "1.81")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("t", TIMES)
def test_quaternion_omega_and_energy_hold_together(name, t):
    motion, exact = shipped(name), CTX.mpf(t)
    record = motion.at(exact, 50)
    q, omega = record.quaternion, record.omega
    size = max(map(abs, omega))
    axis = product(product(q, (0, 0, 0, 1)), (q[0], *(-x for x in q[1:])))[1:]
    assert max(abs(x - e) for x, e in zip(axis, record.axis, strict=True)) < 1e-45
    if name != "through-top" or exact:  # at the pole itself φ and ψ are of one side
        h = CTX.mpf(10) ** -12 / max(1, size)
        after, before = (motion.at(exact + s * h, 50).quaternion for s in (1, -1))
        spun = product((0, *omega), q)  # dq/dt = ω q / 2; differences are good to h²
        for x, y, z in zip(after, before, spun, strict=True):
            assert abs((x - y) / h - z) < 1e-20 * size
    A, C, gMR = (value.mpf(CTX) for value in (motion.top.A, motion.top.C, motion.top.gMR))
    along = sum(x * y for x, y in zip(omega, record.axis, strict=True))
    across = sum(x * x for x in omega) - along**2
    energy = A / 2 * across + C / 2 * along**2 + gMR * record.axis[2]
    assert abs(energy - record.energy) < 1e-40 * abs(record.energy)
    assert abs(along - record.omega3) < 1e-44 * abs(along)
    double = motion.at(float(t))
    exact = motion.at(CTX.mpf(float(t)), 50)
    off = np.abs(double.quaternion - np.array(exact.quaternion, float)).max()
    assert off < 4e-15 * (1 + abs(float(exact.psi)) / 100)
    assert np.abs(double.omega - np.array(exact.omega, float)).max() < 1e-13 * float(size)
    assert double.energy == pytest.approx(float(exact.energy), rel=4e-16)


# --- rates, times and tilts far from 1 -----------------------------------------------------------


@pytest.mark.parametrize(("top", "start"), [
    (ht.Top(1, "0.5", "1e300"), ht.State("2.5", thetadot="0.1", phidot=3)),
    (ht.Top(1, "0.5", "1/3"), ht.State("pi/3", phidot="1e15", psidot="1e-16")),
])  # fmt: skip
def test_a_slow_rate_in_a_fast_motion_has_its_digits(top, start):
    """Digits count from max(1, |x|), not from the fastest rate."""
    record = ht.Motion(top, start).at(0, digits=30)
    for name in RATES:
        assert abs(getattr(record, name) - getattr(start, name).mpf(record.t.context)) < 1e-29


@pytest.mark.parametrize("off", ["1e-290", "-1e-290"])
def test_no_threshold_decides_what_nutates(off):
    off = ht.Exact.of(off)
    for top, start in (
        (CONE, ht.State("pi/3", thetadot=off, phidot=10, psidot="135.6")),
        (CONE, ht.State("pi/3", phidot=10 + off, psidot="135.6")),
        (MARGINAL, ht.State("pi/3", phidot="2/sqrt(3)", omega3=ht.Exact.of("2*sqrt(3)") + off)),
        (MARGINAL, ht.State(0, omega3=3, thetadot=off)),
        (ht.Top(2, 1, off), ht.State("pi/2", phidot=1)),
    ):
        assert ht.Motion(top, start).regime.name == "nutating"


@pytest.mark.parametrize("tilt", ["1e-150", "1e-300"])
@pytest.mark.parametrize("below", [False, True])
def test_doubles_have_rates_where_the_distance_from_a_pole_is_too_small_for_one(tilt, below):
    theta, gMR = (f"pi - {tilt}", -1) if below else (tilt, 1)
    motion = ht.Motion(ht.Top(1, 1, gMR), ht.State(theta, phidot=2, omega3="1e-8"))
    for t in (0.0, 1.0):
        doubles, exact = motion.at(t), motion.at(t, digits=20)
        for name in ("theta", *RATES):
            assert getattr(doubles, name) == pytest.approx(float(getattr(exact, name)), rel=1e-13)


def test_an_angle_too_large_for_a_double_has_a_name():
    motion = ht.Motion(ht.Top(1, 1, 0), ht.State("pi/3", psidot="1e15"))
    with pytest.raises(NoClosedForm, match="digits"):
        motion.at(1e300).psi  # noqa: B018
    exact = motion.at(1e300, digits=20)
    assert abs(exact.psi / (10**15 * exact.t) - 1) < 1e-19
