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
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Final, Protocol

from flint import arb

from heavytop.classification.signs import MOST_BITS, SceneSigns, UndecidedError, rational_ball
from heavytop.errors import Impossible, Unseparated
from heavytop.numbers import ONE, PI, Exact, Number, cos
from heavytop.numbers.ball import Ball, above
from heavytop.numbers.precision import working
from heavytop.scene.state import State
from heavytop.scene.top import Top

_FEW_BITS: Final = 128  # which decide nearly always


@dataclass(frozen=True, slots=True)
class Reduced:
    """One motion, every number a ball.

    Parameters
    ----------
    g, b : arb
        gMR/A [s⁻²] and p_ψ/A [s⁻¹].
    u0, one_minus_u0, one_plus_u0 : arb
        cos θ₀ and 1 ∓ cos θ₀; exact where the start is on a pole.
    udot0 : arb
        u̇₀ [s⁻¹]; exactly 0 where the start is known to be a turning point.
    drift0 : arb
        a − b u₀ = φ̇₀ sin²θ₀ [s⁻¹].
    kinetic0 : arb
        h − g u₀ = ½ (θ̇₀² + φ̇₀² sin²θ₀) [s⁻²].
    kappa : arb
        p_ψ (1/C − 1/A) [s⁻¹].
    """

    g: arb
    b: arb
    u0: arb
    one_minus_u0: arb
    one_plus_u0: arb
    udot0: arb
    drift0: arb
    kinetic0: arb
    kappa: arb

    @property
    def P_minus(self) -> arb:
        """P₋ = a − b [s⁻¹]: 0 where the axis can pass the top."""
        return self.drift0 - self.b * self.one_minus_u0

    @property
    def P_plus(self) -> arb:
        """P₊ = a + b [s⁻¹]: 0 where the axis can pass the bottom."""
        return self.drift0 + self.b * self.one_plus_u0

    @property
    def over_top(self) -> arb:
        """The energy to spare at the top, h − g [s⁻²]."""
        return self.kinetic0 - self.g * self.one_minus_u0

    @property
    def over_bottom(self) -> arb:
        """The energy to spare at the bottom, h + g [s⁻²]."""
        return self.kinetic0 + self.g * self.one_plus_u0

    @property
    def pull(self) -> arb:
        """f₁ = f'(u₀) = 2 ü₀ [s⁻²]."""
        across = self.g * self.one_minus_u0 * self.one_plus_u0
        return 2 * (self.drift0 * self.b - across - 2 * self.kinetic0 * self.u0)

    @property
    def cubic(self) -> tuple[arb, arb, arb, arb]:
        """f₃, f₂, f₁, f₀."""
        bend = 4 * self.g * self.u0 - 2 * self.kinetic0 - self.b * self.b
        return 2 * self.g, bend, self.pull, self.udot0 * self.udot0

    def mirrored(self) -> Reduced:
        """The motion seen from below: θ → π − θ, ψ → −ψ and so g → −g."""
        return Reduced(
            -self.g, -self.b, -self.u0, self.one_plus_u0, self.one_minus_u0, -self.udot0,
            self.drift0, self.kinetic0, -self.kappa,
        )  # fmt: skip


class Source(Protocol):
    """What enclosures are computed from."""

    @property
    def inverted(self) -> bool:
        """Whether g < 0."""

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls of so many bits, which must be flint's working precision."""

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0."""


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

    @classmethod
    def of(cls, source: Source) -> Regime:
        """What is exactly so of one motion.

        Raises
        ------
        Unseparated
            Some number could be neither told from 0 nor proved to be 0.
        """
        with working(_FEW_BITS):
            reduced = source.reduced(_FEW_BITS)
            weightless = _vanishes(source, reduced, "g")
            mirrored = source.inverted
            top, bottom = ("P_plus", "P_minus") if mirrored else ("P_minus", "P_plus")
            surplus = "over_bottom" if mirrored else "over_top"
            resting = _vanishes(source, reduced, "udot0")
            steady = resting and _vanishes(source, reduced, "pull")
            misses_top = not _vanishes(source, reduced, top)
            misses_bottom = not _vanishes(source, reduced, bottom)
            level = not (steady or misses_top) and _vanishes(source, reduced, surplus)
        return cls(mirrored, weightless, resting, steady, misses_top, misses_bottom, level)


def _vanishes(source: Source, reduced: Reduced, name: str) -> bool:
    ball = getattr(reduced, name)
    if ball.is_zero():
        return True
    return not (ball > 0 or ball < 0) and source.vanishes(name)


@dataclass(frozen=True)
class FromScene:
    """The exact numbers of a top and a start.

    Parameters
    ----------
    top : Top
    start : State
    """

    top: Top
    start: State

    def __reduce__(self) -> tuple[Any, ...]:
        return FromScene, (self.top, self.start)  # balls are not copied

    @cached_property
    def signs(self) -> SceneSigns:
        """What is proved of their signs; raises `UndecidedError` where some sign is not."""
        return SceneSigns(self.top, self.start)

    @cached_property
    def u0(self) -> Exact:
        """The cosine of θ₀; on a pole exactly ±1, however θ₀ is written."""
        if self.start.theta.sign() == 0:
            return ONE
        return -ONE if (PI - self.start.theta).sign() == 0 else cos(self.start.theta)

    @property
    def inverted(self) -> bool:
        """Whether g < 0."""
        return self.top.gMR.sign() == -1

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls of so many bits."""
        top, start = self.top, self.start
        A, C, gMR = (value.ball(bits) for value in (top.A, top.C, top.gMR))
        rates = start.thetadot, start.phidot, start.omega3
        thetadot, phidot, omega3 = (value.ball(bits) for value in rates)
        u0, above, below, sine = self._place(bits)
        b = C * omega3 / A
        across = phidot * sine
        return Reduced(
            gMR / A, b, u0, above, below, -sine * thetadot, across * sine,
            (thetadot * thetadot + across * across) / 2, omega3 - b,
        )  # fmt: skip

    def _place(self, bits: int) -> tuple[arb, arb, arb, arb]:
        """The numbers cos θ₀, 1 ∓ cos θ₀ and sin θ₀, exact where cos θ₀ is rational."""
        if self.u0.fraction is not None:
            u0 = self.u0.ball(bits)
            return u0, 1 - u0, 1 + u0, (1 - u0 * u0).sqrt()
        half = self.start.theta.ball(bits) / 2
        s, c = half.sin(), half.cos()
        return c * c - s * s, 2 * s * s, 2 * c * c, 2 * s * c

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0.

        Raises
        ------
        Unseparated
            That could be neither proved nor disproved.
        """
        try:
            return self.signs.sign_of(name) == 0
        except UndecidedError:
            raise self._unproved(name) from None

    def _unproved(self, name: str) -> Unseparated:
        with working(MOST_BITS):
            near = getattr(self.reduced(MOST_BITS), name)
            bound = Ball.of(abs(near)).upper if near.is_finite() else math.inf
        told = f"less than {above(bound)} with {MOST_BITS} bits"
        return Unseparated(f"{name} is {told}, and could not be proved to be 0", bound)


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

    Raises
    ------
    Impossible
        e is zero, or one of the numbers is not rational.
    """

    def __init__(
        self, e: Sequence[Number], l: Sequence[Number], g: Number, kappa: Number = 0  # noqa: E741
    ) -> None:  # fmt: skip
        x, y, z = (_rational("e", value) for value in e)
        lx, ly, lz = (_rational("l", value) for value in l)
        self.g, self.kappa = _rational("g", g), _rational("kappa", kappa)
        self.z, self.a = z, lz
        self.rho2 = x * x + y * y + z * z
        if not self.rho2:
            raise Impossible([("e", "not the zero vector")])
        self.dot = lx * x + ly * y + lz * z  # b ρ
        self.cross = lx * y - ly * x  # u̇₀ ρ
        self.sin2 = (x * x + y * y) / self.rho2
        self.drift0 = lz - self.dot * z / self.rho2
        self.kinetic0 = (lx * lx + ly * ly + lz * lz - self.dot**2 / self.rho2) / 2

    @property
    def inverted(self) -> bool:
        """Whether g < 0."""
        return self.g < 0

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls of the working precision."""
        rho = rational_ball(self.rho2).sqrt()
        u0, sin2 = rational_ball(self.z) / rho, rational_ball(self.sin2)
        far = 1 + abs(u0)
        above, below = (sin2 / far, far) if self.z > 0 else (far, sin2 / far)
        g, dot, cross, drift0, kinetic0, kappa = map(
            rational_ball,
            (self.g, self.dot, self.cross, self.drift0, self.kinetic0, self.kappa),
        )
        return Reduced(
            g * rho, dot / rho, u0, above, below, cross / rho, drift0, kinetic0, kappa
        )  # fmt: skip

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0."""
        if name in ("g", "udot0"):
            return not (self.g if name == "g" else self.cross)
        if name == "pull":
            energy = self.g * self.sin2 * self.rho2 + 2 * self.kinetic0 * self.z
            return self.drift0 * self.dot == energy
        if name in ("P_minus", "P_plus"):
            b = self.dot / self.rho2
            return self._surd_vanishes(self.a, -b if name == "P_minus" else b)
        h = self.kinetic0 + self.g * self.z
        return self._surd_vanishes(h, -self.g if name == "over_top" else self.g)

    def _surd_vanishes(self, p: Fraction, q: Fraction) -> bool:
        """Whether p + q ρ = 0."""
        return p * p == q * q * self.rho2 and p * q <= 0


def _rational(name: str, value: Number) -> Fraction:
    q = Exact.of(value).fraction
    if q is None:
        raise Impossible([(name, "rational numbers")])
    return q
