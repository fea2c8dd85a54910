"""Signs of exact numbers: zeros that are proved, and numbers near zero that must not be."""

import math
from fractions import Fraction

import pytest
from heavytop.exact.normal_form import proved_zero
from hypothesis import given, settings
from hypothesis import strategies as st

from heavytop.exact import PI, Exact, cos, sin, sqrt

HALF, FOURTH = Fraction(1, 2), sqrt(sqrt(2))


@pytest.mark.parametrize(
    "zero",
    [
        sqrt(2) * sqrt(3) - sqrt(6),
        sqrt("1/3") - sqrt(3) / 3,
        Exact.of("sqrt(4^(1/2))") - sqrt(2),
        sqrt(PI**2 * 12) - 2 * sqrt(3) * PI,
        FOURTH**5 / 2 - FOURTH,
        cos(PI / 3) - Fraction(1, 2),
        cos("225 deg") + sqrt(2) / 2,
        sqrt(1 + PI) ** 2 - 1 - PI,
        (1 - PI) ** 2 / (PI - 1) - PI + 1,
        (1 + cos(1)) ** HALF * (1 + cos(1)) ** (3 * HALF) - (1 + cos(1)) ** 2,
    ],
    ids=str,
)
def test_zeros_that_are_seen_in_the_form(zero: Exact) -> None:
    assert zero.sign() == 0
    assert zero == 0


@pytest.mark.parametrize(
    "zero",
    [
        (1 + sqrt(2)) * (sqrt(2) - 1) - 1,
        (FOURTH - 1) * (1 + FOURTH + FOURTH**2 + FOURTH**3) - 1,
        (sqrt(53) + sqrt(59)) ** 2 - 112 - 2 * sqrt(3127),  # primes that are not taken out
        sqrt(53**2 * 59) - 53 * sqrt(59),
        (sqrt(PI) + 1) * (sqrt(PI) - 1) - PI + 1,
        1 / (1 + 1 / (1 + sqrt(2))) - 1 / sqrt(2),
        sin(1) ** 2 + cos(1) ** 2 - 1,
        1 / sin(1) ** 4 - (1 - cos(1) ** 2) ** -2,
        cos("0.2") - 2 * cos("0.1") ** 2 + 1,
        sin("0.3") - 3 * sin("0.1") + 4 * sin("0.1") ** 3,
        sin("0.2") * cos("20.3") - 2 * sin("0.1") * cos("0.1") * cos("20.3"),
        sin(-2) + 2 * sin(1) * cos(1),
        sin(sqrt(8)) - 2 * sin(sqrt(2)) * cos(sqrt(2)),
        cos(PI / 7) - cos(PI * 2 / 7) + cos(PI * 3 / 7) - Fraction(1, 2),
        sqrt((1 + cos(1)) * (1 - cos(1))) - sqrt(1 - cos(1) ** 2),
        (sqrt(2 + sqrt(3)) + 1) * (sqrt(2 + sqrt(3)) - 1) - 1 - sqrt(3),
        sqrt(1 + 1 / PI) * sqrt(PI) * sqrt(1 + 1 / PI) - (1 + PI) / sqrt(PI),
    ],
    ids=str,
)
def test_zeros_that_are_proved_by_expansion(zero: Exact) -> None:
    assert zero != 0, "the form shows it already"
    assert zero.sign() == 0
    assert (zero + Exact.of(10) ** -1000).sign() == 1
    assert (zero - Exact.of(10) ** -1000).sign() == -1


@pytest.mark.parametrize(
    ("x", "sign"),
    [
        (PI - Exact.of(math.pi), 1),
        (PI - Exact.of(math.nextafter(math.pi, 4)), -1),
        (Exact.of("3.14159265358979323846264338327950289") - PI, 1),
        (Exact.of("3.14159265358979323846264338327950288") - PI, -1),
        (sqrt(2) + sqrt(3) - PI, 1),
        (cos(2), -1),
        (-sqrt(2) - PI, -1),
        (sqrt("1 + 1e-200") - 1, 1),
        (1 - sqrt("1 + 1e-299") ** 3, -1),
        (sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3), None),  # zero; roots are not denested
    ],
    ids=str,
)
def test_signs(x: Exact, sign: int | None) -> None:
    assert x.sign() == sign


@pytest.mark.parametrize(
    "different",
    [
        sqrt((1 + cos(1)) * (1 - cos(1))) - (1 - cos(1) ** 2) ** (3 * HALF),
        sqrt(2 + sqrt(3)) - sqrt(3 + sqrt(2)),
        cos(1) - cos(2),
        cos(PI / 5) - cos(PI / 7),
        sin(1) + sin(-2),
    ],
    ids=str,
)
def test_generators_that_differ_are_not_taken_for_one(different: Exact) -> None:
    assert not proved_zero(different.terms)


def test_roots_of_fractions_too_large_to_be_brought_to_integers() -> None:
    q = Fraction(10**3000 + 1, 10**3001 + 9)
    root = sqrt(Exact.of(1) * q)
    assert ((root + 1) * (root - 1) - q + 1).sign() == 0


def test_a_proof_that_takes_too_much_work_is_given_up() -> None:
    long = sum((sqrt(n) for n in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31)), PI)
    assert not proved_zero(((long + 1) ** 64 * (long - 1) ** 64 - (long**2 - 1) ** 64).terms)
    many = sum((sqrt(PI + n) for n in range(40)), PI)
    assert not proved_zero(((many + 1) * (many - 1) - many**2 + 1).terms)


rationals_and_roots = [Exact.of(2), Exact.of("-7/3"), PI, sqrt(6), sqrt(2), FOURTH]
waves = [cos("0.1"), sin("0.1"), cos("0.2"), sin("0.05"), cos(PI / 5), cos(PI * 2 / 5), cos(2)]
leaves = st.sampled_from(rationals_and_roots) | st.sampled_from(waves)


@st.composite
def numbers(draw: st.DrawFn, depth: int = 2) -> Exact:
    if depth == 0 or draw(st.booleans()):
        return draw(leaves)
    a, b = (draw(numbers(depth=depth - 1)) for _ in range(2))
    made = [a + b, a - b, a * b, a**2, sqrt(1 + a**2), 1 / (1 + b**2), a / sqrt(2 + b**2)]
    return draw(st.sampled_from(made))


@settings(deadline=None)
@given(numbers(), numbers(), numbers())
def test_what_holds_of_all_numbers_is_proved(a: Exact, b: Exact, c: Exact) -> None:
    assert ((a + b) * (a - b) - a**2 + b**2).sign() == 0
    assert ((a + b) * c - a * c - b * c).sign() == 0
    d = 1 + c**2
    assert (a / d + d / (1 + b**2) - (a * (1 + b**2) + d**2) / (d * (1 + b**2))).sign() == 0


@settings(deadline=None)
@given(numbers(), numbers(), numbers())
def test_nothing_else_is_proved_zero(a: Exact, b: Exact, c: Exact) -> None:
    assert proved_zero((a * b - c).terms) <= (a * b - c).ball(1000).contains(0)
    assert not proved_zero(((a + b) * (a - b) - a**2 + b**2 + Exact.of(10) ** -500).terms)
