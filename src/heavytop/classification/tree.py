"""The decision tree: the kinds in their order, and how far each rejected one is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

from flint import arb

from heavytop.classification import criteria
from heavytop.classification.criteria import Given, Sum
from heavytop.classification.judge import Ball, Criterion, Judge, Sign, UndecidedError, exact_sign
from heavytop.classification.kind import Kind
from heavytop.numbers import cos


@dataclass(frozen=True, slots=True)
class _Number:
    """A number that may be zero: its sign, and its size beside what it is part of."""

    sign: Callable[[], Sign]
    size: Callable[[], Ball]


class Tree:
    """Finds the kind of one motion.

    A special kind asks for several numbers to be zero; by the largest of their relative sizes it
    is missed.
    """

    def __init__(self, judge: Judge) -> None:
        self.judge = judge
        self._distances: list[Ball] = []

    def kind(self) -> Kind:
        """The first kind that fits.

        Raises
        ------
        UndecidedError
            A sign on the way could not be told.
        """
        if self._vanish(self._theta_rate, self._across, self._spin, self._torque):
            return Kind.AT_REST
        if self._vanish(self._weight):
            return Kind.FORCE_FREE
        if self._vanish(self._theta_rate, self._sine):
            up = self.judge.pole == self.judge.rates["gMR"]
            return Kind.SLEEPING if up else Kind.HANGING
        if self._vanish(self._spin, self._across):
            return Kind.PLANAR_PENDULUM
        return self._reaching_a_pole()

    def detail(self, kind: Kind) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """What tells motions of one kind apart; where that is undecided, what it may be."""
        finders = {
            Kind.SLEEPING: (self._stability, "marginal"),
            Kind.PLANAR_PENDULUM: (self._swing, "asymptotic"),
            Kind.UNIFORM_PRECESSION: (self._speed, "single"),
        }
        if kind not in finders:
            return (), ()
        find, between = finders[kind]
        try:
            return (find(),), ()
        except UndecidedError:
            return (), (between,)

    def margin(self) -> Ball:
        """The distance to the nearest of the kinds that were rejected."""
        least = arb(1)
        for distance in self._distances:
            least = least.min(distance)
        return least

    def _reaching_a_pole(self) -> Kind:
        top, bottom = self._miss(1), self._miss(-1)
        highest = self.judge.rates["gMR"]
        if self._vanish(top if highest > 0 else bottom, self._sum(_over(highest))):
            return Kind.SEPARATRIX
        if self._vanish(top) and self._side(criteria.over_top) > 0:
            return Kind.THROUGH_TOP
        if self._vanish(bottom) and self._side(criteria.over_bottom) > 0:
            return Kind.THROUGH_BOTTOM
        if self._vanish(self._theta_rate, self._sum(criteria.unsteadiness)):
            return Kind.UNIFORM_PRECESSION
        return self._generic()

    def _generic(self) -> Kind:
        judge = self.judge
        if judge.sign(criteria.miss_of_top) * judge.sign(criteria.miss_of_bottom) > 0:
            return Kind.WAVES
        side = self._side(criteria.looping, criteria.lift_beside) * judge.rates["omega3"]
        if side == 0:
            return Kind.CUSPS
        return Kind.LOOPS if side > 0 else Kind.WAVES

    def _stability(self) -> str:
        highest = self.judge.rates["gMR"]
        side = self._side(lambda x: criteria.stiffness(x, highest))
        return ("marginal", "stable", "unstable")[side]

    def _swing(self) -> str:
        return ("asymptotic", "rotating", "swinging")[self._side(_over(self.judge.rates["gMR"]))]

    def _speed(self) -> str:
        over = exact_sign(cos(self.judge.start.theta))
        if over == 0:
            return "single"
        highest = self.judge.rates["gMR"]
        side = self._side(lambda x: criteria.haste(x, over, highest))
        return ("single", "fast", "slow")[side]

    def _vanish(self, *numbers: _Number) -> bool:
        """Whether all of them are zero; where not, by how much that is missed is remembered."""
        sizes, unknown = [], None
        for number in numbers:
            try:
                if number.sign() != 0:
                    sizes.append(number.size())
            except UndecidedError as error:
                unknown = error
        if sizes:
            largest = sizes[0]
            for size in sizes[1:]:
                largest = largest.max(size)
            self._distances.append(largest)
            return False
        if unknown is not None:
            raise unknown
        return True

    def _side(self, criterion: Criterion, beside: Callable[[Given], Ball] | None = None) -> Sign:
        """The sign of a criterion, its size remembered."""
        sign = self.judge.sign(criterion)
        if sign:
            self._distances.append(self.judge.size(criterion, beside))
        return sign

    # --- the numbers ---------------------------------------------------------------------------

    def _sum(self, criterion: Criterion) -> _Number:
        judge = self.judge
        return _Number(partial(judge.sign, criterion), partial(judge.size, criterion))

    def _miss(self, pole: Sign) -> _Number:
        """P₋ or P₊, which vanishes at once where the axis starts on that pole."""
        judge = self.judge
        criterion = criteria.miss_of_top if pole > 0 else criteria.miss_of_bottom
        return _Number(
            lambda: 0 if judge.pole == pole else judge.sign(criterion),
            lambda: judge.size(criterion, partial(criteria.momentum_beside, pole=pole)),
        )

    def _share(self, square: Callable[[Given], Ball]) -> Callable[[], Ball]:
        """√(square / momentum²) of the square of a momentum."""
        return lambda: self.judge.positive(lambda x: (square(x) / _momentum2(x)).sqrt())

    @cached_property
    def _theta_rate(self) -> _Number:
        rates = self.judge.rates
        return _Number(lambda: rates["thetadot"], self._share(lambda x: (x.A * x.thetadot) ** 2))

    @cached_property
    def _across(self) -> _Number:
        judge = self.judge
        return _Number(
            lambda: 0 if judge.pole else judge.rates["phidot"],
            self._share(lambda x: (x.A * x.phidot) ** 2 * x.sin2),
        )

    @cached_property
    def _spin(self) -> _Number:
        return _Number(lambda: self.judge.rates["omega3"], self._share(lambda x: x.p_psi * x.p_psi))

    @cached_property
    def _weight(self) -> _Number:
        return _Number(lambda: self.judge.rates["gMR"], self._share(lambda x: x.A * abs(x.gMR)))

    @cached_property
    def _sine(self) -> _Number:
        return _Number(
            lambda: 0 if self.judge.pole else 1,
            lambda: self.judge.positive(lambda x: x.sin2.sqrt()),
        )

    @cached_property
    def _torque(self) -> _Number:
        """GMR sinθ."""
        weight, sine = self._weight, self._sine
        return _Number(
            lambda: 0 if sine.sign() == 0 else weight.sign(),
            lambda: weight.size().min(sine.size()),
        )


def _momentum2(x: Given) -> Ball:
    """2A K + p_ψ² + A |gMR|, the square of a momentum."""
    return x.A * x.kinetic + x.p_psi * x.p_psi + x.A * abs(x.gMR)


def _over(highest: Sign) -> Callable[[Given], Sum]:
    """2 (E' − |gMR|): by how much the energy reaches over the place where V is highest."""
    return criteria.over_top if highest > 0 else criteria.over_bottom
