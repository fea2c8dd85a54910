"""The formulas of the closed form, each once, for balls and for arrays of doubles.

The argument z of the theta functions is counted from the nearest turning point, √(1 ∓ u) is
√(least² + swing² x²) with x = cn or sn, without cancellation, and Φ± is a multiple of the time, a
step for each turning point, and a sweep since the nearest one. Where P± = 0 the pass is exact and
the sweep a jump: φ jumps by +π as time goes forward, ψ by −π at θ = 0 and by +π at θ = π.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from flint import arb

from heavytop.analytic import balls
from heavytop.analytic.constants import Constants
from heavytop.analytic.roots import root_of
from heavytop.exact.decimals import Context, Number, binary, context
from heavytop.scene.quantities import quantity_of, values_of

if TYPE_CHECKING:
    from heavytop.analytic.motion import ClosedForm


SLOWEST_RATE: Final = 1e-300  # rad/s: rates need no digits below it, where there is no period


class Form:
    """The closed form of one motion; called with a time, or an array of times, it gives a `Point`.

    Its numbers, and those of its points, are computed when they are first read; balls at the
    precision of the constants, which must be the working precision.

    Parameters
    ----------
    constants : Constants
        The constants of the motion.
    N : {balls, doubles}
        The module with its arithmetic.
    """

    def __init__(self, constants: Constants, N: Any) -> None:
        self.c, self.N, c = constants, N, constants
        self._series: dict[Any, Any] = {}
        self.w, self.m, self.delta = map(N.number, (c.w, c.m, c.delta))
        kappa, b = c.start.kappa, c.start.b
        self.kappa, self.omega3 = (N.number(x, abs(b)) for x in (kappa, kappa + b))
        self.swing = N.number(root_of(c.delta))
        self.nearest = N.nearest(c, N.linear(c.x0, -c.half, c.rate))
        # least values, seen with g ≥ 0, of 1 − u and 1 + u, and (root, value, whether it is 0)
        self.least = c.upper[0], c.lower[1]
        self.poles = [(N.number(root_of(x)), N.number(x), x.is_zero()) for x in self.least]

    def __call__(self, t: Any) -> Point:
        """The point at a time, a ball, or at times, a pair of arrays (high and low words)."""
        return Point(self, t)

    def series(self, name: str, upper: bool, which: int) -> Any:
        """A series beside u₁ or u₂, made when it is first needed."""
        key = name, upper, which
        if key not in self._series:
            build = self.c.sweep if name == "sweep" else self.c.theta.function
            self._series[key] = build(self.N, upper, which)
        return self._series[key]

    @cached_property
    def angles(self) -> list[Callable[..., Any]]:
        """Functions for φ and ψ of number of turning point, time, and sweeps since that point."""
        c, (plus, minus) = self.c, self.c.halves
        one, other = (self._sweep_at_start(which) for which in (0, 1))
        slowest = arb(SLOWEST_RATE) if c.period is None else 1 / c.period

        def combine(angle: arb, rate: arb, a: int, b: int) -> Any:
            """The angle plus a Φ₊ + b Φ₋, without sweeps."""
            start, step = angle - (a * one + b * other), a * plus.step + b * minus.step
            return self.N.linear(start, step, rate + a * plus.rate + b * minus.rate, slowest)

        phi, psi = c.angles
        return [combine(phi, arb(0), 1, 1), combine(psi, c.start.kappa, c.side, -c.side)]

    def _sweep_at_start(self, which: int) -> arb:
        """The sweep of Φ₊ or Φ₋ from the turning point nearest the start to the start."""
        c, half = self.c, self.c.halves[which]
        if c.x0.is_zero() and not half.jumps:
            return arb(0)
        sweep = c.sweep(balls, bool(c.first % 2), which)
        return arb(0) if sweep is None else sweep(*balls.argument(c.x0, c.theta.hyperbolic))

    @cached_property
    def rates(self) -> list[tuple[Any, Any]]:
        """For Φ₋ and Φ₊ (rate, None) where P∓ = 0, the rate being 0 except on a pole.

        Else (None, slope): the slope is ½ P∓ over the square root of the least 1 ∓ u.
        """
        number = self.N.number
        ends = zip(self.c.P[::-1], self.c.halves[::-1], self.least, strict=True)
        return [
            (number(arb(0) if half.jumps else half.rate), None)
            if P.is_zero()
            else (None, number(P / (2 * root_of(least))))
            for P, half, least in ends
        ]

    @cached_property
    def opposed(self) -> list[tuple[Any, Any]]:
        """φ̇ sin θ and sin θ at u₁ and at u₂, where P₊ and P₋ have opposite signs; else empty."""
        (plus, minus), ends, number = self.c.P, (self.c.lower, self.c.upper), self.N.number
        if not plus * minus < 0:
            return []
        sines = [(high * low).sqrt() for high, low in ends]
        turning = [plus * high + minus * low for high, low in ends]
        speeds = [x / (2 * sine) for x, sine in zip(turning, sines, strict=True)]
        size = abs(speeds[0]) + abs(speeds[1]) + SLOWEST_RATE
        return [(number(v, size), number(sine)) for v, sine in zip(speeds, sines, strict=True)]


class Point:
    """The top at one time or at many; each quantity is computed when it is first read."""

    def __init__(self, form: Form, t: Any) -> None:
        self.form, self.N, self.t, self.side = form, form.N, t, form.c.side
        self.turning, self.upper, self.z = form.nearest(t)

    def __getattr__(self, name: str) -> Any:
        if name not in FORMULAS:
            raise AttributeError(name)
        value = self.__dict__[name] = FORMULAS[name](self)
        return value


def _series(r: Point, name: str, which: int) -> Any:
    """The values of a series at z, from the nearest turning points; 0 where there is no series."""
    found = [(where, r.form.series(name, bool(upper), which), at) for where, upper, at in r.sides]
    parts = [(where, series(*at) if series else 0 * at[0]) for where, series, at in found]
    return r.N.join(r.upper, parts)


def _leg(r: Point, pole: int, x: Any, at_zero: int) -> tuple[Any, Any]:
    """√(1 ∓ u), seen with g ≥ 0, and the ratio of swing x to it; its sign at an exact pass."""
    least, square, passes = r.form.poles[pole]
    leg = r.form.swing * x
    if passes:
        return abs(leg), r.N.sign(x, at_zero)
    distance = r.N.length(least, square, leg)
    return distance, leg / distance


def _pole_rates(r: Point) -> tuple[Any, Any]:
    """The rates ½ P±/(1 ± u) of Φ₊ and Φ₋."""
    legs = zip(r.form.rates, r.form.poles, (r.top, r.bottom), strict=True)
    minus, plus = (
        rate if slope is None else slope * (pole[0] / leg[0]) / leg[0]
        for (rate, slope), pole, leg in legs
    )
    return plus, minus


def _phidot(r: Point) -> Any:
    """φ̇; where P± have opposite signs, of terms that do not cancel."""
    if not r.form.opposed:
        return r.rates[0] + r.rates[1]
    terms = zip(r.form.opposed, (r.cn, r.sn), strict=True)
    return sum(v * (sine * x / r.sine) * x for (v, sine), x in terms) / r.sine


def _uddot(r: Point) -> Any:
    """d² cos θ/dt²."""
    form, s, c, d = r.form, r.sn, r.cn, r.dn
    pull = form.delta * form.w * (d * d * (c * c - s * s) - form.m * (s * s * c * c))
    return 2 * r.side * form.w * pull


def _axis(r: Point) -> Any:
    """(sin θ sin φ, −sin θ cos φ, cos θ)."""
    sin, cos = r.nodes
    return r.sine * sin, -r.sine * cos, r.u


def _quaternion(r: Point) -> Any:
    """The attitude, body to space, scalar first."""
    sine, cosine = r.N.sqrt(r.one_minus_u / 2), r.N.sqrt(r.one_plus_u / 2)
    (s1, c1), (s2, c2) = (r.N.sin_cos(r.N.half_sum(*r.sums, sign)) for sign in (1, -1))
    return cosine * c1, sine * c2, sine * s2, cosine * s1


def _omega(r: Point) -> Any:
    """The angular velocity in space, ω₃ e + e × ė."""
    sin, cos = r.nodes
    across = (r.omega3 - r.phidot * r.u) * r.sine
    upright = r.omega3 * r.u + r.phidot * r.sine * r.sine
    return r.thetadot * cos + across * sin, r.thetadot * sin - across * cos, upright


FORMULAS: Final[Mapping[str, Callable[[Any], Any]]] = {
    "sides": lambda r: r.N.sides(r.upper, r.z, r.form.c.theta.hyperbolic),
    # of the elliptic functions the denominator and the three numerators
    "under": lambda r: _series(r, "function", 0),
    "sn": lambda r: _series(r, "function", 1) / r.under,
    "cn": lambda r: _series(r, "function", 2) / r.under,
    "dn": lambda r: _series(r, "function", 3) / r.under,
    "top": lambda r: _leg(r, 0, r.cn, -1),
    "bottom": lambda r: _leg(r, 1, r.sn, 1),
    "legs": lambda r: (r.top[0], r.bottom[0])[:: r.side],
    "theta": lambda r: 2 * r.N.atan2(*r.legs),
    "one_minus_u": lambda r: r.legs[0] * r.legs[0],
    "one_plus_u": lambda r: r.legs[1] * r.legs[1],
    "u": lambda r: r.N.cosine(r.one_minus_u, r.one_plus_u),
    "sine": lambda r: r.top[0] * r.bottom[0],
    "thetadot": lambda r: -2 * r.side * r.form.w * r.dn * r.top[1] * r.bottom[1],
    "udot": lambda r: -r.thetadot * r.sine,
    "uddot": _uddot,
    "rates": _pole_rates,
    "phidot": _phidot,
    "psidot": lambda r: r.form.kappa + r.side * (r.rates[0] - r.rates[1]),
    "swept": lambda r: (_series(r, "sweep", 0), _series(r, "sweep", 1)),
    "phi_sum": lambda r: r.form.angles[0](r.turning, r.t, r.swept[0] + r.swept[1]),
    "psi_sum": lambda r: r.form.angles[1](r.turning, r.t, r.side * (r.swept[0] - r.swept[1])),
    "sums": lambda r: (r.phi_sum, r.psi_sum),
    "phi": lambda r: r.N.to_number(r.phi_sum),
    "psi": lambda r: r.N.to_number(r.psi_sum),
    "phi_mod": lambda r: r.N.modulo_circle(r.phi_sum),
    "psi_mod": lambda r: r.N.modulo_circle(r.psi_sum),
    "nodes": lambda r: r.N.sin_cos(r.phi_sum),
    "axis": _axis,
    "quaternion": _quaternion,
    "omega3": lambda r: r.form.omega3 + 0 * r.turning,
    "omega": _omega,
}
"""The quantities of a point, each computed from others."""


# --- quantities in doubles or to any digits -----------------------------------------------------


Read = Callable[[str], Any]

BALL_SPARE_DIGITS: Final = 2  # of a ball, beyond the digits of the number
SHOWN_DIGITS: Final = 10  # of mpmath's precision, beyond the digits of the number
SHOWN_NAMES: Final = ("t", "theta", "phi", "psi")
RECORD_NAMES: Final = ("t", "energy", *FORMULAS)


class Record:
    """The top at one time or at many, each quantity computed when it is first read.

    Made by `Motion.at`: numbers are arrays of doubles, of the shape of the times, vectors with one
    axis more; or mpmath numbers, vectors tuples of them.

    Attributes
    ----------
    t : number
        Time since the start [s].
    theta, phi, psi : number
        Euler angles [rad]; φ and ψ continuous from the start, never reduced.
    phi_mod, psi_mod : number
        φ and ψ modulo 2π, to the digits they have even after 1e9 periods [rad].
    thetadot, phidot, psidot : number
        Their rates [rad/s].
    u, one_minus_u, one_plus_u, udot, uddot : number
        cos θ, 1 ∓ cos θ to their own digits, d cos θ/dt [s⁻¹] and d² cos θ/dt² [s⁻²].
    axis : vector of 3
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    quaternion : vector of 4
        The attitude, body to space, scalar first, continuous from the start.
    omega : vector of 3
        The angular velocity in space [rad/s].
    omega3, energy : number
        The constant angular velocity about the symmetry axis [rad/s], and E [J].

    Quantities that follow from these are attributes too, such as the `reaction` [N] of a top with
    mass and distance.
    """

    def __init__(self, read: Read, made: tuple[Any, ...]) -> None:
        self._read, self._made = read, made

    def __reduce__(self) -> tuple[Any, ...]:
        return self._made

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={getattr(self, name)}" for name in SHOWN_NAMES)
        return f"<Record: {shown}>"

    def __dir__(self) -> tuple[str, ...]:
        return RECORD_NAMES

    def __getattr__(self, name: str) -> Any:
        if name in RECORD_NAMES:
            value = self._read(name)
        elif quantity_of(name).of is not None:
            value = values_of(self, name, self._made[0].__self__)  # the motion that made the record
        else:
            raise AttributeError(name)
        self.__dict__[name] = value
        return value


def read_digits(motion: ClosedForm, t: Any, digits: int) -> Read:
    """The function from the name of a quantity to its value at a time, to so many digits."""
    ball = motion.reader(t, digits + BALL_SPARE_DIGITS)
    return lambda x: motion.energy(digits) if x == "energy" else to_mpf(ball(x), digits)


def to_mpf(found: Any, digits: int) -> Any:
    """A ball, a tuple of balls or None, as mpmath numbers with so many digits."""
    ctx = context(digits + SHOWN_DIGITS)
    return map_balls(lambda x: midpoint(ctx, x), found)


def midpoint(ctx: Context, ball: arb) -> Number:
    """The middle of a ball; 0 where the ball has no bit of accuracy."""
    return ctx.zero if ball.rel_accuracy_bits() <= 0 else binary(ctx, *ball.mid().man_exp())


def map_balls(number: Callable[[arb], Any], found: Any) -> Any:
    """Return a ball, a tuple or a dict with each ball replaced; anything else unchanged."""
    if isinstance(found, tuple):
        return tuple(map_balls(number, x) for x in found)
    if isinstance(found, dict):
        return {name: map_balls(number, x) for name, x in found.items()}
    return number(found) if isinstance(found, arb) else found
