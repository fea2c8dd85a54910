"""What all tests begin with: Ctrl-C as in a terminal, also where whoever began them ignores it."""

import signal

import pytest


@pytest.fixture(scope="session", autouse=True)
def interruptible():
    """nohup, or a job in the background, hands down SIGINT ignored, to this and every process."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
