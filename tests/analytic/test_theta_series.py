"""sn, cn, dn and the arguments of theta functions in doubles, against mpmath's."""

import mpmath
import numpy as np
import pytest
from flint import arb

from heavytop.analytic.theta_series import Argument, ThetaSeries
from heavytop.numbers.double_double import double_double
from heavytop.numbers.intervals import working

CTX = mpmath.MPContext()
CTX.dps = 40
PARAMETERS = ("0", "1e-20", "0.01", "0.3", "0.4999", "0.5001", "0.9", "0.999999", "1-1e-30")
PARTS = np.linspace(-0.25, 0.25, 11)  # of a period, from the turning point nearest


def parameter(text):
    return 1 - CTX.mpf(text[2:]) if text.startswith("1-") else CTX.mpf(text)


def ratio(m):
    return CTX.ellipk(1 - m) / CTX.ellipk(m) if m else None


def series_of(m):
    """The series of m, and the arguments of the parts of a period."""
    with working(200):
        tau = None if not m else arb(str(ratio(m)))
        series = ThetaSeries(tau)
        scale = double_double(series.scale)
    return series, Argument.of(PARTS, 0 * PARTS, scale, series.hyperbolic)


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("m", PARAMETERS)
def test_elliptic_functions(m, upper):
    """To 2e-15, relative: sn and cn keep their digits where they are small."""
    m = parameter(m)
    series, at = series_of(m)
    sn, cn, under = series.sn_cn(at, upper)
    found = sn, cn, series.dn(at, upper, under)
    K = CTX.ellipk(m)
    for i, part in enumerate(PARTS):
        x = 2 * K * CTX.mpf(part) + upper * K
        for name, values in zip(("sn", "cn", "dn"), found, strict=True):
            want = CTX.ellipfun(name, x, m=m)
            assert abs(CTX.mpf(float(values[i])) - want) <= 2e-15 * abs(want) + 1e-36, (name, part)


@pytest.mark.parametrize("where", ["1e-9", "0.01", "0.2", "0.5", "0.7", "0.99"])
@pytest.mark.parametrize("m", PARAMETERS[1:])
def test_sweeps(m, where):
    """The sweeps about both turning points, with the multiple of z that is left out."""
    m = parameter(m)
    tau = ratio(m)
    beta = CTX.mpf(where) * tau / 2
    series, at = series_of(m)
    with working(200):
        own, other, quarter = series.sweeps(arb(str(beta)))
    quarter = float(quarter)
    nome = CTX.exp(-CTX.pi * tau)
    for i, part in enumerate(PARTS):
        left = (CTX.pi - 2 * CTX.mpf(quarter)) * CTX.mpf(part)  # of the real sweep
        for sweep, n in ((own, 1), (other, 2)):
            theta = CTX.jtheta(n, CTX.pi * CTX.mpc(CTX.mpf(part), beta), nome)
            want = (CTX.pi / 2 if n == 1 else 0) - CTX.arg(theta) - left
            assert abs(CTX.mpf(float(sweep(at)[i])) - want) < 1e-15, (n, part)
