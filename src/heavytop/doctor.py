"""What is installed here, found without importing any of it."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Iterator, Mapping
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from heavytop import __version__
from heavytop.errors import CONDA, IN_CLONE
from heavytop.machine import cpu_model, usable_cpus, version

PACKAGE = "heavytop"
_NAME = re.compile(r"[A-Za-z0-9._-]+")
_EXTRA, _SYSTEM = (
    re.compile(rf"""{name}\s*==\s*["']([^"']+)["']""") for name in ("extra", "sys_platform")
)


def diagnosis() -> dict[str, Any]:
    """The state of this installation, as the document ``heavytop/doctor/1``.

    Returns
    -------
    dict
        ``versions`` by package (null where it is missing), ``python``, ``platform``, ``cpu``,
        ``integrator`` (heyoka's wheel, its cache of compiled code, and how to install it where
        it is missing), ``optional`` (extras, what they lack and how to install it) and
        ``missing`` (what pip would have installed on this system).

    Examples
    --------
    >>> sorted(diagnosis())
    ['cpu', 'integrator', 'missing', 'optional', 'platform', 'python', 'schema', 'versions']
    """
    versions = {PACKAGE: __version__} | {name: version(name) for name in requirements(None)}
    return {
        "schema": "heavytop/doctor/1",
        "versions": versions,
        "python": {"version": platform.python_version(), "executable": sys.executable},
        "platform": {
            "system": platform.system(),
            "machine": platform.machine(),
            "libc": " ".join(platform.libc_ver()).strip() or None,
        },
        "cpu": {"model": cpu_model(), "usable": usable_cpus()},
        "integrator": {
            "wheel": wheel("heyoka"),
            "cache": cache(),
            "install": None if find_spec("heyoka") else CONDA,
        },
        "optional": {extra: optional(extra) for extra in extras()},
        "missing": [
            name
            for name in requirements(None, here=True)
            if not (versions[name] or find_spec(name))
        ],
    }


def requirements(extra: str | None, *, here: bool = False) -> list[str]:
    """The packages required by an extra, or always when `extra` is None; those of this system."""
    try:
        lines = metadata.requires(PACKAGE) or []
    except metadata.PackageNotFoundError:
        lines = ["heyoka"]  # run from a bare source tree: the one that is most often missing
    if here:
        lines = [x for x in lines if sys.platform in (_SYSTEM.findall(x) or [sys.platform])]
    found = ((_NAME.match(line), _EXTRA.search(line)) for line in lines)
    return [name[0] for name, owner in found if name and (owner and owner[1]) == extra]


def extras() -> list[str]:
    """The optional parts of the package, by the names that pip knows."""
    try:
        return metadata.metadata(PACKAGE).get_all("Provides-Extra") or []
    except metadata.PackageNotFoundError:
        return []


def optional(extra: str) -> dict[str, Any]:
    """What an extra lacks here, and the line that installs it."""
    lacking = [name for name in requirements(extra) if version(name) is None]
    pip = IN_CLONE.format(extra) if lacking else None
    return {"missing": lacking, "install": pip}


def wheel(name: str) -> dict[str, Any] | None:
    """The tags of an installed wheel (what it was built for), or None without one."""
    try:
        text = metadata.distribution(name).read_text("WHEEL") or ""
    except metadata.PackageNotFoundError:
        return None
    tags = [line.removeprefix("Tag: ") for line in text.splitlines() if line.startswith("Tag: ")]
    return {"version": version(name), "tags": tags}


def cache_folder(environment: Mapping[str, str] = os.environ) -> Path:
    """The folder where heyoka keeps its compiled code, by heyoka's own rule.

    Examples
    --------
    >>> cache_folder({"XDG_CACHE_HOME": "/var/cache/me"}).as_posix()
    '/var/cache/me/heyoka'
    """
    if named := environment.get("HEYOKA_CACHE_DIR"):
        return Path(named)
    if caches := environment.get("XDG_CACHE_HOME"):
        return Path(caches) / "heyoka"
    return Path(environment.get("HOME", "~")).expanduser() / ".cache" / "heyoka"


def cache() -> dict[str, Any]:
    """The folder of compiled code and how much is in it [bytes]."""
    folder = cache_folder()
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    return {"folder": str(folder), "exists": folder.is_dir(), "bytes": size}


def in_words(found: Mapping[str, Any]) -> str:
    """A diagnosis for reading."""
    return "\n".join(f"{label:12} {text}".rstrip() for label, text in _lines(found))


def _lines(found: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    python, system, cpu = found["python"], found["platform"], found["cpu"]
    yield "python", f"{python['version']}  {python['executable']}"
    yield "platform", " ".join(filter(None, (system["system"], system["machine"], system["libc"])))
    yield "cpu", f"{cpu['model'] or 'unknown'}, {cpu['usable']} usable"
    for name, number in found["versions"].items():
        yield name, number or "missing"
    built, store = found["integrator"]["wheel"], found["integrator"]["cache"]
    there = ", ".join(built["tags"]) if built else ""
    lacking = found["integrator"]["install"]
    yield "wheel", "heyoka: " + (f"missing: {lacking}" if lacking else there or "built here")
    size = f"{store['bytes'] / 1e6:.1f} MB" if store["exists"] else "empty"
    yield "cache", f"{size}  {store['folder']}"
    if not found["optional"]:
        yield "optional", "none"
    for extra, state in found["optional"].items():
        missing = f"missing: {state['install']} in the clone"
        yield f"[{extra}]", missing if state["missing"] else "installed"
