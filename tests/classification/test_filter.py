"""What the filter is sure of is true: Fractions and mpmath against arrays of doubles."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heavytop.classification import filter as filtering
from heavytop.classification import kinds
from heavytop.classification.arrays import InputArrays
from heavytop.classification.filter import LIBRARY, ArraySigns, Sized, cosines
from heavytop.classification.kinds import sum_of

pytestmark = pytest.mark.reference

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
    return Sized.of(np.array([x])), Fraction(x)


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


def bound(found):
    return found.error * found.magnitude[0]


def assert_holds(found, truth):
    value = found.value[0]
    if not 2.0**-960 <= found.magnitude[0] <= 2.0**960:  # beyond all that a criterion is made of
        if found.least[0] > 0 and found.magnitude[0] > 1:
            assert (value > 0) == (truth > 0)
        return
    assert abs(Fraction(value) - truth) <= Fraction(bound(found))
    least, most = Fraction(found.least[0]), Fraction(found.most[0])
    assert least * (1 - 3 * U) <= abs(truth) <= most * (1 + 3 * U)
    if least > 0:
        assert (value > 0) == (truth > 0)
    assert most != 0 or truth == 0
    if found.magnitude is found.value:
        assert value >= 0


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value", "ignore:underflow")
@settings(max_examples=1500, deadline=None)
@given(sums)
def test_errors_contain_sums_and_products(pair):
    """Whatever is added and multiplied, the exact rational lies within the error."""
    assert_holds(*pair)


@pytest.mark.parametrize("x", [5e-324, 1e-300, 2.0**-101, 1e31, 1.7e308, np.inf, -np.inf, np.nan])
def test_numbers_out_of_range_are_left_open(x):
    """No product, sum, root or multiple of them is told from zero, nor said to be zero."""
    given = Sized.of(np.array([x]))
    zero, one = Sized.of(np.zeros(1)), Sized.of(np.ones(1))
    for found in (given, given * zero, given + one, 2 * given, abs(given), one - given):
        assert not found.least[0] > 0
        assert found.most[0] != 0


def test_exact_zeros_stay_exact():
    zero, some = Sized.of(np.zeros(1)), Sized.of(np.array([0.1]))
    for found in (zero * some, -3 * zero, zero + zero, zero * (some - some)):
        assert found.most[0] == 0
    assert (some - some).most[0] > 0  # what cancels is not known to


def test_negative_numbers_are_open_where_none_may_be():
    found = Sized.of(np.array([-1.0, 0.0, 1.0]), positive=True)
    assert np.array_equal(found.value, [np.nan, 0.0, 1.0], equal_nan=True)


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


def test_sines_of_the_library_are_trusted_with_reason():
    """Of the angles that are asked for, the library's error is half of what is allowed, or less."""
    theta = tilts()
    angles = theta[theta <= math.pi / 4]
    worst = 0.0
    with mpmath.workprec(320):
        for x, value in zip(angles.tolist(), np.sin(angles).tolist(), strict=True):
            truth = mpmath.sin(mpmath.mpf(x))
            units = abs(float((truth - value) / truth)) * 2**53 if truth else float(value != 0)
            worst = max(worst, units)
    assert worst < LIBRARY / 2


@pytest.mark.slow
def test_cosines_are_within_their_errors():
    """cosθ, 1 − cosθ and 1 + cosθ by mpmath; the errors seen are well within what is allowed."""
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
    assert worst[0] < 5 < found[0].roundings
    assert worst[1] < 6 < found[1].roundings
    assert worst[2] < 6 < found[2].roundings
    for each in found:
        assert (each.value == 0).sum() <= (theta == 0).sum()
        some = np.abs(each.value[each.value != 0])
        assert some.min() >= 2.0**-202
        assert some.max() <= 2


def test_only_zero_is_a_pole():
    cos, one_minus_cos, one_plus_cos = cosines(np.array([0.0, -0.0, 2.0**-100, math.pi]))
    assert (one_minus_cos.value == 0).tolist() == [True, True, False, False]
    assert (one_plus_cos.value > 0).all()
    assert cos.value.tolist() == [1, 1, 1, -1]


@pytest.mark.parametrize(
    "theta", [5e-324, 1e-300, 2.0**-101, -1e-3, np.nextafter(math.pi, 4), 4.0, np.nan, np.inf]
)
def test_other_tilts_are_left_open(theta):
    for found in cosines(np.array([theta])):
        assert np.isnan(found.value[0])


# --- the criteria themselves ---------------------------------------------------------------------

NUMBERS = (
    kinds.PASS_TOP, kinds.PASS_BOTTOM, kinds.OVER_TOP, kinds.OVER_BOTTOM, kinds.STEADY,
    kinds.LOOPING, kinds.SLEEPING, kinds.THETA_RATE, kinds.ACROSS, kinds.SPIN,
    kinds.WEIGHT, kinds.SINE, kinds.HIGH, kinds.FASTER,
)  # fmt: skip


def tops(random, n, held, wide):
    """Tops and starts, some with numbers as small and as large as are let in, and cancelling."""

    def size(n):
        return 2.0 ** (random.uniform(-99.9, 99.9, n) if wide else random.uniform(-4, 4, n))

    def rate(n):
        return size(n) * random.choice((-1, 1, 0), n, p=(0.4, 0.4, 0.2))

    A, theta = size(n), random.uniform(0, math.pi, n)
    C = A * random.uniform(0.01, 2, n)
    beside = np.minimum(np.where(random.random(n) < 0.5, size(n), 1e-9), 1.5)
    theta = np.where(random.random(n) < 0.3, beside, theta)
    theta = np.where(random.random(n) < 0.2, math.pi - beside, theta)
    phidot, spin = rate(n), rate(n)
    pole = random.choice((-1, 1), n)  # where p_φ = ±p_ψ, nearly
    above = np.where(pole > 0, 2 * np.cos(theta / 2) ** 2, 2 * np.sin(theta / 2) ** 2)
    aimed = pole * A * phidot * above / C * (1 + random.choice((0, 1e-15, 1e-9), n))
    aimed = aimed if held == "omega3" else aimed - phidot * np.cos(theta)
    fits = (random.random(n) < 0.5) & (np.abs(aimed) > 2.0**-100) & (np.abs(aimed) < 2.0**100)
    spin = np.where(fits, aimed, spin)
    numbers = {"A": A, "C": C, "gMR": rate(n), "theta": theta, "thetadot": rate(n)}
    return numbers | {"phidot": phidot, held: spin}


def exact_given(row, held):
    """What is given, at the working precision of mpmath."""
    A, C, gMR, theta, thetadot, phidot, spin = map(mpmath.mpf, row)
    u = mpmath.cos(theta)
    omega3 = spin if held == "omega3" else spin + phidot * u
    return kinds.Given(A, C, gMR, u, 1 - u, 1 + u, thetadot, phidot, omega3)


def rows(numbers):
    return enumerate(zip(*(each.tolist() for each in numbers.values()), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("held", ["psidot", "omega3"])
@pytest.mark.parametrize("wide", [False, True])
def test_numbers_are_within_their_errors(held, wide):
    """Each number on doubles, and by the same functions at 400 digits or more."""
    numbers = tops(np.random.default_rng(6), 1500, held, wide)
    with np.errstate(all="ignore"):
        signs = ArraySigns(InputArrays(numbers).starts(slice(None)))
        found = [(number, signs.sign(number)) for number in NUMBERS]
    seen = np.zeros((len(NUMBERS), 2), int)
    with mpmath.workdps(400):
        for at, row in rows(numbers):
            exact = exact_given(row, held)
            for which, (number, (sized, size, zero)) in enumerate(found):
                truth, value = sum_of(number.terms(exact)), sized.value[at]
                if zero[at]:
                    assert truth * (number.factor or (lambda _: 1))(exact) == 0, number
                    continue
                if math.isnan(value):
                    assert not size[at] > 0
                    continue
                assert abs(truth - value) <= sized.error * sized.magnitude[at], number
                sure = size[at] > 0
                assert not sure or (value > 0) == (truth > 0)
                if sure:
                    assert size[at] * filtering._ROUNDED <= number.size(exact), number
                seen[which, int(sure)] += 1
    assert seen[:, 1].min() > 500
    assert seen[:2, 0].min() > 20  # that were aimed at


@pytest.mark.parametrize("roundings", [0, 1])
def test_without_its_errors_the_filter_would_be_wrong(roundings, monkeypatch):
    """The rows that are aimed at a boundary are beside it: nearly no error is not enough."""
    monkeypatch.setattr(Sized, "error", roundings * 2.0**-53)
    with pytest.raises(AssertionError):
        test_numbers_are_within_their_errors("psidot", False)
