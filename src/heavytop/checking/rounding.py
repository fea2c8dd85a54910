"""With how many digits the numbers of a table are written, as the numbers themselves tell."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from heavytop.exact.pairs import UNIT, Array

MOST_WRITTEN: Final = 12  # digits; of more, rounding is not looked for
FINE: Final = 2000.0  # grains between times that nobody chose with so many digits


def grain_of(x: Array) -> Array:
    """Half a unit in the last digit that numbers are written with; 0 where all digits are."""
    x = np.where(np.isfinite(x), x, 0.0)
    digits, size, grain = np.arange(MOST_WRITTEN), abs(x), np.zeros_like(x)
    decades = np.floor(np.log10(np.where(size > 0, size, 1.0)))
    with np.errstate(over="ignore", invalid="ignore"):  # what is so large or small fits nothing
        for short in (size.astype(np.float16), size.astype(np.float32)):
            if (short == size).all() and not grain.any():
                grain = np.spacing(short).astype(np.float64) / 2
        for units in (-digits, np.add.outer(-digits, decades)):  # as %.3f and as %.3e write
            fitting = (10.0**unit for unit in units if _fits(x, size, unit))
            grain = np.maximum(grain, next(fitting, 0.0) / 2)
    return np.asarray(grain * (np.ptp(x, axis=0) > 0))  # what never changes is no measurement


def _fits(x: Array, size: Array, unit: Any) -> bool:
    """Whether numbers are whole multiples of powers of ten."""
    off = abs(np.rint(x * 10.0**-unit) * 10.0**unit - x)
    return bool((off <= 8 * UNIT * size).all())


def is_rounded(t: Array, grain: Array) -> bool:
    """Whether times are rounded, and not chosen.

    Steps are then no multiples of the least of them, as where rows of an even grid are missing. And
    the times part their span evenly but for rounding, or have more digits than anybody chooses.
    """
    steps, least = abs(np.diff(t)), 16 * UNIT * abs(t).max()
    unit = min(steps[steps > least], default=np.nan)
    if not (abs(steps - np.rint(steps / unit) * unit) > least).any():
        return False
    fine = grain.max() < 0.5 and np.median(steps) > FINE * grain.max()
    even = np.linspace(t[0], t[-1], t.size)
    return bool(fine or (abs(t - even) <= 2 * grain + least).all())
