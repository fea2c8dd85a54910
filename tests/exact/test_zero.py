"""Signs of exact numbers: zeros that are proved, and numbers near zero that must not be."""

import math
import random
from fractions import Fraction

import pytest

from heavytop.exact import PI, Exact, acos, atan, cos, sin, sqrt, tan
from heavytop.exact.zero import is_identity, separation

HALF, FOURTH = Fraction(1, 2), sqrt(sqrt(2))
TINY = Exact.of(10) ** -1000
CUBE = Exact.of("2^(1/3)")

ALGEBRAIC = [
    sqrt(2) * sqrt(3) - sqrt(6),
    Exact.of("sqrt(4^(1/2))") - sqrt(2),
    FOURTH**5 / 2 - FOURTH,
    (FOURTH - 1) * (1 + FOURTH + FOURTH**2 + FOURTH**3) - 1,
    (sqrt(53) + sqrt(59)) ** 2 - 112 - 2 * sqrt(3127),
    1 / (1 + 1 / (1 + sqrt(2))) - 1 / sqrt(2),
    cos(PI / 7) - cos(PI * 2 / 7) + cos(PI * 3 / 7) - HALF,
    cos(PI / 5) - (1 + sqrt(5)) / 4,
    (sqrt(2 + sqrt(3)) + 1) * (sqrt(2 + sqrt(3)) - 1) - 1 - sqrt(3),
    sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3),
    Exact.of("(7 + 5*sqrt(2))^(1/3)") - 1 - sqrt(2),
    (CUBE - 1) * (CUBE**2 + CUBE + 1) - 1,
    sin(acos("3/5") + PI / 6) - Exact.of("0.4*sqrt(3) + 0.3"),
    tan(atan("1/2") + atan("1/3")) - 1,
]
IDENTITIES = [
    sqrt(PI**2 * 12) - 2 * sqrt(3) * PI,
    sqrt(1 + PI) ** 2 - 1 - PI,
    (1 - PI) ** 2 / (PI - 1) - PI + 1,
    (1 + cos(1)) ** HALF * (1 + cos(1)) ** (3 * HALF) - (1 + cos(1)) ** 2,
    (sqrt(PI) + 1) * (sqrt(PI) - 1) - PI + 1,
    sin(1) ** 2 + cos(1) ** 2 - 1,
    sqrt(1 - cos(1) ** 2) - sin(1),
    sqrt(1 - cos(4) ** 2) + sin(4),
    cos(2) * (sqrt(1 - cos(1) ** 2) - sin(1)),
    cos("0.2") - 2 * cos("0.1") ** 2 + 1,
    sin("0.3") - 3 * sin("0.1") + 4 * sin("0.1") ** 3,
    sin("0.2") * cos("20.3") - 2 * sin("0.1") * cos("0.1") * cos("20.3"),
    sin(sqrt(8)) - 2 * sin(sqrt(2)) * cos(sqrt(2)),
    sqrt((1 + cos(1)) * (1 - cos(1))) - sqrt(1 - cos(1) ** 2),
    sqrt(1 + 1 / PI) * sqrt(PI) * sqrt(1 + 1 / PI) - (1 + PI) / sqrt(PI),
    (sqrt(5 + 2 * sqrt(6)) - sqrt(2)) * cos(1) - sqrt(3) * cos(1),
    sqrt(8) * PI + cos(PI / 5) * cos(1) - 2 * sqrt(2) * PI - (1 + sqrt(5)) / 4 * cos(1),
    sqrt(4 + 4 * cos(1)) - 2 * sqrt(1 + cos(1)),
    cos(1 + PI / 3) - cos(1) / 2 + sqrt(3) / 2 * sin(1),
    sin(acos("1/3") + 1) - sqrt(8) / 3 * cos(1) - sin(1) / 3,
    (1 + PI + acos("0.3")) ** 2 - (1 + PI) ** 2 - 2 * (1 + PI) * acos("0.3") - acos("0.3") ** 2,
]


@pytest.mark.parametrize("zero", [*ALGEBRAIC, *IDENTITIES], ids=str)
def test_zeros_are_decided_and_so_is_what_is_beside_them(zero):
    assert zero.sign() == 0
    assert ((zero + TINY).sign(), (zero - TINY).sign()) == (1, -1)


def test_which_numbers_are_algebraic():
    assert all(separation(x) < 10_000 for x in ALGEBRAIC)
    assert {separation(x) for x in IDENTITIES if x != 0} == {math.inf}


def test_of_what_is_zero_by_no_identity_the_sign_is_open():
    assert (sqrt(cos(2) ** 2) + cos(2)).sign() is None  # |x| + x


@pytest.mark.parametrize("different", [
    sqrt((1 + cos(1)) * (1 - cos(1))) - (1 - cos(1) ** 2) ** (3 * HALF),
    sqrt(2 + sqrt(3)) - sqrt(3 + sqrt(2)),
    cos(1) - cos(2),
    sin(1) + sin(-2),
    sqrt(1 + cos(1)) - sqrt(2 + 2 * cos(1)),
    sqrt(1 + cos(1)) - sqrt(2 + cos(1)),
    (sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3) + TINY) * cos(1),
    acos("0.3") - acos("0.4"),
    sqrt(1 - cos(4) ** 2) - sin(4),  # sin 4 < 0
    sqrt(cos(2) * (cos(2) - 1)) - cos(2) * sqrt((cos(2) - 1) / cos(2)),  # cos 2 < 0
], ids=str)  # fmt: skip
def test_what_differs_is_not_taken_for_one(different):
    """Beside 1 it is smaller than 256 bits show, where a false proof would make it 0."""
    assert not is_identity(different)
    assert ((1 + different * Exact.of("1e-200")) ** 2 - 1).sign() == different.sign() != 0


def test_the_bound_holds_of_what_is_nearest_to_zero():
    """Powers of 1 − √2 + δ, which shrink as fast as the bound allows but for a factor."""
    for n in range(1, 40):
        power = (sqrt(2) - 1) ** n
        size = -math.log2(abs(float(power)))
        assert separation(power) - 64 >= size >= (separation(power) - 64) / 3
        p, q = round(float((1 + sqrt(2)) ** n)), (1 + sqrt(2)) ** n
        assert (q - p).sign() == (1 if n % 2 else -1)


def drawn(random, depth):
    """A number that may well be zero: what is added and subtracted is often alike."""
    if depth == 0 or random.random() < 0.15:
        angle = random.choice(["0.1", "0.2", "4", "pi/5", "pi/7", "acos(3/5)", "pi/4 + 0.1"])
        k, root = Exact.of(random.randint(-3, 3)), sqrt(random.randint(1, 12))
        return random.choice([k, root, cos(angle), sin(angle), PI / 3 * k])
    a, b = drawn(random, depth - 1), drawn(random, depth - 1)
    makers = (
        *(lambda: a - b, lambda: a * b + random.randint(-2, 2)) * 2,
        lambda: (a + b) * (a - b) - a * a + b * b,
        lambda: sqrt(a * a + 2 * a * b + b * b) - a - b,  # 2|a + b| or 0
        lambda: a / (1 + b * b),
        lambda: Exact.of(1 + a * a) ** Fraction(1, 3) * b,
    )
    return random.choice(makers)()


MANY = pytest.param(1, 8_000, range(2), 800, marks=pytest.mark.slow)


@pytest.mark.parametrize(("seed", "count", "depths", "open_"), [(27, 300, range(1, 4), 60), MANY])
def test_signs_are_those_of_4096_bits(seed, count, depths, open_):
    """Signs of random numbers, of which there are many of each."""
    source, found = random.Random(seed), dict.fromkeys((-1, 0, 1, None), 0)
    for _ in range(count):
        x = drawn(source, source.choice(depths))
        ball, sign = x.ball(4096), x.sign()
        found[sign] += 1
        if ball > 0 or ball < 0:
            assert sign == (1 if ball > 0 else -1), x
            assert not is_identity(x), x
        else:
            assert abs(ball) < TINY.ball(64), x
            assert sign in (0, None), x
    assert min(found[-1], found[0], found[1]) > 30
    assert found[None] <= open_, found
