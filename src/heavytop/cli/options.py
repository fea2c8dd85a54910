"""What makes a function a verb: the options that verbs share, and what becomes of its exceptions.

A verb is a function with a parameter for each option of its own, and `common` for the others.
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer
from typer import Argument, BadParameter, Option

from heavytop import errors
from heavytop.cli.messages import exit_code, explain, plain_warnings, say

if TYPE_CHECKING:
    from heavytop.scene.scene import Scene


class FormulationName(StrEnum):
    """What --formulation takes: the names of the equations, known without deriving any."""

    AUTO = "auto"
    AXIS = "axis"
    ATTITUDE = "attitude"
    CUBIC = "cubic"
    ROUTH = "routh"
    SUBSYSTEM = "subsystem"
    LAGRANGE = "lagrange"


def named_folder(text: str) -> Path:
    """The folder of a name; an empty one would mean the folder one happens to be in."""
    if not str(text):
        raise BadParameter("the name of a folder, not an empty text")
    return Path(text)


def scene_names() -> list[str]:
    """Every shipped scene."""
    from heavytop.scene.scene import shipped_names

    return list(shipped_names())


def _changes(changes: list[str] | None) -> list[str]:
    for change in changes or []:
        key, equals, _ = change.partition("=")
        if not (key.strip() and equals):
            raise BadParameter(f"{change!r} is not KEY=VALUE, in one word: start.phidot=-14")
    return changes or []


SCENE_HELP: Final = "A shipped scene (heavytop scenes lists them), or the path of a TOML file."
SCENE: Final = Argument(metavar="SCENE", help=SCENE_HELP, autocompletion=scene_names)
SceneName = Annotated[str, SCENE]
EQUATIONS: Final = f"Equations to integrate, {', '.join(FormulationName)}: auto takes the fewest."
DIGITS: Final = "Digits wanted at the end of the span, such as 30; else those of the scene."
FOLDER: Final = "Write results into this folder, such as out/first; else nothing is written."
CHANGES: Final = "Change the scene, as often as it is given: --set start.phidot=-14."


@dataclass(frozen=True, kw_only=True)
class Common:
    """The options that verbs share; each verb names those that it takes."""

    formulation: Annotated[FormulationName, Option(metavar="NAME", help=EQUATIONS)] = (
        FormulationName.AUTO
    )
    digits: Annotated[int | None, Option(metavar="D", help=DIGITS)] = None
    json: Annotated[bool, Option("--json", help="Print one JSON document, nothing else.")] = False
    output: Annotated[
        Path | None, Option("-o", "--output", metavar="DIR", parser=named_folder, help=FOLDER)
    ] = None
    changes: Annotated[
        list[str] | None, Option("--set", metavar="KEY=VALUE", callback=_changes, help=CHANGES)
    ] = None
    no_figures: Annotated[bool, Option("--no-figures", help="Draw nothing.")] = False
    quiet: Annotated[bool, Option("-q", "--quiet", help="Print only errors on stderr.")] = False
    verbose: Annotated[bool, Option("-v", "--verbose", help="Say what is being done.")] = False
    debug: Annotated[bool, Option("--debug", help="Show where an error was raised.")] = False

    @property
    def overrides(self) -> list[str]:
        """The changes to the scene that the options ask for."""
        digits = [] if self.digits is None else [f"want.digits={self.digits}"]
        return [*(self.changes or []), *digits]

    def scene(self, name: str) -> Scene:
        """The scene of a name, changed as the options ask."""
        from heavytop.scene.scene import load_scene

        return load_scene(name, overrides=self.overrides)

    def note(self, text: str) -> None:
        """Say what is being done, to those who asked."""
        if self.verbose and not self.quiet:
            say(text)


ALWAYS: Final = ("json", "quiet", "verbose", "debug")
Verb = Callable[..., None]


def verb(*shared: str) -> Callable[[Verb], Verb]:
    """Give a function those options of `Common` that are named, and those that all verbs have."""
    taken = [
        each.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for each in inspect.signature(Common, eval_str=True).parameters.values()
        if each.name in (*shared, *ALWAYS)
    ]

    def with_options(function: Verb) -> Verb:
        signature = inspect.signature(function, eval_str=True)
        own = [each for each in signature.parameters.values() if each.name != "common"]

        @wraps(function)
        def run(**given: Any) -> None:
            common = Common(**{each.name: given.pop(each.name) for each in taken})
            with answering(common, {*given, *shared, "x, y"} - {"scene"}):
                function(**given, common=common)

        run.__signature__ = signature.replace(parameters=[*own, *taken])  # type: ignore[attr-defined]
        return run

    return with_options


@contextmanager
def answering(common: Common, options: Collection[str]) -> Iterator[None]:
    """Turn what a verb raises into a sentence and an exit code, with a traceback if asked for."""
    try:
        with plain_warnings(common.quiet), results_folder(common.output):
            try:
                yield
            except errors.BadScene as bad:
                raise _blamed(bad, common.overrides, options) from bad
    except (typer.Exit, BadParameter, BrokenPipeError):
        raise
    except (Exception, KeyboardInterrupt) as error:
        if common.debug:
            traceback.print_exc()
        say(explain(error))
        raise typer.Exit(exit_code(error)) from None


def _blamed(bad: errors.BadScene, changes: list[str], options: Collection[str]) -> Exception:
    """What is wrong with a scene; the fault of an option where nothing else is wrong."""
    from heavytop.scene.scene import CHANGES as PLACE

    keys = {change.partition("=")[0].strip() for change in changes}
    changed = {name for key in keys if "." in key for name in (key, key.partition(".")[0])}
    faults = tuple(
        replace(fault, file=PLACE, line=None) if fault.key in changed else fault
        for fault in bad.faults
    )
    told = errors.BadScene(faults)
    if all(fault.file == PLACE or fault.key in {*keys, *options} for fault in faults):
        return BadParameter(f"the scene cannot be run so:\n{told}")
    return told


@contextmanager
def results_folder(folder: Path | None) -> Iterator[None]:
    """The folder of -o, if any, proved writable before time is spent on what it is for."""
    with ExitStack() as stack:
        if folder is not None:
            from heavytop.files import writable

            try:
                stack.enter_context(writable(folder))
            except (OSError, ValueError) as error:
                raise unwritable(folder, error) from None
        yield


def unwritable(path: Path, error: Exception) -> BadParameter:
    """What is wrong with the folder or the file named by -o."""
    why = getattr(error, "strerror", None) or str(error)
    if isinstance(error, FileExistsError):
        why = "not a folder"
    return BadParameter(f"cannot write to {str(path)!r}: {why}", param_hint="-o")


def names(option: str, text: str | None) -> tuple[str, ...] | None:
    """The names in a list, without the blanks around them; None where there is no list."""
    if text is None:
        return None
    found = tuple(name.strip() for name in text.split(","))
    if not all(found):
        raise BadParameter(f"{text!r} is not NAME,NAME,…: a name is empty", param_hint=option)
    return found
