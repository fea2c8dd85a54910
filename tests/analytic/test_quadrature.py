"""Plain quadrature of u̇² = f(u) against the elliptic functions: two ways to the same times."""

import mpmath
import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.potential import quadrature_period, quadrature_time
from heavytop.errors import NoClosedForm

SICM = ht.Top("3.28e-4", "6.6e-5", "0.0456")
LIE = ht.Top("15.234375", "0.46875", "147.15")
RISING = {"theta": 1.5, "thetadot": -1, "phidot": 0.5, "psidot": 3}
MOTIONS = {
    "kicked": (SICM, {"theta": "0.1", "phidot": -15, "psidot": 140}),
    "dropped": (SICM, {"theta": "0.1", "psidot": 140}),
    "lie": (LIE, {"theta": "pi/2", "phidot": "-4.61538", "psidot": 150}),
    "rising": (ht.Top(2, 1, 3), RISING),
    "inverted": (ht.Top(2, 1, -3), RISING),
    "force-free": (ht.Top(2, 1, 0), RISING),
    "swing": (ht.Top(2, 1, 3), {"theta": 2.5, "thetadot": 0.5}),
    "near a separatrix": (  # 1 − m = 1e-24
        ht.Top(2, 1, 2),
        {"theta": "pi/3", "phidot": "2/sqrt(3)", "psidot": "5/sqrt(3) + 1e-24"},
    ),
}


def motion(name):
    top, start = MOTIONS[name]
    return ht.Motion(top, ht.State(**start))


def relative(found, exact):
    return abs(exact.context.make_mpf(found._mpf_) / exact - 1)


@pytest.mark.parametrize("name", MOTIONS)
def test_period(name):
    """T by quadrature is T by K(m), to 48 digits."""
    known = motion(name)
    assert relative(quadrature_period(known.rising), known.form(50).period) < 1e-48


# closed form at 50 digits, cross-checked by an independent integrator
@pytest.mark.parametrize(
    ("name", "T"),
    [
        ("kicked", "0.54289551818821995785"),
        ("dropped", "0.40140587019470118608"),
        ("lie", "0.74520694761676905573"),
    ],
)
def test_published_periods(name, T):
    found = quadrature_period(motion(name).rising)
    assert abs(found - found.context.mpf(T)) < 1e-20


@pytest.mark.parametrize("name", MOTIONS)
def test_times_of_tilts(name):
    """t(θ) from the turning point u₁, against θ(t) of the closed form in doubles."""
    known = motion(name)
    age = np.linspace(0.03, 0.47, 12) * known.period
    at = known.at(age + float(known.exact.lower_turning))
    spent = [float(quadrature_time(known.rising, theta)) for theta in at.theta]
    if name == "near a separatrix":  # there θ̇ is small, and rounding of θ matters
        speed = abs(at.thetadot)
        assert np.all(abs(spent - age) * speed < 1e-14 * (1 + age * speed))
    else:
        np.testing.assert_allclose(spent, age, rtol=0, atol=2e-14 * known.period)


@pytest.mark.parametrize("name", MOTIONS)
def test_times_of_tilts_at_many_digits(name):
    """The same to 38 digits."""
    known = motion(name)
    form = known.form(60)
    for part in ("0.07", "0.31"):
        age = form.ctx.mpf(part) * form.period
        theta = form(age + form.lower_turning).theta
        assert relative(quadrature_time(known.rising, theta, 50), age) < 1e-38


def test_what_does_not_nutate_has_no_period():
    for top, start in ((SICM, {"theta": 0, "psidot": 140}), (SICM, {"theta": 0, "psidot": 10})):
        steady = ht.Motion(top, ht.State(**start))
        with pytest.raises(NoClosedForm, match="no nutation"):
            quadrature_period(steady.rising)


# --- by mpmath alone: its quadrature, its elliptic functions, its roots of the cubic ---


class Book:
    """The reduced equation of a motion with gMR > 0 between turning points off the vertical."""

    def __init__(self, name, digits):
        self.mp = mp = mpmath.MPContext()
        mp.dps = digits + 30
        top, start = MOTIONS[name]
        state = ht.State(**start)
        A, C, gMR = (x.mpf(mp) for x in (top.A, top.C, top.gMR))
        theta, thetadot, phidot, omega3 = (
            x.mpf(mp) for x in (state.theta, state.thetadot, state.phidot, state.omega3)
        )
        self.u0, sine = mp.cos(theta), mp.sin(theta)
        self.g, self.b = gMR / A, C * omega3 / A
        self.a = phidot * sine**2 + self.b * self.u0
        h = (thetadot**2 + (phidot * sine) ** 2) / 2 + self.g * self.u0
        cubic = [2 * self.g, -2 * h - self.b**2, 2 * self.a * self.b - 2 * self.g,
                 2 * h - self.a**2]  # fmt: skip
        roots = mp.polyroots(cubic, maxsteps=1000, extraprec=20 * digits)
        self.roots = sorted(mp.re(root) for root in roots)
        low, middle, high = self.roots
        self.m = (middle - low) / (high - low)
        self.w = mp.sqrt(self.g * (high - low) / 2)

    def integral(self, rate, end):
        """∫ rate(u) dt from u₁ on; u = ½ (u₁ + u₂) − ½ (u₂ − u₁) cos α."""
        mp, (low, middle, high) = self.mp, self.roots

        def integrand(alpha):
            u = (low + middle) / 2 - (middle - low) / 2 * mp.cos(alpha)
            return rate(u) / mp.sqrt(2 * self.g * (high - u))

        return mp.quad(integrand, mp.linspace(0, end, 9))


ORDINARY = ("kicked", "dropped", "rising")


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", ORDINARY)
def test_a_period_by_the_quadrature_of_mpmath(name, digits):
    """T, Δφ and the time of a tilt by tanh–sinh quadrature, with roots by Durand and Kerner."""
    book, known = Book(name, digits), motion(name)
    form, mp = known.form(digits), book.mp
    bound = mp.mpf(10) ** (2 - digits)
    assert relative(form.period, book.integral(lambda _: 1, 2 * mp.pi)) < bound
    turned = book.integral(lambda u: (book.a - book.b * u) / (1 - u * u), 2 * mp.pi)
    assert relative(form.precession, turned) < bound
    t = form.period * form.ctx.mpf("0.3")
    u = mp.cos(mp.mpf(form(t + form.lower_turning).theta))
    low, middle, _ = book.roots
    age = book.integral(lambda _: 1, mp.acos((low + middle - 2 * u) / (middle - low)))
    assert relative(t, age) < bound


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", ORDINARY)
def test_a_motion_by_the_elliptic_functions_of_mpmath(name, digits):
    """T by ellipk, Δφ by ellippi, θ(t) by ellipfun, and φ(t) by the incomplete ellippi."""
    book, known = Book(name, digits), motion(name)
    form, mp, (low, middle, _) = known.form(digits), book.mp, book.roots
    bound = mp.mpf(10) ** (2 - digits)
    assert relative(form.modulus[0], book.m) < bound
    assert relative(form.period, 2 * mp.ellipk(book.m) / book.w) < bound
    plus, minus = (book.a + book.b) / (1 + low), (book.a - book.b) / (1 - low)
    n_plus, n_minus = -(middle - low) / (1 + low), (middle - low) / (1 - low)
    turned = plus * mp.ellippi(n_plus, book.m) + minus * mp.ellippi(n_minus, book.m)
    assert relative(form.precession, turned / book.w) < bound
    phi0 = mp.mpf(form(form.lower_turning).phi)
    for part in ("0.1", "0.35"):
        t = form.period * form.ctx.mpf(part)
        at = form(t + form.lower_turning)
        x = book.w * mp.mpf(t)
        sn = mp.ellipfun("sn", x, m=book.m)
        assert abs(mp.mpf(at.theta) - mp.acos(low + (middle - low) * sn**2)) < bound
        amplitude = mp.asin(sn)
        swept = plus * mp.ellippi(n_plus, amplitude, book.m)
        swept += minus * mp.ellippi(n_minus, amplitude, book.m)
        assert abs(mp.mpf(at.phi) - phi0 - swept / (2 * book.w)) < bound
