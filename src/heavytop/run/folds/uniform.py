"""Constant theta, with nothing to integrate: phi and psi turn uniformly."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from heavytop.numbers.decimals import Context, Number
from heavytop.numbers.double_double import Multiples
from heavytop.run.folds.cayley_klein import Angles, steady
from heavytop.run.folds.sample import FoldedSample
from heavytop.run.folds.turned import ARRAYS, DOUBLES, Turned, decimals, words

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Uniform:
    """A motion at constant theta.

    Attributes
    ----------
    ctx : Context
        Of the digits that are promised at the farthest time.
    theta : mpf
    first : tuple of mpf
        phi and psi at the start [rad].
    rates : tuple of mpf
        phidot and psidot [rad/s].
    """

    ctx: Context
    theta: Number
    first: tuple[Number, Number]
    rates: tuple[Number, Number]

    period: ClassVar[None] = None
    gains: ClassVar[tuple[None, None]] = (None, None)
    reach_of_doubles: ClassVar[float] = math.inf

    def at_many(self, t: Array) -> FoldedSample:
        """Return the motion at times of shape (k,) [s]."""
        phi, psi = (
            Turned(whole + each.whole, rest).further(ARRAYS, each.rest)
            for each, (whole, rest) in zip(
                self._first, (rate.turns(t) for rate in self._multiples), strict=True
            )
        )
        return steady(ARRAYS, t, *self._in_doubles, (phi, psi)).stacked()

    def at(self, t: Number) -> FoldedSample:
        """Return the motion at a time [s]."""
        phi, psi = (angle.in_doubles() for angle in self._angles(t))
        return steady(DOUBLES, float(t), *self._in_doubles, (phi, psi)).stacked()

    def decimals(self, t: Number) -> FoldedSample:
        """Return the motion at a time [s], to all digits."""
        return steady(decimals(self.ctx), t, self._half, self.rates, self._angles(t))

    def _angles(self, t: Number) -> Angles:
        turn = 2 * self.ctx.pi
        turned = (x + rate * t for x, rate in zip(self.first, self.rates, strict=True))
        phi, psi = (Turned.of(self.ctx, x / turn) for x in turned)
        return phi, psi

    @cached_property
    def _half(self) -> tuple[Number, Number]:
        return self.ctx.cos(self.theta / 2), self.ctx.sin(self.theta / 2)

    @cached_property
    def _in_doubles(self) -> tuple[tuple[float, float], tuple[float, float]]:
        (up, down), (phidot, psidot) = self._half, self.rates
        return (float(up), float(down)), (float(phidot), float(psidot))

    @cached_property
    def _first(self) -> Angles:
        phi, psi = (angle.in_doubles() for angle in self._angles(self.ctx.zero))
        return phi, psi

    @cached_property
    def _multiples(self) -> tuple[Multiples, ...]:
        turn = 2 * self.ctx.pi
        return tuple(Multiples(words(rate / turn)) for rate in self.rates)
