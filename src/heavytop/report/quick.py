"""The quick studies, which a report makes itself where it is given no results."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.files import write_document
from heavytop.plots.sphere import PUSH, touched
from heavytop.results.base import spelt
from heavytop.results.documents import FILES, Trace, Traces
from heavytop.scene.scene import load_scene, shipped_scenes
from heavytop.spelling import harmless
from heavytop.studies.executors import LETTERS, begin, end, tail

BOOK: Final = ("sicm-kicked", "sicm-dropped", "sicm-forward", "sicm-forward-spin-held")
LIMIT_S: Final = 250.0  # of all of them: under 5 minutes with the page
BUDGET: Final = "30"  # s, of work and precision, and of stress
PERIODS: Final = "1000"
DRIFTING: Final = ("taylor-axis", "dop853-scipy", "strang", "gauss8")
CASES: Final = (
    "through-top", "near-top-1e-8", "lie-group", "beside-the-top", "sleeping-1-1e-4",
    "falling-1e-6", "separatrix-20", "near-separatrix", "cusp", "kick+1e-6", "kick-1e-6",
)  # fmt: skip
STRESSED: Final = (
    "auto", "taylor-axis", "taylor-attitude", "taylor-cubic", "taylor-subsystem",
    "taylor-lagrange", "dop853-scipy", "dop853-scipy-lagrange", "lsoda-scipy-lagrange",
    "radau-scipy-lagrange", "gauss8", "solve-ivp-defaults",
)  # fmt: skip
CLAIMS: Final = ()  # all
PLANE: Final = ("--x", "phidot=-30:40:300", "--y", "theta=0.02:1.5:300")
GRACE: Final = 5.0  # s from SIGTERM to SIGKILL: what checks the claims ends its scripts meanwhile
TAIL: Final = 4096  # bytes of what a command said

TRACE_TIMES, TRACE_POINTS = 3001, 301
TRACE_PERIODS: Final = 3
TRACE_S: Final = 2.0  # of a path where nothing nutates, and the scene does not say

Words = tuple[str, ...]


def quick(
    place: Path,
    about: Sequence[str] = (),
    heard: Callable[[str], object] = lambda _: None,
) -> list[tuple[str, str]]:
    """Run the quick studies, each into a folder of its own, by a process of its own.

    Parameters
    ----------
    place : Path
        It exists.
    about : sequence of str, optional
        The words that name a scene, and change it; the book's tops where there are none.
    heard : callable, optional
        It is told the name of each before it begins.

    Returns
    -------
    list of (str, str)
        What was not run, and why.
    """
    until = time.monotonic() + LIMIT_S
    if not about:
        (place / "traces").mkdir()
        write_document(place / "traces" / "traces.json", traces_document())
    missing, waiting = [], list(_studies(tuple(about)))
    for k, words in enumerate(waiting):
        name = words[-1]
        heard(name)
        limit = (until - time.monotonic()) / (len(waiting) - k)  # what others leave is shared
        code, said = run(words, place, limit)
        if code is None:
            shutil.rmtree(place / name, ignore_errors=True)  # a run leaves that of its part
            said = f"not done in {limit:.0f} s"
        if not any((place / name / file).is_file() for file in FILES):
            why = harmless(said) or f"it ended with code {code}"
            missing.append((name, f"{why} ({spelt(words)})"))
    return missing


def _studies(about: Words) -> Iterator[Words]:
    """The words of what is run; the last names its folder."""
    plain = ("--no-figures", "-o")
    if about:
        yield "run", *about, *plain, "run"
    else:
        for k, name in enumerate(BOOK, start=1):
            yield "run", name, *plain, f"run-{k}-{name}"
    top = about or BOOK[:1]
    yield "atlas", *top, *PLANE, *plain, "atlas"
    drifting = ("--periods", PERIODS, "--methods", ",".join(DRIFTING))
    yield "drift", *top, *drifting, *plain, "drift"
    yield "workprec", *top, "--budget", BUDGET, *plain, "workprec"
    hard = ("--cases", ",".join(CASES), "--methods", ",".join(STRESSED), "--budget", BUDGET)
    yield "stress", *hard, *plain, "stress"
    yield "validate", *CLAIMS, "-o", "validate"


def run(words: Sequence[str], place: Path, limit_s: float) -> tuple[int | None, str]:
    """Run a command of heavytop in a folder; its group of processes is gone when this returns.

    Parameters
    ----------
    words : sequence of str
        The verb, and what it is given.
    place : Path
        The folder in which it is run.
    limit_s : float
        Seconds after which it is ended.

    Returns
    -------
    int or None, str
        Its exit code, None where its time was up, and what it said last.

    Raises
    ------
    OSError
        It cannot be begun.
    """
    said = place / "said"
    # It imports what this process would, and nothing from the folder in which it is run.
    here = {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "TMPDIR": str(place)}
    boot = ("-P", "-m", "heavytop", *words)
    process = begin(boot, said, os.environ | LETTERS | here, place)
    try:
        code: int | None = process.wait(limit_s)
    except subprocess.TimeoutExpired:
        code = None
    finally:
        end([process], GRACE)
    words_said = " ".join(tail(said, TAIL).split())
    return code, words_said.rpartition("Error: ")[2].removeprefix("heavytop: ")[-300:]


def traces_document() -> dict[str, Any]:
    """Return the axis of every shipped scene over a few nutations; nothing is integrated.

    Of a top that rests, sleeps or hangs it is what it does after a push, ``pushed`` [rad/s].

    Examples
    --------
    >>> first = traces_document()["traces"][0]
    >>> first["name"], first["kind"], first["axis"][0], first["pushed"]
    ('at-rest', 'at-rest', [0.0, 0.0, 1.0], 1.0)
    """
    found = []
    for name, title in shipped_scenes().items():
        scene = load_scene(name)
        motion = Motion(scene.top, scene.start)
        pushed = touched(motion)
        moving = pushed or motion
        seconds = moving.period and TRACE_PERIODS * moving.period
        seconds = float(seconds or scene.time or TRACE_S)
        axis = _thinned(moving.at(np.linspace(0.0, seconds, TRACE_TIMES)).axis)
        found.append(
            Trace(
                name=name,
                title=title,
                kind=str(motion.kind),
                tags=tuple(map(str, motion.tags)),
                seconds=seconds,
                axis=tuple(map(tuple, (axis.round(5) + 0.0).tolist())),
                pushed=PUSH if pushed else None,
            )
        )
    return Traces(traces=tuple(found)).document()


def _thinned(path: Any) -> Any:
    """Points of a path that are apart in time, as a cusp needs it, and along it, as a bend does."""
    far = np.cumsum(np.linalg.norm(np.diff(path, axis=0, prepend=path[:1]), axis=1))
    even = np.linspace(0.0, 1.0, len(path)) + far / (far[-1] or 1.0)
    return path[np.searchsorted(even, np.linspace(0.0, even[-1], TRACE_POINTS))]
