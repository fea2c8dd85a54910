"""Signs of the numbers that tell kinds apart, for one top and one start: zeros are proved here.

Balls of 106 bits decide nearly always. What they leave open goes to the exact numbers, whose sign
is found by balls of more bits or by proving that everything cancels.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from math import prod
from typing import Any, Final, TypeAlias

from flint import arb

from heavytop.classification.kinds import Given, Number, sum_of
from heavytop.exact import ONE, PI, Exact, cos
from heavytop.exact.balls import rational_ball, working
from heavytop.exact.number import Sign
from heavytop.scene.state import State
from heavytop.scene.top import Top

Ball: TypeAlias = Any

FEW_BITS: Final = 106
MOST_BITS: Final = 4096  # as many as the exact numbers try


class UndecidedError(Exception):
    """A sum that could be neither told from zero nor proved to be zero; its size is a ball."""

    def __init__(self, size: Ball) -> None:
        self.bound = size.upper().str(2, radius=False)
        super().__init__(f"zero, or smaller than {self.bound} of its terms")


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
        for name in ("gMR", "thetadot", "phidot", "omega3"):
            ball = getattr(found, name)
            if name not in self._rates:
                told = ball_sign(ball)
                self._rates[name] = getattr(self.exact, name).sign() if told is None else told
            if self._rates[name] == 0:
                setattr(found, name, arb(0))
        return found

    def _heights(self, bits: int) -> tuple[Ball, Ball, Ball]:
        """cosθ, 1 − cosθ and 1 + cosθ: exact on a pole, or from the half angle."""
        if self.pole:
            u = arb(self.pole)
            return u, 1 - u, 1 + u
        s, c = (ball_of(self.start.theta, bits) / 2).sin_cos()
        return c * c - s * s, 2 * s * s, 2 * c * c

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
        told = theta.sign(), (PI - theta).sign()
        return 1 if told[0] == 0 else -1 if told[1] == 0 else None if None in told else 0

    def expect_told(self) -> None:
        """Raise `UndecidedError` where something that is given cannot be told from zero."""
        _ = self.few
        for name, told in self._rates.items():
            if told is None:
                raise unproved(getattr(self.exact, name))
        if self.pole is None:
            theta = self.start.theta
            raise unproved(theta if theta.sign() is None else PI - theta)

    def sign(self, number: Number) -> Sign:
        """The sign of a number."""
        if (known := self._found.get(number)) is not None:
            return known
        if number.factor and number.factor(self.few).is_zero():
            told: Sign | None = 0
        else:
            told = ball_sign(sum_of(number.terms(self.few)))
        if told is None:
            told = sum_of(number.terms(self.exact)).sign()
        if told is None:
            with working(MOST_BITS):
                raise UndecidedError(number.size(self.balls(MOST_BITS)))
        self._found[number] = told
        return told

    def nonzero(self, numbers: Iterable[Number]) -> tuple[Number, ...]:
        """Those of some numbers that are not zero; raises where there is none and one may be."""
        found, unknown = [], None
        for number in numbers:
            try:
                if self.sign(number):
                    found.append(number)
            except UndecidedError as error:
                unknown = error
        if unknown and not found:
            raise unknown
        return tuple(found)

    def product(self, numbers: Iterable[Number]) -> int:
        """The sign of a product; raises where a factor may be zero and none is."""
        signs, unknown = [], None
        for number in numbers:
            try:
                signs.append(self.sign(number))
            except UndecidedError as error:
                unknown = error
        if unknown and 0 not in signs:
            raise unknown
        return prod(signs)


def unproved(value: Exact) -> UndecidedError:
    """The error of a number that may be zero."""
    return UndecidedError(abs(value.ball(MOST_BITS)))


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
