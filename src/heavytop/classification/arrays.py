"""Arrays of tops and starts, broadcast and flattened; codes for kinds, their details and tags."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from math import prod
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.classification.kinds import TAGS, Kind
from heavytop.errors import Impossible, ImpossibleStart, NotANumber
from heavytop.exact.pairs import Array
from heavytop.scene.arguments import broken_names
from heavytop.scene.starts import ANGLE_RATES
from heavytop.scene.state import State
from heavytop.scene.top import Top

Mask: TypeAlias = "NDArray[np.bool_]"
Codes: TypeAlias = "NDArray[np.uint8]"
Given: TypeAlias = "Mapping[str, ArrayLike]"

ARRAY_RANGE: Final = 2.0**100  # doubles decide for numbers up to it, and down to 1 over it
_WHOLE: Final = 2.0**53

VERDICT_NAMES: Final = (*map(str, Kind), "impossible")
"""The kinds by their codes; the last is that of impossible motions."""

IMPOSSIBLE: Final = VERDICT_NAMES.index("impossible")

VERDICT_DETAILS: Final = (
    "", "stable", "marginal", "unstable", "swinging", "rotating", "asymptotic",
    "slow", "fast", "single",
)  # fmt: skip
"""The details by their codes, which distinguish motions of one kind; 0 is none."""

TAG_NAMES: Final = tuple(TAGS)
"""The tags whose bits are 1, 2, 4, …"""


def bits(names: tuple[str, ...]) -> int:
    """The bits of those names that are tags.

    Examples
    --------
    >>> bits(("slow", "spherical-pendulum", "spin-reversal"))
    5
    """
    return sum(1 << TAG_NAMES.index(name) for name in names if name in TAG_NAMES)


def detail(names: tuple[str, ...]) -> int:
    """The code of the detail among names; 0 where there is none.

    Examples
    --------
    >>> VERDICT_DETAILS[detail(("slow", "spherical-pendulum"))]
    'slow'
    """
    return next((VERDICT_DETAILS.index(name) for name in names if name in VERDICT_DETAILS), 0)


class Starts(NamedTuple):
    """Tops and starts, each array of one shape (n,) or of one element; `held` names the spin."""

    A: Array
    C: Array
    gMR: Array
    theta: Array
    thetadot: Array
    phidot: Array
    spin: Array
    held: str

    @property
    def arrays(self) -> tuple[Array, ...]:
        """A, C, gMR, theta, thetadot, phidot and spin."""
        return self[:-1]

    @property
    def in_range(self) -> Mask:
        """Where every number is 0 or within 2⁻¹⁰⁰ … 2¹⁰⁰.

        Then no product in a criterion leaves 2⁻⁹⁶⁰ … 2⁹⁶⁰, where roundings are relative.
        """
        sizes = map(np.abs, self.arrays)
        fits = ((x >= 1 / ARRAY_RANGE) & (x <= ARRAY_RANGE) | np.equal(x, 0) for x in sizes)
        return reduce(np.logical_and, fits)

    @property
    def still(self) -> Mask:
        """Where θ̇ = 0."""
        return np.equal(self.thetadot, 0)

    @property
    def level(self) -> Mask:
        """Where φ̇ sinθ = 0; of the doubles in [0, π] only 0 is a pole."""
        return np.equal(self.theta, 0) | np.equal(self.phidot, 0)


class InputArrays:
    """Arrays of tops and starts by name, as columns; a number common to all is one element.

    Parameters
    ----------
    given : mapping of str to array_like
        A, C, gMR, theta, thetadot, phidot, and psidot or omega3, in that order.

    Raises
    ------
    NotANumber
        An argument is not an array of integers or of doubles.
    Impossible
        The shapes do not broadcast.
    """

    def __init__(self, given: Given) -> None:
        arrays = {name: _array(name, each) for name, each in given.items()}
        try:
            self.shape = np.broadcast_shapes(*(each.shape for each in arrays.values()))
        except ValueError:
            sizes = ", ".join(f"{name} {each.shape}" for name, each in arrays.items() if each.shape)
            raise Impossible([("shapes", f"must broadcast together, not {sizes}")]) from None
        self.size = prod(self.shape)
        self._columns = {
            name: (each if each.size == 1 else np.broadcast_to(each, self.shape)).reshape(-1)
            for name, each in arrays.items()
        }

    def part(self, span: Any) -> dict[str, Any]:
        """Parts of the columns by name; a number common to all is one element."""
        return {name: x if x.size == 1 else x[span] for name, x in self._columns.items()}

    def starts(self, span: Any) -> Starts:
        """Some of the tops and starts; a number common to all is one element."""
        part = self.part(span)
        *_, held = part  # the name of the spin is last
        return Starts._make((*part.values(), held))

    def full(self) -> dict[str, Array]:
        """All columns by name, each of as many elements as there are tops."""
        columns = self._columns.items()
        return {name: np.ascontiguousarray(np.broadcast_to(x, self.size)) for name, x in columns}

    def one(self, at: int) -> tuple[Top, State]:
        """One top and its start, exact; raises `ImpossibleTop` or `ImpossibleStart`."""
        numbers = {name: float(x[0]) for name, x in self.part(slice(at, at + 1)).items()}
        moments = {name: numbers.pop(name) for name in ("A", "C", "gMR")}
        return Top.of_numbers(**moments), State(**numbers)


def with_spin(given: Given, psidot: ArrayLike | None, omega3: ArrayLike | None) -> Given:
    """Tops and starts with their spin: psidot, or omega3, or ψ̇ = 0 where neither is given."""
    if psidot is not None and omega3 is not None:
        raise ImpossibleStart(broken_names(ANGLE_RATES, ("psidot", "omega3")))
    if omega3 is not None:
        return {**given, "omega3": omega3}
    return {**given, "psidot": 0.0 if psidot is None else psidot}


def _array(name: str, given: ArrayLike) -> Array:
    """An argument as an array of doubles; `NotANumber` where these cannot hold it exactly."""
    try:
        array = np.asarray(given)
    except ValueError as error:  # lists of different lengths
        raise NotANumber(f"{name}: {error}") from None
    if array.dtype.kind not in "iuf" or not np.can_cast(array.dtype, np.float64):
        raise NotANumber(f"{name}: numbers come as integers or doubles, not as {array.dtype}")
    doubles = array.astype(np.float64, copy=False)
    if array.dtype.kind in "iu" and np.any(abs(doubles) > _WHOLE):
        raise NotANumber(f"{name}: integers up to 2^53, which doubles hold exactly")
    return doubles
