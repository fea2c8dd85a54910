"""``heavytop run``, and ``heavytop resume`` of a run that was interrupted or killed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from heavytop import errors
from heavytop.cli.command import CommandResult, option
from heavytop.errors import EndedEarly, Exit, Outcome

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.results.run import RunResult
    from heavytop.run.exact import SceneMotion
    from heavytop.run.plan import Plan
    from heavytop.run.trajectory import Trajectory
    from heavytop.scene.scene import Scene

Progress: TypeAlias = Callable[[float], None]


def run(
    scene: Scene,
    *,
    force: bool = False,
    formulation: str = "auto",
    digits: int | None = None,
    folder: Path | None = None,
    figures: bool = True,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> CommandResult:
    """Integrate a scene and compare it with the closed form.

    Parameters
    ----------
    scene : Scene
    force : bool
        Replace another run in the folder.
    formulation : str
        Equations to integrate, such as axis; auto: the fewest.
    digits : int, optional
        Correct digits at the end of the span, such as 30; default: the scene's.
    folder : path, optional
        Write results to this folder, such as out/first; default: no files.
    tolerance : float, optional
        Relative error tolerance of a step in doubles, such as 1e-9; default: 2.2e-16.
    """
    from heavytop.run.planning import read_options

    asked = {"formulation": formulation, "tolerance": tolerance}
    read_options(scene, digits=digits, **asked)
    if digits is not None:
        scene = replace(scene, digits=digits)
    return run_folder(folder, scene, asked, figures, progress, force)


def resume(
    folder: Path, *, figures: bool = True, progress: Any = None, **how: Any
) -> CommandResult:
    """Continue a study or a run that was interrupted or killed.

    Parameters
    ----------
    folder : path
        The folder of a study, such as drift or validate, or of a run.
    methods : sequence of str
        Your own methods that the study uses, named again: mine.py:rk4.
    """
    from heavytop.report.files import finished_run
    from heavytop.results.base import typed, typing
    from heavytop.results.registry import RESULTS
    from heavytop.scene.scene import read_scene
    from heavytop.studies import study
    from heavytop.studies.journal import first_line

    begun = first_line(folder)
    figures &= "--no-figures" not in (begun.get("command") or "").split()
    with typing(begun.get("command") or typed()):  # the command that began it
        if not (run := begun.get("run")):
            finished = any((folder / name).exists() for name in RESULTS)
            found = study.resume(folder, progress=progress, **how)
            notes = [(Exit.OK, f"{folder}: this study is finished")] * finished
            return CommandResult(found, notes, figures=figures)
        if known := finished_run(folder):
            code = Exit.OK if known.outcome == Outcome.FINISHED else Exit.ENDED_EARLY
            return CommandResult(known, [(code, f"{folder}: this run is {known.outcome}")])
        scene, asked = read_scene(run["text"], f"{run['name']}.toml"), begun["parameters"]
        asked = {name: asked[name] for name in ("formulation", "tolerance")}
        return run_folder(folder, scene, asked, figures, progress)


def run_folder(
    folder: Path | None, scene: Scene, asked: Any, figures: bool, progress: Any, force: bool = False
) -> CommandResult:
    """Run a scene, or the rest of it; a scene that cannot be run changes no folder."""
    from heavytop.report.files import open_run
    from heavytop.results.run import run_result
    from heavytop.run.plan import closed_form_of
    from heavytop.run.planning import plan_motion

    motion = closed_form_of(scene)
    plan = plan_motion(scene, motion, **asked)
    with ExitStack() as held:
        if folder:
            held.enter_context(open_run(folder, scene, asked, force=force))
        run, early = integrate(scene, motion, plan, folder, progress)
        result = run_result(run)
        problems = problems_of(result, early, folder)
        return CommandResult(result, problems, figures=figures, held=held.pop_all())


def integrate(
    scene: Scene, motion: Motion, plan: Plan, folder: Path | None, progress: Progress | None
) -> tuple[Trajectory | SceneMotion, EndedEarly | None]:
    """Integrate a scene, from the checkpoint in its folder; return also why it ended early, if so.

    Raises
    ------
    ForeignFile
        The trajectory in the folder is of another scene.
    StoppedEarly
        Ctrl-C: the part is kept, and nothing is made of it.
    """
    from heavytop.report.files import tables_of
    from heavytop.results.run import TRAJECTORY
    from heavytop.run.exact import SceneMotion
    from heavytop.run.propagation import Course, finish, integrate_plan
    from heavytop.run.trajectory_file import load_trajectory

    if plan.formulation == "none":
        return SceneMotion(scene, motion, plan), None
    checkpoint = None if folder is None else folder / TRAJECTORY
    part = load_trajectory(checkpoint) if checkpoint and checkpoint.exists() else None
    if part and tables_of(part.scene) != tables_of(scene):
        raise errors.ForeignFile(f"{checkpoint}: of another scene (run --force replaces it)")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", errors.MissedDigitsWarning)  # `problems_of` has it
            course = Course(progress, checkpoint)
            if part:
                return finish(part, course), None
            return integrate_plan(scene, motion, plan, course), None
    except EndedEarly as early:
        if early.outcome is Outcome.INTERRUPTED:  # comparing the part may take as long as the run
            why = f"interrupted at t = {early.trajectory.orbit.end:.6g} s"
            raise errors.StoppedEarly(errors.Stop.INTERRUPTED, why, folder) from None
        return early.trajectory, early


def problems_of(
    result: RunResult, early: EndedEarly | None, folder: Path | None
) -> Iterator[tuple[Exit, str]]:
    """Yield the problems of a run, with exit codes, and where a part of it is kept."""
    from heavytop.run.counts import differences
    from heavytop.run.verify import miss_text

    if early is not None:
        where = "above (-o DIR keeps it)" if folder is None else f"in {folder}"
        at = f"at t = {early.trajectory.orbit.end:.6g} s"
        yield early.exit, f"ended early {at}: {early}; the partial result is {where}"
        return
    if result.missed_digits:
        found = miss_text(dict(result.missed_digits), result.scene["want"]["digits"])
        yield Exit.OUT_OF_BOUND, found
    if result.missed_events:  # a warning has the words already, unless it is quiet
        why = "; ".join(differences(result.missed_events, result.events))
        yield Exit.OUT_OF_BOUND, why if option("quiet") else ""
