"""A kind of study for the tests of the runner: a chaotic map, whose chunks end at random."""

import os
import random
import time
from pathlib import Path

from heavytop.errors import HeavyTopError
from heavytop.studies.journal import Chunk

BLOCK = 50  # steps


def tasks(parameters):
    return [f"henon/{i:03d}" for i in range(parameters["options"]["tasks"])]


def advance(parameters, task, checkpoint):
    """Yield chunks of random length: what they give in all is always the same."""
    where = checkpoint or {"steps": 0, "x": (int(task[-3:]) / 100).hex(), "y": (0.1).hex()}
    steps, x, y = where["steps"], float.fromhex(where["x"]), float.fromhex(where["y"])
    total = parameters["options"]["blocks"] * BLOCK
    while steps < total:
        begun, first, rows = time.monotonic(), steps, []
        time.sleep(float(os.environ.get("TOY_PAUSE", "0.003")))
        for _ in range(random.SystemRandom().randint(1, 8)):  # blocks in a chunk
            for _ in range(BLOCK * (steps < total)):
                x, y, steps = 1 - 1.4 * x * x + y, 0.3 * x, steps + 1
            rows.append({"steps": steps, "x": x.hex(), "ballast": [x.hex()] * 100})
            if steps == total:
                break
        if log := os.environ.get("TOY_LOG"):
            with Path(log).open("a") as file:
                file.write(f"{task} {first} {steps} {os.getpid()}\n")
        if task in os.environ.get("TOY_BUG", ""):
            raise ZeroDivisionError("a slip")
        where = {"steps": steps, "x": x.hex(), "y": y.hex()}
        how = {"fraction": steps / total, "seconds": time.monotonic() - begun}
        yield Chunk(where, tuple(rows), done=steps == total, **how)
        if task in os.environ.get("TOY_REFUSES", ""):
            raise HeavyTopError("too steep")
