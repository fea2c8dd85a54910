"""The reduced motion of the axis: its constants as balls of any precision, and its regime.

In units A = 1, with g = gMR/A, a = p_φ/A, b = p_ψ/A, h = E'/A and u = cos θ,

    u̇² = f(u) = 2 (h − g u)(1 − u²) − (a − b u)²,   f(u₀ + d) = f₀ + f₁ d + f₂ d² + f₃ d³.
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
from heavytop.numbers import Exact, Number, normal_form, sqrt
from heavytop.numbers.exact import rational_value
from heavytop.numbers.intervals import Interval, above, rational_ball, working
from heavytop.scene.arguments import wrong_type
from heavytop.scene.state import State
from heavytop.scene.top import Top

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
        cls, source: ReducedMotion, proved: bool = True, reduced: Reduced | None = None
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
        if (side := ball_sign(start.g)) is None:
            with working(MOST_BITS):
                side = ball_sign(source.reduced(MOST_BITS).g)
        mirrored = side == -1
        top, bottom = ("P_plus", "P_minus") if mirrored else ("P_minus", "P_plus")
        surplus = "over_bottom" if mirrored else "over_top"
        zero = partial(vanishes, source, proved=proved, reduced=start)
        resting, weightless = zero("udot0"), zero("g")
        steady = resting and zero("pull")
        misses_top, misses_bottom = not zero(top), not zero(bottom)
        level = not (steady or misses_top) and zero(surplus)
        return cls(mirrored, weightless, resting, steady, misses_top, misses_bottom, level)


@dataclass(frozen=True)
class ReducedMotion:
    """A motion in balls of any precision, with the proofs of what is exactly 0.

    A ball can show that a number is not 0, and never that it is.

    Parameters
    ----------
    reduced : callable
        The motion in balls of so many bits, which must be the working precision.
    angles : callable
        φ₀ and ψ₀ [rad] in balls; on a pole those on the side towards which the axis moves.
    is_zero : callable
        Whether the number of a name is exactly 0; None where that is neither proved nor disproved.
    """

    reduced: Callable[[int], Reduced]
    angles: Callable[[int], tuple[arb, arb]]
    is_zero: Callable[[str], bool | None]


def vanishes(
    source: ReducedMotion, name: str, proved: bool = True, reduced: Reduced | None = None
) -> bool:
    """Whether a number of the reduced motion is exactly 0; what cannot be told is an error, or 0.

    Raises
    ------
    Unseparated
        It could be neither told from 0 nor proved to be 0, and has to be `proved`.
    """
    with working(FEW_BITS):
        side = ball_sign(getattr(reduced or source.reduced(FEW_BITS), name))
    if side is not None:
        return side == 0
    zero = source.is_zero(name)
    if zero is not None or not proved:
        return zero is not False
    with working(MOST_BITS):
        near = getattr(source.reduced(MOST_BITS), name)
        bound = Interval.of(abs(near)).upper if near.is_finite() else math.inf
    size = f"less than {above(bound)} with {MOST_BITS} bits"
    raise Unseparated(f"{name} is {size}, and could not be proved to be 0", bound)


# --- of a scene ----------------------------------------------------------------------------------


def reduced_from_scene(top: Top, start: State) -> ReducedMotion:
    """The motion of the exact numbers of a top and a start."""
    signs = SceneSigns(top, start)
    return ReducedMotion(
        partial(_scene_numbers, signs), partial(_scene_angles, signs), partial(_scene_zero, signs)
    )


def _scene_numbers(signs: SceneSigns, bits: int) -> Reduced:
    x = signs.balls(bits)
    sine, b = x.sin2.nonnegative_part().sqrt(), x.p_psi / x.A
    return Reduced(
        x.gMR / x.A, b, x.u, x.one_minus_u, x.one_plus_u, -sine * x.thetadot,
        x.phidot * x.sin2, x.kinetic / (2 * x.A), x.omega3 - b,
    )  # fmt: skip


def _scene_angles(signs: SceneSigns, bits: int) -> tuple[arb, arb]:
    start, pole = signs.start, signs.pole or 0
    angles = start.phi.ball(bits), start.psi.ball(bits)
    return _beyond(pole, *angles) if pole * (start.thetadot.sign() or 0) < 0 else angles


def _scene_zero(signs: SceneSigns, name: str) -> bool | None:
    # f₁ is asked for where u̇₀ = 0: on a pole it vanishes with θ̇₀
    factors = (kinds.THETA_RATE,) if name == "pull" and signs.pole else _FACTORS[name]
    try:
        with working(FEW_BITS):
            return signs.product(factors) == 0
    except UndecidedError:
        return None


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


# --- of an axis and its angular momentum ---------------------------------------------------------


def reduced_from_axis(
    e: Sequence[Number], l: Sequence[Number], g: Number, kappa: Number = 0,  # noqa: E741
    phi0: Number | None = None, psi0: Number = 0,
) -> ReducedMotion:  # fmt: skip
    """The motion of numbers in the axis form, ė = l × e, l̇ = g (−e_y, e_x, 0).

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
    (x, y, z), (lx, ly, lz) = _vector("e", e), _vector("l", l)
    rho2 = x * x + y * y + z * z
    if rho2 == 0:
        raise Impossible([("e", "not the zero vector")])
    dot, sin2 = lx * x + ly * y + lz * z, (x * x + y * y) / rho2
    kinetic = (lx * lx + ly * ly + lz * lz - dot * dot / rho2) / 2
    numbers = Reduced(
        _rational("g", g), dot, z, sin2, sin2, lx * y - ly * x, lz - dot * z / rho2, kinetic,
        _rational("kappa", kappa),
    )  # fmt: skip
    phi = None if phi0 is None else _rational("phi0", phi0)
    return ReducedMotion(
        partial(_axis_numbers, numbers, rho2),
        partial(_axis_angles, (x, y, z), (lx, ly), phi, _rational("psi0", psi0)),
        partial(_axis_zero, numbers, rho2),
    )


def _divided(numbers: Reduced, rho: Real) -> Reduced:
    """The motion of e/ρ, from that of e as if |e| were 1."""
    q, u = numbers, numbers.u0 / rho
    g, b, udot = q.g * rho, q.b / rho, q.udot0 / rho
    return Reduced(g, b, u, 1 - u, 1 + u, udot, q.drift0, q.kinetic0, q.kappa)


def _axis_numbers(numbers: Reduced, rho2: fmpq, _: int) -> Reduced:
    found = _divided(numbers.mapped(arb), arb(rho2).sqrt())
    far = 1 + abs(found.u0)
    near = arb(numbers.one_minus_u0) / far  # sin²θ, which is exact
    above, below = (near, far) if numbers.u0 > 0 else (far, near)
    return replace(found, one_minus_u0=above, one_plus_u0=below)


def _axis_zero(numbers: Reduced, rho2: fmpq, name: str) -> bool | None:
    side = getattr(_divided(numbers.mapped(_exact), sqrt(_exact(rho2))), name).sign()
    return None if side is None else side == 0


def _axis_angles(
    e: tuple[fmpq, ...], l: tuple[fmpq, ...], phi0: fmpq | None, psi0: fmpq, _: int,  # noqa: E741
) -> tuple[arb, arb]:  # fmt: skip
    (x, y, z), (lx, ly), psi = e, l, arb(psi0)
    on_pole, pole = x == y == 0, 1 if z > 0 else -1
    sine, cosine = (pole * ly, pole * lx) if on_pole else (x, -y)  # from ė = l × e
    if phi0 is None:
        return arb.atan2(arb(sine), arb(cosine)), psi
    phi = arb(phi0)
    back = on_pole and phi.cos() * cosine + phi.sin() * sine < 0
    return _beyond(pole, phi, psi) if back else (phi, psi)


# --- of constants, and through poles -------------------------------------------------------------


def reduced_from_constants(exact: Reduced, udot2: Fraction, falls: bool = False) -> ReducedMotion:
    """The motion with given constants through a tilt, from which its angles are counted.

    Parameters
    ----------
    exact : Reduced
        The motion in fractions, but for u̇₀.
    udot2 : Fraction
        u̇₀², of a motion that rises there; negative only by a rounding, at a turning point.
    falls : bool
        Whether the axis falls there instead.
    """
    udot2 = max(udot2, Fraction(0))
    zero = partial(_constant_zero, replace(exact, udot0=udot2))
    return ReducedMotion(partial(_constant_numbers, exact, udot2, falls), _no_angles, zero)


def _constant_numbers(exact: Reduced, udot2: Fraction, falls: bool, _: int) -> Reduced:
    speed = rational_ball(udot2).sqrt()
    return replace(exact.mapped(rational_ball), udot0=-speed if falls else speed)


def _constant_zero(exact: Reduced, name: str) -> bool:
    return not getattr(exact, name)


def _no_angles(_: int) -> tuple[arb, arb]:
    return arb(0), arb(0)


def through_poles(source: ReducedMotion, top: bool, bottom: bool) -> ReducedMotion:
    """The motion moved by a rounding error, so that it passes exactly through given poles.

    p_φ is moved to ±p_ψ, and the energy with it.
    """
    moved = partial(_passing_numbers, source, top, bottom)
    return replace(source, reduced=moved, is_zero=partial(_passing_zero, source, top, bottom))


def _passing_numbers(source: ReducedMotion, top: bool, bottom: bool, bits: int) -> Reduced:
    found = source.reduced(bits)
    b = arb(0) if top and bottom else found.b
    drift = b * found.one_minus_u0 if top else -b * found.one_plus_u0
    kinetic = found.kinetic0
    if not found.sin2.is_zero():
        kinetic = (found.udot0 * found.udot0 + drift * drift) / (2 * found.sin2)
    return replace(found, b=b, drift0=drift, kinetic0=kinetic)


def _passing_zero(source: ReducedMotion, top: bool, bottom: bool, name: str) -> bool | None:
    passed = (name == "P_minus" and top) or (name == "P_plus" and bottom)
    return passed or source.is_zero(name)


def _beyond(pole: int, phi: arb, psi: arb) -> tuple[arb, arb]:
    """The angles of the same place on a pole, seen from the other side."""
    return phi + arb.pi(), psi - pole * arb.pi()


def _exact(q: fmpq) -> Exact:
    return Exact(normal_form.rational(Fraction(int(q.p), int(q.q))))  # of any size


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
