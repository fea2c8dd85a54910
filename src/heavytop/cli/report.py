"""``heavytop report``: one page of what was run."""

from __future__ import annotations

import os
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop.cli.ending import ending
from heavytop.cli.exits import FULL, Exit
from heavytop.cli.options import Debug, Json, Quiet, Set, Verbose, blaming, named_folder, overrides
from heavytop.cli.output import results_folder, unwritable
from heavytop.cli.voice import Voice, say
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from heavytop.report.pages.page import Page

PAGE = "report.html"


def page_file(text: str) -> Path:
    """The file of a page: one that is named, as FILE.html, else that of a folder."""
    named = named_folder(text)
    if named.name.lower() == ".html":
        raise typer.BadParameter(f"{text!r}: a name before .html, or a folder")
    as_folder = text.endswith(("/", os.sep)) or named.is_dir()
    return named if named.suffix.lower() == ".html" and not as_folder else named / PAGE


Places = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[DIR…|SCENE]",
        help="Folders of results; or a scene, about which quick studies are run first; or "
        "nothing: the book's tops.",
        show_default=False,
    ),
]
Where = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="DIR",
        help=f"Write {PAGE} and report.json here, or FILE.html (else in the current folder; "
        "with --json, nowhere).",
        parser=page_file,
    ),
]


def report(
    places: Places = None,
    json: Json = False,
    output: Where = None,
    changes: Set = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Put results on one HTML page that needs no network.

    The numbers behind each figure stand beside it.
    """
    voice = Voice(quiet, verbose)
    with ExitStack() as stack:
        stack.enter_context(ending())
        stack.enter_context(voice.warnings())
        folders, about = _meant(places or [], changes, stack)
        html = _file(output, json)
        if html is not None:
            stack.enter_context(results_folder(html.parent))
        page = _page(folders, about, voice, stack)
        files = {} if html is None else _written(page, html)
    if json:
        typer.echo(page.json(files))
    elif html is not None:
        typer.echo(f"{harmless(html)}: {_size(page)}")
    for name, why in () if quiet else page.missing:
        say(f"not on the page: {name}: {why}")
    if not page.sections:
        raise typer.Exit(Exit.ENDED_EARLY)


def _size(page: Page) -> str:
    counts = {"result": len(page.sections), "figure": sum(len(s.pictures) for s in page.sections)}
    return ", ".join(f"{n} {thing}{'s'[: n != 1]}" for thing, n in counts.items())


def _meant(
    places: list[str], changes: list[str] | None, stack: ExitStack
) -> tuple[list[Path], list[str]]:
    """The folders that are named, or the words that name a scene and change it."""
    folders = [named_folder(each) for each in places if Path(each).is_dir()]
    if (folders or not places) and changes:
        raise typer.BadParameter("changes a scene, and none is named", param_hint="--set")
    if folders and len(folders) == len(places):
        return folders, []
    if len(places) > 1:
        others = ", ".join(repr(each) for each in places if not Path(each).is_dir())
        raise typer.BadParameter(f"several folders, or one scene; no folder: {others}",
                                 param_hint="DIR")  # fmt: skip
    if not places:
        return [], []
    from heavytop.scene.scene import load_scene, shipped_names

    options = overrides(changes)
    stack.enter_context(blaming(options))
    load_scene(places[0], overrides=options)
    scene = places[0] if places[0] in shipped_names() else str(Path(places[0]).absolute())
    return [], [scene, *(word for change in options for word in ("--set", change))]


def _file(output: Path | None, json: bool) -> Path | None:
    """Where the page goes; it and the document beside it replace nothing but a report."""
    if output is None and json:
        return None
    html = output or Path(PAGE)
    for path, mark in ((html, b'name="generator" content="heavytop'),
                       (html.with_suffix(".json"), b'"schema": "heavytop/report/1"')):  # fmt: skip
        if path.exists() and not (path.is_file() and mark in _head(path)):
            raise typer.BadParameter(
                f"{harmless(path)} is there, and is no report: say where", param_hint="-o"
            )
    return html


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(2000)
    except OSError as error:
        raise unwritable(path, error) from None


def _page(folders: list[Path], about: list[str], voice: Voice, stack: ExitStack) -> Page:
    from heavytop.report.pages.page import load_results, page_of

    missing: list[tuple[str, str]] = []
    if not folders:
        from heavytop.report.pages.quick import quick

        temporary = tempfile.TemporaryDirectory(prefix="heavytop-", ignore_cleanup_errors=True)
        place = Path(stack.enter_context(temporary))
        missing = quick(place, about, heard=lambda name: voice.note(f"running {name}"))
        folders = [place] if any(place.glob("*/*.json")) else []
    return page_of(load_results(folders) if folders else (), missing=missing)


def _written(page: Page, html: Path) -> dict[str, str]:
    from heavytop.report.pages.page import write_page

    try:
        return write_page(page, html)
    except OSError as error:
        if error.errno in FULL:
            raise
        raise unwritable(html.parent, error) from error  # the folder has gone
