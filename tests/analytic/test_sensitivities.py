"""T, Δφ and Δψ and their derivatives against elementary quadrature, and against integration."""

from fractions import Fraction

import pytest

import heavytop as ht
from heavytop.errors import Impossible

from ..by_hand import ByHand
from ..motions import BOOK, shipped

# beside C = 2A is no rigid body, and beyond a pole a tilt is folded
pytestmark = pytest.mark.filterwarnings("ignore::UserWarning")

STEP, NODES = Fraction(1, 10**12), 100

MOTIONS = {
    "loops": (BOOK, ht.State("0.1", phidot=-15, psidot=140)),
    "cusps": (BOOK, ht.State("0.1", psidot=140)),
    "rising": (BOOK, ht.State("0.4", thetadot=-2, phi="0.3", phidot=3, psi="-1.1", omega3=150)),
    "gravity turned round": (
        ht.Top("0.7", "0.9", "-1.3"), ht.State("1.2", thetadot="0.4", phidot="0.8", psidot=-2),
    ),
    "a spherical pendulum": (ht.Top(1, "0.4", 1), ht.State(2, thetadot="0.1", phidot="0.6")),
    "C = 2A": (ht.Top(1, 2, 1), ht.State(1, thetadot="0.1", phidot="0.6", psidot=2)),
}  # fmt: skip
THROUGH_TOP = ht.State.from_constants(BOOK, E="0.8", p_phi="9.24e-3", p_psi="9.24e-3", theta=1)


def numbers_of(top, start):
    names = ("theta", "thetadot", "phidot", start.held)
    return {x: getattr(top, x) for x in ("A", "C", "gMR")} | {x: getattr(start, x) for x in names}


def by_quadrature(A, C, gMR, **start):
    """T, Δφ and Δψ as integrals over u = cosθ = m - d cos s, where the integrands are periodic."""
    by_hand = ByHand(ht.Top(A, C, gMR), ht.State(**start), 40)
    mp, g, roots = by_hand.mp, by_hand.g, by_hand.roots
    low, high, third = roots if g > 0 else (roots[1], roots[2], roots[0])
    total = [mp.mpf(0)] * 3
    for k in range(NODES):
        v = (low + high) / 2 - (high - low) / 2 * mp.cos(2 * mp.pi * (k + mp.mpf(1) / 2) / NODES)
        dt = 2 * mp.pi / NODES / mp.sqrt(2 * g * (third - v))
        turn = (by_hand.a - by_hand.b * v) / (1 - v * v)
        rates = (1, turn, by_hand.omega3 - turn * v)
        total = [x + y * dt for x, y in zip(total, rates, strict=True)]
    return total


def slopes_by_quadrature(top, start):
    """By x: the derivatives of T, Δφ and Δψ."""
    numbers, found = numbers_of(top, start), {}
    for x, value in numbers.items():
        ends = [by_quadrature(**numbers | {x: value + by}) for by in (-STEP, STEP)]
        found[x] = [(high - low) / float(2 * STEP) for low, high in zip(*ends, strict=True)]
    return found


def off(found, top, start):
    """The largest error, relative to the derivative or to a thousandth of its natural size."""
    period, numbers = ht.Motion(top, start).period, numbers_of(top, start)
    worst = 0.0
    for x, slopes in slopes_by_quadrature(top, start).items():
        size = abs(float(numbers[x])) or 1 / period
        for quantity, slope, natural in zip(found, slopes, (period, 1, 1), strict=True):
            error = abs(found[quantity][x] - slope)
            worst = max(worst, error / max(abs(slope), 1e-3 * natural / size))
    return worst


@pytest.mark.parametrize("which", MOTIONS)
def test_a_period_and_its_sensitivities_are_those_of_elementary_quadrature(which):
    motion, found = ht.Motion(*MOTIONS[which]), ht.sensitivities(*MOTIONS[which])
    for name, exact in zip(found, by_quadrature(**numbers_of(*MOTIONS[which])), strict=True):
        assert abs(motion.mpf(name, 30) - exact) < 1e-15 * abs(exact)
    assert list(found) == ["period", "precession", "spin"]
    assert off(found, *MOTIONS[which]) < 1e-13


# By the variational equations of the attitude form, integrated by heyoka 7.13 in 128 to 256 bits:
# of T, Δφ and Δψ, by A, C, gMR, theta, thetadot, phidot and the spin
INTEGRATED = {
    "near a separatrix": (shipped("near-separatrix"), """
        17321463.14964349 45127376.88163982 -39885151.5904634 -10000571.021335434 0.0
        49542351.093547575 6513575.826072743
        43028802.988798305 -60003302.673305646 -13027151.652145486 -24842725.30108752 0.0
        48545882.36598477 -8660730.775521372
        16974536.66985433 216328997.94029877 -125139035.64000371 -9800284.931133067 0.0
        123073856.44991429 31224438.59624763"""),
    "through the top": (ht.Motion(BOOK, THROUGH_TOP), """
        218.43750073632359 -1276.7296975245135 0.27668113585753856 -0.012482687133195064
        -0.0037287616495312705 -0.0013750455781285221 -0.0006018868574044135
        -947.2251844844124 -1593.3218328564503 9.119497839460811 -0.05424607027495466
        -0.022774219564324207 -0.010599751573870728 -0.0007511374354894694
        38963.821628668586 -221316.5822555587 40.060546812797746 -1.5868942084576945
        -0.4397589064692236 -0.15068645592853136 0.06705833481744781"""),
}  # fmt: skip


@pytest.mark.parametrize("which", INTEGRATED)
def test_sensitivities_are_those_of_integrated_variational_equations(which):
    """Where quadrature has few digits; through the top the angles jump, derivatives do not."""
    motion, text = INTEGRATED[which]
    found = ht.sensitivities(motion.top, motion.start)
    slopes = [slope for by in found.values() for slope in by.values()]
    assert slopes == pytest.approx([*map(float, text.split())], rel=1e-13, abs=1e-30)


def test_a_start_at_a_pole_and_a_pass_of_both():
    """The other side of a pole is no start; a pendulum that turns over passes both."""
    for start in (ht.State(0, thetadot=1, omega3=2), ht.State(2, thetadot=3)):
        top = ht.Top(1, "0.5", 1)
        exact = slopes_by_quadrature(top, start)
        found = ht.sensitivities(top, start)["period"]
        assert list(found.values()) == pytest.approx([float(x[0]) for x in exact.values()], 1e-13)


def test_what_does_not_nutate_is_refused():
    scene = ht.load_scene("separatrix")
    with pytest.raises(Impossible, match="start: one that nutates: separatrix has no period"):
        ht.sensitivities(scene.top, scene.start)
