"""A toy study for the tests of the store and the runner, and what is seen of it from outside."""

import time
from contextlib import suppress
from pathlib import Path

from heavytop.studies import runner
from heavytop.studies.store import Store

TOYS = Path(__file__).parent / "toys"


def results(path):
    """Return every file that must be the same: all but the lock."""
    files = (p for p in path.rglob("*") if p.is_file() and p.name != "lock")
    return {p.relative_to(path).as_posix(): p.read_bytes() for p in files}


def done(path, parameters, **how):
    """Do a study, and return its folder."""
    with Store.open(path, parameters) as store:
        runner.run(store, **how)
    return path


def lines(log):
    """Return what was done: task, first and last step, process, in the order it was done."""
    words = (line.split() for line in log.read_text().splitlines()) if log.exists() else ()
    return [(task, int(a), int(b), int(pid)) for task, a, b, pid in words]


def wait_for(condition, seconds=60):
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return found


def alive(pid):
    """Whether a process is there and not only waits to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


class Killed(BaseException):
    """What nobody catches."""


def kills(monkeypatch, moments, do):
    """Do what is killed after so many renamings, until it is done; return how often it was."""
    rename, left = Path.replace, [0]

    def replace(self, target):
        left[0] -= 1
        if left[0] < 0:
            raise Killed
        return rename(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    for count, left[0] in enumerate(moments):
        with suppress(Killed):
            do()
            return count
    raise AssertionError("it gets nowhere")
