"""Angles in turns, in doubles, arrays of them, or mpmath's numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.numbers.decimals import Context, Number

Real = Any


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """The functions of one type of numbers, `whole` being the integer below."""

    cos: Callable[[Real], Real]
    sin: Callable[[Real], Real]
    atan2: Callable[[Real, Real], Real]
    sqrt: Callable[[Real], Real]
    whole: Callable[[Real], Any]
    pi: Real


def _whole(x: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.floor(x).astype(np.int64)


DOUBLES: Final = Arithmetic(math.cos, math.sin, math.atan2, math.sqrt, math.floor, math.pi)
ARRAYS: Final = Arithmetic(np.cos, np.sin, np.arctan2, np.sqrt, _whole, np.pi)


def decimals(ctx: Context) -> Arithmetic:
    """Return the functions of the numbers of a context."""
    return Arithmetic(ctx.cos, ctx.sin, ctx.atan2, ctx.sqrt, lambda x: int(ctx.floor(x)), +ctx.pi)


@dataclass(frozen=True, slots=True)
class Turned:
    """An angle, as a whole number of turns and a rest [turns]."""

    whole: Any
    rest: Real

    @classmethod
    def of(cls, ctx: Context, turns: Number) -> Turned:
        """Return an angle of so many turns, the rest in [0, 1)."""
        whole = ctx.floor(turns)
        return cls(int(whole), turns - whole)

    def in_doubles(self) -> Turned:
        """Return the same with a double for the rest."""
        return Turned(self.whole, float(self.rest))

    def further(self, m: Arithmetic, turns: Real) -> Turned:
        """Return it turned further, the rest then in [0, 1)."""
        rest = self.rest + turns
        below = m.whole(rest)
        rest = rest - below
        over = rest >= 1  # what is 1e-20 short of a turn is a turn, to rounding
        return Turned(self.whole + below + over, rest - over)


def words(x: Number) -> tuple[float, float, float]:
    """Return three doubles that add up to a number, to 159 bits."""
    high = float(x)
    middle = float(x - high)
    return high, middle, float(x - high - middle)
