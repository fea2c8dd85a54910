"""The reduced motion of the axis: its constants as balls of any precision, and its regime.

In units A = 1, with g = gMR/A, a = p_φ/A, b = p_ψ/A, h = E'/A and u = cos θ,

    u̇² = f(u) = 2 (h − g u)(1 − u²) − (a − b u)²,   f(u₀ + d) = f₀ + f₁ d + f₂ d² + f₃ d³.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any, Final, NamedTuple, TypeAlias

from flint import arb

from heavytop.exact import ONE, PI, Exact, Number, cos, sqrt
from heavytop.exact.balls import ball_of, bound_of, exact_of, fmpq_of, rational_ball, working
from heavytop.exact.number import Sign
from heavytop.scene.state import State
from heavytop.scene.top import Top

Real: TypeAlias = Any

FEW_BITS: Final = 192  # enough for nearly all signs, and for 40 digits
MOST_SIGN_BITS: Final = 4096  # as many as the exact numbers try


class Reduced(NamedTuple):
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
    def slope0(self) -> Real:
        """f₁ = f'(u₀) = 2 ü₀ [s⁻²]."""
        turning = self.drift0 * self.b - 2 * self.kinetic0 * self.u0
        return 2 * (turning - self.g * self.sin2)

    @property
    def cubic(self) -> tuple[Real, Real, Real, Real]:
        """f₃, f₂, f₁, f₀."""
        bend = 4 * self.g * self.u0 - 2 * self.kinetic0 - self.b * self.b
        return 2 * self.g, bend, self.slope0, self.udot0 * self.udot0

    @property
    def cusp_number(self) -> Real:
        """H b − g a [s⁻³]: with P₊P₋ < 0, of the sign of b where φ̇ reverses, zero in cusps."""
        return self.kinetic0 * self.b - self.g * self.drift0

    def mapped(self, kind: Callable[[Real], Real]) -> Reduced:
        """The same in another arithmetic."""
        return Reduced(*map(kind, self))

    def mirrored(self) -> Reduced:
        """The motion seen from below: θ → π − θ, ψ → −ψ and so g → −g."""
        return Reduced(
            -self.g, -self.b, -self.u0, self.one_plus_u0, self.one_minus_u0, -self.udot0,
            self.drift0, self.kinetic0, -self.kappa,
        )  # fmt: skip


class Regime(NamedTuple):
    """Which numbers of a motion are exactly 0; all but `mirrored` are of the motion with g ≥ 0.

    Parameters
    ----------
    mirrored : bool
        g < 0: the motion is seen upside down.
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
    def of(cls, source: ReducedMotion, start: Reduced, zero: Callable[[str], bool]) -> Regime:
        """The regime of a motion with these balls; `zero` tells which numbers vanish, by name."""
        mirrored = source.sign(attrgetter("g"), start) == -1
        top, bottom = ("P_plus", "P_minus") if mirrored else ("P_minus", "P_plus")
        surplus = "over_bottom" if mirrored else "over_top"
        resting, weightless = zero("udot0"), zero("g")
        steady = resting and zero("slope0")
        misses_top, misses_bottom = not zero(top), not zero(bottom)
        level = not (steady or misses_top) and zero(surplus)
        return cls(mirrored, weightless, resting, steady, misses_top, misses_bottom, level)


class ReducedMotion:
    """A motion in balls of any precision, and in exact numbers.

    A ball can show that a number is not 0, and never that it is: exact numbers prove that.
    """

    def reduced(self, bits: int | None) -> Reduced:
        """The motion in balls of so many bits, the working precision; of None, exact."""
        raise NotImplementedError

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad]; on a pole those on the side towards which the axis moves."""
        return arb(0), arb(0)

    @cached_property
    def exact(self) -> Reduced:
        """The motion in exact numbers."""
        return self.reduced(None)

    def sign(self, number: Callable[[Reduced], Real], balls: Reduced) -> Sign | None:
        """The sign of one of its numbers, by balls of the working precision or by exact numbers.

        None where it is neither separated from 0 nor proved to be 0.
        """
        side = ball_sign(number(balls))
        return number(self.exact).sign() if side is None else side

    def bound(self, number: Callable[[Reduced], Real]) -> tuple[str, float]:
        """A bound of the size of one of its numbers, as a text and as a double."""
        with working(MOST_SIGN_BITS):
            return bound_of(number(self.reduced(MOST_SIGN_BITS)))


def ball_sign(ball: arb) -> Sign | None:
    """The sign that every number of a ball has, or None; a ball that is the number 0 has 0."""
    if ball > 0:
        return 1
    if ball < 0:
        return -1
    return 0 if ball.is_zero() else None


# --- of a top and a start ------------------------------------------------------------------------


class StartMotion(ReducedMotion):
    """The motion of a top and a start; balls of numbers that are proved to be 0 are exact."""

    def __init__(self, top: Top, start: State) -> None:
        self.top, self.start = top, start
        self._zeros: dict[str, bool] = {}

    def reduced(self, bits: int | None) -> Reduced:
        """The motion in balls of so many bits, or in exact numbers."""
        top, start = self.top, self.start
        given: list[Any] = [top.A, top.C, top.gMR, start.thetadot, start.phidot, start.spin]
        if bits is not None:
            given = [ball_of(value) for value in given]
        A, C, gMR, thetadot, phidot, spin = given
        u, below, above = self._heights(bits)
        omega3 = spin + phidot * u if start.held == "psidot" else spin
        if bits is not None:
            balls = {"gMR": gMR, "thetadot": thetadot, "phidot": phidot, "omega3": omega3}
            gMR, thetadot, phidot, omega3 = map(self._proved_zero, balls, balls.values())
        udot = thetadot if thetadot == 0 else -root_of(below * above) * thetadot
        return reduced_numbers(A, C, gMR, (u, below, above), thetadot, phidot, omega3, udot)

    def _proved_zero(self, name: str, ball: arb) -> arb:
        """The ball of a number, 0 itself where it is proved to be 0."""
        if name not in self._zeros:
            side = ball_sign(ball)
            if side is None:
                side = getattr(self.top if name == "gMR" else self.start, name).sign()
            self._zeros[name] = side == 0
        return arb(0) if self._zeros[name] else ball

    def _heights(self, bits: int | None) -> tuple[Real, Real, Real]:
        """cosθ, 1 − cosθ and 1 + cosθ: exact where they are rational, or from the half angle."""
        theta = self.start.theta
        if bits is None:
            return self._cos, ONE - self._cos, ONE + self._cos
        if theta.fraction or (q := self._cos.fraction) is None:
            s, c = (ball_of(theta) / 2).sin_cos()
            return c * c - s * s, 2 * s * s, 2 * c * c
        u = rational_ball(q)
        return u, 1 - u, 1 + u

    @cached_property
    def _cos(self) -> Exact:
        """cosθ; ±1 on a pole, however θ is written."""
        return {1: ONE, -1: -ONE}[self._pole] if self._pole else cos(self.start.theta)

    @cached_property
    def _pole(self) -> int:
        """1 where the axis is proved to start pointing up, −1 where down; else 0."""
        theta = self.start.theta
        if theta.fraction:  # π is irrational
            return 0
        return next((pole for pole, x in ((1, theta), (-1, PI - theta)) if x.sign() == 0), 0)

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad]."""
        start, pole = self.start, self._pole
        angles = start.phi.ball(bits), start.psi.ball(bits)
        return _opposite_side(pole, *angles) if pole * (start.thetadot.sign() or 0) < 0 else angles


def reduced_numbers(
    A: Real, C: Real, gMR: Real, heights: tuple[Real, Real, Real],
    thetadot: Real, phidot: Real, omega3: Real, udot: Real,
) -> Reduced:  # fmt: skip
    """The motion of numbers of any arithmetic; `heights` are cosθ, 1 − cosθ and 1 + cosθ."""
    u, below, above = heights
    across, b = phidot * (below * above), C / A * omega3
    kinetic = (thetadot * thetadot + phidot * across) / 2
    return Reduced(gMR / A, b, u, below, above, udot, across, kinetic, omega3 - b)


def root_of(square: Real) -> Real:
    """The root of a number that is not negative."""
    return sqrt(square) if isinstance(square, Exact) else square.nonnegative_part().sqrt()


# --- of an axis and its angular momentum ---------------------------------------------------------


class AxisMotion(ReducedMotion):
    """The motion of numbers in the axis form, ė = l × e, l̇ = g (−e_y, e_x, 0).

    |e| = ρ need not be 1: e/ρ is the axis of a top whose g is ρ times larger.

    Parameters
    ----------
    e, l : iterable of 3 number
        The axis, which is not 0, and the angular momentum divided by A [s⁻¹]; all are rational.
    g : number
        gMR/A [s⁻²].
    kappa : number
        κ = p_ψ (1/C − 1/A) [s⁻¹].
    phi0, psi0 : number
        φ₀ and ψ₀ [rad].
    """

    def __init__(
        self, e: Iterable[Number], l: Iterable[Number], g: Number, kappa: Number = 0,  # noqa: E741
        phi0: Number = 0, psi0: Number = 0,
    ) -> None:  # fmt: skip
        (x, y, z), (lx, ly, lz) = self.vectors = [[*map(fmpq_of, vector)] for vector in (e, l)]
        self.start = fmpq_of(phi0), fmpq_of(psi0)
        self.rho2 = rho2 = x * x + y * y + z * z
        dot, sin2 = lx * x + ly * y + lz * z, (x * x + y * y) / rho2
        kinetic = (lx * lx + ly * ly + lz * lz - dot * dot / rho2) / 2
        self.numbers = Reduced(  # as if |e| were 1; of its heights it has sin²θ
            fmpq_of(g), dot, z, sin2, sin2, lx * y - ly * x, lz - dot * z / rho2, kinetic,
            fmpq_of(kappa),
        )  # fmt: skip

    def reduced(self, bits: int | None) -> Reduced:
        """The motion of e/ρ."""
        number = exact_of if bits is None else arb
        q, rho = self.numbers.mapped(number), root_of(number(self.rho2))
        u = q.u0 / rho
        size = -u if self.numbers.u0 < 0 else u
        far = 1 + size
        near = 1 - size if bits is None else q.one_minus_u0 / far  # no digit cancels
        above, below = (near, far) if self.numbers.u0 > 0 else (far, near)
        return q._replace(
            g=q.g * rho, b=q.b / rho, u0=u, one_minus_u0=above, one_plus_u0=below,
            udot0=q.udot0 / rho,
        )  # fmt: skip

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad]."""
        ((x, y, z), (lx, ly, _)), (phi, psi) = self.vectors, map(arb, self.start)
        pole = 1 if z > 0 else -1
        back = x == y == 0 and pole * (phi.cos() * lx + phi.sin() * ly) < 0  # from ė = l × e
        return _opposite_side(pole, phi, psi) if back else (phi, psi)


# --- of constants, and through poles -------------------------------------------------------------


@dataclass(frozen=True)
class ConstantMotion(ReducedMotion):
    """The motion of constants that are fractions, with φ = ψ = 0 at the start."""

    constants: Reduced

    def reduced(self, bits: int | None) -> Reduced:
        """The motion in balls or exact numbers."""
        return self.constants.mapped(exact_of if bits is None else rational_ball)


@dataclass(frozen=True)
class PassingMotion(ReducedMotion):
    """A motion changed by a rounding error, so that it passes exactly through given poles.

    p_φ becomes ±p_ψ, and the energy changes with it.
    """

    source: ReducedMotion
    top: bool
    bottom: bool

    def reduced(self, bits: int | None) -> Reduced:
        """The motion in balls or exact numbers."""
        found = self.source.reduced(bits)
        b = found.b * 0 if self.top and self.bottom else found.b
        drift = b * found.one_minus_u0 if self.top else -b * found.one_plus_u0
        kinetic = found.kinetic0
        if self.source.exact.sin2.sign() != 0:
            kinetic = (found.udot0 * found.udot0 + drift * drift) / (2 * found.sin2)
        return found._replace(b=b, drift0=drift, kinetic0=kinetic)

    def angles(self, bits: int) -> tuple[arb, arb]:
        """φ₀ and ψ₀ [rad]."""
        return self.source.angles(bits)


def _opposite_side(pole: int, phi: arb, psi: arb) -> tuple[arb, arb]:
    """The angles of the same attitude on a pole, where the axis leaves to the other side."""
    return phi + arb.pi(), psi - pole * arb.pi()
