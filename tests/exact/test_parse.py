"""Texts that are numbers, and what is none, each refused by the rule that it breaks."""

import math
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from heavytop.errors import NotANumber
from heavytop.exact import PI, Exact, parse, sqrt


@pytest.mark.parametrize(("text", "expected"), [
    (".5", Fraction(1, 2)), ("-2^2", -4), ("2^-2", Fraction(1, 4)), ("2**3^2", 512), ("8/2/2", 2),
    ("4^(3/2)", 8), ("8^(1/3)", 2), ("cos(acos(3/4))", Fraction(3, 4)), ("2*3 rad/s", 6),
    ("tan (pi/4) + sin(0)", 1), ("acos(-1/2)*3", 2 * PI), ("atan(1) deg", PI**2 / 720),
    ("3 × 4 ÷ 6 − 1", 1), ("1-2-3", -4), ("6 deg - 1/2 deg", 11 * PI / 360), ("1 + 1 min", 61),
    ("π", PI), ("6 deg", PI / 30), ("30 rpm", PI), ("180 deg/s", PI), ("60 rpm - 30 rpm", PI),
    ("2,5", Fraction(5, 2)), ("0,125", Fraction(1, 8)), ("pi/2 rad", PI / 2),
    ("acos(1)", 0), ("acos(-1)", PI), ("asin(1/2)", PI / 6), ("asin(-1)", -PI / 2),
    ("acos(sqrt(3)/sqrt(3))", 0), ("atan(0)", 0), ("sin(asin(-1/3))", Fraction(-1, 3)),
    ("sin(acos(3/5))", Fraction(4, 5)), ("cos(asin(3/5))", Fraction(4, 5)),
    ("tan(atan(-7/3))", Fraction(-7, 3)), ("cos(pi - acos(1/3))", Fraction(-1, 3)),
    ("sin(2*acos(3/5))", Fraction(24, 25)), ("sin(acos(pi/4))", sqrt(1 - PI**2 / 16)),
])  # fmt: skip
def test_operators_functions_and_units(text, expected):
    assert Exact.of(text) == expected


REFUSED = {
    "ends too early": ["", "1 +", "(1"],
    "unexpected": ["nan", "2 pi", "1_000", "1,5,2", "١", "1)", "exp(1)", "log(2)", "cos 1",
                   "acosh(2)", "1\x00", "__import__('os')"],
    "comma": ["1,000", "12,500 rpm"],
    "division by zero": ["1/0", "tan(pi/2)", "1/(sqrt(5+2*sqrt(6)) - sqrt(2) - sqrt(3))"],
    "cannot be told from zero": ["1/(sqrt(cos(2)^2) + cos(2))"],
    "within -1": ["acos(2)", "asin(-1.0000001)", "acos(-sqrt(2))", "asin(1 + 1e-200*sqrt(2))"],
    "root of a negative": ["sqrt(-1)", "(-8)^(1/2)"],
    "exponent": ["9^9^9", "2^pi", "2^65", "2^(129/2)", "2^(1/65)", "pi^40*pi^30"],
    "too large": ["(1 + 1e-300)^64"],
    "1e300": ["(10^64)^64", "((1 + pi)^64)^64", "9e299*pi", "9e299*sqrt(1 + pi)", "1e301",
              Decimal("1e999999999"), 10**301, 5e-324],
    "1e-300": ["1e-300/pi^2", "0.999e-300", "1e-99999999999"],
    "characters long": ["1" + "0" * 4000],
    "nests": ["(" * 60 + "1" + ")" * 60, "-" * 60 + "1", "2^" * 60 + "1"],
    "true or false": [True],
    "nothing": [None],
    "not a list": [[1]],
    "not a complex": [1j],
    "finite": [math.nan, np.float64("inf"), Decimal("nan")],
}  # fmt: skip


@pytest.mark.parametrize(("rule", "x"), [(rule, x) for rule in REFUSED for x in REFUSED[rule]])
def test_what_is_no_number_is_refused(x, rule):
    with pytest.raises(NotANumber, match=rule):
        Exact.of(x)


SIZES = {  # of each unit, in those of SI
    "deg": math.pi / 180, "rad": 1, "rev": 2 * math.pi,
    "rpm": math.pi / 30, "rev/min": math.pi / 30, "rps": 2 * math.pi, "rev/s": 2 * math.pi,
    "Hz": 2 * math.pi, "deg/s": math.pi / 180, "rad/s": 1, "kg": 1, "g": 1e-3, "m": 1, "cm": 1e-2,
    "mm": 1e-3, "s": 1, "ms": 1e-3, "min": 60, "kg m^2": 1, "g cm^2": 1e-7, "J": 1, "N m": 1,
    "kg m^2/s^2": 1, "kg m^2/s": 1, "J s": 1, "m/s^2": 1, "kg/m^3": 1, "g/cm^3": 1000,
}  # fmt: skip


def test_every_unit_has_its_size():
    assert {name: pytest.approx(size, rel=1e-15) for name, size in SIZES.items()} == {
        name: float(Exact.of(f"1 {name}")) for name in parse.UNITS
    }


@pytest.mark.parametrize(("text", "units", "hint"), [
    ("3 rpm", (), "unit"), ("3 rpm", ("rad",), "unit"), ("9 Grad", ("rad", "deg"), 'mean "deg"'),
    ("3 RPM", ("rpm", "Hz"), 'mean "rpm"'), ("9 degrees", parse.UNITS, 'mean "deg"'),
])  # fmt: skip
def test_a_unit_out_of_place_or_spelled_otherwise_is_refused(text, units, hint):
    with pytest.raises(NotANumber, match=hint):
        Exact.of(text, units)
