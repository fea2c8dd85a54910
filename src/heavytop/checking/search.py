"""The conventions that explain data best: candidates alone, in pairs, and on top of the best."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import combinations
from operator import attrgetter
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.checking.comparison import FIRST, Comparison, decades, octaves
from heavytop.checking.conventions import INERTIA_ROW, NUMBER_ROW, TABLE, Convention
from heavytop.errors import HeavyTopError

# decades, mean of all octaves, by which one explanation beats another clearly
CLEAR_BY: Final = 0.5
ALIKE: Final = 0.05  # decades: no better and no worse
NO_ERROR: Final = 1e-6  # of anything: such data are as they should be
EXTENDED: Final = 6  # best explanations that further conventions are tried on

by_total: Final = attrgetter("total")


class Undoing(NamedTuple):
    """A convention that is undone: its row in the table, which of its variants, words, cost."""

    row: int
    variant: int
    words: str
    cost: float

    @property
    def convention(self) -> Convention:
        """Its row in the table."""
        return TABLE[self.row]

    @property
    def names(self) -> tuple[str, ...]:
        """Such as ``y-up``; two of what is undone at once."""
        return tuple(self.convention.name.split("+"))

    @property
    def sentence(self) -> str:
        """The convention for a person."""
        return self.convention.sentence.format(self.words)


class Explanation(NamedTuple):
    """Conventions, and how far off each quantity is without them [decades].

    `first` is how far off the first row is [rad].
    """

    steps: tuple[Undoing, ...]
    misfit: Any
    first: float = 0.0

    @property
    def names(self) -> frozenset[str]:
        """The names of its conventions."""
        return frozenset(name for step in self.steps for name in step.names)

    @property
    def cost(self) -> float:
        """How many names it has, and what stands back a little more."""
        return sum(step.cost for step in self.steps)

    @property
    def total(self) -> float:
        """The misfit of everything together, a little more for each name."""
        return float(self.misfit.sum()) + ALIKE * self.cost

    @property
    def fits(self) -> bool:
        """Whether it fits so well, to five digits, that nothing more is looked for."""
        return bool((self.misfit < -5).all())

    def beats(self, other: Explanation) -> bool:
        """Whether it is clearly better than another in anything.

        Another motion and another clock are if what fits worst fits better: an integrator's error
        may be nearer to theirs in something.
        """
        new = (step for step in self.steps if not other.names.issuperset(step.names))
        if any(step.convention.is_global for step in new):
            return bool(other.misfit.max() - self.misfit.max() > CLEAR_BY)
        return bool((other.misfit - self.misfit > CLEAR_BY).any())

    def improves(self, base: Explanation) -> bool:
        """Whether it gains 0.7 decades, and what it makes better is good to a tenth then."""
        gains = base.misfit - self.misfit
        good = (self.misfit[gains > CLEAR_BY] < -1).all()
        return bool(self.beats(base) and good and gains.sum() > 0.7)


class Judgement(NamedTuple):
    """The best explanation, the names that are sure, those that explain alike, and all tried."""

    best: Explanation
    sure: frozenset[str]
    alike: tuple[Explanation, ...]
    found: Sequence[Explanation]

    def gain(self, step: Undoing) -> float | None:
        """How many times smaller the misfit of anything is with a convention undone."""
        rest = self.best.names - {*step.names}
        without = min((x for x in self.found if x.names == rest), key=by_total, default=None)
        return None if without is None else float(10 ** max(without.misfit - self.best.misfit))


def undo(comparison: Comparison, steps: Iterable[Undoing]) -> Comparison:
    """The data without some conventions."""
    for step in sorted(steps):
        variants = [variant.data for variant in step.convention.undo(comparison)]
        if step.variant < len(variants):
            comparison = variants[step.variant]
    return comparison


def undo_names(comparison: Comparison, names: Iterable[str]) -> Comparison:
    """The data without the conventions of some names, in the variants that fit best."""
    names = {*names}
    rows = tuple(k for k, row in enumerate(TABLE) if row.name in names)
    tried = [x for x in _try(*_choose_rows(comparison), [rows]) if x.names == names]
    return undo(comparison, min(tried, key=by_total).steps) if tried else comparison


def explain(comparison: Comparison) -> Judgement:
    """The conventions that explain the data clearly better than any others do."""
    some, begins = _choose_rows(comparison)
    base = next(_try(some, begins, [()]), Explanation((), np.zeros(1)))
    if base.first < NO_ERROR and max(np.max(x) for x in some.errors.values()) < NO_ERROR:
        base = base._replace(misfit=np.full_like(base.misfit, -6.5))  # however little it moves
    found, best, every = [base], base, range(INERTIA_ROW)
    often = [k for k in every if not TABLE[k].rare]

    def extend(those: Iterable[Explanation], rows: Iterable[int]) -> None:
        for each in those:
            used = {step.row: step.variant for step in each.steps}
            sets = [tuple(sorted((*used, k))) for k in rows if k not in used]
            found.extend(_try(some, begins, sets, used))

    for level in range(1, 2 if comparison.origin == "fitted" else 6):  # names at most
        if best.fits or (level > 2 and len(best.steps) < level - 1):
            break
        if level <= 2:
            found += _try(some, begins, combinations(every if level == 1 else often, level))
        extend(_rank(found)[: EXTENDED * (level > 1)], every)
        best = min(found, key=by_total)
    if not best.fits:  # an axis with the spin is undone by the ψ of the scene's A
        ranked = _rank(found)[:EXTENDED]
        extend([x for x in ranked if "axis-with-spin" not in x.names], [INERTIA_ROW])
    verdict = judge(found)
    doubtful = {step for step in verdict.best.steps if step.convention.doubtful}
    if any(verdict.sure.issuperset(step.names) for step in doubtful):  # does a number do the same?
        kept = tuple(step for step in verdict.best.steps if step not in doubtful)
        extend([x for x in _rank(found) if x.steps in ((), kept)], [NUMBER_ROW])
        verdict = judge(found)
    return verdict


def _rank(found: Iterable[Explanation]) -> list[Explanation]:
    """The explanations, each once, the best first."""
    return sorted({each.steps: each for each in found}.values(), key=by_total)


def _choose_rows(comparison: Comparison) -> tuple[Comparison, Any]:
    """The rows that conventions are tried on, and where their octaves begin."""
    size = comparison.t.size
    rows, begins = octaves(size)
    if comparison.given is None:  # the start follows from the rows
        rest = np.arange(200, size)  # the first 200, and of the others about 800
        rows = np.r_[: min(200, size), rest[:: rest.size // 800 + 1]]
        _, begins = octaves(rows.size, most=rows.size)
    return comparison.rows(rows), begins


def judge(found: Sequence[Explanation]) -> Judgement:
    """What is sure: the names that all explanations share that are not clearly worse."""
    base = found[0]
    usual = [x for x in found if (x.first < FIRST and not base.beats(x)) or x is base]
    named = min((x for x in usual if "another-number" not in x.names), key=by_total)
    if "inertia-about-centre" not in named.names:  # as no number is fitted, which gains a little
        fitted = "another-number"
        usual = [x for x in usual if fitted not in x.names or x.cost < named.cost or x.beats(named)]
    best, kept = min(usual, key=by_total), list[Explanation]()
    if not best.improves(base):
        return Judgement(base, frozenset(), (), found)
    for each in sorted(usual, key=lambda x: (x.cost, x.total)):
        if (each is named or not best.beats(each)) and not any(
            other.names == each.names
            or (other.names < each.names and not each.beats(other))
            or (other.cost < each.cost - 0.4 and (other.misfit < each.misfit + ALIKE).all())
            for other in kept
        ):
            kept.append(each)
    kept.sort(key=by_total)
    sure = frozenset.intersection(*(x.names for x in kept))
    chosen = next((x for x in kept if x.names == sure), kept[0])
    return Judgement(chosen, sure, tuple(kept) if len(kept) > 1 else (), found)


def _try(
    some: Comparison,
    begins: Any,
    sets: Iterable[tuple[int, ...]],
    fixed: Mapping[int, int] | None = None,
) -> Iterator[Explanation]:
    """What conventions make of the data, in every variant but those that are fixed."""
    for rows in sets:
        those = [TABLE[row] for row in rows]
        if sum(x.doubtful for x in those) > 2 or sum(x.physics for x in those) > 1:
            continue
        states: list[tuple[tuple[Undoing, ...], Comparison]] = [((), some)]
        for row, convention in zip(rows, those, strict=True):
            before, states = states, []
            for steps, data in before:
                with suppress(HeavyTopError):  # of a motion that does not exist
                    states.extend(
                        ((*steps, Undoing(row, k, x.words, convention.cost + x.cost)), x.data)
                        for k, x in enumerate(convention.undo(data))
                        if k == (fixed or {}).get(row, k)
                    )
        for steps, after in states:
            with suppress(HeavyTopError):
                # no fit reaches more than 6.5 decades
                yield Explanation(steps, np.maximum(decades(after, begins), -6.5), after.first)
