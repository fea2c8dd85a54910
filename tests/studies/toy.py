"""A toy study for the tests of the journal and the runner, and what is seen of it from outside."""

import json
from pathlib import Path

from heavytop.studies import study
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
