"""What was changed, cut short or belongs elsewhere is refused by name, and never mixed in."""

import json
import re
import shutil
from hashlib import sha256
from pathlib import Path

import pytest

from heavytop.cli.exits import exit_code
from heavytop.errors import ForeignFile, ForeignStudy, HeavyTopError, StoppedEarly
from heavytop.studies.ledger import Folder, Piece, Study, run, study_of
from heavytop.studies.ledger.canonical import sealed

IDENTITY = {
    "kind": "toy",
    "scene": {"start": {"theta": "0.1", "phidot": "-15"}, "title": "top"},
    "options": {"methods": ["a", "b"], "periods": 1},
    "versions": {"heavytop": "0.1", "heyoka": "7.10.1"},
}
ROW = {"x": "0x1p-1", "ballast": ["0"] * 9999}


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Return a folder with two segments and a pending row in task a/1."""
    path = tmp_path_factory.mktemp("kept") / "study"
    with Folder.create_or_open(path, IDENTITY) as folder:
        folder.record("a/1", Piece({"steps": 5}, (ROW,) * 5, fraction=0.5, spent_s=1.0))
        folder.record("b", Piece({"steps": 1}, (), done=True))
        assert len(folder.entry("a/1").segments) == 2
    return path


@pytest.fixture
def path(kept, tmp_path):
    return Path(shutil.copytree(kept, tmp_path / "study"))


def refused(path, words, kind=ForeignFile):
    """Whether the folder is refused with these words, for a writer and for a reader."""
    for opened in (Folder.open, Folder.look):
        with pytest.raises(kind, match=re.escape(words)) as error:
            opened(path)
        assert exit_code(error.value) == 6
    return True


def resealed(file, change):
    """Change a sealed document as somebody would who knows how it is sealed."""
    document = json.loads(file.read_text())
    del document["sha256"]
    change(document)
    file.write_text(sealed(document))


def test_what_is_whole_is_taken(path):
    with Folder.open(path, IDENTITY["versions"]) as folder:
        assert list(folder.rows("a/1")) == [ROW] * 5
        assert folder.entry("a/1").checkpoint == {"steps": 5}
        assert folder.entry("b").done
        assert folder.spent_s("a/1") == 1.0


def test_every_difference_is_named(path):
    other = json.loads(json.dumps(IDENTITY))
    other["scene"]["start"]["theta"] = "0.2"
    other["options"] = {"methods": ["a", "c"], "periods": True, "seed": 0}
    del other["scene"]["title"]
    with pytest.raises(ForeignStudy) as error:
        Folder.create_or_open(path, other)
    assert error.value.differences == (
        'options.methods[1]: "b" there, "c" here',
        "options.periods: 1 there, true here",
        "options.seed: nothing there, 0 here",
        'scene.start.theta: "0.1" there, "0.2" here',
        'scene.title: "top" there, nothing here',
    )
    assert str(error.value).startswith(f"{path}: holds another study: options.methods[1]")
    assert exit_code(error.value) == 6
    Folder.create_or_open(path, IDENTITY).close()  # and it is free again


def test_another_version_is_refused(path):
    with pytest.raises(ForeignStudy, match=r'versions\.heyoka: "7\.10\.1" there, "7\.11\.0" here'):
        Folder.open(path, {"heavytop": "0.1", "heyoka": "7.11.0"})


def test_a_run_of_another_study_is_refused(path):
    other = Study({**IDENTITY, "kind": "other"}, ("a/1",), "toy_study")
    with Folder.open(path) as folder, pytest.raises(ForeignStudy, match="kind"):
        run(other, folder)


@pytest.mark.parametrize("keep", [0, 1, 40, -2])
@pytest.mark.parametrize(
    "name", ["study.json", "tasks/a/1/checkpoint.json", "tasks/a/1/rows-0002.json"]
)
def test_a_file_cut_short_is_refused_by_name(path, name, keep):
    file = path / name
    file.write_bytes(file.read_bytes()[:keep])
    assert refused(path, str(file))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("study.json", '"0.1"', '"0.2"'),
        ("tasks/a/1/checkpoint.json", '"steps":5', '"steps":6'),
        ("tasks/b/checkpoint.json", '"done":true', '"done":false'),
        ("tasks/a/1/rows-0001.json", "0x1p-1", "0x1p-2"),
    ],
)
def test_a_changed_file_is_refused_by_name(path, name, old, new):
    file = path / name
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    assert refused(path, f"{file}: ")
    assert refused(path, "changed since it was written")


def test_a_study_that_was_changed_and_sealed_again_does_not_fit_its_tasks(path):
    resealed(path / "study.json", lambda d: d["identity"]["scene"].update(title="another"))
    assert refused(path, f"{path / 'tasks/a/1/checkpoint.json'}: of another study")


def test_files_of_another_task_are_refused(path):
    shutil.copy(path / "tasks/b/checkpoint.json", path / "tasks/a/1/checkpoint.json")
    assert refused(path, "a/1/checkpoint.json: of another task ('b', not 'a/1')")


def test_a_missing_segment_is_refused_by_name(path):
    (path / "tasks/a/1/rows-0001.json").unlink()
    assert refused(path, f"{path / 'tasks/a/1/rows-0001.json'}: cannot be read")


def test_a_segment_changed_while_it_is_read_is_refused(path):
    file = path / "tasks/a/1/rows-0002.json"
    with Folder.look(path) as folder:
        file.write_text(file.read_text().replace("0x1p-1", "0x1p-2"))
        with pytest.raises(ForeignFile, match=re.escape(str(file))):
            list(folder.rows("a/1"))


@pytest.mark.parametrize("name", ["../../../secret.json", "/etc/passwd", "rows-0003.json", 1])
def test_a_checkpoint_leads_nowhere_else(path, name):
    secret = path.parent / "secret.json"
    secret.write_text('{"rows":[]}')
    digest = sha256(secret.read_bytes()).hexdigest()

    def change(document):
        document["segments"][0] |= {"file": name, "sha256": digest}

    resealed(path / "tasks/a/1/checkpoint.json", change)
    assert refused(path, "expected rows-0001.json")


@pytest.mark.parametrize(
    "change",
    [
        lambda d: d.pop("segments"),
        lambda d: d.update(segments=5),
        lambda d: d.update(segments=[None]),
        lambda d: d.update(pending=None),
        lambda d: d.update(checkpoint="x"),
        lambda d: d.update(failed=1),
        lambda d: d.update(fraction={}),
        lambda d: d.update(fraction=10**400),
        lambda d: d.update(done="x"),
        lambda d: d["segments"][0].update(rows="1"),
    ],
)
def test_a_checkpoint_of_another_shape_is_refused(path, change):
    resealed(path / "tasks/a/1/checkpoint.json", change)
    assert refused(path, f"{path / 'tasks/a/1/checkpoint.json'}: damaged")


NO_STUDIES = (
    "[]",
    "{}",
    "null",
    "NaN",
    '{"a": NaN}',
    '{"schema": "heavytop/study/1", "a": 1e999}',
    "[" * 100000,
    "\xff",
)


@pytest.mark.parametrize("text", NO_STUDIES, ids=range(len(NO_STUDIES)))
def test_any_other_text_is_refused(path, text):
    (path / "study.json").write_text(text, encoding="latin-1")
    assert refused(path, str(path / "study.json"))


def test_links_that_lead_out_are_refused(path, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    (path / "tasks/a").rename(elsewhere)
    (path / "tasks/a").symlink_to(elsewhere)
    with Folder.open(path) as folder, pytest.raises(ForeignFile, match="leads out of the folder"):
        folder.record("a/1", Piece({}))
    shutil.rmtree(path / "tasks")
    (path / "tasks").symlink_to(tmp_path)
    with pytest.raises(ForeignFile, match="a link"):
        Folder.open(path)
    (path / "lock").unlink()
    (path / "lock").symlink_to(tmp_path / "precious")
    with pytest.raises(ForeignFile, match="a link"):
        Folder.open(path)
    assert not (tmp_path / "precious").exists()


@pytest.mark.parametrize(
    "task", ["", "..", "a/..", "../a", "/a", "a//b", "a/", ".a", "a\\b", "a\n", "é", "a" * 201,
             "checkpoint.json", "a/rows-0001.json", "a."]
)  # fmt: skip
def test_names_that_no_folder_has(path, task, tmp_path):
    with pytest.raises(ValueError, match="not words joined by slashes"):
        Study(IDENTITY, (task,), "toy_study")
    with Folder.open(path) as folder, pytest.raises(HeavyTopError):
        folder.record(task, Piece({}))


def test_a_name_that_is_there_twice():
    with pytest.raises(ValueError, match="named 2 times"):
        Study(IDENTITY, ("a", "a"), "toy_study")


def test_a_kind_is_looked_up_and_never_imported_by_name():
    for kind in ("os", "heavytop.cli", None, 3, ["toy"]):
        with pytest.raises(ForeignFile, match="not a kind of study known here"):
            study_of({"kind": kind})


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(ForeignFile, match=r"not empty and not the folder of a study \(thesis.tex"):
        Folder.create_or_open(tmp_path, IDENTITY)
    for opened in (Folder.open, Folder.look):
        with pytest.raises(ForeignFile, match="not the folder of a study"):
            opened(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(ForeignFile, match="not the folder of a study"):
        Folder.open(tmp_path / "nowhere")
    assert not (tmp_path / "nowhere").exists()


def test_a_study_killed_before_its_first_word_begins_again(tmp_path):
    (tmp_path / "lock").write_text("1 here\n")
    (tmp_path / ".17.study.json").write_text('{"half')
    with Folder.create_or_open(tmp_path, IDENTITY) as folder:
        assert folder.identity == IDENTITY
    assert sorted(p.name for p in tmp_path.iterdir()) == ["lock", "study.json"]


def test_a_folder_that_cannot_be_written_is_not_a_bug(path):
    (path / "lock").unlink()
    (path / "lock").mkdir()  # even for one who may do anything
    with pytest.raises(StoppedEarly, match=f"cannot write {path / 'lock'}: Is a directory") as why:
        Folder.open(path)
    assert exit_code(why.value) == 4
    with Folder.look(path) as folder:
        assert list(folder.rows("a/1")) == [ROW] * 5


def test_what_a_kill_left_is_cleaned_or_written_over(path):
    a = path / "tasks/a/1"
    third = a / "rows-0003.json"
    third.write_text("left by a kill before the checkpoint that names it")
    (a / ".17.checkpoint.json").write_text("half")
    (path / ".17.cost.json").write_text("half")
    mine = path / ".notes.json"
    mine.write_text("not ours")
    with Folder.open(path) as folder:
        assert list(folder.rows("a/1")) == [ROW] * 5
        assert sorted(p.name for p in path.rglob(".*")) == [".notes.json"]
        folder.record("a/1", Piece({"steps": 6}, done=True))
        assert list(folder.rows("a/1")) == [ROW] * 5
    assert json.loads(third.read_text())["rows"] == [ROW]


def test_costs_are_no_result(path):
    (path / "cost.json").write_text("damaged")
    with Folder.open(path) as folder:
        assert folder.spent_s("a/1") == 0


@pytest.mark.parametrize("spent", ["1" + "0" * 400, "-1", "true", '"1"', "null", "[1]"])
def test_a_cost_that_is_no_time_is_no_cost(path, spent):
    (path / "cost.json").write_text(f'{{"spent_s": {{"a/1": {spent}, "b": 2}}}}')
    with Folder.open(path) as folder:
        assert folder.spent_s("a/1") == 0
        assert folder.spent_s("b") == 2


@pytest.mark.parametrize("exchanged", [False, True])
def test_a_folder_that_has_gone_is_not_made_again(path, exchanged):
    with Folder.open(path) as folder:
        gone = path.rename(path.parent / "elsewhere")
        if exchanged:
            shutil.copytree(gone, path)
        there = sorted(path.rglob("*"))
        with pytest.raises(StoppedEarly, match="the folder has gone; without a folder") as why:
            folder.record("c", Piece({"steps": 1}))
    assert exit_code(why.value) == 4
    assert sorted(path.rglob("*")) == there
    assert path.exists() is exchanged


@pytest.mark.parametrize("name", ["file", "nul\0"])
def test_what_can_be_no_folder_is_refused(tmp_path, name):
    (tmp_path / "file").write_text("x")
    for opened in (Folder.open, Folder.look, lambda at: Folder.create_or_open(at, IDENTITY)):
        with pytest.raises(ForeignFile):
            opened(tmp_path / name)


def test_nothing_kept_can_execute():
    """No module of the ledger has what would run the content of a file."""
    source = Path(__file__).parents[2] / "src/heavytop/studies/ledger"
    text = "\n".join(p.read_text() for p in sorted(source.glob("*.py")))
    assert "json.loads" in text
    for word in ("pickle", "marshal", "shelve", "eval(", "exec(", "multiprocessing", "yaml"):
        assert word not in text, word
