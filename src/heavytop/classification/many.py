"""Kinds of motion of whole arrays of tops and starts, each proved."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike

from heavytop.classification import arrays
from heavytop.classification.arrays import VERDICT_NAMES, Codes, InputArrays, Mask, Starts
from heavytop.classification.classify import classify
from heavytop.classification.filter import Filtered, filter_kinds
from heavytop.errors import Impossible
from heavytop.exact.pairs import Array
from heavytop.scene.arguments import expect

# tops computed at once: arrays of 32 KiB stay in the processor's cache
TOPS_AT_ONCE: Final = 4096


@dataclass(frozen=True, slots=True, eq=False)
class Verdicts:
    """The kinds of many motions; arrays have the common shape of the numbers given.

    Parameters
    ----------
    kind : ndarray of uint8
        Index in `names`, the last of which is impossible: no top or no start has these numbers.
    detail : ndarray of uint8
        Index in `details`: distinguishes motions of one kind. 0 where the kind has no details,
        and where they are not decided.
    certified : ndarray of bool
        Whether the kind is proved; true of impossible motions too.
    tags, open_tags : ndarray of uint8 or None
        The tags that hold and those that could be neither proved nor disproved, as bits: 1 for
        the first of `tag_names`, 2, 4, … for the others. None without `tags`.
    sent : int
        The number of motions that doubles left open, and balls decided.
    names, details, tag_names : tuple of str
        The meanings of the codes and of the bits.
    """

    kind: Codes
    detail: Codes
    certified: Mask
    tags: Codes | None
    open_tags: Codes | None
    sent: int

    names: ClassVar[tuple[str, ...]] = VERDICT_NAMES
    details: ClassVar[tuple[str, ...]] = arrays.VERDICT_DETAILS
    tag_names: ClassVar[tuple[str, ...]] = arrays.TAG_NAMES

    @property
    def impossible(self) -> Mask:
        """Where no top or no start has these numbers."""
        return np.equal(self.kind, arrays.IMPOSSIBLE)

    @property
    def counts(self) -> dict[str, int]:
        """The number of motions of each kind that occurs."""
        counted = np.bincount(self.kind.ravel(), minlength=len(VERDICT_NAMES)).tolist()
        return {name: n for name, n in zip(VERDICT_NAMES, counted, strict=True) if n}


def classify_many(
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
) -> Verdicts:
    """The kinds of motion of many tops and starts, proved as `heavytop.classify` proves one.

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
    Verdicts
        Impossible motions are marked and counted; they raise no error.

    Raises
    ------
    ImpossibleStart
        Both psidot and omega3 are given.
    NotANumber
        An argument is not an array of integers or of doubles.
    Impossible
        The shapes do not broadcast.

    Notes
    -----
    Doubles decide a sign where the sum is larger than its rounding errors can be; the others are
    decided by `heavytop.classify`. ``validation/03_benchmarks.py`` measures how fast this is.

    Accuracy: ``tests/classification/test_many.py`` holds kinds and tags to those of
    `heavytop.classify`, one by one.

    Examples
    --------
    The book's top, released at rest, and kicked forwards and backwards:

    >>> import numpy as np
    >>> found = classify_many(A=3.28e-4, C=6.6e-5, gMR=0.0456, theta=0.1, omega3=140,
    ...                       phidot=np.array([0, 5, -15]))
    >>> [found.names[code] for code in found.kind], found.certified.all(), found.sent
    (['cusps', 'waves', 'loops'], np.True_, 0)
    """
    expect("tags", tags, bool)
    given = {"A": A, "C": C, "gMR": gMR, "theta": theta, "thetadot": thetadot, "phidot": phidot}
    columns = InputArrays(arrays.with_spin(given, psidot, omega3))
    found = np.empty((5, columns.size), np.uint8)  # the rows of `Filtered`
    for at in range(0, columns.size, TOPS_AT_ONCE):
        span = slice(at, at + TOPS_AT_ONCE)
        found[:, span] = _filter_chunk(columns.starts(span), tags)
    sent = _classify_open(columns, found)
    found.setflags(write=False)
    kind, detail, proved, held, unknown = found.reshape(5, *columns.shape)
    if not tags:
        held = unknown = None
    return Verdicts(kind, detail, proved.view(np.bool_), held, unknown, sent)


def _filter_chunk(starts: Starts, tagged: bool) -> Codes:
    """The rows of `Filtered` of some motions, as far as doubles decide, with impossible ones."""
    rows = filter_kinds(starts, tagged)
    broken, unsure = is_impossible(starts.A, starts.C, starts.theta), Filtered(*rows).certain == 0
    if unsure.any():  # where a sign is known, all are finite
        for each in starts.arrays:
            broken = broken | unsure & ~np.isfinite(each)
    if broken.any():
        rows[:, np.broadcast_to(broken, unsure.shape)] = _IMPOSSIBLE
    return rows


def _classify_open(columns: InputArrays, found: Codes) -> int:
    """Decide by balls what doubles left open; return how many that were."""
    sent, codes = 0, Filtered(*found)
    for at in np.flatnonzero((codes.certain == 0) | (codes.open_tags != 0)).tolist():
        try:
            verdict = classify(*columns.one(at))
        except Impossible:
            found[:, at] = _IMPOSSIBLE[:, 0]
            continue
        sent += 1
        kind, detail = VERDICT_NAMES.index(verdict.kind), arrays.detail(verdict.tags)
        held, unknown = map(arrays.bits, (verdict.tags, verdict.open_tags))
        found[:, at] = kind, detail, verdict.certified, held, unknown
    return sent


_IMPOSSIBLE: Final = np.array([[arrays.IMPOSSIBLE], [0], [1], [0], [0]], np.uint8)  # it is proved


def is_impossible(A: Array, C: Array, theta: Array) -> Mask:
    """Where a rule of `Top` or `State` is broken by numbers, all of them finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        broken: Mask = ~((A > 0) & (C >= 0) & (theta >= 0) & (theta <= pi))
    return broken
