"""The keeper of a program: where who asked for it is gone, it goes, with its group of processes.

It is a program of its own, ``keeper.py FOLDER WORD…``, that knows nothing of the package and so
starts at once. Who asked holds the other end of its stdin: it closes with him, however he ends.
Then his folder for what is temporary goes as well, where it is told of one.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from typing import Final

REMOVE: Final = "import shutil, sys; shutil.rmtree(sys.argv[1], ignore_errors=True)"
BY_SIGNAL: Final = 128  # added to the number of the signal that ended it, as shells do

NOTHING: Final = (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0)  # its stdin


def keep(folder: str, *words: str) -> int:
    """The exit code of a program in Python, run in the group of processes of its keeper.

    Parameters
    ----------
    folder : str
        What is removed where who asked for it is gone; nothing where it is empty.
    *words : str
        What stands behind ``python``.

    Returns
    -------
    int
        Above 128, the number of the signal that ended it.
    """
    signal.signal(signal.SIGTERM, lambda *_: None)  # the group has it: it may end as it can
    threading.Thread(target=_watch, args=(folder,), daemon=True).start()
    command = [sys.executable, *words]
    pid = os.posix_spawn(sys.executable, command, os.environ, file_actions=[NOTHING])
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    return code if code >= 0 else BY_SIGNAL - code


def _watch(folder: str) -> None:
    os.read(0, 1)  # nothing is ever written: it answers at the end
    try:
        if folder:  # by a process of another group, as this one goes with all of its own
            command = [sys.executable, "-I", "-S", "-c", REMOVE, folder]
            os.posix_spawn(sys.executable, command, os.environ, setpgroup=0, file_actions=[NOTHING])
    finally:
        os.kill(0, signal.SIGKILL)  # 0: the whole group, this process with it


if __name__ == "__main__":
    os._exit(keep(*sys.argv[1:]))
