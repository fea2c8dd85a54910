"""What all tests begin with: Ctrl-C as in a terminal, and no width of one."""

import os
import signal
from importlib import import_module
from pathlib import Path

import pytest

for name in ("COLUMNS", "LINES"):  # readline, which pytest imports, sets them for all processes
    os.environ.pop(name, None)
    os.unsetenv(name)


@pytest.fixture(scope="session", autouse=True)
def interruptible():
    """nohup, or a job in the background, hands down SIGINT ignored, to this and every process."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def script(monkeypatch):
    """Import a script of validation/ or docs/ by its name."""
    for folder in ("validation", "docs"):
        monkeypatch.syspath_prepend(str(Path(__file__).parents[1] / folder))
    return import_module
