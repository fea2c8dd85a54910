"""Half a nutation in extended precision, onto which all the rest of the motion is folded.

theta nods between two turning points, the half-period apart, and the motion about each is
symmetric in time (`turning`). From one turning point to the next the arguments of alpha and beta
turn by constant amounts. So two swings, from a turning point to the next and from that to the one
after, tell the motion at all times; the second repeats the first backwards, and how well it does
measures the errors of both.

No two turning points are closer than pi/(2 sqrt(K)), with K of `turns`: u' obeys Hill's equation
with a factor of at most 4 K. No step is longer, so none is missed, and every turn is counted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heavytop.integration.compiled import System
from heavytop.integration.dense import Dense, Piece, cut, followed
from heavytop.integration.following import Pair
from heavytop.integration.precise import Mark, Precise, Unfinished, Wanted
from heavytop.integration.turning import (
    Real,
    Turning,
    arguments,
    rise,
    rise_rate,
    sense,
    turning,
)
from heavytop.integration.turns import Turns

Array = NDArray[np.float64]
MOST_STEPS = 2000  # in half a nutation
MOST_ITERATIONS = 200
QUICK = 256  # bits up to which half a nutation is done sooner than its code would be improved


@dataclass(frozen=True, slots=True)
class Swing:
    """From a state, most often a turning point, to the next turning point.

    Attributes
    ----------
    duration : real
        How long it takes [s].
    turned : pair of real
        By how much the arguments of alpha and beta turn [rad].
    end : Turning
    marks : tuple of Mark
        Where each step starts, in time since the start.
    dense : Dense
        The same in doubles.
    bend : float
        How fast u turns back at the end, in units of the fastest rate squared.
    """

    duration: Real
    turned: Pair
    end: Turning
    marks: tuple[Mark, ...]
    dense: Dense
    bend: float


@dataclass(frozen=True, slots=True)
class Nutation:
    """What tells the motion at all times. Numbers are decimal texts that hold every bit.

    Attributes
    ----------
    first : str
        The time of a turning point [s].
    before : pair of str
        What the arguments of alpha and beta turn from the start until then [rad].
    half : str
        Half a period [s].
    turned : pair of str
        What they turn in it [rad].
    swings : pair of Swing
        From the first turning point, and from the next.
    closure : float
        By how much the second swing differs from the first [rad; times by the fastest rate].
    lost_bits : float
        How many bits were lost to what is hard to tell: flat turning points, close passes.
    steps : int
    """

    first: str
    before: tuple[str, str]
    half: str
    turned: tuple[str, str]
    swings: tuple[Swing, Swing]
    closure: float
    lost_bits: float
    steps: int


class Folding(Precise):
    """The attitude form compiled for numbers of so many bits, to integrate half a nutation.

    Parameters
    ----------
    bits : int
    parameters : mapping from str to str
        Constants of the run, by symbol name, as decimal texts.
    """

    def __init__(self, bits: int, parameters: Mapping[str, str]) -> None:
        super().__init__(System.of_attitude(bits), bits, parameters, quick=bits <= QUICK)
        names = ("g", "l_z", "n", "P_plus", "P_minus")
        self._g, self._l_z, self._n, P_plus, P_minus = (self._constants[name] for name in names)
        self._turns = Turns.of({name: float(x) for name, x in self._constants.items()})
        self._momenta = P_plus, P_minus
        self._turn = 2 * np.arctan2(self.number("0"), self.number("-1"))

    def nutation(self, state: Sequence[str], turns_at_once: bool) -> Nutation:
        """Integrate half a nutation, twice.

        Parameters
        ----------
        state : sequence of str
            The start, as decimal texts.
        turns_at_once : bool
            Whether the start is itself a turning point.

        Raises
        ------
        Unfinished
            No turning point was reached in so many steps, or in finite numbers.
        """
        start = tuple(map(self.number, state))
        doubles = np.array([float(x) for x in start])
        rate, apart = (
            2 * math.sqrt(self._turns.stiffness(doubles)),
            self._turns.decided(doubles) / 2,
        )
        if not (0 < rate < math.inf and 0 < apart < math.inf):
            raise Unfinished("its rates are beyond the range of doubles, squared")
        self._rate, self._apart = self.number(repr(rate)), self.number(repr(apart))
        lead = None if turns_at_once else self._swing(start, False)
        begun = self._turning(start) if lead is None else lead.end
        first = self._swing(begun.state, True)
        second = self._swing(first.end.state, True)
        rounding = self._closure(first, second)
        return Nutation(
            first=self.text(lead.duration) if lead else "0",
            before=self._texts(lead.turned if lead else self._aside(begun)),
            half=self.text(first.duration),
            turned=self._texts(first.turned),
            swings=(first, second),
            closure=math.ldexp(rounding, -self.bits),
            lost_bits=max(self._lost(first, second), math.log2(max(1.0, rounding))),
            steps=sum(len(swing.marks) for swing in (lead, first, second) if swing),
        )

    def state(self, swing: Swing, since: str) -> tuple[str, ...]:
        """Return the state at a time since the start of a swing [s], as decimal texts."""
        mark = swing.marks[int(swing.dense.piece(np.array([float(since)]))[0])]
        walk = self.walk(mark, [Wanted(since)], 2 * float(swing.duration))
        (found,) = walk.found
        assert found is not None  # no event was asked for
        return tuple(map(self.text, found.state))

    def _texts(self, pair: Pair) -> tuple[str, str]:
        return self.text(pair[0]), self.text(pair[1])

    def _turning(self, state: Sequence[Real]) -> Turning:
        return turning(state, self._l_z, self._momenta, self._rate)

    def _aside(self, begun: Turning) -> Pair:
        """Return the arguments at a start that turns, less those that phi and psi say.

        They are none, or quarters of a turn: the middle of a pass, and the side it leaves to.
        """
        phi, psi = self._constants["phi_0"], self._constants["psi_0"]
        said, quarter = ((phi + psi) / 2, (phi - psi) / 2), self._turn / 4
        off = (self._near(x - y, 0.0) for x, y in zip(begun.arguments, said, strict=True))
        a, b = (quarter * round(float(x / quarter)) for x in off)
        return a, b

    def _near(self, angle: Real, about: float) -> Real:
        """Return an angle with as many turns as bring it near another one."""
        while turns := round((about - float(angle)) / (2 * math.pi)):
            angle = angle + self._turn * turns
        return angle

    def _closure(self, first: Swing, second: Swing) -> float:
        """Return by how much two swings differ, in units of the last bit of 1."""
        turned = (abs(x - y) for x, y in zip(first.turned, second.turned, strict=True))
        late = abs(first.duration - second.duration) * self._rate
        return float(max(late, *turned) * self.number("2") ** self.bits)

    def _lost(self, first: Swing, second: Swing) -> float:
        bend = max(min(first.bend, second.bend), 2.0 ** -min(self.bits, 1000))  # less is rounding
        steep = max(first.end.steepness, second.end.steepness)
        return math.log2(float(steep) / bend) + abs(math.log2(float(self._rate)))

    def _swing(self, state: Sequence[Real], turns_at_once: bool) -> Swing:
        """Integrate to the next turning point, from one or from a state between two."""
        self._taylor.time = self.number("0")
        for i, value in enumerate(state):
            self._taylor.state[i] = value
        marks: list[Mark] = []
        cuts: list[tuple[float, Array]] = []
        sign = 0 if turns_at_once else sense(rise(state))
        while True:
            marks.append(Mark(self._elapsed(), tuple(self._taylor.state), 1))
            length = self._stepped(len(marks))
            cuts.append((float(length), cut(self._taylor.tc, length)))
            rising = sense(rise(self._taylor.state))
            if sign * rising < 0:
                return self._ended(marks, cuts, turns_at_once, self._zero(length, rising))
            sign = rising

    def _stepped(self, count: int) -> Real:
        """Take a step and return its length [s]."""
        length = self._step(self._apart)
        if count > MOST_STEPS:
            raise Unfinished(f"no turning point in {MOST_STEPS} steps")
        return length

    def _zero(self, length: Real, sign: int) -> Real:
        """Return when u turns back in the last step, since its end [s]; `sign` is that of u' there.

        Newton's method, kept between the two times that are known to have the zero between them.
        """
        low, high = -length, length - length
        enough = length * self.number("2") ** -(self.bits // 2 + 4)
        x = low / 2
        for _ in range(MOST_ITERATIONS):
            state = self._dense(x)
            slope, value = rise_rate(state, self._l_z, self._n, self._g), rise(state)
            low, high = (low, x) if sign * value > 0 else (x, high)
            new = x - value / slope if slope else low
            if abs(new - x) <= enough:  # the next change is its square
                return new
            x = new if low < new < high else (low + high) / 2
        return x  # all rounding: too few bits

    def _ended(
        self, marks: list[Mark], cuts: list[tuple[float, Array]], turns_at_once: bool, since: Real
    ) -> Swing:
        """Return a swing that ends so long after the end of its last step."""
        duration, last = self._elapsed() + since, self._dense(since)
        end = self._turning(last)
        begun = arguments(marks[0].state) if not turns_at_once else (since - since, since - since)
        seen = [begun, *(arguments(mark.state) for mark in marks[1:]), end.arguments]
        turned = followed([[float(x) for x in pair] for pair in seen])
        counted = (turned[-1] - turned[0]).tolist()
        changes = (y - x for x, y in zip(begun, end.arguments, strict=True))
        a, b = (self._near(*each) for each in zip(changes, counted, strict=True))
        steps = zip((float(mark.t) for mark in marks), cuts, turned.tolist(), strict=False)
        return Swing(
            duration=duration,
            turned=(a, b),
            end=end,
            marks=tuple(marks),
            dense=Dense.of([Piece(t, *cut, (a, b)) for t, cut, (a, b) in steps]),
            bend=float(abs(rise_rate(last, self._l_z, self._n, self._g)) / self._rate**2),
        )
