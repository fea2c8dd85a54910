"""Enclosure: what can be proved of one motion, to as many digits as are asked for.

Everything is computed in ball arithmetic (Arb, through python-flint) from the exact numbers of a
scene, or from the binary numbers of a run in the axis form. What comes out is an `Interval` that
contains the true value; no rounding error is estimated anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from operator import attrgetter
from typing import Any, Final

from flint import arb

from heavytop.analytic.cubic import TooFewBits, sign_of
from heavytop.analytic.rising import LIMIT, MOST_DIGITS, MotionNumbers, Rising, one
from heavytop.analytic.solution import Nutating, Solution, floor
from heavytop.classification.reduced import ReducedMotion, reduced_from_axis, reduced_from_scene
from heavytop.errors import Impossible
from heavytop.exact import Number
from heavytop.exact.balls import Interval, outward, rational
from heavytop.scene.arguments import expect, text_of, whole
from heavytop.scene.state import State
from heavytop.scene.top import Top

_ERROR_DIGITS: Final = 25  # of θ in `theta_error`: far below the last bit of a double
_MOST_BITS: Final = 1 << 24
_MOST_EVENTS: Final = 10**100

_AT_AN_END: Final = "an event and the end of the span"

EVENTS: Final = ("turning", "reversal", "cusp")
"""What can be counted: a cusp is a turning point too."""


class Enclosure(MotionNumbers[Interval]):
    """Intervals around what one motion has; each is computed when it is asked for.

    Made by `enclose` and `enclose_axis`. The working precision is raised until an interval is
    small enough: relative to max(1, |x|), and absolute for roots, tilts and the axis.

    Parameters
    ----------
    source : ReducedMotion
        The exact numbers.
    digits : int
        Decimal digits of every interval.
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
    Accuracy: every interval contains the truth, by proof.
    ``tests/analytic/test_published.py`` finds in them what others printed.

    References
    ----------
    Johansson, "Arb: efficient arbitrary-precision midpoint-radius interval arithmetic", *IEEE
    Transactions on Computers* 66 (2017).
    """

    def __init__(self, source: ReducedMotion, digits: int = 15, limit: int = LIMIT) -> None:
        self.source = source
        self.digits = self._digits = whole("digits", digits, 2, MOST_DIGITS)
        self.limit = whole("limit", limit, 2, _MOST_BITS)
        self.rising = Rising(source, limit=self.limit)
        self.regime = self.rising.regime

    def __reduce__(self) -> tuple[Any, ...]:
        return Enclosure, (self.source, self.digits, self.limit)  # what was computed is not copied

    def _number(self, ball: arb) -> Interval:
        return Interval.of(ball)

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
        return self._at("theta", t, Solution.theta, one)[0]

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
        return self._at("u", t, Solution.u, one)[0]

    def phi(self, t: Number) -> Interval:
        """φ(t) [rad], continuous from the start but for +π at each exact pass through a pole.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.

        Returns
        -------
        Interval
        """
        return self._at("phi", t, lambda found, time: found.at(time).phi)[0]

    def psi(self, t: Number) -> Interval:
        """ψ(t) [rad], continuous from the start but for ∓π at exact passes of the top, bottom.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.

        Returns
        -------
        Interval
        """
        return self._at("psi", t, lambda found, time: found.at(time).psi)[0]

    def axis(self, t: Number) -> tuple[Interval, ...]:
        """The unit vector (sin θ sin φ, −sin θ cos φ, cos θ) along the symmetry axis at a time.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.

        Returns
        -------
        tuple of 3 Interval
        """
        return self._at("the axis", t, lambda found, time: found.at(time).axis, one)

    def quaternion(self, t: Number) -> tuple[Interval, ...]:
        """The attitude at a time, body to space, scalar first, continuous from the start.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.

        Returns
        -------
        tuple of 4 Interval
        """
        return self._at("the attitude", t, lambda found, time: found.at(time).quaternion, one)

    def rates(self, t: Number) -> tuple[Interval, ...]:
        """θ̇, φ̇ and ψ̇ at a time [rad/s]; at an exact pass through a pole the limits.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.

        Returns
        -------
        tuple of 3 Interval
        """
        of_rates = attrgetter("thetadot", "phidot", "psidot")
        return self._at("a rate", t, lambda found, time: of_rates(found.at(time)))

    def at(self, t: Number, names: Sequence[str]) -> tuple[Interval, ...]:
        """Several quantities at a time, from one computation, one after another.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.
        names : sequence of str
            Of an `ExactRecord`, such as ``theta``, ``phidot``, ``axis``, ``quaternion``, ``omega``:
            a vector gives its components.

        Returns
        -------
        tuple of Interval

        Examples
        --------
        >>> kicked = enclose(Top(A="3.28e-4", C="6.6e-5", gMR="0.0456"),
        ...                  State("0.1", phidot=-15, psidot=140))
        >>> [x.rounded(9) for x in kicked.at(2, ["theta", "axis"])]
        ['0.426943705', '0.230727662', '0.343854519', '0.910235582']
        """

        def value(found: Solution, time: arb) -> tuple[arb, ...]:
            here = found.at(time)
            values = (getattr(here, name) for name in names)
            return tuple(x for each in values for x in (each if type(each) is tuple else (each,)))

        return self._at(" or ".join(names), t, value)

    def theta_error(self, t: Number, theta: float) -> float:
        """An upper bound of |theta − θ(t)| [rad], less than 2e-25 above it.

        Parameters
        ----------
        t : number
            Time since the start [s], exact; floats mean their binary value.
        theta : float
            What is held against θ(t).
        """
        digits = max(self.digits, _ERROR_DIGITS)
        true = self._at("theta", t, Solution.theta, one, digits)[0]
        return outward(abs(rational(theta) - true.middle) + true.spread, 1)

    def count(self, event: str, t: Number) -> int:
        """How many events there are from the start to a time, both included: proved.

        Parameters
        ----------
        event : {"turning", "reversal", "cusp"}
            Turning points of θ, changes of sign of φ̇, or cusps.
        t : number
            The end of the span [s], exact; negative ones are before the start.

        Raises
        ------
        Unseparated
            An event is so near to the time that `limit` bits do not tell them apart.
        ValueError
            Another event.

        Examples
        --------
        >>> dropped = enclose(Top(A="3.28e-4", C="6.6e-5", gMR="0.0456"), State("0.1", psidot=140))
        >>> dropped.count("turning", 2), dropped.count("cusp", 2), dropped.count("reversal", 2)
        (10, 5, 0)
        """
        _known_event(event)

        def counted(found: Solution, time: arb) -> arb:
            forward = sign_of(time, _AT_AN_END)
            end = forward * time
            if not isinstance(found.path, Nutating):
                at = found.lower_turning if event == "turning" else None
                return arb(0 if at is None else _ahead(forward * at) and _ahead(end - forward * at))
            total, periods = arb(0), end / found.path.period
            for after in self._positions(event, found.path):
                total += floor(periods - forward * after, _AT_AN_END)
                total += floor(forward * after, _AT_AN_END) + 1
            return total

        return int(self._at(f"the count of {event}", t, counted, one, 2)[0].middle)

    def time(self, event: str, n: int) -> Interval:
        """When an event happens [s]: 0 is the first one not before the start, −1 the last before.

        Parameters
        ----------
        event : {"turning", "reversal", "cusp"}
            Turning points of θ, changes of sign of φ̇, or cusps.
        n : int
            Which of them.

        Returns
        -------
        Interval

        Raises
        ------
        NotANumber, Impossible
            n is no whole number up to 10¹⁰⁰ in magnitude, or there is no such event.
        ValueError
            Another event.

        Examples
        --------
        >>> kicked = enclose(Top(A="3.28e-4", C="6.6e-5", gMR="0.0456"),
        ...                  State("0.1", phidot=-15, psidot=140), digits=12)
        >>> kicked.time("turning", 0).bounds(12), kicked.time("turning", 2).bounds(12)
        (('0', '0'), ('0.542895518188', '0.542895518189'))
        """
        _known_event(event)
        n = whole("n", n, -_MOST_EVENTS, _MOST_EVENTS)

        def when(found: Solution, _: int) -> arb | None:
            if not isinstance(found.path, Nutating):
                at = found.lower_turning if event == "turning" else None
                return None if at is None or n != (0 if _ahead(at) else -1) else at
            after = self._positions(event, found.path)
            if not after:
                return None
            turns, which = divmod(n, len(after))
            in_period = sorted((x - floor(x, _AT_AN_END) for x in after), key=lambda x: x.mid())
            if not all(low < high for low, high in pairwise(in_period)):
                raise TooFewBits("two events", in_period[-1] - in_period[0])
            return (turns + in_period[which]) * found.path.period

        period = self.period
        span = abs(n) * period.upper if period is not None else 0.0
        found = self.rising.settled(
            f"the time of {event} {n}", when, self.digits, lost=self.rising.lost(span)
        )
        if found is None:
            raise Impossible([("n", f"an event that there is: {event} {n} does not happen")])
        return Interval.of(found)

    def _positions(self, event: str, path: Nutating) -> list[arb]:
        """When the events of a nutation happen, in periods after the start, up to whole ones."""
        start, half = -path.phase, arb(1) / 2
        if event == "turning":
            return [start, half + start]
        if self.rising.cusps:
            return [half + start] if event == "cusp" else []
        if event == "cusp" or (part := path.reversal) is None:
            return []
        if not path.over.drift0.is_zero() and not self.rising.starts_reversing:
            return [start + part, start - part]
        rising = path.over.udot0 > 0
        return [arb(0), start - part if rising else start + part]


def _known_event(event: str) -> None:
    if text_of("event", event) not in EVENTS:
        raise ValueError(f"turning, reversal or cusp, not {event!r}")


def _ahead(time: arb) -> bool:
    """Whether a time is not before the start."""
    return sign_of(time, _AT_AN_END) > 0


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
    Accuracy: as of `Enclosure`; ``tests/analytic/test_elliptic.py`` and
    ``tests/analytic/test_reduced_equation.py`` find in every interval what mpmath's elliptic
    functions and quadrature say.

    References
    ----------
    As of `Enclosure`.
    """
    expect("top", top, Top)
    expect("start", start, State)
    return Enclosure(reduced_from_scene(top, start), digits, limit)


def enclose_axis(
    e: Sequence[Number], l: Sequence[Number], g: Number, kappa: Number = 0,  # noqa: E741
    digits: int = 15, limit: int = LIMIT, phi0: Number | None = None, psi0: Number = 0,
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
        p_ψ (1/C − 1/A) [s⁻¹], which ψ, its rate and `spin` need.
    digits : int
        Decimal digits of every ball.
    limit : int
        Bits at which to give up.
    phi0, psi0 : number, optional
        Where φ and ψ are counted from [rad]; φ₀ is by default that of the axis, in (−π, π].

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
    return Enclosure(reduced_from_axis(e, l, g, kappa, phi0, psi0), digits, limit)
