"""Pictures of a trajectory: each is a function of the axes it draws on, and computes nothing.

The same trajectory gives the same SVG, byte for byte.
"""

from heavytop.plots.figures.angles import loop, nutation, precession, spin_rate
from heavytop.plots.figures.energy import effective_potential, phase_plane
from heavytop.plots.figures.errors import errors
from heavytop.plots.figures.pages import FIGURES, overview
from heavytop.plots.figures.sphere import View, axis_on_sphere
from heavytop.plots.figures.style import save

__all__ = [
    "FIGURES",
    "View",
    "axis_on_sphere",
    "effective_potential",
    "errors",
    "loop",
    "nutation",
    "overview",
    "phase_plane",
    "precession",
    "save",
    "spin_rate",
]
