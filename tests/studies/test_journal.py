"""The journal takes what belongs to its study, and refuses the rest by name."""

import json
import re
from pathlib import Path

import pytest

from heavytop.cli import exit_code
from heavytop.errors import ForeignFile
from heavytop.studies.study import Chunk, Journal, TaskRecord, differences

from .toy import done

pytestmark = pytest.mark.usefixtures("toys")

PARAMETERS = {
    "kind": "toy",
    "scene": {"start": {"theta": "0.1", "phidot": "-15"}, "title": "top"},
    "options": {"tasks": 5, "blocks": 16, "names": ["a", "b"], "rate": 1},
    "versions": {},
}


@pytest.fixture
def study(tmp_path):
    """Return the folder of a study that is done."""
    return done(tmp_path / "study", PARAMETERS)


def test_a_record_is_the_sum_of_its_chunks(tmp_path):
    chunks = (
        Chunk({"at": "0x1p-1"}, ({"x": 1},), fraction=0.5, seconds=1.0),
        Chunk({"at": "0x1p+0"}, ({"x": 2}, {"x": 3}), done=True, seconds=2.0),
    )
    with Journal.open(tmp_path, PARAMETERS) as stored:
        for journal in (stored, Journal.in_memory(PARAMETERS)):
            assert journal.load("a/1") == TaskRecord("a/1")
            for chunk in chunks:
                journal.append("a/1", chunk)
            rows = [{"x": 1}, {"x": 2}, {"x": 3}]
            assert journal.load("a/1") == TaskRecord(
                "a/1", {"at": "0x1p+0"}, True, None, 1.0, 3.0, rows
            )
            assert journal.state("a/1").ended
            assert journal.load("a/2") == TaskRecord("a/2")
    assert Journal.read(tmp_path).load("a/1") == stored.load("a/1")


def test_every_difference_is_named(tmp_path):
    with Journal.open(tmp_path, PARAMETERS):
        pass
    other = json.loads(json.dumps(PARAMETERS))
    other["scene"]["start"]["theta"] = "0.2"
    other["options"] |= {"names": ["a", "c"], "rate": True, "seed": 0}
    del other["scene"]["title"]
    with pytest.raises(ForeignFile) as error, Journal.open(tmp_path, other):
        pass
    assert str(error.value).partition("study: ")[2].split("; ") == [
        'options.names[1]: "b" there, "c" here',
        "options.rate: 1 there, true here",
        "options.seed: nothing there, 0 here",
        'scene.start.theta: "0.1" there, "0.2" here',
        'scene.title: "top" there, nothing here',
    ]
    assert str(error.value).startswith(f"{tmp_path}: holds another study: options.names[1]")
    assert exit_code(error.value) == 3
    with Journal.open(tmp_path, PARAMETERS):  # and it is free again
        pass


def test_nothing_is_another_value_than_null_and_an_empty_list():
    assert differences({"a": None, "b": 1}, {"b": 1}) == ("a: null there, nothing here",)
    assert differences({"a": []}, {"a": [1]}) == ("a: [] there, nothing here",
                                                  "a[0]: nothing there, 1 here")  # fmt: skip
    assert differences({"a": [1, {"b": 2}]}, {"a": [1, {"b": 2}]}) == ()


@pytest.mark.parametrize(
    "line",
    ["", "[]", '{"kind": "drift"}', '{"parameters": []}', '{"parameters": {"kind": "toy"}}'],
)
def test_a_study_that_cannot_be_read_is_refused_by_name(tmp_path, line):
    file = tmp_path / "study.jsonl"
    file.write_text(line + "\n")
    with pytest.raises(ForeignFile, match=re.escape(f"{file}: line 1: damaged")):
        Journal.read(tmp_path)


@pytest.mark.parametrize("line", ["", '{"task": "henon/000"', '{"more": 1}', "[1]"])
def test_a_line_that_cannot_be_read_is_refused_by_name(study, line):
    file = study / "study.jsonl"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines[:2], line, *lines[2:], ""]))
    with pytest.raises(ForeignFile, match=re.escape(f"{file}: line 3: damaged")):
        Journal.read(study)


def test_a_folder_without_a_study_is_refused(tmp_path):
    with pytest.raises(ForeignFile, match="not readable"):
        Journal.read(tmp_path)


@pytest.mark.parametrize("name", ["thesis.tex", ".hidden"])
def test_a_folder_with_something_else_in_it_is_refused(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(ForeignFile, match=rf"not the folder of a study \({name}\)"):
        done(tmp_path, PARAMETERS)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    with pytest.raises(ForeignFile, match="not a folder"):
        done(tmp_path / name, PARAMETERS)


@pytest.mark.parametrize("made", [Path.symlink_to, Path.hardlink_to])
def test_a_lock_that_is_a_link_leaves_alone_what_it_leads_to(tmp_path, made):
    theirs, folder = tmp_path / "thesis.tex", tmp_path / "study"
    folder.mkdir()
    theirs.write_text("theirs")
    made(folder / "lock", theirs)
    with pytest.raises(ForeignFile, match=re.escape(f"{folder / 'lock'}: not the lock")):
        done(folder, PARAMETERS)
    assert theirs.read_text() == "theirs"
