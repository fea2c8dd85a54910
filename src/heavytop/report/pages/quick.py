"""The quick studies, which a report runs where it is given no results."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, NamedTuple

from heavytop.files import write_document, write_text
from heavytop.report.pages.commands import command, folder, is_shipped, scene_file
from heavytop.report.pages.errand import run
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from heavytop.scene.scene import Scene

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
PLANE: Final = ("--x", "phidot=-30:40:300", "--y", "theta=0.02:1.5:300")


class Study(NamedTuple):
    """One of them.

    Attributes
    ----------
    name : str
        That of its folder.
    document : str
        The file that it writes there.
    words : tuple of str
        What is run: a verb, and what it is given.
    shown : str
        The same for a person.
    share : float
        Of the time that is left, its part to that of those after it.
    """

    name: str
    document: str
    words: tuple[str, ...]
    shown: str
    share: float


def quick(
    place: Path,
    scene: Scene | None = None,
    *,
    asked: Sequence[str] = (),
    heard: Callable[[str], object] = lambda _: None,
) -> list[tuple[str, str]]:
    """Run the quick studies, each into a folder of its own, by a process of its own.

    Parameters
    ----------
    place : Path
        It exists.
    scene : Scene, optional
        What they are about; the book's tops where there is none.
    asked : sequence of str, optional
        The words by which the scene was named, and changed, for the commands of what is missing.
    heard : callable, optional
        It is told the name of each before it begins.

    Returns
    -------
    list of (str, str)
        What was not run, and why.
    """
    until = time.monotonic() + LIMIT_S
    if scene is None:
        heard("traces")
        _traces(place / "traces")
    waiting = list(_studies(place, scene, asked))
    missing = []
    while waiting:
        study = waiting[0]
        left = until - time.monotonic()
        heard(study.name)
        limit = left * study.share / sum(each.share for each in waiting)
        if why := _run(waiting.pop(0), place, limit):
            missing.append((study.name, f"{why} ({study.shown})"))
    return missing


def _run(study: Study, place: Path, limit_s: float) -> str:
    """Run one of them; why its document is not there, if so."""
    folder, aside = place / study.name, place / f"{study.name}-aside" / "said"
    folder.mkdir()
    aside.mkdir(parents=True)
    ended = run((*study.words, "-q", "-o", str(folder)), aside, limit_s)
    if ended.code is None:
        (folder / study.document).unlink(missing_ok=True)  # a run leaves that of its part
        return f"not done in {limit_s:.0f} s"
    if (folder / study.document).is_file():
        return ""
    return harmless(ended.said.replace(f"{place}/", "")) or f"it ended with code {ended.code}"


def _studies(place: Path, scene: Scene | None, asked: Sequence[str]) -> Iterator[Study]:
    if scene is None:
        for k, name in enumerate(BOOK, start=1):
            yield _study(f"run-{k}-{name}", "run", "run", ("--no-figures",), (name,), share=16)
        about, upright = (BOOK[0],), (UPRIGHT,)
    else:
        about = upright = (_named(scene, place),)
        yield _study("run", "run", "run", ("--no-figures",), about, asked, share=40)
    drifting = ("--periods", PERIODS, "--methods", ",".join(DRIFTING))
    yield _study("drift", "drift", "drift", (*drifting, "--no-figures"), about, asked, share=45)
    budget = ("--budget", BUDGET, "--no-figures")
    yield _study("workprec", "workprec", "workprec", budget, about, asked, share=55)
    hard = ("--cases", ",".join(CASES), "--methods", ",".join(STRESSED))
    yield _study("stress", "stress", "stress", (*hard, *budget), share=55)
    yield _study("atlas", "atlas", "atlas", (*PLANE, "--no-figures"), about, asked, share=25)
    yield _study("energy-momentum", "energy_momentum", "atlas",
                 ("--energy-momentum", "--no-figures"), upright, asked, share=10)  # fmt: skip
    yield _study("claims", "validate", "validate", CLAIMS, share=60)


def _study(
    name: str,
    document: str,
    verb: str,
    options: tuple[str, ...],
    about: Sequence[str] = (),
    asked: Sequence[str] = (),
    *,
    share: float,
) -> Study:
    told = [word for word in options if word != "--no-figures"]
    shown = command(verb, *(asked or about), *told, *folder(name))
    return Study(name, f"{document}.json", (verb, *about, *options), shown, share)


def _named(scene: Scene, place: Path) -> str:
    """A word for the scene: its name where it is shipped, else a file that is written for it."""
    document = scene.document()
    if is_shipped(document):
        return scene.name
    path = place / f"{_harmless(scene.name)}.toml"
    write_text(path, scene_file(document))
    return str(path)


def _harmless(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in name)[:60] or "scene"


def _traces(folder: Path) -> None:
    """The path of the axis of every shipped scene, by the closed form: at once."""
    from heavytop.report.pages.traces import traces_document

    folder.mkdir()
    write_document(folder / "traces.json", traces_document())
