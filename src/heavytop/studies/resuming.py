"""Taking up a study of any kind where its folder says it was left."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from heavytop.errors import ForeignFile
from heavytop.scene.arguments import heard, path_of, whole
from heavytop.studies import ledger
from heavytop.studies.store import Store

if TYPE_CHECKING:
    from heavytop.studies.atlas import Atlas
    from heavytop.studies.drifts.drift import Drift

GOING_ON: Final[Mapping[str, tuple[str, str]]] = {
    "drift": ("heavytop.studies.drifts.drifting", "resume"),
    "atlas": ("heavytop.studies.atlas", "resume"),
}
"""By kind of study, the module and the function that go on with it."""


def resume(
    folder: str | os.PathLike[str],
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Callable[[ledger.Progress], object] | None = None,
) -> Drift | Atlas:
    """Take up a drift study or an atlas where its folder says it was left.

    Parameters
    ----------
    folder : path
        Where it was written.
    jobs : int
        Processes; results do not depend on it.
    executor : concurrent.futures.Executor, optional
        What does the work, in place of own processes.
    progress : callable, optional
        It is given a `heavytop.studies.ledger.Progress` after every piece of work.

    Returns
    -------
    Drift or Atlas
        The study, whole.

    Raises
    ------
    ForeignFile
        It is no study, was made by other versions, or is damaged.
    InUse
        Another process is writing it.
    StoppedEarly, ForeignWorker
        As for `heavytop.drift` and `heavytop.atlas`.
    WrongType
        It is no path.

    Notes
    -----
    Accuracy: ``tests/property/test_ledger.py`` holds a study that was killed to one that was not,
    bit for bit.

    Examples
    --------
    >>> import heavytop as ht
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as place:
    ...     scene = ht.load_scene("sicm-kicked")
    ...     first = ht.drift(scene, methods=["taylor-axis"], periods=10, samples=3, folder=place)
    ...     print(resume(place).document(costs=False) == first.document(costs=False))
    True
    """
    heard("progress", progress)
    jobs = whole("jobs", jobs, 1)
    kind = kind_of(path_of("folder", folder))
    if kind not in GOING_ON:
        raise ForeignFile(f"{Path(folder)}: a study of {kind!r:.40}")
    module, name = GOING_ON[kind]
    go_on: Any = getattr(import_module(module), name)
    found: Drift | Atlas = go_on(folder, jobs=jobs, executor=executor, progress=progress)
    return found


def kind_of(folder: str | os.PathLike[str]) -> str:
    """The kind of the study in a folder.

    Raises
    ------
    ForeignFile
        There is none.
    """
    try:
        return str(Store(folder).parameters["kind"])
    except ForeignFile:
        return str(ledger.identity_of(folder).get("kind"))
