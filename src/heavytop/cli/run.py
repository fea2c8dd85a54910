"""``heavytop run``, and going on with a run that was interrupted or killed."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from click import BadParameter

from heavytop import errors
from heavytop.cli.command import Ended, exit_code, note, option, results_folder
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
) -> Ended:
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

    if digits is not None:
        scene = replace(scene, digits=digits)
    request = Request(scene, formulation, figures, tolerance)
    return run_request(request, folder, progress, force=force)


def resume(
    folder: Path,
    *,
    methods: Sequence[str] | None = None,
    figures: bool = True,
    progress: Any = None,
    **workers: Any,
) -> Ended:
    """Continue a study or a run that was interrupted or killed.

    Parameters
    ----------
    folder : path
        The folder of a study, such as drift or validate, or of a run.
    methods : sequence of str
        Your own methods that the study uses, named again: mine.py:rk4.
    """
    from heavytop.results.base import command_of, typed, typing

    files = [folder / name for name in ("study.jsonl", "request.json", "run.json")]
    made = next(filter(None, map(command_of, files)), typed())
    figures = figures and "--no-figures" not in (made or "").split()  # as it was begun
    with typing(made):  # the result is that of the command that began it
        if files[0].exists():
            return resume_study(folder, figures, progress, methods=methods or (), **workers)
        if not any(file.exists() for file in (*files, folder / "trajectory.nc")):
            rule = "neither study.jsonl, of a study, nor trajectory.nc or request.json, of a run"
            raise errors.ForeignFile(f"{folder}: no folder with anything to go on with: {rule}")
        if methods is not None or "executor" in workers:
            hint = "--scheduler" if methods is None else "--methods"
            raise BadParameter("is only for studies, and this folder holds a run", param_hint=hint)
        with results_folder(folder):
            return resume_run(folder, progress, figures=figures)


def resume_study(folder: Path, figures: bool, progress: Any, **options: Any) -> Ended:
    """Go on with a study; of one that has ended, say so."""
    from heavytop.studies.study import resume

    began = []

    def update(now: Any) -> None:
        began.append(now.ended == now.tasks > 0)
        if progress is not None:
            progress(now)

    found = resume(folder, progress=update, **options)
    notes = [(Exit.OK, f"{folder}: this study is finished")] if began[0] else []
    return Ended(found, notes, folder, figures)


def resume_run(folder: Path, progress: Progress | None, *, figures: bool) -> Ended:
    """Go on with a run; of one that has ended, say so."""
    from heavytop.report.files import DOCUMENT, REQUEST, TRAJECTORY, Request
    from heavytop.results.run import RunResult
    from heavytop.run.trajectory_file import load_exact, load_interrupted

    if not (folder / REQUEST).exists() and (folder / DOCUMENT).exists():
        found = RunResult.load(folder / DOCUMENT)
        if (outcome := Outcome(found.outcome)) is not Outcome.INTERRUPTED:
            if (folder / TRAJECTORY).exists():  # what is damaged is refused
                (load_interrupted if found.plan.states else load_exact)(folder / TRAJECTORY)
            if outcome is Outcome.FINISHED:
                return Ended(found, [(Exit.OK, f"{folder}: this run is finished")])
            why = f"{folder}: this run ended early: {outcome.sentence}"
            return Ended(found, [(Exit.ENDED_EARLY, why)])
    request = Request.read(folder)
    request.write(folder)
    return run_request(replace(request, figures=request.figures and figures), folder, progress)


def run_request(
    request: Request, folder: Path | None, progress: Progress | None, *, force: bool = False
) -> Ended:
    """Do what is asked, or what is left of it; what cannot be run touches no folder."""
    from heavytop.report.files import REQUEST, open_run, write_results
    from heavytop.results.run import run_result
    from heavytop.run.planning import planned
    from heavytop.run.span import closed_form_of

    motion = closed_form_of(request.scene)
    plan = planned(request.scene, motion, request.formulation, tolerance=request.tolerance)
    if folder is None:
        done, early = integrate(request, motion, plan, None, progress)
        result = run_result(done)
        return Ended(result, [*problems_of(result, early, None)])
    with open_run(folder, request, force=force):
        done, early = integrate(request, motion, plan, folder, progress)
        resumable = early is not None and early.outcome is Outcome.INTERRUPTED
        try:
            result = write_results(done, folder, figures=request.figures and not resumable)
        except OSError as fault:
            unwritten = errors.StoppedEarly.unwritable(fault, folder, folder)
            return Ended(run_result(done), [(Exit.ENDED_EARLY, str(unwritten))])
        for name in result.files.values():
            note(f"wrote {folder / name}")
        if not resumable:
            (folder / REQUEST).unlink(missing_ok=True)
    return Ended(result, [*problems_of(result, early, folder)])


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
        why = f"ended early {at}: {early}; the partial result is {where}"
        if folder is not None and early.outcome is Outcome.INTERRUPTED:
            why += f"; resume with:\n{errors.resuming(folder)}"
        yield exit_code(early), why
        return
    if result.missed_digits:
        digits = result.scene["want"]["digits"]
        yield Exit.OUT_OF_BOUND, missed(dict(result.missed_digits), digits)
    if result.missed_events:  # of which a warning tells, unless it is quiet
        why = "; ".join(differences(result.missed_events, result.events))
        yield Exit.OUT_OF_BOUND, why if option("quiet") else ""
