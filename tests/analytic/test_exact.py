"""Exact numbers against the arithmetic of fractions, and against mpmath at other precisions."""

import math
import pickle
import re
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import MPContext

from heavytop.errors import NotANumber
from heavytop.numbers import PI, Exact, cos, sqrt

rationals = st.fractions(-1000, 1000, max_denominator=1000)
doubles = st.floats(1e-290, 1e290) | st.floats(-1e290, -1e-290) | st.just(0.0)


def context(bits: int) -> MPContext:
    ctx = MPContext()
    ctx.prec = bits
    return ctx


@st.composite
def texts(draw: st.DrawFn, depth: int = 3) -> str:
    """Expressions of the grammar that have a value: roots and divisors are made positive."""
    if depth == 0 or draw(st.booleans()):
        return draw(st.sampled_from(["pi", "2", "0.5", "3", "1.25e-2", "(7/3)"]))
    inner = texts(depth=depth - 1)
    shape = draw(st.sampled_from(["({a} + {b})", "{a}*{b}", "sqrt({a})", "{a}/{b}", "({a})^2"]))
    return shape.format(a=draw(inner), b=draw(inner))


@given(rationals, rationals)
def test_rational_arithmetic_is_that_of_fractions(p: Fraction, q: Fraction) -> None:
    a, b = Exact.of(p), Exact.of(q)
    assert (a + b).fraction == p + q
    assert (a - b).fraction == p - q
    assert (a * b).fraction == p * q
    assert q == 0 or (a / b).fraction == p / q
    assert float(a) == float(p)


@given(doubles)
def test_float_means_its_binary_value(x: float) -> None:
    exact = Exact.of(x)
    assert exact.fraction == Fraction(x)
    assert float(exact) == x
    assert Exact.of(str(exact)) == exact


@given(texts())
def test_text_reads_back_to_the_same_number(text: str) -> None:
    value = Exact.of(text)
    assert str(value) == text
    canonical = str(value * 1 + 0)
    assert Exact.of(canonical) == value, canonical


@given(texts())
def test_values_agree_with_plain_evaluation_at_another_precision(text: str) -> None:
    ctx = context(300)
    names = {"pi": ctx.pi, "sqrt": ctx.sqrt, "mpf": ctx.mpf, "__builtins__": {}}
    text_in_mpmath = re.sub(r"[\d.]+(e-?\d+)?", r"mpf('\g<0>')", text).replace("^", "**")
    expected = eval(text_in_mpmath, names)  # our own text, made above
    value = Exact.of(text).mpf(context(100))
    assert abs(value - expected) <= abs(expected) * 2.0**-98
    assert abs(Exact.of(text).mpf(context(53)) - expected) <= abs(expected) * 2.0**-52


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        (3, 3),
        (Fraction(1, 3), Fraction(1, 3)),
        (Decimal("0.1"), Fraction(1, 10)),
        (np.float32(0.1), Fraction(float(np.float32(0.1)))),
        (np.float64(0.1), Fraction(0.1)),
        (np.int64(-7), -7),
        (np.longdouble(1) / 3, Fraction(*(np.longdouble(1) / 3).as_integer_ratio())),
        ("1.5e3", 1500),
        (".5", Fraction(1, 2)),
        ("-2^2", -4),
        ("2^-2", Fraction(1, 4)),
        ("2**3^2", 512),
        ("4^(3/2)", 8),
        ("0.25^-0.5", 2),
        ("3 × 4 ÷ 6 − 1", 1),
        ("- (1 + 2)*3", -9),
        ("1-2-3", -4),
        ("8/2/2", 2),
    ],
)
def test_what_a_number_may_be(x: object, expected: object) -> None:
    assert Exact.of(x).fraction == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("6 deg", PI / 30),
        ("90deg", PI / 2),
        ("30 rpm", PI),
        ("180 deg/s", PI),
        ("pi/2 rad", PI / 2),
        ("2*3 rad/s", Exact.of(6)),
        ("π", PI),
    ],
)
def test_units(text: str, expected: Exact) -> None:
    assert Exact.of(text) == expected


@pytest.mark.parametrize("units", [(), ("rad", "deg")])
def test_a_unit_out_of_place_is_refused(units: tuple[str, ...]) -> None:
    with pytest.raises(NotANumber, match="unit"):
        Exact.of("3 rpm", units)


@pytest.mark.parametrize(
    ("x", "rule"),
    [
        (True, "true or false"),
        (np.True_, "true or false"),
        (None, "nothing"),
        ([1], "not a list"),
        (1j, "not a complex"),
        (math.nan, "finite"),
        (-math.inf, "finite"),
        (np.float64("nan"), "finite"),
        (Decimal("nan"), "finite"),
        (Decimal("-inf"), "finite"),
        (Decimal("1e999999999"), "1e300"),
        (Decimal("1e-999999999"), "1e300"),
        (10**301, "1e300"),
        (5e-324, "1e-300"),
        ("", "ends too early"),
        ("1 +", "ends too early"),
        ("nan", "unexpected"),
        ("inf", "unexpected"),
        ("2 pi", "unexpected"),
        ("1_000", "unexpected"),
        ("١", "unexpected"),
        ("(1", "ends too early"),
        ("1)", "unexpected"),
        ("sqrt 2", "unexpected"),
        ("cos(1)", "unexpected"),
        ("__import__('os').system('true')", "unexpected"),
        ("1; 2", "unexpected"),
        ("1\x00", "unexpected"),
        ("1/0", "division by zero"),
        ("1/(sqrt(8) - 2*sqrt(2))", "division by zero"),
        ("1/((1+sqrt(2))*(sqrt(2)-1) - 1)", "division by zero"),
        ("1/(sqrt(5+2*sqrt(6)) - sqrt(2) - sqrt(3))", "cannot be told from zero"),
        ("sqrt(-1)", "root of a negative"),
        ("sqrt(3 - pi)", "root of a negative"),
        ("(-8)^(1/2)", "root of a negative"),
        ("8^(1/3)", "an exponent is whole"),
        ("9^9^9", "exponent"),
        ("2^pi", "exponent"),
        ("2^65", "exponent"),
        ("2^(129/2)", "exponent"),
        ("(10^64)^64", "1e300"),
        ("(1 + 1e-300)^64", "too large"),
        ("(pi^64)^64", "1e300"),
        ("((1 + pi)^64)^64", "1e300"),
        ("(sqrt(2) + pi)^64^1*(sqrt(3) + 10^10*pi)^64", "1e300"),
        ("9e299*pi", "1e300"),
        ("1e-300/pi^2", "1e-300"),
        ("9e299*sqrt(1 + pi)", "1e300"),
        ("1e301", "1e300"),
        ("1.001e300", "1e300"),
        ("0.999e-300", "1e-300"),
        ("1e-301", "1e-300"),
        ("1e401", "1e300"),
        ("1e-99999999999", "1e-300"),
        ("1" + "0" * 4000, "characters long"),
        ("(" * 60 + "1" + ")" * 60, "nests"),
        ("-" * 60 + "1", "nests"),
        ("2^" * 60 + "1", "nests"),
        ("1" + "+1" * 300, "at most 500"),
    ],
)
def test_what_is_no_number_is_refused(x: object, rule: str) -> None:
    with pytest.raises(NotANumber, match=rule):
        Exact.of(x)


@pytest.mark.parametrize("text", ["3e299*pi", "pi/3e299", "4e299*sqrt(1 + pi)", "1e300", "1e-300"])
def test_what_is_just_within_the_limits_is_held(text: str) -> None:
    assert Exact.of(text).sign() == 1


def test_equal_numbers_hash_alike_and_survive_pickling() -> None:
    for x in (sqrt(8), Exact.of("pi/3"), Exact.of(0.5), cos(0.3)):
        assert pickle.loads(pickle.dumps(x)) == x
        assert hash(x * 2 / 2) == hash(x)
    assert hash(Exact.of(0.5)) == hash(0.5)
    assert len({sqrt(8), 2 * sqrt(2)}) == 1


def test_an_exact_number_cannot_be_changed() -> None:
    with pytest.raises(AttributeError):
        PI.text = "3"  # type: ignore[misc]


def test_arithmetic_takes_python_and_numpy_numbers_and_refuses_texts() -> None:
    assert 1 - Exact.of(0.25) == 0.75
    assert 1 / Exact.of(4) == np.float64(2) * Exact.of("0.125")
    with pytest.raises(TypeError):
        PI + "1"  # type: ignore[operator]
    with pytest.raises(NotANumber, match="finite"):
        PI + math.nan
