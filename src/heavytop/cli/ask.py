"""The verbs that ask the other way round: which value gives this, and what a range gives."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from heavytop.cli import options
from heavytop.cli.command import manner, note, show, verb
from heavytop.cli.options import file, option, read
from heavytop.scene.quantities import showing

PICTURES = (".png", ".svg", ".pdf")
VARY = "Which number, and its range: start.psidot=10:400, with units if you like."
SO_THAT = 'What its motion is to have: "round = 3.5 s", "theta_max <= 5 deg", "kind = cusps".'
OVER = "Which number, from where to where, and how many: start.psidot=50:400:36."
FACTS = "Facts, such as round,theta_max,round_estimate."
TABLE = file("Write x.csv, x.json or a picture: x.png, x.svg, x.pdf.", ".csv", ".json", *PICTURES)


@verb
def find(
    scene: options.SceneName,
    vary: Annotated[str, option("KEY=A:B", VARY)],
    so_that: Annotated[str, option("WISH", SO_THAT)],
    changes: options.Changes = None,
) -> None:
    """Find which value of a scene gives the motion you want."""
    from heavytop.analytic import find as module
    from heavytop.results.ask import FoundResult

    found = module.find(read(scene, changes), vary, so_that).document()
    found.pop("schema")
    show(FoundResult(**found))


@verb
def sweep(
    scene: options.SceneName,
    over: Annotated[str, option("KEY=A:B:N", OVER)],
    facts: Annotated[str, option("NAME,…", FACTS)],
    file: Annotated[Path | None, TABLE] = None,
    changes: options.Changes = None,
) -> None:
    """Tabulate facts of the motion over a range."""
    from heavytop.studies import sweep as module

    found = module.sweep(read(scene, changes), over, options.names("--facts", facts) or ())
    if file is not None:
        with showing(manner().units):
            if file.suffix.lower() in PICTURES:
                from heavytop.plots.style import save

                save(found.figure(), file)
            else:
                found.save(file)
        note(f"wrote {file}")
    if file is None or manner().json:
        show(found)
