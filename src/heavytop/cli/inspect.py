"""The verbs that integrate nothing: what a scene is, its exact values, and what is installed."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer import Argument, BadParameter, Option

from heavytop import errors
from heavytop.cli.messages import Exit, leave, print_json, print_table, show
from heavytop.cli.options import SCENE, Common, SceneName, names, scene_names, unwritable, verb

SCENES_SCHEMA = "heavytop/scenes/1"


@verb("changes")
def classify(scene: SceneName, *, common: Common) -> None:
    """Say which kind of motion a scene is, with the proof.

    Nothing is integrated.
    """
    from heavytop.results.classification import classified

    read = common.scene(scene)
    common.note(f"classifying {read.name}")
    show(classified(read).document(), common.json)


@verb("changes", "formulation", "digits")
def plan(scene: SceneName, *, common: Common) -> None:
    """Say how a scene would be integrated, why, and at what cost.

    Nothing is integrated.
    """
    from heavytop.results.classification import planned

    show(planned(common.scene(scene), common.formulation.value).document(), common.json)


@verb()
def scenes(
    name: Annotated[
        str | None,
        Argument(metavar="NAME", help="Print the text of this one.", autocompletion=scene_names),
    ] = None,
    *,
    common: Common,
) -> None:
    """List the scenes that are shipped, or print the text of one."""
    from heavytop.scene.scene import shipped_scenes, shipped_text

    if name is None:
        titles = shipped_scenes()
        if common.json:
            print_json({"schema": SCENES_SCHEMA, "scenes": dict(titles)})
            return
        from heavytop.report.tables import facts, printed

        print_table(printed([facts(titles.items())], ""))
        return
    try:
        text = shipped_text(name)
    except errors.BadScene as unknown:
        raise BadParameter(str(unknown), param_hint="NAME") from None
    if common.json:
        print_json({"schema": SCENES_SCHEMA, "name": name, "text": text})
    else:
        typer.echo(text, nl=False)


@verb()
def derive(
    latex: Annotated[bool, Option("--latex", help="Print a LaTeX document.")] = False,
    *,
    common: Common,
) -> None:
    """Derive from the rotation matrix what is integrated."""
    from heavytop.equations.derivation import as_latex, as_text, derivation, derive_document

    if latex and common.json:
        raise BadParameter("--json holds the LaTeX too", param_hint="--latex")
    if common.json:
        print_json(derive_document(derivation()))
    else:
        typer.echo((as_latex if latex else as_text)(derivation()))


@verb()
def doctor(*, common: Common) -> None:
    """Say what is installed here: versions, processor, wheel, cache."""
    from heavytop.doctor import diagnosis, in_words

    found = diagnosis()
    if common.json:
        print_json(found)
    else:
        typer.echo(in_words(found))
    if found["missing"]:
        leave([(Exit.OUT_OF_BOUND, "missing: " + ", ".join(found["missing"]))])


TIMES = "Times [s]: 0:10:0.01, or a file with a column t."
QUANTITIES = "Any of theta, phi, psi [rad], rates, omega [rad/s], axis, attitude."
EVENTS = "Any of turning, reversal, cusp; with --json or -o x.json."
FILE = "Write x.csv, x.json or x.nc; else to stdout."
PACK = "Write the values of all shipped scenes, and score.py, there."


@verb("changes")
def reference(
    scene: Annotated[str | None, SCENE] = None,
    times: Annotated[str | None, Option(metavar="A:B:STEP|FILE", help=TIMES)] = None,
    quantities: Annotated[str, Option(metavar="NAME,…", help=QUANTITIES)] = "theta,phi,psi",
    events: Annotated[str | None, Option(metavar="NAME,…", help=EVENTS)] = None,
    digits: Annotated[int, Option(metavar="D", help="Digits of every number, proved.")] = 20,
    output: Annotated[Path | None, Option("-o", "--output", metavar="FILE", help=FILE)] = None,
    pack: Annotated[Path | None, Option(metavar="DIR", help=PACK)] = None,
    *,
    common: Common,
) -> None:
    """Print exact values of a motion, every digit proved."""
    from heavytop.analytic import reference as exact

    if pack is not None:
        others = {"SCENE": scene, "--times": times, "--events": events, "-o": output}
        _pack(pack, common, others | {"--set": common.changes})
        return
    if scene is None or times is None:
        missing = "SCENE" if scene is None else "--times"
        raise BadParameter("is missing", param_hint=missing)
    if output is not None and output.suffix not in (".csv", ".json", ".nc"):
        raise BadParameter(f"{output}: .csv, .json or .nc", param_hint="-o")
    if events and not (common.json or (output is not None and output.suffix == ".json")):
        raise BadParameter("with --json or -o x.json: no table", param_hint="--events")
    wanted, happening = names("--quantities", quantities), names("--events", events)
    asked = exact.read_times(times)
    found = exact.reference(common.scene(scene), asked, wanted or (), digits, happening or ())
    if output is not None:
        try:
            found.save(output)
        except OSError as fault:
            raise unwritable(output, fault) from None
        common.note(f"wrote {output}")
    if common.json:
        print_json(found.document())
    elif output is None:
        typer.echo(found.to_csv(), nl=False)


def _pack(folder: Path, common: Common, others: dict[str, object]) -> None:
    """Write the values of all shipped scenes; what else was asked for has no say in them."""
    from heavytop.results.reference_pack import write_pack

    if given := [option for option, value in others.items() if value]:
        raise BadParameter("nothing else goes with --pack", param_hint=given[0])
    try:
        files = write_pack(folder)
    except OSError as fault:
        raise unwritable(folder, fault) from None
    common.note(f"wrote {len(files)} files into {folder}")
