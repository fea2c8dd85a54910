"""``heavytop validate``: what is claimed, measured against its bounds."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heavytop.cli.ending import ending
from heavytop.cli.exits import Exit
from heavytop.cli.options import Debug, Folder, Json, Quiet, Verbose
from heavytop.cli.output import noted, printing_anyway, results_folder, show
from heavytop.cli.voice import Voice, say

if TYPE_CHECKING:
    from heavytop.claims.validate import Validation

Names = Annotated[
    list[str] | None,
    typer.Argument(metavar="CLAIM", help="Claims or scripts; the default tier when left out."),
]
Proofs = Annotated[
    bool, typer.Option("--proofs", help="Run every validation script: hours, on a quiet machine.")
]


def validate(
    claims: Names = None,
    proofs: Proofs = False,
    json: Json = False,
    output: Folder = None,
    quiet: Quiet = False,
    verbose: Verbose = False,
    debug: Debug = False,
) -> None:
    """Measure what is claimed, on authorities outside this project."""
    from heavytop.claims.validate import UnknownClaim
    from heavytop.claims.validate import validate as measured

    voice = Voice(quiet, verbose)
    with ExitStack() as stack:
        stack.enter_context(ending())
        stack.enter_context(results_folder(output))
        try:
            found = measured(
                tuple(claims or ()),
                proofs=proofs,
                progress=stack.enter_context(voice.progress()),
                note=voice.note,
            )
        except UnknownClaim as unknown:
            raise typer.BadParameter(str(unknown), param_hint="CLAIM") from None
    finish(found, output, json=json, voice=voice)


def finish(found: Validation, folder: Path | None, *, json: bool, voice: Voice) -> None:
    """Write and print what was measured; leave with a code of its own where a claim fails."""
    files: dict[str, str] = {}
    with printing_anyway() as unsaved:
        files = results(found, folder, voice)
    show(found.document(files), json)
    for each in found.failed:
        say(f"{each.claim.id} does not hold" + (f": {each.failure}" if each.failure else ""))
    unsaved.leave()
    if found.failed:
        raise typer.Exit(Exit.OUT_OF_BOUND)


def results(found: Validation, folder: Path | None, voice: Voice) -> dict[str, str]:
    """Write the file of a validation, where there is a folder for it."""
    if folder is None:
        return {}
    from heavytop.report.study_files import write_validation

    return noted(write_validation(found, folder), folder, voice)
