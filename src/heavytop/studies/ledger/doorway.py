"""The ways into the folder of a study, and what is refused or cleaned away there."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from heavytop.errors import ForeignFile, Stop, StoppedEarly
from heavytop.files import write_text
from heavytop.studies.ledger.canonical import sealed, unsealed
from heavytop.studies.ledger.study import Identity

STUDY, LOCK, TASKS = "study.json", "lock", "tasks"
SCHEMA = "heavytop/study/1"
_LEFTOVER = re.compile(r"\.\d+\.(probe|(study|checkpoint|cost|rows-\d{4,})\.json)")


def named(path: str | os.PathLike[str]) -> Path:
    """The place that a person names, if a folder can have that name."""
    place = Path(path)
    if "\0" in str(place):
        raise ForeignFile(f"{str(place)!r}: no folder has a NUL in its name")
    return place


def kept_identity(path: Path) -> Identity:
    """What is asked, as a folder says.

    Raises
    ------
    ForeignFile
        It is not the folder of a study, or what it says is damaged.
    """
    if not (path / STUDY).exists():
        raise ForeignFile(f"{path}: not the folder of a study (there is no {STUDY})")
    identity = unsealed(path / STUDY, SCHEMA).get("identity")
    if not isinstance(identity, dict):
        raise ForeignFile(f"{path / STUDY}: identity: not an object")
    return identity


def file_of(path: Path) -> tuple[int, int]:
    """Which file a study is written in: another one of the same name is another study."""
    try:
        found = (path / STUDY).stat()
    except OSError as fault:
        raise ForeignFile(f"{path / STUDY}: cannot be read ({fault.strerror})") from None
    return found.st_dev, found.st_ino


def expect_there(path: Path, file: tuple[int, int]) -> None:
    """Refuse to go on in a folder that was taken away, or exchanged, since it was opened.

    Raises
    ------
    StoppedEarly
    """
    try:
        there = file_of(path) == file
    except ForeignFile:
        there = False
    if not there:
        raise StoppedEarly(Stop.UNWRITABLE, f"{path}: the folder has gone", None)


def begin(path: Path, identity: Identity) -> None:
    """Write what is asked, before anything is answered."""
    write_text(path / STUDY, sealed({"schema": SCHEMA, "identity": identity}, indent=2))


def refuse_strangers(path: Path) -> None:
    """Refuse a file, and a folder that holds something, and no study."""
    if path.exists() and not path.is_dir():
        raise ForeignFile(f"{path}: not a folder")
    if not path.exists() or (path / STUDY).exists():
        return
    strangers = [p.name for p in path.iterdir() if p.name != LOCK and not _leftover(p)]
    if strangers:
        some = ", ".join(sorted(strangers)[:3])
        raise ForeignFile(f"{path}: not empty and not the folder of a study ({some})")


def _leftover(path: Path) -> bool:
    """Whether a file is the unfinished one of a writer that was killed."""
    return _LEFTOVER.fullmatch(path.name) is not None


def clean(path: Path) -> None:
    """Take away what a killed writer left unfinished; only the holder of the lock may."""
    tasks = path / TASKS
    if tasks.is_symlink():
        raise ForeignFile(f"{tasks}: a link; the tasks of a study lie in its folder")
    for place in (*path.glob(".*"), *tasks.rglob(".*.json")):
        if _leftover(place):
            place.unlink(missing_ok=True)


@contextmanager
def writing(path: Path, folder: Path) -> Iterator[None]:
    """Let a file of a study be written; where it cannot, the study ends early and keeps the rest.

    Raises
    ------
    StoppedEarly
        It names the file and the reason.
    """
    try:
        yield
    except OSError as fault:
        if not (folder / STUDY).exists():  # taken away since it was looked at
            raise StoppedEarly(Stop.UNWRITABLE, f"{folder}: the folder has gone", None) from fault
        raise StoppedEarly.unwritable(fault, path, folder) from fault
