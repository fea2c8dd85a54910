"""Ctrl-C ends what takes long, within a second."""

import os
import signal
import subprocess
import sys
import time

import pytest

from ..processes import soon

BEGIN = "import signal, pathlib, sys; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
SICM = "A=3.28e-4, C=6.6e-5, gMR=0.0456, theta=[0.1] * 300, psidot=140"
SCENE = "ht.Scene(ht.Top(3.28e-4, 6.6e-5, 0.0456), ht.State(0.1, psidot=140), time={}, digits={})"
LONG = {
    "one thread": f"ht.propagate_many({SICM}, time=1e12, jobs=1)",
    "two threads": f"ht.propagate_many({SICM}, time=1e12, jobs=2)",
    "many digits": f"ht.propagate({SCENE.format(2, 3000)}, formulation='axis')",
}


@pytest.mark.slow
@pytest.mark.parametrize("call", LONG.values(), ids=LONG)
def test_ctrl_c_ends_it_within_a_second(call, tmp_path):
    """Late in the call, where the steps are; a process that was begun with SIGINT ignored, too."""
    ready = tmp_path / "ready"
    code = f"{BEGIN}import heavytop as ht\npathlib.Path({str(ready)!r}).write_text('on')\n{call}\n"
    run = subprocess.Popen([sys.executable, "-W", "ignore", "-c", code], stderr=subprocess.PIPE)
    try:
        soon(ready)
        time.sleep(2)
        assert run.poll() is None
        os.kill(run.pid, signal.SIGINT)
        began = time.monotonic()
        _, said = run.communicate(timeout=20)
        assert time.monotonic() - began < 5  # a second, and a busy machine
        assert run.returncode != 0
        assert b"KeyboardInterrupt" in said or b"the run was interrupted" in said
    finally:
        run.kill()
        run.wait()
