"""The keeper of a script: where who asked for it is gone, it goes, with all that it began.

It is a program of its own, ``keeper.py SCRIPT WORD…``, that knows nothing of the package and so
starts at once. Who asked holds the other end of its stdin: it closes with him, however he ends.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from typing import Final

BY_SIGNAL: Final = 128  # added to the number of the signal that ended a script, as shells do


def keep(*words: str) -> int:
    """The exit code of a script, run in the group of processes of its keeper.

    Parameters
    ----------
    *words : str
        Its path, and what it is given.

    Returns
    -------
    int
        Above 128, the number of the signal that ended it.
    """
    signal.signal(signal.SIGTERM, lambda *_: None)  # the group has it: the script may end as it can
    threading.Thread(target=_watch, daemon=True).start()
    nothing = (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0)
    command = [sys.executable, *words]
    pid = os.posix_spawn(sys.executable, command, os.environ, file_actions=[nothing])
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    return code if code >= 0 else BY_SIGNAL - code


def _watch() -> None:
    os.read(0, 1)  # nothing is ever written: it answers at the end
    os.kill(0, signal.SIGKILL)  # 0: the whole group, this process with it


if __name__ == "__main__":
    os._exit(keep(*sys.argv[1:]))
