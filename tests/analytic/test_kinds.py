"""Every kind of motion from a start that is one, and its neighbours that are not."""

import random
from fractions import Fraction

import numpy as np
import pytest

from heavytop.analytic.motion import Motion
from heavytop.classification import Kind
from heavytop.classification.classify import classify
from heavytop.numbers import Exact
from heavytop.scene.state import State
from heavytop.scene.top import Top

SICM = (Fraction("3.28e-4"), Fraction("6.6e-5"), Fraction("0.0456"))
BETSCH = (Fraction("6.375e-3"), Fraction("7.5e-4"), Fraction("0.73575"))
X = Exact.of


def verdict(top, theta, phidot=0, psidot=0, thetadot=0, omega3=None):
    spin = {"psidot": psidot} if omega3 is None else {"omega3": omega3}
    return classify(Top(*top), State(theta, thetadot=thetadot, phidot=phidot, **spin))


def sicm(phidot, **spin):
    return verdict(SICM, Fraction("0.1"), phidot, **(spin or {"psidot": 140}))


@pytest.mark.parametrize(
    ("phidot", "spin", "kind"),
    [
        # the ladder of SICM §2.10, ψ̇ = 140 held: loops below 0, cusp at 0, waves, cusp, loops
        (-137.277519110785, {}, Kind.WAVES),
        (-137.277519110782, {}, Kind.LOOPS),
        (-15, {}, Kind.LOOPS),
        (0, {}, Kind.CUSPS),
        (1, {}, Kind.WAVES),
        (9.26062465343215, {}, Kind.WAVES),
        (9.26062465343217, {}, Kind.LOOPS),
        (15, {}, Kind.LOOPS),
        (15.6958379980759, {}, Kind.LOOPS),
        (15.6958379980761, {}, Kind.WAVES),
        # and with ω3 = 140 held
        (-5638.8439, {"omega3": 140}, Kind.WAVES),
        (-5638.8437, {"omega3": 140}, Kind.LOOPS),
        (9.87012987012986, {"omega3": 140}, Kind.WAVES),
        (9.87012987012988, {"omega3": 140}, Kind.LOOPS),
        (15, {"omega3": 140}, Kind.WAVES),
    ],
)
def test_ladder_of_kicks(phidot, spin, kind):
    """Waves, loops, cusp, waves, loops: as φ̇₀ grows, with ψ̇ or with ω3 held."""
    assert sicm(phidot, **spin).kind is kind


def test_the_cusp_that_starts_at_the_bottom():
    """k = 2gMR/p_ψ = 760/77 with ω3 = 140 held is a cusp exactly, and 1e-30 beside it is not."""
    cusp = Fraction(760, 77)
    assert sicm(cusp, omega3=140).kind is Kind.CUSPS
    for aside, kind in ((-1, Kind.WAVES), (1, Kind.LOOPS)):
        found = sicm(cusp + aside * Fraction(1, 10**30), omega3=140)
        assert found.kind is kind
        assert 1e-33 < found.margin < 1e-29


TWO = (2, 1, 3)
KINDS = [
    ("at rest below", (TWO, X("pi")), "at-rest", ()),
    ("at rest above", (TWO, 0), "at-rest", ()),
    ("at rest, weightless", ((2, 1, 0), 1), "at-rest", ()),
    ("force-free", ((2, 1, 0), 1, 1, 20), "force-free", ("closed-orbit",)),
    ("sleeping", (TWO, 0, 0, 20), "sleeping", ("stable",)),
    ("marginal: ω3² C² = 4 A gMR", ((2, 1, 2), 0, 0, 4), "sleeping", ("marginal",)),
    ("unstable", (TWO, 0, 0, 1), "sleeping", ("unstable",)),
    ("upside down", ((2, 1, -3), X("pi"), 0, 20), "sleeping", ("stable", "inverted-gravity")),
    ("hanging", (TWO, X("pi"), 0, 1), "hanging", ()),
    ("hanging up", ((2, 1, -3), 0, 0, 1), "hanging", ("inverted-gravity",)),
    ("swing", (TWO, 1), "planar-pendulum",
     ("swinging", "closed-orbit", "start-at-rest")),
    ("turning over", (TWO, 1, 0, 0, 5), "planar-pendulum",
     ("rotating", "closed-orbit")),
    ("θ̇² = 4gMR/A sin²½θ", ((2, 1, 2), X("pi/3"), 0, 0, 1), "planar-pendulum", ("asymptotic",)),
    ("separatrix", ((2, 1, 2), X("pi/3"), X("2/sqrt(3)"), X("5/sqrt(3)")), "separatrix", ()),
    ("through the top", (TWO, 0, 0, 2, 3), "through-top", ()),
    ("through the bottom", (TWO, X("pi"), 0, 2, 3), "through-bottom", ()),
    ("slow", (BETSCH, X("pi/3"), 10, Fraction("135.6")), "uniform-precession",
     ("slow", "closed-orbit")),
    ("single", ((1, 1, 2), X("pi/2"), 1, 2), "uniform-precession",
     ("single", "spherical-top", "closed-orbit")),
    ("cone", ((2, 1, -2), X("pi/3"), X("sqrt(2)"), -X("sqrt(2)/2")), "uniform-precession",
     ("single", "spherical-pendulum", "closed-orbit", "inverted-gravity")),
    ("spherical pendulum", (TWO, X("pi/2"), 1, 0), "waves", ("spherical-pendulum",)),
    ("spherical top", ((1, 1, 3), 1, 1, 5), "waves", ("spherical-top",)),
    ("dropped", (SICM, Fraction("0.1"), 0, 140), "cusps", ("start-at-rest",)),
]  # fmt: skip


@pytest.mark.parametrize(("name", "case", "kind", "tags"), KINDS, ids=[k[0] for k in KINDS])
def test_kinds(name, case, kind, tags):
    found = verdict(*case)
    assert found.kind == kind
    assert found.tags == tags
    assert found.certified
    assert found.why
    assert not found.open_tags
    low, high = found.margin_enclosure
    assert low <= found.margin <= high
    assert 0 < found.margin <= 1


def test_fast_is_the_other_rate():
    """At the p_ψ of the slow precession 10 rad/s the fast one is gMR/(A cosθ·10) = 23.08…"""
    A, _, gMR = BETSCH
    fast = gMR / (A * Fraction(1, 2) * 10)
    assert float(fast) == pytest.approx(23.082352941176471, rel=1e-15)
    omega3 = Fraction("135.6") + 5
    assert verdict(BETSCH, X("pi/3"), fast, omega3=omega3).tags == ("fast", "closed-orbit")
    assert verdict(BETSCH, X("pi/3"), 10, omega3=omega3).tags == ("slow", "closed-orbit")
    assert verdict(BETSCH, X("pi/3"), fast + Fraction(1, 10**30), omega3=omega3).kind != (
        "uniform-precession"
    )


def test_next_to_special_kinds_is_generic():
    """1e-30 off, each special kind is told from its neighbours, with a margin that says so."""
    off = X("1e-30")
    cases = [
        verdict((2, 1, 2), X("pi/3"), X("2/sqrt(3)"), X("5/sqrt(3)") + off),
        verdict(TWO, off, 0, 2, 3),
        verdict(BETSCH, X("pi/3"), X("10") + off, Fraction("135.6")),
    ]
    for found in cases:
        assert found.kind in ("loops", "waves", "cusps")
        assert found.margin < 1e-28
    assert "near-separatrix" in cases[0].tags


def drawn(draw, gMR):
    """A motion at random."""
    start = State(
        draw.uniform(0.3, 2.8), thetadot=draw.uniform(-1, 1), phidot=draw.uniform(-2, 2),
        psidot=draw.uniform(-3, 3),
    )  # fmt: skip
    return Motion(Top(2, draw.uniform(0.1, 3.9), gMR), start)


def test_spin_reversal_is_what_the_rates_do():
    """ψ̇ takes both signs exactly when the tag says so: seen on the closed form, at random."""
    draw, seen = random.Random(5), set()
    for _ in range(40):
        motion = drawn(draw, draw.choice([-3, 0, 3]))
        rates = motion.at(np.linspace(0, motion.period, 4001)).psidot
        reverses = bool(rates.min() < 0 < rates.max())
        found = classify(motion.top, motion.start)
        assert ("spin-reversal" in found.tags) is reverses
        seen.add((motion.top.gMR.sign() < 0, reverses))
    assert len(seen) == 4


def test_loops_are_what_the_rates_do():
    """φ̇ takes both signs in loops and one in waves, for either sign of gMR, at random."""
    draw, seen = random.Random(3), set()
    for _ in range(60):
        motion = drawn(draw, draw.uniform(-3, 3))
        rates = motion.at(np.linspace(0, motion.period, 4001)).phidot
        kind = classify(motion.top, motion.start).kind
        assert (kind is Kind.LOOPS) is bool(rates.min() < 0 < rates.max())
        seen.add(kind)
    assert seen == {Kind.LOOPS, Kind.WAVES}
