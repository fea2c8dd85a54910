"""What every result is: how it is shown, how it becomes JSON, and what is refused from a file."""

import json
import math
from typing import Any, ClassVar

import pytest
from rich.console import Console

from heavytop.errors import ForeignFile
from heavytop.results import base
from heavytop.results.base import Result
from heavytop.results.table import Table, as_rows
from heavytop.scene.quantities import MISSING, QUANTITIES, read_units, show_units

HOSTILE = "<script>alert(1)</script> [red]x[/red] \\[bold] \x1b[31m"
RUNS = ({"case": "a|b", "theta": 2 / 3, "bound": 1.41e-15}, {"case": "b", "theta": None})


class Some(Result):
    schema: ClassVar = "heavytop/some/1"
    index: ClassVar = ("case",)
    name: str
    runs: tuple[Any, ...] = RUNS

    def facts(self):
        yield "name", self.name

    def tables(self):
        yield Table(self.runs, ("case", "theta", "bound"), self.name)


SOME = Some(name="one")


def printed(thing, width):
    console = Console(width=width)
    with console.capture() as found:
        console.print(thing)
    return found.get()


def test_one_table_is_shown_in_every_form():
    [table] = SOME.tables()
    assert table.texts() == [["a|b", "0.666666666667", "1.5e-15"], ["b", MISSING, MISSING]]
    assert '<td style="text-align:right">0.666666666667</td>' in table.html
    assert "0.666666666667" in printed(table, 80)
    frame, data = SOME.to_pandas(), SOME.to_xarray()
    assert frame.loc["a|b", "theta"] == float(data["theta"].sel(case="a|b")) == 2 / 3
    assert frame.attrs["units"]["theta"] == "rad"
    assert data["theta"].attrs == QUANTITIES["theta"].attributes


@pytest.mark.parametrize(("width", "text"), [(80, "0.666666666667"), (31, " 0.66666667")])
def test_a_narrow_terminal_shows_fewer_digits(width, text):
    shown = printed(Table([RUNS[0] | {"phi": 2 / 3}], ("case", "theta", "phi")), width)
    assert text in shown
    assert max(map(len, shown.splitlines())) <= width


def test_columns_without_room_stand_below_the_others_with_the_first():
    rows = [{"case": "cusp"} | {f"method-{k}": f"{k}.0" for k in range(9)}]
    parts = printed(Table(rows, (*rows[0],)), 40).split("\n\n")
    cells = [part.split("\n")[1].split() for part in parts]
    assert [first for first, *_ in cells] == ["cusp"] * len(parts)
    assert [x for _, *others in cells for x in others] == [f"{k}.0" for k in range(9)]


def test_rows_beyond_the_first_are_counted():
    assert printed(Table(RUNS * 2, ("case",), first=1, more=7), 40).endswith("… and 10 more\n")


def test_no_text_becomes_markup_or_script_or_acts_on_a_terminal():
    some = Some(name=HOSTILE, runs=({"case": HOSTILE, "theta": 1.0, "bound": 1.0},))
    shown = printed(some, 200)
    assert "\x1b[31m" not in shown
    assert shown.count("<script>alert(1)</script> [red]x[/red] \\[bold] \\x1b[31m") == 3
    assert "<script>" not in some.html()
    assert some.html().count("&lt;script&gt;") == 3


def test_a_result_says_on_one_line_of_what_it_is_and_from_where_to_where_its_numbers_go():
    rows = [{"case": "a", "energy": 2e-9}, {"case": "b", "energy": 1e-7}, {"case": "c"}]

    class Drifts(Some):
        def tables(self):
            yield Table(self.runs, ("case", "energy"))

    said = repr(Drifts(name="one", runs=rows))
    assert said == "<Drifts: name: one; a, b, c: energy 2e-09 to 1e-07>"


@pytest.mark.parametrize("bound", [1.41e-15, 1.7e-15, 0.5, 9.91e-9])
def test_a_bound_is_never_rounded_down(bound):
    """The double 1.7e-15 is above its decimals."""
    assert bound <= float(QUANTITIES["bound"].text(bound)) <= 1.1 * bound


@pytest.mark.parametrize(("values", "text", "in_degrees"), [
    ({"A": 0.000328, "C": "6.60e-5"}, "A = 0.000328 kg m², C = 6.60e-5 kg m²", None),
    ({"theta": "pi/2", "phi": 0}, "θ = pi/2 rad", "θ = pi/2 rad"),
    ({"theta": "0.5"}, "θ = 0.5 rad", "θ = 28.6479 deg"),
    ({"omega3": "30 rpm"}, "ω₃ = 30 rpm", "ω₃ = 30 rpm"),
    ({"quaternion": [1, 0.5]}, "q = [1, 0.5]", None), ({"theta": 0}, "all zero", None),
])  # fmt: skip
def test_what_is_given_is_shown_with_units(values, text, in_degrees):
    assert base.nonzero(values) == text
    with show_units(read_units("deg,deg/s")):
        assert base.nonzero(values) == (in_degrees or text)


# --- stored ------------------------------------------------------------------------------------


def put(folder, **changed):
    path = folder / "some.json"
    path.write_text(json.dumps(SOME.document() | changed))
    return path


def test_what_is_saved_is_loaded(tmp_path):
    SOME.save(f"{tmp_path}/some.json")
    assert Some.load(tmp_path / "some.json") == SOME
    assert Some.load(put(tmp_path, planted={"more": 1})) == SOME


@pytest.mark.parametrize("text", ["", "null", "[1]", '{"schema": "heavytop/some/0"}', "{}"])
def test_what_is_no_such_document_is_refused_by_its_name(tmp_path, text):
    path = tmp_path / "some.json"
    for wrong in (None, text):
        if wrong is not None:
            path.write_text(wrong)
        with pytest.raises(ForeignFile, match=str(path)):
            Some.load(path)


def test_a_result_has_the_command_that_made_it_and_a_file_no_other(tmp_path):
    assert "\x1b" not in base.command_line(["run", "\x1b[31m"])
    with base.typing("heavytop some"):
        assert Some.load(put(tmp_path)).command is None
        assert Some(name="a").command == "heavytop some"


def test_rows_are_what_json_holds():
    found = as_rows({"a": math.inf, "b": 1, "c": [{"d": math.nan}], "e": "1", "f": True})
    assert found == {"a": None, "b": 1, "c": ({"d": None},), "e": "1", "f": True}
    assert (found.b, found.c[0].d, {"b", "items"} <= {*dir(found)}) == (1, None, True)
    with pytest.raises(AttributeError, match="'x': there are a, b"):
        found.x  # noqa: B018
