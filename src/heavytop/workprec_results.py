"""The files of a work–precision diagram: its document and its chart."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from heavytop.files import write_document
from heavytop.workprecs.work_precision import WorkPrecision


def write_work_precision(
    found: WorkPrecision, folder: str | os.PathLike[str], *, figures: bool = True
) -> dict[str, str]:
    """Write ``workprec.json`` and the chart; times are what it is about, so it holds them.

    Parameters
    ----------
    found : WorkPrecision
    folder : path
        It is made where there is none.
    figures : bool
        Whether the chart is drawn.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    OSError
        A file cannot be written.
    """
    place = Path(folder)
    place.mkdir(parents=True, exist_ok=True)
    files = {"document": "workprec.json"}
    if figures and found.points:
        files |= _figures(found.document(), place)
    write_document(place / files["document"], found.document(files=files))
    return files


def _figures(document: dict[str, Any], place: Path) -> dict[str, str]:
    from heavytop.report.figures import save
    from heavytop.report.workprec_figure import workprec_figure

    figure = workprec_figure(document)
    files = {f"chart_{form}": f"workprec.{form}" for form in ("svg", "png")}
    for name in files.values():
        save(figure, place / name)
    return files
