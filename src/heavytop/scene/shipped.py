"""The scenes that come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from heavytop.errors import BadScene, Fault
from heavytop.scene import scene_file
from heavytop.text import nearest

FOLDER: Final = Path(__file__).parents[1] / "scenes"


def shipped_scenes() -> dict[str, str]:
    """The scenes that come with the package.

    Returns
    -------
    dict from str to str
        Their titles, by their names.

    Examples
    --------
    >>> shipped_scenes()["sicm-dropped"]
    'SICM 2.10, let go from rest: cusps'
    """
    texts = {name: shipped_text(name) for name in shipped_names()}
    return {name: scene_file.parse(text)["title"] for name, text in texts.items()}


def shipped_text(name: str) -> str:
    """The text of a scene that comes with the package, comments and all.

    Parameters
    ----------
    name : str
        A key of `shipped_scenes`.

    Returns
    -------
    str

    Raises
    ------
    BadScene
        No shipped scene has this name.

    Examples
    --------
    >>> print(shipped_text("sicm-dropped").splitlines()[0])
    format = 1
    """
    if name not in shipped_names():
        hint = nearest(name, shipped_names())
        raise BadScene((Fault(name, None, "scene", "", "no shipped scene has this name", hint),))
    return (FOLDER / f"{name}.toml").read_text("utf-8")


def shipped_names() -> list[str]:
    """Their names, in the order of the alphabet."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))
