"""A motion folded onto half a nutation, by its period and by its symmetry in time.

Time is counted in half-periods from a turning point. About each turning point the motion is
symmetric (`taylor.turning`), and phi and psi there are those of the first one and as many times
what they gain in half a period.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from heavytop.alone import Alone
from heavytop.integration.folding import Folding, Nutation
from heavytop.numbers.decimals import Context, Number
from heavytop.numbers.double_double import Multiples, two_product
from heavytop.run.folds.cayley_klein import Angles, Constants, nodding
from heavytop.run.folds.sample import FoldedSample
from heavytop.run.folds.turned import ARRAYS, DOUBLES, Arithmetic, Real, Turned, decimals, words

Array = NDArray[np.float64]
TOLD_APART = 2.0**50  # half-periods that doubles tell from their neighbours, with room


@dataclass(frozen=True, eq=False)
class Nodding:
    """A motion whose theta swings between two turning points.

    Attributes
    ----------
    ctx : Context
        Of more digits than the integration has.
    engine : Folding
    nutation : Nutation
    constants : mapping from str to mpf
        Of the run, by symbol name: P_plus, P_minus, l_z, kappa, phi_0 and psi_0.
    """

    ctx: Context
    engine: Folding
    nutation: Nutation
    constants: Mapping[str, Number]
    _alone: Alone = field(default_factory=Alone, repr=False)

    @cached_property
    def first(self) -> Number:
        """The time of a turning point [s]."""
        return self.ctx.mpf(self.nutation.first)

    @cached_property
    def half(self) -> Number:
        """Half a period [s]."""
        return self.ctx.mpf(self.nutation.half)

    @property
    def period(self) -> Number:
        """T [s], the period of theta."""
        return 2 * self.half

    @property
    def reach_of_doubles(self) -> float:
        """How far off doubles still tell one half-period from the next [s]."""
        return float(self.half) * TOLD_APART

    @property
    def gains(self) -> tuple[Number, Number]:
        """What phi and psi gain in a period [rad]."""
        phi, psi = self._gains
        return 4 * self.ctx.pi * phi, 4 * self.ctx.pi * psi

    def at_many(self, t: Array) -> FoldedSample:
        """Return the motion at times of shape (k,) [s], no more than 2^50 half-periods away."""
        n, since = self._reduced(t)
        states, swung = np.empty((6, t.size)), np.empty((2, t.size))
        for swing, among in zip(self.nutation.swings, (n % 2 == 0, n % 2 == 1), strict=True):
            here = np.flatnonzero(among)
            states[:, here], swung[:, here] = swing.dense.at(np.abs(since[0][here]))
        phi, psi = (
            Turned(whole + each.whole, rest + each.rest)
            for each, (whole, rest) in zip(
                self._first, (gain.turns(n) for gain in self._gained), strict=True
            )
        )
        whole, rest = self._spun(since)
        begun = phi, Turned(psi.whole + whole, psi.rest + rest)
        sign = np.where(since[0] < 0, -1.0, 1.0)
        parts = list(states), list(swung)
        return _seen(ARRAYS, t, *parts, sign, begun, self._in_doubles).stacked()

    def at(self, t: Number) -> FoldedSample:
        """Return the motion at a time [s]."""
        n, since, (phi, psi) = self._begun(t)
        state, swung = self.nutation.swings[n % 2].dense.at(np.array([abs(float(since))]))
        sign, begun = (-1 if since < 0 else 1), (phi.in_doubles(), psi.in_doubles())
        parts = state[:, 0].tolist(), swung[:, 0].tolist()
        return _seen(DOUBLES, float(t), *parts, sign, begun, self._in_doubles).stacked()

    def decimals(self, t: Number) -> FoldedSample:
        """Return the motion at a time [s], to all digits."""
        ctx = self.ctx
        n, since, begun = self._begun(t)
        swing, text = self.nutation.swings[n % 2], ctx.nstr(abs(since), ctx.dps)
        with self._alone:
            state = tuple(map(ctx.mpf, self.engine.state(swing, text)))
        _, near = swing.dense.at(np.array([float(abs(since))]))
        q_0, q_1, q_2, q_3, *_ = state
        swung = (
            self._argument(*each) for each in zip(((q_0, q_3), (q_1, q_2)), near[:, 0], strict=True)
        )
        sign = -1 if since < 0 else 1
        return _seen(decimals(ctx), t, state, tuple(swung), sign, begun, self._constants)

    def _argument(self, arm: tuple[Number, Number], near: float) -> Number:
        """Return the argument of alpha or beta that is near a double."""
        x, y = arm
        if not x and not y:  # on the pole a right angle to what it is at the turning point
            return self.ctx.pi / 2 * round(near / (math.pi / 2))
        turn = 2 * self.ctx.pi
        principal = self.ctx.atan2(y, x)
        return principal + turn * round((near - float(principal)) / (2 * math.pi))

    def _reduced(self, t: Array) -> tuple[Array, tuple[Array, Array]]:
        """Return a turning point close by, by its number, and the time since it [s].

        Rounding may take another than the nearest, but none beyond the end of a swing.
        """
        first = words(self.first)
        n = np.rint((t - first[0]) / self._halves.words[0])
        return n, self._halves.rest(t, n, first)

    def _begun(self, t: Number) -> tuple[int, Number, Angles]:
        """Return the nearest turning point, the time since it, and phi and psi to count from.

        The uniform part of psi is counted up to the time itself.
        """
        ctx, turn = self.ctx, 2 * self.ctx.pi
        n = int(ctx.nint((t - self.first) / self.half))
        since = t - self.first - n * self.half
        phi, psi = (x + n * gain for x, gain in zip(self._first_turns, self._gains, strict=True))
        psi += self.constants["kappa"] * since / turn
        return n, since, (Turned.of(ctx, phi), Turned.of(ctx, psi))

    def _spun(self, since: tuple[Array, Array]) -> tuple[NDArray[np.int64], Array]:
        """Return the uniform part of psi since the turning points, as turns and a rest."""
        high, low, _ = words(self.constants["kappa"] / (2 * self.ctx.pi))
        spun, error = two_product(np.full_like(since[0], high), since[0])
        whole = np.rint(spun)
        return whole.astype(np.int64), (spun - whole) + error + high * since[1] + low * since[0]

    @cached_property
    def _first_turns(self) -> tuple[Number, Number]:
        """Phi and psi at the turning point that is counted from [turns]."""
        c, turn = self.constants, 2 * self.ctx.pi
        a, b = map(self.ctx.mpf, self.nutation.before)
        return (c["phi_0"] + a + b) / turn, (c["psi_0"] + a - b + c["kappa"] * self.first) / turn

    @cached_property
    def _gains(self) -> tuple[Number, Number]:
        """What phi and psi gain in half a period [turns]."""
        turn, spun = 2 * self.ctx.pi, self.constants["kappa"] * self.half
        a, b = map(self.ctx.mpf, self.nutation.turned)
        return (a + b) / turn, (a - b + spun) / turn

    @cached_property
    def _first(self) -> Angles:
        phi, psi = (Turned.of(self.ctx, x).in_doubles() for x in self._first_turns)
        return phi, psi

    @cached_property
    def _halves(self) -> Multiples:
        return Multiples(words(self.half))

    @cached_property
    def _gained(self) -> tuple[Multiples, Multiples]:
        phi, psi = (Multiples(words(gain)) for gain in self._gains)
        return phi, psi

    @cached_property
    def _constants(self) -> Constants:
        return Constants(*(self.constants[name] for name in Constants.__slots__))

    @cached_property
    def _in_doubles(self) -> Constants:
        return Constants(*(float(self.constants[name]) for name in Constants.__slots__))


def _seen(
    m: Arithmetic,
    t: Real,
    state: Sequence[Real],
    swung: Sequence[Real],
    sign: Real,
    begun: Angles,
    constants: Constants,
) -> FoldedSample:
    """Return the motion, from what the arguments of alpha and beta turn since a turning point."""
    a, b = (sign * x / (2 * m.pi) for x in swung)
    angles = begun[0].further(m, a + b), begun[1].further(m, a - b)
    return nodding(m, t, state, sign, begun[0], angles, constants)
