"""Processes that a test began by way of others: what they said of themselves, and their end."""

import time
from pathlib import Path


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
