"""The versions of installed packages, and the machine, found without imports of the packages."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Mapping
from contextlib import suppress
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from heavytop.errors import IN_CLONE, INSTALL_HEYOKA

LIBRARIES: Final = (
    "heavytop", "heyoka", "numpy", "sympy", "mpmath", "python-flint", "scipy", "numba", "CyRK"
)  # fmt: skip
REQUIREMENT: Final = re.compile(r"""([\w.-]+)(?:.*?\bextra == ["']([^"']+))?""")


def versions() -> dict[str, str | None]:
    """Versions that the last bits of a run depend on: libraries, Python and the processor."""
    here = {"python": platform.python_version(), "cpu": cpu_model() or platform.machine()}
    return {name: version(name) for name in LIBRARIES} | here


def version(name: str) -> str | None:
    """The installed version of a package, or None."""
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(name)
    return None


def cpu_model() -> str | None:
    """The name of the processor, or None where the system does not give it."""
    with suppress(OSError):
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
        if found := re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE):
            return found[1].strip()
    return platform.processor() or None


def usable_cpus() -> int:
    """The number of processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def diagnosis() -> dict[str, Any]:
    """The state of this installation, as the document ``heavytop/doctor/2``.

    Returns
    -------
    dict
        ``versions`` by package (null where it is missing), ``python``, ``platform``, ``cpu``,
        ``cache`` (of compiled code), ``optional`` (extras, what they lack and how to install it)
        and ``missing`` (what pip would have installed on this system).

    Examples
    --------
    >>> sorted(diagnosis())
    ['cache', 'cpu', 'missing', 'optional', 'platform', 'python', 'schema', 'versions']
    """
    needed, *extras = requirements().items()
    lacking = {extra: [x for x in names if version(x) is None] for extra, names in extras}
    return {
        "schema": "heavytop/doctor/2",
        "versions": {name: version(name) for name in ("heavytop", *needed[1])},
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cpu": {"model": cpu_model(), "usable": usable_cpus()},
        "cache": cache(),
        "optional": {
            extra: {"missing": names, "install": IN_CLONE.format(extra) if names else None}
            for extra, names in lacking.items()
        },
        "missing": [name for name in needed[1] if not (version(name) or find_spec(name))],
    }


def requirements() -> dict[str, list[str]]:
    """The packages that are required on this system, by extra; those without one come first."""
    found: dict[str, list[str]] = {"": []}
    with suppress(metadata.PackageNotFoundError):  # run from a bare source tree
        for line in metadata.requires("heavytop") or ():
            if "sys_platform" not in line or f"'{sys.platform}'" in line.replace('"', "'"):
                name, extra = REQUIREMENT.findall(line)[0]
                found.setdefault(extra, []).append(name)
    return found


def cache() -> dict[str, Any]:
    """The folder where heyoka keeps its compiled code, by its own rule, and its size [bytes]."""
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    folder = Path(os.environ.get("HEYOKA_CACHE_DIR") or Path(home) / "heyoka")
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    return {"folder": str(folder), "exists": folder.is_dir(), "bytes": size}


def in_words(found: Mapping[str, Any]) -> str:
    """A diagnosis as text."""
    cpu, store = found["cpu"], found["cache"]
    lines = {
        "python": f"{found['python']}, {found['platform']}",
        "cpu": f"{cpu['model'] or 'unknown'}, {cpu['usable']} usable",
        **{name: number or "missing" for name, number in found["versions"].items()},
        "cache": f"{store['bytes'] / 1e6:.1f} MB  {store['folder']}",
    }
    if not find_spec("heyoka"):
        lines["heyoka"] = f"missing: {INSTALL_HEYOKA}"
    for extra, state in found["optional"].items():
        missing = f"missing: {state['install']} in the clone"
        lines[f"[{extra}]"] = missing if state["missing"] else "installed"
    return "\n".join(f"{label:12} {text}" for label, text in lines.items())
