"""The files of studies: what each found, as a document and a chart, in its folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from heavytop.errors import Stop, StoppedEarly
from heavytop.files import write_document
from heavytop.hdf5 import write_sealed
from heavytop.results.base import with_command

if TYPE_CHECKING:
    from heavytop.claims.validate import Validation
    from heavytop.results.drift import Drift
    from heavytop.results.energy_momentum import Diagram
    from heavytop.results.stress import Stress
    from heavytop.results.work_precision import WorkPrecision
    from heavytop.studies.atlas import Atlas

Folder: TypeAlias = str | os.PathLike[str]
Written: TypeAlias = dict[str, str]
"""Names of files, by what they are."""

Document: TypeAlias = Callable[..., dict[str, Any]]

FORMS: Final = ("svg", "png")


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
    place, errors = Path(folder), "drift.nc"
    with _stopping(place, kept=place):
        data = bytes(drift.to_xarray().to_netcdf(engine="h5netcdf"))  # whole before it is on disk
        write_sealed(place / errors, lambda part: part.write_bytes(data))
        document = partial(drift.document, costs=False)
        return _written("drift", document, place, figures, {"errors": errors})


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
    return _afresh("stress", stress.document, folder, figures)


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
    return _afresh("workprec", found.document, folder, figures and bool(found.points))


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
    place, files = Path(folder), {"document": "atlas.json"}
    with _stopping(place, kept=place):
        if found.whole:
            files["map"] = "atlas.nc"
            found.save_map(place / files["map"])
        if found.whole and figures:
            from heavytop.plots.atlas import atlas_figure

            files |= _saved("atlas", atlas_figure(found), place)
        document = with_command(found.document(costs=False, files=files))
        write_document(place / files["document"], document)
    return files


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
    place, files, document = Path(folder), {"document": "energy_momentum.json"}, found.document()
    with _stopping(place, kept=None):
        if figures:
            files |= _saved("energy_momentum", charted("energy_momentum", document), place)
        if figures and document["critical_set"] is not None:
            drawn = _saved("critical_set", charted("critical_set", document), place)
            files |= {f"critical_set_{form}": drawn[f"chart_{form}"] for form in FORMS}
        write_document(place / files["document"], found.document(files=files))
    return files


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
    return _afresh("validate", found.document, folder, figures=False)


@contextmanager
def _stopping(place: Path, *, kept: Path | None) -> Iterator[None]:
    """Let files be written; where one cannot, a long study has ended early, and no option is bad.

    `kept` is the folder from which the study can be taken up again, where there is one.
    """
    try:
        yield
    except OSError as fault:
        why = f"cannot write {_meant(fault, place)}: {fault.strerror or fault}"
        kind = Unwritten if kept is None else StoppedEarly
        raise kind(Stop.UNWRITABLE, why, kept) from fault


def _meant(fault: OSError, place: Path) -> Path:
    """Return the file that could not be written, by the name that it would have had at last."""
    path = Path(os.fsdecode(fault.filename or place))
    return path.with_name(path.name.removeprefix(f".{os.getpid()}."))


def _afresh(name: str, document: Document, folder: Folder, figures: bool) -> Written:
    """Write a study that kept no folder of its own while it went."""
    place = Path(folder)
    with _stopping(place, kept=None):
        place.mkdir(parents=True, exist_ok=True)
        return _written(name, document, place, figures, {})


def _written(
    name: str, document: Document, place: Path, figures: bool, others: Mapping[str, str]
) -> Written:
    """Write the document, then the chart, then the document that names the chart too.

    What was computed is on the disk before anything is drawn; charts of another study of the same
    name go as soon as its document is replaced.
    """
    files = {"document": f"{name}.json", **others}
    plain = with_command(document(files=files))
    write_document(place / files["document"], plain)
    for form in FORMS:
        (place / f"{name}.{form}").unlink(missing_ok=True)
    if figures:
        files |= _saved(name, charted(name, plain), place)
        write_document(place / files["document"], plain | {"files": files})
    return files


def charted(name: str, document: Mapping[str, Any]) -> Any:
    """The figure of a document, as ``heavytop.plots.NAME`` draws it."""
    draw = getattr(import_module(f"heavytop.plots.{name}"), f"{name}_figure")
    return draw(document)


def _saved(name: str, figure: Any, place: Path) -> Written:
    """Save a figure in every form."""
    from heavytop.plots.figures import save

    files = {f"chart_{form}": f"{name}.{form}" for form in FORMS}
    for file in files.values():
        save(figure, place / file)
    return files
