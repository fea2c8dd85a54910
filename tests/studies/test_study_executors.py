"""Whoever does the tasks, threads, processes or strangers, the files are those of one process."""

import threading
import time
from concurrent.futures import BrokenExecutor, Executor, Future
from concurrent.futures import ThreadPoolExecutor as Threads

import pytest

from heavytop.doctor import versions
from heavytop.errors import ForeignFile, Stop, StoppedEarly
from heavytop.studies import study
from heavytop.studies.journal import Chunk, Journal
from heavytop.studies.study import run

from . import toy
from .toy import results

PARAMETERS = {"kind": "toy", "options": {"tasks": 4, "blocks": 24}, "versions": versions()}
NAMES = tuple(f"henon/{i:03d}" for i in range(4))


@pytest.fixture(autouse=True)
def short(toys, monkeypatch):
    """A toy that is quick."""
    monkeypatch.setenv("TOY_PAUSE", "0.001")


def done(path, **how):
    return toy.done(path, PARAMETERS, slice_s=0.01, **how)


@pytest.fixture
def whole(tmp_path):
    """Return the files of a study that one process did."""
    return results(done(tmp_path / "whole"))


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


def test_threads_write_the_same_files(whole, tmp_path):
    with Threads(3) as pool:
        assert results(done(tmp_path / "threads", executor=pool)) == whole
    # it was shut down
    with pytest.raises(StoppedEarly, match="is accepted: RuntimeError: cannot schedule new"):
        done(tmp_path / "study", executor=pool)


@pytest.mark.parametrize(
    "fault", [BrokenExecutor("gone"), KilledWorker("gone"), KeyboardInterrupt()]
)
def test_a_task_whose_worker_is_lost_is_sent_again(fault, whole, tmp_path):
    away = Here(lambda task, times: fault if times == 2 else None)
    assert results(done(tmp_path / "study", executor=away)) == whole


def test_a_task_that_loses_its_worker_twice_ends_the_study(whole, tmp_path):
    bad = NAMES[2]
    away = Here(lambda task, times: KilledWorker("four died") if task == bad else None)
    with pytest.raises(StoppedEarly) as lost:
        done(tmp_path / "study", executor=away)
    assert lost.value.outcome is Stop.WORKER_LOST
    assert f"the worker on {bad} was lost twice (KilledWorker: four died)" in str(lost.value)
    assert away.sent.count(bad) == 2
    assert any(Journal.read(tmp_path / "study").record(task).ended for task in NAMES[:2])
    assert results(done(tmp_path / "study", executor=Here())) == whole


def test_after_a_loss_tasks_run_one_at_a_time_until_none_is_suspected():
    """A broken pool does not tell which of its tasks killed the process."""
    sent = []

    class Pool(Executor):
        workers = 2

        def submit(self, fn, /, *args):
            sent.append((args[2], Future()))
            if len(sent) == 4:
                for _, each in sent:
                    each.set_exception(BrokenExecutor("all of them"))
            elif len(sent) > 4:
                assert len(sent) > 8 or all(each.done() for _, each in sent[:-1])
                sent[-1][1].set_result(fn(*args))
            return sent[-1][1]

    store = Journal(PARAMETERS)
    run(store, executor=Pool(), slice_s=0.01)
    assert {task for task, _ in sent[4:8]} == set(NAMES)
    assert all(store.record(task).ended for task in NAMES)


def test_a_worker_with_other_versions_is_refused_by_name(tmp_path):
    other = {**PARAMETERS, "versions": {**versions(), "heyoka": "7.0.0"}}
    found = f'versions.heyoka: "{versions()["heyoka"]}" there, "7.0.0" here'
    with pytest.raises(ForeignFile, match=found), Threads(1) as pool:
        toy.done(tmp_path / "study", other, executor=pool)
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
