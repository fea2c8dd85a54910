"""Doing a drift study: from what is asked to what was found, in this process or in several."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

from heavytop.errors import BadScene, Fault, ForeignFile
from heavytop.machine import versions
from heavytop.scene.arguments import heard, parse_options, path_of
from heavytop.scene.scene import Scene
from heavytop.studies import ledger
from heavytop.studies.drifts.drift import Drift, gathered
from heavytop.studies.drifts.options import JOBS
from heavytop.studies.drifts.study import KIND, Study
from heavytop.studies.methods import DEFAULT
from heavytop.studies.recorded import naming

Show = Callable[[ledger.Progress], object]


def drift(
    scene: Scene,
    *,
    methods: Sequence[str] = DEFAULT,
    periods: float = 10_000,
    ensemble: int = 1,
    samples: int = 25,
    seed: int = 0,
    jobs: int = 1,
    folder: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    progress: Show | None = None,
) -> Drift:
    """Follow a top with several methods, and measure how their errors grow.

    Every run is held against the closed form of its own binary start, at 40 digits.

    Parameters
    ----------
    scene : Scene
        Its top and its start; its span and its wants are not used.
    methods : sequence of str
        ``NAME`` or ``NAME=SETTING``, such as ``taylor-axis-projected`` or ``strang=200``.
    periods : float
        Nutation periods to go, at least 1.
    ensemble : int
        Starts: the scene's own, and neighbouring ones.
    samples : int
        Times, spread evenly over the decades, at which errors are measured.
    seed : int
        Of the neighbouring starts.
    jobs : int
        Processes; results do not depend on it.
    folder : path, optional
        Where everything is written down, so that a study that was killed goes on from there. It
        is new, or empty, or holds this study.
    executor : concurrent.futures.Executor, optional
        Its workers do the runs, wherever they are, and `jobs` means nothing; results do not
        depend on it. That of a dask cluster: `heavytop.studies.cluster.executor_at`.
    progress : callable, optional
        It is given a `heavytop.studies.ledger.Progress` after every half second of work.

    Returns
    -------
    Drift

    Raises
    ------
    BadScene
        Nothing nutates; there is no such method; an option is of the wrong kind or out of its
        bounds. Every fault is listed.
    ForeignFile
        The folder holds something else, another study, or a damaged file.
    InUse
        Another process is writing the folder.
    StoppedEarly
        Ctrl-C; a full disk; a worker that died twice. What was done is in the folder.
    ForeignWorker
        A worker of the executor has other versions than this process.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> found = drift(load_scene("sicm-kicked"), methods=["taylor-axis"], periods=100, samples=5)
    >>> found["taylor-axis"].phase_s[-1] < 1e-12
    True

    Notes
    -----
    Accuracy: ``tests/two_ways/test_drift.py`` finds a shift of 1e-9 s, and one of 3e-12 s, as a
    phase to a millionth of itself.

    References
    ----------
    Brouwer, "On the accumulation of errors in numerical integration", *Astronomical Journal* 46
    (1937), for the powers of the time with which errors grow.
    """
    heard("progress", progress)
    if folder is not None:
        path_of("folder", folder)
    values, wrong = parse_options(str(getattr(scene, "name", "drift")), {"jobs": jobs}, JOBS)
    try:
        study = Study.asked(scene, methods, periods, ensemble, samples, seed)
    except BadScene as bad:
        raise BadScene((*bad.faults, *wrong)) from None
    jobs = _one(values, wrong)
    if folder is None:
        memory = ledger.run(_tasks(study), jobs=jobs, executor=executor, on_progress=progress)
        return gathered(study, memory)
    with ledger.Folder.create_or_open(folder, study.identity) as book:
        ledger.run(_tasks(study), book, jobs=jobs, executor=executor, on_progress=progress)
        return gathered(study, book)


def resume(
    folder: str | os.PathLike[str],
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Show | None = None,
) -> Drift:
    """Take up a drift study where its folder says it was left.

    Raises
    ------
    ForeignFile
        It is no study of drift, was made by other versions, or is damaged.
    InUse
        Another process is writing it.
    StoppedEarly, ForeignWorker
        As for `drift`.
    """
    jobs = _one(*parse_options(str(folder), {"jobs": jobs}, JOBS))
    with ledger.Folder.open(folder, versions()) as book:
        if book.identity.get("kind") != KIND:
            raise ForeignFile(f"{Path(folder)}: a study of {book.identity.get('kind')!r:.40}")
        with naming(Path(folder) / "study.json"):
            study = Study.of(book.identity)
        ledger.run(_tasks(study), book, jobs=jobs, executor=executor, on_progress=progress)
        return gathered(study, book)


def _one(values: Mapping[str, int], wrong: Sequence[Fault]) -> int:
    """Return the number of processes, unless something is wrong with it."""
    if wrong:
        raise BadScene(tuple(wrong))
    return values["jobs"]


def _tasks(study: Study) -> ledger.Study:
    return ledger.study_of(study.identity)
