"""Plain quadrature of u̇² = f(u) against the elliptic functions: two ways to the same times."""

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
