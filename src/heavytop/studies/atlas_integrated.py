"""Kinds of motion told by integration: by what happens at the turning points of one nutation.

The integrator knows nothing of the criteria by which a kind is proved, and these know nothing of
it: two maps of one plane are two independent results.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.classification.arrays import IMPOSSIBLE, NAMES, Codes
from heavytop.classification.kinds import Kind
from heavytop.run.ensemble import Ensemble, propagate_many
from heavytop.studies.atlas_plane import Array, Mask, Momenta

SPAN: Final = 1.55  # nutation periods: one turning point at least is met twice
PART: Final = 5  # steps are at most such a part of a period: none passes over a turning point
STEPS: Final = 10_000
POLE: Final = 1e-12  # rad: nearer the axis cannot be told from the vertical
REST: Final = 1e-12  # of φ̇, and of φ̇ sin²θ, at the other turning point: less is none
LEVEL: Final = 1e-12  # rad: a nutation smaller than that is rounding
DOUBT: Final = 20  # times what a run differs from itself, a period later, is no more than rounding


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
        Codes of `heavytop.classification.many.Verdicts.names`; undecided where a run broke off.
    """
    start: dict[str, Any] = {
        name: np.broadcast_to(each, period.shape).ravel() for name, each in tops.items()
    }
    once = np.where(np.isfinite(period), period, 1.0).ravel()
    run = propagate_many(
        **start, time=SPAN * once, longest=once / PART, events=("turning",), step_limit=STEPS,
        jobs=1,
    )  # fmt: skip
    return _kinds(run, start).reshape(period.shape)


def _kinds(run: Ensemble, start: Mapping[str, Array]) -> Codes:
    """Codes of kinds of a row of runs; later lines go over earlier ones."""
    low, high, met = _turning_points(run, start)
    off_theta = DOUBT * np.fmax(low.off_theta, high.off_theta)
    unsure = np.logical_or(*(abs(each.phidot) <= DOUBT * each.off_phidot for each in (low, high)))
    rest = _vanishes(low.phidot, high.phidot) & _vanishes(low.across, high.across)
    nod = np.where(met == 0, 0.0, high.theta - low.theta)
    with np.errstate(all="ignore"):
        momenta = Momenta.of(start)
        A, theta, thetadot, gMR = (start[name] for name in ("A", "theta", "thetadot", "gMR"))
        moving = A * (abs(thetadot) + abs(start["phidot"] * np.sin(theta)))
        rounding = REST * (abs(momenta.p_psi) + moving + np.sqrt(A * abs(gMR)))
    still = abs(thetadot) * A <= rounding
    pole = np.sin(theta) <= POLE
    flat = (abs(momenta.p_psi) <= rounding) & ((momenta.across == 0) | pole)
    upwards = (np.cos(theta) > 0) == (gMR > 0)
    found = np.full(met.size, NAMES.index(Kind.WAVES), np.uint8)
    for kind, where in (
        (Kind.LOOPS, low.phidot * high.phidot < 0),
        (Kind.UNDECIDED, unsure),
        (Kind.CUSPS, rest),
        (Kind.SEPARATRIX, met == 1),
        (Kind.UNDECIDED, nod <= off_theta),
        (Kind.UNIFORM_PRECESSION, (nod <= LEVEL) & still),
        (Kind.SEPARATRIX, (met == 0) & ~still),
        (Kind.UNDECIDED, (np.pi - high.theta <= off_theta) | (low.theta <= off_theta)),
        (Kind.THROUGH_BOTTOM, np.pi - high.theta <= POLE),
        (Kind.THROUGH_TOP, low.theta <= POLE),
        (Kind.PLANAR_PENDULUM, flat),
        (Kind.HANGING, pole & still & ~upwards),
        (Kind.SLEEPING, pole & still & upwards),
        (Kind.FORCE_FREE, gMR == 0),
        (Kind.AT_REST, flat & still & (pole | (gMR == 0))),
        (Kind.UNDECIDED, run.ending != 0),
    ):
        found[where] = NAMES.index(kind)
    found[~momenta.possible] = IMPOSSIBLE
    return found


def _vanishes(one: Array, other: Array) -> Mask:
    """Where the smaller of two numbers is nothing beside the larger."""
    small, large = np.sort(abs(np.stack((one, other))), axis=0)
    return np.asarray(small <= REST * large)


class _TurningPoint(NamedTuple):
    """The upper turning point of each top, or the lower one; nan and 0 where it met none.

    Attributes
    ----------
    theta, phidot : ndarray
        When it is first met.
    off_theta, off_phidot : ndarray
        By how much those a period later differ from it: the error of the run itself.
    """

    theta: Array
    phidot: Array
    off_theta: Array
    off_phidot: Array

    @property
    def across(self) -> Array:
        """φ̇ sin²θ."""
        return np.asarray(self.phidot * np.sin(self.theta) ** 2)


def _turning_points(
    run: Ensemble, start: Mapping[str, Array]
) -> tuple[_TurningPoint, _TurningPoint, NDArray[np.int64]]:
    """The turning points at the smallest θ and at the largest, and how many each top met.

    A start at rest in θ is one, unless nothing nutates.
    """
    size, here = run.end.size, np.flatnonzero(start["thetadot"] == 0)  # known without error
    which = np.concatenate((here, run.zeros.which))
    theta = np.concatenate((start["theta"][here], run.met.theta))
    phidot = np.concatenate((start["phidot"][here], run.met.phidot))
    low, high = np.full(size, np.inf), np.full(size, -np.inf)
    np.fmin.at(low, which, theta)
    np.fmax.at(high, which, theta)
    with np.errstate(invalid="ignore"):  # of tops that met none: inf less inf
        upper = theta <= ((low + high) / 2)[which]
    points = []
    for at in (upper, ~upper):
        tops, first = np.unique(which[at], return_index=True)
        values, errors = [], []
        for each in (theta[at], phidot[at]):
            value, error = np.full(size, np.nan), np.zeros(size)
            value[tops] = each[first]
            np.fmax.at(error, which[at], abs(each - value[which[at]]))
            values.append(value)
            errors.append(error)
        points.append(_TurningPoint(*values, *errors))
    return points[0], points[1], run.count("turning")
