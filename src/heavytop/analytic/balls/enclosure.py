"""Enclosure: what can be proved of one motion, to as many digits as are asked for."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, Final, TypeAlias, cast

from flint import arb

from heavytop.analytic.balls.course import Course, Half, Nodding, course
from heavytop.analytic.balls.rising import LIMIT, settled
from heavytop.classification.reduced import FromAxis, FromScene, Regime, Source
from heavytop.numbers import Exact, Number
from heavytop.numbers.intervals import Interval, outward, rational, working
from heavytop.scene.arguments import expect, whole
from heavytop.scene.state import State
from heavytop.scene.top import Top

_ERROR_DIGITS: Final = 25  # of θ in `theta_error`: far below the last bit of a double
_MOST_DIGITS: Final = 10_000
_MOST_BITS: Final = 1 << 24
_BY_THE: Final = 64  # bits for late times come by so many, so that times share their course

Value: TypeAlias = Callable[[Course, int], arb]


class Enclosure:
    """Balls around what one motion has; each is computed when it is asked for.

    Made by `enclose` and `enclose_axis`. The working precision is doubled until a ball is small
    enough: relative to max(1, |x|), and absolute for roots and θ.

    Parameters
    ----------
    source : Source
        The exact numbers.
    digits : int
        Decimal digits of every ball.
    limit : int
        Bits at which to give up.

    Raises
    ------
    NotANumber, Impossible
        Digits that are no whole number from 2 to 10 000, bits that are none from 2 to 2²⁴.
    Unseparated
        On construction, where a number can be neither told from 0 nor proved to be 0; by every
        property and method, where `limit` bits do not give the digits.

    Notes
    -----
    Accuracy: every ball contains the truth, by proof. ``tests/analytic/test_balls_published.py``
    finds in them what others printed.

    References
    ----------
    Johansson, "Arb: efficient arbitrary-precision midpoint-radius interval arithmetic", *IEEE
    Transactions on Computers* 66 (2017).
    """

    def __init__(self, source: Source, digits: int = 15, limit: int = LIMIT) -> None:
        self.source = source
        self.digits = whole("digits", digits, 2, _MOST_DIGITS)
        self.limit = whole("limit", limit, 2, _MOST_BITS)
        self.known = Regime.of(source)
        self._courses: dict[int, Course] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return Enclosure, (self.source, self.digits, self.limit)  # what was computed is not copied

    @property
    def nutates(self) -> bool:
        """Whether θ swings between two turning points; elsewhere there is no period."""
        return not (self.known.steady or self.known.asymptotic)

    @cached_property
    def roots(self) -> tuple[Interval, ...]:
        """u₁ ≤ u₂ ≤ u₃, the roots of the cubic as cos θ; without the infinite one if gMR = 0.

        A double root is one by proof: its two balls are then the same.
        """
        places = range(2 if self.known.weightless else 3)
        if not self.known.mirrored:
            return tuple(self._root(f"u{i + 1}", i, 1) for i in places)
        return tuple(self._root(f"u{i + 1}", 2 - i, -1) for i in places)

    @cached_property
    def theta_min(self) -> Interval:
        """The smallest θ [rad]; 0, never reached, where the axis tends to the top."""
        return self._turning("theta_min", 0 if self.known.mirrored else 1)

    @cached_property
    def theta_max(self) -> Interval:
        """The largest θ [rad]; π, never reached, where the axis tends to the bottom."""
        return self._turning("theta_max", 1 if self.known.mirrored else 0)

    @cached_property
    def period(self) -> Interval | None:
        """T [s], the period of θ; None where nothing nutates."""
        return self._of_period("the period", lambda path, _: path.period)

    @cached_property
    def precession(self) -> Interval | None:
        """Δφ [rad] in one period, +π for each exact pass through a pole; None without nutation."""
        return self._of_period("the precession", lambda path, _: path.turns[0] + path.turns[1])

    @cached_property
    def spin(self) -> Interval | None:
        """Δψ [rad] in one period, −π for a pass of the top, +π of the bottom; or None."""
        side = -1 if self.known.mirrored else 1

        def turned(path: Nodding, bits: int) -> arb:
            plus, minus = path.turns
            return self.source.reduced(bits).kappa * path.period + side * (plus - minus)

        return self._of_period("the spin", turned)

    def theta(self, t: Number) -> Interval:
        """θ(t) [rad].

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.

        Returns
        -------
        Interval
        """
        return self._at("theta", t, self._tilt, self.digits)

    def u(self, t: Number) -> Interval:
        """The cosine of θ(t).

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.

        Returns
        -------
        Interval
        """
        return self._at("u", t, self._cosine, self.digits)

    def theta_error(self, t: Number, theta: float) -> float:
        """An upper bound of |theta − θ(t)| [rad], less than 2e-25 above it.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.
        theta : float
            What is held against θ(t).
        """
        true = self._at("theta", t, self._tilt, max(self.digits, _ERROR_DIGITS))
        return outward(abs(rational(theta) - true.middle) + true.spread, 1)

    def _root(self, name: str, place: int, side: int) -> Interval:
        return self._settled(name, lambda path, _: side * path.roots[place])

    def _turning(self, name: str, which: int) -> Interval:
        return self._settled(name, lambda path, _: self._tilt(path.turnings[which]))

    def _of_period(self, name: str, value: Callable[[Nodding, int], arb]) -> Interval | None:
        if not self.nutates:
            return None
        return settled(
            name, lambda bits: value(cast(Nodding, self._course(bits)), bits), self.digits,
            self.limit,
        )  # fmt: skip

    def _at(self, name: str, t: Number, value: Callable[[Half], arb], digits: int) -> Interval:
        time = Exact.of(t)
        turned = min(max(1.0, abs(float(time)) * self._rate), sys.float_info.max)
        lost = _BY_THE * math.ceil(math.log2(turned) / _BY_THE)
        return self._settled(
            name, lambda path, bits: value(path.half(time.ball(bits))), digits, lost
        )

    def _settled(
        self, name: str, value: Value, digits: int | None = None, lost: int = 0
    ) -> Interval:
        return settled(
            name, lambda bits: value(self._course(bits), bits),
            self.digits if digits is None else digits, self.limit, absolute=True, lost=lost,
        )  # fmt: skip

    def _tilt(self, half: Half) -> arb:
        sine, cosine = reversed(half) if self.known.mirrored else half
        return 2 * arb.atan2(sine, cosine)

    def _cosine(self, half: Half) -> arb:
        high, low = half
        u = (1 - high * high).intersection(low * low - 1)
        return -u if self.known.mirrored else u

    @cached_property
    def _rate(self) -> float:
        """The order of the fastest rate in the motion [s⁻¹]: what late times lose digits by."""
        with working(64):
            start = self.source.reduced(64)
            return float((abs(start.g) + 2 * start.kinetic0 + start.b * start.b).sqrt().upper())

    def _course(self, bits: int) -> Course:
        """The course at a precision, which must be the working one."""
        if bits not in self._courses:
            start = self.source.reduced(bits)
            over = start.mirrored() if self.known.mirrored else start
            self._courses[bits] = course(over, self.known)
        return self._courses[bits]


def enclose(top: Top, start: State, digits: int = 15, limit: int = LIMIT) -> Enclosure:
    """The enclosure of the motion of `top` from `start`, both exact.

    Parameters
    ----------
    top : Top
        What spins.
    start : State
        How it starts.
    digits : int
        Decimal digits of every ball.
    limit : int
        Bits at which to give up.

    Returns
    -------
    Enclosure
        Balls, each computed when it is asked for.

    Raises
    ------
    Unseparated
        A number can be neither told from 0 nor proved to be 0.
    NotANumber, Impossible
        Digits that are no whole number from 2 to 10 000, bits that are none from 2 to 2²⁴.
    WrongType
        `top` is no Top, or `start` no State.

    Examples
    --------
    >>> motion = enclose(Top(A="3.28e-4", C="6.6e-5", gMR="0.0456"),
    ...                  State(theta="0.1", phidot=-15, psidot=140), digits=20)
    >>> print(motion.period.bounds(20))
    ('0.54289551818821995784', '0.54289551818821995785')
    >>> motion.theta_error(2, 0.4269437053097)
    4.309210679788058e-14

    Notes
    -----
    Accuracy: as of `Enclosure`; ``tests/analytic/test_balls_against_closed_form.py`` finds the
    closed form, which shares no line with them, in every ball.

    References
    ----------
    As of `Enclosure`.
    """
    expect("top", top, Top)
    expect("start", start, State)
    return Enclosure(FromScene(top, start), digits, limit)


def enclose_axis(
    e: Sequence[Number], l: Sequence[Number], g: Number, kappa: Number = 0,  # noqa: E741
    digits: int = 15, limit: int = LIMIT,
) -> Enclosure:  # fmt: skip
    """The enclosure of the motion that the axis form, ė = l × e, l̇ = g (−e_y, e_x, 0), has.

    Parameters
    ----------
    e, l : sequence of 3 number
        The axis, of any length but 0, and the angular momentum divided by A [s⁻¹]; floats mean
        their binary values.
    g : number
        gMR/A [s⁻²].
    kappa : number
        p_ψ (1/C − 1/A) [s⁻¹], which only `spin` needs.
    digits : int
        Decimal digits of every ball.
    limit : int
        Bits at which to give up.

    Raises
    ------
    Impossible
        e is zero, or one of the numbers is not rational.

    Examples
    --------
    >>> motion = enclose_axis(e=(0.0, 0.6, 0.8), l=(1.0, 3.0, 4.0), g=1.0)
    >>> print(motion.period.bounds(12))
    ('1.30737052675', '1.30737052676')
    """
    return Enclosure(FromAxis(e, l, g, kappa), digits, limit)
