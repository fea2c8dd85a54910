"""What a result says, as facts and tables of texts: terminal, page and Markdown render these."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple, Self, TypeAlias

from heavytop.numbers.parse import UNITS

Known: TypeAlias = Mapping[str, Any]
Row: TypeAlias = tuple[str, str]

MISSING: Final = "–"
FAIL: Final = "FAIL"  # how the row of a claim begins that does not hold
MOST_ROWS: Final = 60  # of the numbers behind a picture; its data have all of them

SYMBOLS: Final = {
    "t": ("t", "s"), "A": ("A", "kg m²"), "C": ("C", "kg m²"), "gMR": ("gMR", "J"),
    "theta": ("θ", "rad"), "phi": ("φ", "rad"), "psi": ("ψ", "rad"), "thetadot": ("θ̇", "rad/s"),
    "phidot": ("φ̇", "rad/s"), "psidot": ("ψ̇", "rad/s"), "omega3": ("ω₃", "rad/s"),
    "rate": ("φ̇", "rad/s"), "p_phi": ("p_φ", "kg m²/s"), "p_psi": ("p_ψ", "kg m²/s"),
    "E": ("E", "J"), "E_prime": ("E′", "J"), "potential": ("potential", "J"),
    "theta_min": ("least θ", "rad"), "theta_max": ("greatest θ", "rad"), "phase_s": ("phase", "s"),
    "axis": ("axis", "rad"), "us_per_period": ("time of a period", "µs"),
    "period": ("period", "s"), "precession": ("Δφ per period", "rad"),
    "spin": ("Δψ per period", "rad"), "residual": ("residual", "rad/s"),
}  # fmt: skip
"""By the name of a quantity in a document: its symbol, and its unit."""


class FactRows(NamedTuple):
    """Labels and texts side by side."""

    rows: tuple[Row, ...]

    @classmethod
    def of(cls, rows: Iterable[Row]) -> Self:
        """The facts of any rows."""
        return cls(tuple(rows))


class Table(NamedTuple):
    """Texts below headings.

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

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""
    left: int = 1
    first: int | None = None
    more: int = 0

    @classmethod
    def of(cls, rows: Sequence[Known], digits: int = 6, most: int = MOST_ROWS) -> Self:
        """The table of rows with the same names; of many, rows that are evenly spaced.

        Examples
        --------
        >>> Table.of([{"t": 0, "kind": "cusp"}, {"t": 1 / 3, "kind": None}])[:2]
        (('t [s]', 'kind'), (('0', 'cusp'), ('0.333333', '–')))
        """
        names = [
            name for name in (rows[0] if rows else ()) if any(r[name] is not None for r in rows)
        ]
        some = rows[:: max(1, -(-len(rows) // most))]
        cells = tuple(tuple(cell(row[name], digits) for name in names) for row in some)
        return cls(tuple(map(headed, names)), cells, more=len(rows) - len(some))

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


class Fitting(NamedTuple):
    """Forms of the same tables, the best first: at a terminal the first one that fits it."""

    forms: tuple[tuple[Table, ...], ...]


Part: TypeAlias = FactRows | Table | Fitting | str


def number(value: Any, digits: int = 12) -> str:
    """A number to so many digits; a decimal text as it is.

    Examples
    --------
    >>> number(2 / 3, 3), number("0.66666666666666666667"), number(None)
    ('0.667', '0.66666666666666666667', '–')
    """
    if value is None:
        return MISSING
    return value if isinstance(value, str) else f"{value:.{digits}g}"


def short(value: Any) -> str:
    """A value to 3 digits."""
    return MISSING if value is None else f"{float(value):.3g}"


def size(error: float | None) -> str:
    """An error to two digits."""
    return MISSING if error is None else f"{error:.1e}"


def cell(value: Any, digits: int = 6) -> str:
    """A value of a document as a table has it.

    Examples
    --------
    >>> cell(5280, 2), cell(172.6, 3), cell(True), cell(["a", "b"])
    ('5280', '173', 'yes', 'a, b')
    """
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return ", ".join(map(str, value)) or MISSING
    return str(value) if isinstance(value, int) else number(value, digits)


def headed(name: str) -> str:
    """The heading of a column: the symbol of a quantity with its unit, else its name in words."""
    if name in SYMBOLS:
        return "{} [{}]".format(*SYMBOLS[name])
    return name.replace("_", " ") if name.isidentifier() and name.isascii() else name


def with_unit(name: str, text: str) -> str:
    """The value of a quantity with its unit, if it does not bring one of its own."""
    unit = "" if name not in SYMBOLS or text.endswith(tuple(UNITS)) else SYMBOLS[name][1]
    return f"{text} {unit}".rstrip()


def quantities(values: Known, *names: str) -> Iterator[Row]:
    """Quantities that are known, by their symbols, with their units."""
    for name in names:
        if values[name] is not None:
            yield SYMBOLS[name][0], with_unit(name, number(values[name]))


def given(values: Known, digits: int = 6) -> str:
    """What a scene gives of a top or of its start, zeros left out.

    Examples
    --------
    >>> given({"theta": 0.1, "phi": 0, "phidot": -15, "omega3": "30 rpm"})
    'θ = 0.1 rad, φ̇ = -15 rad/s, ω₃ = 30 rpm'
    """
    words = (
        f"{SYMBOLS.get(name, (name,))[0]} = {with_unit(name, cell(value, digits))}"
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


def files(document: Known) -> Iterable[Row]:
    """The files of a result, where it has any."""
    return [("files", ", ".join(document["files"].values()))] if document.get("files") else []


def grouped(rows: Iterable[Known], *names: str) -> dict[tuple[Any, ...], list[Known]]:
    """Rows with the same values together, in the order in which they come."""
    found: dict[tuple[Any, ...], list[Known]] = {}
    for row in rows:
        found.setdefault(tuple(row.get(name) for name in names), []).append(row)
    return found
