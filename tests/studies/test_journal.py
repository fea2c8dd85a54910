"""The journal takes what belongs to its study, and refuses the rest by name."""

import os
import re

import pytest

from heavytop.errors import ForeignFile
from heavytop.studies.journal import Chunk, Journal

from .toy import done, results

pytestmark = pytest.mark.usefixtures("toys")

OPTIONS = {"tasks": 5, "blocks": 16, "names": ["a", "b"], "rate": 1}
SCENE = {"start": {"theta": "0.1", "phidot": "-15"}, "title": "top"}
PARAMETERS = {"kind": "toy", "scene": SCENE, "options": OPTIONS, "versions": {}}


def test_a_record_is_the_sum_of_its_chunks(tmp_path):
    chunks = (
        Chunk({"at": "0x1p-1"}, [{"x": 1}], fraction=0.5, seconds=1.0),
        Chunk({"at": "0x1p+0"}, [{"x": 2}, {"x": 3}], done=True, seconds=2.0),
    )
    with Journal.open(tmp_path, PARAMETERS) as stored:
        for journal in (stored, Journal(PARAMETERS)):
            for chunk in chunks:
                assert not journal.record("a/1").ended
                journal.append("a/1", chunk)
    for each in (journal, stored, Journal.read(tmp_path)):
        record = each.record("a/1")
        assert (record.last, record.seconds) == (chunks[1]._replace(rows=()), 3.0)
        assert record.ended
        assert each.rows("a/1") == [{"x": 1}, {"x": 2}, {"x": 3}]
        assert each.rows("a/2") == []
    with (tmp_path / "study.jsonl").open("r+b") as file:
        file.write(file.readlines()[-1] * 2)  # by another, where a lock does not hold
    with pytest.raises(ForeignFile, match="line 4: a/1 had ended before"):
        Journal.read(tmp_path)


def test_every_difference_is_named(tmp_path):
    with Journal.open(tmp_path, PARAMETERS):
        pass
    other = PARAMETERS | {"scene": {"start": {"theta": "20°", "phidot": "-15"}}}
    other["options"] = OPTIONS | {"names": ["a", "c"], "rate": True, "seed": 0}
    with pytest.raises(ForeignFile) as error, Journal.open(tmp_path, other):
        pass
    assert str(error.value).partition("another study: ")[2].split("; ") == [
        'options.names: ["a","b"] there, ["a","c"] here',
        "options.rate: 1 there, true here",
        "options.seed: nothing there, 0 here",
        'scene.start.theta: "0.1" there, "20°" here',
        'scene.title: "top" there, nothing here',
    ]
    with Journal.open(tmp_path, PARAMETERS):  # and it is free again
        pass


DAMAGES = {
    "a number": lambda line: re.sub(rb"(\d)(?=[,}])", b"8", line.replace(b"8", b"7"), count=1),
    "its digest": lambda line: line.replace(b'"sha256":"', b'"sha256":"0'),
    "cut": lambda line: line[: len(line) // 2] + b"\n",
    "gone": lambda line: b"\n",
}


@pytest.mark.parametrize("number", [1, 3])
@pytest.mark.parametrize("damage", DAMAGES)
def test_a_line_that_is_not_as_it_was_written_is_refused_by_name(tmp_path, number, damage):
    file = done(tmp_path / "study", PARAMETERS) / "study.jsonl"
    lines = file.read_bytes().splitlines(keepends=True)
    lines[number - 1] = DAMAGES[damage](lines[number - 1])
    file.write_bytes(b"".join(lines))
    for read in (Journal.read, lambda folder: done(folder, PARAMETERS)):
        with pytest.raises(ForeignFile, match=re.escape(f"{file}: line {number}: damaged")):
            read(file.parent)
    assert file.read_bytes() == b"".join(lines)


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_last_line_that_is_not_as_it_was_written_is_done_again(tmp_path, damage):
    """A kill leaves half a line without its end; the task goes on from the line before."""
    file = done(tmp_path / "study", PARAMETERS, slice_s=0.0) / "study.jsonl"
    whole, (*lines, last) = results(file.parent), file.read_bytes().splitlines(keepends=True)
    for end in (b"\n", b""):
        file.write_bytes(b"".join([*lines, DAMAGES[damage](last).rstrip() + end]))
        done(file.parent, PARAMETERS)
        assert results(file.parent) == whole


@pytest.mark.parametrize("text", ["", '{"sha256":"'])
def test_where_no_first_line_is_whole_there_is_nothing_and_a_study_begins(tmp_path, text):
    (tmp_path / "study.jsonl").write_text(text)
    with pytest.raises(ForeignFile, match="there is neither a study nor a run"):
        Journal.read(tmp_path)
    assert results(done(tmp_path, PARAMETERS)) == results(done(tmp_path / "other", PARAMETERS))


def test_a_folder_with_something_else_in_it_is_refused(tmp_path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(ForeignFile, match=r"not the folder of a study \(thesis.tex\)"):
        done(tmp_path, PARAMETERS)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(ForeignFile, match="not a folder"):
        done(tmp_path / "thesis.tex", PARAMETERS)


@pytest.mark.parametrize(("name", "make"), [
    ("study.jsonl", lambda file, other: file.symlink_to(other)),
    ("study.jsonl", lambda file, other: os.mkfifo(file)),
    ("study.jsonl", lambda file, other: file.write_text("precious")),
    ("lock", lambda file, other: file.symlink_to(other)),
])  # fmt: skip
def test_what_is_no_journal_or_lock_of_ours_is_not_written_to(tmp_path, name, make):
    other, place = tmp_path / "other", tmp_path / "place"
    other.write_text("precious")
    place.mkdir()
    make(place / name, other)
    with pytest.raises(ForeignFile, match=re.escape(str(place / name))):
        done(place, PARAMETERS)
    assert other.read_text() == "precious"
    assert not (place / name).is_file() or (place / name).read_text() == "precious"
