"""An axis of an atlas: which number of a scene changes along it, from where to where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from heavytop.errors import NotANumber
from heavytop.names import nearest
from heavytop.numbers import Exact
from heavytop.numbers.parse import ANGLES, RATES
from heavytop.scene.arguments import Refused

MOST: Final = 1_000_000  # pixels along one axis


class Role(NamedTuple):
    """What a number of a scene sets, its units, and how a chart writes it."""

    sets: str
    units: tuple[str, ...]
    unit: str
    sign: str


ROLES: Final = {
    "theta": Role("tilt", ANGLES, "rad", r"$\theta$"),
    "thetadot": Role("nodding", RATES, "rad/s", r"$\dot{\theta}$"),
    "phidot": Role("precession", RATES, "rad/s", r"$\dot{\varphi}$"),
    "psidot": Role("spin", RATES, "rad/s", r"$\dot{\psi}$"),
    "omega3": Role("spin", RATES, "rad/s", r"$\omega_3$"),
    "p_phi": Role("precession", (), "kg m² s⁻¹", r"$p_\varphi$"),
    "p_psi": Role("spin", (), "kg m² s⁻¹", r"$p_\psi$"),
    "E": Role("nodding", (), "J", "E"),
    "A": Role("A", (), "kg m²", "A"),
    "C": Role("C", (), "kg m²", "C"),
    "gMR": Role("gMR", (), "kg m² s⁻²", "gMR"),
}
"""What may change along an axis. Two axes of a plane set different things."""

FORM: Final = "NAME=FROM:TO:COUNT, such as phidot=-20:20:2000 (or …:COUNT:log)"


@dataclass(frozen=True, slots=True)
class Axis:
    """The values of one number of a scene along an axis; a pixel is the top at its middle.

    Parameters
    ----------
    name : str
        One of `ROLES`.
    low, high : Exact
        The first and the last value, the first the smaller.
    count : int
        How many there are, both ends among them.
    log : bool
        Whether neighbours have the same ratio and not the same difference.

    Raises
    ------
    Refused
        It has no name of a number, no range, or too many pixels or too few.
    """

    name: str
    low: Exact
    high: Exact
    count: int
    log: bool = False

    def __post_init__(self) -> None:
        if self.name not in ROLES:
            raise _unknown(self.name)
        if not 2 <= self.count <= MOST:
            raise Refused(f"from 2 to {MOST} pixels")
        if (self.high - self.low).sign() != 1:
            raise Refused("FROM is to be less than TO")
        if not float(self.low) < float(self.high):
            raise Refused("between FROM and TO there is no double")
        if self.log and (self.low.sign(), self.high.sign()) not in ((1, 1), (-1, -1)):
            raise Refused("a logarithmic axis does not reach 0")

    @classmethod
    def of(cls, given: Any) -> Axis:
        """The axis that a text, or (name, low, high, count), says.

        Raises
        ------
        Refused
            It says none.

        Examples
        --------
        >>> Axis.of("phidot=-20:20:5").values
        array([-20., -10.,   0.,  10.,  20.])
        >>> Axis.of(("C", "1e-6", "1e-4", 3, "log")).text
        'C=1e-6:1e-4:3:log'
        """
        if isinstance(given, Axis):
            return given
        if isinstance(given, str):
            return cls._read(given)
        if not isinstance(given, Sequence) or not 4 <= len(given) <= 5:
            raise Refused(f"a text {FORM}, or (name, low, high, count)")
        name, low, high, count, *log = given
        if isinstance(count, bool) or not isinstance(count, int) or log not in ([], ["log"]):
            raise Refused("(name, low, high, count) or (name, low, high, count, 'log')")
        return cls._built(str(name), low, high, count, bool(log))

    @classmethod
    def _read(cls, text: str) -> Axis:
        name, equals, rest = text.partition("=")
        low, high, count, *log = [*rest.split(":"), "", "", ""][: max(3, rest.count(":") + 1)]
        whole = equals and low.strip() and high.strip() and count.strip().isdecimal()
        if not whole or [word.strip() for word in log] not in ([], ["log"]) or len(count) > 20:
            raise Refused(FORM)
        return cls._built(name.strip(), low, high, int(count), bool(log))

    @classmethod
    def _built(cls, name: str, low: Any, high: Any, count: int, log: bool) -> Axis:
        if name not in ROLES:
            raise _unknown(name)
        try:
            first, last = (Exact.of(each, ROLES[name].units) for each in (low, high))
        except NotANumber as wrong:
            raise Refused(str(wrong)) from None
        return cls(name, first, last, count, log)

    @property
    def text(self) -> str:
        """The axis as it can be read again."""
        return f"{self.name}={self.low}:{self.high}:{self.count}{':log' if self.log else ''}"

    @property
    def values(self) -> NDArray[np.float64]:
        """The values, increasing: of a linear axis each the double nearest the exact one."""
        return _values(self)


@lru_cache(maxsize=8)
def _values(axis: Axis) -> NDArray[np.float64]:
    low, high, last = _fraction(axis.low), _fraction(axis.high), axis.count - 1
    if axis.log:
        values = float(low) * float(high / low) ** (np.arange(axis.count) / last)
        values[0], values[-1] = float(low), float(high)
    else:  # a quotient of integers is rounded once
        first, step = low.numerator * high.denominator, high.numerator * low.denominator
        under = low.denominator * high.denominator * last
        ends = ((first * (last - k) + step * k) / under for k in range(axis.count))
        values = np.fromiter(ends, np.float64, axis.count)
    values.setflags(write=False)
    return values


def _fraction(x: Exact) -> Fraction:
    """A number as a fraction; an irrational one is rounded to a double first."""
    return x.fraction if x.fraction is not None else Fraction(float(x))


def _unknown(name: str) -> Refused:
    return Refused(f"one of {', '.join(ROLES)}", nearest(name, ROLES))
