"""The signs of the criteria for one top and one start: the one place where zeros are proved.

Balls of 106 bits decide nearly always. What they leave open goes to the exact numbers, whose sign
is found by balls of more bits or by proving that everything cancels.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cached_property
from typing import Any, Final, Literal, TypeAlias

from flint import arb, fmpq

from heavytop.classification import kinds
from heavytop.classification.kinds import Given, Sum
from heavytop.numbers import ONE, PI, Exact, cos
from heavytop.numbers.intervals import working
from heavytop.scene.state import State
from heavytop.scene.top import Top

Ball: TypeAlias = Any
Sign: TypeAlias = Literal[-1, 0, 1]
Criterion: TypeAlias = Callable[[Given], Sum]

FEW_BITS: Final = 106
MOST_BITS: Final = 4096  # as many as the exact numbers try


class UndecidedError(Exception):
    """A sum that could be neither told from zero nor proved to be zero; its size is a ball."""

    def __init__(self, size: Ball) -> None:
        self.bound = size.upper().str(2, radius=False)
        super().__init__(f"zero, or smaller than {self.bound} of its terms")


class SceneSigns:
    """What is positive, zero or negative of one top and one start, each found when first asked for.

    Signs raise `UndecidedError` where a number could be neither told from zero nor proved to be
    zero. Balls do not: they are exact where a zero is proved, and wide where it is not.
    """

    def __init__(self, top: Top, start: State) -> None:
        self.top, self.start = top, start
        self._rates: dict[str, Sign | None] = {}
        self._found: dict[Criterion, Sign] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.top, self.start)  # balls are not copied

    @cached_property
    def few(self) -> Given:
        """What is given, as balls of 106 bits."""
        return self.balls(FEW_BITS)

    def balls(self, bits: int) -> Given:
        """What is given, as balls of so many bits."""
        with working(bits):
            A, C = (ball_of(moment, bits) for moment in (self.top.A, self.top.C))
            gMR, thetadot, phidot, omega3 = (self._rate_ball(name, bits) for name in _RATES)
            return Given(A, C, gMR, *self._heights(bits), thetadot, phidot, omega3)

    def _rate_ball(self, name: str, bits: int) -> Ball:
        ball = ball_of(self._given(name), bits)
        if name not in self._rates:
            told = ball_sign(ball)
            self._rates[name] = self._given(name).sign() if told is None else told
        return arb(0) if self._rates[name] == 0 else ball

    def _heights(self, bits: int) -> tuple[Ball, Ball, Ball]:
        """cosθ, 1 − cosθ and 1 + cosθ: exact on a pole, or from the half angle."""
        if self._pole:
            u = arb(self._pole)
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
        return self._pole * ONE if self._pole else cos(self.start.theta)

    def rate(self, name: str) -> Sign:
        """The sign of gMR, thetadot, phidot or omega3."""
        if name not in self._rates:
            self._rates[name] = self._given(name).sign()
        if (told := self._rates[name]) is None:
            raise unproved(self._given(name))
        return told

    def _given(self, name: str) -> Exact:
        found: Exact = self.top.gMR if name == "gMR" else getattr(self.start, name)
        return found

    @cached_property
    def _pole(self) -> Sign | None:
        theta = self.start.theta
        if theta.fraction is not None:  # π is irrational
            return 1 if theta.fraction == 0 else 0
        with working(FEW_BITS):
            ball = theta.ball(FEW_BITS)
            if ball > 0 and ball < arb.pi():
                return 0
        told = theta.sign(), (PI - theta).sign()
        return 1 if told[0] == 0 else -1 if told[1] == 0 else None if None in told else 0

    def expect_told(self) -> None:
        """Raise `UndecidedError` where something that is given cannot be told from zero."""
        for name in _RATES:
            self.rate(name)
        _ = self.pole

    @cached_property
    def pole(self) -> Sign:
        """1 where the axis starts pointing up, −1 where down, 0 where neither."""
        if self._pole is None:
            theta = self.start.theta
            raise unproved(theta if theta.sign() is None else PI - theta)
        return self._pole

    @cached_property
    def cos_sign(self) -> Sign:
        """The sign of cosθ."""
        told = ball_sign(self.few.cos)
        return sign_of_exact(self._cos) if told is None else told

    def sign(self, criterion: Criterion) -> Sign:
        """The sign of a criterion."""
        if criterion in self._found:
            return self._found[criterion]
        with working(FEW_BITS):
            told = ball_sign(sum_of(criterion(self.few)))
        if told is None:
            told = sum_of(criterion(self.exact)).sign()
        if told is None:
            given = self.balls(MOST_BITS)
            with working(MOST_BITS):
                raise UndecidedError(relative_size(criterion(given), arb(0)))
        self._found[criterion] = told
        return told

    def sign_of(self, name: str) -> Sign:
        """The sign of a constant of the reduced motion, up to factors that are positive.

        Parameters
        ----------
        name : {"g", "udot0", "drift0", "P_minus", "P_plus", "pull", "over_top", "over_bottom", \
"looping"}
            As in `heavytop.classification.reduced.Reduced`; of u̇₀ and of f₁, which are the
            negative of what is told, only whether they are zero is meant.
        """
        if name == "g":
            return self.rate("gMR")
        if name in ("udot0", "drift0"):
            return 0 if self.pole else self.rate("thetadot" if name == "udot0" else "phidot")
        if name == "pull" and self.pole:  # where f₁ vanishes with θ̇₀
            return self.rate("thetadot")
        if self.pole and name == ("P_minus" if self.pole > 0 else "P_plus"):
            return 0
        return self.sign(_CRITERIA[name])


_RATES: Final = ("gMR", "thetadot", "phidot", "omega3")
_CRITERIA: Final[dict[str, Criterion]] = {
    "P_minus": kinds.p_minus,
    "P_plus": kinds.p_plus,
    "pull": kinds.steady_balance,
    "over_top": kinds.over_top,
    "over_bottom": kinds.over_bottom,
    "looping": kinds.looping,
}


def sum_of(terms: Sum) -> Any:
    """The sum of some terms."""
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def relative_size(terms: Sum, beside: Ball) -> Ball:
    """|sum|/Σ|terms|; `beside` is something else that the sum is small beside."""
    return abs(sum_of(terms)) / sum((abs(term) for term in terms), beside)


def sign_of_exact(value: Exact) -> Sign:
    """The sign of an exact number, or `UndecidedError`."""
    if (sign := value.sign()) is None:
        raise unproved(value)
    return sign


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


def rational_ball(q: Fraction) -> Ball:
    """A ball of a rational number, at the working precision."""
    return arb(fmpq(q.numerator, q.denominator))
