"""Whether rules of kinds fit: what follows from the signs of their numbers, where they are known.

Of one motion all here are truth values, of arrays they are masks.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import and_, eq, or_
from typing import Any, ClassVar, Final, NamedTuple

from heavytop.classification.kinds import Criterion, Rule, Tag


class Sign(NamedTuple):
    """A number, whether it is positive, whether that is certain, and whether it is exactly 0."""

    number: Any
    positive: Any
    certain: Any
    zero: Any


class Tristate(NamedTuple):
    """Where something is certainly so, and where it is certainly not; elsewhere it is unsure."""

    yes: Any
    no: Any

    def __and__(self, other: Tristate) -> Tristate:
        return Tristate(self.yes & other.yes, self.no | other.no)


CERTAINLY_NOT: Final = Tristate(yes=False, no=True)


class Signs:
    """The signs of criteria of kinds."""

    always = Tristate(True, False)
    everywhere: ClassVar[Any] = bool

    def sign(self, number: Criterion) -> Sign:
        """The sign of one number."""
        raise NotImplementedError

    def vanish(self, numbers: Iterable[Criterion]) -> Tristate:
        """Whether all of some criteria are 0; they are evaluated in order, until none can be."""
        yes, no = self.always
        for number in numbers:
            _, _, certain, zero = self.sign(number)
            yes, no = yes & zero, no | certain
            if self.everywhere(no):
                break
        return Tristate(yes, no)

    def positive(self, numbers: Iterable[Criterion]) -> Tristate:
        """Whether a product is positive; where a factor is exactly 0, it is not."""
        _, positive, certain, zeros = zip(*map(self.sign, numbers), strict=True)
        sure = reduce(and_, certain)
        yes = sure & reduce(eq, positive)
        return Tristate(yes, reduce(or_, zeros, sure ^ yes))

    def fit(self, rule: Rule | Tag) -> Tristate:
        """Whether a rule fits: all its zeros are zero, and its product is positive."""
        found = self.vanish(rule.zeros)
        if self.everywhere(found.no) or not rule.positive:
            return found
        return found & self.positive(rule.positive)
