"""A judge: tells the sign of a criterion by proof, and how large it is beside its terms.

Balls of 106 bits decide nearly always. What they leave open goes to the exact numbers, whose sign
is found by balls of more bits or by proving that everything cancels.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any, Final, Literal, TypeAlias

from flint import arb

from heavytop.classification.criteria import Given, Sum
from heavytop.numbers import ONE, PI, Exact, cos
from heavytop.numbers.intervals import working
from heavytop.scene.state import State
from heavytop.scene.top import Top

Ball: TypeAlias = Any
Sign: TypeAlias = Literal[-1, 0, 1]
Criterion: TypeAlias = Callable[[Given], Sum]

FEW_BITS: Final = 106
_MORE_BITS: Final = (256, 1024, 4096)
_GOOD_BITS: Final = 54  # of a margin


class UndecidedError(Exception):
    """A sum that could be neither told from zero nor proved to be zero.

    Parameters
    ----------
    size : Ball
        Its relative size, as far as it is known.
    """

    def __init__(self, size: Ball) -> None:
        self.bound = size.upper().str(2, radius=False)
        super().__init__(f"zero, or smaller than {self.bound} of its terms")


class Judge:
    """Decides on one top and one start; everything is found when it is first asked for."""

    def __init__(self, top: Top, start: State) -> None:
        self.top, self.start = top, start
        self.few = self.balls(FEW_BITS)

    def balls(self, bits: int) -> Given:
        """What is given, as balls of so many bits; 1 ∓ cosθ from the half angle."""
        top, start = self.top, self.start
        with working(bits):
            return Given(
                top.A.ball(bits), top.C.ball(bits), self._rate("gMR", top.gMR, bits),
                *self._heights(bits), self._rate("thetadot", start.thetadot, bits),
                self._rate("phidot", start.phidot, bits), self._rate("omega3", start.omega3, bits),
            )  # fmt: skip

    def _rate(self, name: str, value: Exact, bits: int) -> Ball:
        """A ball of what may be zero: the number 0 itself where it is."""
        return value.ball(bits) if self.rates[name] else arb(0)

    def _heights(self, bits: int) -> tuple[Ball, Ball, Ball]:
        """cosθ, 1 − cosθ and 1 + cosθ; from the half angle, and exact on a pole."""
        if self.pole:
            u = arb(self.pole)
            return u, 1 - u, 1 + u
        theta = self.start.theta.ball(bits)
        s, c = (theta / 2).sin_cos()
        return theta.cos(), 2 * s * s, 2 * c * c

    @cached_property
    def exact(self) -> Given:
        """What is given, as exact numbers."""
        top, start, u = self.top, self.start, cos(self.start.theta)
        return Given(
            top.A, top.C, top.gMR, u, ONE - u, ONE + u, start.thetadot, start.phidot, start.omega3
        )

    def sign(self, criterion: Criterion) -> Sign:
        """The sign of a criterion.

        Raises
        ------
        UndecidedError
            It could be neither told from zero nor proved to be zero.
        """
        with working(FEW_BITS):
            told = ball_sign(_total(criterion(self.few)))
        if told is not None:
            return told
        proved = _total(criterion(self.exact)).sign()
        if proved is None:
            raise UndecidedError(self._bound(criterion))
        found: Sign = proved
        return found

    def size(self, criterion: Criterion, beside: Callable[[Given], Ball] | None = None) -> Ball:
        """|sum|/Σ|terms| of a criterion that is not zero, told from zero.

        Parameters
        ----------
        criterion : callable
            The criterion.
        beside : callable, optional
            Something else that the sum is small beside, added to the terms.
        """
        return self.positive(lambda x: _size(criterion(x), beside(x) if beside else None))

    def positive(self, number: Callable[[Given], Ball]) -> Ball:
        """A number known to be positive, with as many bits as a double of it takes."""
        with working(FEW_BITS):
            value = number(self.few)
        for bits in _MORE_BITS:
            if value.rel_accuracy_bits() >= _GOOD_BITS:
                break
            given = self.balls(bits)
            with working(bits):
                value = number(given)
        return value

    def _bound(self, criterion: Criterion) -> Ball:
        bits = _MORE_BITS[-1]
        given = self.balls(bits)
        with working(bits):
            return _size(criterion(given))

    @cached_property
    def rates(self) -> dict[str, Sign]:
        """The signs of gMR, θ̇, φ̇ and ω3."""
        given = {"gMR": self.top.gMR, "thetadot": self.start.thetadot}
        given |= {"phidot": self.start.phidot, "omega3": self.start.omega3}
        return {name: exact_sign(value) for name, value in given.items()}

    @cached_property
    def pole(self) -> Sign:
        """1 where the axis starts pointing up, −1 where down, 0 where neither."""
        theta = self.start.theta
        if theta.fraction is not None:  # π is irrational
            return 1 if theta.fraction == 0 else 0
        if exact_sign(theta) == 0:
            return 1
        return -1 if exact_sign(PI - theta) == 0 else 0


def _size(terms: Sum, beside: Ball | None = None) -> Ball:
    scale = _total(tuple(abs(term) for term in terms))
    return abs(_total(terms)) / (scale if beside is None else scale + beside)


def exact_sign(value: Exact) -> Sign:
    """The sign of an exact number.

    Raises
    ------
    UndecidedError
        It could be neither told from zero nor proved to be zero.
    """
    sign = value.sign()
    if sign is None:
        raise UndecidedError(abs(value.ball(_MORE_BITS[-1])))
    return sign


def ball_sign(ball: Ball) -> Sign | None:
    """The sign that every number of a ball has, or None; a ball that is the number 0 has 0."""
    if ball > 0:
        return 1
    if ball < 0:
        return -1
    return 0 if ball.is_zero() else None


def _total(terms: Sum) -> Any:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total
