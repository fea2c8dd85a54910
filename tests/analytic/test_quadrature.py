"""Plain quadrature of u̇² = f(u) against the elliptic functions: two ways to the same times."""

from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.many_times import DoubleForm
from heavytop.analytic.rising import Rising
from heavytop.analytic.theory.closed_form import MPForm
from heavytop.analytic.theory.nutation import nutation
from heavytop.analytic.theory.quadrature import elapsed, elapsed_exact, period
from heavytop.analytic.theory.reduced import Reduced
from heavytop.classification.reduced import FromScene
from heavytop.errors import NoClosedForm
from heavytop.numbers import Exact
from heavytop.numbers.decimals import context

CTX = context(60)
SICM = (Fraction("3.28e-4"), Fraction("6.6e-5"), Fraction("0.0456"))
LIE = (Fraction("15.234375"), Fraction("0.46875"), Fraction("147.15"))
START = {
    "kicked": (*SICM, Fraction("0.1"), 0, 0, 0, -15, 140),
    "dropped": (*SICM, Fraction("0.1"), 0, 0, 0, 0, 140),
    "lie": (*LIE, Exact.of("pi/2"), 0, 0, 0, Fraction("-4.61538"), 150),
    "rising": (2, 1, 3, 1.5, 0, 0, -1, 0.5, 3),
    "inverted": (2, 1, -3, 1.5, 0, 0, -1, 0.5, 3),
    "force-free": (2, 1, 0, 1.5, 0, 0, -1, 0.5, 3),
    "swing": (2, 1, 3, 2.5, 0, 0, 0.5, 0, 0),
}


def motion(name):
    return Reduced.from_angles(CTX, *START[name])


@pytest.mark.parametrize("name", START)
def test_period(name):
    """T by the trapezoid rule is T by K(m), to 48 digits."""
    reduced = motion(name)
    assert abs(period(nutation(reduced)) / MPForm(reduced, 50).period - 1) < CTX.mpf("1e-48")


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
    assert abs(period(nutation(motion(name))) - CTX.mpf(T)) < CTX.mpf("1e-20")


@pytest.mark.parametrize("name", START)
def test_times_of_angles(name):
    """t(θ) from the turning point u₁, against θ(t) of the closed form in doubles."""
    A, C, gMR, theta, phi, psi, thetadot, phidot, psidot = START[name]
    rates = {"thetadot": thetadot, "phidot": phidot, "psidot": psidot}
    rising = Rising(FromScene(ht.Top(A, C, gMR), ht.State(theta, phi=phi, psi=psi, **rates)))
    roots, form = nutation(motion(name)), DoubleForm(rising)
    age = np.linspace(0.03, 0.47, 12) * form.period
    lower = rising.settled("u1", lambda found, bits: found.lower_turning, 30)
    at = form(age + float(lower))
    spent = elapsed(roots, at.theta)
    np.testing.assert_allclose(spent, age, rtol=0, atol=2e-14 * form.period)


@pytest.mark.parametrize("name", START)
def test_times_of_angles_at_many_digits(name):
    """The same to 38 digits."""
    reduced = motion(name)
    roots, form = nutation(reduced), MPForm(reduced, 50)
    ctx = form.ctx
    for part in ("0.07", "0.31"):
        age = ctx.mpf(part) * form.period
        theta = form(age - form.orbit.t0).theta
        spent = elapsed_exact(roots, roots.ctx.make_mpf(theta._mpf_))
        assert abs(spent / age - 1) < ctx.mpf("1e-38")


def test_too_near_a_separatrix():
    """1 − m = 1e-24: the quadrature says that it gives up; the closed form does not mind."""
    spin = Exact.of("5/sqrt(3)") + Exact.of("1e-24")
    reduced = Reduced.from_angles(
        CTX, 2, 1, 2, Exact.of("pi/3"), 0, 0, 0, Exact.of("2/sqrt(3)"), spin
    )
    roots = nutation(reduced)
    with pytest.raises(NoClosedForm, match="separatrix"):
        period(roots)
    with pytest.raises(NoClosedForm, match="separatrix"):
        elapsed(roots, [float(roots.theta_upper)])
