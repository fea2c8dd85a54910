"""A study of an atlas: the plane and what is asked of it, as values that can be written down."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from heavytop.errors import BadScene, Fault, ForeignFile, HeavyTopError
from heavytop.machine import versions
from heavytop.scene import arguments
from heavytop.scene.arguments import shown
from heavytop.scene.scene import Scene
from heavytop.studies import recorded
from heavytop.studies.atlas_plane import ROLES, Axis, Plane, Tile
from heavytop.studies.atlases.columns import SETS, size

KIND: Final = "atlas"
FORMAT: Final = 1
MOST: Final = 10**10  # pixels
LARGEST: Final = 2**24  # pixels of a tile
TILE: Final = {"kind": 2**20, "rows": 2**16, "integrate": 2**14}
"""Pixels of a tile: a second of work or less, and what a worker has in memory."""


@dataclass(frozen=True)
class Study:
    """A plane, and what is asked of its pixels.

    Attributes
    ----------
    plane : Plane
    what : str
        A key of `columns.SETS`.
    tile: int
        Pixels of a tile, at most.
    """

    plane: Plane
    what: str
    tile: int

    @classmethod
    def asked(cls, scene: object, x: object, y: object, what: str, tile: int = 0) -> Study:
        """Return the study that is asked for.

        Raises
        ------
        BadScene
            No scene, no axis, two axes that set the same thing, too many pixels. Every fault is
            listed.
        """
        file = str(getattr(scene, "name", KIND))
        axes, faults = arguments.parse_options(file, {"x": x, "y": y}, {"x": Axis.of, "y": Axis.of})
        if not isinstance(scene, Scene):
            faults.append(
                Fault(file, None, "scene", shown(scene), "a Scene", "load_scene gives one")
            )
        if len(axes) == 2:
            faults.extend(_together(file, axes["x"], axes["y"]))
        if faults or not isinstance(scene, Scene):
            raise BadScene(tuple(faults))
        return cls(Plane(scene, axes["x"], axes["y"]), what, tile or TILE[what])

    @classmethod
    def of(cls, identity: Mapping[str, Any]) -> Study:
        """Return the study that an identity describes.

        Raises
        ------
        ForeignFile
            It describes none; the message names what is wrong.
        """
        found = recorded.table("identity", identity, ("scene", "x", "y", "what", "tile"))
        what = recorded.text("what", found["what"])
        if what not in SETS:
            raise recorded.refused("what", what, f"one of {', '.join(SETS)}")
        tile = recorded.whole("tile", found["tile"], 1, LARGEST)
        x, y = (recorded.text(name, found[name]) for name in ("x", "y"))
        try:
            return cls.asked(recorded.scene(found["scene"]), x, y, what, tile)
        except HeavyTopError as wrong:
            raise ForeignFile(str(wrong)) from None

    @property
    def identity(self) -> dict[str, Any]:
        """Everything that the results depend on, for JSON.

        The processor is not among it: shards come from several machines.
        """
        tables = self.plane.scene.document()
        return {
            "kind": KIND,
            "format": FORMAT,
            "scene": {key: tables[key] for key in ("name", "title", "source", "top", "start")},
            "x": self.plane.x.text,
            "y": self.plane.y.text,
            "what": self.what,
            "tile": self.tile,
            "versions": {key: value for key, value in versions().items() if key != "cpu"},
        }

    @cached_property
    def tiles(self) -> Mapping[str, Tile]:
        """The tiles by the names of their tasks."""
        return self.plane.tiles(self.tile)

    @property
    def bytes(self) -> int:
        """About how much room the atlas takes on a disk, tiles and map together."""
        return int(self.plane.x.count * self.plane.y.count * size(self.what) * (4 / 3 + 1))


def _together(file: str, x: Axis, y: Axis) -> Iterator[Fault]:
    """Yield what is wrong with two axes as a pair."""
    if ROLES[x.name].sets == ROLES[y.name].sets:
        rule = f"another number than x = {x.name}: both set the {ROLES[x.name].sets}"
        yield Fault(file, None, "y", y.name, rule)
    if x.count * y.count > MOST:
        rule = f"at most {MOST:.0e} pixels"
        yield Fault(file, None, "x, y", f"{x.count} × {y.count} pixels", rule)
