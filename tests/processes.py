"""Processes that a test begins, or began by way of others: what they said, and their end."""

import os
import subprocess
import sys
import time
from pathlib import Path

import heavytop

SOURCE = Path(heavytop.__file__).parents[1]


def surroundings(*folders, **more):
    """Those of a process that imports the package, and what lies in other folders first."""
    return os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (*folders, SOURCE)))} | more


def begin(*words, env=None):
    """A process of Python."""
    how = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "start_new_session": True}
    command = [sys.executable, *map(str, words)]
    return subprocess.Popen(command, env=env or surroundings(), encoding="utf-8", **how)


def wait_for(condition, seconds=60):
    """What a condition is as soon as it holds."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return found


def soon(path):
    """What a file says, as soon as it says something."""
    return wait_for(lambda: path.exists() and path.read_text(), seconds=20)


def alive(pid):
    """Whether a process is there and not only waits to be buried."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
