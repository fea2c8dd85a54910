"""Taking up a study of any kind where its folder says it was left."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Executor
from typing import TYPE_CHECKING

from heavytop.scene.arguments import heard, path_of, whole
from heavytop.studies.runner import Progress, study_of, with_versions_here
from heavytop.studies.store import STUDY, Store, differences, reading

if TYPE_CHECKING:
    from heavytop.results.drift import Drift
    from heavytop.results.work_precision import WorkPrecision
    from heavytop.studies.atlas import Atlas
    from heavytop.studies.stress import Stress


def resume(
    folder: str | os.PathLike[str],
    *,
    jobs: int = 1,
    executor: Executor | None = None,
    progress: Callable[[Progress], object] | None = None,
) -> Drift | Atlas | Stress | WorkPrecision:
    """Take up a study of any kind where its folder says it was left.

    Parameters
    ----------
    folder : path
        Where it was written.
    jobs : int
        Processes; results do not depend on it.
    executor : concurrent.futures.Executor, optional
        What does the work, in place of own processes.
    progress : callable, optional
        It is given a `heavytop.studies.runner.Progress` again and again.

    Returns
    -------
    Drift, Atlas, Stress or WorkPrecision
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
    Accuracy: ``tests/property/test_runner.py`` holds a study that was killed to one that was not,
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
    path, jobs = path_of("folder", folder), whole("jobs", jobs, 1)
    parameters = with_versions_here(Store(path).parameters)
    study = study_of(parameters)
    with reading(path / STUDY):
        renewed = study.renewed(parameters) | {"versions": parameters["versions"]}
        if wrong := differences(parameters, renewed):
            raise ValueError(f"not what a study asked for so would have: {wrong[0]}")
    how = {"jobs": jobs, "executor": executor, "on_progress": progress}
    with Store.open(path, parameters) as store:
        found: Drift | Atlas | Stress | WorkPrecision = study.complete(store, **how)
    return found
