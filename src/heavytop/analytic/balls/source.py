"""Sources: the exact numbers that a motion is computed from, and proofs that some of them are 0.

A ball can show that a number is not 0, and never that it is. What a source proves is which of

    g, u̇₀, P₋, P₊, f₁ (`pull`), h − g (`over_top`), h + g (`over_bottom`)

are exactly 0: for a scene by the algebra of exact numbers, for the binary numbers of the axis form
by rational arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Final, Protocol

from flint import arb, fmpq

from heavytop.analytic.balls.reduced import Reduced
from heavytop.errors import Impossible, Unseparated
from heavytop.numbers import ONE, PI, Exact, Number, cos
from heavytop.numbers.ball import Ball, above
from heavytop.scene.state import State
from heavytop.scene.top import Top

_MANY_BITS: Final = 4096  # as many as the exact numbers try


class Source(Protocol):
    """What enclosures are computed from."""

    @property
    def inverted(self) -> bool:
        """Whether g < 0."""

    def reduced(self, bits: int) -> Reduced:
        """The motion in balls of so many bits, which must be flint's working precision."""

    def vanishes(self, name: str) -> bool:
        """Whether the number of that name is exactly 0."""


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
        decided = _SCENE_TESTS[name]
        x = decided(self)
        if (sign := x.sign()) is None:
            raise _unproved(name, x)
        return sign == 0

    @property
    def _two_kinetic(self) -> Exact:
        start, u = self.start, self.u0
        return start.thetadot**2 + start.phidot**2 * (ONE - u) * (ONE + u)

    @property
    def _pull(self) -> Exact:
        """f₁ over −2 sin²θ₀/A where θ̇₀ = 0; on a pole it vanishes with θ̇₀."""
        top, start, u = self.top, self.start, self.u0
        if u in (1, -1):
            return start.thetadot
        turning = top.A * u * start.phidot - top.C * start.omega3
        return turning * start.phidot + top.gMR


_SCENE_TESTS: Final[dict[str, Callable[[FromScene], Exact]]] = {
    "g": lambda s: s.top.gMR,
    "udot0": lambda s: s.start.thetadot * (ONE - s.u0) * (ONE + s.u0),
    "P_minus": lambda s: (
        (ONE - s.u0) * (s.top.A * s.start.phidot * (ONE + s.u0) - s.top.C * s.start.omega3)
    ),
    "P_plus": lambda s: (
        (ONE + s.u0) * (s.top.A * s.start.phidot * (ONE - s.u0) + s.top.C * s.start.omega3)
    ),
    "pull": lambda s: s._pull,
    "over_top": lambda s: s.top.A * s._two_kinetic - 2 * s.top.gMR * (ONE - s.u0),
    "over_bottom": lambda s: s.top.A * s._two_kinetic + 2 * s.top.gMR * (ONE + s.u0),
}


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
        rho = _ball(self.rho2).sqrt()
        u0, sin2 = _ball(self.z) / rho, _ball(self.sin2)
        far = 1 + abs(u0)
        above, below = (sin2 / far, far) if self.z > 0 else (far, sin2 / far)
        return Reduced(
            _ball(self.g) * rho, _ball(self.dot) / rho, u0, above, below, _ball(self.cross) / rho,
            _ball(self.drift0), _ball(self.kinetic0), _ball(self.kappa),
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


def _unproved(name: str, x: Exact) -> Unseparated:
    near = x.ball(_MANY_BITS)
    bound = Ball.of(abs(near)).upper if near.is_finite() else math.inf
    told = f"less than {above(bound)} with {_MANY_BITS} bits"
    return Unseparated(f"{name} is {told}, and could not be proved to be 0", bound)


def _rational(name: str, value: Number) -> Fraction:
    q = Exact.of(value).fraction
    if q is None:
        raise Impossible([(name, "rational numbers")])
    return q


def _ball(q: Fraction) -> arb:
    return arb(fmpq(q.numerator, q.denominator))
