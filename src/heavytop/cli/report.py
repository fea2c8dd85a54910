"""``heavytop report``: one page of what was run."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer
from typer import Argument, BadParameter, Option

from heavytop.cli.messages import FULL, Exit, leave
from heavytop.cli.options import (
    Common,
    named_folder,
    results_folder,
    scene_names,
    unwritable,
    verb,
)
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from heavytop.report.page import Page

PAGE = "report.html"
MARKS = {".html": b'name="generator" content="heavytop', ".json": b'"schema": "heavytop/report/1"'}
"""What stands near the beginning of the files of a report."""


def page_file(text: str) -> Path:
    """The file of a page: one that is named, as FILE.html, else that of a folder."""
    named = named_folder(text)
    if named.name.lower() == ".html":
        raise BadParameter(f"{text!r}: a name before .html, or a folder")
    as_folder = text.endswith(("/", os.sep)) or named.is_dir()
    return named if named.suffix.lower() == ".html" and not as_folder else named / PAGE


PLACES: Final = (
    "Folders of results; or a scene, about which quick studies are run first; or nothing: the "
    "book's tops."
)
WHERE: Final = (
    f"Write {PAGE} and report.json into this folder, or FILE.html; else into the current folder, "
    "and with --json nowhere."
)


@verb("changes")
def report(
    places: Annotated[
        list[str] | None,
        Argument(metavar="[DIR…|SCENE]", help=PLACES, autocompletion=scene_names),
    ] = None,
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="DIR", help=WHERE, parser=page_file)
    ] = None,
    *,
    common: Common,
) -> None:
    """Put results on one HTML page that needs no network.

    The numbers behind each figure stand beside it.
    """
    with ExitStack() as stack:
        folders, about = _meant(places or [], common)
        html = None if output is None and common.json else output or Path(PAGE)
        if html is not None:
            _expect_replaceable(html)
            stack.enter_context(results_folder(html.parent))
        page = _page(folders, about, common, stack)
        files = {} if html is None else _written(page, html)
    if common.json:
        typer.echo(page.json(files))
    elif html is not None:
        figures = sum(len(section.pictures) for section in page.sections)
        counts = {"result": len(page.sections), "figure": figures}
        told = ", ".join(f"{n} {thing}{'s'[: n != 1]}" for thing, n in counts.items())
        typer.echo(f"{harmless(html)}: {told}")
    leave(_ends(page, common.quiet))


def _ends(page: Page, quiet: bool) -> Iterator[tuple[Exit, str]]:
    for name, why in page.missing:
        yield Exit.OK, "" if quiet else f"not on the page: {name}: {why}"
    if not page.sections:
        yield Exit.ENDED_EARLY, ""


def _meant(places: list[str], common: Common) -> tuple[list[Path], list[str]]:
    """The folders that are named, or the words that name a scene and change it."""
    folders = [named_folder(each) for each in places if Path(each).is_dir()]
    if (folders or not places) and common.changes:
        raise BadParameter("changes a scene, and none is named", param_hint="--set")
    if len(folders) == len(places):
        return folders, []
    if len(places) > 1:
        others = ", ".join(repr(each) for each in places if not Path(each).is_dir())
        rule = f"several folders, or one scene; no folder: {others}"
        raise BadParameter(rule, param_hint="DIR")
    common.scene(places[0])  # refused here, if it is to be refused
    scene = places[0] if places[0] in scene_names() else str(Path(places[0]).absolute())
    return [], [scene, *(word for change in common.overrides for word in ("--set", change))]


def _expect_replaceable(html: Path) -> None:
    """Refuse to replace anything but a report, by the page or by the document beside it."""
    for suffix, mark in MARKS.items():
        path = html if suffix == ".html" else html.with_suffix(suffix)
        if path.exists() and not (path.is_file() and mark in _beginning(path)):
            rule = f"{harmless(path)} is there, and is no report: say where"
            raise BadParameter(rule, param_hint="-o")


def _beginning(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(2000)
    except OSError as error:
        raise unwritable(path, error) from None


def _page(folders: list[Path], about: list[str], common: Common, stack: ExitStack) -> Page:
    """The page of folders, or of the studies that are run first about a scene."""
    from heavytop.report.page import load_results, page_of

    missing: list[tuple[str, str]] = []
    if not folders:
        from heavytop.report.quick import quick

        temporary = tempfile.TemporaryDirectory(prefix="heavytop-", ignore_cleanup_errors=True)
        place = Path(stack.enter_context(temporary))
        missing = quick(place, about, heard=lambda name: common.note(f"running {name}"))
        folders = [place] if any(place.glob("*/*.json")) else []
    return page_of(load_results(folders) if folders else (), missing=missing)


def _written(page: Page, html: Path) -> dict[str, str]:
    from heavytop.report.page import write_page

    try:
        return write_page(page, html)
    except OSError as error:
        if error.errno in FULL:
            raise
        raise unwritable(html.parent, error) from error  # the folder has gone
