"""`Result`, the base class of all results, with every way to show, store and load them.

A kind of result adds its fields, whose names are the keys of its JSON, and facts, tables, charts
and problems. Symbols, units and formats of numbers are in `heavytop.scene.quantities`. Texts of
files are made harmless where they leave, for a console and for HTML.
"""

from __future__ import annotations

import json
import os
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, fields
from importlib import import_module
from itertools import chain
from pathlib import Path
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, ClassVar, Self, dataclass_transform

from heavytop.errors import Exit, ForeignFile
from heavytop.files import expect_intact, write_document, write_text
from heavytop.results.registry import RESULTS
from heavytop.results.table import Fact, Table, as_rows
from heavytop.scene.arguments import path_of
from heavytop.scene.quantities import Quantity, quantity_of
from heavytop.text import Plotted, printable

if TYPE_CHECKING:
    import pandas
    import xarray
    from rich.console import Console, ConsoleOptions, RenderableType

# --- the command line ------------------------------------------------------------------------

_TYPED: ContextVar[str | None] = ContextVar("command", default=None)
typed = _TYPED.get
"""Return the command line, where this process is a command; None where Python is used."""


def command_line(words: Sequence[str]) -> str:
    """Return a command line as a shell takes it, without characters that control a terminal.

    Examples
    --------
    >>> command_line(["run", "my scene.toml"])
    "heavytop run 'my scene.toml'"
    """
    return printable(shlex.join(["heavytop", *words]))


@contextmanager
def typing(command: str | None) -> Iterator[None]:
    """A block in which results are those of a command."""
    token = _TYPED.set(command)
    try:
        yield
    finally:
        _TYPED.reset(token)


# --- results ---------------------------------------------------------------------------------


@dataclass_transform(frozen_default=True, kw_only_default=True)
@dataclass(frozen=True, kw_only=True, repr=False)
class Result(Plotted):
    """The result of a command or a function: a dataclass, whose fields are its JSON.

    Attributes
    ----------
    command : str or None
        The command line, as a text that is never executed; None where Python was used.
    files : mapping from str to str
        Names of the files that were written, by what they are.
    versions : mapping from str to (str or None)
        Of what the last bits depend on.
    """

    schema: ClassVar[str]
    heading: ClassVar[str]
    """Its heading on a page, by default the name of the class."""
    table: ClassVar[str] = ""
    """The field that has its rows,"""
    index: ClassVar[tuple[str, ...]] = ()
    """and the columns that tell them apart."""
    left_out: ClassVar[tuple[str, ...]] = ()
    """Fields that are not in its JSON."""
    data_file: ClassVar[str] = ""
    """The file that has its numbers beside its JSON, if there is one."""

    command: str | None = field(default_factory=typed)
    files: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str | None] = field(default_factory=dict)

    def __init_subclass__(cls) -> None:
        cls.heading = vars(cls).get("heading", cls.__name__)
        dataclass(frozen=True, kw_only=True, repr=False)(cls)

    def __post_init__(self) -> None:
        for each in fields(self):
            if each.name not in self.left_out:
                object.__setattr__(self, each.name, as_rows(getattr(self, each.name)))

    __iter__ = None  # of results with `__getitem__`, which takes names: Python would try numbers

    def __repr__(self) -> str:
        scene, fact = getattr(self, "scene", None) or {}, ": ".join(next(self.facts(), ()))
        rows = next((table.line for table in self.tables()), "")
        head = " of ".join(filter(None, (type(self).__name__, scene.get("name"))))
        return printable(f"<{head}: {'; '.join(filter(None, (fact, rows)))}>")

    def facts(self) -> Iterator[Fact]:
        """Yield labels and texts."""
        yield from ()

    def tables(self) -> Iterator[Table]:
        """Yield the tables that are shown below the facts, in this order."""
        yield from ()

    def charts(self) -> Mapping[str, Callable[..., Any]]:
        """Return functions that draw a picture of it on axes, by name; the first is the default."""
        return dict(_drawing().charts_of(self))

    def problems(self) -> Iterator[tuple[Exit, str]]:
        """Yield what is wrong with it: exit codes, and a sentence for each."""
        for method, why in self.failures().items():
            yield Exit.ENDED_EARLY, f"{method}: {why}"
        if self.table and not getattr(self, self.table):
            yield Exit.ENDED_EARLY, "nothing was run"

    def failures(self) -> Mapping[str, str]:
        """Return the users' methods that gave no result, and why."""
        return {}

    def numbers(self) -> Table:
        """Return its numbers as one table: that of `to_pandas` and of CSV."""
        if self.table:
            rows = getattr(self, self.table)
            return Table(rows, [*dict.fromkeys(chain.from_iterable(rows))], keys=self.index)
        return next(self.tables(), Table.of_facts(self.facts()))._replace(keys=self.index)

    def to_csv(self) -> str:
        """Return its numbers as comma-separated values, with a header that has the units."""
        return self.numbers().csv

    def to_pandas(self) -> pandas.DataFrame:
        """Return its numbers as a pandas DataFrame, units and names in its attributes."""
        return self.numbers().to_pandas()

    def to_xarray(self) -> xarray.Dataset:
        """Return its numbers as an xarray Dataset with units and names."""
        found = self.numbers().to_xarray()
        return found.assign_attrs(schema=self.schema, command=self.command or "")

    def document(self) -> dict[str, Any]:
        """Return the result for JSON."""
        names = (each.name for each in fields(self) if each.name not in self.left_out)
        return {"schema": self.schema, **{name: getattr(self, name) for name in names}}

    def without_times(self) -> Mapping[str, Any]:
        """Return fields without times, as its folder has them, which resuming does not change."""
        return {}

    def save_data(self, folder: Path) -> dict[str, str]:
        """Write its numbers beside its JSON; return names of files, by what they are."""
        return {}

    def figure(self) -> Any:
        """Return the first of its figures; None where there is nothing to draw."""
        return next((draw() for _, _, draw in self.figures()), None)

    def figures(self) -> Iterator[tuple[str, str, Callable[[], Any]]]:
        """Yield names of its figures, their titles, and functions that draw them."""
        yield from _drawing().result_figures(self)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write its numbers to a file whose name ends in ``.csv``, or all of it to one of JSON.

        `load` reads that of JSON.

        Parameters
        ----------
        path : path
        """
        place = path_of("path", path)
        if place.suffix.lower() == ".csv":
            write_text(place, self.to_csv())
        else:
            write_document(place, self.document())

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Return the result that a file holds.

        Parameters
        ----------
        path : path

        Raises
        ------
        ForeignFile
            It is no regular file, or not such a result: the message has the format it has.
        """
        with expect_intact(path):
            document = json.loads(Path(path).read_bytes())
            if (has := document.get("schema")) != cls.schema:
                has = printable(has)[:60]
                raise ForeignFile(f"{printable(path)}: of the format {has}, not {cls.schema}")
            return cls.from_document(document)

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Self:
        """Return the result of a document; keys that are no fields follow from these."""
        names = {each.name for each in fields(cls)} - {*cls.left_out}
        return cls(**{"command": None} | {n: x for n, x in document.items() if n in names})

    # --- screens -----------------------------------------------------------------------------

    def __rich_console__(
        self, console: Console, options: ConsoleOptions
    ) -> Iterator[RenderableType]:
        from rich.text import Text

        scene = getattr(self, "scene", None) or {}
        if name := " — ".join(filter(None, (scene.get("name"), scene.get("title")))):
            yield Text(printable(name), style="bold")
        parts = [Table.of_facts(self.facts()), *self.tables(), self.files_table]
        first, *others = [part for part in parts if part.rows]
        yield first
        for part in others:
            yield from (Text(), part)

    @property
    def files_table(self) -> Table:
        """The names of the files that it was written to."""
        files = ", ".join(self.files.values())
        return Table.of_facts([("files", files)] if files else [])

    def html(self) -> str:
        """Return the facts and the tables in HTML."""
        return "".join(part.html for part in (Table.of_facts(self.facts()), *self.tables()))


def kind_of(found: Result | type[Result]) -> str:
    """Return the kind of a result: the name of its document."""
    return found.schema.split("/")[1]


def _drawing() -> Any:
    """Return the module that draws results, of a higher layer and slow to import."""
    return import_module("heavytop.plots.studies")


# --- files -----------------------------------------------------------------------------------


def load_result(path: Path) -> Result:
    """Return the result that a file holds, by its name.

    Raises
    ------
    ForeignFile
        It is no regular file, or not what its name says.
    """
    found: Result = resolve_name(f"heavytop.{RESULTS[path.name].result}").load(path)
    return found


# --- values as texts -------------------------------------------------------------------------


def error_of(name: str) -> Quantity:
    """Return the error of a quantity, itself a quantity."""
    return quantity_of(name if name == "phase_s" else f"{name}_error")


def error_text(name: str, size: float) -> str:
    """Return an error with its unit."""
    return error_of(name).with_unit(size, form=".3g")


def nonzero(values: Mapping[str, Any], form: str = ".6g") -> str:
    """Return the numbers of a top or a start in words, zeros left out.

    Examples
    --------
    >>> nonzero({"theta": 0.1, "phi": 0, "phidot": -15, "omega3": "30 rpm"})
    'θ = 0.1 rad, φ̇ = -15 rad/s, ω₃ = 30 rpm'
    """
    named = [(quantity_of(name), value) for name, value in values.items() if value not in (0, None)]
    words = (f"{of.symbol} = {of.with_unit(value, form=form)}" for of, value in named)
    return ", ".join(words) or "all zero"


def group(rows: Iterable[Mapping[str, Any]], *names: str) -> dict[Any, list[Any]]:
    """Return rows by their values of some columns, in the order in which these first appear."""
    found: dict[Any, list[Any]] = {}
    for row in rows:
        found.setdefault(tuple(row.get(name) for name in names), []).append(row)
    return found


def skipped_runs(skipped: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the reasons why runs were skipped, each with its methods and their numbers of runs.

    Examples
    --------
    >>> skipped = [{"method": name, "reason": "no time"} for name in ("auto", "strang", "auto")]
    >>> [*skipped_runs(skipped)]
    ['no time: auto (2), strang (1)']
    """
    for (reason,), same in group(skipped, "reason").items():
        counts = Counter(each["method"] for each in same).items()
        yield f"{reason}: {', '.join(f'{name} ({n})' for name, n in counts)}"
