"""Kinds of motion told by integration: by what happens at the turning points of one nutation.

The integrator knows nothing of the criteria by which a kind is proved, and these know nothing of
it: two maps of one plane are two independent results.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from heavytop.classification.arrays import IMPOSSIBLE, NAMES, Codes
from heavytop.classification.kinds import Kind
from heavytop.run.ensemble import Ensemble, propagate_many
from heavytop.studies.atlas_plane import Array, Mask, constants

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
    (angle, rate), error = _turning_points(run, start)
    met = run.count("turning")
    off_angle, off_rate = DOUBT * error
    off_angle = off_angle.max(axis=0)
    unsure = np.any(abs(rate) <= off_rate, axis=0)
    rest = _one_vanishes(rate) & _one_vanishes(rate * np.sin(angle) ** 2)
    low, high = angle
    nod = np.where(met == 0, 0.0, high - low)
    with np.errstate(all="ignore"):
        momenta = constants(start)
        A, theta, thetadot, gMR = (start[name] for name in ("A", "theta", "thetadot", "gMR"))
        moving = A * (abs(thetadot) + abs(start["phidot"] * np.sin(theta)))
        rounding = REST * (abs(momenta.p_psi) + moving + np.sqrt(A * abs(gMR)))
    still = abs(thetadot) * A <= rounding
    pole = np.sin(theta) <= POLE
    flat = (abs(momenta.p_psi) <= rounding) & ((momenta.across == 0) | pole)
    upwards = (np.cos(theta) > 0) == (gMR > 0)
    found = np.full(met.size, NAMES.index(Kind.WAVES), np.uint8)
    for kind, where in (
        (Kind.LOOPS, rate[0] * rate[1] < 0),
        (Kind.UNDECIDED, unsure),
        (Kind.CUSPS, rest),
        (Kind.SEPARATRIX, met == 1),
        (Kind.UNDECIDED, nod <= off_angle),
        (Kind.UNIFORM_PRECESSION, (nod <= LEVEL) & still),
        (Kind.SEPARATRIX, (met == 0) & ~still),
        (Kind.UNDECIDED, (np.pi - high <= off_angle) | (low <= off_angle)),
        (Kind.THROUGH_BOTTOM, np.pi - high <= POLE),
        (Kind.THROUGH_TOP, low <= POLE),
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


def _one_vanishes(pair: Array) -> Mask:
    """Where the smaller of two numbers is nothing beside the larger."""
    small, large = np.sort(abs(pair), axis=0)
    return np.asarray(small <= REST * large)


def _turning_points(run: Ensemble, start: Mapping[str, Array]) -> tuple[Array, Array]:
    """θ and φ̇ at turning points, and by how much the run differs from them a period later.

    Both are of shape (2, 2, k): θ and φ̇, where θ is smallest and where it is largest, of every
    top. They are nan and 0 where it met none; a start at rest in θ is one.
    """
    size, here = run.end.size, np.flatnonzero(start["thetadot"] == 0)  # known without error
    which = np.concatenate((here, run.zeros.which))
    met = np.array([np.concatenate((start[name][here], getattr(run.met, name)))
                    for name in ("theta", "phidot")])  # fmt: skip
    low, high = np.full(size, np.inf), np.full(size, -np.inf)
    np.fmin.at(low, which, met[0])
    np.fmax.at(high, which, met[0])
    with np.errstate(invalid="ignore"):  # of tops that met none: inf less inf
        key = which + size * (met[0] > ((low + high) / 2)[which])
    there, first = np.unique(key, return_index=True)
    value, error = np.full((2, 2 * size), np.nan), np.zeros((2, 2 * size))
    value[:, there] = met[:, first]
    for k in range(2):
        np.fmax.at(error[k], key, abs(met[k] - value[k, key]))
    return value.reshape(2, 2, size), error.reshape(2, 2, size)
