"""The closed form against the rigid-body equations, and the constants against the Lagrangian.

`rigid_series` integrates the equations by their own Taylor series at 40 digits, in a form that has
no pole, and finds what it has in the closed form and in the intervals of `enclose`.
"""

import random
from fractions import Fraction

import pytest
import sympy as sp

import heavytop as ht
from heavytop.analytic.closed_form import constants
from heavytop.equations import lagrangian as lag
from heavytop.exact import PI
from heavytop.exact.balls import Interval, rational
from heavytop.exact.decimals import context
from heavytop.scene.state import State
from heavytop.scene.top import Top

from ..motions import MOTIONS, motion, named
from .rigid_series import WORK, attitude, cross, here, solved

CTX = context(60)


def inside(ball, value, digits=33):
    """Whether an interval holds a number that is good to so many digits."""
    slack = Fraction(1, 10**digits) * max(1, abs(ball.middle))
    return value in Interval(ball.middle, ball.spread + slack)


FAST = ("slender", "uniform", "1e-9 off uniform")  # whose series take ten times as many steps


@pytest.mark.slow
@pytest.mark.reference
@pytest.mark.parametrize(
    ("name", "t"),
    [(n, t) for n in MOTIONS for t in (("0.17", "-0.09") if n in FAST else ("1.7", "-0.9"))],
)
def test_it_solves_the_rigid_body_equations(name, t):
    """Axis and a body vector agree to 1e-33 with the equations integrated at 40 digits.

    So do axis, attitude and rates of intervals; the rates from ℓ: ė = ℓ × e, and ω₃ = ℓ·e + κ.
    """
    begun = named(name)
    at, found = begun.form(40)(t), ht.enclose(begun.top, begun.start, 40)
    e, l, v, kappa = solved(MOTIONS[name], t)  # noqa: E741
    got = attitude(*map(here, (at.phi, at.theta, at.psi)))
    w, x, y, z = (WORK.mpf(b.middle.numerator) / b.middle.denominator for b in found.quaternion(t))
    third = 2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z
    first = w * w + x * x - y * y - z * z, 2 * (x * y + w * z), 2 * (x * z - w * y)
    for vectors in ((*got[0], *got[1]), (*at.axis, *got[1]), (*third, *first)):
        assert max(abs(a - b) for a, b in zip((*e, *v), vectors, strict=True)) < 1e-33
    assert all(inside(*pair) for pair in zip(found.axis(t), e, strict=True))
    sin2 = e[0] ** 2 + e[1] ** 2
    if sin2 < 1e-20:
        return  # on a pole the angles have no rates of their own
    edot = cross(l, e)
    phidot = (e[0] * edot[1] - e[1] * edot[0]) / sin2
    omega3 = sum(a * b for a, b in zip(l, e, strict=True)) + kappa
    rates = -edot[2] / WORK.sqrt(sin2), phidot, omega3 - phidot * e[2]
    assert all(inside(*pair, 28) for pair in zip(found.rates(t), rates, strict=True))


@pytest.mark.parametrize("name", MOTIONS)
def test_start_is_the_start(name):
    """At t = 0 every angle and rate is the given one, in the interval too."""
    begun = named(name)
    form, found = begun.form(30), ht.enclose(begun.top, begun.start, 25)
    for each, ball in zip(
        ("theta", "phi", "psi", "thetadot", "phidot", "psidot"),
        (found.theta(0), found.phi(0), found.psi(0), *found.rates(0)),
        strict=True,
    ):
        # on a pole φ and ψ, and their rates, have no value of their own
        if begun.start.theta not in (0, PI) or each == "theta":
            given = getattr(begun.start, each).mpf(form.ctx)
            assert abs(getattr(form(0), each) - given) < 1e-28
            assert inside(ball, given, 38)


@pytest.mark.parametrize(("theta", "up"), [(0, 1), ("pi", -1)])
@pytest.mark.parametrize("thetadot", [1, -1])
@pytest.mark.parametrize("gMR", [3, -3])
def test_start_on_a_pole_names_the_side_it_goes_to(theta, up, thetadot, gMR):
    """φ₀ is where the axis goes; when θ̇₀ points through the pole it is φ₀ + π, and ψ₀ ∓ π."""
    begun = motion(2, 1, gMR, theta, phi="0.3", psi="0.2", thetadot=thetadot, psidot=1)
    at = begun.form(30)(Fraction(1, 10**20))
    turned = thetadot * up < 0
    assert abs(at.phi - CTX.mpf("0.3") - turned * CTX.pi) < 1e-19
    assert abs(at.psi - CTX.mpf("0.2") + up * turned * CTX.pi) < 1e-19


@pytest.mark.parametrize("part", ["0.02", "0.3", "0.48", "0.52", "0.98"])
@pytest.mark.parametrize("gMR", [3, -3])
def test_periods_are_counted_from_the_nearest_lower_turning(part, gMR):
    """Begun anywhere on the way, the u₁ nearest is what times and n count from."""
    args = (2, 1, gMR, "1.5", 0, 0, -1, "0.5", 3)
    first = motion(*args).form(50)
    ctx, T = first.ctx, first.period
    at, since = first(ctx.mpf(part) * T + first.lower_turning), ctx.mpf(part) * T
    given = (at.theta, at.phi, at.psi, at.thetadot, at.phidot, at.psidot)
    again = motion(*args[:3], *map(rational, given))
    form, want = again.form(40), since if since < T / 2 else since - T
    assert abs(form.lower_turning + want) < ctx.mpf("1e-40")
    for t in ("-3.29", "0", "0.41", "0.93"):
        n = int(ctx.floor(ctx.mpf(t) + want / T + ctx.mpf("0.5")))
        assert form(ctx.mpf(t) * T).n == again.at(float(t) * float(T)).n == n


# --- constants of the motion ---------------------------------------------------------------------


@pytest.mark.reference
@pytest.mark.parametrize("seed", range(4))
def test_constants_are_the_legendre_transform(seed):
    source = random.Random(seed)
    A, C, g = (Fraction(source.randint(1, 999), 500) for _ in range(3))
    theta, *rates = (Fraction(source.randint(-999, 999), 350) for _ in range(4))
    numbers = (A, min(C, 2 * A), g, abs(theta), *rates)
    symbols = (lag.A, lag.C, lag.gMR, lag.theta, *lag.VELOCITIES)
    values = dict(zip(symbols, map(sp.Rational, numbers), strict=True))
    _, p_phi, p_psi = lag.momenta()
    E = lag.energy()
    symbolic = {"E": E, "E_prime": E - p_psi**2 / (2 * lag.C), "p_phi": p_phi, "p_psi": p_psi}
    state = dict(zip(("thetadot", "phidot", "psidot"), rates, strict=True))
    for name, value in constants(Top(*numbers[:3]), State(numbers[3], **state), 50).items():
        exact = CTX.mpf(str(symbolic[name].subs(values).evalf(60)))
        assert abs(value - exact) < CTX.mpf(10) ** -46, name
