"""The files of a stress test: its document and its chart."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from heavytop.errors import Stop, StoppedEarly
from heavytop.files import write_document
from heavytop.stresses.stress import Stress


def write_stress(
    stress: Stress, folder: str | os.PathLike[str], *, figures: bool = True
) -> dict[str, str]:
    """Write a stress test: ``stress.json``, and the chart ``stress.svg`` and ``stress.png``.

    Parameters
    ----------
    stress : Stress
    folder : path
        It exists.
    figures : bool
        Whether the chart is drawn.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    StoppedEarly
        A file cannot be written.
    """
    place = Path(folder)
    files = {"document": "stress.json"}
    try:
        if figures:
            files |= _figures(stress.document(), place)
        write_document(place / files["document"], stress.document(files=files))
    except OSError as fault:
        why = f"cannot write {fault.filename or place}: {fault.strerror or fault}"
        raise StoppedEarly(Stop.UNWRITABLE, why, None) from fault
    return files


def _figures(document: dict[str, Any], place: Path) -> dict[str, str]:
    from heavytop.report.figures import save
    from heavytop.report.stress_figure import stress_figure

    figure = stress_figure(document)
    files = {f"chart_{form}": f"stress.{form}" for form in ("svg", "png")}
    for name in files.values():
        save(figure, place / name)
    return files
