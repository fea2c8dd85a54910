"""Pixels at θ = π: the double nearest π is not π, but that is what it means.

Seen from below, θ → π − θ, ψ → −ψ and g → −g, such a start is at θ = 0, where doubles are exact.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from heavytop.classification.arrays import NAMES, TAG_NAMES
from heavytop.classification.kinds import Kind
from heavytop.studies.atlases.columns import Columns

Mask = NDArray[np.bool_]

TURNED: Final = ("gMR", "thetadot", "psidot", "omega3")
"""What changes its sign when a motion is seen from below."""


def at_bottom(tops: Mapping[str, Any]) -> Mask:
    """Where θ is the double nearest π, in the shape that the tops have together."""
    shape = np.broadcast_shapes(*(np.shape(each) for each in tops.values()))
    return np.broadcast_to(np.equal(tops["theta"], np.pi), shape)


def mirrored(tops: Mapping[str, Any], where: Mask) -> dict[str, Any]:
    """The tops, those at the bottom as they are seen from below."""
    turned = {
        name: np.where(where, -np.asarray(tops[name]), tops[name])
        for name in TURNED
        if name in tops
    }
    return {**tops, **turned, "theta": np.where(where, 0.0, tops["theta"])}


def restored(columns: Columns, where: Mask, weighted: Mask) -> Columns:
    """The columns of mirrored tops, as they are seen from above.

    Parameters
    ----------
    columns : dict from str to ndarray
    where : ndarray of bool
        Which were mirrored.
    weighted : ndarray of bool
        Whose gMR is not 0.
    """
    found, kind = dict(columns), columns["kind"]
    top, bottom = (np.uint8(NAMES.index(k)) for k in (Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM))
    found["kind"] = np.where(where & (kind == top), bottom, kind)
    found["kind"] = np.where(where & (kind == bottom), top, found["kind"])
    inverted = np.uint8(1 << TAG_NAMES.index("inverted-gravity"))
    if "tags" in found:
        found["tags"] = np.where(where & weighted, found["tags"] ^ inverted, found["tags"])
    if "theta_min" in found:
        low, high = found["theta_min"], found["theta_max"]
        found["theta_min"] = np.where(where, np.pi - high, low)
        found["theta_max"] = np.where(where, np.pi - low, high)
        found["spin"] = np.where(where, -found["spin"], found["spin"])
    return found
