"""The options that verbs share, each stated once."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

from typer import Argument, BadParameter, Option

if TYPE_CHECKING:
    from heavytop.scene.scene import Scene

FormulationName = StrEnum("FormulationName", "AUTO AXIS ATTITUDE CUBIC ROUTH SUBSYSTEM LAGRANGE")
"""What --formulation takes: the names of the equations, known without deriving any."""


# --- values ----------------------------------------------------------------------------------


def named_folder(text: str) -> Path:
    """The folder of a name; an empty one would mean the folder one happens to be in."""
    if not str(text):
        raise BadParameter("the name of a folder cannot be empty")
    return Path(text)


def names(option: str, text: str | None) -> tuple[str, ...] | None:
    """The names in a list, without the blanks around them; None where there is no list."""
    if text is None:
        return None
    found = tuple(name.strip() for name in text.split(","))
    if not all(found):
        raise BadParameter(f"{text!r} is not NAME,NAME,…: a name is empty", param_hint=option)
    return found


def read(scene: str, changes: Sequence[str] | None, digits: int | None = None) -> Scene:
    """The scene of a name, or of the folder of a run, changed as the options ask."""
    from heavytop.scene.scene import load_scene, read_scene, shipped_names

    wanted = [] if digits is None else [f"want.digits={digits}"]
    changed, run = [*(changes or ()), *wanted], Path(scene) / "trajectory.nc"
    if scene in shipped_names() or not run.exists():
        return load_scene(scene, overrides=changed)
    from heavytop.hdf5 import attribute, opened

    with opened(run) as file:
        text, name = attribute(file, "scene"), attribute(file, "name")
    return read_scene(text, where=f"{name}.toml", overrides=changed)


def _changes(changes: list[str] | None) -> list[str]:
    for change in changes or []:
        key, equals, _ = change.partition("=")
        if not (key.strip() and equals):
            raise BadParameter(f"{change!r} is not KEY=VALUE, in one word: start.phidot=-14")
    return changes or []


def option(metavar: str, text: str, *named: str, **more: Any) -> Any:
    """An option with a value: the word for it, and what it is."""
    return Option(*named, metavar=metavar, help=text, **more)


def file(text: str, *endings: str) -> Any:
    """The option -o of a verb that writes one file, which ends in one of these."""

    def named(text: str) -> Path:
        if Path(text).suffix.lower() not in endings:
            raise BadParameter(f"{text}: the name of a file in {', '.join(endings)}")
        return Path(text)

    return option("FILE", text, "-o", "--output", parser=named)


# --- options ---------------------------------------------------------------------------------

WHICH: Final = "A shipped scene (heavytop scenes lists them), a TOML file, or the folder of a run."
SET: Final = "Change a value of the scene; may be repeated: --set start.phidot=-14."
DIGITS: Final = "Correct digits at the end of the span, such as 30; default: the scene's."
EQUATIONS: Final = f"Equations to integrate: {', '.join(FormulationName)}; auto: the fewest."
TOLERANCE: Final = "Relative error tolerance of a step in doubles, such as 1e-9; default: 2.2e-16."
FOLDER: Final = "Write results to this folder, such as out/first; default: no files."
METHODS: Final = (
    "Methods, each NAME or NAME=SETTING (a tolerance, or steps a period), as in "
    "taylor-axis=1e-9,gauss8=32, or your own, as mine.py:rk4=200; default: a selection."
)
SCHEDULER: Final = "Use the workers of a dask scheduler, such as tcp://192.168.0.2:8786."
SCENE: Final = Argument(metavar="SCENE", help=WHICH)
JOBS: Final = option("J", "Number of processes, such as 4.", "--jobs", "-j", min=1, max=1024)

SceneName = Annotated[str, SCENE]
Changes = Annotated[list[str] | None, option("KEY=VALUE", SET, "--set", callback=_changes)]
Digits = Annotated[int | None, option("D", DIGITS, min=1)]
Formulation = Annotated[FormulationName, option("NAME", EQUATIONS)]
Tolerance = Annotated[float | None, option("T", TOLERANCE)]
Folder = Annotated[Path | None, option("DIR", FOLDER, "-o", "--output", parser=named_folder)]
NoFigures = Annotated[bool, Option("--no-figures", help="Do not draw figures.")]
Methods = Annotated[str | None, option("NAME,…", METHODS)]
Periods = Annotated[float, option("N", "Length of the run in nutation periods, such as 1e6.")]
Budget = Annotated[float, option("S", "Time limit of the whole study [s], such as 60.")]
Jobs = Annotated[int, JOBS]
Scheduler = Annotated[str | None, option("ADDRESS", SCHEDULER)]
