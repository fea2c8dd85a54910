"""What executed pages and run commands rest on: when it changes, all are run anew."""

from __future__ import annotations

from functools import cache
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[2]


@cache
def digest() -> str:
    """One name for the package as it is now, and for the versions of everything it uses."""
    found = sha256((ROOT / "requirements" / "lock-py311.txt").read_bytes())
    for path in sorted((*(ROOT / "src").rglob("*.*"), *(ROOT / "validation").glob("*.*"))):
        if path.is_file() and "__pycache__" not in path.parts:
            found.update(str(path.relative_to(ROOT)).encode() + path.read_bytes())
    return found.hexdigest()[:16]
