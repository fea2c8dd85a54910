"""Studies done by dask workers, one of which is killed, end in the files of one process."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from claim import claim, finish

import heavytop as ht
from heavytop.studies.workers import executor_at

METHODS = ("taylor-axis", "taylor-axis-projected", "sofroniou-spaletta10", "dop853-cyrk")
ASKED = {"methods": METHODS, "periods": 1e5, "ensemble": 2, "samples": 13}
PLANE = {"x": "phidot=-20:20:2000", "y": "psidot=-150:150:2000"}
WORKERS = 2


def dask(*arguments):
    command = [sys.executable, "-m", "dask", *map(str, arguments), "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def result_files(folder):
    files = (p for p in folder.rglob("*") if p.is_file() and p.name != "lock")
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in files}


def all_there(executor):
    """Wait until every worker has come."""
    end = time.monotonic() + 60
    while executor.workers < WORKERS:
        if time.monotonic() > end:
            raise TimeoutError("the workers have not come in a minute")
        time.sleep(0.1)


def killer(worker):
    """What kills a worker when a third of the study is done."""

    def heard(now):
        if now.fraction > 1 / 3 and worker.poll() is None:
            worker.send_signal(signal.SIGKILL)
            worker.wait()

    return heard


def ended(processes):
    """End processes."""
    for process in processes:
        process.kill()
        process.wait()


def compared(name, make, place):
    """Make a study in one process and on two workers, one of which is killed, and compare."""
    began = time.perf_counter()
    make(folder=place / f"{name}-here", jobs=1)
    alone_s = time.perf_counter() - began
    address = f"tcp://127.0.0.1:{free_port()}"
    scheduler = dask("scheduler", "--host", "127.0.0.1", "--port", address.rpartition(":")[2])
    workers = [dask("worker", address, "--nthreads", 1, "--no-nanny") for _ in range(WORKERS)]
    try:
        with executor_at(address, timeout_s=30) as executor:
            all_there(executor)
            began = time.perf_counter()
            killed = killer(workers[0])
            make(folder=place / f"{name}-there", executor=executor, progress=killed)
            there_s = time.perf_counter() - began
    finally:
        ended((*workers, scheduler))
    one, other = (result_files(place / f"{name}-{where}") for where in ("here", "there"))
    different = [file for file in {*one, *other} if one.get(file) != other.get(file)]
    print(f"     {name}: {len(one)} files, {sum(map(len, one.values()))} bytes", *different)
    print(f"     one process {alone_s:.0f} s; two workers, one of them killed, {there_s:.0f} s")
    claim(f"{name}: workers that were not killed, of one", int(workers[0].returncode != -9), 0)
    claim(f"{name}: files that differ", len(different), 0)


SCENE = ht.load_scene("sicm-kicked")
with tempfile.TemporaryDirectory() as folder:
    os.environ["DASK_TEMPORARY_DIRECTORY"] = folder
    compared("drift", lambda **how: ht.drift(SCENE, **ASKED, **how), Path(folder))
    compared("atlas", lambda **how: ht.atlas(SCENE, **PLANE, **how), Path(folder))
finish()
