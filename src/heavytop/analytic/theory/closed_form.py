"""The closed form at any number of digits: θ, φ, ψ at a time, the period and what turns in it.

Every kind of motion has one of three courses, each a module of its own: an axis that nods between
two turning points (`nodding`, with `halves` for φ and ψ), one that tends to the vertical
(`asymptotic`), and one that keeps its tilt (`steady_course`).

An exact pass through a pole makes φ jump by +π (as time goes forward); ψ then jumps by −π at
θ = 0, where φ + ψ is continuous, and by +π at θ = π, where φ − ψ is: axis and attitude stay smooth.
An axis that stays on the vertical keeps its φ, and ψ takes the whole spin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from heavytop.analytic.theory.asymptotic import Asymptotic
from heavytop.analytic.theory.course import NOTHING, Proved
from heavytop.analytic.theory.nodding import Nodding
from heavytop.analytic.theory.orbit import Orbit, orbit
from heavytop.analytic.theory.place import Place
from heavytop.analytic.theory.reduced import Reduced
from heavytop.analytic.theory.steady_course import Steady
from heavytop.errors import NoClosedForm
from heavytop.numbers.decimals import Number, number

__all__ = ["Asymptotic", "ExactRecord", "MPForm", "Nodding", "Orbit", "Steady", "orbit"]


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


FARTHEST = 1e20
"""Nutation periods up to which the digits are those asked for."""


class MPForm:
    """The closed form of one motion at `digits` decimal digits; call it with a time.

    Parameters
    ----------
    reduced : Reduced
        The motion. It is computed again at the precision the digits need.
    digits : int
        Decimal digits wanted; relative to max(1, |x|), for up to 1e20 periods.
    proved : Proved
        What is known of the motion from its exact numbers. The rest is told by a threshold.

    Raises
    ------
    NoClosedForm
        When 10 000 digits do not tell apart what is proved to differ.

    Notes
    -----
    Accuracy: the digits asked for agree with those of ten times as many on every shipped scene, by
    ``tests/analytic/test_scene_accuracy.py``; as near as 1e-150 to steady, sleeping, asymptotic
    and passing motions the equations of motion hold to 50 digits of 70, by
    ``tests/analytic/test_near_special_motions.py``.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> kicked = Reduced.from_angles(context(60), "3.28e-4", "6.6e-5", "0.0456", "0.1", 0, 0,
    ...                              0, -15, 140)
    >>> form = MPForm(kicked, 30)
    >>> form.ctx.nstr(form(2).theta, 20), form.ctx.nstr(form.period, 20)
    ('0.42694370530965690245', '0.54289551818821995785')
    """

    def __init__(self, reduced: Reduced, digits: int = 50, proved: Proved = NOTHING) -> None:
        self.digits = digits
        self.orbit = orbit(reduced, digits, proved)
        self.ctx = self.orbit.ctx
        self._reduced = reduced.refined(self.ctx)
        self._side = -1 if reduced.g < 0 else 1

    @property
    def period(self) -> Number | None:
        """T [s], the period of θ; None where nothing nutates."""
        return self.orbit.T if isinstance(self.orbit, Nodding) else None

    @property
    def precession(self) -> Number | None:
        """Δφ [rad] in one period; None where nothing nutates."""
        if not isinstance(self.orbit, Nodding):
            return None
        return self.orbit.turn_plus + self.orbit.turn_minus

    @property
    def spin(self) -> Number | None:
        """Δψ [rad] in one period; None where nothing nutates."""
        if not isinstance(self.orbit, Nodding):
            return None
        turned = self._side * (self.orbit.turn_plus - self.orbit.turn_minus)
        return self._reduced.kappa * self.orbit.T + turned

    @property
    def tilts(self) -> tuple[Number, Number]:
        """θ [rad] between which it moves: at u₁ and at u₂, the same twice when it is steady."""
        one, other = self.orbit.turnings
        return self._tilt(*one), self._tilt(*other)

    @property
    def mean_rates(self) -> tuple[Number, Number]:
        """Means of (φ + ψ)˙ − κ and (φ − ψ)˙ + κ [rad/s], without jumps at poles."""
        plus, minus = self.orbit.mean_rates
        return (2 * plus, 2 * minus) if self._side > 0 else (2 * minus, 2 * plus)

    @property
    def lower_turning(self) -> Number | None:
        """The time [s] of one passage of θ through u₁ (θ_max if gMR ≥ 0); others are T apart.

        Of an axis that tends to the vertical it is the only one; None where θ is constant.
        """
        if isinstance(self.orbit, Asymptotic):
            return -self.orbit.x0 / self.orbit.w
        return -self.orbit.t0 if isinstance(self.orbit, Nodding) else None

    @property
    def reversal(self) -> Number | None:
        """How long before and after each `lower_turning` φ̇ changes its sign [s]; None if never."""
        return self.orbit.reversal if isinstance(self.orbit, Nodding) else None

    def _tilt(self, above: Number, below: Number) -> Number:
        """θ [rad] from the upright 1 ∓ u."""
        if self._side < 0:
            above, below = below, above
        return 2 * self.ctx.atan2(self.ctx.sqrt(above), self.ctx.sqrt(below))

    def __call__(self, t: Any) -> ExactRecord:
        """Where the top is at time `t` [s], a number of any kind.

        Raises
        ------
        NoClosedForm
            Farther than 1e20 periods away, where the digits end.
        """
        ctx, start, side = self.ctx, self._reduced, self._side
        time = number(ctx, t)
        if self.period is not None and abs(time) > FARTHEST * self.period:
            raise NoClosedForm(f"t: more than {FARTHEST:g} periods away, where the digits end")
        place = self.orbit.place(time)
        above, below, rise, plus, minus, n = place
        theta = self._tilt(above, below)
        if side < 0:
            above, below = below, above
        phi = start.phi0 + (plus + minus)
        phidot, psidot = self._rates(place)
        sine = ctx.sqrt(above * below)
        u = 1 - above if above < below else below - 1
        return ExactRecord(
            time, theta, phi, start.psi0 + start.kappa * time + side * (plus - minus),
            -side * rise, phidot, psidot, u, above, below, side * rise * sine,
            (sine * ctx.sin(phi), -sine * ctx.cos(phi), u), n, start.kappa + start.b,
        )  # fmt: skip

    def _rates(self, place: Place) -> tuple[Number, Number]:
        """φ̇ and ψ̇."""
        start, path = self._reduced, self.orbit
        if isinstance(path, Steady):
            plus, minus = path.plus_rate, path.minus_rate
        else:
            plus = path.P_plus / (2 * place.one_plus_u) if path.P_plus else self.ctx.zero
            minus = path.P_minus / (2 * place.one_minus_u) if path.P_minus else self.ctx.zero
        return plus + minus, start.kappa + self._side * (plus - minus)
