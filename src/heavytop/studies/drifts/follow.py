"""Following one run from mark to mark, piece by piece, so that little is lost when it is killed."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any, Final

from heavytop.comparison.steppers import IntegrationFailed, StepperState
from heavytop.errors import ForeignFile
from heavytop.integration.bits import DOUBLE
from heavytop.numbers.double_double import DoubleDouble
from heavytop.studies.drifts import checked
from heavytop.studies.drifts.runs import Run, run
from heavytop.studies.drifts.study import Study
from heavytop.studies.ledger import Piece
from heavytop.studies.methods import Method

PIECE_S: Final = 0.5  # of work between two checkpoints


def tasks(identity: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of the runs of a study."""
    return Study.of(identity).tasks


def follow(
    identity: Mapping[str, Any], task: str, checkpoint: Mapping[str, Any] | None
) -> Iterator[Piece]:
    """Follow a run from its start, or from a checkpoint, in pieces of half a second.

    Parameters
    ----------
    identity : mapping
        Of the study.
    task : str
    checkpoint : mapping, optional

    Yields
    ------
    Piece
        Its rows are the marks it passed, every float as hexadecimal text.

    Raises
    ------
    ForeignFile
        No run like this one wrote the checkpoint.
    """
    study = Study.of(identity)
    method, scene = study.task(task)
    walk = _Walk(method, run(scene, method), study.marks(method))
    if checkpoint is not None:
        walk.restore(checkpoint)
    yield walk.piece()  # of a run at its end, an empty one that says so
    while not walk.done:
        yield walk.piece()


class _Walk:
    """A run under way."""

    def __init__(self, method: Method, found: Run, periods: tuple[float, ...]) -> None:
        self.method, self.run, self.periods = method, found, periods
        self.times = [found.march.output_time(n * found.period) for n in periods]
        self.place = found.march.begin()
        self.marked = 0
        self.ended = ""
        self.spent = 0.0

    @property
    def done(self) -> bool:
        """Whether every mark is passed, or none can be any more."""
        return bool(self.ended) or self.marked >= len(self.times)

    def restore(self, checkpoint: Mapping[str, Any]) -> None:
        """Go back to where a checkpoint was written."""
        self.place, self.marked = checked.under_way(
            checkpoint, self.method, self.run.period, self.times, self.place
        )
        place = self.place
        words = place.state if self.method.bits == DOUBLE else (*place.state, *place.carry)
        try:
            self.run.yardstick(place.time, words)
        except (ArithmeticError, TypeError, ValueError) as fault:
            raise ForeignFile(f"state: none of this top ({fault})") from None

    def piece(self) -> Piece:
        """Take blocks of steps for half a second, or to the end."""
        rows: list[dict[str, Any]] = []
        self.spent = 0.0
        while not self.done and self.spent < PIECE_S:
            try:
                after = self._block()
                rows += self._passed(after)
            except IntegrationFailed as news:
                self.ended = str(news)
                break
            self.place = after
        return Piece(self._checkpoint(), tuple(rows), self.done, self._fraction(), self.spent)

    def _block(self) -> StepperState:
        began = time.perf_counter()
        try:
            return self.run.march.block(self.place)
        finally:
            self.spent += time.perf_counter() - began

    def _passed(self, after: StepperState) -> list[dict[str, Any]]:
        """Return the rows of the marks in the block that leads to a place."""
        behind = [t for t in self.times[self.marked :] if _not_after(t, after.time)]
        if not behind:
            return []
        seen = self.run.march.states_at(self.place, behind).tolist()
        first = self.marked
        found = [
            self._row(first + k, t, row)
            for k, (t, row) in enumerate(zip(behind, seen, strict=True))
        ]
        self.marked += len(behind)
        return found

    def _row(self, k: int, t: DoubleDouble, row: list[float]) -> dict[str, Any]:
        off = asdict(self.run.yardstick(t, row))
        return {
            "periods": self.periods[k].hex(),
            "t": [word.hex() for word in t],
            "state": [word.hex() for word in row],
            **{name: _hexed(value) for name, value in off.items()},
        }

    def _checkpoint(self) -> dict[str, Any]:
        gone = self.place.time[0] / self.run.period
        return {
            "place": _written(self.place),
            "periods": gone.hex(),
            "marked": self.marked,
            "ended": self.ended,
        }

    def _fraction(self) -> float:
        return 1.0 if self.done else self.place.time[0] / self.times[-1][0]


def _not_after(t: DoubleDouble, end: DoubleDouble) -> bool:
    return t[0] < end[0] or (t[0] == end[0] and t[1] <= end[1])


def _hexed(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _hexed(each) for name, each in value.items()}
    if value is None:
        return None
    if not math.isfinite(value):
        raise IntegrationFailed("its errors are no longer finite")
    return float(value).hex()


def _written(place: StepperState) -> dict[str, Any]:
    words = ("time", "state", "carry")
    return {name: [x.hex() for x in getattr(place, name)] for name in words} | {
        "steps": place.steps,
        "evaluations": place.evaluations,
    }
