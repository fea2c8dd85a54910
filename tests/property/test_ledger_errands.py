"""Whoever does the tasks, threads, processes or strangers, the files are those of one process."""

import json
import multiprocessing
import os
import signal
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from concurrent.futures import ThreadPoolExecutor as Threads
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import pytest

from heavytop.cli.exits import exit_code
from heavytop.errors import ForeignFile, ForeignWorker, NoWorkerWarning, Stop, StoppedEarly
from heavytop.machine import versions
from heavytop.studies.ledger import Folder, Study, errands, run, study_of
from heavytop.studies.ledger.effort import BrokenTask
from heavytop.studies.ledger.errand import errand
from heavytop.studies.ledger.kinds import KINDS

TOYS = Path(__file__).parent / "toys"
IDENTITY = {"kind": "toy", "options": {"tasks": 4, "blocks": 24}, "versions": versions()}
STEPS = 50 * 24  # of one task
LONGEST = 50 * 8  # of one piece


@pytest.fixture(autouse=True)
def toys(monkeypatch):
    monkeypatch.syspath_prepend(str(TOYS))
    monkeypatch.setitem(KINDS, "toy", "toy_study")
    monkeypatch.setitem(KINDS, "lonely", "lonely")
    monkeypatch.setattr(errands, "SECONDS", 0.01)


@pytest.fixture
def study():
    return study_of(IDENTITY)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the files of a study that one process did."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(TOYS))
        patch.setenv("TOY_PAUSE", "0")
        study = Study(IDENTITY, [f"henon/{i:03d}" for i in range(4)], "toy_study")
        return results(done(study, tmp_path_factory.mktemp("whole") / "study"))


def done(study, path, **how):
    with Folder.create_or_open(path, study.identity) as folder:
        run(study, folder, **how)
    return path


def results(path):
    """Return every file that must be the same: all but the lock and the costs."""
    files = (p for p in path.rglob("*") if p.is_file() and p.name not in ("lock", "cost.json"))
    return {p.relative_to(path).as_posix(): p.read_bytes() for p in files}


def processes():
    import enrolled

    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(2, mp_context=spawn, initializer=enrolled.enroll)


def lines(log):
    """Return what was done: task, first and last step, process."""
    words = (line.split() for line in log.read_text().splitlines()) if log.exists() else ()
    return [(task, int(a), int(b), int(pid)) for task, a, b, pid in words]


class Here(Executor):
    """An executor that does an errand when it is asked for it, and can be told to lose some."""

    workers = 1

    def __init__(self, lose=lambda task, times: None):
        self.sent, self._lose = [], lose

    def submit(self, fn, /, *args, **kwargs):
        (text,) = args
        assert fn is errand
        task = json.loads(text)["task"]
        self.sent.append(task)
        future = Future()
        if fault := self._lose(task, self.sent.count(task)):
            future.set_exception(fault)
        else:
            future.set_result(fn(text))
        return future


class KilledWorker(Exception):
    """As dask calls it."""


def test_threads_write_the_same_files(study, whole, tmp_path):
    with Threads(3) as pool:
        assert results(done(study, tmp_path / "threads", executor=pool)) == whole


def test_processes_write_the_same_files_even_when_one_is_killed(
    study, whole, tmp_path, monkeypatch
):
    path, log = tmp_path / "processes", tmp_path / "log"
    monkeypatch.setenv("TOY_LOG", str(log))
    monkeypatch.setenv("TOY_PAUSE", "0.01")
    seen = []

    def kill(progress):
        seen.append(progress)
        if len(seen) == 6:
            os.kill(lines(log)[-1][3], signal.SIGKILL)

    with processes() as pool, pytest.raises(StoppedEarly) as lost:
        done(study, path, executor=pool, on_progress=kill)
    assert lost.value.outcome is Stop.WORKER_LOST
    assert "the executor takes no errand: BrokenProcessPool" in str(lost.value)
    assert exit_code(lost.value) == 4
    assert str(lost.value).endswith(f"heavytop resume {path}")
    before = len(lines(log))
    with processes() as pool:
        assert results(done(study, path, executor=pool)) == whole
    pids = [{pid for *_, pid in part} for part in (lines(log)[:before], lines(log)[before:])]
    assert not pids[0] & pids[1]
    twice = sum(b - a for _, a, b, _ in lines(log)) - 4 * STEPS
    assert twice <= 2 * 2 * 3 * LONGEST  # what was away: of each errand some pieces


def test_a_task_whose_worker_is_lost_goes_out_again(study, whole, tmp_path):
    for fault in (BrokenExecutor("gone"), KilledWorker("gone"), KeyboardInterrupt()):
        away = Here(lambda task, times, f=fault: f if times == 2 else None)
        path = tmp_path / type(fault).__name__
        assert results(done(study, path, executor=away)) == whole


def test_a_task_that_loses_its_worker_twice_ends_the_study(study, whole, tmp_path):
    bad = study.tasks[2]
    away = Here(lambda task, times: KilledWorker("four died") if task == bad else None)
    with pytest.raises(StoppedEarly) as lost:
        done(study, tmp_path / "study", executor=away)
    assert lost.value.outcome is Stop.WORKER_LOST
    assert f"the worker on {bad} was lost twice (KilledWorker: four died)" in str(lost.value)
    assert away.sent.count(bad) == 2
    with Folder.look(tmp_path / "study") as folder:
        assert any(folder.entry(task).done for task in study.tasks[:2])
    assert results(done(study, tmp_path / "study", executor=Here())) == whole


def test_what_comes_back_with_the_last_loss_is_kept(study, tmp_path):
    """Two errands are away: one is lost for good, and the other ends when it is called off."""
    bad, good = study.tasks[:2]

    class Late(Future):
        def __init__(self, text):
            super().__init__()
            self.text = text

        def cancel(self):
            self.set_result(errand(self.text))
            return False

    class Slow(Here):
        def submit(self, fn, /, *args, **kwargs):
            late = json.loads(args[0])["task"] == good
            return Late(*args) if late else super().submit(fn, *args, **kwargs)

    away = Slow(lambda task, times: KilledWorker("died"))
    with pytest.raises(StoppedEarly):
        done(study, tmp_path / "study", executor=away)
    assert away.sent == [bad, bad]
    with Folder.look(tmp_path / "study") as folder:
        assert folder.entry(good).checkpoint


def test_no_more_than_two_errands_a_worker_are_away(study):
    class Slow(Here):
        workers = 2
        most = 0

        def submit(self, fn, /, *args, **kwargs):
            self.sent.append(Future())
            self.most = max(self.most, sum(not f.done() for f in self.sent))
            if self.most == 4:
                for future in self.sent:
                    future.set_exception(ValueError("no heavytop here"))
            return self.sent[-1]

    slow = Slow()
    with pytest.raises(StoppedEarly, match="did not come back: ValueError: no heavytop here"):
        run(study, executor=slow)
    assert slow.most == len(slow.sent) == 4


def test_without_workers_it_does_not_wait_for_ever(study, tmp_path, monkeypatch):
    monkeypatch.setattr(errands, "PATIENCE_S", 0.2)

    class Deserted(Executor):
        workers = 0

        def submit(self, fn, /, *args, **kwargs):
            return Future()

    with pytest.raises(StoppedEarly, match="no worker for 0 s") as stopped:
        done(study, tmp_path / "study", executor=Deserted())
    assert stopped.value.outcome is Stop.WORKER_LOST


def test_that_no_worker_is_left_is_said_once_each_time(study, tmp_path, monkeypatch):
    monkeypatch.setattr(errands, "PATIENCE_S", 1.5)
    monkeypatch.setattr(errands, "NOTICED_S", 0.25)
    monkeypatch.setattr(errands, "TICK_S", 0.01)
    now = [0.0]
    monkeypatch.setattr(errands, "time", SimpleNamespace(monotonic=lambda: now[0]))

    class Deserted(Executor):
        @property
        def workers(self):  # one comes, and is gone again
            now[0] += 0.05
            return int(0.6 < now[0] < 0.9)

        def submit(self, fn, /, *args, **kwargs):
            return Future()

    with (
        pytest.warns(NoWorkerWarning, match=r"unless one comes, the study ends in 1 s") as told,
        pytest.raises(StoppedEarly, match="no worker for 2 s"),
    ):
        done(study, tmp_path / "study", executor=Deserted())
    assert len(told) == 2


def test_a_worker_that_is_gone_for_a_moment_is_not_missed(study, tmp_path, monkeypatch):
    monkeypatch.setattr(errands, "NOTICED_S", 5.0)
    monkeypatch.setattr(errands, "PATIENCE_S", 0.3)  # before anything is said
    deserted = type("Deserted", (Executor,), {"workers": 0, "submit": lambda *_: Future()})
    with pytest.raises(StoppedEarly, match="no worker"):
        done(study, tmp_path / "study", executor=deserted())


def test_a_worker_with_other_versions_is_refused_by_name(tmp_path):
    other = {**IDENTITY, "versions": {**versions(), "heyoka": "7.0.0"}}
    with pytest.raises(ForeignWorker) as refusal, Threads(1) as pool:
        done(study_of(other), tmp_path / "study", executor=pool)
    assert str(refusal.value).startswith(f"process {os.getpid()} on ")
    found = f'versions.heyoka: "{versions()["heyoka"]}" there, "7.0.0" here'
    assert refusal.value.differences == (found,)
    assert str(refusal.value).endswith(f"a worker unlike this study: {found}")
    assert exit_code(refusal.value) == 6
    assert list(results(tmp_path / "study")) == ["study.json"]


def test_ctrl_c_calls_off_what_waits_and_keeps_what_is_done(study, whole, tmp_path):
    class Stuck(Here):
        """It does the first errands, and begins no other."""

        waiting = ()

        def submit(self, fn, /, *args, **kwargs):
            if len(self.sent) < 3:
                return super().submit(fn, *args, **kwargs)
            self.waiting = (*self.waiting, Future())
            return self.waiting[-1]

    seen = []

    def interrupt(progress):
        seen.append(progress)
        if len(seen) == 2:  # the first piece of the first errand
            os.kill(os.getpid(), signal.SIGINT)

    path, pool = tmp_path / "study", Stuck()
    with pytest.raises(StoppedEarly) as stopped:
        done(study, path, executor=pool, on_progress=interrupt)
    assert stopped.value.outcome is Stop.INTERRUPTED
    assert exit_code(stopped.value) == 130
    assert pool.waiting
    assert all(future.cancelled() for future in pool.waiting)
    with Folder.look(path) as folder:
        assert folder.entry(study.tasks[0]).checkpoint
        assert folder.entry(study.tasks[1]).checkpoint
    assert results(done(study, path, executor=Here())) == whole


def test_an_executor_that_was_shut_down_says_so(study, tmp_path):
    pool = Threads(1)
    pool.shutdown()
    with pytest.raises(StoppedEarly, match="takes no errand: RuntimeError: cannot schedule new"):
        done(study, tmp_path / "study", executor=pool)


def test_what_a_task_raises_comes_back(study, tmp_path, monkeypatch):
    monkeypatch.setenv("TOY_REFUSES", study.tasks[1])
    book = run(study, executor=Here())
    failed = [book.entry(task).failed for task in study.tasks]
    assert failed == [None, "too steep", None, None]
    monkeypatch.setenv("TOY_BUG", study.tasks[1])
    with pytest.raises(BrokenTask, match=f"{study.tasks[1]}: ZeroDivisionError: a slip") as bug:
        run(study, executor=Here())
    assert "in _misbehave" in bug.value.__notes__[0]


def test_a_refused_checkpoint_names_its_file(study, tmp_path, monkeypatch):
    import toy_study

    def refuse(identity, task, checkpoint):
        raise ForeignFile("steps: none")
        yield

    monkeypatch.setattr(toy_study, "follow", refuse)
    with pytest.raises(ForeignFile, match=r"study/tasks/henon/00./checkpoint.json: steps: none"):
        done(study, tmp_path / "study", executor=Here())


def test_a_process_does_one_errand_at_a_time():
    """The precision of the libraries below is global: threads would change each other's."""
    import lonely

    with Threads(4) as pool:
        run(study_of({"kind": "lonely"}), executor=pool)
    assert lonely.MOST == [1]


def test_an_errand_ends_soon_after_its_time(study, monkeypatch):
    clock = count(0, 0.05)
    monkeypatch.setattr(
        "heavytop.studies.ledger.errand.time", SimpleNamespace(monotonic=clock.__next__)
    )
    asked = {"identity": study.identity, "task": study.tasks[0], "checkpoint": None}
    found = json.loads(errand(json.dumps({**asked, "seconds": 0.12})))
    assert len(found) == 3
    assert len(json.loads(errand(json.dumps({**asked, "seconds": 0})))) == 1


def test_an_executor_takes_the_place_of_jobs(study):
    here = Here()
    assert run(study, jobs=2, executor=here).entry(study.tasks[0]).done
    assert set(here.sent) == set(study.tasks)


def test_errands_go_by_the_kind_of_a_study(study):
    with pytest.raises(ValueError, match="errands go by the kind"):
        run(Study(IDENTITY, study.tasks, "elsewhere"), executor=Here())
    with pytest.raises(ForeignFile, match="kind = 'unheard': not a kind of study known here"):
        errand(json.dumps({"identity": {"kind": "unheard"}, "task": "a", "checkpoint": None,
                           "seconds": 1}))  # fmt: skip


def test_what_an_executor_does_not_say_is_counted_here(monkeypatch):
    monkeypatch.setattr(errands, "usable_cpus", lambda: 7)
    assert errands.workers(Executor()) == 7
    with Threads(3) as pool:
        assert errands.workers(pool) == 3
    Gone = type("Gone", (Executor,), {"workers": 0})
    assert errands.workers(Gone()) == 1
