"""Exact values of a motion at given times, as decimals with every digit proved."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, Final

from heavytop.analytic.motion import Motion
from heavytop.analytic.refine import balls_in
from heavytop.errors import Fault, ForeignFile, Impossible, NotANumber, Refused, refuse
from heavytop.exact import Exact, Number
from heavytop.exact.balls import Interval
from heavytop.exact.number import rational
from heavytop.exact.parse import text_of
from heavytop.files import write_document, write_text
from heavytop.scene import arguments
from heavytop.scene.arguments import Range, Reader, one_of, parse_names, parse_options
from heavytop.scene.quantities import QUANTITIES, Need, columns_of, component_names, wanted
from heavytop.scene.scene import Scene, expect_scene
from heavytop.scene.scene_file import EVENTS

REFERENCE_SCHEMA: Final = "heavytop/reference/1"
MOST_TIMES: Final = 1_000_000
MOST_EVENTS: Final = 100_000
MOST_PRINTED_DIGITS: Final = 4000  # Python prints integers of 4300
UNSPUN: Final = {"theta", "phi", "axis"}  # the quantities of a point mass
PROVED_DIGITS: Final = 3  # beyond the printed ones: the last one is off by its rounding alone

# for each quantity the headings of its columns, and the names of their values in a record
EVENT_QUANTITIES: Final[Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]]] = {
    name: (component_names(columns_of(name)), columns_of(name))
    for name in (*wanted(), "omega")
    if QUANTITIES[name].need > Need.NOTHING and QUANTITIES[name].of is None
}


@dataclass(frozen=True, slots=True)
class Reference:
    """Exact values of a motion: decimals within one unit of their last digit of the truth.

    Parameters
    ----------
    scene : Scene
        Its top and its start.
    digits : int
        Digits of every number, before and after the decimal point; below 1 only those after it.
        Whole numbers of more digits keep all of them.
    columns : mapping from str to tuple of str
        Decimal texts by the name of the column; ``t`` [s] has the exact times.
    events : tuple of (str, str)
        Turning points, reversals and cusps between the first time and the last: kind, time [s].

    Notes
    -----
    Accuracy: by proof, as of `Motion.interval`; ``tests/analytic/test_reference.py`` holds every
    digit to a computation with many more.

    References
    ----------
    As of `Motion`.
    """

    scene: Scene
    digits: int
    columns: Mapping[str, tuple[str, ...]] = field(repr=False)
    events: tuple[tuple[str, str], ...] = field(default=(), repr=False)

    def __str__(self) -> str:
        return self.to_csv()

    def to_csv(self) -> str:
        """The columns as comma-separated values, with a header."""
        text = io.StringIO()
        rows = self.columns, *zip(*self.columns.values(), strict=True)
        csv.writer(text, lineterminator="\n").writerows(rows)
        return text.getvalue()

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the values whole, to a file of JSON whose name ends in ``.json``, or to one of CSV.

        Parameters
        ----------
        path : path
        """
        place = arguments.path_of("path", path)
        if place.suffix.lower() == ".json":
            write_document(place, self.document())
        else:
            write_text(place, self.to_csv())

    def document(self) -> dict[str, Any]:
        """The document of the schema ``heavytop/reference/1``."""
        return {
            "schema": REFERENCE_SCHEMA,
            "scene": self.scene.problem(),
            "digits": self.digits,
            "columns": {name: list(texts) for name, texts in self.columns.items()},
            "events": [{"kind": kind, "t": t} for kind, t in self.events],
        }


def reference(
    scene: Scene,
    times: str | Sequence[Number],
    quantities: Sequence[str] = ("theta", "phi", "psi"),
    digits: int = 20,
    events: Sequence[str] = (),
) -> Reference:
    """Exact values of the motion of a scene, every printed digit proved (the last one ± 1).

    Parameters
    ----------
    scene : Scene
        Its top and its start; its span and its wants are not used.
    times : str or sequence of number
        ``"A:B:STEP"`` from A to B [s], or the times themselves: floats mean their binary value,
        texts are decimals.
    quantities : sequence of str
        Any of theta, phi, psi, rates, axis, attitude, omega (in space).
    digits : int
        Digits of every number: in front of the point and behind it; behind it alone below 1.
    events : sequence of str
        Any of turning, reversal, cusp: their times between the first time and the last.

    Returns
    -------
    Reference

    Raises
    ------
    BadScene
        A quantity or event is unknown; digits or times are out of bounds. Every fault is listed.
    Impossible
        There are too many events between the times.
    Unseparated
        A number is neither separated from 0 nor proved to be 0.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> exact = reference(load_scene("sicm-kicked"), "0:2:1", ["theta", "phi"], digits=12)
    >>> print(exact.to_csv())
    t,theta,phi
    0,0.100000000000,0.000000000000
    1,0.248584103212,8.05620392264
    2,0.426943705310,15.1169640955
    <BLANKLINE>

    Notes
    -----
    Accuracy: by proof, as of `Motion.interval`; ``tests/analytic/test_reference.py`` holds every
    digit to a computation with many more.

    References
    ----------
    As of `Motion`.
    """
    exact, digits, wanted, kinds = read_request(scene, times, quantities, digits, events)
    motion = Motion(scene.top, scene.start)
    motion.require_proof()
    names = [name for _, names in wanted for name in names]
    cells = [
        [Interval.of(x).rounded(digits) for name in names for x in balls_in(number(name))]
        for number in (motion.reader(t, digits + PROVED_DIGITS) for t in exact)
    ]
    header = (column for columns, _ in wanted for column in columns)
    columns = {"t": tuple(map(exact_text, exact))}
    columns |= dict(zip(header, zip(*cells, strict=True), strict=True))
    happened: list[tuple[str, str]] = []
    for kind, first, last in ((kind, min(exact), max(exact)) for kind in kinds):
        found = motion.events(kind)
        if found.count(first, last) > MOST_EVENTS:
            rule = f"at most {MOST_EVENTS} events of a kind between the first time and the last"
            raise Impossible([("events", rule)])
        balls = found.times(first, last, digits + PROVED_DIGITS)
        happened += [(kind, Interval.of(t).rounded(digits)) for t in balls]
    return Reference(scene, digits, columns, tuple(happened))


def read_request(
    scene: Scene, times: Any, quantities: Sequence[str], digits: int, events: Sequence[str]
) -> tuple[tuple[Fraction, ...], int, list[Any], list[str]]:
    """The arguments of `reference`, read: times, digits, quantities, kinds of events."""
    expect_scene(scene)
    file = scene.name
    digits_read = Range(2, MOST_PRINTED_DIGITS, whole=True)
    readers: dict[str, Reader] = {"times": times_of, "digits": digits_read}
    options, wrong = parse_options(file, {"times": times, "digits": digits}, readers)
    wanted, unknown = parse_names(file, "quantities", quantities, one_of(EVENT_QUANTITIES))
    kinds, strange = parse_names(file, "events", events, one_of({x: x for x in EVENTS}), least=0)
    if scene.top.C == 0 and not (wrong or unknown) and (spun := {*quantities} - UNSPUN):
        rule = f"a point mass (C = 0) has no {' and no '.join(sorted(spun))}"
        strange = [*strange, Fault(file, None, "quantities", ", ".join(quantities), rule)]
    refuse(wrong, unknown, strange)
    return options["times"], options["digits"], wanted, kinds


def times_of(times: object) -> tuple[Fraction, ...]:
    """The exact times that ``A:B:STEP`` or a sequence of numbers stands for.

    Examples
    --------
    >>> [exact_text(t) for t in times_of("0:1:0.25")], exact_text(Fraction(1, 3))
    (['0', '0.25', '0.5', '0.75', '1'], '1/3')
    """
    items = arguments.items_of(times.split(":") if isinstance(times, str) else times)
    if items is None:
        raise Refused("A:B:STEP, or a sequence of numbers")
    found = tuple(map(_time, items))
    if isinstance(times, str):
        if len(found) != 3:
            raise Refused("A:B:STEP, three decimal numbers in seconds")
        start, end, step = found
        if not step or (end - start) / step < 0:
            raise Refused("A:B:STEP, a step that leads from A to B")
        last = int((end - start) / step)
        found = tuple(start + k * step for k in range(last + 1 if last < MOST_TIMES else 0))
    if not 0 < len(found) <= MOST_TIMES:
        raise Refused(f"from 1 to {MOST_TIMES} times")
    return found


def _time(value: Any) -> Fraction:
    """A time [s]: a decimal text, or a number by its exact value."""
    try:
        exact = Exact.of(Decimal(value) if isinstance(value, str) else value).fraction
    except (NotANumber, ArithmeticError):
        exact = None
    if exact is None:
        raise Refused(f"numbers or decimal texts in seconds, not {arguments.value_text(value)}")
    return exact


def read_times(text: str) -> str | list[str]:
    """The times that an option names: ``A:B:STEP``, a list, or a file whose column ``t`` has them.

    >>> read_times("0.5,2")
    ['0.5', '2']

    Raises
    ------
    ForeignFile
        The file is not readable, or has no such column.
    """
    if ":" in text:
        return text
    with suppress(Refused):
        times_of(times := text.split(","))
        return times
    try:
        with Path(text).open("rb") as file:
            lines = file.read().decode("utf-8-sig").splitlines()
        header, *rows = csv.reader(filter(str.strip, lines), strict=True)
        return [*dict(zip(header, zip(*rows, strict=True), strict=True))["t"]]
    except OSError as fault:
        why = f"neither times, as 1,2.5 or 0:10:0.01, nor a file ({fault.strerror or fault})"
        raise ForeignFile(f"{text}: {why}") from None
    except (ValueError, LookupError, csv.Error):
        why = "a CSV file with a column t is expected, and no comma in a number"
        raise ForeignFile(f"{text}: {why}") from None


def exact_text(x: Fraction) -> str:
    """A rational number as a finite decimal, where there is one; else as a fraction."""
    text = text_of(rational(x))
    return text if "/" in text else f"{Decimal(text):f}"
