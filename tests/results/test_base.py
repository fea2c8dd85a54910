"""What every result is: how it is shown, how it becomes JSON, and what is refused from a file."""

import json
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import pytest
from rich.console import Console

from heavytop.errors import ForeignFile
from heavytop.results import base
from heavytop.results.base import Chart, Result, Table, as_rows, given, read_json
from heavytop.scene.quantities import MISSING, QUANTITIES

HOSTILE = "<script>alert(1)</script> [red]x[/red] \\[bold] \x1b[31m"


@dataclass(frozen=True, kw_only=True, repr=False)
class Some(Result):
    schema: ClassVar = "heavytop/some/1"
    index: ClassVar = ("case",)
    name: str
    runs: tuple[Any, ...]

    def facts(self):
        yield "name", self.name

    def tables(self):
        yield Table(self.runs, ("case", "theta", "bound"), self.name)


RUNS = ({"case": "a|b", "theta": 2 / 3, "bound": 1.41e-15}, {"case": "b", "theta": None})
SOME = Some(name="one", runs=RUNS)


def put(folder, **changed):
    path = folder / "some.json"
    path.write_text(json.dumps(SOME.document() | changed))
    return path


def printed(thing, width):
    console = Console(width=width)
    with console.capture() as found:
        console.print(thing)
    return found.get()


# --- shown -------------------------------------------------------------------------------------


def test_one_table_is_shown_in_every_form():
    [table] = SOME.tables()
    assert table.texts() == [["a|b", "0.666666666667", "1.5e-15"], ["b", MISSING, MISSING]]
    assert table.markdown.splitlines()[2] == "| a\\|b | 0.666666666667 | 1.5e-15 |"
    assert table.csv == "case,theta,bound\na|b,0.6666666666666666,1.41e-15\nb,,\n"
    assert '<td style="text-align:right">0.666666666667</td>' in table.html
    assert "0.666666666667" in printed(table, 80)
    frame = SOME.to_pandas()
    assert frame.loc["a|b", "theta"] == 2 / 3
    assert frame.attrs["units"]["theta"] == "rad"
    data = SOME.to_xarray()
    assert float(data["theta"].sel(case="a|b")) == 2 / 3
    assert data["theta"].attrs == QUANTITIES["theta"].attributes
    assert data.attrs["schema"] == "heavytop/some/1"


@pytest.mark.parametrize(("width", "text"), [(80, "0.666666666667"), (31, "0.66666667")])
def test_a_narrow_terminal_shows_fewer_digits(width, text):
    rows = [{"case": "a", "theta": 2 / 3, "phi": 2 / 3}]
    shown = printed(Table(rows, ("case", "theta", "phi")), width)
    assert text in shown
    assert max(map(len, shown.splitlines())) <= width
    assert ("0.666666666667" in shown) == (width == 80)


def test_columns_without_room_stand_below_the_others_with_the_first():
    names = [f"method-{k}" for k in range(9)]
    rows = [{"case": "cusp", **{name: f"{k}.0" for k, name in enumerate(names)}}]
    shown = printed(Table(rows, ("case", *names)), 40).split("\n\n")
    assert len(shown) > 1
    assert all(part.strip().startswith("case") for part in shown)
    assert [word for part in shown for word in part.split("\n")[1].split()[1:] if word] == [
        f"{k}.0" for k in range(9)
    ]


def test_rows_beyond_the_first_are_counted():
    rows = [{"case": str(k)} for k in range(5)]
    assert printed(Table(rows, ("case",), first=2, more=7), 40).endswith("… and 10 more\n")


def test_no_text_becomes_markup_or_script_or_acts_on_a_terminal():
    some = Some(name=HOSTILE, runs=({"case": HOSTILE, "theta": 1.0, "bound": 1.0},))
    shown = printed(some, 200)
    assert "\x1b[31m" not in shown
    assert shown.count("<script>alert(1)</script> [red]x[/red] \\[bold] \\x1b[31m") == 3
    assert "<script>" not in some.html()
    assert some.html().count("&lt;script&gt;") == 3


@pytest.mark.parametrize(
    ("bound", "text"),
    [(1.41e-15, "1.5e-15"), (1.7e-15, "1.8e-15"), (0.5, "5.0e-01"), (9.91e-9, "1.0e-08")],
)
def test_a_bound_is_never_rounded_down(bound, text):
    """The double 1.7e-15 is above its decimals."""
    assert QUANTITIES["bound"].text(bound) == text
    assert float(text) >= bound


def test_what_is_given_is_shown_with_signs_and_units():
    assert given({"A": 0.000328, "C": "6.60e-5"}) == "A = 0.000328 kg m², C = 6.60e-5 kg m²"
    assert given({"theta": "pi/2", "phi": 0, "omega3": 140}) == "θ = pi/2 rad, ω₃ = 140 rad/s"
    assert given({"theta": 0}) == "all zero"


def test_facts_alone_are_a_table():
    assert "x  1\n" in printed(Table.of_facts([("x", "1")]), 40)


# --- stored ------------------------------------------------------------------------------------


def test_what_is_saved_is_loaded(tmp_path):
    SOME.save(f"{tmp_path}/some.json")
    assert Some.load(tmp_path / "some.json") == Some.load(f"{tmp_path}/some.json") == SOME
    assert Some.load(put(tmp_path, planted={"more": 1})) == SOME


def test_another_format_is_refused_by_its_name(tmp_path):
    with pytest.raises(ForeignFile, match="heavytop/some/0, not heavytop/some/1"):
        Some.load(put(tmp_path, schema="heavytop/some/0"))
    path = put(tmp_path)
    path.write_text('{"schema": "heavytop/some/1"}')
    with pytest.raises(ForeignFile, match="not what was written"):
        Some.load(path)


@pytest.mark.parametrize("text", ["", "null", "[" * 100_000, "[1]"])
def test_what_is_no_document_is_refused(tmp_path, text):
    path = tmp_path / "some.json"
    path.write_text(text)
    with pytest.raises(ForeignFile, match=str(path)):
        read_json(path)
    assert base.command_of(path) is None
    with pytest.raises(ForeignFile, match="not readable"):
        Some.load(tmp_path / "nowhere.json")


def test_a_result_has_the_command_that_made_it_and_a_file_no_other(tmp_path):
    assert "\x1b" not in base.command_line(["run", "\x1b[31m"])
    with base.typing("heavytop some"):
        path = put(tmp_path)
        assert Some.load(path).command is None
        assert Some(name="a", runs=()).command == "heavytop some"
    assert base.command_of(put(tmp_path, command="heavytop some")) == "heavytop some"
    assert base.command_of(put(tmp_path, command=3)) is None


def test_rows_are_what_json_holds():
    odd = {"a": math.inf, "b": 1, "c": [{"d": math.nan}], "e": "1", "f": True}
    found = as_rows(odd)
    assert found == {"a": None, "b": 1, "c": ({"d": None},), "e": "1", "f": True}
    assert (found.b, found.c[0].d) == (1, None)
    with pytest.raises(AttributeError, match="'x': there are a, b"):
        found.x  # noqa: B018


def test_a_chart_without_numbers_is_not_drawn():
    class Drawn(Some):
        chart: ClassVar = Chart("nothing.at_all", "", "runs")

    assert Drawn(name="a", runs=()).figure() is None
    assert Some(name="a", runs=RUNS).figure() is None
