"""Processes that a test began by way of others: what they said of themselves, and their end."""

import os
import time
from pathlib import Path


def soon(path):
    """What a file says, as soon as it says something."""
    for _ in range(400):
        if path.exists() and path.read_text():
            return path.read_text()
        time.sleep(0.05)
    raise TimeoutError(path)


def gone(pid):
    """Whether a process has ended; one that nobody has asked after yet has."""
    for _ in range(100):
        try:
            os.kill(pid, 0)
            if Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z":
                return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.02)
    return False
