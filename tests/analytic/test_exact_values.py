"""What leaves an exact number: balls, mpmath numbers and doubles, against mpmath far beyond."""

import math
import subprocess
import sys
import threading
from collections.abc import Iterator
from fractions import Fraction

import pytest
from flint import arb, ctx
from hypothesis import given
from hypothesis import strategies as st
from mpmath import MPContext, libmp

from heavytop.errors import NotANumber
from heavytop.numbers import PI, Exact, cos, sin, sqrt
from heavytop.numbers.intervals import working

rationals = st.fractions() | st.fractions(-1000, 1000, max_denominator=1000)
EXACT = {"n": Exact.of, "pi": PI, "sqrt": sqrt, "cos": cos, "sin": sin}


def context(bits: int) -> MPContext:
    mp = MPContext()
    mp.prec = bits
    return mp


@st.composite
def formulas(draw: st.DrawFn, depth: int = 3) -> str:
    """Python expressions that have a value: what is divided by or under a root is positive."""
    if depth == 0 or draw(st.booleans()):
        return draw(st.sampled_from(["pi", "n('2')", "n('0.1')", "n('-7.5e-3')", "sqrt(n('6'))"]))
    inner = formulas(depth=depth - 1)
    shapes = ["({a} + {b})", "({a} - {b})", "{a}*{b}", "({a})**3", "cos({a})", "sin({a})"]
    shape = draw(st.sampled_from([*shapes, "sqrt(1 + ({a})**2)", "{a}/(1 + ({b})**2)"]))
    return shape.format(a=draw(inner), b=draw(inner))


def by_mpmath(formula: str, bits: int) -> Fraction:
    mp = context(bits)
    names = {"n": mp.mpf, "pi": +mp.pi, "sqrt": mp.sqrt, "cos": mp.cos, "sin": mp.sin}
    value = Fraction(*libmp.to_rational(eval(formula, names)._mpf_))  # our own formula
    return value if abs(value) > Fraction(1, 2**1500) else Fraction(0)


def by_us(formula: str) -> Exact:
    value = eval(formula, dict(EXACT))
    assert isinstance(value, Exact)
    return value


def bounds(ball: arb) -> tuple[Fraction, Fraction]:
    """The ends of a ball, exactly."""
    (m, e), (r, f) = ball.mid().man_exp(), ball.rad().man_exp()
    middle, radius = (Fraction(int(k)) * Fraction(2) ** int(j) for k, j in ((m, e), (r, f)))
    return middle - radius, middle + radius


@given(formulas(), st.integers(2, 400))
def test_a_ball_holds_the_number(formula: str, bits: int) -> None:
    ball = by_us(formula).ball(bits)
    value = by_mpmath(formula, 2000)
    slack = Fraction(1, 2**1500)
    if ball.is_finite():
        low, high = bounds(ball)
        assert low - slack <= value <= high + slack


@given(formulas())
def test_a_ball_narrows_to_the_number(formula: str) -> None:
    low, high = bounds(by_us(formula).ball(1000))
    assert high - low <= Fraction(1, 2**900)


@given(rationals, st.integers(2, 300))
def test_the_ball_of_a_rational_is_good_to_an_ulp(q: Fraction, bits: int) -> None:
    low, high = bounds(Exact.of(q).ball(bits))
    assert low <= q <= high
    assert high - low <= 2 * abs(q) / 2 ** (bits - 1)


def test_a_ball_that_cannot_be_told_is_not_finite() -> None:
    steep = 1 / (sqrt(Exact.of("1 + 1e-200")) - 1)
    assert not steep.ball(64).is_finite()
    low, high = bounds(steep.ball(2000))
    series = 2 * 10**200 + Fraction(1, 2)  # less x/8 and more
    assert low <= series <= high + Fraction(1, 10**199)
    assert high - low < Fraction(1, 10**100)
    assert float(steep) == 2e200


@pytest.mark.parametrize("bits", range(20, 100, 7))
def test_the_ball_of_a_root_of_what_cancels_holds_the_root(bits: int) -> None:
    cancelling = sqrt(Exact.of("1 + 1e-30") / 9) - Fraction(1, 3)
    low, high = bounds(sqrt(cancelling).ball(bits))
    value = Fraction(1, 6 * 10**30) * (1 - Fraction(1, 4 * 10**30))  # and 1e-60 of it more
    assert max(low, 0) ** 2 <= value <= high**2


def test_the_ball_of_a_root_of_what_may_be_zero_holds_zero() -> None:
    zero = sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3)  # not proved to be
    assert zero.sign() is None
    low, high = bounds(sqrt(zero).ball(300))
    assert low <= 0 <= high <= Fraction(1, 2**90)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_ball_of_a_power_of_what_may_be_zero_is_narrow(n: int) -> None:
    zero = sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3)  # not proved to be
    low, high = bounds((zero**n * cos("0.1")).ball(300))
    assert low <= 0 <= high <= Fraction(1, 2 ** (280 * n))


@given(formulas(), st.integers(30, 200))
def test_values_are_rounded_to_nearest(formula: str, bits: int) -> None:
    exact = by_us(formula)
    value = by_mpmath(formula, 2000)
    rounded = exact.mpf(context(bits))
    assert rounded == libmp_rounded(value, bits)
    assert float(exact) == float(value)


@given(rationals, st.integers(2, 200))
def test_rationals_are_rounded_to_nearest(q: Fraction, bits: int) -> None:
    assert Exact.of(q).mpf(context(bits)) == libmp_rounded(q, bits)


@given(st.integers(-(2**60), 2**60), st.integers(2, 50), st.integers(-80, 80))
def test_ties_go_to_even(m: int, bits: int, e: int) -> None:
    tie = (2 * m + 1) * Fraction(2) ** e
    assert Exact.of(tie).mpf(context(bits)) == libmp_rounded(tie, bits)


def libmp_rounded(q: Fraction, bits: int) -> object:
    return context(bits).make_mpf(libmp.from_rational(q.numerator, q.denominator, bits, "n"))


def test_cancellation_inside_costs_no_digits() -> None:
    """√(1+x) − 1 for x = 1e-200: half its digits and more cancel, and yet 30 are right."""
    x = sqrt(Exact.of("1 + 1e-200")) - 1
    series = context(400).mpf(10) ** -200 / 2
    assert abs(x.mpf(context(100)) / series - 1) < 1e-29
    assert float(x) == 5e-201


def test_double_is_the_nearest_even_at_a_tie() -> None:
    tie = Exact.of(Fraction(2**53 + 1))
    assert float(tie) == 2.0**53
    assert float(tie + sqrt(2) / 10**100) == 2.0**53 + 2


def test_a_number_beyond_the_doubles_is_said_so() -> None:
    with pytest.raises(NotANumber, match="double"):
        float(Exact.of("1e300") ** 2)
    with pytest.raises(NotANumber, match="double"):
        float(Exact.of("1e300") ** 2 * PI)


def test_a_zero_that_is_not_proved_is_a_plain_zero() -> None:
    zero = sqrt(5 + 2 * sqrt(6)) - sqrt(2) - sqrt(3)
    assert str(float(zero)) == "0.0"
    assert zero.mpf(context(100)) == 0


def test_the_square_of_a_negative_cosine_keeps_its_sign_out_of_the_root() -> None:
    """√(cos²2) = |cos 2| = −cos 2, not cos 2."""
    assert float(sqrt(cos(2) ** 2)) == pytest.approx(-math.cos(2), rel=1e-15)
    assert (sqrt(cos(2) ** 2) + cos(2)).mpf(context(200)) == 0


# --- the precision of a process, and its threads ------------------------------------------------


@pytest.fixture
def hasty_threads() -> Iterator[None]:
    """Threads that are interrupted as often as can be."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("hasty_threads")
def test_threads_at_different_precisions_get_what_each_gets_alone() -> None:
    x = sqrt(2 + cos("0.1")) / (PI - sqrt(3) * sin(1)) + sqrt(5) ** 3
    precisions = (30, 64, 150, 700)
    alone = {bits: bounds(x.ball(bits)) for bits in precisions}
    different: list[int] = []

    def work(bits: int) -> None:
        different.extend(bits for _ in range(400) if bounds(x.ball(bits)) != alone[bits])

    threads = [threading.Thread(target=work, args=(bits,)) for bits in precisions * 2]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=300)
        assert not thread.is_alive()
    assert different == []


def test_the_precision_is_put_back() -> None:
    before = ctx.prec
    with working(200):
        with working(80):
            assert ctx.prec == 80
        with pytest.raises(ZeroDivisionError), working(90):
            raise ZeroDivisionError
        assert ctx.prec == 200
    assert ctx.prec == before


def test_a_precision_that_is_none_is_refused_and_leaves_the_lock_open() -> None:
    with pytest.raises(ValueError, match="prec"):
        PI.ball(1)
    signs: list[object] = []
    thread = threading.Thread(target=lambda: signs.append(cos(2).sign()))
    thread.start()
    thread.join(timeout=20)
    assert signs == [-1]


@pytest.mark.parametrize(
    ("text", "sign"),
    [
        ("pi", 1), ("-2*pi", -1), ("pi - 3.14159265358979323846", 1), ("3/pi - 1", -1),
        ("3.14159265358979323847 - pi", 1), ("3.141592653589793238462 - pi", -1),
        ("pi**2 - 10", -1),
        ("-sqrt(2)", -1), ("pi/sqrt(3)", 1), ("3.141592653589793238463 - pi", 1), ("1/pi", 1),
    ],
)  # fmt: skip
def test_signs_told_without_balls_are_those_that_balls_tell(text: str, sign: int) -> None:
    x = Exact.of(text)
    assert x.sign() == sign
    ball = x.ball(200)
    assert (ball > 0) - (ball < 0) == sign


def test_neither_flint_nor_mpmath_is_imported_for_rationals_and_pi() -> None:
    code = (
        "import sys; from heavytop.numbers import Exact, PI, cos, sqrt;"
        "x = Exact.of('0.1') + 1; x.sign(); float(x / 3); str(x); (PI - x).sign(); sqrt(x).sign();"
        "str(PI - x); cos(PI).sign();"
        "assert not {'flint', 'mpmath'} & set(sys.modules), 'imported'"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)
