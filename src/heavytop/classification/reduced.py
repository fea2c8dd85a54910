"""The reduced motion of the axis: its constants as balls of any precision, and its regime.

In units A = 1, with g = gMR/A, a = p_φ/A, b = p_ψ/A, h = E'/A and u = cos θ,

    u̇² = f(u) = 2 (h − g u)(1 − u²) − (a − b u)²,   f(u₀ + d) = f₀ + f₁ d + f₂ d² + f₃ d³.

A ball can show that a number is not 0, and never that it is. A source proves which of

    g, u̇₀, P₋, P₊, f₁ (`pull`), h − g (`over_top`), h + g (`over_bottom`)

are exactly 0: for a scene by the algebra of exact numbers, for the binary numbers of the axis form
by rational arithmetic. With that the regime is known: steady, asymptotic or nutating.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from fractions import Fraction
from functools import partial
from typing import Any, Final, TypeAlias

from flint import arb, fmpq

from heavytop.classification import kinds
from heavytop.classification.signs import (
    MOST_BITS,
    SceneSigns,
    UndecidedError,
    ball_sign,
)
from heavytop.errors import Impossible, Unseparated
from heavytop.exact import Exact, Number, sqrt
from heavytop.exact.balls import Interval, above, rational_ball, working
from heavytop.exact.number import rational, rational_value
from heavytop.scene.arguments import wrong_type

Real: TypeAlias = Any

FEW_BITS: Final = 192  # which decide nearly always, and serve for 40 digits


@dataclass(frozen=True, slots=True)
class Reduced:
    """One motion, every number a ball; or a number of any other arithmetic.

    Parameters
    ----------
    g, b : Real
        gMR/A [s⁻²] and p_ψ/A [s⁻¹].
    u0, one_minus_u0, one_plus_u0 : Real
        cos θ₀ and 1 ∓ cos θ₀; exact where the start is on a pole.
    udot0 : Real
        u̇₀ [s⁻¹]; exactly 0 where the start is known to be a turning point.
    drift0 : Real
        a − b u₀ = φ̇₀ sin²θ₀ [s⁻¹].
    kinetic0 : Real
        h − g u₀ = ½ (θ̇₀² + φ̇₀² sin²θ₀) [s⁻²].
    kappa : Real
        p_ψ (1/C − 1/A) [s⁻¹].
    """

    g: Real
    b: Real
    u0: Real
    one_minus_u0: Real
    one_plus_u0: Real
    udot0: Real
    drift0: Real
    kinetic0: Real
    kappa: Real

    @property
    def a(self) -> Real:
        """Momentum about the vertical, p_φ/A [s⁻¹]."""
        return self.drift0 + self.b * self.u0

    @property
    def h(self) -> Real:
        """Energy without that of the spin, E'/A [s⁻²]."""
        return self.kinetic0 + self.g * self.u0

    @property
    def energy(self) -> Real:
        """E/A [s⁻²]."""
        return self.h + self.b * (self.kappa + self.b) / 2  # ω₃ = κ + b

    @property
    def sin2(self) -> Real:
        """sin²θ₀."""
        return self.one_minus_u0 * self.one_plus_u0

    @property
    def P_minus(self) -> Real:
        """P₋ = a − b [s⁻¹]: 0 where the axis can pass the top."""
        return self.drift0 - self.b * self.one_minus_u0

    @property
    def P_plus(self) -> Real:
        """P₊ = a + b [s⁻¹]: 0 where the axis can pass the bottom."""
        return self.drift0 + self.b * self.one_plus_u0

    @property
    def over_top(self) -> Real:
        """The energy to spare at the top, h − g [s⁻²]."""
        return self.kinetic0 - self.g * self.one_minus_u0

    @property
    def over_bottom(self) -> Real:
        """The energy to spare at the bottom, h + g [s⁻²]."""
        return self.kinetic0 + self.g * self.one_plus_u0

    @property
    def pull(self) -> Real:
        """f₁ = f'(u₀) = 2 ü₀ [s⁻²]."""
        turning = self.drift0 * self.b - 2 * self.kinetic0 * self.u0
        return 2 * (turning - self.g * self.sin2)

    @property
    def cubic(self) -> tuple[Real, Real, Real, Real]:
        """f₃, f₂, f₁, f₀."""
        bend = 4 * self.g * self.u0 - 2 * self.kinetic0 - self.b * self.b
        return 2 * self.g, bend, self.pull, self.udot0 * self.udot0

    @property
    def looping(self) -> Real:
        """H b − g a [s⁻³]: with P₊P₋ < 0, of the sign of b where φ̇ reverses, zero in cusps."""
        return self.kinetic0 * self.b - self.g * self.drift0

    def mapped(self, kind: Callable[[Real], Real]) -> Reduced:
        """The same in another arithmetic."""
        return Reduced(*(kind(getattr(self, field.name)) for field in fields(self)))

    def mirrored(self) -> Reduced:
        """The motion seen from below: θ → π − θ, ψ → −ψ and so g → −g."""
        return Reduced(
            -self.g, -self.b, -self.u0, self.one_plus_u0, self.one_minus_u0, -self.udot0,
            self.drift0, self.kinetic0, -self.kappa,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Regime:
    """What is exactly so of a motion; everything but `mirrored` is said of the motion with g ≥ 0.

    Parameters
    ----------
    mirrored : bool
        g < 0: the motion is looked at from below.
    weightless : bool
        g = 0.
    resting : bool
        u̇₀ = 0.
    steady : bool
        u̇₀ = ü₀ = 0, and so θ is constant.
    misses_top, misses_bottom : bool
        P₋ ≠ 0, P₊ ≠ 0.
    asymptotic : bool
        P₋ = 0 and h = g: the axis tends to the top.
    """

    mirrored: bool
    weightless: bool
    resting: bool
    steady: bool
    misses_top: bool
    misses_bottom: bool
    asymptotic: bool

    @property
    def name(self) -> str:
        """What θ does in the long run: "steady", "asymptotic" or "nutating"."""
        return "steady" if self.steady else "asymptotic" if self.asymptotic else "nutating"

    @classmethod
    def of(
        cls, source: MotionSource, proved: bool = True, reduced: Reduced | None = None
    ) -> Regime:
        """What is exactly so of one motion.

        What 4096 bits do not tell from 0, and what is not proved to be 0 either, is an error; or
        it counts as 0, if nothing has to be `proved`.

        Raises
        ------
        Unseparated
            Some number could be neither told from 0 nor proved to be 0.
        """
        start = reduced or source.reduced(FEW_BITS)
        mirrored = _negative(source, start)
        top, bottom = ("P_plus", "P_minus") if mirrored else ("P_minus", "P_plus")
        surplus = "over_bottom" if mirrored else "over_top"
        with working(FEW_BITS):
            zero = partial(_vanishes, source, start, proved)
            resting, weightless = zero("udot0"), zero("g")
            steady = resting and zero("pull")
            misses_top, misses_bottom = not zero(top), not zero(bottom)
            level = not (steady or misses_top) and zero(surplus)
        return cls(mirrored, weightless, resting, steady, misses_top, misses_bottom, level)


def vanishes(
    source: MotionSource, name: str, proved: bool = True, reduced: Reduced | None = None
) -> bool:
    """Whether a number of the reduced motion is exactly 0; what cannot be told is an error, or 0.

    Raises
    ------
    Unseparated
        It could be neither told from 0 nor proved to be 0, and has to be `proved`.
    """
    with working(FEW_BITS):
        return _vanishes(source, reduced or source.reduced(FEW_BITS), proved, name)


def _negative(source: MotionSource, reduced: Reduced) -> bool:
    """Whether V is highest below: g < 0, as far as that can be told."""
    if (sign := ball_sign(reduced.g)) is None:
        with working(MOST_BITS):
            sign = ball_sign(source.reduced(MOST_BITS).g)
    return sign == -1


def _vanishes(source: MotionSource, reduced: Reduced, proved: bool, name: str) -> bool:
    if (told := ball_sign(getattr(reduced, name))) is not None:
        return told == 0
    try:
        return source.vanishes(name)
    except Unseparated:
        if proved:
            raise
        return True


class FromScene(SceneSigns):
    """The exact numbers of a top and a start."""

    def _heights(self, bits: int) -> tuple[arb, arb, arb]:
        """cosθ, 1 − cosθ and 1 + cosθ: exact where they are rational, or from the half angle."""
        if self.start.theta.fraction or (q := self._cos.fraction) is None:
            return super()._heights(bits)
        u = rational_ball(q)
        return u, 1 - u, 1 + u

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls of so many bits."""
        x = self.balls(bits)
        sine, b = x.sin2.nonnegative_part().sqrt(), x.p_psi / x.A
        return Reduced(
            x.gMR / x.A, b, x.cos, x.one_minus_cos, x.one_plus_cos, -sine * x.thetadot,
            x.phidot * x.sin2, x.kinetic / (2 * x.A), x.omega3 - b,
        )  # fmt: skip

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad]; through a pole on which it starts the axis comes out beyond it."""
        start, pole = self.start, self.pole or 0
        angles = start.phi.ball(bits), start.psi.ball(bits)
        return _beyond(pole, *angles) if pole * (start.thetadot.sign() or 0) < 0 else angles

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0.

        Raises
        ------
        Unseparated
            That could be neither proved nor disproved.
        """
        # f₁ is asked for where u̇₀ = 0: on a pole it vanishes with θ̇₀
        factors = (kinds.THETA_RATE,) if name == "pull" and self.pole else _FACTORS[name]
        try:
            with working(FEW_BITS):
                return self.product(factors) == 0
        except UndecidedError:
            raise self._unproved(name) from None

    def _unproved(self, name: str) -> Unseparated:
        with working(MOST_BITS):
            near = getattr(self.reduced(MOST_BITS), name)
            bound = Interval.of(abs(near)).upper if near.is_finite() else math.inf
        size = f"less than {above(bound)} with {MOST_BITS} bits"
        return Unseparated(f"{name} is {size}, and could not be proved to be 0", bound)


_FACTORS: Final = {
    "g": (kinds.WEIGHT,),
    "udot0": (kinds.SINE, kinds.THETA_RATE),
    "drift0": (kinds.ACROSS,),
    "P_minus": (kinds.PASS_TOP,),
    "P_plus": (kinds.PASS_BOTTOM,),
    "pull": (kinds.SINE, kinds.STEADY),
    "over_top": (kinds.OVER_TOP,),
    "over_bottom": (kinds.OVER_BOTTOM,),
    "looping": (kinds.LOOPING,),
}
"""The numbers of `kinds` whose product a constant of the reduced motion is, but for its sign."""


class FromAxis:
    """The numbers of a motion in the axis form, ė = l × e, l̇ = g (−e_y, e_x, 0).

    |e| = ρ need not be 1: e/ρ is the axis of a top whose g is ρ times larger.

    Parameters
    ----------
    e, l : sequence of 3 number
        The axis, and the angular momentum divided by A [s⁻¹].
    g : number
        gMR/A [s⁻²].
    kappa : number
        κ = p_ψ (1/C − 1/A) [s⁻¹].
    phi0 : number, optional
        φ₀ [rad]; by default that of the axis, in (−π, π], or on a pole of where it moves to.
    psi0 : number
        ψ₀ [rad].

    Raises
    ------
    Impossible
        e is zero, or one of the numbers is not rational.
    """

    def __init__(
        self, e: Sequence[Number], l: Sequence[Number], g: Number, kappa: Number = 0,  # noqa: E741
        phi0: Number | None = None, psi0: Number = 0,
    ) -> None:  # fmt: skip
        self.phi0 = None if phi0 is None else _rational("phi0", phi0)
        self.psi0 = _rational("psi0", psi0)
        self.e, self.l = _vector("e", e), _vector("l", l)
        self.g, self.kappa = _rational("g", g), _rational("kappa", kappa)
        (x, y, z), (lx, ly, lz) = self.e, self.l
        self.rho2 = x * x + y * y + z * z
        if self.rho2 == 0:
            raise Impossible([("e", "not the zero vector")])
        self.dot = lx * x + ly * y + lz * z  # b ρ
        self.cross = lx * y - ly * x  # u̇₀ ρ
        self.sin2 = (x * x + y * y) / self.rho2
        self.drift0 = lz - self.dot * z / self.rho2
        self.kinetic0 = (lx * lx + ly * ly + lz * lz - self.dot * self.dot / self.rho2) / 2

    def _reduced(self, number: Callable[[fmpq], Real], rho: Real) -> Reduced:
        """The motion in an arithmetic, in which ρ is the root of `rho2`."""
        g, dot, z, cross, drift, kinetic, kappa = map(
            number,
            (self.g, self.dot, self.e[2], self.cross, self.drift0, self.kinetic0, self.kappa),
        )
        u = z / rho
        return Reduced(g * rho, dot / rho, u, 1 - u, 1 + u, cross / rho, drift, kinetic, kappa)

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls of the working precision."""
        found = self._reduced(arb, arb(self.rho2).sqrt())
        far = 1 + abs(found.u0)
        near = arb(self.sin2) / far
        above, below = (near, far) if self.e[2] > 0 else (far, near)
        return replace(found, one_minus_u0=above, one_plus_u0=below)

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad]; through a pole on which it starts the axis comes out beyond it."""
        (x, y, z), (lx, ly, _), psi = self.e, self.l, arb(self.psi0)
        on_pole, pole = x == y == 0, 1 if z > 0 else -1
        sine, cosine = (pole * ly, pole * lx) if on_pole else (x, -y)  # from ė = l × e
        if self.phi0 is None:
            return arb.atan2(arb(sine), arb(cosine)), psi
        phi = arb(self.phi0)
        back = on_pole and phi.cos() * cosine + phi.sin() * sine < 0
        return _beyond(pole, phi, psi) if back else (phi, psi)

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0."""
        exact = self._reduced(_exact, sqrt(_exact(self.rho2)))
        return bool(getattr(exact, name).sign() == 0)


@dataclass(frozen=True)
class FromConstants:
    """The motion with given constants through a tilt, all of them rational numbers.

    Parameters
    ----------
    exact : Reduced
        The motion in fractions, but for u̇₀.
    udot2 : Fraction
        u̇₀², of a motion that rises there; negative only by a rounding, at a turning point.
    falls : bool
        Whether the axis falls there instead.
    """

    exact: Reduced
    udot2: Fraction
    falls: bool = False

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls of the working precision."""
        speed = rational_ball(max(self.udot2, Fraction(0))).sqrt()
        return replace(self.exact.mapped(rational_ball), udot0=-speed if self.falls else speed)

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad], from which the angles are counted."""
        return arb(0), arb(0)

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0."""
        return self.udot2 <= 0 if name == "udot0" else not getattr(self.exact, name)


@dataclass(frozen=True)
class Through:
    """A motion moved by a rounding error, so that it passes exactly through given poles.

    Parameters
    ----------
    source : MotionSource
        The motion that passes beside them.
    top, bottom : bool
        Through which poles it passes.
    """

    source: MotionSource
    top: bool
    bottom: bool

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls, p_φ moved to ±p_ψ and the energy with it."""
        found = self.source.reduced(bits)
        b = arb(0) if self.top and self.bottom else found.b
        drift = b * found.one_minus_u0 if self.top else -b * found.one_plus_u0
        kinetic = found.kinetic0
        if not found.sin2.is_zero():
            kinetic = (found.udot0 * found.udot0 + drift * drift) / (2 * found.sin2)
        return replace(found, b=b, drift0=drift, kinetic0=kinetic)

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad]."""
        return self.source.angles(bits)

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0."""
        if (name == "P_minus" and self.top) or (name == "P_plus" and self.bottom):
            return True
        return self.source.vanishes(name)


MotionSource: TypeAlias = FromScene | FromAxis | FromConstants | Through
"""What enclosures are computed from: `reduced` gives the motion in balls of so many bits, which
must be the working precision, `angles` φ₀ and ψ₀ [rad], on a pole those on the side towards which
the axis moves, and `vanishes` whether the number of a name is exactly 0."""


def _beyond(pole: int, phi: arb, psi: arb) -> tuple[arb, arb]:
    """The angles of the same place on a pole, seen from the other side."""
    return phi + arb.pi(), psi - pole * arb.pi()


def _exact(q: fmpq) -> Exact:
    return rational(Fraction(int(q.p), int(q.q)))  # of any size


def _vector(name: str, value: Sequence[Number]) -> list[fmpq]:
    if isinstance(value, str) or not isinstance(value, Iterable):
        raise wrong_type(name, "three numbers", value)
    try:
        x, y, z = value
    except (TypeError, ValueError):  # an array of no dimension, or of another length
        raise Impossible([(name, "three numbers")]) from None
    return [_rational(name, each) for each in (x, y, z)]


def _rational(name: str, value: Number) -> fmpq:
    # of a run: a component of the axis may be of any size, unlike what a scene says
    q = Exact.of(value).fraction if isinstance(value, str | Exact) else rational_value(value)
    if q is None:
        raise Impossible([(name, "rational numbers")])
    return fmpq(q.numerator, q.denominator)
