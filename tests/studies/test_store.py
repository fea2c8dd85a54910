"""The store takes what belongs to its study, and refuses the rest by name."""

import json
import re
from pathlib import Path

import pytest

from heavytop.cli import exit_code
from heavytop.errors import ForeignFile
from heavytop.studies.store import Chunk, MemoryStore, Record, Store, differences

from .toy import done, results

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
    with Store.open(tmp_path, PARAMETERS) as store:
        for stored in (store, MemoryStore(PARAMETERS)):
            record = Record("a/1")
            assert stored.load("a/1") == record
            for chunk in (
                Chunk({"at": "0x1p-1"}, ({"x": 1},), fraction=0.5),
                Chunk({"at": "0x1p+0"}, ({"x": 2}, {"x": 3}), done=True),
            ):
                record = record.after(chunk)
                stored.save(record)
                assert stored.load("a/1") == record
            assert record.rows == [{"x": 1}, {"x": 2}, {"x": 3}]
            assert record.ended
            assert stored.load("a/2") == Record("a/2")


def test_every_difference_is_named(tmp_path):
    with Store.open(tmp_path, PARAMETERS):
        pass
    other = json.loads(json.dumps(PARAMETERS))
    other["scene"]["start"]["theta"] = "0.2"
    other["options"] |= {"names": ["a", "c"], "rate": True, "seed": 0}
    del other["scene"]["title"]
    with pytest.raises(ForeignFile) as error, Store.open(tmp_path, other):
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
    with Store.open(tmp_path, PARAMETERS):  # and it is free again
        pass


def test_nothing_is_another_value_than_null_and_an_empty_list():
    assert differences({"a": None, "b": 1}, {"b": 1}) == ("a: null there, nothing here",)
    assert differences({"a": []}, {"a": [1]}) == ("a: [] there, nothing here",
                                                  "a[0]: nothing there, 1 here")  # fmt: skip
    assert differences({"a": [1, {"b": 2}]}, {"a": [1, {"b": 2}]}) == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "not readable"),
        ("[]", "not readable"),
        ('{"kind": "drift"}', "not a study of this version"),
    ],
)
def test_a_study_that_cannot_be_read_is_refused_by_name(tmp_path, text, words):
    file = tmp_path / "study.json"
    file.write_text(text)
    with pytest.raises(ForeignFile, match=re.escape(f"{file}: {words}")):
        Store(tmp_path)


@pytest.mark.parametrize(
    "change",
    ["", '{"task": "henon/000"', {"task": "other"}, {"rows": [1]}, {"done": "yes"}, {"more": 1}],
    ids=str,
)
def test_a_record_that_cannot_be_read_is_refused_by_name(study, change):
    file = next(study.glob("tasks/*.json"))
    record = json.loads(file.read_text())
    file.write_text(change if isinstance(change, str) else json.dumps(record | change))
    with pytest.raises(ForeignFile, match=re.escape(str(file))):
        Store(study).load(record["task"])


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


def test_tasks_that_are_a_link_are_not_written_into(tmp_path):
    theirs, folder = tmp_path / "theirs", tmp_path / "study"
    theirs.mkdir()
    (theirs / ".12.notes.json").touch()
    with Store.open(folder, PARAMETERS):
        pass
    (folder / "tasks").rmdir()
    (folder / "tasks").symlink_to(theirs)
    with pytest.raises(ForeignFile, match=re.escape(f"{folder / 'tasks'}: not a folder")):
        done(folder, PARAMETERS)
    assert [path.name for path in theirs.iterdir()] == [".12.notes.json"]


def test_what_a_killed_writer_left_is_cleaned_away(study, tmp_path):
    before = results(study)
    (study / ".77.study.json").touch()
    (study / "tasks/.77.abc.json").touch()
    done(study, PARAMETERS)
    assert results(study) == before
    (tmp_path / "new").mkdir()
    (tmp_path / "new/.77.study.json").touch()
    done(tmp_path / "new", PARAMETERS)
    assert results(tmp_path / "new") == before
