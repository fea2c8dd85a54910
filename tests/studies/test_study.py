"""A study that was killed, wherever and however often, is the study that was not: bit for bit."""

import json
import os
import random
import signal
import threading
import time
from concurrent.futures import BrokenExecutor, Executor, Future
from concurrent.futures import ThreadPoolExecutor as Threads
from pathlib import Path

import pytest

from heavytop.doctor import versions
from heavytop.errors import ForeignFile, InUse, Stop, StoppedEarly
from heavytop.studies import study
from heavytop.studies.journal import Chunk, Journal
from heavytop.studies.study import run

from ..processes import alive, begin, surroundings, wait_for
from .toy import TOYS, done, lines, results

pytestmark = [pytest.mark.usefixtures("toys"), pytest.mark.processes]

PARAMETERS = {"kind": "toy", "options": {"tasks": 3, "blocks": 60}, "versions": versions()}
STEPS = 50 * 60  # of one task
SLICE = 0.1  # of work between two lines of the journal [s]; see run_toy.py
SLOWLY = {"TOY_PAUSE": "0.03"}  # so that it is not done before it is killed
SENT = 50 * 8 * (1 + SLICE / 0.03)  # steps in one slice, at most, of chunks of 8 blocks
NAMES = tuple(f"henon/{i:03d}" for i in range(3))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the files of a study that nothing happened to."""
    path = tmp_path_factory.mktemp("whole")
    assert finished(path, 1, path.parent / "log") == (0, "")
    return results(path)


def started(path, jobs, log, **environment):
    """Start a process that does the study."""
    env = surroundings(TOYS, TOY_LOG=str(log), **environment)
    return begin(TOYS / "run_toy.py", path, jobs, json.dumps(PARAMETERS), env=env)


def finished(path, jobs, log, **environment):
    """Let a process do the study; return its exit code and its errors."""
    process = started(path, jobs, log, **environment)
    _, errors = process.communicate(timeout=60)
    return process.returncode, errors


def steps(log):
    """Return how many steps were done, those done twice counted twice."""
    return sum(last - first for _, first, last, _ in lines(log))


@pytest.mark.slow
def test_killed_at_any_moment_it_goes_on(whole, tmp_path):
    """Each kill loses no more than the slice of each worker."""
    path, log, moments = tmp_path / "study", tmp_path / "log", random.Random(2)
    for _ in range(4):
        before = len(lines(log))
        process = started(path, 2, log, **SLOWLY)
        wait_for(lambda n=before, p=process: len(lines(log)) > n or p.poll() is not None)
        time.sleep(moments.uniform(0, 0.1))
        assert process.poll() is None
        process.kill()
        process.communicate()
    assert finished(path, 2, log) == (0, "")
    assert results(path) == whole
    assert 3 * STEPS <= steps(log) <= 3 * STEPS + 4 * 2 * 2 * SENT
    before = lines(log)
    assert finished(path, 2, log) == (0, "")  # what is finished is not done again
    assert lines(log) == before


def test_the_number_of_workers_changes_nothing(whole, tmp_path):
    journal = Journal.read(done(tmp_path / "three", PARAMETERS, jobs=3, slice_s=SLICE))
    assert results(tmp_path / "three") == whole
    memory, seen = Journal(PARAMETERS), []
    run(memory, jobs=2, on_progress=seen.append, slice_s=0.0)
    for task in NAMES:
        assert memory.rows(task) == journal.rows(task)
    assert [row["steps"] for row in memory.rows(NAMES[1])] == list(range(50, STEPS + 1, 50))
    assert min(memory.record(task).seconds for task in NAMES) > 0
    fractions = [now.fraction for now in seen]
    assert fractions == sorted(fractions)
    assert seen[-1] == (1, 3, 3)


def test_workers_die_with_the_one_that_writes(tmp_path):
    log = tmp_path / "log"
    process = started(tmp_path / "study", 2, log, TOY_PAUSE="0.05")
    workers = wait_for(lambda: len(found := {pid for *_, pid in lines(log)}) == 2 and found)
    assert process.pid not in workers
    assert all(map(alive, workers))
    held = {f.resolve().name for pid in workers for f in Path(f"/proc/{pid}/fd").iterdir()}
    assert "lock" not in held
    process.kill()
    process.communicate()
    wait_for(lambda: not any(map(alive, workers)), seconds=2)


@pytest.mark.slow
def test_a_killed_worker_is_replaced(whole, tmp_path):
    path, log = tmp_path / "study", tmp_path / "log"
    process = started(path, 2, log, **SLOWLY)
    wait_for(lambda: len(lines(log)) > 4)
    os.kill(lines(log)[0][3], signal.SIGKILL)
    assert (process.communicate(timeout=60)[1], process.returncode) == ("", 0)
    assert results(path) == whole
    assert steps(log) <= 3 * STEPS + 4 * SENT


STOPS = [(1, signal.SIGINT), (2, signal.SIGINT), (2, signal.SIGTERM)]


@pytest.mark.slow
@pytest.mark.parametrize(("jobs", "number"), STOPS)
def test_ctrl_c_saves_and_says_how_to_go_on(jobs, number, whole, tmp_path):
    path, log = tmp_path / "a study", tmp_path / "log"
    process = started(path, jobs, log, **SLOWLY)
    wait_for(lambda: len(lines(log)) > 4)
    os.killpg(process.pid, number)  # a terminal and a batch system send it to workers too
    errors = process.communicate(timeout=60)[1]
    assert (process.returncode, f"\nheavytop resume '{path}'\n" in errors) == (130, True)
    assert not any(alive(pid) for *_, pid in lines(log))
    assert finished(path, jobs, log) == (0, "")
    assert results(path) == whole
    # alone, not even the chunk at hand
    assert steps(log) <= 3 * STEPS + (jobs > 1) * 2 * jobs * SENT


def test_one_writes_and_the_second_is_refused_by_name(tmp_path):
    with Journal.open(tmp_path, PARAMETERS):
        with pytest.raises(InUse, match=rf"is being written by process {os.getpid()} on \S+$"):
            done(tmp_path, PARAMETERS)
        assert Journal.read(tmp_path).parameters == PARAMETERS  # reading is for everybody


@pytest.mark.slow
def test_a_full_disk_leaves_a_folder_that_goes_on(whole, tmp_path):
    path, log = tmp_path / "study", tmp_path / "log"
    code, errors = finished(path, 2, log, TOY_FILE_LIMIT="400000", **SLOWLY)
    assert (code, f"cannot write {path / 'study.jsonl'}" in errors) == (4, True)
    assert finished(path, 2, log) == (0, "")
    assert results(path) == whole


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_task_that_fails_stops_no_other_and_stays_so(jobs, tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_REFUSES", NAMES[1])
    for _ in range(2):
        journal = Journal.read(done(tmp_path, PARAMETERS, jobs=jobs))
        last = [journal.record(task).last for task in NAMES]
        assert [each.failed for each in last] == [None, "too steep", None]
        assert [each.done for each in last] == [True, False, True]
        assert journal.rows(NAMES[1])  # what it gave before is kept
        monkeypatch.delenv("TOY_REFUSES", raising=False)


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_bug_in_a_task_is_raised(jobs, monkeypatch):
    monkeypatch.setenv("TOY_BUG", NAMES[1])
    with pytest.raises(ZeroDivisionError, match="a slip") as bug:
        run(Journal(PARAMETERS), jobs=jobs)
    cause = str(bug.value.__cause__) if jobs > 1 else str(bug.traceback[-1])
    assert "in advance" in cause


def test_nothing_in_the_current_folder_is_imported(tmp_path, monkeypatch):
    for name in ("json", "queue", "ctypes"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('executed')")
    monkeypatch.chdir(tmp_path)
    journal = Journal(PARAMETERS)
    run(journal, jobs=2)
    assert journal.record(NAMES[0]).ended


# --- executors of others ------------------------------------------------------------------------


def sliced(path, executor):
    return done(path, PARAMETERS, executor=executor, slice_s=0.0)


class Here(Executor):
    """An executor that does a slice when it is asked for it, and can be told to lose some."""

    workers = 1

    def __init__(self, lose=lambda task, times: None):
        self.sent, self._lose = [], lose

    def submit(self, fn, /, *args):
        task = args[2]
        self.sent.append(task)
        future = Future()
        if fault := self._lose(task, self.sent.count(task)):
            future.set_exception(fault)
        else:
            future.set_result(fn(*args))
        return future


KilledWorker = type("KilledWorker", (Exception,), {})  # as dask calls it


def test_threads_write_the_same_files_until_they_are_shut_down(whole, tmp_path):
    with Threads(3) as pool:
        assert results(sliced(tmp_path / "threads", pool)) == whole
    with pytest.raises(StoppedEarly, match="is accepted: RuntimeError: cannot schedule new"):
        sliced(tmp_path / "study", pool)


LOSSES = [BrokenExecutor("gone"), KilledWorker("gone"), KeyboardInterrupt()]


@pytest.mark.parametrize("fault", LOSSES)
def test_a_task_whose_worker_is_lost_is_sent_again(fault, whole, tmp_path):
    away = Here(lambda task, times: fault if times == 2 else None)
    assert results(sliced(tmp_path / "study", away)) == whole
    assert min(map(away.sent.count, NAMES)) > 2


def test_a_task_that_loses_its_worker_twice_ends_the_study(whole, tmp_path):
    bad = NAMES[2]
    away = Here(lambda task, times: KilledWorker("four died") if task == bad else None)
    with pytest.raises(StoppedEarly) as lost:
        sliced(tmp_path / "study", away)
    assert lost.value.outcome is Stop.WORKER_LOST
    assert f"the worker on {bad} was lost twice (KilledWorker: four died)" in str(lost.value)
    assert away.sent.count(bad) == 2
    assert any(Journal.read(tmp_path / "study").record(task).ended for task in NAMES[:2])
    assert results(sliced(tmp_path / "study", Here())) == whole


def test_after_a_loss_tasks_run_one_at_a_time_until_none_is_suspected():
    """A broken pool does not tell which of its tasks killed the process."""
    sent = []

    class Pool(Executor):
        workers = 2

        def submit(self, fn, /, *args):
            sent.append((args[2], Future()))
            if len(sent) == 3:
                for _, each in sent:
                    each.set_exception(BrokenExecutor("all of them"))
            elif len(sent) > 3:
                assert len(sent) > 6 or all(each.done() for _, each in sent[:-1])
                sent[-1][1].set_result(fn(*args))
            return sent[-1][1]

    store = Journal(PARAMETERS)
    run(store, executor=Pool(), slice_s=0.01)
    assert {task for task, _ in sent[3:6]} == set(NAMES)
    assert all(store.record(task).ended for task in NAMES)


def test_a_worker_with_other_versions_is_refused_by_name(tmp_path):
    other = {**PARAMETERS, "versions": {**versions(), "heyoka": "7.0.0"}}
    found = f'versions.heyoka: "{versions()["heyoka"]}" there, "7.0.0" here'
    with pytest.raises(ForeignFile, match=found), Threads(1) as pool:
        done(tmp_path / "study", other, executor=pool)
    assert results(tmp_path / "study") == {}


def test_a_process_does_one_slice_at_a_time(monkeypatch):
    """The precision of the libraries below is global: threads would change each other's."""
    alone = threading.Lock()

    def advance(*_):
        assert alone.acquire(blocking=False)
        time.sleep(0.01)
        alone.release()
        yield Chunk(done=True)

    monkeypatch.setattr(study.study_of(PARAMETERS), "advance", advance)
    with Threads(4) as pool:
        run(Journal(PARAMETERS), executor=pool)
