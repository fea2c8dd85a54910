"""``heavytop run``, and going on with a run that was interrupted or killed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from heavytop import errors
from heavytop.cli.command import CommandResult, option
from heavytop.errors import EndedEarly, Exit, Outcome

if TYPE_CHECKING:
    from heavytop.analytic.motion import Motion
    from heavytop.report.files import Request
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
    from heavytop.report.files import Request
    from heavytop.run.planning import read_options

    read_options(scene, formulation=formulation, tolerance=tolerance, digits=digits)
    if digits is not None:
        scene = replace(scene, digits=digits)
    request = Request(scene, formulation, figures, tolerance)
    return run_request(request, folder, progress, force=force)


def resume(
    folder: Path,
    *,
    methods: Sequence[str] = (),
    figures: bool = True,
    progress: Any = None,
    **workers: Any,
) -> CommandResult:
    """Continue a study or a run that was interrupted or killed.

    Parameters
    ----------
    folder : path
        The folder of a study, such as drift or validate, or of a run.
    methods : sequence of str
        Your own methods that the study uses, named again: mine.py:rk4.
    """
    from heavytop.report.files import DOCUMENT, REQUEST, TRAJECTORY, Request
    from heavytop.results.base import command_of, typed, typing
    from heavytop.results.registry import RESULTS
    from heavytop.results.run import RunResult
    from heavytop.studies import study
    from heavytop.studies.journal import STUDY

    there = [x for x in (STUDY, REQUEST, DOCUMENT, TRAJECTORY) if (folder / x).exists()]
    if not there:
        raise errors.ForeignFile(f"{folder}: there is neither a study nor a run to go on with")
    with typing(command_of(folder / there[0]) or typed()):  # that of the command that began it
        if there[0] == STUDY:
            finished = any((folder / name).exists() for name in RESULTS)
            found = study.resume(folder, methods=methods, progress=progress, **workers)
            return CommandResult(found, [(Exit.OK, f"{folder}: this study is finished")] * finished)
        if there[0] == DOCUMENT:
            known = RunResult.load(folder / DOCUMENT)
            code = Exit.OK if known.outcome == Outcome.FINISHED else Exit.ENDED_EARLY
            return CommandResult(known, [(code, f"{folder}: this run is {known.outcome}")])
        request = Request.read(folder)
        request.write(folder)
        return run_request(replace(request, figures=request.figures and figures), folder, progress)


def run_request(
    request: Request, folder: Path | None, progress: Progress | None, *, force: bool = False
) -> CommandResult:
    """Do what is asked, or what is left of it; what cannot be run touches no folder.

    Of a run that is interrupted nothing is made: comparing it would take as long as it did.
    """
    from heavytop.report.files import REQUEST, open_run, write_results
    from heavytop.results.run import run_result
    from heavytop.run.planning import planned
    from heavytop.run.span import closed_form_of

    motion = closed_form_of(request.scene)
    plan = planned(request.scene, motion, request.formulation, tolerance=request.tolerance)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
    with nullcontext() if folder is None else open_run(folder, request, force=force):
        run, early = integrate(request, motion, plan, folder, progress)
        if early is not None and early.outcome is Outcome.INTERRUPTED:
            why = f"interrupted at t = {early.trajectory.orbit.end:.6g} s"
            raise errors.StoppedEarly(errors.Stop.INTERRUPTED, why, folder)
        if folder is None:
            result = run_result(run)
        else:
            result = write_results(run, folder, figures=request.figures)
            (folder / REQUEST).unlink(missing_ok=True)
    return CommandResult(result, problems_of(result, early, folder))


def integrate(
    request: Request, motion: Motion, plan: Plan, folder: Path | None, progress: Progress | None
) -> tuple[Trajectory | SceneMotion, EndedEarly | None]:
    """Integrate a scene from where its folder has it; and why the trajectory is a part if it is."""
    from heavytop.report.files import TRAJECTORY, load_part
    from heavytop.run.exact import SceneMotion
    from heavytop.run.propagation import completed, integrate_plan

    scene = request.scene
    if plan.formulation == "none":
        return SceneMotion(scene, motion, plan), None
    part = None if folder is None else load_part(folder, scene)
    if part is not None and part.outcome is Outcome.SINGULAR:
        return part, EndedEarly(part.outcome, part)
    checkpoint = None if folder is None else folder / TRAJECTORY
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", errors.MissedDigitsWarning)  # said at the end
            if part is not None:
                return completed(part, progress=progress, checkpoint=checkpoint), None
            return integrate_plan(scene, motion, plan, progress, checkpoint=checkpoint), None
    except EndedEarly as early:
        return early.trajectory, early


def problems_of(
    result: RunResult, early: EndedEarly | None, folder: Path | None
) -> Iterator[tuple[Exit, str]]:
    """What is wrong with a run, and where the part that was done can be found."""
    from heavytop.run.counts import differences
    from heavytop.run.verify import missed

    if early is not None:
        where = "above (-o DIR keeps it)" if folder is None else f"in {folder}"
        at = f"at t = {early.trajectory.orbit.end:.6g} s"
        yield early.exit, f"ended early {at}: {early}; the partial result is {where}"
        return
    if result.missed_digits:
        digits = result.scene["want"]["digits"]
        yield Exit.OUT_OF_BOUND, missed(dict(result.missed_digits), digits)
    if result.missed_events:  # of which a warning tells, unless it is quiet
        why = "; ".join(differences(result.missed_events, result.events))
        yield Exit.OUT_OF_BOUND, why if option("quiet") else ""
