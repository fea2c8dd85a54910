"""The verbs that judge and show: claims, a trajectory of one's own, one page of what was run."""

from __future__ import annotations

import math
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer import Argument, BadParameter, Option

from heavytop.cli import options
from heavytop.cli.command import FULL, Exit, answer, leave, manner, note, progress_bar, say, verb
from heavytop.cli.command import results_folder as proved
from heavytop.cli.options import option
from heavytop.cli.studies import finish
from heavytop.errors import HeavyTopError, StoppedEarly
from heavytop.spelling import harmless

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from heavytop.scene.scene import Scene

CLAIMS: Final = "Claims or scripts, such as betsch-cone 39_flint; default: all claims."
PROOFS: Final = "Measure all that scripts claim; takes an hour or two on a quiet machine."


@verb
def validate(
    claims: Annotated[list[str] | None, Argument(metavar="CLAIM", help=CLAIMS)] = None,
    proofs: Annotated[bool, Option("--proofs", help=PROOFS)] = False,
    jobs: options.Jobs = 2,
    output: options.Folder = None,
) -> None:
    """Measure the package's claims against outside authorities."""
    from heavytop import claims as register

    told: dict[str, Any] = {"note": say if proofs and not manner().quiet else note}
    try:
        with progress_bar() as told["progress"]:
            found = register.validate(claims or (), proofs=proofs, jobs=jobs, folder=output, **told)
    except register.UnknownClaim as unknown:
        raise BadParameter(str(unknown), param_hint="CLAIM") from None
    finish(found, output)


DATA: Final = "A table (.csv, .tsv, .npz, .mat, .nc or .h5), or the folder of a run."
SUBJECT: Final = "Scene of the data, such as sicm-kicked, or a file with only a table [top]."
COLUMNS: Final = "Your names of the columns, such as t=Zeit,theta=tilt [deg]."
UNDONE: Final = "Conventions under which the data are judged, such as y-up,degrees."
ENOUGH: Final = "Exit with code 5 if the data have fewer digits than D, such as 6."
FILES: Final = {"check.json", "check.svg", "check.png"}
CHARTS: Final = (".svg", ".png", ".pdf")
DRAWN: Final = (
    "Write a chart of the errors (x.svg, x.png or x.pdf), or chart and document to a folder."
)
OF: Final = option("SCENE", SUBJECT)


@verb
def check(
    data: Annotated[Path, Argument(metavar="DATA", help=DATA)],
    scene: Annotated[str | None, OF] = None,
    columns: Annotated[str | None, option("NAME=COLUMN,…", COLUMNS)] = None,
    undone: Annotated[str | None, option("NAMES", UNDONE, "--as")] = None,
    digits: Annotated[float | None, option("D", ENOUGH)] = None,
    file: Annotated[Path | None, option("FILE|DIR", DRAWN, "-o", "--output")] = None,
    changes: options.Changes = None,
) -> None:
    """Compare your trajectory with the exact motion; name mistakes."""
    from heavytop.checking.judge import check as judge
    from heavytop.checking.judge import subject

    pairs = [pair.partition("=") for pair in options.names("--columns", columns) or ()]
    if not all(equals for _, equals, _ in pairs):
        raise BadParameter(f"{columns!r} is not NAME=COLUMN,…", param_hint="--columns")
    if digits is not None and not 0 <= digits < math.inf:
        raise BadParameter(f"{digits:g} is not a number of digits", param_hint="--digits")
    chart = file is not None and file.suffix.lower() in CHARTS and not file.is_dir()
    if file is not None and not chart and file.suffix and not file.is_dir():
        raise BadParameter(f"{file}: a folder, or {', '.join(CHARTS)}", param_hint="-o")
    if file is not None and file.is_dir() and {x.name for x in file.iterdir()} - FILES:
        raise BadParameter(f"{file} contains files that are not of a check", param_hint="-o")
    if changes and scene is None:
        raise BadParameter("needs a --scene to change", param_hint="--set")
    of = scene if scene is None else subject(scene, changes or ())
    taken = options.names("--as", undone) or ()
    found = judge(data, of, {name: column for name, _, column in pairs}, taken)
    document = found.document()
    ends = []
    if digits is not None and found.digits_as_given < digits:
        said = f"{digits:g} digits were requested; the data have {found.digits_as_given:.1f}"
        ends.append((Exit.OUT_OF_BOUND, said))
    answer(document, lambda: print(found, flush=True))  # in the alphabet of the terminal
    if file is not None:
        from heavytop.plots.studies import check_figure
        from heavytop.plots.style import save
        from heavytop.report.files import write_study
        from heavytop.results.check import CheckResult

        try:
            if chart:
                save(check_figure(document), file)
                note(f"wrote {file}")
            else:
                for name in write_study(CheckResult.from_document(document), file).values():
                    note(f"wrote {file / name}")
        except StoppedEarly as fault:
            ends.insert(0, (Exit.ENDED_EARLY, str(fault)))
        except OSError as fault:
            code = Exit.ENDED_EARLY if fault.errno in FULL else Exit.USAGE
            ends.insert(0, (code, f"cannot write {file}: {fault.strerror or fault}"))
    leave(ends)


# --- film ------------------------------------------------------------------------------------

FILM: Final = options.file("Film to write: x.gif, x.webp or x.mp4.", ".gif", ".webp", ".mp4")


@verb
def film(
    scene: options.SceneName,
    file: Annotated[Path, FILM],
    seconds: Annotated[float, option("S", "Length of the film [s].")] = 10.0,
    fps: Annotated[float, option("F", "Frames a second, at most 50.")] = 25.0,
    size: Annotated[str, option("WxH", "Width and height in pixels, such as 800x600.")] = "800x600",
    follow: Annotated[
        bool, Option("--follow", help="Turn the camera with the precession of the top.")
    ] = False,
    changes: options.Changes = None,
) -> None:
    """Make a film of the exact motion, slowed down."""
    from heavytop.plots.film import film as make

    known = options.read(scene, changes)
    with progress_bar() as bar:
        made = make(known, file, seconds=seconds, fps=fps, size=size, follow=follow, progress=bar)
    document = {"schema": "heavytop/film/1", "scene": known.name, "file": str(made)}
    answer(document, lambda: typer.echo(f"{harmless(made)}: {made.stat().st_size / 1e6:.2g} MB"))


# --- explore ---------------------------------------------------------------------------------

EXPLORED: Final = Argument(metavar="SCENE", help="The scene that the page starts with.")


@verb
def explore(
    file: Annotated[Path, options.file("Page to write: x.html.", ".html")],
    scene: Annotated[str, EXPLORED] = "sicm-kicked",
    changes: options.Changes = None,
) -> None:
    """Write an HTML page where you change a top and watch it move.

    The page computes in the browser and needs no network.
    """
    from heavytop.report.explorer import explore as make

    known = options.read(scene, changes)
    made = make(known, file)
    document = {"schema": "heavytop/explore/1", "scene": known.name, "file": str(made)}
    answer(document, lambda: typer.echo(f"{harmless(made)}: {made.stat().st_size / 1e6:.2g} MB"))


# --- report ----------------------------------------------------------------------------------

PAGE: Final = "report.html"
REPORT_SCHEMA: Final = "heavytop/report/2"


def page_file(text: str) -> Path:
    """The file of a page: one that is named, as FILE.html, else that of a folder."""
    named = options.named_folder(text)
    return named if named.suffix.lower() == ".html" and not named.is_dir() else named / PAGE


ABOUT: Final = (
    "Folders of results; or a scene, which is run and studied first; default: sicm-kicked."
)
WHERE: Final = f"Folder for {PAGE}, or FILE.html; default: the current folder."
PLACES: Final = Argument(metavar="[DIR…|SCENE]", help=ABOUT)
PLANE: Final = ("phidot=-30:40:300", "theta=0.02:1.5:300")


@verb
def report(
    places: Annotated[list[str] | None, PLACES] = None,
    file: Annotated[Path | None, option("DIR", WHERE, "-o", "--output", parser=page_file)] = None,
    changes: options.Changes = None,
) -> None:
    """Put results on one HTML page that needs no network.

    The page includes the numbers of each result.
    """
    from heavytop.report.page import page_of, write_page

    missing: list[tuple[str, str]] = []
    with ExitStack() as stack:
        folders = _folders(places or [], changes or [])
        scene = None if folders else options.read((places or ["sicm-kicked"])[0], changes)
        html = file or Path(PAGE)
        stack.enter_context(proved(html.parent))
        if scene is not None:
            temporary = tempfile.TemporaryDirectory(prefix="heavytop-", ignore_cleanup_errors=True)
            folders = [Path(stack.enter_context(temporary))]
            missing += _study(scene, folders[0])
        page = page_of(folders)
        write_page(page, html)
    figures = sum(len(section.pictures) for section in page.sections)
    counts = {"result": len(page.sections), "figure": figures}
    told = ", ".join(f"{n} {thing}{'s'[: n != 1]}" for thing, n in counts.items())
    document = {
        "schema": REPORT_SCHEMA,
        "file": harmless(html),
        "results": [section.name for section in page.sections],
        "missing": [{"study": name, "reason": why} for name, why in missing],
    }
    answer(document, lambda: typer.echo(f"{harmless(html)}: {told}"))
    said = () if manner().quiet else missing
    leave([(Exit.OK, f"not on the page: {name}: {why}") for name, why in said])


def _folders(places: list[str], changes: list[str]) -> list[Path]:
    """The folders that are named; none where a scene is, or nothing."""
    folders = [options.named_folder(each) for each in places if Path(each).is_dir()]
    if folders and changes:
        raise BadParameter("needs a SCENE to change", param_hint="--set")
    if len(folders) < len(places) and len(places) > 1:
        others = ", ".join(repr(each) for each in places if not Path(each).is_dir())
        rule = f"give several folders or one scene; these are not folders: {others}"
        raise BadParameter(rule, param_hint="DIR")
    return folders


def _study(scene: Scene, place: Path) -> Iterator[tuple[str, str]]:
    """Run a scene and its studies, each with its defaults; say what cannot be done."""
    from heavytop.claims import validate
    from heavytop.report.files import write_results, write_study
    from heavytop.run.propagation import propagate
    from heavytop.studies import atlas, drift, stress, work_precision

    studies: dict[str, Callable[[], Any]] = {
        "run": lambda: propagate(scene),
        "drift": lambda: drift.drift(scene),
        "workprec": lambda: work_precision.work_precision(scene),
        "stress": stress.stress,
        "atlas": lambda: atlas.atlas(scene, *PLANE),
        "validate": validate,
    }
    for name, study in studies.items():
        note(f"running {name}")
        try:
            (place / name).mkdir()
            write = write_results if name == "run" else write_study
            write(study(), place / name, figures=False)
        except StoppedEarly:
            raise
        except HeavyTopError as fault:
            yield name, str(fault)
