"""The cubic's roots: published values, products of roots, and digits close to poles."""

from fractions import Fraction

import mpmath
import pytest

from heavytop.analytic.cubic import Roots
from heavytop.analytic.rising import Rising
from heavytop.analytic.solution import Asymptotic, Nutating, Steady
from heavytop.classification.reduced import FromAxis, FromScene, Regime
from heavytop.numbers import Exact
from heavytop.numbers.decimals import context
from heavytop.numbers.intervals import Interval, working
from heavytop.scene.state import State
from heavytop.scene.top import Top

CTX = context(60)
SICM = Top("3.28e-4", "6.6e-5", "0.0456")
LIE = Top("15.234375", "0.46875", "147.15")
BETSCH = Top("6.375e-3", "7.5e-4", "0.73575")
BITS = 256


def motion(top, theta, phidot, psidot, thetadot=0):
    return FromScene(top, State(theta, thetadot=thetadot, phidot=phidot, psidot=psidot))


def roots_of(source, bits=BITS):
    """The roots of a motion seen with g ≥ 0, each distance an interval."""
    with working(bits):
        regime, over = Regime.of(source), source.reduced(bits)
        found = Roots.of(over.mirrored() if regime.mirrored else over, regime)
        names = ("down", "up", "delta", "one_minus_u1", "one_plus_u1", "one_minus_u2",
                 "one_plus_u2", "m", "mc", "w")  # fmt: skip
        balls = {name: Interval.of(getattr(found, name)) for name in names}
        roots = {"u1": found.one_plus_u1 - 1, "u2": 1 - found.one_minus_u2, "u3": found.u3}
        return balls | {
            name: None if root is None else Interval.of(root) for name, root in roots.items()
        }


def mpf(ball, ctx=CTX):
    return ctx.mpf(ball.middle.numerator) / ball.middle.denominator


def tilt(found, which):
    """θ at u₁ or at u₂, from both distances."""
    high, low = (CTX.sqrt(mpf(found[f"one_{side}_u{which}"])) for side in ("minus", "plus"))
    return 2 * CTX.atan2(high, low)


# Closed form at 50 digits for the book's decimals, cross-checked by an independent integrator.
@pytest.mark.parametrize(
    ("phidot", "low", "high"),
    [
        (-15, "0.1", "0.51723131823843479801"),
        (0, "0.1", "0.18124330588605412758"),
        (15, "0.0061062066932874334", "0.1"),
    ],
)
def test_turning_angles_of_the_book(phidot, low, high):
    found = roots_of(motion(SICM, "0.1", phidot, 140))
    assert abs(tilt(found, 2) - CTX.mpf(low)) < CTX.mpf("1e-19")
    assert abs(tilt(found, 1) - CTX.mpf(high)) < CTX.mpf("1e-19")


def test_roots_of_the_lie_group_benchmark():
    """u = −0.99999999999973779144, 0, 3.2053612385329505649 (50 digits, cross-checked)."""
    found = roots_of(motion(LIE, "pi/2", "-4.61538", 150))
    assert abs(mpf(found["u1"]) + CTX.mpf("0.99999999999973779144")) < CTX.mpf("1e-20")
    assert found["u2"] == Interval(Fraction(0), Fraction(0))
    assert abs(mpf(found["u3"]) - CTX.mpf("3.2053612385329505649")) < CTX.mpf("1e-19")


def polynomial(source, ctx):
    """The cubic's coefficients in u from the numbers of the scene alone, g ≥ 0."""
    A, C, gMR = (x.mpf(ctx) for x in (source.top.A, source.top.C, source.top.gMR))
    start = source.start
    theta, thetadot, phidot, omega3 = (
        x.mpf(ctx) for x in (start.theta, start.thetadot, start.phidot, start.omega3)
    )
    u, sine, b = ctx.cos(theta), ctx.sin(theta), C * omega3 / A
    if gMR < 0:
        gMR, u, b = -gMR, -u, -b
    g, a = gMR / A, phidot * sine**2 + b * u
    h = (thetadot**2 + (phidot * sine) ** 2) / 2 + g * u
    return [2 * g, -(2 * h + b * b), 2 * a * b - 2 * g, 2 * h - a * a]


TINY = Exact.of("1e-30")
KINDS = {
    "loops": motion(Top(2, 1, 3), "0.7", 2, 5, "0.3"),
    "upside down": motion(Top(2, 1, -3), "0.7", 2, 5, "0.3"),
    "next to no weight": motion(Top(2, 1, TINY), "0.7", 2, 5, "0.3"),
    "falling": motion(Top(2, 1, 3), 2, "0.1", 9, 1),
    "1e-30 off steady": motion(BETSCH, "pi/3", 10, "135.6", TINY),
    "1e-30 inside the separatrix": FromScene(
        Top(2, 1, 2), State("pi/3", phidot="2/sqrt(3)", omega3=Exact.of("2*sqrt(3)") - TINY)
    ),
    "1e-30 beyond the separatrix": FromScene(
        Top(2, 1, 2), State("pi/3", phidot="2/sqrt(3)", omega3=Exact.of("2*sqrt(3)") + TINY)
    ),
    "1e-30 past the top": motion(Top(2, 1, 3), TINY, 1, 3, 2),
    "1e-30 off sleeping": motion(Top(2, 1, 3), TINY, 0, 3),
    "fast": motion(Top(1, "1e-6", 1), 1, "0.3", "1e9", "0.1"),
}


@pytest.mark.parametrize("name", KINDS)
def test_roots_hold_those_of_mpmath(name):
    """Every interval holds the polynomial roots found at 400 digits; each is narrow."""
    found, ctx = roots_of(KINDS[name], 640), context(400)
    with mpmath.workdps(400):
        coefficients = [mpmath.mpf(x) for x in polynomial(KINDS[name], ctx)]
        u1, u2, u3 = sorted(
            mpmath.re(u) for u in mpmath.polyroots(coefficients, maxsteps=900, extraprec=3000)
        )
        g = coefficients[0] / 2
        truth = {
            "u1": u1, "u2": u2, "u3": u3, "delta": u2 - u1, "m": (u2 - u1) / (u3 - u1),
            "mc": (u3 - u2) / (u3 - u1), "w": mpmath.sqrt(g * (u3 - u1) / 2),
            "one_minus_u1": 1 - u1, "one_plus_u1": 1 + u1,
            "one_minus_u2": 1 - u2, "one_plus_u2": 1 + u2,
        }  # fmt: skip
        for each, value in truth.items():
            ball = found[each]
            slack = Fraction(1, 10**300) * max(1, abs(ball.middle))
            assert value in Interval(ball.middle, ball.spread + slack), each
            assert ball.spread <= abs(ball.middle) / 10**60, each


@pytest.mark.parametrize("gMR", [3, -3, 0, TINY])
def test_roots_are_roots(gMR):
    """f vanishes at each finite root, for gMR of either sign, for none and for next to none."""
    source = motion(Top(2, 1, gMR), "0.7", 2, 5, "0.3")
    found = roots_of(source, 640)  # of which a third root at 1e30 takes 400
    f = polynomial(source, CTX)
    for name in ("u1", "u2", "u3"):
        if found[name] is None or abs(found[name].middle) > 2:
            continue  # far outside the sphere f is a difference of large numbers
        assert abs(CTX.polyval(f, mpf(found[name]))) < CTX.mpf("1e-50")
    assert (found["u3"] is None) == (gMR == 0)
    ends = sorted(tilt(found, which) for which in (1, 2))
    start = CTX.pi - CTX.mpf("0.7") if gMR == -3 else CTX.mpf("0.7")
    assert ends[0] < start < ends[1]


@pytest.mark.parametrize("tiny", ["1e-3", "1e-15", "1e-33"])
def test_distance_from_the_bottom_keeps_its_digits(tiny):
    """1 + u₁ against polynomial roots found at 400 digits, down to 1e-66."""
    source = motion(LIE, "pi/2", Exact.of("-60/13") + Exact.of(tiny), 150)
    found = roots_of(source)["one_plus_u1"]
    with mpmath.workdps(400):
        cubic = [mpmath.mpf(x) for x in polynomial(source, context(400))]
        lowest = min(mpmath.polyroots(cubic, maxsteps=500, extraprec=2000), key=lambda u: u.real)
        assert abs(mpmath.mpf(mpf(found)) / (lowest.real + 1) - 1) < mpmath.mpf("1e-30")


def test_a_start_on_a_turning_point_is_that_turning_point():
    """θ̇₀ = 0: exactly no way left on one side."""
    nothing = Interval(Fraction(0), Fraction(0))
    assert roots_of(motion(SICM, "0.1", -15, 140))["up"] == nothing
    assert roots_of(motion(SICM, "0.1", 15, 140))["down"] == nothing


def test_almost_steady_keeps_half_of_nothing():
    """u₂ − u₁ = 1e-30: the expansion about the start loses none of its digits."""
    source = motion(BETSCH, "pi/3", 10, Exact.of("135.6") + Exact.of("1e-28"))
    found, finer = roots_of(source)["delta"], roots_of(source, 1024)["delta"]
    assert found.middle < Fraction(1, 10**27)
    assert abs(found.middle / finer.middle - 1) < Fraction(1, 10**25)
    assert finer in found


# --- the regime --------------------------------------------------------------------------------

STEADY = motion(BETSCH, "pi/3", 10, "135.6")
ASYMPTOTIC = motion(Top(2, 1, 2), "pi/3", Exact.of("2/sqrt(3)"), Exact.of("5/sqrt(3)"))


def test_regimes():
    """Steady, asymptotic and nutating motions are told apart; only the last have roots."""
    kinds = {"steady": (STEADY, Steady), "asymptotic": (ASYMPTOTIC, Asymptotic),
             "nutating": (motion(Top(2, 1, 2), 1, 0, 1), Nutating)}  # fmt: skip
    for name, (source, kind) in kinds.items():
        rising = Rising(source)
        assert rising.regime.name == name
        with working(BITS):
            path = rising.solution(BITS).path
            assert type(path) is kind
            assert (path.period is None) == (name != "nutating")


@pytest.mark.parametrize("exponent", [30, 100, 290])
@pytest.mark.parametrize("side", [1, -1])
def test_no_threshold_decides_the_regime(exponent, side):
    """However near a special motion is, what differs from it nutates: 1e-290 is not nothing."""
    off = Exact.of(Fraction(side, 10**exponent))
    rate, spin = Exact.of("2/sqrt(3)"), Exact.of("2*sqrt(3)")
    weight = Top(2, 1, 2)
    near = (
        motion(BETSCH, "pi/3", 10, "135.6", off),
        motion(BETSCH, "pi/3", Exact.of(10) + off, "135.6"),
        FromScene(weight, State("pi/3", phidot=rate, omega3=spin + off)),
        FromScene(weight, State("pi/3", phidot=rate, omega3=spin, thetadot=off)),
        FromScene(weight, State(0, omega3=3, thetadot=off)),
        FromScene(Top(2, 1, off), State("pi/2", phidot=1)),
    )
    for source in near:
        assert Regime.of(source).name == "nutating"
    assert Regime.of(near[2]).misses_top != Regime.of(near[3]).misses_top
    assert Regime.of(near[5]).mirrored == (side < 0)
    assert not Regime.of(near[5]).weightless


@pytest.mark.parametrize(
    ("theta", "mirrored", "misses_top", "misses_bottom"),
    [(0, False, False, True), ("pi", False, True, False)],
)
def test_a_start_on_a_pole_passes_through_it(theta, mirrored, misses_top, misses_bottom):
    """Seen with g ≥ 0: with g < 0 top and bottom change places."""
    for gMR in (3, -3):
        regime = Regime.of(motion(Top(2, 1, gMR), theta, 0, 4, 1))
        poles = (regime.misses_top, regime.misses_bottom)
        assert poles == ((misses_top, misses_bottom) if gMR > 0 else (misses_bottom, misses_top))
        assert regime.mirrored == (gMR < 0)
        assert regime.resting
        assert not regime.steady


@pytest.mark.parametrize("bits", [64, 256, 1024])
def test_rounding_is_no_motion(bits):
    """An axis along its momentum, or round the equator, without weight: steady at any precision."""
    axes = ((0.375, -0.5, 0.75), (0.375, -0.625, 0.75), (-0.9375, 0.21875, -0.25))
    along = [FromAxis(e, [3 * x for x in e], 0) for e in axes]
    round_equator = motion(Top(2, 1, 0), "pi/2", 1, 0)
    for source in (*along, round_equator):
        rising = Rising(source)
        assert rising.regime.steady
        with working(bits):
            assert isinstance(rising.solution(bits).path, Steady)


def test_an_axis_a_hair_off_its_momentum_moves():
    """One unit in the last place is no rounding: doubles are exact."""
    e = (0.375, -0.5, 0.75)
    l = (1.125, -1.5, 2.25 * (1 + 2**-52))  # noqa: E741
    assert Regime.of(FromAxis(e, l, 0)).name == "nutating"
