"""What a map says of itself: the attributes of columns and axes, by the CF conventions."""

from __future__ import annotations

from typing import Any

import numpy as np

from heavytop.classification.many import Verdicts
from heavytop.studies.atlas_plane import ROLES, Axis, Plane
from heavytop.studies.atlases.columns import SETS


def attributes(name: str, what: str) -> dict[str, Any]:
    """The attributes of a column: unit, sentence, and the CF flags of codes."""
    column = SETS[what][name]
    found: dict[str, Any] = {"long_name": column.text, "units": column.unit or "1"}
    if name in ("kind", "integrated"):
        return found | _values(Verdicts.names)
    if name == "detail":
        return found | _values(("none", *Verdicts.details[1:]))
    if name in ("tags", "open_tags"):
        masks = np.array([1 << k for k in range(len(Verdicts.tag_names))], np.uint8)
        return found | {"flag_masks": masks, "flag_meanings": _words(Verdicts.tag_names)}
    return found


def coordinates(plane: Plane) -> dict[str, Any]:
    """The axes, as coordinates."""
    return {
        axis.name: (axis.name, values, _unit(axis))
        for axis, values in ((plane.x, plane.x.values), (plane.y, plane.y.values))
    }


def _unit(axis: Axis) -> dict[str, Any]:
    units = {
        "rad/s": "rad s-1",
        "kg m² s⁻¹": "kg m2 s-1",
        "kg m²": "kg m2",
        "kg m² s⁻²": "kg m2 s-2",
    }
    unit = ROLES[axis.name].unit
    return {"long_name": axis.name, "units": units.get(unit, unit) or "1"}


def _values(names: tuple[str, ...]) -> dict[str, Any]:
    return {
        "flag_values": np.arange(len(names), dtype=np.uint8),
        "flag_meanings": _words(names),
    }


def _words(names: tuple[str, ...]) -> str:
    return " ".join(names)
