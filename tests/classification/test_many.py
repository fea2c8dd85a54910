"""Kinds of whole arrays against p_φ, p_ψ and E at 300 digits, and against the one-by-one proof."""

import math

import numpy as np
import pytest

import heavytop as ht
from heavytop.classification import kinds, many
from heavytop.classification.arrays import TAG_NAMES, bits, detail
from heavytop.errors import Impossible, NotANumber

from ..starts import nasty, regular, top_and_state


def assert_one_by_one(numbers, found):
    """Kind, detail, tags and proof are those of `classify`."""
    for at, row in enumerate(zip(*(each.tolist() for each in numbers.values()), strict=True)):
        verdict = ht.classify(*top_and_state(dict(zip(numbers, row, strict=True))))
        assert found.names[found.kind[at]] == verdict.kind, row
        assert found.detail[at] == detail(verdict.tags), row
        assert found.tags[at] == bits(verdict.tags), row
        assert found.open_tags[at] == bits(verdict.open_tags), row
        assert found.certified[at] == verdict.certified


@pytest.mark.parametrize("held", ["psidot", "omega3"])
def test_many_are_what_they_are_one_by_one(held):
    numbers = nasty(np.random.default_rng(7), 800, held)
    found = ht.classify_many(**numbers, tags=True)
    assert found.certified.all()
    assert_one_by_one(numbers, found)


def test_away_from_the_boundaries_none_is_sent():
    """Doubles tell the tags too, spin reversal among them, and of a pole that is passed."""
    numbers = regular(np.random.default_rng(3), 1000)
    numbers["C"][::5] = numbers["A"][::5]
    numbers["omega3"][::7] = 0.0
    found = ht.classify_many(**numbers, tags=True)
    assert found.sent == 0
    assert_one_by_one(numbers, found)
    both = [(found.tags & bits((name,)) > 0).mean() for name in TAG_NAMES[:3]]
    assert 0.1 < min(both) <= max(both) < 0.9
    passing = {"A": 2, "C": 1.5, "gMR": 3, "theta": 0, "thetadot": 2, "phidot": 9}
    found = ht.classify_many(**passing, omega3=np.linspace(-5, 5, 40), tags=True)
    assert (found.counts, found.sent, found.tags.any()) == ({"through-top": 40}, 0, False)


def test_near_the_separatrix():
    """Near p_φ = p_ψ, as E' tends to gMR, 1 − m falls below 1e-6: balls say so, and only there."""
    omega3 = 1.4 * (1 + math.cos(1.0)) * (1 + 1e-6)
    rise = 2 * (1 - math.cos(1.0)) - (0.7 * math.sin(1.0)) ** 2
    thetadot = math.sqrt(rise) * (1 + 10.0 ** np.arange(-12, -1, 0.25))
    given = {"A": 1.0, "C": 0.5, "gMR": 1.0, "theta": 1.0, "phidot": 0.7, "omega3": omega3}
    numbers = {name: np.full(44, x) for name, x in given.items()} | {"thetadot": thetadot}
    found = ht.classify_many(**numbers, tags=True)
    assert_one_by_one(numbers, found)
    assert 10 < np.sum(found.tags & bits(("near-separatrix",)) > 0) <= found.sent < 34


def test_spin_reversal_beside_a_turning_point():
    """Where a start with ψ̇ = 0 turns back, ψ̇ only touches 0; beside it nothing is told amiss."""
    random, n = np.random.default_rng(8), 400
    numbers = regular(random, n)
    del numbers["omega3"]
    flat = np.arange(n) % 2 == 0  # discs near the top: the zero of ψ̇ is then least well known
    numbers["C"] = np.where(flat, 2 * numbers["A"], numbers["C"])
    numbers["theta"] = np.where(flat, 10.0 ** random.uniform(-4, -1, n), numbers["theta"])
    numbers["psidot"] = 10.0 ** random.uniform(-17, -9, n) * random.choice((-1, 0, 1), n)
    numbers["thetadot"] = 10.0 ** random.uniform(-17, -5, n) * random.choice((-1, 0, 1), n)
    found = ht.classify_many(**numbers, tags=True)
    assert_one_by_one(numbers, found)
    assert 0.05 < (found.tags & bits(("spin-reversal",)) > 0).mean() < 0.95
    still = (numbers["psidot"] == 0) & (numbers["thetadot"] == 0) & ~flat
    assert ht.classify_many(**{name: x[still] for name, x in numbers.items()}, tags=True).sent == 0


def test_far_from_the_separatrix_by_two_numbers():
    """Where 1 − m < 1e-6, E' and P∓ are as near to the separatrix as `kinds.FAR` says."""
    random, n = np.random.default_rng(21), 4000
    d, e = 10 ** random.uniform(-9, -5, (2, n))
    beside = 1 - e - 10 ** random.uniform(-9, 0, n)
    u1 = np.where(random.random(n) < 0.1, beside, random.uniform(-1, 1, n))
    near = (u1 >= -1) & (u1 <= 1 - e) & (d + e < 1e-6 * (1 + d - u1))
    d, e, u1 = d[near], e[near], u1[near]
    # A = gMR = 1: f(1) = −P₋², f(−1) = −P₊² and f = 2 (E' − u)(1 − u²) − (a − b u)²
    minus, plus = np.sqrt(2 * (1 - u1) * e * d), np.sqrt(2 * (1 + u1) * (2 - e) * (2 + d))
    for side in (-1, 1):
        spare = u1 + 1 + d - e - ((plus - side * minus) / 2) ** 2 / 2  # E' − gMR
        assert np.all(kinds.FAR_RATIO * abs(2 * spare) < 1 - 1e-9)
    assert np.all((kinds.FAR_RATIO * minus) ** 2 < 10)
    assert near.sum() > 250


# --- shapes, and what is impossible ---------------------------------------------------------------


def test_arrays_are_broadcast_whatever_their_order(monkeypatch):
    """Rows, columns, transposed arrays and chunks of any size give what single elements give."""
    random = np.random.default_rng(2)
    given = {
        "A": 2.0, "C": random.uniform(0.1, 2, (3, 1, 1)), "gMR": random.normal(size=(4, 1)),
        "theta": random.uniform(0, 3, (5, 4, 3)).T, "phidot": random.normal(size=5),
        "thetadot": np.float32(0.25), "psidot": 3,
    }  # fmt: skip
    found = ht.classify_many(**given, tags=True)
    assert found.kind.shape == found.certified.shape == found.tags.shape == (3, 4, 5)
    monkeypatch.setattr(many, "TOPS_AT_ONCE", 7)
    parts = ht.classify_many(**given, tags=True)
    for field in ("kind", "detail", "certified", "tags", "open_tags"):
        assert np.array_equal(getattr(parts, field), getattr(found, field)), field
    full = np.broadcast_arrays(*given.values())
    one = ht.classify_many(**{name: x[1, 2, 3] for name, x in zip(given, full, strict=True)})
    assert one.kind == found.kind[1, 2, 3]


GOOD = {"A": 2.0, "C": 1.0, "gMR": 3.0, "theta": 1.0, "thetadot": 0.5, "phidot": 1.0, "omega3": 2.0}
BAD = [("theta", -1e-9), ("theta", -5e-324), ("theta", math.nextafter(math.pi, 4)), ("A", 1e308)]
BAD += [("A", 0.0), ("A", -1.0), ("C", -5e-324), ("C", -1.0)]
BAD += [(name, x) for name in GOOD for x in (math.nan, math.inf, -math.inf, 1e301, 1e-310)]


@pytest.mark.parametrize("still", [False, True])
def test_what_is_impossible_is_marked_and_counted(still):
    """What `Top` and `State` refuse is impossible here, in any company, and nothing else is."""
    base = GOOD | ({"thetadot": 0.0, "phidot": 0.0, "omega3": 0.0, "theta": 0.0} if still else {})
    cases = [base | {name: x} for name, x in BAD] + [base]
    table = {name: np.array([case[name] for case in cases]) for name in base}
    found = ht.classify_many(**table, tags=True)
    assert found.impossible.tolist() == [True] * len(BAD) + [False]
    assert found.counts["impossible"] == len(BAD)
    assert sum(found.counts.values()) == len(cases)
    assert found.sent == 0
    assert not found.tags[:-1].any()
    assert found.certified.all()
    for case in cases[:-1]:
        with pytest.raises((Impossible, ht.FoldedTiltWarning)):  # arrays fold no tilt
            top_and_state(case)


@pytest.mark.parametrize("theta", ["pi/3", [1, "x"], True, None, [[1, 2], [3]], np.longdouble(1)])
def test_what_is_no_array_of_numbers_is_refused(theta):
    with pytest.raises(NotANumber, match="theta"):
        ht.classify_many(A=1, C=1, gMR=1, theta=theta)


def test_refusals_and_results_that_do_not_change():
    with pytest.raises(ht.ImpossibleStart, match="not both"):
        ht.classify_many(A=1, C=1, gMR=1, theta=1, psidot=1, omega3=1)
    with pytest.raises(Impossible, match=r"theta \(2,\), phidot \(3,\)"):
        ht.classify_many(A=1, C=1, gMR=1, theta=[1, 2], phidot=[1, 2, 3])
    k = 2**27 + 1
    with pytest.raises(NotANumber, match=r"2\^53"):
        ht.classify_many(A=1, C=1, gMR=np.int64(k * k), theta=0, omega3=2 * k)
    none = ht.classify_many(A=1, C=1, gMR=1, theta=np.zeros((0, 3)))
    assert (none.kind.shape, none.counts) == ((0, 3), {})
