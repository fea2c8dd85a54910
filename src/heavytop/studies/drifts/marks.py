"""Marks: the times, spread evenly over the decades, at which a long run is looked at."""

from __future__ import annotations

import numpy as np

PHASE = 0.6180339887498949  # of a period: no turning point, where an error in time does not show


def marks(periods: float, samples: int) -> tuple[float, ...]:
    """Return numbers of nutation periods, increasing, the last within one of `periods`.

    All are at the same phase of the nutation, away from its turning points.

    Parameters
    ----------
    periods : float
        At least 1.
    samples : int
        How many; where they would fall into the same period, fewer.

    Examples
    --------
    >>> [round(n, 3) for n in marks(1000, 4)]
    [0.618, 9.618, 99.618, 999.618]
    """
    whole = np.unique(np.rint(np.geomspace(1, max(1, int(periods)), max(1, samples))))
    return tuple(float(n - 1 + PHASE) for n in whole)
