"""The verbs that integrate nothing: what a scene is, its exact values, and what is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, BadParameter, Option

from heavytop import errors
from heavytop.cli import options
from heavytop.cli.command import Exit, answer, leave, manner, note, print_table, show, verb
from heavytop.cli.options import file, option, read
from heavytop.scene.quantities import WANTED, quantity_of

SCENES_SCHEMA = "heavytop/scenes/1"


@verb
def classify(scene: options.SceneName, changes: options.Changes = None) -> None:
    """Find and prove the kind of motion of a scene.

    Nothing is integrated.
    """
    from heavytop.results.classification import classified

    known = read(scene, changes)
    note(f"classifying {known.name}")
    show(classified(known))


@verb
def plan(
    scene: options.SceneName,
    formulation: options.Formulation = options.FormulationName.AUTO,
    digits: options.Digits = None,
    changes: options.Changes = None,
) -> None:
    """Show how a scene would be integrated, why, and at what cost.

    Nothing is integrated.
    """
    from heavytop.results.classification import planned

    show(planned(read(scene, changes, digits), formulation.value))


PRINTED = Argument(metavar="NAME", help="Print the text of this scene.")


@verb
def scenes(name: Annotated[str | None, PRINTED] = None) -> None:
    """List the shipped scenes, or print the text of one."""
    from heavytop.scene.scene import shipped_scenes, shipped_text

    if name is None:
        titles = shipped_scenes()
        from heavytop.results.base import Table

        document = {"schema": SCENES_SCHEMA, "scenes": titles}
        answer(document, lambda: print_table(Table.of_facts(titles.items())))
        return
    try:
        text = shipped_text(name)
    except errors.BadScene as unknown:
        raise BadParameter(str(unknown), param_hint="NAME") from None
    document = {"schema": SCENES_SCHEMA, "name": name, "text": text}
    answer(document, lambda: typer.echo(text, nl=False))


@verb
def derive(latex: Annotated[bool, Option(help="Print a LaTeX document.")] = False) -> None:
    """Derive the integrated equations from the rotation matrix."""
    from heavytop.equations.derivation import as_latex, as_text, derivation, derive_document

    if latex and manner().json:
        raise BadParameter(
            "cannot be combined with --json, which contains the LaTeX", param_hint="--latex"
        )
    steps = derivation()
    answer(derive_document(steps), lambda: typer.echo((as_latex if latex else as_text)(steps)))


@verb
def doctor() -> None:
    """Print the versions, the processor, and heyoka's cache."""
    from heavytop.doctor import diagnosis, in_words

    found = diagnosis()
    answer(found, lambda: typer.echo(in_words(found)))
    if found["missing"]:
        leave([(Exit.OUT_OF_BOUND, "missing: " + ", ".join(found["missing"]))])


TIMES = "Times [s]: 0:10:0.01, or a file with a column t."
QUANTITIES = f"Any of {', '.join(n for n in WANTED if quantity_of(n).columns)}, omega."
EVENTS = "Events to add: turning, reversal, cusp; needs --json or -o x.json."
TABLE = file("Write x.csv or x.json; default: print.", ".csv", ".json")


@verb
def reference(
    scene: options.SceneName,
    times: Annotated[str, option("A:B:STEP|FILE", TIMES)],
    quantities: Annotated[str, option("NAME,…", QUANTITIES)] = "theta,phi,psi",
    events: Annotated[str | None, option("NAME,…", EVENTS)] = None,
    digits: Annotated[int, option("D", "Proved digits of every number, such as 50.")] = 20,
    file: Annotated[Path | None, TABLE] = None,
    changes: options.Changes = None,
) -> None:
    """Print exact values of a motion, every digit proved."""
    from heavytop.analytic import reference as exact

    if events and not (manner().json or (file is not None and file.suffix.lower() == ".json")):
        raise BadParameter("with --json or -o x.json: no table", param_hint="--events")
    if manner().unit:
        raise BadParameter("none: every digit is proved in SI", param_hint="--unit")
    wanted = options.names("--quantities", quantities) or ()
    happening = options.names("--events", events) or ()
    asked = exact.read_times(times)
    found = exact.reference(read(scene, changes), asked, wanted, digits, happening)
    if file is not None:
        found.save(file)
        note(f"wrote {file}")
    if file is None or manner().json:
        answer(found.document(), lambda: typer.echo(found.to_csv(), nl=False))
