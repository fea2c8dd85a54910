"""Making an atlas: from what is asked to what was found, here, in processes, or in shards."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, Final

from heavytop.errors import BadScene, Fault, ForeignFile
from heavytop.files import regular, write_document
from heavytop.machine import usable_cpus, versions
from heavytop.scene import arguments
from heavytop.scene.arguments import Range, Refused, heard, path_of, wrong_type
from heavytop.scene.scene import Scene
from heavytop.studies import ledger, recorded
from heavytop.studies.atlases.atlas import Atlas, gathered
from heavytop.studies.atlases.study import KIND, Study

SHARD: Final = "shard.json"
Show = Callable[[ledger.Progress], object]


def atlas(
    scene: Scene,
    x: object,
    y: object,
    *,
    only: str | None = None,
    integrate: bool = False,
    shard: str | tuple[int, int] | None = None,
    jobs: int | None = None,
    executor: Executor | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Show | None = None,
) -> Atlas:
    """The kind of motion of every pixel of a plane of tops, each proved, and how each moves.

    Parameters
    ----------
    scene : Scene
        Its top and its start say every number that no axis changes.
    x, y : str, tuple or Axis
        ``"phidot=-20:20:2000"`` or ``("phidot", -20, 20, 2000)``: start values, constants (p_phi,
        p_psi, E) or parameters (A, C, gMR), with a last ``:log`` on a logarithmic axis.
    only : {"kind"}, optional
        Only kinds are found, many times as fast.
    integrate : bool
        Each top is integrated too, and its kind told by the events of that run.
    shard : str or (int, int), optional
        Only the tiles of shard i of n, ``"i/n"`` with 1 ≤ i ≤ n; `merge_atlases` joins shards.
    jobs : int, optional
        Processes; by default one for each processor. Results do not depend on it.
    executor : concurrent.futures.Executor, optional
        What computes the tiles, in place of own processes.
    folder : path, optional
        Where tiles are written down, so that an atlas that was killed goes on from there. It is
        new, or empty, or holds this atlas.
    progress : callable, optional
        It is given a `heavytop.studies.ledger.Progress` after every tile.

    Returns
    -------
    Atlas

    Raises
    ------
    BadScene
        No axis, two axes that set the same thing, an option of the wrong kind, or more pixels
        than there is room for. Every fault is listed.
    ForeignFile
        The folder holds something else, another atlas, or a damaged file.
    InUse
        Another process is writing the folder.
    StoppedEarly
        Ctrl-C; a full disk; a worker that died twice. What was done is in the folder.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> found = atlas(load_scene("sicm-kicked"), "phidot=-20:20:41", "psidot=-150:150:31", jobs=1)
    >>> found.counts, found.uncertified
    ({'planar-pendulum': 1, 'loops': 622, 'cusps': 30, 'waves': 618}, 0)

    Notes
    -----
    Accuracy: ``tests/two_ways/test_atlas.py`` holds pixels to 1e-13 of `heavytop.Motion` alone,
    and their kinds to integrated ones.
    """
    heard("progress", progress)
    if folder is not None:
        path_of("folder", folder)
    file = str(getattr(scene, "name", KIND))
    given = {"jobs": usable_cpus() if jobs is None else jobs, "shard": shard, "only": only,
             "integrate": integrate, "executor": executor}  # fmt: skip
    values, wrong = arguments.parse_options(file, given, OPTIONS)
    if only is not None and integrate is True:
        wrong.append(Fault(file, None, "only", "", "not together with integrate"))
    try:
        study = Study.asked(scene, x, y, _what(only, integrate))
    except BadScene as bad:
        raise BadScene((*bad.faults, *wrong)) from None
    if faults := [*wrong, *_room(file, study, folder, values.get("shard"))]:
        raise BadScene(tuple(faults))
    tasks = _share(study, values["shard"])
    if folder is None:
        book = ledger.run(_tasks(study), jobs=values["jobs"], tasks=tasks, executor=executor,
                          on_progress=progress)  # fmt: skip
        return gathered(study, book, tasks, values["jobs"])
    with ledger.Folder.create_or_open(folder, study.identity) as kept:
        _note_shard(kept.path, values["shard"])
        ledger.run(_tasks(study), kept, jobs=values["jobs"], tasks=tasks, executor=executor,
                   on_progress=progress)  # fmt: skip
        return gathered(study, kept, tuple(study.tiles), values["jobs"])


def continued(
    folder: str | os.PathLike[str],
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Show | None = None,
) -> Atlas:
    """Take up an atlas where its folder says it was left.

    Raises
    ------
    ForeignFile
        It is no atlas, was made by other versions, or is damaged.
    InUse
        Another process is writing it.
    StoppedEarly
        As for `atlas`.
    """
    here = {key: value for key, value in versions().items() if key != "cpu"}
    with ledger.Folder.open(folder, here) as kept:
        study = _study(kept)
        tasks = _share(study, _noted_shard(kept.path))
        ledger.run(_tasks(study), kept, jobs=jobs, tasks=tasks, executor=executor,
                   on_progress=progress)  # fmt: skip
        return gathered(study, kept, tuple(study.tiles), jobs)


def merge_atlases(
    folders: Sequence[str | os.PathLike[str]], folder: str | os.PathLike[str]
) -> tuple[Atlas, tuple[str, ...]]:
    """Join the shards of an atlas in a new folder, or in one of theirs.

    Parameters
    ----------
    folders : sequence of path
        At least one.
    folder : path
        Where all tiles are then; it is new, or empty, or holds this atlas.

    Returns
    -------
    Atlas
    tuple of str
        The tiles that none of them has.

    Raises
    ------
    BadScene
        No folder is given.
    ForeignFile
        A folder holds no atlas, another one, or a damaged file; nothing was written.
    InUse
        Another process is writing `folder`.
    WrongType
        `folders` is no sequence of paths, or `folder` no path.

    Notes
    -----
    Accuracy: ``tests/two_ways/test_atlas.py`` holds shards that were joined to the whole, bit for
    bit.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from heavytop.scene.scene import load_scene
    >>> plane = load_scene("sicm-kicked"), "phidot=-20:20:41", "psidot=-150:150:31"
    >>> with TemporaryDirectory() as place:
    ...     parts = [f"{place}/{i}" for i in (1, 2)]
    ...     for i, part in enumerate(parts, 1):
    ...         _ = atlas(*plane, shard=(i, 2), jobs=1, folder=part)
    ...     found, missing = merge_atlases(parts, f"{place}/all")
    ...     print(found.whole, missing, found.counts["loops"])
    True () 622
    """
    if isinstance(folders, str | bytes) or not isinstance(folders, Sequence):
        raise wrong_type("folders", "a list of paths", folders)
    if not folders:
        raise BadScene((Fault(KIND, None, "merge", "", "at least one folder"),))
    parts, whole = [path_of("folders", each) for each in folders], path_of("folder", folder)
    looked = [ledger.Folder.look(each) for each in parts]  # before anything is written
    study = _study(looked[0])
    for each in looked[1:]:
        each.expect(study.identity)
    with ledger.Folder.create_or_open(whole, study.identity) as kept:
        missing = ledger.merge(kept, parts)
        _note_shard(kept.path, None)
        return gathered(study, kept, tuple(study.tiles), 1), tuple(missing)


def load_atlas(folder: str | os.PathLike[str]) -> Atlas:
    """Read the atlas in a folder, as far as it is done.

    Parameters
    ----------
    folder : path
        What `atlas` or `merge_atlases` wrote into.

    Returns
    -------
    Atlas

    Raises
    ------
    ForeignFile
        It is none, or is damaged.
    WrongType
        It is no path.

    Notes
    -----
    Accuracy: as of `atlas`; ``tests/two_ways/test_atlas.py`` holds what is read to be what was
    computed, bit for bit.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from heavytop.scene.scene import load_scene
    >>> with TemporaryDirectory() as place:
    ...     plane = load_scene("sicm-kicked"), "phidot=-20:20:41", "psidot=-150:150:31"
    ...     made = atlas(*plane, jobs=1, folder=place)
    ...     print(load_atlas(place).counts == made.counts)
    True
    """
    kept = ledger.Folder.look(path_of("folder", folder))
    study = _study(kept)
    return gathered(study, kept, tuple(study.tiles), 1)


def _study(kept: ledger.Folder) -> Study:
    if kept.identity.get("kind") != KIND:
        raise ForeignFile(f"{kept.path}: a study of {kept.identity.get('kind')!r:.40}")
    with recorded.naming(kept.path / "study.json"):
        return Study.of(kept.identity)


def _what(only: object, integrate: object) -> str:
    if isinstance(only, str) and only == "kind":
        return "kind"
    return "integrate" if integrate is True else "rows"


def _share(study: Study, shard: tuple[int, int] | None) -> tuple[str, ...]:
    tasks = tuple(study.tiles)
    return tasks if shard is None else ledger.shard(tasks, *shard)


def _note_shard(folder: Path, shard: tuple[int, int] | None) -> None:
    """Note which shard a folder is for, or that it is for all: so far its tiles are the same."""
    note = folder / SHARD
    try:
        if shard is None:
            note.unlink(missing_ok=True)
        else:
            write_document(note, {"shard": list(shard)})
    except OSError as fault:
        raise ForeignFile(f"{note}: not the note of a shard ({fault.strerror})") from None


def _noted_shard(folder: Path) -> tuple[int, int] | None:
    note = folder / SHARD
    if not note.exists():
        return None
    try:
        with regular(note) as file:
            found = json.loads(file.read(1000))["shard"]
        if found is None:
            raise ValueError("null")
        return _shard(found)
    except (OSError, ValueError, TypeError, KeyError, RecursionError) as fault:
        raise ForeignFile(f"{note}: damaged ({fault})") from None


def _room(
    file: str, study: Study, folder: str | os.PathLike[str] | None, shard: tuple[int, int] | None
) -> list[Fault]:
    """What is wrong when there is not room enough on the disk, or in memory."""
    needed = int(study.bytes * _left(study, folder) / (shard[1] if shard else 1))
    if folder is None:
        free, where = _free_memory(), "in memory"
    else:
        place = Path(folder).absolute()
        there = next(each for each in (place, *place.parents) if each.exists())
        free, where = shutil.disk_usage(there).free, f"on the disk of {there}"
    if needed <= free:
        return []
    rule = f"{_gigabytes(needed)} are needed {where}, and {_gigabytes(free)} are free"
    return [Fault(file, None, "x, y", f"{study.plane.x.count * study.plane.y.count} pixels", rule)]


def _left(study: Study, folder: str | os.PathLike[str] | None) -> float:
    """The part of an atlas that is not in a folder yet."""
    if folder is None:
        return 1.0
    done = sum(1 for _ in Path(folder).glob("tasks/*/*/checkpoint.json"))
    return max(0.0, 1 - done / len(study.tiles))


def _free_memory() -> int:
    """Bytes that this machine could give; no limit where it does not say."""
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):
        return 2**62


def _gigabytes(count: int) -> str:
    return f"{count / 1e9:.4g} GB" if count >= 1e9 else f"{count / 1e6:.4g} MB"


def _tasks(study: Study) -> ledger.Study:
    return ledger.study_of(study.identity)


def _shard(given: object) -> tuple[int, int] | None:
    """Return (i, n) of ``i/n``."""
    if given is None:
        return None
    words = given.split("/") if isinstance(given, str) else given
    rule = "i/n, whole numbers with 1 <= i <= n <= 10000"
    if not isinstance(words, Sequence) or len(words) != 2:
        raise Refused(rule)
    try:
        i, n = (_whole(word) for word in words)
    except ValueError:
        raise Refused(rule) from None
    if not 1 <= i <= n <= 10_000:
        raise Refused(rule)
    return i, n


def _whole(word: object) -> int:
    if isinstance(word, str) and word.strip().isdecimal() and len(word) < 10:
        return int(word)
    if isinstance(word, int) and not isinstance(word, bool):
        return word
    raise ValueError


def _only(given: object) -> str | None:
    if given is not None and not (isinstance(given, str) and given == "kind"):
        raise Refused("kind")
    return None if given is None else "kind"


def _executor(given: object) -> object:
    if given is not None and not callable(getattr(given, "submit", None)):
        raise Refused("a concurrent.futures.Executor")
    return given


def _truth(given: object) -> bool:
    if not isinstance(given, bool):
        raise Refused("True or False")
    return given


OPTIONS: Mapping[str, Callable[[object], Any]] = {
    "jobs": Range(1, 1024, whole=True), "shard": _shard, "only": _only, "integrate": _truth,
    "executor": _executor,
}  # fmt: skip
