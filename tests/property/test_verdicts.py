"""Verdicts over the whole space, against the definitions evaluated at 300 digits with roots."""

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heavytop.classification import Kind
from heavytop.classification.classify import classify
from heavytop.numbers import Exact
from heavytop.scene.state import State
from heavytop.scene.top import Top

mp = mpmath.mp.clone()
mp.dps = 300
ZERO = mp.mpf(10) ** -250

numbers = st.one_of(
    st.floats(-50, 50).map(lambda x: x if abs(x) > 1e-20 else 0.0),
    st.sampled_from([0.0, 1.0, -1.0, 2.0, 1e-12, -1e-9, 1e-30, 0.5, 1e6]),
)
tilts = st.one_of(
    st.floats(1e-20, 3.1415926),
    st.sampled_from(["0", "pi", "pi/2", "pi/3", "1e-8", "1e-30", "0.1"]),
)
moments = st.sampled_from(
    [("1", "1"), ("2", "1"), ("3.28e-4", "6.6e-5"), ("1", "2"), ("1", "0.01")]
)


class Truth:
    """The motion in mpmath: constants, cubic, roots."""

    def __init__(self, top, start):
        self.A, self.C, self.g = (x.mpf(mp) for x in (top.A, top.C, top.gMR))
        theta, td, pd, w3 = (
            x.mpf(mp) for x in (start.theta, start.thetadot, start.phidot, start.omega3)
        )
        self.u, self.s = mp.cos(theta), mp.sin(theta)
        if abs(self.s) < ZERO:
            self.s = mp.zero
        self.td, self.pd, self.w3 = td, pd, w3
        self.p_psi = self.C * w3
        self.p_phi = self.A * pd * self.s**2 + self.p_psi * self.u
        self.e = self.A * (td**2 + (pd * self.s) ** 2) / 2 + self.g * self.u

    def f(self, u):
        return 2 * (self.e - self.g * u) * (1 - u * u) * self.A - (self.p_phi - self.p_psi * u) ** 2

    def turning(self):
        """The two roots between which u moves."""
        A, g = self.A, self.g
        cubic = [
            2 * A * g, -(2 * A * self.e + self.p_psi**2), 2 * (self.p_phi * self.p_psi - A * g),
            2 * A * self.e - self.p_phi**2,
        ]  # fmt: skip
        roots = sorted(x.real for x in mp.polyroots(cubic, maxsteps=500, extraprec=2000))
        return roots[:2] if g > 0 else roots[1:]


def holds(kind, x):
    """Whether the definition of a kind holds, equalities to 1e-250 of what they are part of."""

    def none(value, *terms):
        return abs(value) <= ZERO * max(map(abs, terms), default=1) or value == 0

    vertical = x.s == 0 and x.td == 0
    up = x.g * x.u > 0
    top = none(x.p_phi - x.p_psi, x.p_phi, x.p_psi)
    bottom = none(x.p_phi + x.p_psi, x.p_phi, x.p_psi)
    level = abs(x.g)
    match kind:
        case Kind.AT_REST:
            return x.td == 0 and x.pd * x.s == 0 and x.w3 == 0 and (x.g == 0 or x.s == 0)
        case Kind.FORCE_FREE:
            return x.g == 0
        case Kind.SLEEPING | Kind.HANGING:
            return vertical and up is (kind is Kind.SLEEPING)
        case Kind.PLANAR_PENDULUM:
            return x.p_psi == 0 and x.pd * x.s == 0
        case Kind.SEPARATRIX:
            return (top if x.g > 0 else bottom) and none(x.e - level, x.e, level)
        case Kind.THROUGH_TOP:
            return top and x.e > x.g
        case Kind.THROUGH_BOTTOM:
            return bottom and x.e > -x.g
        case Kind.UNIFORM_PRECESSION:
            terms = (x.A * x.u * x.pd**2, -x.p_psi * x.pd, x.g)
            return x.td == 0 and none(sum(terms), *terms)
    low, high = x.turning()
    if x.p_psi == 0:
        return kind is Kind.WAVES
    turn = x.p_phi / x.p_psi
    near = min(abs(turn - low), abs(turn - high))
    if kind is Kind.CUSPS:
        return near < mp.mpf(10) ** -40  # a turning point is a root, good to half the digits
    return (low < turn < high) is (kind is Kind.LOOPS) or near < mp.mpf(10) ** -40


@settings(max_examples=400, deadline=None)
@given(moments, numbers, tilts, numbers, numbers, numbers, st.booleans())
def test_the_first_kind_that_fits(moments, gMR, theta, thetadot, phidot, spin, held):
    """The verdict's definition holds, and that of no kind before it."""
    top = Top(*moments, gMR)
    start = State(theta, thetadot=thetadot, phidot=phidot, **{"omega3" if held else "psidot": spin})
    found = classify(top, start)
    assert found.certified
    assert 0 < found.margin <= 1
    low, high = found.margin_enclosure
    assert low <= found.margin <= high
    assert high - low <= 1e-14 * found.margin + 1e-300
    x = Truth(top, start)
    assert holds(found.kind, x)
    order = list(Kind)
    for earlier in order[: min(order.index(found.kind), order.index(Kind.LOOPS))]:
        assert not holds(earlier, x), earlier


@settings(max_examples=200, deadline=None)
@given(
    st.sampled_from(["psidot", "omega3"]), st.integers(3, 30), st.sampled_from([-1, 1]),
    st.floats(0.05, 3.0), st.floats(0.5, 50),
)  # fmt: skip
def test_beside_a_cusp(held, exponent, way, theta, spin):
    """Dropped from rest it has cusps; kicked by ±1e-3 … ±1e-30 it has loops or waves, proved.

    Near rest the sign of E' p_psi − gMR p_phi is that of −gMR φ̇ p_psi: loops backwards, waves
    forwards, while the kick is below 2 gMR/p_psi.
    """
    top = Top("1", "0.5", "1")
    kick = way * Exact.of(f"1e-{exponent}")
    dropped = classify(top, State(theta, **{held: spin}))
    kicked = classify(top, State(theta, phidot=kick, **{held: spin}))
    assert dropped.kind is Kind.CUSPS
    assert kicked.kind is (Kind.WAVES if way > 0 else Kind.LOOPS)
    assert dropped.certified
    assert kicked.certified


@pytest.mark.parametrize("exponent", [1, 3, 6, 9, 12])
def test_around_the_sleeping_threshold(exponent):
    """C ω3 = 2 √(A gMR), an irrational number: on it marginal, beside it stable or unstable."""
    top = Top("3.28e-4", "6.60e-5", "0.0456")
    threshold = 2 * (top.A * top.gMR) ** Exact.of("1/2").fraction / top.C
    off = Exact.of(f"1e-{exponent}")
    for way, tag in ((-1, "unstable"), (0, "marginal"), (1, "stable")):
        found = classify(top, State(0, omega3=threshold * (1 + way * off)))
        assert (found.kind, found.tags) == (Kind.SLEEPING, (tag,))
