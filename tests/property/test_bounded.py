"""Bounds contain the truth: Fractions and mpmath against arrays of doubles."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heavytop.classification.bounded import Bounded, total
from heavytop.classification.cosines import COS_ULPS, HEIGHT_ULPS, cosines

U = Fraction(1, 2**53)
exponents = st.integers(-100, 99)
mantissas = st.integers(2**52, 2**53 - 1)
signs = st.sampled_from((-1, 1))
doubles = st.one_of(
    st.just(0.0),
    st.builds(lambda s, m, e: s * math.ldexp(m, e - 52), signs, mantissas, exponents),
    st.builds(lambda s, m, e: s * math.ldexp(m, e - 52), signs, mantissas, st.integers(-1, 1)),
)


def leaf(x):
    return Bounded.of(np.array([x])), Fraction(x)


def grown(pairs):
    """Sums, differences, products and small multiples of what there is."""
    return st.one_of(
        st.tuples(pairs, pairs).map(lambda p: (p[0][0] + p[1][0], p[0][1] + p[1][1])),
        st.tuples(pairs, pairs).map(lambda p: (p[0][0] - p[1][0], p[0][1] - p[1][1])),
        st.tuples(pairs, pairs).map(lambda p: (p[0][0] * p[1][0], p[0][1] * p[1][1])),
        pairs.map(lambda p: (p[0] * p[0], p[1] * p[1])),
        pairs.map(lambda p: (abs(p[0]), abs(p[1]))),
        st.tuples(st.integers(-(10**40), 10**40), pairs).map(
            lambda p: (p[0] * p[1][0], p[0] * p[1][1])
        ),
    )


sums = st.recursive(doubles.map(leaf), grown, max_leaves=9)


def assert_holds(found, truth):
    value, bound = found.value[0], found.bound[0]
    if max(-found.low, found.high) > 960:
        assert math.isnan(value)
        assert not found.least[0] > 0
        assert found.most[0] != 0
        return
    assert math.isfinite(bound)
    assert abs(Fraction(value) - truth) <= Fraction(bound)
    least, most = Fraction(found.least[0]), Fraction(found.most[0])
    assert least * (1 - 3 * U) <= abs(truth) <= most * (1 + 3 * U)
    assert (least > 0) == (abs(value) > bound)
    assert most != 0 or truth == 0
    if found.positive:
        assert value >= 0


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value")
@settings(max_examples=1500, deadline=None)
@given(sums)
def test_bounds_contain_sums_and_products(pair):
    """Whatever is added and multiplied, the exact rational lies within the bound."""
    assert_holds(*pair)


@settings(max_examples=300, deadline=None)
@given(doubles, doubles, doubles, doubles)
def test_bounds_contain_quotients_and_roots(a, b, c, d):
    """√(|a| b²) and |a| c²/|d|, by mpmath; division by zero is left open."""
    with mpmath.workprec(600), np.errstate(all="ignore"):
        (x, a), (y, b), (z, c), (w, d) = map(leaf, (a, b, c, d))
        root = (abs(x) * (y * y)).sqrt()
        exact = mpmath.sqrt(mpmath.mpf(abs(a).numerator) / abs(a).denominator) * abs(
            mpmath.mpf(b.numerator) / b.denominator
        )
        assert abs(mpmath.mpf(root.value[0]) - exact) <= mpmath.mpf(root.bound[0])
        quotient = abs(x) * (z * z) / abs(w)
        if d:
            assert_holds(quotient, abs(a) * c * c / abs(d))
        else:
            assert not quotient.least[0] > 0


@pytest.mark.parametrize("ulps", [4, 41, 1000])
def test_a_root_keeps_half_of_the_error(ulps):
    """√4 from a 4 that is known to n units only, off by all of them on either side."""
    for side in (-1, 1):
        four = Bounded(np.array([4 * (1 + side * ulps * 2.0**-53)]), ulps, 2, 3, positive=True)
        root = four.sqrt()
        assert abs(root.value[0] - 2) <= root.bound[0] <= (ulps / 2 + 4) * 2.0**-52


@settings(max_examples=300, deadline=None)
@given(doubles, doubles, st.integers(-300, 300))
def test_scaling_keeps_the_truth(a, b, k):
    """2ᵏ (a + b), small beside 1 or not: the truth is within the bound, or nothing is said."""
    (x, a), (y, b) = leaf(a), leaf(b)
    found = (x + y).scaled(np.array([2.0**k]), 3)
    if (abs(a) + abs(b)) * Fraction(2) ** k <= 8:
        assert_holds(found, (a + b) * Fraction(2) ** k)
    else:
        assert np.isnan(found.value[0]) or abs(found.value[0]) <= 8


@pytest.mark.parametrize("x", [5e-324, 1e-300, 2.0**-101, 1e31, 1.7e308, np.inf, -np.inf, np.nan])
def test_numbers_out_of_range_are_left_open(x):
    """No product, sum, root or multiple of them is told from zero, nor said to be zero."""
    given = Bounded.of(np.array([x]))
    zero, one = Bounded.of(np.zeros(1)), Bounded.of(np.ones(1))
    for found in (given, given * zero, given + one, 2 * given, abs(given).sqrt(), one - given):
        assert not found.least[0] > 0
        assert found.most[0] != 0


def test_what_may_leave_the_range_of_doubles_is_left_open():
    """2¹⁰⁰ to the tenth, and 2⁻¹⁰⁰; to the ninth both are held."""
    for x in (2.0**100, 2.0**-100):
        number = power = Bounded.of(np.array([x]))
        for _ in range(8):
            power = power * number
        assert power.least[0] > 0
        assert np.isnan((power * number).value[0])


def test_exact_zeros_stay_exact():
    zero, some = Bounded.of(np.zeros(1)), Bounded.of(np.array([0.1]))
    for found in (zero * some, -3 * zero, zero + zero, zero * (some - some), zero.sqrt()):
        assert found.most[0] == 0
    assert (some - some).most[0] > 0  # what cancels is not known to


def test_negative_numbers_are_open_where_none_may_be():
    found = Bounded.of(np.array([-1.0, 0.0, 1.0]), positive=True)
    assert np.array_equal(found.value, [np.nan, 0.0, 1.0], equal_nan=True)


@pytest.mark.parametrize("act", [lambda x: x.sqrt(), lambda x: x / x, lambda x: abs(x) / x])
def test_sums_that_may_cancel_are_no_divisors_and_have_no_root(act):
    some = Bounded.of(np.ones(1))
    with pytest.raises(ValueError, match="may cancel"):
        act(some - some)


def test_total_is_the_sum():
    parts = [leaf(x) for x in (1.0, 1e-17, -1.0)]
    assert_holds(total(tuple(x for x, _ in parts)), sum(q for _, q in parts))


def tilts():
    """More than 1e5 angles in [0, π]: all over, and as near to 0, π/4, … as doubles are."""
    random = np.random.default_rng(5)
    near = [
        np.concatenate([x + k * np.spacing(x), x * (1 + np.ldexp(k, -40)), x + k * 1e-9])
        for k in (np.arange(-3000, 3001),)
        for x in (math.pi / 4, math.pi / 2, 3 * math.pi / 4, math.pi, 1.0, 2.0)
    ]
    small = np.exp(random.uniform(math.log(2.0**-100), 0, 20_000))
    parts = [random.uniform(0, math.pi, 60_000), small, math.pi - small, math.pi / 2 - small]
    parts += [[0.0, 1e-8, 2.0**-100, math.pi, math.pi / 2], *near]
    theta = np.concatenate(parts)
    return theta[(theta >= 0) & (theta <= math.pi)]


def test_cosines_are_within_their_bounds():
    """cosθ, 1 − cosθ and 1 + cosθ by mpmath; the errors seen are well within what is proved."""
    theta = tilts()
    assert theta.size > 100_000
    found = cosines(theta)
    values = [each.value.tolist() for each in found]
    worst = [0.0, 0.0, 0.0]
    with mpmath.workprec(320):
        for i, x in enumerate(theta.tolist()):
            cos = mpmath.cos(mpmath.mpf(x))
            for j, truth in enumerate((cos, 1 - cos, 1 + cos)):
                value = values[j][i]
                units = abs(float(truth - value) / value) * 2**53 if value else float(truth != 0)
                worst[j] = max(worst[j], units)
    assert worst[0] < 2.5 < COS_ULPS
    assert worst[1] < 6 < HEIGHT_ULPS
    assert worst[2] < 6 < HEIGHT_ULPS
    for each in found:
        assert (each.value == 0).sum() <= (theta == 0).sum()
        some = np.abs(each.value[each.value != 0])
        assert 2.0**each.low <= some.min()
        assert some.max() <= 2.0**each.high


def test_only_zero_is_a_pole():
    cos, below, above = cosines(np.array([0.0, -0.0, 2.0**-100, math.pi]))
    assert (below.value == 0).tolist() == [True, True, False, False]
    assert (above.value > 0).all()
    assert cos.value.tolist() == [1, 1, 1, -1]


@pytest.mark.parametrize(
    "theta", [5e-324, 1e-300, 2.0**-101, -1e-3, np.nextafter(math.pi, 4), 4.0, np.nan, np.inf]
)
def test_other_tilts_are_left_open(theta):
    for found in cosines(np.array([theta])):
        assert np.isnan(found.value[0])
