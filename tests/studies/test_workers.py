"""Dask workers write the files that one process writes; what hangs in a worker is ended."""

import json
import multiprocessing
import os
import signal
import time
from contextlib import ExitStack, closing, contextmanager
from threading import Thread, Timer

import pytest

from heavytop import errors
from heavytop.doctor import versions
from heavytop.studies import study, workers

from ..processes import alive, begin, soon, surroundings, wait_for
from . import toy
from .toy import TOYS, lines, results

pytestmark = [pytest.mark.usefixtures("toys"), pytest.mark.processes]

PARAMETERS = {"kind": "toy", "options": {"tasks": 5, "blocks": 20}, "versions": versions()}


@contextmanager
def dask(*options, **environment):
    """A process of dask that is ended in the end."""
    process = begin("-m", "dask", *options, env=surroundings(TOYS, **environment))
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=20)


def worker(place, address, *more, **environment):
    alone = ("--nthreads", 1, "--no-nanny", "--no-dashboard", "--local-directory", place)
    return dask("worker", address, *alone, *more, **environment)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    pytest.importorskip("distributed", reason="dask is not installed: pip install '.[cluster]'")
    place = tmp_path_factory.mktemp("dask")
    options = ("--host", "127.0.0.1", "--port", 0, "--no-dashboard", "--no-show")
    with dask("scheduler", *options, "--scheduler-file", place / "known"):
        yield place, json.loads(soon(place / "known"))["address"]


def done(path, **how):
    return results(toy.done(path, PARAMETERS, slice_s=0.02, **how))


def test_two_workers_write_the_same_files_and_a_killed_one_is_done_without(scheduler, tmp_path):
    """One of them is killed in the middle: what it was at is done again by the other."""
    place, address = scheduler
    log = tmp_path / "log"
    with ExitStack() as stack:
        slow = {"TOY_LOG": str(log), "TOY_PAUSE": "0.01"}
        two = [stack.enter_context(worker(place, address, **slow)) for _ in range(2)]

        def kill(progress):
            if len({pid for *_, pid in lines(log)}) == 2 and two[0].poll() is None:
                two[0].kill()

        executor = stack.enter_context(workers.executor_at(address, timeout_s=60))
        wait_for(lambda: executor.workers == 2)
        there = done(tmp_path / "there", executor=executor, on_progress=kill)
        assert two[0].poll() == -9
    assert there == done(tmp_path / "here")


def test_a_scheduler_without_workers_and_an_address_without_a_scheduler(scheduler):
    _, address = scheduler
    for wrong in (address, "tcp://127.0.0.1:1", "nonsense", "smoke://hill:1"):
        with pytest.raises(errors.NoScheduler, match=f"^{wrong}: no dask scheduler with a worker"):
            workers.executor_at(wrong, timeout_s=0.5)


# --- calls with a limit of time --------------------------------------------------------------


@pytest.fixture
def process():
    with closing(workers.TimedWorker()) as worker:
        yield worker


def test_a_call_that_hangs_is_killed_and_the_next_one_is_done(process):
    first = process.call(os.getpid)
    for number in workers.STOPS:  # which its whole group gets
        os.kill(first, number)
    assert process.call(os.getpid, timeout=60) == first != os.getpid()
    with pytest.raises(workers.TimedOut):
        process.call(time.sleep, 600, timeout=0.5)
    assert not alive(first)
    second = process.call(os.getpid)
    assert second != first
    process.close()
    assert not alive(second)


ENDS = [((os._exit, 3), "code 3"), ((os.abort,), "SIGABRT"), ((int, "x"), "ValueError: invalid")]


@pytest.mark.parametrize(("call", "why"), ENDS)
def test_a_worker_that_dies_is_told_from_one_that_hangs(process, call, why):
    with pytest.raises(workers.WorkerLost, match=why):
        process.call(*call)
    assert process.call(abs, -1, timeout=5) == 1  # starting it is no part of the call


def test_after_an_interrupted_call_the_next_one_has_its_own_answer(process):
    process.call(abs, -1)
    Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        process.call(time.sleep, 60)
    assert process.call(abs, -2, timeout=20) == 2


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(("looks", "grace"), [(False, 0.2), (True, 0.4)])
def test_what_does_not_look_at_the_stop_is_interrupted_after_the_grace(number, looks, grace):
    handlers = [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]
    began, last = time.monotonic(), None
    Timer(0.1, os.kill, (os.getpid(), number)).start()
    with workers.stop_signal(grace) as stop:
        while not (looks and stop.is_set()) and time.monotonic() < began + 60:
            time.sleep(0.01)
        last = time.monotonic()
    assert stop.is_set()
    assert (last is not None) == looks  # cut off in the loop, or at its end
    assert time.monotonic() - began < 30
    assert handlers == [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]
    time.sleep(0.5)  # what ended in time is not interrupted afterwards


def test_a_process_that_is_being_started_is_not_cut_off():
    """It would say so in a traceback of its own."""
    done = False
    with workers.stop_signal(0.2):
        with workers.start_processes():
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.5)
            done = True
        time.sleep(60)
    assert done


def test_what_is_refused_in_a_worker_is_refused_here(process):
    with pytest.raises(errors.ForeignFile, match="kind = 'unheard'"):
        process.call(study.study_of, {"kind": "unheard"})


def begins():
    return workers.TIMED_WORKER.call(abs, -1)


def lingers():
    Thread(target=time.sleep, args=(60,)).start()
    return 1


ENDS = [(begins, workers.Processes.shutdown), (lingers, lambda pool: pool.close(0.5))]


@pytest.mark.parametrize(("call", "end"), ENDS)
def test_a_worker_of_any_executor_ends_with_the_process_or_the_thread_that_it_began(call, end):
    """At its end it would wait for that process, which waits for calls, or for that thread."""
    pool = workers.Processes(1)
    assert pool.submit(call).result() == 1
    [worker] = pool.processes
    (ends := Thread(target=end, args=(pool,), daemon=True)).start()
    ends.join(20)
    assert not ends.is_alive()
    assert workers.connection.wait([worker.sentinel], 5)


def test_a_daemon_as_a_worker_of_dask_is_can_begin_one(process, monkeypatch):
    config = multiprocessing.current_process()._config
    monkeypatch.setitem(config, "daemon", True)
    assert process.call(abs, -1) == 1
    assert config["daemon"] is True
