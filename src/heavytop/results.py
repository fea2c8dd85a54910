"""The files of a run: document, trajectory and figures, in one folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from heavytop.document import run_document
from heavytop.files import regular, write_document
from heavytop.trajectory import Trajectory

FORMS: Final = ("svg", "png")
OWN_FIGURES: Final = frozenset(
    f"{name}.{form}"
    for name in ("overview", "angles", "potential", "phase", "errors")
    for form in FORMS
)


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
    clear(folder)
    trajectory.save(folder / files["trajectory"])
    if figures:
        files |= _write_figures(trajectory, folder)
    document = run_document(trajectory, files=files)
    write_document(folder / files["document"], document)
    return document


def clear(folder: Path) -> None:
    """Remove the document of an earlier run in a folder, and the figures of which it tells.

    They would stand beside another top's document. Other files are left alone.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OSError
        A file cannot be removed.
    """
    document = folder / "run.json"
    for name in _figures_told(document):
        (folder / name).unlink(missing_ok=True)
    document.unlink(missing_ok=True)


def _figures_told(document: Path) -> frozenset[str]:
    try:
        with regular(document) as file:
            told = json.loads(file.read())["files"].values()
        return OWN_FIGURES & {name for name in told if isinstance(name, str)}
    except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return frozenset()  # there is no document, or it is no run's


def _write_figures(trajectory: Trajectory, folder: Path) -> dict[str, str]:
    """Write every figure of a run; return their names by what they are."""
    from heavytop.report.figures import FIGURES, save

    files = {}
    for name, draw in FIGURES.items():
        figure = draw(trajectory)
        for form in FORMS:
            files[f"{name}_{form}"] = f"{name}.{form}"
            save(figure, folder / f"{name}.{form}")
    return files
