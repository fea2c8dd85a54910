"""A kind of study that counts how many of its tasks are done at the same moment."""

import time

from heavytop.studies.journal import Chunk

NOW = []
MOST = [0]


def tasks(parameters):
    return [f"t/{i}" for i in range(6)]


def advance(parameters, task, checkpoint):
    NOW.append(task)
    MOST[0] = max(MOST[0], len(NOW))
    time.sleep(0.01)
    NOW.remove(task)
    yield Chunk(rows=({"task": task},), done=True)
