"""What a result says, as facts and tables of texts; and these at a terminal, and in Markdown."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping
from contextvars import ContextVar
from decimal import ROUND_CEILING, Context
from typing import Any, Final, NamedTuple, TypeAlias

from rich.console import Console, ConsoleOptions, Group, RenderableType
from rich.measure import Measurement
from rich.table import Table as Grid
from rich.text import Text

from heavytop.exact.parse import UNITS
from heavytop.scene.quantities import SI, Units, scaled

Known: TypeAlias = Mapping[str, Any]
Row: TypeAlias = tuple[str, ...]

MISSING: Final = "–"
FAIL: Final = "FAIL"  # how the row of a claim begins that does not hold

SYMBOLS: Final = {
    "t": ("t", "s"), "A": ("A", "kg m²"), "C": ("C", "kg m²"), "gMR": ("gMR", "J"),
    "theta": ("θ", "rad"), "phi": ("φ", "rad"), "psi": ("ψ", "rad"), "thetadot": ("θ̇", "rad/s"),
    "phidot": ("φ̇", "rad/s"), "psidot": ("ψ̇", "rad/s"), "omega3": ("ω₃", "rad/s"),
    "rate": ("φ̇", "rad/s"), "p_phi": ("p_φ", "kg m²/s"), "p_psi": ("p_ψ", "kg m²/s"),
    "E": ("E", "J"), "E_prime": ("E′", "J"), "potential": ("potential", "J"),
    "theta_min": ("least θ", "rad"), "theta_max": ("greatest θ", "rad"), "phase_s": ("phase", "s"),
    "axis": ("axis", "rad"), "us_per_period": ("time of a period", "µs"),
    "period": ("period", "s"), "round": ("once round", "s"), "amplitude": ("amplitude", "rad"),
    "precession": ("Δφ per period", "rad"),
    "spin": ("Δψ per period", "rad"), "residual": ("residual", "rad/s"),
}  # fmt: skip
"""By the name of a quantity in a document: its symbol, and its unit."""


SHOWN: Final[ContextVar[Units]] = ContextVar("units", default=SI)
"""The units that people asked for, in place of those of SI."""


class Table(NamedTuple):
    """Texts in rows: columns below headings, or without headings facts, a label and what it says.

    Attributes
    ----------
    head : tuple of str
    rows : tuple of tuple of str
    title : str
    left : int
        Of so many columns at the left the texts are not aligned to the right.
    first : int or None
        So many rows suffice at a terminal.
    more : int
        How many rows there are beside.
    """

    head: Row
    rows: tuple[Row, ...]
    title: str = ""
    left: int = 1
    first: int | None = None
    more: int = 0

    @property
    def fails(self) -> bool:
        """Whether a row begins with FAIL."""
        return any(row[0] == FAIL for row in self.rows)

    @property
    def markdown(self) -> str:
        r"""The table in Markdown.

        Examples
        --------
        >>> print(Table(("kind", "n"), (("a|b", "2"),)).markdown)
        | kind | n |
        | -- | --: |
        | a\|b | 2 |
        """
        rules = ["--" if k < self.left else "--:" for k in range(len(self.head))]
        rows = (
            [" ".join(text.replace("|", "\\|").split()) for text in row]
            for row in (self.head, rules, *self.rows)
        )
        return "\n".join(f"| {' | '.join(row)} |" for row in rows)

    def __rich__(self) -> Group:
        return _stacked([self])


class Fitting(NamedTuple):
    """Forms of the same tables, the best first: a terminal shows the first that is no wider."""

    forms: tuple[tuple[Table, ...], ...]

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        anywhere = options.update_width(sys.maxsize)
        for form in map(_stacked, self.forms):
            if Measurement.get(console, anywhere, form).maximum <= options.max_width:
                break
        yield form


Part: TypeAlias = Table | Fitting | str
Line: TypeAlias = Row | Part
"""A part, or a single fact: a label and what it says."""


def facts(rows: Iterable[Row]) -> Table:
    """Labels, and what they say."""
    return Table((), tuple(rows))


# --- at a terminal ------------------------------------------------------------------------------


def printed(parts: Iterable[Part], heading: str) -> RenderableType:
    """Parts below a heading, if there is one; nothing in them is taken for markup of rich."""
    found: list[RenderableType] = [Text(heading, style="bold")] if heading else []
    for k, part in enumerate(parts):
        found += [Text()] * (k > 0)
        found.append(Text(part, style="bold") if isinstance(part, str) else part)
    return Group(*found)


def _stacked(tables: Iterable[Table]) -> Group:
    found: list[RenderableType] = []
    for each in tables:
        found += [Text()] * bool(found) + [Text(each.title, style="cyan")] * bool(each.title)
        found.append(_grid(each))
        if more := each.more + len(each.rows) - len(each.rows[: each.first]):
            found.append(Text(f"… and {more} more"))
    return Group(*found)


def _grid(table: Table) -> Grid:
    """A table of rich; what is too wide is folded, not cut."""
    grid = Grid(box=None, pad_edge=False, header_style="cyan", show_header=bool(table.head))
    if not table.head:
        grid.add_column(style="cyan", no_wrap=True)
        grid.add_column(overflow="fold")
    for at, heading in enumerate(table.head):
        left = at < table.left
        grid.add_column(Text(heading), justify="left" if left else "right", overflow="fold")
    for row in table.rows[: table.first]:
        grid.add_row(*(Text(text, style="red" if text == FAIL else "") for text in row))
    return grid


# --- values as texts ----------------------------------------------------------------------------


def number(value: Any, digits: int = 12) -> str:
    """A number to so many digits; a decimal text as it is.

    Examples
    --------
    >>> number(2 / 3, 3), number("0.66666666666666666667"), number(None)
    ('0.667', '0.66666666666666666667', '–')
    """
    if value is None:
        return MISSING
    if isinstance(value, list | tuple):
        return f"[{', '.join(number(each, digits) for each in value)}]"
    return value if isinstance(value, str) else f"{value:.{digits}g}"


def short(value: Any) -> str:
    """A value to 3 digits."""
    return MISSING if value is None else f"{float(value):.3g}"


def size(error: float | None) -> str:
    """An error to two digits."""
    return MISSING if error is None else f"{error:.1e}"


def at_most(bound: float) -> str:
    """A proved bound to two digits, rounded up."""
    return size(float(Context(prec=2, rounding=ROUND_CEILING).create_decimal_from_float(bound)))


def headed(name: str) -> str:
    """The heading of a column: the symbol of a quantity with its unit, else its name in words."""
    if name in SYMBOLS:
        return f"{SYMBOLS[name][0]} [{shown_unit(name)}]"
    return name.replace("_", " ")


def shown_unit(name: str) -> str:
    """The unit in which a quantity is shown."""
    return scaled(SYMBOLS[name][1], SHOWN.get())[0]


def in_units(name: str, value: Any) -> Any:
    """A value in the unit in which its quantity is shown."""
    return value if value is None else float(value) * scaled(SYMBOLS[name][1], SHOWN.get())[1]


def with_unit(name: str, text: str) -> str:
    """The value of a quantity with its unit, if it does not bring one of its own."""
    unit = "" if name not in SYMBOLS or text.endswith(tuple(UNITS)) else SYMBOLS[name][1]
    return f"{text} {unit}".rstrip()


def quantities(values: Known, *names: str) -> Iterator[Row]:
    """Quantities that are known, by their symbols, with their units."""
    for name in names:
        if values[name] is not None and shown_unit(name) == SYMBOLS[name][1]:
            yield SYMBOLS[name][0], with_unit(name, number(values[name]))
        elif values[name] is not None:
            yield SYMBOLS[name][0], f"{number(in_units(name, values[name]))} {shown_unit(name)}"


def given(values: Known, digits: int = 6) -> str:
    """What a scene gives of a top or of its start, zeros left out.

    Examples
    --------
    >>> given({"theta": 0.1, "phi": 0, "phidot": -15, "omega3": "30 rpm"})
    'θ = 0.1 rad, φ̇ = -15 rad/s, ω₃ = 30 rpm'
    """
    words = (
        f"{SYMBOLS.get(name, (name,))[0]} = {with_unit(name, number(value, digits))}"
        for name, value in values.items()
        if value not in (0, None)
    )
    return ", ".join(words) or "all zero"


def title(scene: Known) -> str:
    """The name of a scene and its title."""
    return " — ".join(filter(None, (scene.get("name"), scene.get("title"))))


def called(document: Known) -> str:
    """What the scene of a result is called: by its title, else by its name."""
    return str(document["scene"]["title"] or document["scene"]["name"])


def grouped(rows: Iterable[Known], *names: str) -> dict[Row, list[Known]]:
    """Rows with the same values together, in the order in which they come."""
    found: dict[Any, list[Known]] = {}
    for row in rows:
        found.setdefault(tuple(row.get(name) for name in names), []).append(row)
    return found
