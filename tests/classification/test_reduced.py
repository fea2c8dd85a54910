"""The reduced motion of a start, however it is given, and which special motion it is."""

from fractions import Fraction

from heavytop.analytic.form import midpoint
from heavytop.analytic.motion import ClosedForm
from heavytop.classification.reduced import AxisMotion, PassingMotion, StartMotion
from heavytop.exact.balls import working
from heavytop.exact.decimals import context
from heavytop.scene.state import State

from ..motions import TWO, WEIGHTLESS

CTX = context(60)


def reduced(source):
    """The numbers of a reduced motion: middles of intervals."""
    with working(300):
        return source.reduced(300).mapped(lambda ball: midpoint(CTX, ball))


def test_through_a_pole_moves_no_more_than_it_must():
    """A start rounded off one that passes exactly: p_φ and E' move by the rounding, b stays."""
    start = State("pi/3", thetadot="0.5", phidot=1 + Fraction(1, 10**17), psidot="2.5")
    rounded = StartMotion(TWO, start)  # P₋ is about 1e-17
    passing = PassingMotion(rounded, top=True, bottom=False)
    assert ClosedForm(rounded).regime.misses_top
    assert not ClosedForm(passing).regime.misses_top
    before, after = reduced(rounded), reduced(passing)
    assert abs(after.P_minus) < 1e-80 < abs(before.P_minus)
    assert passing.angles(200) == rounded.angles(200)
    for name in ("g", "b", "u0", "udot0", "kappa"):
        assert getattr(after, name) == getattr(before, name), name
    for name in ("drift0", "kinetic0"):
        assert 0 < abs(getattr(after, name) - getattr(before, name)) < 1e-16, name
    f = 2 * after.kinetic0 * after.one_minus_u0 * after.one_plus_u0 - after.drift0**2
    assert abs(f - after.udot0**2) <= CTX.mpf(10) ** -50


# --- which special motion it is ------------------------------------------------------------------


def test_rounding_is_no_motion():
    """An axis along its momentum, or round the equator, without weight: steady at any precision.

    One unit in the last place of an axis is no rounding: doubles are exact.
    """
    axes = ((0.375, -0.5, 0.75), (0.375, -0.625, 0.75), (-0.9375, 0.21875, -0.25))
    along = [AxisMotion(e, [3 * x for x in e], 0) for e in axes]
    assert all(ClosedForm(source).regime.steady for source in along)
    assert ClosedForm(StartMotion(WEIGHTLESS, State("pi/2", phidot=1))).regime.steady
    aside = (1.125, -1.5, 2.25 * (1 + 2**-52))
    assert ClosedForm(AxisMotion(axes[0], aside, 0)).regime.name == "nutating"
