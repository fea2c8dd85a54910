"""The files of a run: document, trajectory and figures, in one folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from heavytop.document import run_document
from heavytop.files import write_document
from heavytop.trajectory import Trajectory


def write_results(trajectory: Trajectory, folder: Path, *, figures: bool = True) -> dict[str, Any]:
    """Write a run; the document comes last, so that where it stands the rest is whole.

    Parameters
    ----------
    trajectory : Trajectory
    folder : Path
        It exists; files of an earlier run in it are replaced.
    figures : bool
        Whether figures are drawn.

    Returns
    -------
    dict
        The document, schema ``heavytop/run/1``; its ``files`` are the names of what was written.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    files = {"document": "run.json", "trajectory": "trajectory.nc"}
    (folder / files["document"]).unlink(missing_ok=True)  # of an earlier run in this folder
    trajectory.save(folder / files["trajectory"])
    if figures:
        files |= _write_figures(trajectory, folder)
    document = run_document(trajectory, files=files)
    write_document(folder / files["document"], document)
    return document


def _write_figures(trajectory: Trajectory, folder: Path) -> dict[str, str]:
    """Write every figure of a run; return their names by what they are."""
    from heavytop.report.figures import FIGURES, save

    files = {}
    for name, draw in FIGURES.items():
        figure = draw(trajectory)
        for form in ("svg", "png"):
            files[f"{name}_{form}"] = f"{name}.{form}"
            save(figure, folder / f"{name}.{form}")
    return files
