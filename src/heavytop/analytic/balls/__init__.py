"""Enclosures: roots, turning points, period, precession, spin and θ(t) with proved bounds.

Everything is computed in ball arithmetic (Arb, through python-flint) from the exact numbers of a
scene, or from the binary numbers of a run in the axis form. What comes out is a `Ball`, an interval
that contains the true value; no rounding error is estimated anywhere.
"""

from heavytop.analytic.balls.enclosure import Enclosure, enclose, enclose_axis
from heavytop.numbers.ball import Ball

__all__ = ["Ball", "Enclosure", "enclose", "enclose_axis"]
