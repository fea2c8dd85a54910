"""Exactly through a pole: φ and ψ jump there, the axis and the attitude do not.

There φ and ψ are not defined apart. φ jumps by +π as time goes forward, ψ by −π at the top, where
φ + ψ is what is defined, and by +π at the bottom, where φ − ψ is. The rotation from body to space,
a quaternion or a matrix, turns with ω on either side and at the pass itself.
"""

from itertools import pairwise

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.many_times import DoubleForm
from heavytop.analytic.rising import Rising
from heavytop.classification.reduced import FromScene

# a start, the pole that is passed (1 top, −1 bottom), and half periods from u₁ to there
GIVEN = {
    "the top, from it": (((2, 1, 3), 0, 0, 2, 3), 1, 1),
    "the top, into it": (((2, 1, 3), 0, 0, 2, -3), 1, 1),
    "the top, from afar": (((2, 1, 2), "pi/3", 4, 10, -1), 1, 1),
    "the bottom": (((2, 1, 3), "pi", 0, 2, 3), -1, 0),
    "the bottom, from afar": (((2, 1, 2), "2*pi/3", -4, 10, 1), -1, 0),
    "the top, hanging from it": (((2, 1, -3), 0, 0, 2, 1), 1, 0),
    "the bottom, standing on it": (((2, 1, -3), "pi", 0, 2, 3), -1, 1),
    "a swing": (((2, 1, 3), "2.5", 0, 0, 0.5), -1, 0),
    "turning over, the top": (((2, 1, 3), "2.5", 0, 0, 5), 1, 1),
    "turning over, the bottom": (((2, 1, 3), "2.5", 0, 0, -5), -1, 0),
    "weightless, the top": (((2, 1, 0), 0, 0, 2, 3), 1, 1),
}


def rising_of(top, theta, phidot, psidot, thetadot):
    state = ht.State(theta, thetadot=thetadot, phi="0.3", phidot=phidot, psi="-0.7", psidot=psidot)
    return Rising(FromScene(ht.Top(*top), state))


PASSES = {name: (rising_of(*given), pole, half) for name, (given, pole, half) in GIVEN.items()}


def attitude(ctx, at):
    """The unit quaternion of Rz(φ) Rx(θ) Rz(ψ), scalar first."""
    half, plus, minus = at.theta / 2, (at.phi + at.psi) / 2, (at.phi - at.psi) / 2
    c, s = ctx.cos(half), ctx.sin(half)
    return [c * ctx.cos(plus), s * ctx.cos(minus), s * ctx.sin(minus), c * ctx.sin(plus)]


def product(p, q):
    a, (x, y, z), b, (u, v, w) = p[0], p[1:], q[0], q[1:]
    return [
        a * b - x * u - y * v - z * w,
        a * u + b * x + y * w - z * v,
        a * v + b * y + z * u - x * w,
        a * w + b * z + x * v - y * u,
    ]


def passing(form, half):
    return half * form.period / 2 + form.lower_turning + 2 * form.period


@pytest.mark.parametrize("name", PASSES)
def test_angles_jump_as_said(name):
    rising, pole, half = PASSES[name]
    form = ClosedForm(rising, 60)
    ctx, h = form.ctx, form.ctx.mpf("1e-30")
    t = passing(form, half)
    before, at, after = form(t - h), form(t), form(t + h)
    assert abs(after.phi - before.phi - ctx.pi) < ctx.mpf("1e-25")
    assert abs(after.psi - before.psi + pole * ctx.pi) < ctx.mpf("1e-25")
    # the time of the pass is rounded: it is before the pass or after it
    assert min(abs(at.phi - after.phi), abs(at.phi - before.phi)) < ctx.mpf("1e-25")
    assert min(at.theta, ctx.pi - at.theta) < ctx.mpf("1e-30")


@pytest.mark.parametrize("name", PASSES)
def test_the_attitude_turns_on_smoothly(name):
    """q̇ = ½ ω q with |ω|² = ω3² + 2 (E' − V)/A, and ω3 about the axis, on both sides and at it."""
    rising, pole, half = PASSES[name]
    form = ClosedForm(rising, 60)
    ctx, h = form.ctx, form.ctx.mpf("1e-12")
    t, r = passing(form, half), form.reduced
    places = [attitude(ctx, form(t + k * h)) for k in (-3, -1, 0, 1, 3)]
    for one, other in pairwise(places):  # one branch of ±q
        if sum(a * b for a, b in zip(one, other, strict=True)) < 0:
            other[:] = [-x for x in other]
    far, near = (
        [(b - a) / (2 * k * h) for a, b in zip(places[i], places[4 - i], strict=True)]
        for i, k in ((0, 3), (1, 1))
    )
    rate = [(9 * b - a) / 8 for a, b in zip(far, near, strict=True)]
    here = places[2]
    omega = [2 * x for x in product(rate, [here[0], *(-x for x in here[1:])])]
    squared = (r.kappa + r.b) ** 2 + 2 * (r.kinetic0 + r.g * (r.u0 - pole))
    assert abs(omega[0]) < ctx.mpf("1e-40")
    assert abs(sum(x * x for x in omega[1:]) / squared - 1) < ctx.mpf("1e-40")
    assert abs(omega[3] - pole * (r.kappa + r.b)) < ctx.mpf("1e-40") * ctx.sqrt(squared)
    for k, q in zip((-3, -1, 1, 3), places[:2] + places[3:], strict=True):
        ahead = [a + k * h * b for a, b in zip(here, rate, strict=True)]
        assert max(abs(a - b) for a, b in zip(q, ahead, strict=True)) < 40 * squared * h**2


@pytest.mark.parametrize("name", PASSES)
def test_the_axis_crosses_the_pole_in_a_straight_line(name):
    """ė at the pass is θ̇ across the vertical, and the same just before and just after."""
    rising, pole, half = PASSES[name]
    form = ClosedForm(rising, 60)
    ctx, h = form.ctx, form.ctx.mpf("1e-15")
    t, r = passing(form, half), form.reduced
    speed = ctx.sqrt(2 * (r.kinetic0 + r.g * (r.u0 - pole)))
    before, at, after = (form(t + k * h).axis for k in (-1, 0, 1))
    assert abs(at[2] - pole) < ctx.mpf("1e-50")
    leaving = [(b - a) / h for a, b in zip(at, after, strict=True)]
    coming = [(b - a) / h for a, b in zip(before, at, strict=True)]
    assert abs(ctx.hypot(*leaving[:2]) / speed - 1) < ctx.mpf("1e-12")
    assert max(abs(a - b) for a, b in zip(leaving, coming, strict=True)) < 1e-12 * speed


@pytest.mark.parametrize("name", PASSES)
def test_doubles_pass_smoothly_too(name):
    """Sampled every 1e-6 s through five passes, axis and attitude move as far as ω lets them."""
    rising, _, half = PASSES[name]
    form = DoubleForm(rising)
    lower, T = rising.settled("T", lambda found, bits: (found.lower_turning, found.path.period), 30)
    pole = float(lower + (half / 2 + 2) * T)
    t = (pole + np.arange(-2, 3)[:, None] * form.period + np.arange(-50, 51) * 1e-6).ravel()
    at = form(np.append(t, pole))
    half_angles = at.theta / 2, (at.phi + at.psi) / 2, (at.phi - at.psi) / 2
    (c, s), (cp, sp), (cm, sm) = ((np.cos(x), np.sin(x)) for x in half_angles)
    q = np.stack((c * cp, s * cm, s * sm, c * sp), axis=-1)
    r = ClosedForm(rising).reduced
    size = float((r.kappa + r.b) ** 2 + 2 * (r.kinetic0 + abs(r.g) * (1 + abs(r.u0)))) ** 0.5
    apart = np.diff(t) < 2e-6
    turned = 1 - abs(np.sum(q[1:-1] * q[:-2], axis=-1))  # 1 − cos of half the angle
    assert np.all(turned[apart] < (1.001e-6 * size) ** 2 / 8 + 1e-15)
    moved = np.linalg.norm(np.diff(at.axis[:-1], axis=0), axis=-1)
    assert np.all(moved[apart] < 1.001e-6 * size + 1e-15)
    jumps = np.diff(at.phi[:-1])[apart]
    assert np.sum(jumps > 3.1) == 5
    assert np.all((jumps > 3.1) | (abs(jumps) < 1e-4))
