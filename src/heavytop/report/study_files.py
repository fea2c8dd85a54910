"""The files of studies: what each found, as a document and charts, in its folder."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from heavytop.errors import Stop, StoppedEarly
from heavytop.files import write_document
from heavytop.hdf5 import write_sealed
from heavytop.results.base import with_command

if TYPE_CHECKING:
    from heavytop.checking.result import Check
    from heavytop.results.drift import Drift
    from heavytop.results.energy_momentum import Diagram
    from heavytop.results.stress import Stress
    from heavytop.results.validation import Validation
    from heavytop.results.work_precision import WorkPrecision
    from heavytop.studies.atlas import Atlas

Folder: TypeAlias = str | os.PathLike[str]
Written: TypeAlias = dict[str, str]
"""Names of files, by what they are."""

FORMS: Final = ("svg", "png")
DRAWN_IN: Final = {
    "drift": "studies", "workprec": "studies", "stress": "studies", "atlas": "atlas",
    "energy_momentum": "theory", "critical_set": "theory", "check": "check",
}  # fmt: skip
"""The module of `heavytop.plots` that draws a chart."""


class Unwritten(StoppedEarly):
    """A study that reached its end, and whose files cannot be written: what it found is at hand."""

    def __str__(self) -> str:
        return self.why


def write_drift(drift: Drift, folder: Folder, *, figures: bool = True) -> Written:
    """Write ``drift.json``, its errors and its chart; they hold no wall-clock values.

    Parameters
    ----------
    drift : Drift
    folder : path
        That of the study; it exists.
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
    with _writing(folder, kept=True) as place:
        data = bytes(drift.to_xarray().to_netcdf(engine="h5netcdf"))  # whole before it is on disk
        write_sealed(place / "drift.nc", lambda part: part.write_bytes(data))
        document = drift.document(costs=False)
        return _written(place, "drift", document, {"drift": document} if figures else {},
                        errors="drift.nc")  # fmt: skip


def write_stress(stress: Stress, folder: Folder, *, figures: bool = True) -> Written:
    """Write ``stress.json`` and its chart.

    Parameters
    ----------
    stress : Stress
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
    Unwritten
        A file cannot be written. The document is written first, and again once the chart is there.
    """
    with _writing(folder) as place:
        document = stress.document()
        return _written(place, "stress", document, {"stress": document} if figures else {})


def write_work_precision(found: WorkPrecision, folder: Folder, *, figures: bool = True) -> Written:
    """Write ``workprec.json`` and its chart; times are what it is about, so it holds them.

    Parameters
    ----------
    found : WorkPrecision
    folder : path
        It is made where there is none.
    figures : bool
        Whether the chart is drawn; there is none without points.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    Unwritten
        A file cannot be written. The document is written first, and again once the chart is there.
    """
    with _writing(folder) as place:
        document = found.document()
        charts = {"workprec": document} if figures and found.points else {}
        return _written(place, "workprec", document, charts)


def write_atlas(found: Atlas, folder: Folder, *, figures: bool = True) -> Written:
    """Write ``atlas.json``, and of a whole atlas the map ``atlas.nc`` and its picture.

    Parameters
    ----------
    found : Atlas
    folder : path
        That of the study; it exists.
    figures : bool
        Whether the picture is drawn.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    StoppedEarly
        A file cannot be written.
    """
    with _writing(folder, kept=True) as place:
        others = {}
        if found.whole:
            others["map"] = "atlas.nc"
            found.save_map(place / others["map"])
        charts = {"atlas": found} if found.whole and figures else {}
        return _written(place, "atlas", found.document(costs=False), charts, **others)


def write_energy_momentum(found: Diagram, folder: Folder, *, figures: bool = True) -> Written:
    """Write ``energy_momentum.json`` and the pictures: the diagram, and the critical set.

    Parameters
    ----------
    found : Diagram
    folder : path
        It exists.
    figures : bool
        Whether the pictures are drawn; without gravity there is no critical set to draw.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    StoppedEarly
        A file cannot be written.
    """
    with _writing(folder) as place:
        document = found.document()
        charts = {"energy_momentum": document} if figures else {}
        if figures and document["critical_set"] is not None:
            charts["critical_set"] = document
        return _written(place, "energy_momentum", document, charts)


def write_check(found: Check, folder: Folder, *, figures: bool = True) -> Written:
    """Write ``check.json`` and its chart.

    Parameters
    ----------
    found : Check
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
    Unwritten
        A file cannot be written. The document is written first, and again once the chart is there.
    """
    with _writing(folder) as place:
        document = found.document()
        return _written(place, "check", document, {"check": document} if figures else {})


def write_validation(found: Validation, folder: Folder) -> Written:
    """Write ``validate.json``.

    Parameters
    ----------
    found : Validation
    folder : path
        It is made where there is none.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    Unwritten
        The file cannot be written.
    """
    with _writing(folder) as place:
        return _written(place, "validate", found.document(), {})


@contextmanager
def _writing(folder: Folder, *, kept: bool = False) -> Iterator[Path]:
    """The folder of a study; where a file of it cannot be written, the study has ended early.

    `kept` says that the study can be taken up again from there.
    """
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
        yield place
    except OSError as fault:
        path = Path(os.fsdecode(fault.filename or place))
        path = path.with_name(path.name.removeprefix(f".{os.getpid()}."))  # as it is named at last
        why = f"cannot write {path}: {fault.strerror or fault}"
        kind = StoppedEarly if kept else Unwritten
        raise kind(Stop.UNWRITABLE, why, place if kept else None) from fault


def _written(
    place: Path, name: str, document: Mapping[str, Any], charts: Mapping[str, Any], **others: str
) -> Written:
    """Write the document, then its charts, then the document that names these too.

    What was computed is on the disk before anything is drawn; charts of another study of the same
    name go as soon as its document is replaced. `charts` has what each of them draws.
    """
    files = {"document": f"{name}.json", **others}
    plain = with_command({**document, "files": files})
    write_document(place / files["document"], plain)
    for chart in {name: None, **charts}:
        for form in FORMS:
            (place / f"{chart}.{form}").unlink(missing_ok=True)
    if charts:
        from heavytop.plots.style import save

        for chart, of in charts.items():
            figure = charted(chart, of)
            for form in FORMS:
                files[f"{'chart' if chart == name else chart}_{form}"] = f"{chart}.{form}"
                save(figure, place / f"{chart}.{form}")
        write_document(place / files["document"], plain | {"files": files})
    return files


def charted(name: str, of: Any) -> Any:
    """The chart of a document, or of an atlas."""
    return getattr(import_module(f"heavytop.plots.{DRAWN_IN[name]}"), f"{name}_figure")(of)
