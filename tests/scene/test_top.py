"""Tops, from moments, parts and solids: published moments, integrals and the book's top."""

import math
import pickle
import re
from fractions import Fraction

import pytest
import sympy as sp

import heavytop as ht
from heavytop.exact.number import rational_value
from heavytop.scene.solids import ALUMINIUM, STEEL, combine, cone, disk, ring, rod, sphere

from ..motions import BOOK

GOOD = {
    ht.Top: {"A": 1, "C": 1, "gMR": 1},
    ht.Top.from_parts: {"mass": 1, "distance": 1, "A_cm": 1, "C_cm": 1, "gravity": "9.81"},
    ht.Top.from_solids: {"parts": [sphere(radius=1, centre=1, mass=1)], "gravity": 1},
    disk: {"radius": 1, "thickness": 1, "centre": 0, "mass": 1},
}


@pytest.mark.parametrize(("make", "values", "broken"), [
    (ht.Top, {"A": 0}, {"A"}),
    (ht.Top, {"C": -5e-324}, {"C"}),
    (ht.Top, {"A": math.nan, "C": -1, "gMR": True}, {"A", "C", "gMR"}),
    (ht.Top, {"A": "3 deg"}, {"A"}),
    (ht.Top.from_parts, {"A_cm": -1, "C_cm": 1}, {"A"}),
    (ht.Top.from_parts, {"C_cm": -1}, {"C_cm"}),
    (ht.Top.from_parts, {"gravity": "fast", "mass": -1}, {"gravity", "mass"}),
    *((ht.Top.from_solids, {"parts": parts}, {"solids"}) for parts in ([], [3])),
    (ht.Top.from_solids, {"gravity": "x"}, {"gravity"}),
    (disk, {"mass": 0}, {"mass"}),
    (disk, {"radius": -1, "thickness": "1 kg", "base": 0, "mass": None},
     {"base", "mass", "radius", "thickness"}),
    (cone, {"radius": 1, "apex": 2, "base": 2, "mass": 1}, {"base"}),
    (ring, {"outer": 1, "inner": 1, "thickness": 1, "base": 0, "mass": 1}, {"inner"}),
])  # fmt: skip
def test_what_is_impossible_is_refused_with_every_fault(make, values, broken):
    with pytest.raises(ht.ImpossibleTop) as error:
        make(**(GOOD.get(make, {}) | values))
    assert {fault.key for fault in error.value.faults} == broken


@pytest.mark.parametrize(("make", "values", "why"), [
    (ht.Top, {"C": 2.0000000000000004}, "C = 2.0000000000000004 > 2A = 2:"),
    (ht.Top.from_parts, {"C_cm": 2.5}, "C_cm = 2.5 > 2 A_cm = 2:"),
    (ht.Top.from_parts, {"A_cm": -0.5}, "A = 0.5 < M R² = 1:"),
])  # fmt: skip
def test_moments_that_no_rigid_body_has_are_warned_of_once_and_taken(make, values, why):
    with pytest.warns(ht.ImpossibleBodyWarning, match=re.escape(why)) as said:
        top = make(**(GOOD[make] | values))
    assert [top.warning] == [str(each.message) for each in said]
    assert pickle.loads(pickle.dumps(top)).warning == top.warning  # and says nothing anew


def moments(density, profile, start, end):
    """Mass, first moment, A and C about the pivot by integration over thin disks."""
    z = sp.Symbol("z")
    slab = density * sp.pi * profile(z) ** 2
    integrands = (1, z, profile(z) ** 2 / 4 + z**2, profile(z) ** 2 / 2)
    return [sp.integrate(sp.expand(slab * each), (z, start, end)) for each in integrands]


SHAPES = {  # a solid, its radius at each height, and its ends
    "disk": (disk(radius=2, thickness=1, base=3, density=7), lambda z: sp.Integer(2), (3, 4)),
    "rod below the pivot": (
        rod(radius="1/2", length=3, centre=-1, density=7), lambda z: 1 / sp.Integer(2),
        (-sp.Rational(5, 2), sp.Rational(1, 2)),
    ),
    "cone on its apex": (cone(radius=1, apex=2, base=5, density=7), lambda z: (z - 2) / 3, (2, 5)),
    "cone on its base": (cone(radius=1, apex=5, base=2, density=7), lambda z: (5 - z) / 3, (2, 5)),
    "sphere": (sphere(radius=2, centre=3, density=7), lambda z: sp.sqrt(4 - (z - 3) ** 2), (1, 5)),
}  # fmt: skip


@pytest.mark.parametrize("name", SHAPES)
def test_moments_are_the_integrals_over_thin_disks(name):
    body, profile, ends = SHAPES[name]
    mass, first, A, C = moments(7, profile, *ends)
    found = (body.mass, body.mass * body.centre, body.A, body.C_cm)
    for exact, integral in zip(found, (mass, first, A, C), strict=True):
        assert sp.simplify(sp.sympify(str(exact)) - integral) == 0


def test_a_ring_and_its_core_make_a_disk_and_density_and_mass_agree():
    wheel = ring(outer=3, inner="1/2", thickness=2, centre=5, density=7)
    core = rod(radius="1/2", length=2, base=4, density=7)
    assert combine([wheel, core]) == combine([disk(radius=3, thickness=2, centre=5, density=7)])
    light = disk(radius=1, thickness="1/pi", centre=0, density=5)
    assert light == disk(radius=1, thickness="1/pi", centre=0, mass=5)


THE_BOOKS = [
    ring(outer="0.042", inner="0.0015", thickness="0.005", centre="0.0505", density=ALUMINIUM),
    rod(radius="0.0015", length="0.178", base=0, density=STEEL),
]


def test_an_aluminium_disk_on_a_steel_rod_is_the_books_top():
    """SICM section 2.10 prints A = 3.28e-4, C = 6.60e-5, gMR = 0.0456."""
    top = ht.Top.from_solids(THE_BOOKS, gravity="9.80665")
    assert [f"{float(x):.3g}" for x in (top.A, top.C, top.gMR)] == ["0.000328", "6.6e-05", "0.0456"]


def test_from_solids_is_from_parts():
    """By parallel axes; upside down gMR is negative."""
    body = combine(THE_BOOKS)
    own = {"mass": body.mass, "distance": body.centre, "A_cm": body.A_cm, "C_cm": body.C}
    assert ht.Top.from_parts(**own, gravity="9.8") == ht.Top.from_solids(THE_BOOKS, gravity="9.8")
    hanging = ht.Top.from_solids([sphere(radius="0.1", centre=-1, mass=1)], gravity="9.81")
    assert hanging.gMR == ht.Exact.of("-9.81")


@pytest.mark.parametrize(("name", "case"), {  # a start, and times [s]
    "loops": (ht.State("0.4", phidot=-3, psidot=30), ("0", "0.21", "1.7")),
    "point mass": (ht.State("2", phidot="1.5", thetadot="0.3"), ("0.4", "2.5")),
}.items())  # fmt: skip
def test_the_force_of_the_pivot_moves_the_centre_of_mass(name, case):
    """Newton: M r̈ = F − M g, where r̈ is differenced from the exact path to 30 digits."""
    start, times = case
    moments = {"A_cm": 0, "C_cm": 0} if name == "point mass" else {"A_cm": "0.02", "C_cm": "0.01"}
    top = ht.Top.from_parts(mass="0.7", distance="-0.3", gravity="9.81", **moments)
    motion, h = ht.Motion(top, start), Fraction(1, 10**15)
    for time in times:
        now = Fraction(time)
        before, here, after = (motion.at(t, 60).axis for t in (now - h, now, now + h))
        force = motion.reaction(now, 40)
        doubles = motion.reaction(float(now))
        for k, gravity in enumerate((0, 0, Fraction("9.81"))):
            bent = (after[k] - 2 * here[k] + before[k]) * 10**30
            expected = Fraction("0.7") * (Fraction("-0.3") * rational_value(bent) + gravity)
            assert abs(rational_value(force[k]) - expected) < Fraction(1, 10**24)
            assert doubles[k] == pytest.approx(float(expected), rel=1e-12, abs=1e-12)


def test_a_force_of_the_pivot_needs_the_mass():
    with pytest.raises(ht.ImpossibleTop, match="needs mass and distance"):
        ht.Motion(BOOK, ht.State("0.1")).reaction(0.0)
    balanced = ht.Top(1, 1, 0, mass=1, distance=0)
    with pytest.raises(ht.ImpossibleTop, match="gravity: missing"):
        ht.Motion(balanced, ht.State("0.1")).reaction(0.0)
