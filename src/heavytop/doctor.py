"""What is installed here, found without importing any of it."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Mapping
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from heavytop import __version__
from heavytop.errors import CONDA, IN_CLONE
from heavytop.machine import cpu_model, usable_cpus, version

PACKAGE = "heavytop"
_REQUIRED = re.compile(r"([\w.-]+)")
_EXTRA, _SYSTEM = (
    re.compile(rf"""{name}\s*==\s*["']([^"']+)["']""") for name in ("extra", "sys_platform")
)


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
    needed, here = requirements(None), requirements(None, here=True)
    versions = {PACKAGE: __version__} | {name: version(name) for name in needed}
    return {
        "schema": "heavytop/doctor/2",
        "versions": versions,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cpu": {"model": cpu_model(), "usable": usable_cpus()},
        "cache": cache(),
        "optional": {extra: optional(extra) for extra in extras()},
        "missing": [name for name in here if not (versions[name] or find_spec(name))],
    }


def requirements(extra: str | None, *, here: bool = False) -> list[str]:
    """The packages required by an extra, or always when `extra` is None; those of this system."""
    try:
        lines = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        lines = ["heyoka"]  # run from a bare source tree: the one that is most often missing
    if here:
        lines = [x for x in lines if sys.platform in (_SYSTEM.findall(x) or [sys.platform])]
    owners = [(_REQUIRED.match(line), _EXTRA.search(line)) for line in lines]
    return [name[0] for name, owner in owners if name and (owner and owner[1]) == extra]


def extras() -> list[str]:
    """The optional parts of the package, by the names that pip knows."""
    try:
        return metadata.metadata(PACKAGE).get_all("Provides-Extra") or []
    except metadata.PackageNotFoundError:
        return []


def optional(extra: str) -> dict[str, Any]:
    """What an extra lacks here, and the line that installs it."""
    lacking = [name for name in requirements(extra) if version(name) is None]
    return {"missing": lacking, "install": IN_CLONE.format(extra) if lacking else None}


def cache() -> dict[str, Any]:
    """The folder where heyoka keeps its compiled code, by its own rule, and its size [bytes]."""
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    folder = Path(os.environ.get("HEYOKA_CACHE_DIR") or Path(home) / "heyoka")
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    return {"folder": str(folder), "exists": folder.is_dir(), "bytes": size}


def in_words(found: Mapping[str, Any]) -> str:
    """A diagnosis for reading."""
    cpu, store = found["cpu"], found["cache"]
    lines = {
        "python": f"{found['python']}, {found['platform']}",
        "cpu": f"{cpu['model'] or 'unknown'}, {cpu['usable']} usable",
        **{name: number or "missing" for name, number in found["versions"].items()},
        "cache": f"{store['bytes'] / 1e6:.1f} MB  {store['folder']}",
    }
    if not find_spec("heyoka"):
        lines["heyoka"] = f"missing: {CONDA}"
    for extra, state in found["optional"].items():
        missing = f"missing: {state['install']} in the clone"
        lines[f"[{extra}]"] = missing if state["missing"] else "installed"
    return "\n".join(f"{label:12} {text}" for label, text in lines.items())
