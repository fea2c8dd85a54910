"""The search for conventions that explain data: alone, in pairs, and added to the best ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import combinations
from operator import attrgetter
from typing import Any, Final, NamedTuple

import numpy as np

from heavytop.checking.comparison import FIRST_ERROR, LEAST_MOTION, Comparison, decades, octaves
from heavytop.checking.conventions import INERTIA_ROW, NUMBER_ROW, TABLE, Convention
from heavytop.errors import HeavyTopError

# decades, mean of all octaves, by which the misfit of a clearly better explanation is smaller
CLEAR_BY: Final = 0.5
ALIKE: Final = 0.05  # decades that make no difference
EXTENDED: Final = 6  # best explanations to which further conventions are added
LEAST_MISFIT: Final = -6.5  # decades: no fit is better

by_total: Final = attrgetter("total")


class Undoing(NamedTuple):
    """An undone convention: its row in the table, the number of its variant, words, cost."""

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
        """Its name, such as ``y-up``; two names of a row that undoes two at once."""
        return tuple(self.convention.name.split("+"))

    @property
    def sentence(self) -> str:
        """The convention for a person."""
        return self.convention.sentence.format(self.words)


class Explanation(NamedTuple):
    """Conventions, and the misfit of each quantity without them [decades].

    `first_error` is the error of the first row [rad].
    """

    steps: tuple[Undoing, ...]
    misfit: Any
    first_error: float = 0.0

    @property
    def names(self) -> frozenset[str]:
        """The names of its conventions."""
        return frozenset(name for step in self.steps for name in step.names)

    @property
    def cost(self) -> float:
        """The sum of the costs of its conventions, about 1 for each."""
        return sum(step.cost for step in self.steps)

    @property
    def total(self) -> float:
        """The misfit of all quantities together, plus a little for each convention."""
        return float(self.misfit.sum()) + ALIKE * self.cost

    @property
    def fits(self) -> bool:
        """Whether it fits to five digits, so that the search ends."""
        return bool((self.misfit < -5).all())

    def beats(self, other: Explanation) -> bool:
        """Whether it is clearly better than another in some quantity.

        Of another motion or another clock the worst quantity must be better: in some quantity the
        error of an integrator may look like theirs.
        """
        new = (step for step in self.steps if not other.names.issuperset(step.names))
        if any(step.convention.is_global for step in new):
            return bool(other.misfit.max() - self.misfit.max() > CLEAR_BY)
        return bool((other.misfit - self.misfit > CLEAR_BY).any())

    def improves(self, base: Explanation) -> bool:
        """Whether it gains 0.7 decades, and the quantities that it improves then fit to a tenth."""
        gains = base.misfit - self.misfit
        good = (self.misfit[gains > CLEAR_BY] < -1).all()
        return bool(self.beats(base) and good and gains.sum() > 0.7)


class Judgement(NamedTuple):
    """The best explanation, the sure names, the explanations as good as it, and all tried."""

    best: Explanation
    sure: frozenset[str]
    alike: tuple[Explanation, ...]
    found: Sequence[Explanation]

    def gain(self, step: Undoing) -> float | None:
        """The largest factor by which undoing a convention reduces the misfit of a quantity."""
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
    tried = [x for x in _try_sets(*_choose_rows(comparison), [rows]) if x.names == names]
    return undo(comparison, min(tried, key=by_total).steps) if tried else comparison


def explain(comparison: Comparison) -> Judgement:
    """The conventions that explain the data clearly better than any others."""
    some, begins = _choose_rows(comparison)
    base = next(_try_sets(some, begins, [()]), Explanation((), np.zeros(1)))
    found, best, every = [base], base, range(INERTIA_ROW)
    often = [k for k in every if not TABLE[k].rare]

    def extend(explanations: Iterable[Explanation], rows: Iterable[int]) -> None:
        for each in explanations:
            used = {step.row: step.variant for step in each.steps}
            sets = [tuple(sorted((*used, k))) for k in rows if k not in used]
            found.extend(_try_sets(some, begins, sets, used))

    for level in range(1, 2 if comparison.origin == "fitted" else 6):  # at most so many names
        if best.fits or (level > 2 and len(best.steps) < level - 1):
            break
        if level <= 2:
            found += _try_sets(some, begins, combinations(every if level == 1 else often, level))
        extend(_rank(found)[: EXTENDED * (level > 1)], every)
        best = min(found, key=by_total)
    if not best.fits:  # an axis with the spin is undone by the ψ of the scene's A
        ranked = _rank(found)[:EXTENDED]
        extend([x for x in ranked if "axis-with-spin" not in x.names], [INERTIA_ROW])
    verdict = judge(found)
    doubtful = {step for step in verdict.best.steps if step.convention.doubtful}
    if any(verdict.sure.issuperset(step.names) for step in doubtful):  # is it another number?
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
        rest = np.arange(200, size)  # the first 200 rows, and about 800 of the others
        rows = np.r_[: min(200, size), rest[:: rest.size // 800 + 1]]
        _, begins = octaves(rows.size, most=rows.size)
    return comparison.rows(rows), begins


def judge(found: Sequence[Explanation]) -> Judgement:
    """The judgement: names are sure that all explanations share that are not clearly worse."""
    base = found[0]
    usual = [x for x in found if (x.first_error < FIRST_ERROR and not base.beats(x)) or x is base]
    named = min((x for x in usual if "another-number" not in x.names), key=by_total)
    if "inertia-about-centre" not in named.names:  # no number was fitted; a fit gains a little
        fit = "another-number"
        usual = [x for x in usual if fit not in x.names or x.cost <= named.cost or x.beats(named)]
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


def _try_sets(
    some: Comparison,
    begins: Any,
    sets: Iterable[tuple[int, ...]],
    fixed: Mapping[int, int] | None = None,
) -> Iterator[Explanation]:
    """Yield the explanations by sets of rows of the table, in all variants, or in `fixed` ones."""
    for rows in sets:
        conventions = [TABLE[row] for row in rows]
        if sum(x.doubtful for x in conventions) > 2 or sum(x.physics for x in conventions) > 1:
            continue
        states: list[tuple[tuple[Undoing, ...], Comparison]] = [((), some)]
        for row, convention in zip(rows, conventions, strict=True):
            before, states = states, []
            for steps, data in before:
                with suppress(HeavyTopError):  # the motion does not exist
                    states.extend(
                        ((*steps, Undoing(row, k, x.words, convention.cost + x.cost)), x.data)
                        for k, x in enumerate(convention.undo(data))
                        if k == (fixed or {}).get(row, k)
                    )
        for steps, after in states:
            with suppress(HeavyTopError):
                misfit = decades(after, begins, LEAST_MOTION if steps else 0.0)
                yield Explanation(steps, np.maximum(misfit, LEAST_MISFIT), after.first_error)
