"""Growth: the exponent with which an error grows, by least squares in logarithms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LAST_DECADES = 3  # of the times that are fitted: before them an error is still that of the start
LEAST_POINTS = 4


@dataclass(frozen=True, slots=True)
class Growth:
    """An error that grows as a power of the time.

    Attributes
    ----------
    exponent : float
        1/2 for a random walk, 1 for a steady drift, 3/2 for the integral of a random walk.
    stderr : float
        Standard error of the exponent, from how far the points lie off the line. Errors at
        neighbouring times are not independent, so it is rather too small.
    points : int
        How many times were fitted.
    """

    exponent: float
    stderr: float
    points: int


def growth(periods: Sequence[float], errors: Sequence[float | None]) -> Growth | None:
    """Return the growth over the last three decades, or None where there is nothing to fit.

    Parameters
    ----------
    periods : sequence of float, shape (k,)
    errors : sequence of (float or None), shape (k,)
        RMS errors; zeros and None are left out, and the last of the others ends the decades.

    Examples
    --------
    >>> n = [10.0, 100.0, 1000.0, 10000.0]
    >>> found = growth(n, [1e-15 * x**1.5 for x in n])
    >>> round(found.exponent, 6), found.points
    (1.5, 4)
    >>> growth(n, [0.0, None, 1e-15, 2.0]) is None
    True
    """
    known = [(n, e) for n, e in zip(periods, errors, strict=True) if e]
    from_here = max((n for n, _ in known), default=0.0) / 10**LAST_DECADES * 0.999
    fitted = [(np.log(n), np.log(e)) for n, e in known if n >= from_here]
    if len(fitted) < LEAST_POINTS:
        return None
    x, y = np.array(fitted).T
    spread = x - x.mean()
    slope = float(spread @ y / (spread @ spread))
    residual = y - y.mean() - slope * spread
    variance = float(residual @ residual) / (len(fitted) - 2) / float(spread @ spread)
    return Growth(slope, float(np.sqrt(variance)), len(fitted))
