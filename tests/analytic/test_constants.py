"""The constants of the motion and the reduced motion, against the textbook definitions."""

from fractions import Fraction

import pytest

from heavytop.analytic.theory.constants import constants
from heavytop.analytic.theory.reduced import Reduced
from heavytop.errors import NotANumber
from heavytop.numbers.decimals import context, digits_lost, number, threshold, vanishes
from heavytop.scene.state import State
from heavytop.scene.top import Top

CTX = context(60)


def close(one, other, digits=50):
    return abs(one - other) <= CTX.mpf(10) ** -digits * max(1, abs(other))


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
    found = constants(CTX, top, start)
    assert close(found.E_prime, E_prime)
    assert close(found.E, E_prime + p_psi**2 / (2 * C))
    assert close(found.p_psi, p_psi)
    assert close(found.p_phi, A * phd * CTX.sin(th) ** 2 + p_psi * CTX.cos(th))
    assert found.floats["p_psi"] == float(p_psi)


def test_lie_group_benchmark_constants():
    """E, p_φ, p_ψ as the benchmark's decimals give them (Brüls, Cardona & Arnold 2012)."""
    top = Top("15.234375", "0.46875", "147.15")
    found = constants(CTX, top, State("pi/2", phi="pi", phidot="-4.61538", psidot=150))
    assert close(found.E, CTX.mpf("5435.696790865546875"))
    assert close(found.p_phi, CTX.mpf("-70.3124296875"))
    assert close(found.p_psi, CTX.mpf("70.3125"))


def test_held_spin_is_used_as_given():
    """A kick that holds ω3 has p_ψ = C ω3 exactly."""
    start = State.kicked(theta="0.1", omega3=140, phidot=15)
    assert close(constants(CTX, Top(2, 1, 3), start).p_psi, 140)


def test_axis_and_angles_define_the_same_motion():
    """e, ℓ made from the angles give back g, a, b, h, u₀, u̇₀, φ₀ and the sums P±."""
    args = (2.0, 1.25, 3.0, 0.7, -1.1, 0.4, 0.3, -0.8, 5.0)
    by_angles = Reduced.from_angles(CTX, *args)
    A, C, gMR, th, ph, ps, thd, phd, psd = map(CTX.mpf, args)
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
    by_axis = Reduced.from_axis(CTX, e, l, gMR / A, psi0=ps, kappa=by_angles.kappa)
    for name in ("g", "a", "b", "h", "u0", "udot0", "phi0", "psi0", "P_plus", "P_minus",
                 "kinetic0", "drift0", "one_minus_u0", "one_plus_u0"):  # fmt: skip
        assert close(getattr(by_axis, name), getattr(by_angles, name)), name


def test_a_long_axis_is_a_unit_axis_with_more_gravity():
    """|e| = ρ: e/ρ obeys the same equations with g ρ; here ρ = 2."""
    l = (0.5, -1.0, 3.0)  # noqa: E741
    double = Reduced.from_axis(CTX, (1.2, 0.0, 1.6), l, 1.5)
    unit = Reduced.from_axis(CTX, (Fraction(1.2) / 2, 0, Fraction(1.6) / 2), l, 3.0)
    assert abs(double.u0 - 0.8) < 1e-15
    rho = CTX.sqrt(CTX.mpf(1.2) ** 2 + CTX.mpf(1.6) ** 2)
    assert close(double.g, CTX.mpf(1.5) * rho)
    for name in ("a", "b", "u0", "udot0", "kinetic0"):
        assert close(getattr(double, name), getattr(unit, name), 15), name


def test_expansion_about_the_start_is_the_cubic():
    """f(u₀ + d) by its Taylor coefficients against f as it is defined."""
    r = Reduced.from_angles(CTX, 2, 1, 3, 0.7, 0, 0, 0.3, -0.8, 5)
    f0, f1, f2, f3 = r.taylor
    for d in (CTX.mpf("0.1"), CTX.mpf("-0.4")):
        u = r.u0 + d
        f = 2 * (r.h - r.g * u) * (1 - u * u) - (r.a - r.b * u) ** 2
        assert close(f0 + d * (f1 + d * (f2 + d * f3)), f)


def test_sums_keep_their_digits_near_a_pole():
    """P₋ of a start 1e-25 from the top has its digits: a − b as a difference has none."""
    r = Reduced.from_angles(CTX, 2, 1, 3, Fraction(1, 10**25), 0, 0, 0, 7, 5)
    fine = r.refined(context(150))
    assert abs(r.P_minus / fine.P_minus - 1) < CTX.mpf(10) ** -55
    assert abs((r.a - r.b) / fine.P_minus - 1) > CTX.mpf(10) ** -20


def test_refining_goes_back_to_the_exact_numbers():
    """A third read at 60 digits is a third to 150 digits when computed again at 150."""
    r = Reduced.from_angles(CTX, 3, 1, 1, 1, 0, 0, 0, 0, 1)
    fine = context(150)
    assert abs(r.refined(fine).g - fine.mpf(1) / 3) < fine.mpf(10) ** -149
    assert abs(r.mirrored().refined(fine).g + fine.mpf(1) / 3) < fine.mpf(10) ** -149


def test_pi_starts_on_the_pole():
    """θ = "pi" is the pole itself, not a rounding error from it."""
    start = State("pi", thetadot=1)
    r = Reduced.from_scene(CTX, Top(2, 1, 3), start)
    assert r.sin2 == 0
    assert r.P_plus == 0
    assert r.u0 == -1


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
