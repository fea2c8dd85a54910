"""A toy study for the tests of the journal and the runner, and what is seen of it from outside."""

import json
from contextlib import suppress
from pathlib import Path

from heavytop.studies import journal, study
from heavytop.studies.journal import Journal

TOYS = Path(__file__).parent / "toys"


def results(path):
    """Return what must be the same of each task, however often its work was interrupted."""
    found, file = {}, path / "study.jsonl"
    *lines, _ = file.read_text().split("\n") if file.exists() else [""]
    for line in map(json.loads, lines[1:]):
        rows = found.get(line["task"], ([],))[0]
        rows += line["rows"]
        state = (line[name] for name in ("checkpoint", "done", "failed"))
        found[line["task"]] = (rows, *state)
    return found


def drop_line(path):
    """Take the last line of a study away, as if it had been killed before it."""
    *lines, _ = (path / "study.jsonl").read_text().splitlines()
    (path / "study.jsonl").write_text("\n".join([*lines, ""]))


def done(path, parameters, **how):
    """Do a study, and return its folder."""
    with Journal.open(path, parameters) as opened:
        study.run(opened, **how)
    return path


def lines(log):
    """Return what was done: task, first and last step, process, in the order it was done."""
    words = (line.split() for line in log.read_text().splitlines()) if log.exists() else ()
    return [(task, int(a), int(b), int(pid)) for task, a, b, pid in words]


class Killed(BaseException):
    """What nobody catches."""


def tears(monkeypatch, cuts, do):
    """Do what is killed in the middle of a line, until it is done; return how often it was.

    Each cut is how many lines are written before it, and which part of the next one.
    """
    write, left = journal._write_line, [0, 0.0]

    def torn(file, line):
        left[0] -= 1
        if left[0] < 0:
            text = journal.seal(journal.canonical_json(line).encode())
            file.write(text[: int(left[1] * len(text))])
            raise Killed
        return write(file, line)

    monkeypatch.setattr(journal, "_write_line", torn)
    for count, left[:] in enumerate(cuts):
        with suppress(Killed):
            do()
            return count
    raise AssertionError("it gets nowhere")
