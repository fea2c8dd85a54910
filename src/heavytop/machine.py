"""The machine: its processor and the packages installed, on which the last bits of a run depend."""

from __future__ import annotations

import os
import platform
import re
from importlib import metadata
from pathlib import Path
from typing import Final

LIBRARIES: Final = ("heavytop", "heyoka", "numpy", "sympy", "mpmath", "scipy", "numba", "CyRK")


def versions() -> dict[str, str | None]:
    """What the last bits of a run depend on: libraries, Python and the processor."""
    here = {"python": platform.python_version(), "cpu": cpu_model() or platform.machine()}
    return {name: version(name) for name in LIBRARIES} | here


def version(name: str) -> str | None:
    """The installed version of a package, or None."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def cpu_model() -> str | None:
    """The processor's name, where the system tells it."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return platform.processor() or None
    found = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    return found.group(1).strip() if found else None


def usable_cpus() -> int:
    """The number of processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
