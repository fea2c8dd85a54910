"""This computer as one with another system: no heyoka, and nothing that only POSIX has.

Every process whose PYTHONPATH begins with this folder is such a one, as are those that it begins.
The standard library, which knows where it is, keeps what it needs.
"""

import builtins
import os
import signal
import sys

POSIX = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
LACKING = {
    os: ("fchmod", "fork", "getuid", "killpg", "sched_getaffinity"),
    signal: ("pthread_sigmask", "SIGALRM", "SIGHUP"),
}
import_module = builtins.__import__


def imported(name, *given, **named):
    """Import a module, unless it is this package that asks for one of POSIX."""
    asks = (*given, named.get("globals"), None)[0] or {}
    if name in POSIX and asks.get("__name__", "").startswith("heavytop"):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return import_module(name, *given, **named)


for module, names in LACKING.items():
    for each in names:
        delattr(module, each)
sys.modules["heyoka"] = None
builtins.__import__ = imported
