"""The quick studies, which a report makes itself where it is given no results."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from heavytop.files import write_document
from heavytop.report.pages.sections import traces_document
from heavytop.results.base import spelt
from heavytop.spelling import harmless
from heavytop.studies.executors import LETTERS, begin, end, tail

BOOK: Final = ("sicm-kicked", "sicm-dropped", "sicm-forward", "sicm-forward-spin-held")
UPRIGHT: Final = "sleeping-unstable"  # whose diagram of energy and momentum has a thread
LIMIT_S: Final = 250.0  # of all of them: under 5 minutes with the page
BUDGET: Final = "40"  # s, of work and precision, and of stress
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
GRACE: Final = 5.0  # s from SIGTERM to SIGKILL: what checks the claims ends its scripts meanwhile
TAIL: Final = 4096  # bytes of what a command said
PLANE: Final = ("--x", "phidot=-30:40:300", "--y", "theta=0.02:1.5:300")


class QuickStudy(NamedTuple):
    """One of them.

    Attributes
    ----------
    document : str
        The file that it writes.
    words : tuple of str
        What is run: a verb, and what it is given; the last is the name of the folder.
    share : float
        Of the time that is left, its part to that of those after it.
    """

    document: str
    words: tuple[str, ...]
    share: float

    @property
    def name(self) -> str:
        """That of its folder."""
        return self.words[-1]


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
    while waiting:
        shares = sum(study.share for study in waiting)
        study = waiting.pop(0)
        heard(study.name)
        limit = (until - time.monotonic()) * study.share / shares
        if why := _run(study, place, limit):
            missing.append((study.name, f"{why} ({spelt(study.words)})"))
    return missing


def _studies(about: tuple[str, ...]) -> Iterator[QuickStudy]:
    def study(document: str, verb: str, *words: str, name: str = "", share: float) -> QuickStudy:
        plain = () if verb == "validate" else ("--no-figures",)
        return QuickStudy(f"{document}.json", (verb, *words, *plain, "-o", name or document), share)

    if about:
        yield study("run", "run", *about, share=40)
    for k, name in enumerate(() if about else BOOK, start=1):
        yield study("run", "run", name, name=f"run-{k}-{name}", share=16)
    top, upright, budget = about or BOOK[:1], about or (UPRIGHT,), ("--budget", BUDGET)
    drifting = ("--periods", PERIODS, "--methods", ",".join(DRIFTING))
    yield study("drift", "drift", *top, *drifting, share=45)
    yield study("workprec", "workprec", *top, *budget, share=55)
    hard = ("--cases", ",".join(CASES), "--methods", ",".join(STRESSED))
    yield study("stress", "stress", *hard, *budget, share=55)
    yield study("atlas", "atlas", *top, *PLANE, share=25)
    yield study("energy_momentum", "atlas", *upright, "--energy-momentum", share=10)
    yield study("validate", "validate", *CLAIMS, share=60)


def _run(study: QuickStudy, place: Path, limit_s: float) -> str:
    """Run one of them; why its document is not there, if so."""
    code, said = run(study.words, place, limit_s)
    document = place / study.name / study.document
    if code is None:
        document.unlink(missing_ok=True)  # a run leaves that of its part
        return f"not done in {limit_s:.0f} s"
    return "" if document.is_file() else harmless(said) or f"it ended with code {code}"


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
