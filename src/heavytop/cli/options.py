"""The options that verbs share, and what they ask of a scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from heavytop import errors

DEBUG = "heavytop.debug"  # key in the context that every verb shares


def _note_debug(ctx: typer.Context, wanted: bool) -> None:
    ctx.meta[DEBUG] = wanted


def named_folder(text: str) -> Path:
    """The folder of a name; an empty one would mean the folder one happens to be in."""
    if not str(text):
        raise typer.BadParameter("the name of a folder, not an empty text")
    return Path(text)


def listed(option: str, what: str) -> Any:
    """An option that takes a list; `names` says what is in it."""
    return typer.Option(option, metavar="NAME,…", help=what)


def budgeted(least: float) -> Any:
    """The option of a budget of time."""
    return typer.Option("--budget", metavar="S", min=least, help="Seconds for all of it.")


SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="A shipped scene or the path of a TOML file.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON document and nothing else.")]
Folder = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        metavar="DIR",
        help="Write results here (else nowhere).",
        parser=named_folder,
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change the scene: --set start.phidot=-14."),
]
Form = Annotated[
    str, typer.Option("--formulation", metavar="NAME", help="Equations to integrate, or auto.")
]
Digits = Annotated[
    int | None,
    typer.Option("--digits", metavar="D", min=1, max=10_000, help="Digits wanted at the end."),
]
Periods = Annotated[
    float, typer.Option("--periods", metavar="N", help="Nutation periods to go.", min=1)
]
Jobs = Annotated[int, typer.Option("--jobs", "-j", metavar="J", min=1, max=1024, help="Processes.")]
NoFigures = Annotated[bool, typer.Option("--no-figures", help="Draw nothing.")]
Latex = Annotated[bool, typer.Option("--latex", help="Print one whole LaTeX document.")]
Quiet = Annotated[bool, typer.Option("-q", "--quiet", help="Errors only on stderr.")]
Verbose = Annotated[bool, typer.Option("-v", "--verbose", help="Say what is being done.")]
Debug = Annotated[
    bool,
    typer.Option("--debug", help="Show tracebacks.", callback=_note_debug, is_eager=True),
]


def overrides(changes: list[str] | None, digits: int | None = None) -> list[str]:
    """The changes to the scene that the options ask for."""
    changes = changes or []
    for change in changes:
        key, equals, _ = change.partition("=")
        if not (key.strip() and equals):
            raise typer.BadParameter(f"{change!r} is not KEY=VALUE", param_hint="--set")
    return [*changes, *([f"want.digits={digits}"] if digits is not None else [])]


def names(option: str, text: str | None) -> tuple[str, ...] | None:
    """The names that a list holds, without the blanks around them; None where there is no list."""
    if text is None:
        return None
    found = tuple(name.strip() for name in text.split(","))
    if not all(found):
        raise typer.BadParameter(f"{text!r} is not NAME,NAME,…: a name is empty", param_hint=option)
    return found


@contextmanager
def blaming(options: list[str]) -> Iterator[None]:
    """Blame the options, not the scene, for what stands in an option."""
    keys = {"formulation", *(option.partition("=")[0].strip() for option in options)}
    changed = {name for key in keys if "." in key for name in (key, key.partition(".")[0])}
    try:
        yield
    except errors.BadScene as bad:
        from heavytop.scene.scene import CHANGES

        faults = [
            replace(fault, file=CHANGES, line=None) if fault.key in changed else fault
            for fault in bad.faults
        ]
        told = errors.BadScene(tuple(faults))
        if all(fault.file == CHANGES or fault.key in keys for fault in told.faults):
            raise typer.BadParameter(f"the scene cannot be run so:\n{told}") from bad
        raise told from bad
