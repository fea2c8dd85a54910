"""What the files of a study say, held against what a study writes there: nothing is believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import isclose
from typing import Any, Final

from heavytop.comparison.steppers import StepperState
from heavytop.errors import ForeignFile
from heavytop.numbers.double_double import DoubleDouble
from heavytop.studies import recorded
from heavytop.studies.drifts.yardstick import Off
from heavytop.studies.ledger import Book
from heavytop.studies.methods import TOLERANCE, Method

MOST: Final = 2**63 - 1
CHECKPOINT: Final = ("place", "periods", "marked", "ended")
PLACE: Final = ("time", "state", "carry", "steps", "evaluations")
ROW: Final = ("periods", "t", "state", *(each.name for each in fields(Off)))


@dataclass(frozen=True, slots=True)
class Ended:
    """One run at its end.

    Attributes
    ----------
    rows : tuple of dict
        The marks that it passed.
    periods : float
        How far it went.
    steps : int
    ended : str
        Why it ended early; empty where it did not.
    """

    rows: tuple[dict[str, Any], ...]
    periods: float
    steps: int
    ended: str


def under_way(
    found: object, method: Method, period: float, times: Sequence[DoubleDouble], begun: StepperState
) -> tuple[StepperState, int]:
    """Return where a run goes on, and how many marks it has passed.

    Parameters
    ----------
    found : object
        The checkpoint, as it was read.
    method : Method
    period : float
        Of the run's nutation [s].
    times : sequence of DoubleDouble
        Of the marks.
    begun : StepperState
        Where the run began.

    Raises
    ------
    ForeignFile
        No run of this method that is under way can have written it.
    """
    document = recorded.table("checkpoint", found, CHECKPOINT)
    place = _place(document["place"], begun)
    _in_step(method, period, place)
    marked = recorded.whole("marked", document["marked"], 0, len(times))
    passed = sum(t <= place.time for t in times)
    if marked != passed:
        raise recorded.refused(
            "marked", marked, f"at {place.time[0]:g} s the run has passed {passed}"
        )
    if recorded.text("ended", document["ended"]):
        raise recorded.refused("ended", document["ended"], "the run is said not to be done")
    return place, marked


def _place(found: object, begun: StepperState) -> StepperState:
    document = recorded.table("place", found, PLACE)
    high, low = recorded.words("time", document["time"], 2)
    if high < 0 or high + low != high:
        raise recorded.refused("time", document["time"], "expected a double-double from 0")
    carried = len(begun.carry)
    place = StepperState(
        (high, low),
        recorded.words("state", document["state"], len(begun.state)),
        recorded.words("carry", document["carry"], *((carried,) if carried else (0, 1))),
        recorded.whole("steps", document["steps"], 0),
        recorded.whole("evaluations", document["evaluations"], 0),
    )
    if not carried and place.carry and not place.carry[0] > 0:
        raise recorded.refused("carry", document["carry"], "expected the length of a step")
    return place


def _in_step(method: Method, period: float, place: StepperState) -> None:
    """Refuse a time at which a method of fixed step is not after so many steps."""
    if method.set_by == TOLERANCE:
        return
    if not isclose(place.time[0] * method.setting, place.steps * period, rel_tol=1e-13):
        raise recorded.refused("steps", place.steps, f"not those of {place.time[0]:g} s")


def runs(book: Book, tasks: Sequence[str], marks: Sequence[float]) -> tuple[Ended, ...]:
    """Return the runs of a method, all at their end.

    Raises
    ------
    ForeignFile
        Rows or a last checkpoint are not what such a run writes.
    """
    found = tuple(_run(book, task, marks) for task in tasks)
    named = [(task, row) for task, run in zip(tasks, found, strict=True) for row in run.rows]
    for task, row in named:
        if row["invariants"].keys() != named[0][1]["invariants"].keys():
            raise ForeignFile(f"{book.origin(task)}: invariants: not those of the other rows")
    return found


def _run(book: Book, task: str, marks: Sequence[float]) -> Ended:
    rows = []
    for k, row in enumerate(book.rows(task)):
        with recorded.naming(book.origin(task, k)):
            rows.append(_row(row, k, marks))
    with recorded.naming(book.origin(task)):
        return _at_end(book.entry(task).checkpoint, tuple(rows), marks)


def _row(found: object, k: int, marks: Sequence[float]) -> dict[str, Any]:
    row = dict(recorded.table(f"row {k}", found, ROW))
    if k >= len(marks) or recorded.word("periods", row["periods"]) != marks[k]:
        raise recorded.refused("periods", row["periods"], f"not that of mark {k}")
    recorded.words("t", row["t"], 2)
    errors = {**recorded.table("invariants", row["invariants"], ()), "energy": row["energy"]}
    for name, error in {**errors, "phase_s": row["phase_s"]}.items():
        recorded.word(name, error)
    if row["axis"] is not None:
        recorded.word("axis", row["axis"])
    return row


def _at_end(found: object, rows: tuple[dict[str, Any], ...], marks: Sequence[float]) -> Ended:
    document = recorded.table("checkpoint", found, CHECKPOINT)
    place = recorded.table("place", document["place"], PLACE)
    ended = recorded.text("ended", document["ended"])
    marked = recorded.whole("marked", document["marked"], 0, len(marks))
    if marked != len(rows):
        raise recorded.refused("marked", marked, f"there are {len(rows)} rows")
    if not ended and marked != len(marks):
        raise recorded.refused("marked", marked, f"a run at its end has passed {len(marks)}")
    periods = recorded.word("periods", document["periods"])
    if periods < 0:
        raise recorded.refused("periods", document["periods"], "expected a number from 0")
    return Ended(rows, periods, recorded.whole("steps", place["steps"], 0), ended)
