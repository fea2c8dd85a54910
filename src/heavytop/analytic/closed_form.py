"""The closed form in mpmath numbers: midpoints of the balls of `solution`, each to its digits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from flint import arb

from heavytop.analytic.rising import Rising, one
from heavytop.analytic.solution import Asymptotic, Nutating, Record, Solution
from heavytop.classification.reduced import FromScene, Reduced
from heavytop.numbers.decimals import Context, Number, binary, context, number
from heavytop.numbers.intervals import working
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


@dataclass(frozen=True, slots=True)
class ExactRecord:
    """Where the top is and how it moves at one time, in mpmath numbers.

    Parameters
    ----------
    t : Number
        Time since the start [s].
    theta, phi, psi : Number
        Euler angles [rad]; φ and ψ continuous from the start, never reduced.
    thetadot, phidot, psidot : Number
        Their rates [rad/s].
    u, one_minus_u, one_plus_u, udot : Number
        cos θ, 1 ∓ cos θ to their own digits, and d cos θ/dt [s⁻¹].
    axis : tuple of 3 Number
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    n : int
        The period of the nutation, counted from the one whose u₁ is nearest the start.
    omega3, energy : Number
        What is constant: the angular velocity about the symmetry axis [rad/s], and E [J], which
        `Motion.at` knows; None where the moments are not known.
    """

    t: Number
    theta: Number
    phi: Number
    psi: Number
    thetadot: Number
    phidot: Number
    psidot: Number
    u: Number
    one_minus_u: Number
    one_plus_u: Number
    udot: Number
    axis: tuple[Number, Number, Number]
    n: int
    omega3: Number = None
    energy: Number = None

    @property
    def quaternion(self) -> tuple[Number, Number, Number, Number]:
        """The attitude, body to space, scalar first."""
        ctx = self.theta.context
        cosine, sine = (ctx.sqrt(x / 2) for x in (self.one_plus_u, self.one_minus_u))
        plus, minus = (self.phi + self.psi) / 2, (self.phi - self.psi) / 2
        return (
            cosine * ctx.cos(plus), sine * ctx.cos(minus),
            sine * ctx.sin(minus), cosine * ctx.sin(plus),
        )  # fmt: skip

    @property
    def omega(self) -> tuple[Number, Number, Number]:
        """The angular velocity in space [rad/s]: ω₃ along the axis, and e × ė."""
        ctx = self.theta.context
        sine = ctx.sqrt(self.one_minus_u * self.one_plus_u)
        across = (self.omega3 - self.phidot * self.u) * sine
        sin, cos = ctx.sin(self.phi), ctx.cos(self.phi)
        upright = self.omega3 * self.u + self.phidot * sine * sine
        return self.thetadot * cos + across * sin, self.thetadot * sin - across * cos, upright


class ClosedForm:
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
    asked for, by proof. ``tests/analytic/test_scene_accuracy.py`` holds them to ten times as many.

    Examples
    --------
    >>> from heavytop.scene.state import State
    >>> top, start = Top("3.28e-4", "6.6e-5", "0.0456"), State("0.1", phidot=-15, psidot=140)
    >>> form = ClosedForm(Rising(FromScene(top, start)), 30)
    >>> form.ctx.nstr(form(2).theta, 20), form.ctx.nstr(form.period, 20)
    ('0.42694370530965690245', '0.54289551818821995785')
    """

    def __init__(self, rising: Rising, digits: int = 50) -> None:
        self.rising, self.digits = rising, digits
        self.ctx: Context = context(digits + _SHOWN)

    def __reduce__(self) -> tuple[Any, ...]:
        return ClosedForm, (self.rising, self.digits)  # what was computed is not copied

    @cached_property
    def period(self) -> Number | None:
        """T [s], the period of θ; None where nothing nutates."""
        return self._number("the period", lambda found: found.period)

    @cached_property
    def precession(self) -> Number | None:
        """Δφ [rad] in one period; None where nothing nutates."""
        return self._number("the precession", lambda found: found.precession)

    @cached_property
    def spin(self) -> Number | None:
        """Δψ [rad] in one period; None where nothing nutates."""
        return self._number("the spin", lambda found: found.spin)

    @cached_property
    def relative_spin(self) -> Number | None:
        """Δψ − κT [rad] in one period, without what a fast spin brings by itself; or None."""
        return self._number("the spin", lambda found: found.relative_spin)

    @cached_property
    def tilts(self) -> tuple[Number, Number]:
        """θ [rad] between which it moves: at u₁ and at u₂, the same twice when it is steady."""
        one, other = self._numbers("a tilt", lambda found: found.tilts)
        return one, other

    @cached_property
    def nearest(self) -> tuple[Number, Number]:
        """How near the axis comes to the top and to the bottom [rad], each to its own digits."""

        def angles(found: Solution) -> tuple[arb, arb]:
            (high, low), (above, below) = found.path.turnings
            top, bottom = 2 * arb.atan2(above, below), 2 * arb.atan2(low, high)
            return (top, bottom) if found.side > 0 else (bottom, top)

        top, bottom = self._numbers("how near it comes to a pole", angles, _itself)
        return top, bottom

    @cached_property
    def roots(self) -> tuple[Number, ...]:
        """The roots cos θ of the cubic, increasing; the infinite one is missing if gMR = 0."""
        return self._numbers("a root", lambda found: found.cosines)

    @cached_property
    def mean_rates(self) -> tuple[Number, Number]:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        plus, minus = self._numbers("a rate", lambda found: found.mean_rates)
        return plus, minus

    @cached_property
    def lower_turning(self) -> Number | None:
        """The time [s] of one passage of θ through u₁ (θ_max if gMR ≥ 0); others are T apart.

        Of an axis that tends to the vertical it is the only one; None where θ is constant.
        """
        return self._number("a turning point", lambda found: found.lower_turning)

    @cached_property
    def reversal(self) -> Number | None:
        """How long before and after each `lower_turning` φ̇ changes its sign [s]; None if never."""
        if self.rising.cusps:
            return None
        return self._number("a reversal", lambda found: found.reversal)

    @cached_property
    def modulus(self) -> tuple[Number, Number] | None:
        """The parameter m = k² of the elliptic functions and 1 − m; None where nothing nutates."""

        def parameters(found: Solution) -> tuple[arb, ...]:
            path = found.path
            return (path.roots.m, path.roots.mc) if isinstance(path, Nutating) else ()

        found = self._numbers("the modulus", parameters, _itself)
        return (found[0], found[1]) if found else None

    @cached_property
    def growth(self) -> Number | None:
        """The rate w [1/s] at which an axis tends to the vertical; None where it does not."""
        return self._number(
            "a rate", lambda found: found.path.w if isinstance(found.path, Asymptotic) else None
        )

    @cached_property
    def reduced(self) -> Reduced:
        """The motion in units A = 1."""
        bits = self.ctx.prec + 64
        with working(bits):
            return self.rising.source.reduced(bits).mapped(self._midpoint)

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
        time = number(self.ctx, t)
        if lost := self.rising.lost(float(time)):  # exact numbers are evaluated to more digits
            time = number(context(self.ctx.dps + lost), t)

        def seen(solution: Solution, _: int) -> tuple[Record, tuple[bool, bool]]:
            return solution.at(arb(time)), solution.avoids

        def balls(both: tuple[Record, tuple[bool, bool]]) -> tuple[arb, ...]:
            *angles, thetadot, phidot, psidot = both[0].numbers
            apart = [x / x.mid() for x, off in zip(both[0].distances, both[1], strict=True) if off]
            return *angles, thetadot / slow, phidot / slow, psidot / slow, *apart

        found: Record = self.rising.settled(
            "the motion", seen, self.digits + _SPARE, of=balls, lost=lost
        )[0]
        mid = self._midpoint
        theta, phi, psi, thetadot, phidot, psidot = map(mid, found.numbers)
        x, y, z = map(mid, found.axis)
        return ExactRecord(
            self.ctx.make_mpf(time._mpf_), theta, phi, psi, thetadot, phidot, psidot,
            mid(found.u), mid(found.one_minus_u), mid(found.one_plus_u), mid(found.udot),
            (x, y, z), found.n, mid(found.omega3),
        )  # fmt: skip

    def _number(self, name: str, value: Callable[[Solution], arb | None]) -> Number | None:
        found = self.rising.settled(
            name, lambda solution, _: value(solution), self.digits + _SPARE, of=_present
        )
        return None if found is None else self._midpoint(found)

    def _numbers(
        self, name: str, value: Callable[[Solution], tuple[arb, ...]],
        size: Callable[[arb], arb] | None = one,
    ) -> tuple[Number, ...]:  # fmt: skip
        found = self.rising.settled(
            name, lambda solution, _: value(solution), self.digits + _SPARE, size=size
        )
        return tuple(map(self._midpoint, found))

    def _midpoint(self, ball: arb) -> Number:
        return midpoint(self.ctx, ball)


def constants(top: Top, start: State, digits: int = 60) -> Constants:
    """The constants E, E', p_φ, p_ψ of the motion of `top` from `start`, to so many digits."""
    bits, ctx = context(digits).prec + 64, context(digits)
    with working(bits):
        reduced = FromScene(top, start).reduced(bits)
        A, p_psi = top.A.ball(bits), (top.C * start.omega3).ball(bits)
        E_prime, p_phi = A * reduced.h, A * reduced.a
        balls = E_prime + p_psi * start.omega3.ball(bits) / 2, E_prime, p_phi, p_psi
        return Constants(*(midpoint(ctx, ball) for ball in balls))


def midpoint(ctx: Context, ball: arb) -> Number:
    """The middle of a ball; 0 where the ball cannot be told from it."""
    if ball.contains(0):
        return ctx.zero
    return binary(ctx, *ball.mid().man_exp())


def _itself(x: arb) -> arb:
    return abs(x.mid())


def _present(ball: arb | None) -> tuple[arb, ...]:
    return () if ball is None else (ball,)
