"""How far a run is off the closed form of its own binary numbers, sample by sample."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heavytop.analytic.many_times import DoubleRecord
from heavytop.integration.outputs import Sample
from heavytop.run.trajectory import Trajectory
from heavytop.run.witness import closed_form

Array = NDArray[np.float64]

MOST = 1000


@dataclass(frozen=True, slots=True)
class Deviations:
    """Differences between a run and the closed form.

    Attributes
    ----------
    t : ndarray, shape (k,)
        Sample times [s].
    of : dict from str to ndarray, shape (k,)
        |run − closed form| of ``theta``, ``phi``, ``psi`` [rad] and ``axis`` (a length), of those
        that the run follows. Zeros are exact.
    """

    t: Array
    of: dict[str, Array]


def deviations(trajectory: Trajectory, most: int = MOST) -> Deviations:
    """Return the errors of a trajectory at its samples, or at some of them.

    Parameters
    ----------
    trajectory : Trajectory
    most : int
        How many samples are looked at; they are evenly spaced.

    Raises
    ------
    NoClosedForm
        There is nothing to hold the run against.
    """
    every = -(-trajectory.t.size // most)
    run = trajectory.samples.at(slice(None, None, every))
    exact = closed_form(trajectory)(run.t)
    return Deviations(run.t, dict(_followed(run, exact)))


def _followed(run: Sample, exact: DoubleRecord) -> Iterator[tuple[str, Array]]:
    for name in ("theta", "phi", "psi"):
        difference = np.abs(getattr(run, name) - getattr(exact, name))
        if not np.isnan(difference).all():
            yield name, difference
    distance = np.linalg.norm(run.axis - exact.axis, axis=1)
    if not np.isnan(distance).all():
        yield "axis", distance
