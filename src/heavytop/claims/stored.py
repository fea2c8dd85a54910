"""The file of a validation."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from heavytop.claims.validation import Validation
from heavytop.errors import StoppedEarly
from heavytop.files import make_folder, write_document

FILE: Final = "validate.json"


def write_validation(found: Validation, folder: Path) -> dict[str, str]:
    """Write ``validate.json``.

    Parameters
    ----------
    found : Validation
    folder : Path
        It is made where there is none.

    Returns
    -------
    dict from str to str
        Names of the files, by what they are.

    Raises
    ------
    StoppedEarly
        The file cannot be written.
    """
    files = {"document": FILE}
    try:
        make_folder(folder)
        write_document(folder / FILE, found.document(files))
    except OSError as fault:
        raise StoppedEarly.unwritable(fault, folder / FILE, None) from fault
    return files
