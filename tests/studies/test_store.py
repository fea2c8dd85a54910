"""The store takes what belongs to its study, refuses the rest by name, and merges shards."""

import json
import re
import shutil
from pathlib import Path

import pytest

from heavytop.cli import exit_code
from heavytop.errors import ForeignFile
from heavytop.studies.store import Chunk, MemoryStore, Record, Store, differences

from . import toy
from .toy import results

pytestmark = pytest.mark.usefixtures("toys")

PARAMETERS = {
    "kind": "toy",
    "scene": {"start": {"theta": "0.1", "phidot": "-15"}, "title": "top"},
    "options": {"tasks": 5, "blocks": 16, "names": ["a", "b"], "rate": 1},
    "versions": {},
}
NAMES = tuple(f"henon/{i:03d}" for i in range(5))


def done(path, tasks):
    return toy.done(path, PARAMETERS, tasks=tasks)


@pytest.fixture
def parts(tmp_path):
    """Return three folders, each with a third of the tasks."""
    return [done(tmp_path / f"part-{i}", NAMES[i::3]) for i in range(3)]


@pytest.fixture
def whole(tmp_path):
    return results(done(tmp_path / "whole", NAMES))


def merged(path, *sources):
    with Store.open(path, PARAMETERS) as store:
        store.merge(sources)
        return [task for task in NAMES if not store.load(task).ended]


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
        ("[]", "Input should be an object"),
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
def test_a_record_that_cannot_be_read_is_refused_by_name(parts, change):
    file = next(parts[0].glob("tasks/*.json"))
    record = json.loads(file.read_text())
    file.write_text(change if isinstance(change, str) else json.dumps(record | change))
    with pytest.raises(ForeignFile, match=re.escape(str(file))):
        Store(parts[0]).load(record["task"])


@pytest.mark.parametrize("name", ["thesis.tex", ".hidden"])
def test_a_folder_with_something_else_in_it_is_refused(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(ForeignFile, match=rf"not the folder of a study \({name}\)"):
        done(tmp_path, ())
    assert [p.name for p in tmp_path.iterdir()] == [name]
    with pytest.raises(ForeignFile, match="not a folder"):
        done(tmp_path / name, ())


def test_what_a_killed_writer_left_is_cleaned_away(parts, tmp_path):
    before = results(parts[0])
    (parts[0] / ".77.study.json").touch()
    (parts[0] / "tasks/.77.abc.json").touch()
    done(parts[0], NAMES[::3])
    assert results(parts[0]) == before
    (tmp_path / "new").mkdir()
    (tmp_path / "new/.77.study.json").touch()
    done(tmp_path / "new", NAMES[::3])
    assert results(tmp_path / "new") == before


def test_merged_parts_are_the_study_done_whole(parts, whole, tmp_path):
    (parts[0] / "tasks" / ".123.abc.json").write_text('{"task": "cut')  # of a killed writer
    assert merged(tmp_path / "study", parts[0], parts[2]) == ["henon/001", "henon/004"]
    for _ in range(2):  # the second time nothing changes
        assert merged(tmp_path / "study", *parts) == []
        assert results(tmp_path / "study") == whole


def test_what_has_not_ended_is_not_taken_and_is_replaced(parts, whole, tmp_path):
    from toy_study import advance

    begun = tmp_path / "begun"
    with Store.open(begun, PARAMETERS) as store:
        for task in NAMES[:2]:
            store.save(Record(task).after(next(advance(PARAMETERS, task, None))))
    assert merged(tmp_path / "other", begun, parts[1]) == ["henon/000", "henon/002", "henon/003"]
    assert Store(tmp_path / "other").load("henon/000") == Record("henon/000")
    assert merged(begun, *parts) == []
    assert results(begun) == whole


def test_an_interrupted_merging_is_done_again(parts, whole, tmp_path, monkeypatch):
    moments = (1 + most % 2 for most in range(100))
    path = tmp_path / "study"
    assert toy.kills(monkeypatch, moments, lambda: merged(path, *parts)) > 1
    assert merged(path, *parts) == []
    assert results(tmp_path / "study") == whole


def test_another_study_is_not_merged(parts, tmp_path):
    other = {**PARAMETERS, "options": {"tasks": 5, "blocks": 17}}
    toy.done(tmp_path / "other", other, tasks=NAMES[1:2])
    before = results(parts[0])
    with pytest.raises(ForeignFile, match=r"options\.blocks: 17 there, 16 here"):
        merged(parts[0], parts[1], tmp_path / "other")
    assert results(parts[0]) == before


def test_two_results_of_one_task_are_refused_by_name(parts, tmp_path):
    twin = Path(shutil.copytree(parts[0], tmp_path / "twin"))
    file = next(twin.glob("tasks/*.json"))
    document = json.loads(file.read_text())
    document["rows"][0]["x"] = "0x0p+0"
    file.write_text(json.dumps(document))
    there = tmp_path / "study/tasks" / file.name
    words = re.escape(f"{file}: not the same result as in {there}")
    with pytest.raises(ForeignFile, match=words):
        merged(tmp_path / "study", parts[0], twin)
    with pytest.raises(ForeignFile, match="not the same result"):
        merged(parts[0], twin)
