"""``heavytop check``: a trajectory that somebody else computed, judged by the exact motion."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

from typer import Argument, BadParameter, Option

from heavytop.cli.messages import FULL, Exit, leave, print_json
from heavytop.cli.options import Common, names, scene_names, verb

DATA = "A table: .csv, .tsv, .npz, .mat, .nc or .h5."
SCENE = "What the data are of: a scene, or a file with a [top] alone."
COLUMNS = "Names of unusual columns, as in t=Zeit,theta=tilt."
DIGITS = "Leave with 5 if the data have fewer digits, such as 6."
CHART = "Draw the errors: x.svg, x.png or x.pdf."


@verb()
def check(
    data: Annotated[Path, Argument(metavar="DATA", help=DATA)],
    scene: Annotated[
        str | None, Option(metavar="SCENE", help=SCENE, autocompletion=scene_names)
    ] = None,
    columns: Annotated[str | None, Option(metavar="NAME=COLUMN,…", help=COLUMNS)] = None,
    digits: Annotated[float | None, Option(metavar="D", help=DIGITS)] = None,
    output: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help=CHART)] = None,
    *,
    common: Common,
) -> None:
    """Judge a trajectory of your own, and name the usual slips."""
    from heavytop.checking.judge import check as judge

    pairs = [pair.partition("=") for pair in names("--columns", columns) or ()]
    if not all(equals for _, equals, _ in pairs):
        raise BadParameter(f"{columns!r} is not NAME=COLUMN,…", param_hint="--columns")
    if output is not None and output.suffix not in (".svg", ".png", ".pdf"):
        raise BadParameter(f"{output}: .svg, .png or .pdf", param_hint="-o")
    if digits is not None and not 0 <= digits < math.inf:
        raise BadParameter(f"{digits:g} is no number of digits", param_hint="--digits")
    found = judge(data, scene, {name: column for name, _, column in pairs})
    document = found.document()
    if common.json:
        print_json(document)
    else:
        print(found, flush=True)  # in the alphabet of the terminal
    ends = []
    if output is not None:
        from heavytop.plots.studies import check_figure
        from heavytop.plots.style import save

        try:
            save(check_figure(document), output)
            common.note(f"wrote {output}")
        except OSError as fault:
            code = Exit.ENDED_EARLY if fault.errno in FULL else Exit.USAGE
            ends.append((code, f"cannot write {output}: {fault.strerror or fault}"))
    if digits is not None and found.digits < digits:
        said = f"{digits:g} digits were asked for, and there are {found.digits:.1f}"
        ends.append((Exit.OUT_OF_BOUND, said))
    leave(ends)
