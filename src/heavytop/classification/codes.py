"""The codes in which arrays hold kinds, their details and tags."""

from __future__ import annotations

from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from heavytop.classification.kind import Kind

Codes: TypeAlias = "NDArray[np.uint8]"

NAMES: Final = (*map(str, Kind), "impossible")
"""What the codes of kinds mean; the last is of no motion."""

IMPOSSIBLE: Final = NAMES.index("impossible")

DETAILS: Final = (
    "", "stable", "marginal", "unstable", "swinging", "rotating", "asymptotic",
    "slow", "fast", "single",
)  # fmt: skip
"""What the codes of details mean: what tells motions of one kind apart."""

TAGS: Final = (
    "spherical-pendulum", "spherical-top", "spin-reversal", "closed-orbit", "near-separatrix",
    "inverted-gravity", "start-at-rest",
)  # fmt: skip
"""The tags whose bits are 1, 2, 4, …"""


def bits(names: tuple[str, ...]) -> int:
    """The bits of those names that are tags.

    Examples
    --------
    >>> bits(("slow", "spherical-pendulum", "spin-reversal"))
    5
    """
    return sum(1 << TAGS.index(name) for name in names if name in TAGS)


def detail(names: tuple[str, ...]) -> int:
    """The code of the detail among names; 0 where there is none.

    Examples
    --------
    >>> DETAILS[detail(("slow", "spherical-pendulum"))]
    'slow'
    """
    return next((DETAILS.index(name) for name in names if name in DETAILS), 0)
