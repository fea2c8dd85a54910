"""The journal takes what belongs to its study, and refuses the rest by name."""

import json
import re

import pytest

from heavytop.errors import ForeignFile
from heavytop.studies.journal import Chunk, Journal

from .toy import done

pytestmark = pytest.mark.usefixtures("toys")

PARAMETERS = {
    "kind": "toy",
    "scene": {"start": {"theta": "0.1", "phidot": "-15"}, "title": "top"},
    "options": {"tasks": 5, "blocks": 16, "names": ["a", "b"], "rate": 1},
    "versions": {},
}


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
        'options.names: ["a","b"] there, ["a","c"] here',
        "options.rate: 1 there, true here",
        "options.seed: nothing there, 0 here",
        'scene.start.theta: "0.1" there, "0.2" here',
        'scene.title: "top" there, nothing here',
    ]
    assert error.value.exit == 3
    with Journal.open(tmp_path, PARAMETERS):  # and it is free again
        pass


@pytest.mark.parametrize(
    ("number", "line"),
    [(1, "[]"), (1, '{"parameters": []}'), (1, '{"parameters": {"kind": "toy"}}'),
     (3, ""), (3, '{"task": "henon/000"'), (3, '{"more": 1}')],
)  # fmt: skip
def test_a_line_that_cannot_be_read_is_refused_by_name(tmp_path, number, line):
    file = done(tmp_path / "study", PARAMETERS) / "study.jsonl"
    lines = file.read_text().splitlines()
    lines[number - 1] = line
    file.write_text("\n".join([*lines, ""]))
    with pytest.raises(ForeignFile, match=re.escape(f"{file}: line {number}: damaged")):
        Journal.read(file.parent)


def test_a_folder_with_something_else_in_it_is_refused(tmp_path):
    with pytest.raises(ForeignFile, match="not readable"):
        Journal.read(tmp_path)
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(ForeignFile, match=r"not the folder of a study \(thesis.tex\)"):
        done(tmp_path, PARAMETERS)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.tex"]
    with pytest.raises(ForeignFile, match="not a folder"):
        done(tmp_path / "thesis.tex", PARAMETERS)


def test_a_lock_that_is_a_link_leaves_alone_what_it_leads_to(tmp_path):
    theirs, folder = tmp_path / "thesis.tex", tmp_path / "study"
    folder.mkdir()
    theirs.write_text("theirs")
    (folder / "lock").symlink_to(theirs)
    with pytest.raises(ForeignFile, match=re.escape(f"{folder / 'lock'}: not the lock")):
        done(folder, PARAMETERS)
    assert theirs.read_text() == "theirs"
