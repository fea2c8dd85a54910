"""Elliptic integrals by arithmetic–geometric means, against Carlson's integrals of mpmath."""

import random

import mpmath
import pytest

from heavytop.analytic.theory.elliptic import complete_first, complete_third, first
from heavytop.numbers.decimals import context

CTX = context(60)


def reference():
    """An mpmath of many more digits: Π(n|m) is a difference where n is far from zero."""
    ctx = mpmath.MPContext()
    ctx.dps = 260
    return ctx


def parameters(seed):
    """Parameters mc from 1e-60 to 1, and from 1 − 1e-40."""
    draw = random.Random(seed)
    small = [CTX.mpf(10) ** draw.uniform(-60, 0) for _ in range(20)]
    return [CTX.one, *small, *(1 - CTX.mpf(10) ** draw.uniform(-40, -1) for _ in range(10))]


def apart(found, exact):
    return float(abs(exact.context.make_mpf(found._mpf_) / exact - 1))


def test_first_kind():
    """F from tan φ = 1e-40 to 1e40, and K, to 1e-57; tan⁴ φ = 1/mc halves K: a step meets 0."""
    ctx, draw = reference(), random.Random(1)
    for mc in parameters(2):
        exact_mc = ctx.make_mpf(mc._mpf_)
        tangents = [CTX.mpf(10) ** draw.uniform(-40, 40) for _ in range(4)]
        for tangent in (*tangents, CTX.one, mc**-0.25, mc**-0.5):
            t = ctx.make_mpf(tangent._mpf_)
            s2, c2 = t**2 / (1 + t**2), 1 / (1 + t**2)
            exact = ctx.sqrt(s2) * ctx.elliprf(c2, c2 + exact_mc * s2, 1)
            assert apart(first(CTX, tangent, mc), exact) < 1e-57
        assert apart(complete_first(CTX, mc), ctx.elliprf(0, exact_mc, 1)) < 1e-57


def test_third_kind():
    """Π(1 − p|m) to 1e-57 from p = 1e-30 to 1e90: a pass within 1e-45 of a pole."""
    ctx, draw = reference(), random.Random(3)
    for mc in parameters(4):
        p, exact_mc = CTX.mpf(10) ** draw.uniform(-30, 90), ctx.make_mpf(mc._mpf_)
        q = ctx.make_mpf(p._mpf_)
        carlson = ctx.elliprf(0, exact_mc, 1) + (1 - q) / 3 * ctx.elliprj(0, exact_mc, 1, q)
        assert apart(complete_third(CTX, p, mc), carlson) < 1e-57


@pytest.mark.parametrize("tangent", ["0", "1e-20", "0.3", "1e20"])
def test_the_limit_of_no_complement(tangent):
    """F(φ|1) = asinh tan φ."""
    found = first(CTX, CTX.mpf(tangent), CTX.zero)
    assert abs(found - CTX.asinh(CTX.mpf(tangent))) <= CTX.mpf("1e-58") * abs(found)
