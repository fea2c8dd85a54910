"""The effective potential of the tilt, and the curves of constant energy in the θ–θ̇ plane.

In units A = 1, without the constant energy p_ψ²/2C of the spin,

    V(θ) = ⅛ [P₊ tan(θ/2) + P₋ cot(θ/2)]² + g cos θ,     ½ θ̇² + V(θ) = h.

Written so, nothing cancels near the poles; where P₋ = 0 the top is a point like any other, and
where P₊ = 0 the bottom is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from heavytop.analytic.theory.course import Course, course, miss_of_bottom, miss_of_top, upright
from heavytop.analytic.theory.nutation import Nutation
from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import STANDARD_DIGITS, Number, context, threshold

Array = npt.NDArray[np.float64]

FAMILY = (0.25, 0.5, 0.75, 1.25, 1.5)
"""Amplitudes of the family of curves, beside that of the motion: the root of their energies."""

_GRID = 4097
_ZOOMS = 3
_AT_REST = 1e-12  # of the typical energy: what the place of the bottom is not known to


class Curve(NamedTuple):
    """One branch θ̇ ≥ 0 of a curve of constant energy; the other is its mirror image.

    Attributes
    ----------
    theta : ndarray, shape (k,)
        From the smallest tilt to the largest [rad].
    speed : ndarray, shape (k,)
        |θ̇| [rad/s]; zero at turning points, but not where the curve runs into a pole.
    """

    theta: Array
    speed: Array


@dataclass(frozen=True)
class Potential:
    """V(θ) at the momenta of one motion.

    Parameters
    ----------
    motion : Reduced
        The motion.

    Examples
    --------
    >>> from heavytop.numbers.decimals import context
    >>> r = Reduced.from_angles(context(30), 1, 1, 3, "pi/2", 0, 0, 0, 2, 0)
    >>> float(Potential(r)(np.pi / 2).round(12))
    2.0
    """

    motion: Reduced

    @cached_property
    def exact(self) -> Reduced:
        """The motion at 60 digits."""
        return self.motion.refined(context(STANDARD_DIGITS))

    @cached_property
    def momenta(self) -> tuple[float, float]:
        """P₊ and P₋ [1/s], exactly zero where they count as zero."""
        r, zero = self.exact, threshold(self.exact.ctx)
        plus = float(r.P_plus) if miss_of_bottom(r) > zero else 0.0
        minus = float(r.P_minus) if miss_of_top(r) > zero else 0.0
        return plus, minus

    def __call__(self, theta: npt.ArrayLike) -> Array:
        """V at the tilts θ [rad], of the same shape [1/s²]; vast or infinite at a pole
        that no energy reaches.
        """
        tilt = np.asarray(theta, dtype=np.float64)
        s, c = np.sin(tilt / 2), np.cos(tilt / 2)
        plus, minus = self.momenta
        with np.errstate(divide="ignore"):
            rise = np.divide(s, c) * plus if plus else np.zeros_like(tilt)
            fall = np.divide(c, s) * minus if minus else np.zeros_like(tilt)
        value: Array = (rise + fall) ** 2 / 8 + float(self.exact.g) * (c - s) * (c + s)
        return value

    @cached_property
    def bottom(self) -> float:
        """The tilt where V is least [rad], to about 1e-8; there is one such tilt."""
        low, high = 0.0, np.pi
        for _ in range(_ZOOMS):
            tilts = np.linspace(low, high, _GRID)
            least = int(np.argmin(self(tilts)))
            low, high = float(tilts[max(least - 1, 0)]), float(tilts[min(least + 1, _GRID - 1)])
        return float(tilts[least])

    @cached_property
    def least(self) -> Number:
        """V at `bottom`, at 60 digits [1/s²]."""
        at = self._resting
        return at.g * at.u0 + (at.drift0**2 / (2 * at.sin2) if at.sin2 else 0)

    @cached_property
    def excess(self) -> float:
        """How far the energy h of the motion is above the least [1/s²]; not below zero."""
        return max(0.0, float(self.exact.h - self.least))

    def turning(self, excess: float) -> Nutation | None:
        """The turning points of the motion so far above the least; None where nothing nutates.

        Parameters
        ----------
        excess : float
            Energy above the least one [1/s²].
        """
        if excess <= 0:
            return None
        through = self._through(self.least + excess)
        return Nutation.of(through) if course(through) is Course.NUTATING else None

    def curve(self, excess: float, points: int = 301) -> Curve | None:
        """The curve of the motion so far above the least energy; None where nothing nutates.

        Parameters
        ----------
        excess : float
            Energy above the least one [1/s²].
        points : int
            How many.
        """
        roots = self.turning(excess)
        return None if roots is None else curve(roots, points)

    @cached_property
    def spread(self) -> float:
        """The energy above the least that a picture has to show [1/s²].

        That of the motion, or of the separatrix if it is larger; where the tilt rests at the
        bottom, what carries it a third of the way to the nearer pole. Zero where V is constant.
        """
        room = max(min(self.bottom, np.pi - self.bottom), 0.5) / 3
        side = room if self.bottom < np.pi / 2 else -room
        typical = float(self(self.bottom + side)) - float(self.least)
        own = self.excess if self.excess > _AT_REST * typical else typical
        saddle = float(abs(self.exact.g) - self.least) if self.has_separatrix else 0.0
        return max(own, saddle, 0.0)

    def family(self, points: int = 301) -> tuple[Curve, ...]:
        """Curves at the momenta of the motion, their energies spaced about `spread`.

        Parameters
        ----------
        points : int
            Of each curve.
        """
        curves = (self.curve(amplitude**2 * self.spread, points) for amplitude in FAMILY)
        return tuple(each for each in curves if each is not None)

    @property
    def has_separatrix(self) -> bool:
        """Whether motions tend to the vertical: p_φ = p_ψ and p_ψ² < 4 A gMR, seen upright."""
        over = upright(self.exact)
        return bool(miss_of_top(over) <= threshold(over.ctx) and over.b**2 < 4 * over.g)

    def separatrix(self, points: int = 301) -> Curve | None:
        """The curve of the motions that tend to the vertical; None where there are none.

        They exist at p_φ = p_ψ for p_ψ² < 4 A gMR: there the upright top is unstable. Then

            θ̇ = 2 tan(θ/2) √(g (sin²(θₘ/2) − sin²(θ/2))),   cos²(θₘ/2) = b²/4g.

        Parameters
        ----------
        points : int
            How many.
        """
        if not self.has_separatrix:
            return None
        over = upright(self.exact)
        g, c2 = float(over.g), float(over.b**2 / (4 * over.g))
        s2 = float(1 - over.b**2 / (4 * over.g))
        alpha = np.linspace(0.0, np.pi / 2, points)
        sine, cosine = np.sin(alpha), np.sin(np.pi / 2 - alpha)
        below = np.sqrt(cosine**2 + c2 * sine**2)  # cos(θ/2); sin(θ/2) is √s2 sine
        ratio = np.divide(cosine, below, out=np.ones_like(below), where=below > 0)
        theta = 2 * np.arctan2(np.sqrt(s2) * sine, below)
        return _seen(Curve(theta, 2 * np.sqrt(g) * s2 * sine * ratio), self.exact.g < 0)

    @cached_property
    def _resting(self) -> Reduced:
        """The motion at `bottom` with the momenta of this one, but without θ̇ and energy."""
        r, ctx = self.exact, self.exact.ctx
        half = ctx.mpf(self.bottom) / 2
        s2 = ctx.one if self.bottom == np.pi else ctx.sin(half) ** 2
        plus, minus = self.momenta
        rise, fall = (r.P_plus if plus else ctx.zero), (r.P_minus if minus else ctx.zero)
        return replace(
            r, b=(rise - fall) / 2, u0=1 - 2 * s2, one_minus_u0=2 * s2, one_plus_u0=2 - 2 * s2,
            udot0=ctx.zero, drift0=rise * s2 + fall * (1 - s2), kinetic0=ctx.zero,
        )  # fmt: skip

    def _through(self, h: Number) -> Reduced:
        """The motion of energy h that goes through `bottom`."""
        at, ctx = self._resting, self._resting.ctx
        kinetic = h - at.g * at.u0
        squared = 2 * kinetic * at.sin2 - at.drift0**2
        udot = ctx.sqrt(squared) if squared > 0 else ctx.zero
        return replace(at, udot0=udot, kinetic0=kinetic)


def curve(roots: Nutation, points: int = 301) -> Curve:
    """The curve between two turning points, with all its digits at both.

    Parameters
    ----------
    roots : Nutation
        The turning points.
    points : int
        How many.
    """
    beta = np.linspace(0.0, np.pi / 2, points)
    above, below = (float(roots.delta) * np.sin(x) ** 2 for x in (np.pi / 2 - beta, beta))
    # above = u − u₁ and below = u₂ − u, so that θ grows with β
    top, bottom = float(roots.one_minus_u2), float(roots.one_plus_u1)
    one_minus, one_plus = top + below, bottom + above
    lead = 4 * float(roots.w) ** 2 * (np.sin(beta) ** 2 + float(roots.mc) * np.cos(beta) ** 2)
    speed = np.sqrt(lead * _share(below, one_minus) * _share(above, one_plus))
    theta = 2 * np.arctan2(np.sqrt(one_minus), np.sqrt(one_plus))
    return _seen(Curve(theta, speed), roots.mirrored)


def _share(part: Array, whole: Array) -> Array:
    """The part of the whole; one at a pole that is passed, where both are zero."""
    return np.divide(part, whole, out=np.ones_like(part), where=whole > 0)


def _seen(upright_curve: Curve, mirrored: bool) -> Curve:
    theta, speed = upright_curve
    return Curve(np.pi - theta[::-1], speed[::-1]) if mirrored else upright_curve
