"""The conventions that explain data best: candidates alone, in pairs, and on top of the best."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from heavytop.checking.comparison import FIRST, Comparison, Octaves, decades, octaves
from heavytop.checking.conventions import ANOTHER_MOTION, INERTIA, NUMBER, TABLE, cost
from heavytop.errors import HeavyTopError

CLEAR: Final = 0.5  # decades, mean of all octaves, by which one explanation beats another clearly
ALIKE: Final = 0.05  # decades: no better and no worse
LEAST_GAIN: Final = 0.7  # decades that all names together have to gain
MOST_MOTIONS: Final = 2  # names that another start may have as well
GOOD: Final = -1.0  # decades: what a convention makes better has to be better than this
FITTING: Final = -5.0  # decades: nothing is looked for
DEEPEST: Final = -6.5  # decades: no better is told from better still, nor reached by a fit
EXTENDED: Final = 6  # best explanations that further conventions are tried on
NEARLY: Final = 0.4  # of a name: explanations that cost so little more are as likely
MOST_NAMES: Final = 5
DENSE_ROWS: Final = 200  # the first, where the start is that of the data
MOST_ROWS: Final = 1000


class Undoing(NamedTuple):
    """A convention that is undone: its row in the table, which of its variants, words, cost."""

    row: int
    variant: int
    words: str
    cost: float

    @property
    def names(self) -> tuple[str, ...]:
        """Such as ``y-up``; two of what is undone at once."""
        return tuple(TABLE[self.row].name.split("+"))

    @property
    def sentence(self) -> str:
        """The same for a person."""
        return TABLE[self.row].sentence.format(self.words.strip())


class Explanation(NamedTuple):
    """Conventions, and how far off the data are without them, by quantity [decades].

    `first` is how far off their first row is [rad].
    """

    steps: tuple[Undoing, ...]
    misfit: dict[str, float]
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
        return sum(self.misfit.values()) + ALIKE * self.cost


class Judgement(NamedTuple):
    """The best explanation, the names that are sure, those that explain alike, and all gains."""

    best: Explanation
    sure: frozenset[str]
    alike: tuple[Explanation, ...]
    found: tuple[Explanation, ...]

    def gain(self, step: Undoing) -> float | None:
        """How many times smaller the misfit of everything is with a convention undone."""
        rest, best = self.best.names - {*step.names}, self.best.misfit
        without = [x for x in self.found if x.names == rest]
        if not without:
            return None
        other = min(without, key=_total).misfit
        return float(10 ** max(other.get(name, 0.0) - value for name, value in best.items()))


def undo(comparison: Comparison, what: Sequence[Undoing] | Sequence[str]) -> Comparison:
    """The data without some conventions: of names the variants that fit best."""
    steps: list[Undoing] = [each for each in what if isinstance(each, Undoing)]
    if names := [each for each in what if isinstance(each, str)]:
        rows = sorted(k for k, row in enumerate(TABLE) if row.name in names)
        some, windows = _some(comparison)
        tried = [x for x in _tried(some, [(*rows,)], windows) if x.names == {*names}]
        steps = [*min(tried, key=lambda x: x.total).steps] if tried else []
    for step in sorted(steps):
        variants = [undone for _, undone in TABLE[step.row].undo(comparison)]
        if step.variant < len(variants):
            comparison = variants[step.variant]
    return comparison


def explain(comparison: Comparison) -> Judgement:
    """The conventions that explain the data clearly better than any others do."""
    some, windows = _some(comparison)
    nothing = Explanation((), dict.fromkeys(("axis",), 0.0))
    base = next(_tried(some, [()], windows), nothing)
    found, best = [base], base
    every = [k for k in range(len(TABLE)) if k < INERTIA]
    often = [k for k in every if not TABLE[k].rare]
    for level in range(1, 2 if comparison.origin == "fitted" else MOST_NAMES + 1):
        if is_fitting(best) or (level > 2 and len(best.steps) < level - 1):
            break
        if level == 1:
            found += _tried(some, [(k,) for k in every], windows)
        elif level == 2:
            found += _tried(some, combinations(often, 2), windows)
        for each in _best(found)[: EXTENDED * (level > 1)]:
            found += _extended(some, each, every, windows)
        best = min(found, key=_total)
    if not is_fitting(best):
        for each in _best(found)[:EXTENDED]:
            if "axis-with-spin" not in each.names:  # which is undone by the ψ of the scene's A
                found += _extended(some, each, [INERTIA], windows)
    verdict = judge(found)
    if verdict.sure & ANOTHER_MOTION:  # or does another number do the same?
        kept = tuple(step for step in verdict.best.steps if not ANOTHER_MOTION & {*step.names})
        for each in [base, *(x for x in _best(found) if kept and x.steps == kept)]:
            found += _extended(some, each, [NUMBER], windows)
        verdict = judge(found)
    return verdict


def _best(found: Iterable[Explanation]) -> list[Explanation]:
    """The explanations, each once, the best first."""
    return sorted({each.steps: each for each in found}.values(), key=_total)


def is_fitting(explanation: Explanation) -> bool:
    """Whether nothing more is looked for."""
    return all(value < FITTING for value in explanation.misfit.values())


def _total(explanation: Explanation) -> float:
    return explanation.total


def _some(comparison: Comparison) -> tuple[Comparison, Octaves]:
    """The rows that conventions are tried on, and their octaves."""
    if comparison.given is None:
        rest = np.arange(DENSE_ROWS, comparison.data.t.size)
        rows = [*range(min(DENSE_ROWS, comparison.data.t.size)), *rest[:: rest.size // 800 + 1]]
        some = replace(comparison, data=comparison.data.rows(rows))
        return some, octaves(some.data.t.size)
    windows = octaves(comparison.data.t.size)
    return replace(comparison, data=comparison.data.rows(windows.rows)), windows


def judge(found: Sequence[Explanation]) -> Judgement:
    """What is sure: the names that all explanations share that are not clearly worse."""
    base = found[0]
    usual = [x for x in found if x.first < FIRST or x is base]
    fitted = {x.steps for x in usual if "another-number" in x.names}
    named = min((x for x in usual if x.steps not in fitted and not _better(base, x)), key=_total)
    if "inertia-about-centre" not in named.names:  # as no number is fitted, which gains a little
        fitted -= {x.steps for x in usual if x.cost < named.cost or _better(x, named)}
        usual = [x for x in usual if x.steps not in fitted]
    best = min((x for x in usual if not _better(base, x)), key=_total)
    alike = [x for x in usual if x is named or not (_better(base, x) or _better(best, x))]
    kept: list[Explanation] = []
    for each in sorted(alike, key=lambda x: (x.cost, x.total)):
        if not any(
            other.names == each.names
            or (other.names < each.names and not _better(each, other))
            or (other.cost < each.cost - NEARLY and _as_good(other, each))
            for other in kept
        ):
            kept.append(each)
    kept.sort(key=_total)
    if not _fits(best, base):
        return Judgement(base, frozenset(), (), (*found,))
    sure = frozenset.intersection(*(x.names for x in kept))
    chosen = next((x for x in kept if x.names == sure), kept[0])
    return Judgement(chosen, sure, tuple(kept) if len(kept) > 1 else (), (*found,))


def _fits(best: Explanation, base: Explanation) -> bool:
    """Whether it gains enough, and what it makes better is good then."""
    gains = {name: base.misfit.get(name, 0.0) - value for name, value in best.misfit.items()}
    better = [best.misfit[name] for name, gain in gains.items() if gain > CLEAR]
    return bool(better) and sum(gains.values()) > LEAST_GAIN and max(better) < GOOD


def _better(one: Explanation, other: Explanation) -> bool:
    """Whether one is clearly better than the other in anything."""
    return any(other.misfit.get(name, value) - value > CLEAR for name, value in one.misfit.items())


def _as_good(one: Explanation, other: Explanation) -> bool:
    return all(value < other.misfit.get(name, np.inf) + ALIKE for name, value in one.misfit.items())


def _extended(
    some: Comparison, each: Explanation, further: Iterable[int], windows: Octaves
) -> Iterator[Explanation]:
    """An explanation with one more convention."""
    used = {step.row: step.variant for step in each.steps}
    sets = [tuple(sorted((*used, k))) for k in further if k not in used]
    return _tried(some, sets, windows, used)


def _tried(
    some: Comparison,
    sets: Iterable[tuple[int, ...]],
    windows: Octaves,
    fixed: dict[int, int] | None = None,
) -> Iterator[Explanation]:
    """What conventions make of the data, in every variant but those that are fixed."""
    for rows in sets:
        motions = sum(TABLE[row].name in ANOTHER_MOTION for row in rows)
        if motions > MOST_MOTIONS or sum(TABLE[row].physics for row in rows) > 1:
            continue
        states: list[tuple[tuple[Undoing, ...], Comparison]] = [((), some)]
        for row in rows:
            states = [
                ((*steps, Undoing(row, k, words, cost(row, words))), after)
                for steps, before in states
                for k, (words, after) in enumerate(_variants(row, before))
                if k == (fixed or {}).get(row, k)
            ]
        for steps, after in states:
            try:
                misfit = {x: max(off, DEEPEST) for x, off in decades(after, windows).items()}
                yield Explanation(steps, misfit, after.first)
            except HeavyTopError:
                continue


def _variants(row: int, comparison: Comparison) -> Iterator[tuple[str, Comparison]]:
    """The variants of a row; none where the motion does not exist."""
    try:
        yield from TABLE[row].undo(comparison)
    except HeavyTopError:
        return
