"""Kinds of motion told by integration: by what happens at the turning points of one nutation.

The integrator knows nothing of the criteria by which a kind is proved, and these know nothing of
it: two maps of one plane are two witnesses.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.classification.arrays import IMPOSSIBLE, NAMES, Codes
from heavytop.classification.kinds import Kind
from heavytop.run.ensemble import Ensemble, propagate_many

Array = NDArray[np.float64]

SPAN: Final = 1.55  # nutation periods: one turning point at least is met twice
PART: Final = (
    5  # steps are no longer than such a part of a period: none passes over a turning point
)
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
    shape = np.shape(period)
    numbers: dict[str, Any] = {
        name: np.broadcast_to(each, shape).ravel() for name, each in tops.items()
    }
    once = np.where(np.isfinite(period), period, 1.0).ravel()
    run = propagate_many(
        **numbers, time=SPAN * once, longest=once / PART, events=("turning",), step_limit=STEPS,
        jobs=1,
    )  # fmt: skip
    return _told(run, numbers).reshape(shape)


def _told(run: Ensemble, start: Mapping[str, Array]) -> Codes:
    """Codes of kinds of a row of runs; later words go over earlier ones."""
    low, high = _turnings(run, start)
    sorts = (low, high)
    off_theta = DOUBT * np.fmax(low.off_theta, high.off_theta)
    untold = np.logical_or(*(abs(each.phidot) <= DOUBT * each.off_phidot for each in sorts))
    rest = np.logical_and(*(_at_rest(*pair) for pair in (
        (low.phidot, high.phidot), (low.across, high.across))))  # fmt: skip
    alone = low.met == 0
    nod = np.where(alone, 0.0, high.theta - low.theta)
    p_psi, across, size = _momenta(start)
    still = abs(start["thetadot"]) * start["A"] <= REST * size
    pole = np.sin(start["theta"]) <= POLE
    flat = (abs(p_psi) <= REST * size) & ((across == 0) | pole)
    upwards = (np.cos(start["theta"]) > 0) == (start["gMR"] > 0)
    found = np.full(run.end.size, NAMES.index(Kind.WAVES), np.uint8)
    for kind, where in (
        (Kind.LOOPS, low.phidot * high.phidot < 0),
        (Kind.UNDECIDED, untold),
        (Kind.CUSPS, rest),
        (Kind.SEPARATRIX, low.met + high.met == 1),
        (Kind.UNDECIDED, nod <= off_theta),
        (Kind.UNIFORM_PRECESSION, (nod <= LEVEL) & still),
        (Kind.SEPARATRIX, alone & ~still),
        (Kind.UNDECIDED, (np.pi - high.theta <= off_theta) | (low.theta <= off_theta)),
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
    """The turning points of each top that are highest, or lowest: nan and 0 where it met none.

    Attributes
    ----------
    theta, phidot : ndarray
        At the first of them.
    off_theta, off_phidot : ndarray
        By how much those a period later differ from it: what the run itself is off.
    met : ndarray of int
        How many turning points of either sort there were.
    """

    theta: Array
    phidot: Array
    off_theta: Array
    off_phidot: Array
    met: NDArray[np.int64]

    @property
    def across(self) -> Array:
        """φ̇ sin²θ."""
        return np.asarray(self.phidot * np.sin(self.theta) ** 2)


def _at_rest(one: Array, other: Array) -> Any:
    """Where the smaller of two numbers is nothing beside the larger."""
    small, large = np.sort(abs(np.stack((one, other))), axis=0)
    return small <= REST * large


def _turnings(run: Ensemble, start: Mapping[str, Array]) -> tuple[_Turning, _Turning]:
    """The turning points at the smallest θ and at the largest; a start at rest in θ is one."""
    met, size = run.met, run.end.size
    here = np.flatnonzero(start["thetadot"] == 0)
    which = np.concatenate((here, run.zeros.which))
    theta = np.concatenate((start["theta"][here], met.theta))
    phidot = np.concatenate((start["phidot"][here], met.phidot))
    count = np.bincount(which, minlength=size)
    with np.errstate(invalid="ignore"):  # of tops that met none: inf less inf
        low, high = (_extreme(which, theta, size, np.fmin, np.inf),
                     _extreme(which, theta, size, np.fmax, -np.inf))  # fmt: skip
        middle = (low + high) / 2
        return tuple(  # type: ignore[return-value]
            _sort(which, theta, phidot, below == (theta <= middle[which]), count)
            for below in (True, False)
        )


def _extreme(which: Any, values: Array, size: int, choose: Any, least: float) -> Array:
    found = np.full(size, least)
    choose.at(found, which, values)
    return found


def _sort(which: Any, theta: Array, phidot: Array, mine: Any, count: Any) -> _Turning:
    """One sort of turning points: the first of each top, and how far the others are off it."""
    at = np.flatnonzero(mine)
    tops, first = np.unique(which[at], return_index=True)
    values = []
    for each in (theta, phidot):
        one = np.full(count.size, np.nan)
        one[tops] = each[at][first]
        values.append((one, _extreme(which[at], abs(each[at] - one[which[at]]), count.size,
                                     np.fmax, 0.0)))  # fmt: skip
    return _Turning(values[0][0], values[1][0], values[0][1], values[1][1], count)


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
