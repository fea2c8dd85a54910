"""Jacobi's functions and the argument of θ₁ against Arb's own theta functions and mpmath."""

import mpmath
import pytest
from flint import acb, arb

from heavytop.analytic.cubic import TooFewBits
from heavytop.analytic.elliptic import Jacobi, first_kind, third_kind
from heavytop.numbers.intervals import working

TAUS = ("0.005", "0.1", "0.999", "1", "1.31", "4.3", "60")
PLACES = ("-0.5", "-0.47", "-1e-30", "0.2", "0.4999", "0.5", "0.6")
BITS = (64, 150, 380)


def thetas(z, tau):
    return acb.modular_theta(z, acb(0, tau))


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("tau", TAUS)
def test_functions_hold_what_arb_says(tau, bits):
    """sn = θ₃θ₁/θ₂θ₄, and likewise cn and dn; each ball is about as small as the bits allow."""
    with working(2 * bits + 400):
        _, two, three, four = (theta.real for theta in thetas(acb(0), arb(tau)))
        scales = three / two, four / two, four / three
        wants = []
        for x in PLACES:
            one_x, two_x, three_x, four_x = (th.real for th in thetas(acb(arb(x)), arb(tau)))
            over = (one_x, two_x, three_x)
            wants.append([k * th / four_x for k, th in zip(scales, over, strict=True)])
    with working(bits):
        jacobi = Jacobi(arb(tau))
        for x, want in zip(PLACES, wants, strict=True):
            for ball, truth in zip(jacobi.functions(arb(x)), want, strict=True):
                assert ball.overlaps(truth)
                assert ball.rad() < arb(2) ** (12 - bits) / min(arb(tau), arb(1))


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("tau", TAUS)
def test_the_argument_holds_what_arb_says(tau, bits):
    for x in PLACES:
        for part in ("1e-20", "0.2", "0.4999"):
            with working(2 * bits + 400):
                beta = arb(tau) * arb(part)
                truth = (acb(0, 1) * thetas(acb(arb(x), -beta), arb(tau))[0]).arg()
            with working(bits):
                ball = Jacobi(arb(tau)).argument(arb(x), arb(tau) * arb(part))
                assert ball.overlaps(truth), (x, part)
                assert ball.rad() < arb(2) ** (12 - bits) / min(arb(tau), arb(1)) ** 2


def test_without_a_modulus_they_are_circular():
    with working(100):
        sn, cn, dn = Jacobi(None).functions(arb("0.1"))
        for ball, want in zip((sn, cn, dn), (*arb("0.1").sin_cos_pi(), arb(1)), strict=True):
            assert ball.overlaps(want)
            assert ball.rad() < arb(2) ** -95


def test_what_is_not_known_well_enough_is_refused():
    """A number of periods known to no better than one, and a modulus that is not known."""
    with working(100):
        with pytest.raises(TooFewBits):
            Jacobi(arb(2)).functions(arb(0, 1))
        with pytest.raises(TooFewBits):
            Jacobi(arb(2, 1.9))


def test_integrals_are_mpmaths():
    """F for a cosine and sine that are only known in ratio, and the complete Π."""
    ctx = mpmath.mp.clone()
    ctx.dps = 40
    s2, c2, mc = "0.3", "1.2", "0.35"
    phi = ctx.atan(ctx.sqrt(ctx.mpf(s2) / ctx.mpf(c2)))
    with working(160):
        ball = first_kind(arb(s2), arb(c2), arb(mc))
        assert abs(ball - arb(str(ctx.ellipf(phi, 1 - ctx.mpf(mc))))) < arb("1e-38")
        K = arb(str(ctx.ellipk(1 - ctx.mpf(mc))))
        ball = third_kind(K, arb(mc), arb("0.7"))
        assert abs(ball - arb(str(ctx.ellippi(ctx.mpf("0.3"), 1 - ctx.mpf(mc))))) < arb("1e-38")
