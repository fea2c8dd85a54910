"""Signs of the criteria of kinds, for one top and one start: zeros are proved here.

Balls of 106 bits decide nearly always. What they leave open goes to the exact numbers, whose sign
is found by balls of more bits or by proving that everything cancels.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from math import prod
from typing import Final

from flint import arb

from heavytop.classification.kinds import Criterion
from heavytop.classification.reduced import (
    MOST_BITS,
    Reduced,
    ball_of,
    ball_sign,
    reduced_from_scene,
)
from heavytop.exact.balls import working
from heavytop.exact.number import Sign
from heavytop.scene.state import State
from heavytop.scene.top import Top

SIGN_BITS: Final = 106


class UndecidedError(Exception):
    """A number that is neither separated from zero nor proved to be zero."""

    def __init__(self, symbol: str, size: arb) -> None:
        self.bound = abs(size).upper().str(2, radius=False)
        super().__init__(
            f"the sign of {symbol} is open: in units A = 1 its size is at most {self.bound}"
        )


class SceneSigns:
    """The signs of criteria for one top and one start, each computed when it is first needed.

    They take a working precision of 106 bits; `UndecidedError` is raised where a number is
    neither separated from zero nor proved to be zero.
    """

    def __init__(self, top: Top, start: State) -> None:
        self.top, self.source = top, reduced_from_scene(top, start)
        self._found: dict[Criterion, Sign] = {}

    @cached_property
    def few(self) -> Reduced:
        """The motion in balls of 106 bits."""
        return self.source.reduced(SIGN_BITS)

    def sign(self, number: Criterion) -> Sign:
        """The sign of a number."""
        if number not in self._found:
            self._found[number] = self._sign(number)
        return self._found[number]

    def _sign(self, number: Criterion) -> Sign:
        side = ball_sign(number.value(self.few))
        if side is None:
            side = number.value(self.source.exact).sign()
        if side is None:
            with working(MOST_BITS):
                raise UndecidedError(number.symbol, number.value(self.source.reduced(MOST_BITS)))
        return side

    def shown(self, number: Criterion, bits: int) -> arb:
        """What is shown of a number, at the working precision of so many bits."""
        x = self.few if bits == SIGN_BITS else self.source.reduced(bits)
        moments = (ball_of(moment, bits) for moment in (self.top.A, self.top.C))
        shown: arb = number.shown(number.value(x), x, *moments)
        return shown

    def vanish(self, numbers: Iterable[Criterion]) -> bool:
        """Whether all of some numbers are zero; raises where one may be and no other is not."""
        return not any(self._signs(numbers, decided=any))

    def product(self, numbers: Iterable[Criterion]) -> int:
        """The sign of a product; raises where a factor may be zero and none is."""
        return prod(self._signs(numbers, decided=lambda signs: 0 in signs))

    def _signs(
        self, numbers: Iterable[Criterion], decided: Callable[[list[Sign]], bool]
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
