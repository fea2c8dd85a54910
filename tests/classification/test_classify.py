"""Kinds by definition over the whole space, of tops built to have them, and of their neighbours.

Tops are built backwards from chosen roots u₁ ≤ u₂ ≤ u₃, so that each kind is hit exactly: from
f(∓1) = −P±², P₊² = 2g (1 + u₁)(1 + u₂)(1 + u₃) and P₋² = 2g (1 − u₁)(1 − u₂)(u₃ − 1). The start is
a turning point, where φ̇ = (a − b u)/(1 − u²).
"""

import itertools
from fractions import Fraction

import pytest
from flint import arb
from hypothesis import given, settings
from hypothesis import strategies as st

from heavytop import Kind, State, Top
from heavytop.classification.classify import UndecidedError, classify
from heavytop.exact import Exact, sqrt

from ..motions import BOOK
from ..starts import CTX, kind_of

X = Exact.of
numbers = st.sampled_from([0.0, 1.0, -1.0, 2.0, 1e-12, -1e-9, 1e-30, 0.5, 1e6])
numbers |= st.floats(-50, 50).map(lambda x: x if abs(x) > 1e-20 else 0.0)
tilts = st.sampled_from(["0", "pi", "pi/2", "pi/3", "1e-8", "1e-30", "0.1"])
tilts |= st.floats(1e-20, 3.1415926)
moments = st.sampled_from([(1, 1), (2, 1), ("3.28e-4", "6.6e-5"), (1, 2), (1, "0.01")])


@settings(max_examples=400, deadline=None)
@given(moments, numbers, tilts, numbers, numbers, numbers, st.booleans())
def test_the_first_kind_that_fits(moments, gMR, theta, thetadot, phidot, spin, held):
    """Kinds and details are those of their definitions, at 300 digits."""
    held = "omega3" if held else "psidot"
    top, start = Top(*moments, gMR), State(theta, thetadot=thetadot, phidot=phidot, **{held: spin})
    found = classify(top, start)
    assert found.certified
    numbers = [X(x).mpf(CTX) for x in (*moments, gMR, theta, thetadot, phidot, spin)]
    kind, detail = kind_of(*numbers, held=held)
    assert found.kind == kind
    assert not detail or detail in found.tags


@pytest.mark.parametrize("exponent", [1, 12])
def test_around_the_sleeping_threshold(exponent):
    """C ω3 = 2 √(A gMR), an irrational number: on it marginal, beside it stable or unstable."""
    threshold, off = 2 * sqrt(BOOK.A * BOOK.gMR) / BOOK.C, X(f"1e-{exponent}")
    for way, tag in ((-1, "unstable"), (0, "marginal"), (1, "stable")):
        found = classify(BOOK, State(0, omega3=threshold * (1 + way * off)))
        assert (found.kind, found.tags) == (Kind.SLEEPING, (tag,))


# --- built from their roots ----------------------------------------------------------------------


ANGLES = {  # cosines of angles that a scene can say exactly
    "0": X(1), "pi/6": sqrt("3/4"), "pi/4": sqrt("1/2"), "pi/3": X("1/2"), "pi/2": X(0),
    "2*pi/3": X("-1/2"), "3*pi/4": -sqrt("1/2"), "pi": X(-1),
}  # fmt: skip


def built(theta, other, third, signs=(1, 1)):
    """The top and the start at θ that has the roots cosθ, `other` and `third`."""
    g, A, C, u = X("1.25"), X("2"), X("0.5"), ANGLES[theta]
    plus = signs[0] * sqrt(2 * g * (1 + u) * (1 + other) * (1 + third))
    minus = signs[1] * sqrt(2 * g * (1 - u) * (1 - other) * (third - 1))
    a, b = (plus + minus) / 2, (plus - minus) / 2
    phidot = (a - b * u) / (1 - u * u) if u not in (1, -1) else X(0)
    return Top(A, C, g * A), State(theta, phidot=phidot, omega3=b * A / C)


INNER = [name for name in ANGLES if name not in ("0", "pi")]


@pytest.mark.parametrize(("high", "low"), [*itertools.combinations(INNER, 2)])
def test_cusps(high, low):
    """u₃ such that a = b u₂; φ̇ a hair's breadth off, 1e-3 … 1e-30, it is loops or waves.

    P₊ and P₋ are two roots of nested roots, of which no identity of polynomials shows zero.
    """
    u1, u2 = ANGLES[low], ANGLES[high]
    ratio = (1 - u2) * (1 + u1) / ((1 + u2) * (1 - u1))
    top, start = built(low, u2, (1 + ratio) / (1 - ratio), (1, -1))
    assert (classify(top, start).kind, classify(top, start).certified) == (Kind.CUSPS, True)
    assert classify(top, State(high, omega3=start.omega3)).kind is Kind.CUSPS
    for exponent in (3, 30):
        for way, kind in ((-1, Kind.WAVES), (1, Kind.LOOPS)):
            rate = start.phidot + way * X(f"1e-{exponent}")
            assert classify(top, State(low, phidot=rate, omega3=start.omega3)).kind is kind


def test_what_cannot_be_proved_is_undecided():
    """|cos 2| + cos 2 is 0 for all that 4096 bits say, and by no identity."""
    found = classify(Top(1, 1, 1), State("0.3", phidot="sqrt(cos(2)^2)+cos(2)", psidot=10))
    assert (found.kind, found.certified, found.tags) == (Kind.UNDECIDED, False, ())
    assert found.bound.endswith("e-1221") or float(found.bound) < 1e-300
    assert found.bound in found.why


@pytest.mark.parametrize("size", ["1.249", "-9.96e-5", "1.001e-1300"])
def test_the_bound_of_an_open_sign_is_rounded_up(size):
    bound = UndecidedError("p", arb(size)).bound
    assert abs(Fraction(size)) <= Fraction(bound) <= abs(Fraction(size)) * Fraction("1.1")


def test_near_separatrix():
    """The tag where 1 − m < 1e-6, on both sides of the separatrix; m = (u₂ − u₁)/(u₃ − u₁)."""
    for off, near in ((X("4.9e-7"), True), (X("5.1e-7"), True), (X("1.02e-6"), False)):
        second = 1 - off / 2
        third = 1 + off / 4
        expected = ((third - second) / (third - X("1/2")) - X("1e-6")).sign() < 0
        found = classify(*built("pi/3", second, third))
        assert ("near-separatrix" in found.tags) is expected is (near and expected)
