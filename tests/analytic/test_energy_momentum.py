"""The energy–momentum diagram against the effective potential, books, and proved kinds."""

import mpmath
import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.energy_momentum import energy_momentum
from heavytop.errors import NotANumber

from ..motions import BOOK, CONE, INVERTED

DIAGRAMS = {  # the top and p_psi; the threshold of the book's top is 0.0077348
    "falls": (BOOK, "0.004"),
    "falls, backwards": (BOOK, "-0.004"),
    "sleeps": (BOOK, "0.00924"),
    "threshold": (BOOK, "sqrt(4*3.28e-4*0.0456)"),
    "spherical pendulum": (BOOK, 0),
    "inverted, falls": (INVERTED, "0.005"),
    "inverted, sleeps": (INVERTED, "-0.00924"),
}


def diagram_of(name):
    return energy_momentum(*DIAGRAMS[name])


def unit_of(diagram):
    """√(A |gMR|) [kg m² s⁻¹]."""
    return float(np.sqrt(float(diagram.top.A) * abs(float(diagram.top.gMR))))


def valley(top, p_phi, p_psi):
    """The least of (p_phi - p_psi u)^2/2A(1 - u^2) + gMR u, from its definition, at 40 digits."""
    with mpmath.workdps(40):
        A, gMR, p, q = (x.mpf(mpmath.mp) for x in (top.A, top.gMR, ht.Exact.of(p_phi), p_psi))

        def V(theta):
            lift = gMR * mpmath.cos(theta)
            return (p - q * mpmath.cos(theta)) ** 2 / (2 * A * mpmath.sin(theta) ** 2) + lift

        tilts = mpmath.linspace(mpmath.mpf("1e-12"), mpmath.pi - mpmath.mpf("1e-12"), 400)
        nearest = min(range(1, 399), key=lambda k: V(tilts[k]))
        low, high = tilts[nearest - 1], tilts[nearest + 1]
        for _ in range(170):
            one, other = (2 * low + high) / 3, (low + 2 * high) / 3
            low, high = (low, other) if V(one) < V(other) else (one, high)
        return float(V(low)), float(low)


@pytest.mark.reference
@pytest.mark.parametrize("name", DIAGRAMS)
def test_the_edge_is_the_bottom_of_the_effective_potential(name):
    """Every motion has E' >= V(theta) >= min V; its slope is phidot = dH/dp_phi, by Hamilton."""
    diagram = diagram_of(name)
    unit, weight = unit_of(diagram), abs(float(diagram.top.gMR))
    p_phi = unit * np.array([-7.1, -2.6, -1.3, 0.03, 0.6, 1.1, 1.9, 4.4])
    truth = np.array([valley(diagram.top, p, diagram.p_psi) for p in p_phi])
    assert np.all(abs(diagram.least(p_phi) - truth[:, 0]) < 1e-14 * (weight + abs(truth[:, 0])))
    np.testing.assert_allclose(diagram.edge(p_phi).theta, truth[:, 1], rtol=0, atol=1e-12)
    p_phi, step = p_phi[1:-1], 1e-5 * unit
    slope = (diagram.least(p_phi + step) - diagram.least(p_phi - step)) / (2 * step)
    np.testing.assert_allclose(slope, diagram.edge(p_phi).rate, rtol=1e-8)


@pytest.mark.reference
def test_steady_precessions_of_the_books_lie_on_the_edge():
    """SICM exercise 2.13 (theta 0.1, omega3 140) by another program, and Betsch & Steinmann."""
    rates = np.array([6.3668390938832, 21.945335558617])
    p_phi = 3.28e-4 * rates * np.sin(0.1) ** 2 + 6.6e-5 * 140 * np.cos(0.1)
    found = diagram_of("sleeps").edge(p_phi)
    np.testing.assert_allclose(found.rate, rates, rtol=1e-11)
    np.testing.assert_allclose(found.theta, 0.1, rtol=1e-11)
    assert found.fast.tolist() == [False, True]
    diagram = energy_momentum(CONE, "7.5e-4*140.6")
    for which, rate in (("slow", 10), ("fast", 23.082352941176471)):
        place = diagram.steady(np.pi / 3, which)
        p = 6.375e-3 * rate * 0.75 + 7.5e-4 * 140.6 / 2
        energy = 0.73575 / 2 + 6.375e-3 * rate**2 * 0.75 / 2
        told = place.rate, place.p_phi, place.E_prime, diagram.least(p)
        assert [float(x) for x in told] == pytest.approx([rate, p, energy, energy], rel=1e-14)
        assert place.fast == (which == "fast")


@pytest.mark.parametrize("name", DIAGRAMS)
def test_the_sheets_by_tilt_are_the_edge(name):
    """Slow and fast, wherever both are real: p_psi^2 >= 4 A gMR cos theta; and they meet there."""
    diagram = diagram_of(name)
    tilt = np.linspace(0.02, np.pi - 0.02, 96)  # not pi/2, where there is one rate only
    A, gMR = float(diagram.top.A), float(diagram.top.gMR)
    real = float(diagram.p_psi) ** 2 >= 4 * A * gMR * np.cos(tilt)
    for which in ("slow", "fast"):
        found = diagram.steady(tilt, which)
        assert np.array_equal(np.isfinite(found.rate), real)
        on = found.p_phi[real]
        np.testing.assert_allclose(diagram.least(on), found.E_prime[real], rtol=1e-11, atol=1e-15)
        np.testing.assert_allclose(diagram.edge(on).rate, found.rate[real], rtol=1e-8)
        if float(diagram.p_psi):
            assert np.all(found.fast[real] == (which == "fast"))


@pytest.mark.parametrize("beta", [0.0, 0.3, 1.999, 2.0, 2.5])
@pytest.mark.parametrize("side", [1, -1])
def test_the_focus_focus_point_comes_down_to_the_edge(beta, side):
    """Where p_phi = p_psi the quartic is (W^2 - g)(W^2 - bW + g): least E' at W = sqrt(g), so that
    the standing top is gMR (2 - beta)^2/2 above it, beta = |p_psi|/sqrt(A gMR); from beta = 2 on 0.
    """
    diagram = energy_momentum(ht.Top(4, 1, side * 9), 6 * beta)
    below = 9 * max(2 - beta, 0) ** 2 / 2
    assert diagram.depth == pytest.approx(below, rel=1e-12)
    place = diagram.standing
    assert place == (side * 6 * beta, 9)
    assert place.E_prime - diagram.least(place.p_phi) == pytest.approx(below, abs=1e-13)
    assert (diagram.focus_focus is None) == (beta >= 2) == (not diagram.isolated)


@pytest.mark.parametrize("name", DIAGRAMS)
def test_every_region_has_its_kind(name):
    """The kinds proved by `classify` on a start with exactly the constants of the place."""
    diagram = diagram_of(name)
    unit, weight, seen = unit_of(diagram), abs(float(diagram.top.gMR)), set()
    for p_phi in unit * np.array([-2.7, -1.35, -0.52, 0.11, 0.47, 0.83, 1.7]):
        for energy in diagram.least(p_phi) + weight * np.linspace(0.07, 1.93, 6):
            told = str(diagram.kinds(energy, p_phi))
            proved = ht.classify(diagram.top, diagram.start(energy, p_phi))
            assert (str(proved.kind), proved.certified) == (told, True)
            seen.add(told)
    assert seen == ({"waves"} if diagram.p_psi.sign() == 0 else {"waves", "loops"})
    assert diagram.kinds(diagram.least(unit) - 1e-9 * weight, unit) == ""


@pytest.mark.parametrize("name", [name for name in DIAGRAMS if name != "threshold"])
def test_the_lines_between_regions_have_their_kinds(name):
    """Proved: p_phi = ±p_psi above the ends of the line of cusps, and that line between them."""
    diagram = diagram_of(name)
    top, p_psi, gMR = diagram.top, diagram.p_psi, diagram.top.gMR
    lines = [(gMR + ht.Exact.of("0.7"), p_psi), (ht.Exact.of("0.7") - gMR, -p_psi)]
    lines += [(gMR * part, p_psi * part) for part in map(ht.Exact.of, ("-0.6", "0.1", "0.8"))]
    names = ["planar-pendulum"] * 5
    if diagram.cusps:
        names = ["through-top", "through-bottom", "cusps", "cusps", "cusps"]
    for (energy, p_phi), expected in zip(lines, names, strict=True):
        proved = ht.classify(top, diagram.start(energy, p_phi))
        assert (str(proved.kind), proved.certified) == (expected, True)


@pytest.mark.parametrize("gMR", [8, -8])
def test_the_lines_are_where_doubles_tell_them(gMR):
    diagram, side = energy_momentum(ht.Top(4, 1, gMR), 2), gMR // 8
    p_phi = side * np.array([2, -2, 1, -1, 2, -2])
    told = diagram.kinds([8.5, 0.5, 4, -4, 8, -8], p_phi).tolist()
    passes = ["through-top", "through-bottom"][::side]
    assert told == [*passes, "cusps", "cusps", "separatrix", "hanging"]
    assert diagram.cusps == (diagram.hanging, diagram.standing) == ((-2 * side, -8), (2 * side, 8))
    assert ht.classify(diagram.top, diagram.start(8, 2 * side)).kind == "separatrix"


def test_special_places_by_name():
    diagram = energy_momentum(ht.Top(1, 1, 1), 3)
    assert diagram.kinds([1, -1, 1.5], [3, -3, 0]).tolist() == ["sleeping", "hanging", "loops"]
    on_edge = diagram.kinds(diagram.least(1.0), 1.0)
    assert on_edge == "uniform-precession"
    free = energy_momentum(ht.Top(1, 1, 0), 1)
    assert free.kinds([1, 1, 0.9], [0, 2, 2]).tolist() == ["force-free", "", ""]
    assert (free.focus_focus, free.cusps, free.ratio, free.depth) == (None, None, None, 0)
    np.testing.assert_array_equal(free.least([-3, -1, 0.5, 2]), [4, 0, 0, 1.5])
    np.testing.assert_array_equal(free.edge([-3, 2]).rate, [-3, 2])
    np.testing.assert_allclose(np.cos(free.edge([-3, 2]).theta), [-1 / 3, 1 / 2], rtol=1e-15)


# p_psi, p_phi, E', gMR: beside corners and edges, and where the axis passes a pole
PLACES = {
    "through the bottom, barely": (1.0, -1.0, -0.999, 1),
    "through a stable top": (2.5, 2.5, 1.01, 1),
    "inverted, through the top, barely": (1.0, 1.0, -0.999, -1),
    "inverted, past a stable bottom": (2.5, -2.5 + 1e-13, 1.01, -1),
    "beside the focus–focus point": (1.0, 1.0 + 1e-12, 1.0 - 1e-12, 1),
    "planar, swinging": (0, 0.0, -0.9, 1),
    "free": (1.0, 0.3, 0.01, 0),
    "free, through the top": (1.0, 1.0, 0.01, 0),
}


@pytest.mark.parametrize("name", PLACES)
def test_what_a_nutation_brings_anywhere(name):
    """The same from the place, and from the motion that starts at `start`, whose kind is proved."""
    p_psi, p_phi, E_prime, gMR = PLACES[name]
    diagram = energy_momentum(ht.Top(1, "0.6", gMR), p_psi)
    motion = ht.Motion(diagram.top, diagram.start(E_prime, p_phi))
    assert motion.certified
    kept = [float(x) for x in (motion.constants.E_prime, motion.constants.p_phi)]
    assert kept == pytest.approx([E_prime, p_phi], rel=1e-15, abs=1e-30)
    told = diagram.advance(p_phi, E_prime)
    gained = [float(each) for each in (told.period, told.precession, told.spin)]
    alone = [motion.period, motion.precession, motion.spin]
    assert gained == pytest.approx(alone, rel=1e-13, abs=1e-13)
    brought = diagram.b * (1 / 0.6 - 1) * motion.period
    assert float(told.relative_spin) == pytest.approx(motion.spin - brought, abs=1e-12)
    if motion.from_top > 0.5:
        rising = diagram.start(E_prime, p_phi, theta=motion.theta_min + 1e-3, branch="rising")
        assert rising.thetadot.sign() == -1


@pytest.mark.parametrize(
    ("act", "says"),
    [
        (lambda d: d.start("-0.05", 0), "E: at least"),
        (lambda d: d.advance(0.0, -0.05), "E_prime: at least"),
        (lambda d: d.steady(1.0, "quick"), '"slow" or "fast"'),
    ],
)
def test_refusals_say_what_would_be_right(act, says):
    with pytest.raises(ht.ImpossibleStart, match=says):
        act(diagram_of("falls"))
    with pytest.raises(NotANumber):
        energy_momentum(BOOK, "fast")
