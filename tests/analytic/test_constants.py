"""The constants of the motion and the reduced motion, against the textbook definitions."""

from fractions import Fraction

import pytest

from heavytop.analytic.closed_form import constants, midpoint
from heavytop.classification.reduced import (
    FromAxis,
    FromConstants,
    FromScene,
    Reduced,
    Regime,
    Through,
)
from heavytop.errors import NotANumber
from heavytop.numbers.decimals import context, digits_lost, number, threshold, vanishes
from heavytop.numbers.intervals import Interval, rational, working
from heavytop.scene.state import State
from heavytop.scene.top import Top

CTX = context(60)
BITS = 300
NAMES = ("g", "a", "b", "h", "u0", "udot0", "P_plus", "P_minus", "kinetic0", "drift0",
         "one_minus_u0", "one_plus_u0", "over_top", "over_bottom", "pull", "looping",
         "kappa")  # fmt: skip


def close(one, other, digits=50):
    return abs(one - other) <= CTX.mpf(10) ** -digits * max(1, abs(other))


def reduced(source, bits=BITS, names=NAMES):
    """The numbers of a reduced motion, middles of intervals, and φ₀ and ψ₀."""
    with working(bits):
        found = source.reduced(bits)
        numbers = {name: midpoint(CTX, getattr(found, name)) for name in names}
        phi0, psi0 = (midpoint(CTX, ball) for ball in source.angles(bits))
    return numbers | {"phi0": phi0, "psi0": psi0}


def test_definitions():
    """E = ½A(θ̇² + φ̇² sin²θ) + p_ψ²/2C + gMR cosθ and the momenta, written out."""
    top, start = (
        Top("3.28e-4", "6.6e-5", "0.0456"),
        State("0.1", thetadot="0.7", phidot=-15, psidot=140),
    )
    A, C, gMR, th, thd, phd, psd = map(
        CTX.mpf, ("3.28e-4", "6.6e-5", "0.0456", "0.1", "0.7", "-15", "140")
    )
    omega3 = psd + phd * CTX.cos(th)
    p_psi = C * omega3
    E_prime = A / 2 * (thd**2 + (phd * CTX.sin(th)) ** 2) + gMR * CTX.cos(th)
    found = constants(top, start)
    assert close(found.E_prime, E_prime)
    assert close(found.E, E_prime + p_psi**2 / (2 * C))
    assert close(found.p_psi, p_psi)
    assert close(found.p_phi, A * phd * CTX.sin(th) ** 2 + p_psi * CTX.cos(th))
    assert found.floats["p_psi"] == float(p_psi)
    exact = reduced(FromScene(top, start))
    assert close(exact["a"], found.p_phi / A)
    assert close(exact["h"], E_prime / A)
    assert close(exact["kappa"], omega3 - p_psi / A)


@pytest.mark.parametrize("digits", [20, 60, 300])
def test_constants_have_the_digits(digits):
    top, start = Top("3.28e-4", "6.6e-5", "0.0456"), State("0.1", phidot=-15, psidot=140)
    ctx = context(2 * digits)
    A, C, gMR, u = (x.mpf(ctx) for x in (top.A, top.C, top.gMR, start.theta))
    u, sin2 = ctx.cos(u), ctx.sin(u) ** 2
    p_psi = C * (140 - 15 * u)
    found = constants(top, start, digits)
    for value, want in (
        (found.E_prime, A / 2 * 225 * sin2 + gMR * u),
        (found.p_phi, -15 * A * sin2 + p_psi * u),
        (found.p_psi, p_psi),
        (found.E, A / 2 * 225 * sin2 + gMR * u + p_psi**2 / (2 * C)),
    ):
        assert abs(ctx.mpf(value) / want - 1) < ctx.mpf(10) ** (1 - digits)


def test_lie_group_benchmark_constants():
    """E, p_φ, p_ψ as the benchmark's decimals give them (Brüls, Cardona & Arnold 2012)."""
    top = Top("15.234375", "0.46875", "147.15")
    found = constants(top, State("pi/2", phi="pi", phidot="-4.61538", psidot=150))
    assert close(found.E, CTX.mpf("5435.696790865546875"))
    assert close(found.p_phi, CTX.mpf("-70.3124296875"))
    assert close(found.p_psi, CTX.mpf("70.3125"))


def test_held_spin_is_used_as_given():
    """A kick that holds ω3 has p_ψ = C ω3 exactly."""
    start = State.kicked(theta="0.1", omega3=140, phidot=15)
    assert close(constants(Top(2, 1, 3), start).p_psi, 140)


ARGS = (2.0, 1.25, 3.0, 0.7, -1.1, 0.4, 0.3, -0.8, 5.0)


def scene_of(A, C, gMR, theta, phi, psi, thetadot, phidot, psidot):
    rates = {"thetadot": thetadot, "phidot": phidot, "psidot": psidot}
    return FromScene(Top(A, C, gMR), State(theta, phi=phi, psi=psi, **rates))


def test_axis_and_angles_define_the_same_motion():
    """e, ℓ made from the angles give back every number of the reduced motion, and φ₀, ψ₀."""
    by_angles = scene_of(*ARGS)
    A, C, gMR, th, ph, ps, thd, phd, psd = map(CTX.mpf, ARGS)
    s, c, sp, cp = CTX.sin(th), CTX.cos(th), CTX.sin(ph), CTX.cos(ph)
    e = (s * sp, -s * cp, c)
    edot = (
        c * sp * thd + s * cp * phd,
        -c * cp * thd + s * sp * phd,
        -s * thd,
    )
    b = C / A * (psd + phd * c)
    cross = [e[i - 2] * edot[i - 1] - e[i - 1] * edot[i - 2] for i in range(3)]
    l = [cross[i] + b * e[i] for i in range(3)]  # noqa: E741
    kappa = reduced(by_angles)["kappa"]
    by_axis = reduced(
        FromAxis(
            map(rational, e), map(rational, l), *map(rational, (gMR / A, kappa)), psi0=rational(ps)
        )
    )
    for name, value in reduced(by_angles).items():
        assert close(by_axis[name], value), name


@pytest.mark.parametrize("falls", [True, False])
def test_constants_define_the_same_motion(falls):
    """So do the constants of the motion and the place, all of them rational."""
    g, b, drift, u = Fraction(3, 2), Fraction(2), Fraction(-1, 3), Fraction(1, 4)
    udot2 = Fraction(1, 9)
    kinetic = (udot2 + drift**2) / (2 * (1 - u**2))
    zero, kappa = Fraction(0), Fraction(1, 2)
    motion = Reduced(g, b, u, 1 - u, 1 + u, zero, drift, kinetic, kappa)
    found = FromConstants(motion, udot2, falls)
    at = reduced(found)
    root = CTX.sqrt(CTX.mpf(15)) / 4
    phidot = Fraction(-1, 3) / (1 - u**2)
    omega3 = 2 * b  # C = A/2, and so κ = ω₃/2
    theta = rational(CTX.acos(CTX.mpf("0.25")))
    thetadot = rational((1 if falls else -1) / (3 * root))
    scene = scene_of(1, "0.5", g, theta, 0, 0, thetadot, phidot, omega3 - phidot * u)
    for name, value in reduced(scene).items():
        if name != "kappa":
            assert close(at[name], value), name
    assert close(at["kappa"], CTX.mpf("0.5"))
    assert not found.vanishes("udot0")
    assert found.vanishes("P_minus") == (drift == b * (1 - u))


def test_through_a_pole_moves_no_more_than_it_must():
    """A start rounded off one that passes exactly: p_φ and E' move by the rounding, b stays."""
    off = Fraction(1, 10**17)
    rounded = scene_of(2, 1, 3, "pi/3", 0, 0, "0.5", 1 + off, "2.5")  # P₋ is about 1e-17
    passing = Through(rounded, top=True, bottom=False)
    regime = Regime.of(passing)
    assert not regime.misses_top
    assert Regime.of(rounded).misses_top
    before, after = reduced(rounded), reduced(passing)
    assert after["P_minus"] == 0
    for name in ("g", "b", "u0", "udot0", "kappa", "phi0", "psi0"):
        assert after[name] == before[name], name
    for name in ("drift0", "kinetic0"):
        assert 0 < abs(after[name] - before[name]) < 1e-16, name
    f = 2 * after["kinetic0"] * after["one_minus_u0"] * after["one_plus_u0"] - after["drift0"] ** 2
    assert close(f, after["udot0"] ** 2)


def test_a_long_axis_is_a_unit_axis_with_more_gravity():
    """|e| = ρ: e/ρ obeys the same equations with g ρ; here ρ = 2."""
    l = (0.5, -1.0, 3.0)  # noqa: E741
    double = reduced(FromAxis((1.2, 0.0, 1.6), l, 1.5))
    unit = reduced(FromAxis((Fraction(1.2) / 2, 0, Fraction(1.6) / 2), l, 3.0))
    assert abs(double["u0"] - 0.8) < 1e-15
    rho = CTX.sqrt(CTX.mpf(1.2) ** 2 + CTX.mpf(1.6) ** 2)
    assert close(double["g"], CTX.mpf(1.5) * rho)
    for name in ("a", "b", "u0", "udot0", "kinetic0"):
        assert close(double[name], unit[name], 15), name


def test_expansion_about_the_start_is_the_cubic():
    """f(u₀ + d) by its Taylor coefficients against f as it is defined."""
    source = scene_of(2, 1, 3, 0.7, 0, 0, 0.3, -0.8, 5)
    with working(BITS):
        f3, f2, f1, f0 = (midpoint(CTX, x) for x in source.reduced(BITS).cubic)
    at = reduced(source)
    for d in (CTX.mpf("0.1"), CTX.mpf("-0.4")):
        u = at["u0"] + d
        f = 2 * (at["h"] - at["g"] * u) * (1 - u * u) - (at["a"] - at["b"] * u) ** 2
        assert close(f0 + d * (f1 + d * (f2 + d * f3)), f)


def test_sums_keep_their_digits_near_a_pole():
    """P₋ of a start 1e-25 from the top has its digits: a − b as a difference has none."""
    source = scene_of(2, 1, 3, Fraction(1, 10**25), 0, 0, 0, 7, 5)
    with working(200):
        found = source.reduced(200)
        P_minus, difference = Interval.of(found.P_minus), Interval.of(found.a - found.b)
    assert P_minus.spread < abs(P_minus.middle) / 10**55
    assert difference.spread > abs(P_minus.middle) / 10**15
    with working(600):
        assert Interval.of(source.reduced(600).P_minus) in P_minus


def test_more_bits_go_back_to_the_exact_numbers():
    """A third read at 200 bits is a third to 150 digits when computed again at 520."""
    source, third = scene_of(3, 1, 1, 1, 0, 0, 0, 0, 1), Fraction(1, 3)
    for bits, digits in ((200, 59), (520, 149)):
        with working(bits):
            motion = source.reduced(bits)
            for side, over in ((1, motion), (-1, motion.mirrored())):
                ball = Interval.of(over.g)
                assert abs(ball.middle - side * third) < Fraction(1, 10**digits)
                assert side * third in ball


def test_mirrored_twice_is_the_motion_itself():
    with working(BITS):
        motion = scene_of(*ARGS).reduced(BITS)
        once, twice = motion.mirrored(), motion.mirrored().mirrored()
        for name in NAMES:
            one, other = Interval.of(getattr(motion, name)), Interval.of(getattr(twice, name))
            assert one == other, name
        assert Interval.of(once.P_plus - motion.P_minus).middle < Fraction(1, 10**80)
        assert Interval.of(once.over_top - motion.over_bottom).middle < Fraction(1, 10**80)


def test_pi_starts_on_the_pole():
    """θ = "pi" is the pole itself, not a rounding error from it."""
    source = FromScene(Top(2, 1, 3), State("pi", thetadot=1))
    with working(BITS):
        found = source.reduced(BITS)
        assert found.sin2.is_zero()
        assert found.P_plus.is_zero()
        assert found.u0 == -1
        assert found.u0.is_exact()


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "a tenth", None, True])
def test_refusals(value):
    with pytest.raises(NotANumber):
        number(CTX, value)


def test_zero_rule():
    assert threshold(CTX) == CTX.mpf(10) ** -40
    assert vanishes(CTX, CTX.mpf("1e-41"), 1)
    assert not vanishes(CTX, CTX.mpf("1e-39"), 1)
    assert digits_lost(CTX, CTX.mpf("1e-17"), 1) == 17
    assert digits_lost(CTX, 0, 1) == 0
