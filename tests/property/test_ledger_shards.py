"""Parts of a study done apart and merged are the study done whole; strangers are not merged."""

import json
import re
import shutil
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heavytop.errors import ForeignFile, ForeignStudy
from heavytop.studies.ledger import Folder, Piece, Study, merge, run, shard, study_of
from heavytop.studies.ledger.canonical import sealed
from heavytop.studies.ledger.kinds import KINDS

TOYS = Path(__file__).parent / "toys"
IDENTITY = {"kind": "toy", "options": {"tasks": 5, "blocks": 16}}


@pytest.fixture(autouse=True)
def toys(monkeypatch):
    monkeypatch.syspath_prepend(str(TOYS))
    monkeypatch.setenv("TOY_PAUSE", "0")
    monkeypatch.setitem(KINDS, "toy", "toy_study")


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a place with the study done whole, and in three parts."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOYS))
        patch.setenv("TOY_PAUSE", "0")
        place = tmp_path_factory.mktemp("made")
        study = Study(IDENTITY, [f"henon/{i:03d}" for i in range(5)], "toy_study")
        tasks = {"whole": study.tasks, **{f"part-{i}": shard(study.tasks, i, 3) for i in (1, 2, 3)}}
        for name, some in tasks.items():
            with Folder.create_or_open(place / name, IDENTITY) as folder:
                run(study, folder, tasks=some)
        return place


@pytest.fixture
def parts(made, tmp_path):
    """Return three folders, each with a third of the tasks."""
    return [Path(shutil.copytree(made / f"part-{i}", tmp_path / f"part-{i}")) for i in (1, 2, 3)]


@pytest.fixture
def whole(made):
    return results(made / "whole")


def results(path):
    """Return every file that must be the same: all but the lock and the costs."""
    files = (p for p in path.rglob("*") if p.is_file() and p.name not in ("lock", "cost.json"))
    return {p.relative_to(path).as_posix(): p.read_bytes() for p in files}


def merged(path, *sources):
    with Folder.create_or_open(path, IDENTITY) as folder:
        return merge(folder, sources)


@given(st.integers(0, 50), st.integers(1, 60))
def test_the_parts_are_the_whole(tasks, n):
    names = [f"t/{i}" for i in range(tasks)]
    parts = [shard(names, i, n) for i in range(1, n + 1)]
    assert sorted(name for part in parts for name in part) == sorted(names)
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


@pytest.mark.parametrize(("i", "n"), [(0, 3), (4, 3), (1, 0), (-1, 3)])
def test_no_such_part(i, n):
    with pytest.raises(ValueError, match=f"shard {i}/{n}: the parts of a whole are 1/n to n/n"):
        shard(["a"], i, n)


def test_merged_parts_are_the_study_done_whole(parts, whole, tmp_path):
    assert merged(tmp_path / "study", parts[0], parts[2]) == ("henon/001", "henon/004")
    assert merged(tmp_path / "study", parts[1]) == ()
    assert results(tmp_path / "study") == whole
    assert merged(tmp_path / "study", *parts) == ()  # again: nothing changes
    assert results(tmp_path / "study") == whole
    with Folder.look(tmp_path / "study") as folder, Folder.look(parts[0]) as part:
        assert folder.spent_s("henon/000") == part.spent_s("henon/000") > 0
        assert sum(1 for _ in folder.rows("henon/000")) == 16


def test_a_part_of_the_tasks_is_done_and_no_other(parts):
    study, seen = study_of(IDENTITY), []
    with Folder.open(parts[0]) as folder:
        assert folder.identity == IDENTITY
        ended = [task for task in study.tasks if folder.entry(task).ended]
        assert ended == ["henon/000", "henon/003"]
        run(study, folder, tasks=["henon/000", "henon/001"], on_progress=seen.append)
        assert folder.entry("henon/001").ended
        assert not folder.entry("henon/002").checkpoint
        with pytest.raises(ValueError, match="task 'henon/9': not one of this study"):
            run(study, folder, tasks=["henon/001", "henon/9"])
    assert (seen[0].fraction, seen[0].ended, seen[0].tasks) == (0.5, 1, 2)
    assert seen[-1].fraction == 1


def test_what_has_not_ended_is_not_taken_and_is_replaced(parts, whole, tmp_path):
    """A task begun here and ended there is there the one that counts; the other way too."""
    begun = tmp_path / "begun"
    with Folder.create_or_open(begun, IDENTITY) as folder:
        from toy_study import follow

        for task in ("henon/000", "henon/001"):
            folder.record(task, next(follow(IDENTITY, task, None)))
    assert merged(begun, *parts) == ()
    assert results(begun) == whole
    with Folder.create_or_open(tmp_path / "other", IDENTITY) as folder:
        folder.record("henon/000", next(follow(IDENTITY, "henon/000", None)))
    assert merged(tmp_path / "new", tmp_path / "other", parts[1]) == (
        "henon/000",
        "henon/002",
        "henon/003",
    )
    assert not (tmp_path / "new/tasks/henon/000").exists()


class Killed(BaseException):
    """What nobody catches."""


def test_an_interrupted_merging_is_done_again(parts, whole, tmp_path, monkeypatch):
    rename, left, kills = Path.replace, [0], 0

    def replace(self, target):
        left[0] -= 1
        if left[0] < 0:
            raise Killed
        return rename(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    for most in range(100):
        left[0] = 1 + most % 4
        try:
            assert merged(tmp_path / "study", *parts) == ()
            break
        except Killed:
            kills += 1
    assert kills > 3
    assert results(tmp_path / "study") == whole


def test_another_study_is_refused_with_its_differences(parts, tmp_path):
    other = {"kind": "toy", "options": {"tasks": 5, "blocks": 17}}
    with Folder.create_or_open(tmp_path / "other", other) as folder:
        run(study_of(other), folder, tasks=["henon/001"])
    before = results(parts[0])
    with pytest.raises(ForeignStudy) as refusal:
        merged(parts[0], parts[1], tmp_path / "other")
    assert str(refusal.value) == (
        f"{tmp_path / 'other'}: holds another study: options.blocks: 17 there, 16 here"
    )
    assert results(parts[0]) == before


def test_a_damaged_file_is_refused_before_anything_is_written(parts, tmp_path):
    rows = parts[2] / "tasks/henon/002/rows-0001.json"
    rows.write_bytes(rows.read_bytes().replace(b"0x1", b"0x2", 1))
    with pytest.raises(ForeignFile, match=re.escape(f"{rows}: cut short or changed")):
        merged(tmp_path / "study", *parts)
    assert list(results(tmp_path / "study")) == ["study.json"]


def test_two_results_of_one_task_are_refused_by_name(parts, tmp_path):
    twin = Path(shutil.copytree(parts[0], tmp_path / "twin"))
    file = twin / "tasks/henon/003/checkpoint.json"
    document = json.loads(file.read_text())
    del document["sha256"]
    document["checkpoint"]["x"] = "0x0p+0"
    file.write_text(sealed(document))
    there = parts[0] / "tasks/henon/003/checkpoint.json"
    for first, second, names in ((twin, parts[0], (there, file)), (parts[0], twin, (file, there))):
        words = re.escape(f"{names[0]}: not the same result as in {names[1]}")
        with pytest.raises(ForeignFile, match=words):
            merged(tmp_path / "study", parts[1], first, second)
        assert list(results(tmp_path / "study")) == ["study.json"]
    with pytest.raises(ForeignFile, match="not the same result"):
        merged(parts[0], twin)  # what is there already counts as much


def test_a_file_changed_meanwhile_is_refused(parts, tmp_path, monkeypatch):
    with (
        Folder.create_or_open(tmp_path / "study", IDENTITY) as folder,
        Folder.look(parts[0]) as source,
    ):
        (parts[0] / "tasks/henon/000/rows-0001.json").write_text("{}")
        with pytest.raises(ForeignFile, match=r"rows-0001.json: cut short or changed"):
            folder.take_over("henon/000", source)
        assert not folder.entry("henon/000").ended
    assert not list((tmp_path / "study").rglob("checkpoint.json"))


def test_merging_writes_only_where_it_may(parts):
    with Folder.look(parts[0]) as folder, pytest.raises(ValueError, match="not opened for writing"):
        merge(folder, [parts[1]])


def test_the_rows_in_memory_are_those_of_one_segment(tmp_path):
    row = {"ballast": ["0x1p-1"] * 20_000}  # 200 kB: a segment of its own
    with Folder.create_or_open(tmp_path / "part", IDENTITY) as folder:
        for i in range(40):
            folder.record("henon/000", Piece({"i": i}, (row,), done=i == 39))
    size = sum(map(len, results(tmp_path / "part").values()))
    tracemalloc.start()
    merged(tmp_path / "study", tmp_path / "part")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 0.2 * size
