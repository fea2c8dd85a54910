"""The start of the closed form is the given one."""

from fractions import Fraction

import pytest

from heavytop.exact import PI
from heavytop.exact.decimals import context

from ..motions import MOTIONS, motion, named
from ..views import Bounds, holds
from .test_form import TINY, near

CTX = context(80)


STARTS = {name: named(name) for name in MOTIONS}
STARTS |= {f"{name}, {e}": each for e in TINY for name, each in near(e).items()}


@pytest.mark.parametrize("begun", STARTS.values(), ids=STARTS)
def test_start_is_the_start(begun):
    """At t = 0 every angle and rate is the given one, in the interval too."""
    at, found = begun.at(0, 70), Bounds(begun, 25)
    for each in ("theta", "phi", "psi", "thetadot", "phidot", "psidot"):
        # on a pole φ and ψ, and their rates, have no value of their own
        if begun.start.theta not in (0, PI) or each == "theta":
            given = getattr(begun.start, each).mpf(CTX)
            size = abs(given) if each == "theta" else 1 + abs(given)
            assert abs(getattr(at, each) - given) <= size * CTX.mpf("1e-60")
            assert holds(found(each, 0), given, 38)


@pytest.mark.parametrize(("theta", "up"), [(0, 1), ("pi", -1)])
@pytest.mark.parametrize("thetadot", [1, -1])
@pytest.mark.parametrize("gMR", [3, -3])
def test_start_on_a_pole_names_the_side_it_goes_to(theta, up, thetadot, gMR):
    """φ₀ is where the axis goes; when θ̇₀ points through the pole it is φ₀ + π, and ψ₀ ∓ π."""
    begun = motion(2, 1, gMR, theta, phi="0.3", psi="0.2", thetadot=thetadot, psidot=1)
    at = begun.at(Fraction(1, 10**20), 30)
    turned = thetadot * up < 0
    assert abs(at.phi - CTX.mpf("0.3") - turned * CTX.pi) < 1e-19
    assert abs(at.psi - CTX.mpf("0.2") + up * turned * CTX.pi) < 1e-19
