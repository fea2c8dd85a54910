"""Tables on a page: numbers as texts, to sensible digits."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

MOST_ROWS: Final = 60  # of a table on the page; the data have all of them
MISSING: Final = "–"
FAIL: Final = "FAIL"  # how the row of a claim begins that does not hold
DIGITS: Final = 6
WHOLE: Final = 1e9  # whole numbers are spelt in full below it


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of texts; of long ones, rows that are evenly spaced, and how many there are."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    all_rows: int
    every: int = 1  # of so many rows one is there

    @classmethod
    def of(
        cls, columns: Mapping[str, Sequence[Any]], most: int = MOST_ROWS, digits: int = DIGITS
    ) -> Table:
        """The table of columns of equal length.

        Examples
        --------
        >>> Table.of({"t": [0.0, 1 / 3], "kind": ["cusp", None]}).rows
        (('0', 'cusp'), ('0.333333', '–'))
        """
        count = max(map(len, columns.values()), default=0)
        every = max(1, -(-count // most))
        cells = ([cell(value, digits) for value in c[::every]] for c in columns.values())
        return cls(tuple(columns), tuple(zip(*cells, strict=True)), count, every)

    @classmethod
    def of_rows(
        cls, rows: Sequence[Mapping[str, Any]], most: int = MOST_ROWS, digits: int = DIGITS
    ) -> Table:
        """The table of rows with the same names; a column in which there is nothing is left out.

        Examples
        --------
        >>> Table.of_rows([{"t": 0, "why": None}, {"t": 1, "why": None}]).head
        ('t',)
        """
        names = [
            name for name in (rows[0] if rows else ()) if any(r[name] is not None for r in rows)
        ]
        return cls.of({name: [row[name] for row in rows] for name in names}, most, digits)

    def parted(self, name: str) -> Iterator[tuple[str, Table]]:
        """The rows with one value in a column together, each part without that column.

        Examples
        --------
        >>> whole = Table.of({"verdict": ["hold", "FAIL"], "whose": ["Euler", "Euler"]})
        >>> [(value, part.counted) for value, part in whole.parted("whose")]
        [('Euler', '1 hold, 1 FAIL')]
        """
        at = self.head.index(name)
        rows: dict[str, list[tuple[str, ...]]] = {}
        for row in self.rows:
            rows.setdefault(row[at], []).append(row[:at] + row[at + 1 :])
        for value, some in rows.items():
            head = self.head[:at] + self.head[at + 1 :]
            yield value, Table(head, tuple(some), len(some))

    @property
    def counted(self) -> str:
        """How many rows begin with each word."""
        words = Counter(row[0].split(":")[0] for row in self.rows)
        return ", ".join(f"{count} {word}" for word, count in words.items())

    @property
    def fails(self) -> bool:
        """Whether a row begins with FAIL."""
        return any(row[0] == FAIL for row in self.rows)


def cell(value: Any, digits: int = DIGITS) -> str:
    """A value to so many digits; a whole number, a text or a decimal of many digits as it is.

    Examples
    --------
    >>> cell(2 / 3e7, 2), cell(5280.0, 2), cell(172.6, 2), cell(None)
    ('6.7e-8', '5280', '170', '–')
    """
    if value is None or value != value:
        return MISSING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int | float):
        return shown(value, digits)
    words = str(value)
    return words if len(words) <= 300 else f"{words[:299]}…"


def amount(count: int, thing: str) -> str:
    """So many things.

    Examples
    --------
    >>> amount(1, "result"), amount(2, "result")
    ('1 result', '2 results')
    """
    return f"{count} {thing}{'' if count == 1 else 's'}"


def rounded(known: Mapping[str, Any], digits: int = DIGITS) -> dict[str, Any]:
    """What is known, its floats to so many digits; a decimal of more keeps those asked for.

    Examples
    --------
    >>> rounded({"period": 2 / 3, "precession": "0.66666666666666666667"})
    {'period': 0.666667, 'precession': '0.66666666666666666667'}
    """
    return {
        name: float(f"{x:.{digits}g}") if isinstance(x, float) else x for name, x in known.items()
    }


def shown(value: float, digits: int = DIGITS) -> str:
    """A number to so many digits; one that is whole, and not long, as it is."""
    if abs(value) < WHOLE and value == int(value):
        return f"{value + 0:.0f}"
    text = f"{value:.{digits}g}"
    if "e+" in text and abs(value) < WHOLE:
        return f"{float(text):.0f}"
    return re.sub(r"e([+-])0*(\d)", r"e\1\2", text).replace("e+", "e")
