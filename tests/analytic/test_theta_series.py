"""sn, cn, dn and the arguments of theta functions in doubles, against mpmath's."""

import mpmath
import numpy as np
import pytest
from flint import arb

from heavytop.analytic.theta_series import ThetaSeries
from heavytop.exact.balls import working
from heavytop.exact.pairs import double_double

pytestmark = pytest.mark.reference

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
        series = ThetaSeries(arb(str(m)), arb(str(1 - m)))
        z = [series.scale * 2 * arb(str(CTX.ellipk(m))) * arb(float(part)) for part in PARTS]
        high, low = (np.array(words) for words in zip(*map(double_double, z), strict=True))
    return series, series.argument(high, low)


@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize("m", PARAMETERS)
def test_elliptic_functions(m, upper):
    """To 2e-15, relative: sn and cn keep their digits where they are small."""
    m = parameter(m)
    series, at = series_of(m)
    found = [np.broadcast_to(values, PARTS.shape) for values in series.functions(at, upper)]
    K = CTX.ellipk(m)
    for i, part in enumerate(PARTS):
        x = 2 * K * CTX.mpf(part) + upper * K
        for name, values in zip(("sn", "cn", "dn"), found, strict=True):
            want = CTX.ellipfun(name, x, m=m)
            assert abs(CTX.mpf(float(values[i])) - want) <= 2e-15 * abs(want) + 1e-36, (name, part)


def test_where_there_is_one_turning_point():
    """Of m = 1 they are hyperbolic, and tend to what they are far away without overflow."""
    with working(200):
        series = ThetaSeries(arb(1), arb(0))
        assert series.scale == 1
        assert series.half == 0
        below, _ = series.sweeps(arb("0.3"), -1)
    x = np.array([-800.0, -3.0, 0.0, 1e-9, 2.0, 650.0])
    with np.errstate(over="ignore"):
        at = series.argument(x, 0 * x)
    sn, cn, dn = series.functions(at, upper=False)
    for i, each in enumerate(x.tolist()):
        assert abs(CTX.mpf(sn[i]) - CTX.tanh(each)) <= 4e-16 * abs(CTX.tanh(each))
        assert abs(CTX.mpf(cn[i]) - CTX.sech(each)) <= 4e-16 * CTX.sech(each) + 1e-303
        assert dn[i] == cn[i]
        angle = CTX.atan(CTX.tanh(each) / CTX.tan(CTX.mpf("0.3")))
        assert abs(CTX.mpf(below[0](at)[i]) + angle) <= 4e-16


@pytest.mark.parametrize("where", ["1e-9", "0.01", "0.2", "0.5", "0.7", "0.99"])
@pytest.mark.parametrize("m", PARAMETERS[1:])
def test_sweeps(m, where):
    """The sweeps about both turning points, with the multiple of z that is left out."""
    m = parameter(m)
    tau = ratio(m)
    beta = CTX.mpf(where) * tau / 2
    series, at = series_of(m)
    with working(200):
        (own, other), step = series.sweeps(arb(str(2 * beta * CTX.ellipk(m))), 1)
    step = float(step)
    nome = CTX.exp(-CTX.pi * tau)
    for i, part in enumerate(PARTS):
        left = (CTX.pi - 2 * CTX.mpf(step)) * CTX.mpf(part)  # of the real sweep
        for sweep, n in ((own, 1), (other, 2)):
            theta = CTX.jtheta(n, CTX.pi * CTX.mpc(CTX.mpf(part), beta), nome)
            want = (CTX.pi / 2 if n == 1 else 0) - CTX.arg(theta) - left
            assert abs(CTX.mpf(float(sweep(at)[i])) - want) < 1e-15, (n, part)
