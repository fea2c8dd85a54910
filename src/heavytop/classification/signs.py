"""Signs of the numbers that tell kinds apart, for one top and one start: zeros are proved here.

Balls of 106 bits decide nearly always. What they leave open goes to the exact numbers, whose sign
is found by balls of more bits or by proving that everything cancels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from math import prod
from typing import Any, Final, TypeAlias

from flint import arb

from heavytop.classification.kinds import Given, Number, sum_of
from heavytop.numbers import ONE, PI, Exact, cos
from heavytop.numbers.exact import Sign
from heavytop.numbers.intervals import rational_ball, working
from heavytop.scene.state import State
from heavytop.scene.top import Top

Ball: TypeAlias = Any

FEW_BITS: Final = 106
MOST_BITS: Final = 4096  # as many as the exact numbers try
RATES: Final = {"gMR": "gMR", "thetadot": "θ̇", "phidot": "φ̇", "omega3": "ω₃"}


class UndecidedError(Exception):
    """A number that could be neither told from zero nor proved to be zero.

    Parameters
    ----------
    symbol : str
        What it is called.
    size : ball
        Its size, or of a sum that beside its terms.
    name : str, optional
        Of the size.
    """

    def __init__(self, symbol: str, size: Ball, name: str = "its size") -> None:
        self.bound = size.upper().str(2, radius=False)
        bound = f"{name} is at most {self.bound}"
        super().__init__(f"the sign of {symbol} is open: {bound}, and 0 is not proved")


class SceneSigns:
    """What is positive, zero or negative of one top and one start, each found when first asked for.

    Signs are asked for at a working precision of 106 bits; `UndecidedError` is raised where a
    number could be neither told from zero nor proved to be zero. Balls are exact where what is
    given is proved to be zero, and wide where it is not.
    """

    def __init__(self, top: Top, start: State) -> None:
        self.top, self.start = top, start
        self._rates: dict[str, Sign | None] = {}
        self._found: dict[Number, Sign] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.top, self.start)  # balls are not copied

    @cached_property
    def few(self) -> Given:
        """What is given, as balls of 106 bits."""
        return self.balls(FEW_BITS)

    def balls(self, bits: int) -> Given:
        """What is given, as balls of so many bits, which must be the working precision."""
        top, start = self.top, self.start
        given = (top.A, top.C, top.gMR, start.thetadot, start.phidot, getattr(start, start.held))
        A, C, gMR, thetadot, phidot, omega3 = (ball_of(value, bits) for value in given)
        heights = self._heights(bits)
        if start.held == "psidot":
            omega3 += phidot * heights[0]
        found = Given(A, C, gMR, *heights, thetadot, phidot, omega3)
        for name in RATES:
            ball = getattr(found, name)
            if name not in self._rates:
                sign = ball_sign(ball)
                self._rates[name] = getattr(self.exact, name).sign() if sign is None else sign
            if self._rates[name] == 0:
                setattr(found, name, arb(0))
        return found

    def _heights(self, bits: int) -> tuple[Ball, Ball, Ball]:
        """cosθ, 1 − cosθ and 1 + cosθ: exact where they are rational, or from the half angle."""
        theta = self.start.theta
        if theta.fraction or (q := self._cos.fraction) is None:
            s, c = (ball_of(theta, bits) / 2).sin_cos()
            return c * c - s * s, 2 * s * s, 2 * c * c
        u = rational_ball(q)
        return u, 1 - u, 1 + u

    @cached_property
    def exact(self) -> Given:
        """What is given, as exact numbers."""
        top, start, u = self.top, self.start, self._cos
        return Given(
            top.A, top.C, top.gMR, u, ONE - u, ONE + u, start.thetadot, start.phidot, start.omega3
        )

    @cached_property
    def _cos(self) -> Exact:
        """cosθ; ±1 on a pole, however θ is written."""
        return {1: ONE, -1: -ONE}[self.pole] if self.pole else cos(self.start.theta)

    @cached_property
    def pole(self) -> Sign | None:
        """1 where the axis starts pointing up, −1 where down, 0 where neither; None if unknown."""
        theta = self.start.theta
        if theta.fraction is not None:  # π is irrational
            return 1 if theta.fraction == 0 else 0
        ball = theta.ball(FEW_BITS)
        if ball > 0 and ball < arb.pi():
            return 0
        signs = theta.sign(), (PI - theta).sign()
        return 1 if signs[0] == 0 else -1 if signs[1] == 0 else None if None in signs else 0

    def expect_given(self) -> None:
        """Raise `UndecidedError` where something that is given cannot be told from zero."""
        _ = self.few
        for name, sign in self._rates.items():
            if sign is None:
                raise unproved(RATES[name], getattr(self.exact, name))
        if self.pole is None:
            theta = self.start.theta
            raise unproved(*(("θ", theta) if theta.sign() is None else ("π − θ", PI - theta)))

    def sign(self, number: Number) -> Sign:
        """The sign of the sum of a number's terms."""
        if number not in self._found:
            self._found[number] = self._sign(number)
        return self._found[number]

    def _sign(self, number: Number) -> Sign:
        if number.factor and number.factor(self.few).is_zero():
            return 0
        sign = ball_sign(sum_of(number.terms(self.few)))
        if sign is None:
            sign = sum_of(number.terms(self.exact)).sign()
        if sign is None:
            with working(MOST_BITS):
                terms = number.terms(self.balls(MOST_BITS))
                size = abs(sum_of(terms)) / sum_of(tuple(map(abs, terms)))
                raise UndecidedError(number.symbol, size, "|sum|/Σ|terms|")
        return sign

    def vanish(self, numbers: Iterable[Number]) -> bool:
        """Whether all of some numbers are zero; raises where one may be and no other is not."""
        return not any(self._signs(numbers, decided=any))

    def product(self, numbers: Iterable[Number]) -> int:
        """The sign of a product; raises where a factor may be zero and none is."""
        return prod(self._signs(numbers, decided=lambda signs: 0 in signs))

    def _signs(
        self, numbers: Iterable[Number], decided: Callable[[list[Sign]], bool]
    ) -> list[Sign]:
        """The signs of some numbers; raises where one is unknown, unless the others decide."""
        signs, unknown = [], None
        for number in numbers:
            try:
                signs.append(self.sign(number))
            except UndecidedError as error:
                unknown = error
            if decided(signs):
                break
        if unknown and not decided(signs):
            raise unknown
        return signs


def unproved(symbol: str, value: Exact) -> UndecidedError:
    """The error of a number that may be zero."""
    return UndecidedError(symbol, abs(value.ball(MOST_BITS)))


def ball_sign(ball: Ball) -> Sign | None:
    """The sign that every number of a ball has, or None; a ball that is the number 0 has 0."""
    if ball > 0:
        return 1
    if ball < 0:
        return -1
    return 0 if ball.is_zero() else None


def ball_of(value: Exact, bits: int) -> Ball:
    """A ball of an exact number, at the working precision of so many bits."""
    q = value.fraction
    return value.ball(bits) if q is None else rational_ball(q)
