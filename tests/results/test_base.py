"""What every result is: how it becomes JSON, and what is refused where it is read back."""

import json
import math
from dataclasses import dataclass
from typing import Literal

import pytest

from heavytop.errors import ForeignFile
from heavytop.results import base
from heavytop.results.base import Column, Number, Part, Result, Text


@dataclass(frozen=True, kw_only=True)
class Inner(Part):
    size: Number


@dataclass(frozen=True, kw_only=True)
class Some(Result):
    schema: Literal["test/1"] = "test/1"
    name: Text
    count: int
    inner: Inner
    column: Column = ()


SOME = Some(name="a", count=2, inner=Inner(size=0.5), column=(1.0, None))


def put(folder, **changed):
    path = folder / "some.json"
    path.write_text(json.dumps(SOME.document() | changed))
    return path


def test_what_is_saved_is_loaded(tmp_path):
    SOME.save(f"{tmp_path}/some.json")
    assert Some.load(tmp_path / "some.json") == Some.load(f"{tmp_path}/some.json") == SOME
    assert SOME.document(files={"chart": "x.svg"})["files"] == {"chart": "x.svg"}
    assert Some.load(put(tmp_path, planted={"more": 1})) == SOME


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"count": True}, "count: Input should be a valid integer"),
        ({"inner": {"size": math.nan}}, "inner: size: int: Input should be a valid integer"),
        ({"column": [1.0, "x"]}, "column: 1: int: Input should be a valid integer"),
        ({"schema": "test/2"}, "schema: Input should be 'test/1'"),
    ],
)
def test_what_is_of_another_type_is_refused_with_its_place(tmp_path, changed, said):
    with pytest.raises(ForeignFile) as error:
        Some.load(put(tmp_path, **changed))
    assert str(error.value).startswith(f"{tmp_path}/some.json: {said}")


@pytest.mark.parametrize("text", ["", "null", "[" * 10_000])
def test_what_is_no_document_is_refused(tmp_path, text):
    path = tmp_path / "some.json"
    path.write_text(text)
    with pytest.raises(ForeignFile, match=str(path)):
        Some.load(path)
    assert base.command_of(path) is None
    with pytest.raises(ForeignFile, match="not readable"):
        Some.load(tmp_path / "nowhere.json")


def test_a_text_that_a_terminal_would_act_on_is_spelt_out(tmp_path):
    assert "\x1b" not in Some.load(put(tmp_path, name="\x1b[31m")).name
    assert "\x1b" not in base.spelt(["run", "\x1b[31m"])


def test_a_result_has_the_command_that_made_it_and_a_file_no_other(tmp_path):
    with base.typing("heavytop some"):
        path = put(tmp_path, command=None)
        assert Some.load(path).command is None
        assert Some(name="a", count=1, inner=Inner(size=1)).command == "heavytop some"
        assert base.with_command({"schema": "x"}) == {"schema": "x", "command": "heavytop some"}
    assert base.with_command({"schema": "x", "command": "y"})["command"] == "y"
    assert base.command_of(put(tmp_path, command="heavytop some")) == "heavytop some"
    assert base.command_of(put(tmp_path, command=3)) is None


def test_what_is_not_finite_is_none():
    odd = {"a": math.inf, "b": 1, "c": {"d": math.nan}, "e": "1", "f": True}
    assert base.finite(odd) == odd | {"a": None, "c": {"d": None}}
