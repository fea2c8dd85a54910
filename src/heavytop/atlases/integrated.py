"""Kinds of motion told by integration: by what happens at the turning points of one nutation.

The integrator knows nothing of the criteria by which a kind is proved, and these know nothing of
it: two maps of one plane are two witnesses.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.ensemble import Ensemble, propagate_many
from heavytop.kinds.codes import IMPOSSIBLE, NAMES, Codes
from heavytop.kinds.kind import Kind

Array = NDArray[np.float64]

SPAN: Final = 1.05  # nutation periods: from a turning point both others are met
STEPS: Final = 10_000
POLE: Final = 1e-12  # rad: nearer the axis cannot be told from the vertical
REST: Final = 1e-12  # of the largest rate at a turning point: less is none
LEVEL: Final = 1e-10  # rad: a nutation smaller than that is rounding


def integrated(tops: Mapping[str, Any], period: Array) -> Codes:
    """Codes of kinds, told by the events of a run over one nutation.

    Parameters
    ----------
    tops : mapping of str to array_like
        As for `heavytop.classify_many`.
    period : ndarray
        How long one nutation takes [s], of the shape that `tops` has together; nan where nothing
        nutates: there a second takes its place.

    Returns
    -------
    ndarray of uint8
        Codes of `heavytop.kinds.many.Verdicts.names`; undecided where a run broke off.
    """
    shape = np.shape(period)
    numbers: dict[str, Any] = {
        name: np.broadcast_to(each, shape).ravel() for name, each in tops.items()
    }
    time = SPAN * np.where(np.isfinite(period), period, 1.0).ravel()
    run = propagate_many(**numbers, time=time, events=("turning",), step_limit=STEPS, jobs=1)
    return _told(run, numbers).reshape(shape)


def _told(run: Ensemble, start: Mapping[str, Array]) -> Codes:
    """Codes of kinds of a row of runs; later words go over earlier ones."""
    low, high = _turnings(run, start)
    rates = np.sort(abs(np.stack((low.phidot, high.phidot))), axis=0)
    level = (low.met == 0) | (high.theta - low.theta <= LEVEL)
    found = np.full(run.end.size, NAMES.index(Kind.WAVES), np.uint8)
    p_psi, across, size = _momenta(start)
    still = abs(start["thetadot"]) * start["A"] <= REST * size
    flat = (abs(p_psi) <= REST * size) & (abs(across) <= REST * size)
    pole = np.sin(start["theta"]) <= POLE
    upwards = (np.cos(start["theta"]) > 0) == (start["gMR"] > 0)
    for kind, where in (
        (Kind.LOOPS, low.phidot * high.phidot < 0),
        (Kind.CUSPS, rates[0] <= REST * rates[1]),
        (Kind.SEPARATRIX, low.met + high.met == 1),
        (Kind.UNIFORM_PRECESSION, level & still),
        (Kind.SEPARATRIX, level & ~still),
        (Kind.THROUGH_BOTTOM, np.pi - high.theta <= POLE),
        (Kind.THROUGH_TOP, low.theta <= POLE),
        (Kind.PLANAR_PENDULUM, flat),
        (Kind.HANGING, pole & still & ~upwards),
        (Kind.SLEEPING, pole & still & upwards),
        (Kind.FORCE_FREE, start["gMR"] == 0),
        (Kind.AT_REST, flat & still & (pole | (start["gMR"] == 0))),
        (Kind.UNDECIDED, run.ending != 0),
    ):
        found[where] = NAMES.index(kind)
    found[~_possible(start)] = IMPOSSIBLE
    return found


class _Turning(NamedTuple):
    """The turning point of each top that is highest, or lowest: nan and 0 where it met none."""

    theta: Array
    phidot: Array
    met: NDArray[np.int64]


def _turnings(run: Ensemble, start: Mapping[str, Array]) -> tuple[_Turning, _Turning]:
    """The smallest and the largest θ at which each top turned; a start at rest in θ counts."""
    met, size = run.met, run.end.size
    here = np.flatnonzero(start["thetadot"] == 0)
    which = np.concatenate((run.zeros.which, here))
    theta = np.concatenate((met.theta, start["theta"][here]))
    phidot = np.concatenate((met.phidot, start["phidot"][here]))
    order = np.lexsort((theta, which))
    tops, first, count = np.unique(which[order], return_index=True, return_counts=True)
    found = []
    for at in (order[first], order[first + count - 1]):
        rows = [np.full(size, np.nan), np.full(size, np.nan), np.zeros(size, np.int64)]
        rows[0][tops], rows[1][tops], rows[2][tops] = theta[at], phidot[at], count
        found.append(_Turning(*rows))
    return found[0], found[1]


def _momenta(start: Mapping[str, Array]) -> tuple[Array, Array, Array]:
    """p_ψ, A φ̇ sin²θ, and how large momenta are here at all."""
    A, C, theta, phidot = (start[name] for name in ("A", "C", "theta", "phidot"))
    with np.errstate(all="ignore"):
        spin = start.get("omega3")
        omega3 = start["psidot"] + phidot * np.cos(theta) if spin is None else spin
        p_psi, sine = C * omega3, np.sin(theta)
        moving = A * (abs(start["thetadot"]) + abs(phidot * sine))
        size = abs(p_psi) + moving + np.sqrt(A * abs(start["gMR"]))
        return p_psi, A * phidot * sine**2, size


def _possible(start: Mapping[str, Array]) -> NDArray[np.bool_]:
    """Where a top and a start have such numbers."""
    A, C, theta = start["A"], start["C"], start["theta"]
    finite = np.isfinite(np.stack(list(start.values()))).all(axis=0)
    return finite & (A > 0) & (C > 0) & (2 * A >= C) & (theta >= 0) & (theta <= np.pi)
