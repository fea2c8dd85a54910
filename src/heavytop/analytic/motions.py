"""Turning points, periods and turns of whole arrays of tops and starts, by the closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from heavytop.analytic.motion import Motion
from heavytop.analytic.theory.rows.row import rows
from heavytop.classification.arrays import (
    DETAILS,
    NAMES,
    Array,
    InputArrays,
    Mask,
    Starts,
    with_spin,
)
from heavytop.classification.kinds import Kind
from heavytop.classification.many import Verdicts, classify_many
from heavytop.errors import NoClosedForm

CHUNK: Final = 8192  # motions at a time: the arrays in use stay in the cache, the calls are few


@dataclass(frozen=True, slots=True)
class Motions:
    """What motions they are; arrays have the common shape of what was given.

    Parameters
    ----------
    verdicts : Verdicts
        Their kinds.
    theta_min, theta_max : ndarray of float
        The least and the greatest θ [rad]; bounds, where the axis tends to the vertical. Nan
        where the motion is impossible.
    period : ndarray of float
        T [s], the period of θ. This and what follows is nan where nothing nutates.
    precession, spin : ndarray of float
        Δφ and Δψ in one period [rad]; an exact pass through a pole makes φ jump by π.
    sent : int
        How many were computed one by one, by `heavytop.Motion`.
    columns : tuple of str
        The names of the five arrays.
    """

    verdicts: Verdicts
    theta_min: Array
    theta_max: Array
    period: Array
    precession: Array
    spin: Array
    sent: int

    columns: ClassVar[tuple[str, ...]] = ("theta_min", "theta_max", "period", "precession", "spin")


def motions_many(
    *,
    A: ArrayLike,
    C: ArrayLike,
    gMR: ArrayLike,
    theta: ArrayLike,
    thetadot: ArrayLike = 0.0,
    phidot: ArrayLike = 0.0,
    psidot: ArrayLike | None = None,
    omega3: ArrayLike | None = None,
    tags: bool = False,
) -> Motions:
    """The turning points, period, precession and spin of many tops and starts, and their kinds.

    Parameters
    ----------
    A, C, gMR : array_like
        Moments of inertia [kg m²] and weight times distance [kg m² s⁻²].
    theta, thetadot, phidot : array_like
        Tilt [rad] and rates [rad/s].
    psidot, omega3 : array_like, optional
        The spin, as ψ̇ or as ω3 [rad/s]; not both. All are broadcast; doubles mean their exact
        binary value.
    tags : bool
        Whether tags are found too.

    Returns
    -------
    Motions
        What is impossible is marked and counted, not refused.

    Raises
    ------
    ImpossibleStart
        Both psidot and omega3 are given.
    NotANumber
        Something is not an array of integers or of doubles.
    Impossible
        The shapes do not broadcast.

    Notes
    -----
    Every number is that of one motion alone, bit for bit: it depends on nothing else in the array.

    Accuracy: 1e-14 of `heavytop.Motion`'s, relative, and of angles relative to max(1, |x|); as near
    as 1e-15 to every special motion, by ``tests/analytic/test_motions_many.py``.
    ``validation/25_rows_per_second.py`` measures how fast this is.

    References
    ----------
    As of `heavytop.Motion`; elliptic integrals by arithmetic–geometric means, *NIST Digital Library
    of Mathematical Functions*, section 19.8.

    Examples
    --------
    The book's top, released at rest, kicked forwards and backwards, and asleep:

    >>> found = motions_many(A=3.28e-4, C=6.6e-5, gMR=0.0456, theta=[0.1, 0.1, 0.1, 0], omega3=140,
    ...                      phidot=[0, 5, -15, 0])
    >>> [found.verdicts.names[code] for code in found.verdicts.kind]
    ['cusps', 'waves', 'loops', 'sleeping']
    >>> print(found.period.round(8), found.sent)
    [0.40140587 0.4044716  0.38409494        nan] 0
    """
    tops = {"A": A, "C": C, "gMR": gMR, "theta": theta, "thetadot": thetadot, "phidot": phidot}
    given: dict[str, Any] = with_spin(tops, psidot, omega3)
    survey = _Survey(InputArrays(given), classify_many(**given, tags=tags))
    survey.compute()
    return survey.motions(survey.send())


class _Survey:
    """Many tops and starts, and the numbers found of them."""

    def __init__(self, columns: InputArrays, verdicts: Verdicts) -> None:
        self.columns, self.verdicts = columns, verdicts
        self.kind, self.detail = verdicts.kind.reshape(-1), verdicts.detail.reshape(-1)
        self.found = tuple(np.full(columns.size, np.nan) for _ in Motions.columns)
        self.left = np.zeros(columns.size, np.bool_)

    def compute(self) -> None:
        """Put in what doubles can tell, and mark what they cannot."""
        for at in range(0, self.columns.size, CHUNK):
            span = slice(at, at + CHUNK)
            starts = self.columns.starts(span)
            nods, steady = self._courses(starts, span)
            *numbers, trusted = rows(*starts)
            put = nods & trusted
            for array, part in zip(self.found, numbers, strict=True):
                np.copyto(array[span], part, where=put)
            for array in self.found[:2]:
                np.copyto(array[span], starts.theta, where=steady)
            self.left[span] = ~(put | steady | (self.kind[span] == _IMPOSSIBLE))

    def send(self) -> int:
        """Compute what is left one by one, and say how many that were."""
        left = np.flatnonzero(self.left)
        for at in left.tolist():
            try:
                numbers = _one(Motion(*self.columns.one(at)))
            except NoClosedForm:
                continue
            for array, number in zip(self.found, numbers, strict=True):
                array[at] = number
        return left.size

    def motions(self, sent: int) -> Motions:
        """What was found, in the shape of what was given."""
        for array in self.found:
            array.setflags(write=False)
        low, high, period, *turns = (each.reshape(self.columns.shape) for each in self.found)
        return Motions(self.verdicts, low, high, period, turns[0], turns[1], sent)

    def _courses(self, starts: Starts, span: slice) -> tuple[Mask, Mask]:
        """Where θ nods, and where it is constant, by the kind and the start."""
        kind, detail = self.kind[span], self.detail[span]
        free = kind == _FORCE_FREE
        still = free & starts.still & (starts.level | _carried(starts))
        nods = _NODS[kind] | (kind == _PLANAR) & ((detail == _SWINGING) | (detail == _ROTATING))
        return nods | free & ~still, _STEADY[kind] | still


def _carried(starts: Starts) -> Mask:
    """Where no torque and A φ̇ cosθ = C ω3 keep θ; but for θ = 0, cosθ is transcendental."""
    if starts.held == "omega3":
        return np.zeros(1, np.bool_)
    return np.equal(starts.A, starts.C) & np.equal(starts.spin, 0)


def _one(motion: Motion) -> tuple[float, ...]:
    turns = (motion.period, motion.precession, motion.spin)
    return motion.theta_min, motion.theta_max, *(np.nan if x is None else x for x in turns)


def _among(*kinds: Kind) -> Mask:
    return np.isin(NAMES, kinds)


_NODS = _among(Kind.THROUGH_TOP, Kind.THROUGH_BOTTOM, Kind.LOOPS, Kind.CUSPS, Kind.WAVES)
_STEADY = _among(Kind.AT_REST, Kind.SLEEPING, Kind.HANGING, Kind.UNIFORM_PRECESSION)
_IMPOSSIBLE = NAMES.index("impossible")
_FORCE_FREE, _PLANAR = NAMES.index(Kind.FORCE_FREE), NAMES.index(Kind.PLANAR_PENDULUM)
_SWINGING, _ROTATING = DETAILS.index("swinging"), DETAILS.index("rotating")
