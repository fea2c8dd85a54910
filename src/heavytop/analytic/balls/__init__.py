"""Enclosures: roots, turning points, period, precession, spin and θ(t) with proved bounds.

Everything is computed in ball arithmetic (Arb, through python-flint) from the exact numbers of a
scene, or from the binary numbers of a run in the axis form. What comes out is an
`Interval` that contains the true value; no rounding error is estimated anywhere.
"""

from heavytop.analytic.balls.enclosure import Enclosure, enclose, enclose_axis
from heavytop.numbers.intervals import Interval

__all__ = ["Enclosure", "Interval", "enclose", "enclose_axis"]
