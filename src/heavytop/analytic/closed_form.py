"""The closed form in mpmath numbers: midpoints of the balls of `solution`, each to its digits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from operator import itemgetter
from typing import Any, Final

from flint import arb

from heavytop.analytic.rising import MotionNumbers, Rising
from heavytop.analytic.solution import ExactRecord, Solution
from heavytop.classification.reduced import Reduced, ball_of, reduced_from_scene
from heavytop.exact.balls import working
from heavytop.exact.decimals import Context, Number, binary, context
from heavytop.scene.state import State
from heavytop.scene.top import Top

_SPARE: Final = 2  # digits that a ball has beyond those asked for
_SHOWN: Final = 10  # digits of the numbers handed out beyond those asked for


@dataclass(frozen=True, slots=True)
class Constants:
    """Energies E, E' = E − p_ψ²/2C and momenta p_φ, p_ψ.

    Parameters
    ----------
    E, E_prime : Number
        Energy, and energy without that of the spin [J].
    p_phi, p_psi : Number
        Momenta about the vertical and about the symmetry axis [kg m² s⁻¹].

    Notes
    -----
    They are numbers of many digits (mpmath's ``mpf``): ``float(constants.E)`` is one as a float,
    `floats` all of them, and an f-string shows as many digits as it asks for.
    """

    E: Number
    E_prime: Number
    p_phi: Number
    p_psi: Number

    def items(self) -> tuple[tuple[str, Number], ...]:
        """The four constants with their names."""
        names = ("E", "E_prime", "p_phi", "p_psi")
        return tuple((name, getattr(self, name)) for name in names)

    @property
    def floats(self) -> dict[str, float]:
        """The four constants as floats, by name."""
        return {name: float(value) for name, value in self.items()}


class ClosedForm(MotionNumbers[Number]):
    """The closed form of one motion at `digits` decimal digits; call it with a time.

    Parameters
    ----------
    rising : Rising
        The motion at any precision.
    digits : int
        Decimal digits wanted, relative to max(1, |x|), at any time; of rates in a motion slower
        than 1 rad/s relative to its fastest.

    Raises
    ------
    NoClosedForm
        By every property and by a call, when 65 536 bits do not give the digits.

    Notes
    -----
    Accuracy: each number is the midpoint of a ball that contains the true one and has the digits
    asked for, by proof. ``tests/analytic/test_motion.py`` holds them to ten times as many.

    Examples
    --------
    >>> from heavytop.scene.state import State
    >>> top, start = Top("3.28e-4", "6.6e-5", "0.0456"), State("0.1", phidot=-15, psidot=140)
    >>> form = ClosedForm(Rising(reduced_from_scene(top, start)), 30)
    >>> form.ctx.nstr(form(2).theta, 20), form.ctx.nstr(form.period, 20)
    ('0.42694370530965690245', '0.54289551818821995785')
    """

    def __init__(self, rising: Rising, digits: int = 50) -> None:
        self.rising, self.digits, self._digits = rising, digits, digits + _SPARE
        self.ctx: Context = context(digits + _SHOWN)

    def __reduce__(self) -> tuple[Any, ...]:
        return ClosedForm, (self.rising, self.digits)  # what was computed is not copied

    def _number(self, ball: arb) -> Number:
        return midpoint(self.ctx, ball)

    @cached_property
    def reduced(self) -> Reduced:
        """The motion in units A = 1."""
        bits = self.ctx.prec + 64
        with working(bits):
            return self.rising.source.reduced(bits).mapped(self._number)

    def __call__(self, t: Any) -> ExactRecord:
        """Where the top is at time `t` [s], a number of any kind.

        Raises
        ------
        NotANumber
            `t` is no finite number.
        NoClosedForm
            When 65 536 bits do not give the digits.
        """
        slow = arb(min(max(self.rising.rate, 1e-300), 1.0))  # rates less than 1 have their digits

        def seen(found: Solution, time: arb) -> tuple[ExactRecord, list[arb]]:
            at = found.at(time)
            rates = [rate / slow for rate in (at.thetadot, at.phidot, at.psidot)]
            distances = zip((at.one_minus_u, at.one_plus_u), found.avoids, strict=True)
            apart = [x / x.mid() for x, never_zero in distances if never_zero or not x.contains(0)]
            return at, [at.theta, at.phi, at.psi, *rates, *apart]

        found: ExactRecord = self._at("the motion", t, seen, of=itemgetter(1))[0]
        return found


def constants(top: Top, start: State, digits: int = 60) -> Constants:
    """The constants E, E', p_φ, p_ψ of the motion of `top` from `start`, to so many digits."""
    bits, ctx = context(digits).prec + 64, context(digits)
    with working(bits):
        reduced = reduced_from_scene(top, start).reduced(bits)
        balls = reduced.energy, reduced.h, reduced.a, reduced.b
        A = ball_of(top.A, bits)
        return Constants(*(midpoint(ctx, A * ball) for ball in balls))


def midpoint(ctx: Context, ball: arb) -> Number:
    """The middle of a ball; 0 where the ball cannot be told from it."""
    return ctx.zero if ball.rel_accuracy_bits() <= 0 else binary(ctx, *ball.mid().man_exp())
