"""The files of a drift study: document, errors and chart, beside the study in its folder."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from heavytop.drifts.drift import Drift
from heavytop.errors import Stop, StoppedEarly
from heavytop.files import write_document, write_whole


def write_drift(
    drift: Drift, folder: str | os.PathLike[str], *, figures: bool = True
) -> dict[str, str]:
    """Write a finished study's results; they hold no wall-clock values.

    Parameters
    ----------
    drift : Drift
    folder : path
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
    try:
        return _written(drift, place, figures=figures)
    except OSError as fault:
        why = f"cannot write {fault.filename or place}: {fault.strerror or fault}"
        raise StoppedEarly(Stop.UNWRITABLE, why, place) from fault


def _written(drift: Drift, place: Path, *, figures: bool) -> dict[str, str]:
    files = {"document": "drift.json", "errors": "drift.nc"}
    data = bytes(drift.to_xarray().to_netcdf(engine="h5netcdf"))  # whole before it is on the disk
    write_whole(place / files["errors"], lambda part: part.write_bytes(data))
    if figures:
        files |= _figures(drift.document(costs=False), place)
    write_document(place / files["document"], drift.document(costs=False, files=files))
    return files


def _figures(document: dict[str, Any], place: Path) -> dict[str, str]:
    from heavytop.report.drift_figure import drift_figure
    from heavytop.report.figures import save

    figure = drift_figure(document)
    files = {f"chart_{form}": f"drift.{form}" for form in ("svg", "png")}
    for name in files.values():
        save(figure, place / name)
    return files
