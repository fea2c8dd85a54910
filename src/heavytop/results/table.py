"""Rows and tables of results, and every way to show and store a table.

Symbols, units and formats of the columns are in `heavytop.scene.quantities`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

from heavytop.scene.quantities import Quantity, quantity_of
from heavytop.text import cut, printable

if TYPE_CHECKING:
    import pandas
    import xarray
    from rich.console import Console, ConsoleOptions, RenderableType

Fact = tuple[str, str]
FAIL: Final = "FAIL"  # the first cell of a claim that does not hold
ROW_STYLES: Final = {FAIL: "red"}
FOLDED_AT: Final = 40  # letters of a cell: a longer text is folded at a terminal
MOST_NAMED: Final = 100  # letters of names of rows, on one line
MOST_SHOWN_DIGITS, FEWEST_SHOWN_DIGITS = 12, 3  # of the numbers of a table at a terminal


class Row(dict[str, Any]):
    """A row of a table, or a part of a header: values by their names, also as attributes."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"{name!r}: there are {', '.join(self)}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]


def as_rows(value: Any) -> Any:
    """Return a value as JSON has it: mappings as rows, lists as tuples, None for nan and inf."""
    if hasattr(value, "_asdict"):  # a named tuple
        value = value._asdict()
    if isinstance(value, Mapping):
        return Row({name: as_rows(each) for name, each in value.items()})
    if isinstance(value, list | tuple):
        return tuple(map(as_rows, value))
    if value is None or isinstance(value, str | bool | int):
        return value
    number = float(value)
    return number if math.isfinite(number) else None


class Table(NamedTuple):
    """Some columns of some rows; numbers stay numbers until they are shown.

    Attributes
    ----------
    rows : sequence of mapping from str to value
    columns : sequence of str
        Keys of the rows, which are names of quantities in `heavytop.scene.quantities`.
    title : str
    meanings : mapping from str to Quantity
        The quantities of columns whose names mean something else elsewhere.
    left : int
        How many columns, the first ones, are aligned to the left.
    first : int or None
        How many rows are shown at a terminal.
    more : int
        How many rows are left out of `rows`.
    keys : sequence of str
        The columns that distinguish rows.
    """

    rows: Sequence[Mapping[str, Any]]
    columns: Sequence[str]
    title: str = ""
    meanings: Mapping[str, Quantity] = {}
    left: int = 1
    first: int | None = None
    more: int = 0
    keys: Sequence[str] = ()

    @classmethod
    def of_facts(cls, facts: Iterable[Fact]) -> Table:
        """Return labels and texts as a table without headings."""
        rows = [{"label": label, "text": text} for label, text in facts]
        headless = dict.fromkeys(("label", "text"), Quantity("", ""))
        return cls(rows, ("label", "text"), meanings=headless, left=2)

    @property
    def quantities(self) -> dict[str, Quantity]:
        """The quantities of the columns."""
        return {name: self.meanings.get(name) or quantity_of(name) for name in self.columns}

    @property
    def head(self) -> list[str]:
        """The headings of the columns."""
        return [of.heading for of in self.quantities.values()]

    def texts(self, digits: int = 17) -> list[list[str]]:
        """Return the cells of the rows as texts, with so many digits."""
        of = self.quantities
        return [[of[n].text(row.get(n), digits) for n in self.columns] for row in self.rows]

    @property
    def line(self) -> str:
        """The names of the rows, and the range of the numbers in each column, in a line.

        >>> rows = [{"method": "a", "energy": 1e-9}, {"method": "b", "energy": 1e-7}]
        >>> Table(rows, ("method", "energy")).line
        'a, b: energy 1e-09 to 1e-07'
        """
        of, words = self.quantities, []
        for name in self.columns[1:]:
            found = [x for row in self.rows if isinstance(x := row.get(name), int | float)]
            ends = [of[name].text(end(found), FEWEST_SHOWN_DIGITS) for end in (min, max) if found]
            words += [f"{of[name].heading} {' to '.join(dict.fromkeys(ends))}"] * bool(ends)
        names = ", ".join(dict.fromkeys(texts[0] for texts in self.texts(FEWEST_SHOWN_DIGITS)))
        return ": ".join(filter(None, (cut(names, MOST_NAMED), ", ".join(words))))

    @property
    def fails(self) -> bool:
        """Whether a row begins with FAIL."""
        return any(row.get(self.columns[0]) == FAIL for row in self.rows)

    @property
    def sides(self) -> list[Literal["left", "right"]]:
        """The side to which each column is aligned."""
        return ["left" if k < self.left else "right" for k in range(len(self.columns))]

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        """Yield the table; on a narrow terminal with fewer digits, then in several parts."""
        from rich.table import Table as Grid
        from rich.text import Text

        for digits in (*range(MOST_SHOWN_DIGITS, FEWEST_SHOWN_DIGITS - 1, -1), MOST_SHOWN_DIGITS):
            texts = [self.head, *self.texts(digits)[: self.first]]
            widths = [min(FOLDED_AT, max(map(len, x))) + 2 for x in zip(*texts, strict=True)]
            if sum(widths) <= options.max_width:
                break
        parts = [[0]]
        for k in range(1, len(widths)):
            if sum(widths[j] for j in (*parts[-1], k)) > options.max_width and len(parts[-1]) > 1:
                parts.append([0])
            parts[-1].append(k)
        yield from [Text(printable(self.title), style="cyan")] * bool(self.title)
        for part in parts:
            yield from [Text()] * (part is not parts[0])
            grid = Grid(box=None, pad_edge=False, header_style="cyan", show_header=any(self.head))
            for k in part:
                head = Text(printable(texts[0][k]))
                grid.add_column(head, justify=self.sides[k], overflow="fold", no_wrap=not k)
            for row in texts[1:]:
                cells = (Text(printable(row[k]), style=ROW_STYLES.get(row[k], "")) for k in part)
                grid.add_row(*cells)
            yield grid
        if more := self.more + len(self.rows) - len(texts[1:]):
            yield Text(f"… and {more} more")

    @property
    def html(self) -> str:
        """The table in HTML."""

        def line(tag: str, texts: Iterable[str]) -> str:
            cells = zip(self.sides, texts, strict=True)
            row = (f'<{tag} style="text-align:{x}">{escape(text)}</{tag}>' for x, text in cells)
            return f"<tr>{''.join(row)}</tr>"

        caption = f"<caption>{escape(self.title)}</caption>" if self.title else ""
        head = line("th", self.head) if any(self.head) else ""
        return f"<table>{caption}{head}{''.join(line('td', row) for row in self.texts())}</table>"

    @property
    def markdown(self) -> str:
        r"""The table in Markdown.

        Examples
        --------
        >>> print(Table([{"case": "a|b", "n": 2}], ("case", "n")).markdown)
        | case | n |
        | -- | --: |
        | a\|b | 2 |
        """
        rules = ["--" if side == "left" else "--:" for side in self.sides]
        lines = (self.head, rules, *self.texts())
        rows = ([" ".join(text.replace("|", "\\|").split()) for text in row] for row in lines)
        return "\n".join(f"| {' | '.join(row)} |" for row in rows)

    @property
    def csv(self) -> str:
        """The table as comma-separated values, with a header that has the units.

        >>> print(Table([{"t": 0.5, "kind": "loops"}], ("t", "kind")).csv, end="")
        t [s],kind
        0.5,loops
        """
        shown = {name: of.shown for name, of in self.quantities.items()}
        heads = {n: f"{n} [{unit}]" for n, (unit, _) in shown.items() if unit not in ("", "1")}
        frame = self._replace(keys=()).to_pandas()
        for name in frame.select_dtypes(float):
            frame[name] *= shown[name][1]
        return str(frame.rename(columns=heads).to_csv(index=False))

    def to_pandas(self) -> pandas.DataFrame:
        """Return the table as a DataFrame, with units and names in its attributes."""
        import pandas

        found = pandas.DataFrame([*self.rows], columns=[*self.columns]).infer_objects()
        found = found.astype({name: float for name in found if found[name].isna().all()})
        for key in ("units", "long_name"):
            found.attrs[key] = {name: of.attributes[key] for name, of in self.quantities.items()}
        return found.set_index([*self.keys]) if self.keys else found

    def to_xarray(self) -> xarray.Dataset:
        """Return the table as a Dataset over `keys`, nan where there is no row."""
        found: xarray.Dataset = self.to_pandas().to_xarray()
        for name, of in self.quantities.items():
            found[name].attrs = of.attributes
        found.attrs = {}
        return found
