"""A worker: a process that follows tasks for the one that writes.

Orders come in as lines of JSON, pieces go out as lines of JSON, and nothing else passes. After
every piece it waits for the word to go on, so that no more than one is ever on its way.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import threading
from contextlib import suppress
from queue import SimpleQueue
from typing import IO, Any

from heavytop.studies.ledger.canonical import canonical
from heavytop.studies.ledger.telling import told

_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG

Orders = SimpleQueue[dict[str, Any]]


def main(module: str, parent: int) -> None:
    """Follow what is ordered on stdin until it closes; `module` is named by the parent's code."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    die_with(parent)
    source, channel = _private(0, "r"), _private(1, "w")
    os.dup2(2, 1)  # what a library prints is no message
    orders: Orders = SimpleQueue()
    threading.Thread(target=_listen, args=(source, orders), daemon=True).start()
    while True:
        _obey(module, orders.get(), orders, channel)


def die_with(parent: int) -> None:
    """End when the parent ends, however it does; where Linux helps, even inside a long step."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
    if os.getppid() != parent:  # it went before this was asked for
        os._exit(0)


def _private(number: int, mode: str) -> IO[str]:
    """A standard stream under another number, which libraries do not know."""
    stream = open(os.dup(number), mode, encoding="utf-8", newline="\n")  # noqa: SIM115, PTH123
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, number)
    os.close(nothing)
    return stream


def _listen(source: IO[str], orders: Orders) -> None:
    """Pass on the orders; when there can be no more, end at once."""
    for line in source:
        orders.put(json.loads(line))
    os._exit(0)


def _obey(module: str, order: dict[str, Any], orders: Orders, channel: IO[str]) -> None:
    """Follow one task; after a piece that is not the last, wait for the word to go on."""
    for message in told(module, order["identity"], order["task"], order["checkpoint"]):
        _say(channel, message)
        if "piece" in message and not message["piece"]["done"]:
            orders.get()


def _say(channel: IO[str], message: dict[str, Any]) -> None:
    channel.write(canonical(message) + "\n")
    channel.flush()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
