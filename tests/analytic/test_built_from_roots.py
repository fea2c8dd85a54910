"""Tops built backwards from chosen roots u₁ ≤ u₂ ≤ u₃, so that each kind is hit exactly.

From f(∓1) = −P±²: P₊² = 2g (1 + u₁)(1 + u₂)(1 + u₃) and P₋² = 2g (1 − u₁)(1 − u₂)(u₃ − 1). The
start is a turning point, where φ̇ = (a − b u)/(1 − u²).
"""

import itertools

import pytest

from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.classification.classify import classify
from heavytop.classification.reduced import FromScene, Regime
from heavytop.errors import Unseparated
from heavytop.numbers import Exact, sqrt
from heavytop.scene.state import State
from heavytop.scene.top import Top

X = Exact.of
ANGLES = {  # cosines of angles that a scene can say exactly
    "0": X(1),
    "pi/6": sqrt("3/4"),
    "pi/4": sqrt("1/2"),
    "pi/3": X("1/2"),
    "pi/2": X(0),
    "2*pi/3": X("-1/2"),
    "3*pi/4": -sqrt("1/2"),
    "pi": X(-1),
}


def built(theta, other, third, signs=(1, 1), g="1.25", A="2", C="0.5"):
    """The top and the start at θ that has the roots cosθ, `other` and `third`."""
    g, A, C, u = X(g), X(A), X(C), ANGLES[theta]
    plus = signs[0] * sqrt(2 * g * (1 + u) * (1 + other) * (1 + third))
    minus = signs[1] * sqrt(2 * g * (1 - u) * (1 - other) * (third - 1))
    a, b = (plus + minus) / 2, (plus - minus) / 2
    phidot = (a - b * u) / (1 - u * u) if u not in (1, -1) else X(0)
    return Top(A, C, g * A), State(theta, phidot=phidot, omega3=b * A / C)


PAIRS = [  # of turning points, the higher first, apart and away from the poles
    (high, low)
    for high, low in itertools.combinations(ANGLES, 2)
    if "0" not in (high, low) and "pi" not in (high, low)
]
SIGNS = [(1, 1), (1, -1), (-1, 1), (-1, -1)]


@pytest.mark.parametrize("signs", SIGNS)
@pytest.mark.parametrize(("high", "low"), PAIRS)
def test_generic(high, low, signs):
    """Loops where φ̇ has opposite signs at the two turning points, waves where it has one."""
    for third in (X("1.0625"), X(3)):
        top, start = built(high, ANGLES[low], third, signs)
        opposite = built(low, ANGLES[high], third, signs)
        rates = start.phidot.sign() * opposite[1].phidot.sign()
        for found in (classify(top, start), classify(*opposite)):
            assert found.kind is (Kind.LOOPS if rates < 0 else Kind.WAVES)
            assert found.certified
            assert not found.open_tags
        roots = Motion(top, start).roots
        expected = (ANGLES[low], ANGLES[high], third)
        assert roots == pytest.approx([float(x) for x in expected], abs=1e-15)


def with_reversal(low, u1, where, third):
    """The start at the lower turning point of a motion with p_φ = p_ψ `where`, u₂ left to follow.

    f(u₁) = 0 and the product of (1 + u) over the roots give b² = 2g (1 + u₁)(1 + u₂)(1 + u₃)/
    (1 + where)²; with where = u₂ that is a cusp.
    """
    b = sqrt(2 * (1 + u1) * (1 + third) / (1 + where))
    return Top(1, X("0.25"), 1), State(
        low, phidot=b * (where - u1) / (1 - u1 * u1), omega3=b / X("0.25")
    )


@pytest.mark.parametrize(("high", "low"), PAIRS)
def test_cusps(high, low):
    """u₃ such that a = b u₂; φ̇ a hair's breadth off, 1e-3 … 1e-30, it is loops or waves."""
    u1, u2 = ANGLES[low], ANGLES[high]
    ratio = (1 - u2) * (1 + u1) / ((1 + u2) * (1 - u1))
    top, start = with_reversal(low, u1, u2, (1 + ratio) / (1 - ratio))
    assert classify(top, start).kind is Kind.CUSPS
    released = State(high, omega3=start.omega3)
    assert classify(top, released).kind is Kind.CUSPS
    for exponent in (3, 10, 17, 30):
        for way, kind in ((-1, Kind.WAVES), (1, Kind.LOOPS)):
            rate = start.phidot + way * X(f"1e-{exponent}")
            off = classify(top, State(low, phidot=rate, omega3=start.omega3))
            assert off.kind is kind
            assert off.margin < 10.0 ** (1 - exponent)


def test_what_cannot_be_proved_is_undecided():
    """A cusp whose P₊ and P₋ are two roots of nested roots: zero, for all that 4096 bits say."""
    u1, u2 = ANGLES["pi/4"], ANGLES["pi/6"]
    ratio = (1 - u2) * (1 + u1) / ((1 + u2) * (1 - u1))
    third = (1 + ratio) / (1 - ratio)
    found = classify(*built("pi/4", u2, third, (1, -1)))
    assert found.kind is Kind.UNDECIDED
    assert not found.certified
    assert found.tags == ()
    assert found.bound.endswith("e-1221") or float(found.bound) < 1e-300
    assert found.bound in found.why
    off = classify(*built("pi/4", u2, third + X("1e-30"), (1, -1)))
    assert off.certified


@pytest.mark.parametrize("theta", ["pi/6", "pi/3", "pi/2", "3*pi/4"])
def test_double_root_at_the_start(theta):
    """u₁ = u₂: uniform precession; with the third root 1e-30 away, still."""
    for third, signs in itertools.product((X("1.5"), X(1) + X("1e-30")), SIGNS):
        found = classify(*built(theta, ANGLES[theta], third, signs))
        assert found.kind is Kind.UNIFORM_PRECESSION
        assert found.tags[0] in (("single",) if theta == "pi/2" else ("slow", "fast"))


SPECIAL = [
    ("through-top", "pi/3", X(1), X(2), ()),
    ("through-bottom", "pi/3", X(-1), X(2), ()),
    ("separatrix", "pi/3", X(1), X(1), ()),
    ("planar-pendulum", "pi/3", X(-1), X(1), ("swinging", "closed-orbit", "start-at-rest")),
    ("sleeping", "0", X(1), X(1), ("marginal",)),
    ("sleeping", "0", X("1/2"), X(1), ("unstable",)),
    ("sleeping", "0", X(1), X("1.5"), ("stable",)),
    ("hanging", "pi", X(-1), X("1.5"), ()),
]


@pytest.mark.parametrize(("kind", "theta", "other", "third", "tags"), SPECIAL)
def test_special(kind, theta, other, third, tags):
    """Roots on the poles."""
    found = classify(*built(theta, other, third))
    assert found.kind == kind
    assert found.tags == tags
    assert found.certified


@pytest.mark.parametrize("exponent", [4, 8, 15, 30, 60])
def test_next_to_the_poles(exponent):
    """With a root 1e-4 … 1e-60 off a pole nothing passes it, and the margin knows."""
    off = X(f"1e-{exponent}")
    for other, third in ((1 - off, X(2)), (off - 1, X(2)), (1 - off, 1 + off)):
        found = classify(*built("pi/3", other, third, (1, -1)))
        assert found.kind in (Kind.LOOPS, Kind.WAVES)
        assert found.certified
        assert 10.0 ** (-exponent - 2) < found.margin < 100 * 10.0 ** (-exponent / 2)


def test_near_separatrix():
    """The tag where 1 − m < 1e-6, on both sides of the separatrix; m = (u₂ − u₁)/(u₃ − u₁)."""
    for off, near in ((X("4.9e-7"), True), (X("5.1e-7"), True), (X("1.02e-6"), False)):
        second = 1 - off / 2
        third = 1 + off / 4
        mc = (third - second) / (third - X("1/2"))
        expected = (mc - X("1e-6")).sign() < 0
        found = classify(*built("pi/3", second, third))
        assert ("near-separatrix" in found.tags) is expected is (near and expected)


def test_zeros_that_only_a_proof_sees():
    """A rate that is zero by an identity counts as zero; one that no identity shows, as unknown."""
    top, seen = Top(1, 1, 1), "(1+sqrt(2))*(sqrt(2)-1)-1"
    found = classify(top, State("0.3", phidot=seen, thetadot="(pi+1)^2-pi^2-2*pi-1", psidot=10))
    assert (found.kind, found.certified) == (Kind.CUSPS, True)
    assert 0 < found.margin_enclosure[0] <= found.margin <= found.margin_enclosure[1]
    unseen = State("sqrt(3+2*sqrt(2))-1-sqrt(2)", psidot=1)  # theta = 0
    assert classify(top, unseen).kind is Kind.UNDECIDED
    with pytest.raises(Unseparated):
        Regime.of(FromScene(top, unseen))
