"""The effective potential of the tilt, curves of constant energy, and time by quadrature.

In units A = 1, without the constant energy p_ψ²/2C of the spin,

    V(θ) = ⅛ [P₊ tan(θ/2) + P₋ cot(θ/2)]² + g cos θ,     ½ θ̇² + V(θ) = h.

Written so, nothing cancels near the poles; where P₋ = 0 the top is a point like any other, and
where P₊ = 0 the bottom is.

With u = ½ (u₁ + u₂) − ½ (u₂ − u₁) cos α the roots of f at the turning points cancel, and

    t = ∫ dα / √(2g (u₃ − u)),   T = the same over a whole turn of α,

the integral of a smooth function, which needs no elliptic functions: it shares the roots with the
closed form and nothing else.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt
from flint import acb, arb

from heavytop.analytic.closed_form import midpoint
from heavytop.analytic.critical_set import Array, valley
from heavytop.analytic.cubic import root_of
from heavytop.analytic.rising import Rising
from heavytop.analytic.solution import Asymptotic, Nutating, Solution
from heavytop.classification.reduced import FromConstants, MotionSource, Reduced, vanishes
from heavytop.errors import NoClosedForm
from heavytop.numbers.decimals import Number, context
from heavytop.numbers.intervals import Interval, rational, rational_ball, working

FAMILY: Final = (0.25, 0.5, 0.75, 1.25, 1.5)
"""Amplitudes of the family of curves, beside that of the motion: the root of their energies."""

_BITS: Final = 256  # of the constants
_AT_REST: Final = 1e-12  # of the typical energy: what of it is rounding


class Curve(NamedTuple):
    """One branch θ̇ ≥ 0 of a curve of constant energy; the other is its mirror image.

    `theta` grows from the smallest tilt to the largest [rad]; `speed` is |θ̇| [rad/s], zero at
    turning points, but not where the curve runs into a pole.
    """

    theta: Array
    speed: Array


class Potential:
    """V(θ) at the momenta of one motion, its constants known to 256 bits.

    Parameters
    ----------
    source : MotionSource
        The exact numbers of the motion, `Motion.rising.source`.

    Attributes
    ----------
    g, h : Fraction
        gMR/A and E'/A, the energy without that of the spin [1/s²].
    momenta : tuple of 2 Fraction
        P₊ and P₋ [1/s], exactly zero where an axis passes through that pole, or so nearly that no
        double tells it.

    Examples
    --------
    >>> from heavytop.analytic.motion import Motion
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> motion = Motion(Top(1, 1, 3), State("pi/2", phidot=2))
    >>> float(Potential(motion.rising.source)(np.pi / 2).round(12))
    2.0
    """

    def __init__(self, source: MotionSource) -> None:
        with working(_BITS):
            start = source.reduced(_BITS)
            self.g, self.h = Interval.of(start.g).middle, Interval.of(start.h).middle
            plus, minus = (_momentum(source, start, name) for name in ("P_plus", "P_minus"))
        self.momenta = plus, minus

    def __call__(self, theta: npt.ArrayLike) -> Array:
        """V [1/s²] at the tilts θ [rad]; vast or infinite at a pole that no energy reaches."""
        tilt = np.asarray(theta, dtype=np.float64)
        s, c = np.sin(tilt / 2), np.cos(tilt / 2)
        plus, minus = map(float, self.momenta)
        with np.errstate(divide="ignore"):
            across = (s / c * plus if plus else 0.0) + (c / s * minus if minus else 0.0)
        return np.asarray(across**2 / 8 + float(self.g) * (c - s) * (c + s))

    @cached_property
    def _poles(self) -> tuple[Fraction, Fraction]:
        """The numbers 1 − cosθ and 1 + cosθ where V is least, or beside it by a rounding."""
        found = valley(float(self.g), *map(float, self.momenta))
        minus, plus = (Fraction(float(x)) for x in (found.one_minus_u, found.one_plus_u))
        return (minus, 2 - minus) if minus < plus else (2 - plus, plus)

    @property
    def bottom(self) -> float:
        """The tilt where V is least [rad]; there is one such tilt."""
        minus, plus = map(float, self._poles)
        return float(2 * np.arctan2(np.sqrt(minus), np.sqrt(plus)))

    @cached_property
    def least(self) -> Fraction:
        """V [1/s²] at `bottom`, exactly."""
        (minus, plus), (P, Q) = self._poles, self.momenta
        across = P * minus + Q * plus
        return self.g * (1 - minus) + (across**2 / (8 * minus * plus) if across else 0)

    @cached_property
    def excess(self) -> float:
        """How far the energy h of the motion is above the least [1/s²]; not below zero."""
        return max(0.0, float(self.h - self.least))

    def raised(self, excess: float | Fraction) -> Rising | None:
        """The motion so far above the least energy [1/s²]; None where θ is constant."""
        if excess <= 0:
            return None
        (plus, minus), h = self.momenta, self.least + Fraction(excess)
        a, b = (plus + minus) / 2, (plus - minus) / 2
        motion = Rising(FromConstants.of(self.g, a, b, h, self._poles), proved=False)
        return None if motion.regime.steady else motion

    def curve(self, excess: float | Fraction, points: int = 301) -> Curve | None:
        """The curve of the motion so far above the least energy, to all digits at both its ends.

        None where θ is constant.
        """
        if (motion := self.raised(excess)) is None:
            return None
        found = motion.settled(
            "a root", lambda solution, _: _distances(solution), 20, size=lambda x: abs(x.mid())
        )
        delta, top, bottom, mc, w = map(float, found)
        beta = np.linspace(0.0, np.pi / 2, points)
        above, below = (delta * np.sin(x) ** 2 for x in (np.pi / 2 - beta, beta))
        # above = u − u₁ and below = u₂ − u, so that θ grows with β
        one_minus, one_plus = top + below, bottom + above
        lead = 4 * w**2 * (np.sin(beta) ** 2 + mc * np.cos(beta) ** 2)
        speed = np.sqrt(lead * _share(below, one_minus) * _share(above, one_plus))
        theta = 2 * np.arctan2(np.sqrt(one_minus), np.sqrt(one_plus))
        if motion.regime.mirrored:
            return Curve(np.pi - theta[::-1], speed[::-1])
        return Curve(theta, speed)

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
        return max(own, float(self._saddle), 0.0)

    def family(self, points: int = 301) -> tuple[Curve, ...]:
        """Curves at the momenta of the motion, their energies spaced about `spread`."""
        curves = (self.curve(amplitude**2 * self.spread, points) for amplitude in FAMILY)
        return tuple(each for each in curves if each is not None)

    @property
    def _saddle(self) -> Fraction:
        """How far the energy is above the least where the axis tends to the vertical [1/s²], or 0.

        It does so at P₋ = 0 (seen with g > 0), if V is not least there: for b² < 4g.
        """
        missed = self.momenta[0 if self.g < 0 else 1]
        return Fraction(0) if missed else abs(self.g) - self.least

    def separatrix(self, points: int = 301) -> Curve | None:
        """The curve of the motions that tend to the vertical; None where there are none."""
        return self.curve(self._saddle, points)


def quadrature_period(motion: Rising, digits: int = 50) -> Number:
    """The period T of a nutation [s] by quadrature, to so many digits.

    Examples
    --------
    >>> from heavytop.analytic.motion import Motion
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> kicked = Motion(Top("3.28e-4", "6.6e-5", "0.0456"), State("0.1", phidot=-15, psidot=140))
    >>> float(quadrature_period(kicked.rising))
    0.5428955181882199
    """
    return _integrated(motion, lambda _: 2 * arb.pi(), digits)


def quadrature_time(motion: Rising, theta: Any, digits: int = 20) -> Number:
    """How long the axis takes from the turning point u₁ to a tilt θ [s], by quadrature.

    At most half a period; u₁ is where θ is largest, or with gMR < 0 smallest.
    """
    tilt = rational(theta)

    def alpha(found: Solution) -> arb:
        """The α of θ: tan²½α = (u − u₁)/(u₂ − u)."""
        gone, left = (abs(rational_ball(tilt).cos() - end.cos()) for end in found.tilts)
        return 2 * arb.atan2(root_of(gone), root_of(left))

    return _integrated(motion, alpha, digits)


def _integrated(motion: Rising, end: Any, digits: int) -> Number:
    """∫ dα/√(2g (u₃ − u)) from 0 to an end; 2g (u₃ − u) = 4w² (1 − m + m cos²½α)."""
    if motion.regime.name != "nutating":
        raise NoClosedForm(f"a {motion.regime.name} motion has no nutation")

    def integral(found: Solution, _: int) -> arb:
        mc, w = _distances(found)[3:]

        def slowness(alpha: acb, analytic: bool) -> acb:
            c = (alpha / 2).cos()
            return 1 / (2 * w * (mc + (1 - mc) * c * c).sqrt(analytic=analytic))

        return acb.integral(slowness, acb(0), acb(end(found))).real

    found = motion.settled("a time", integral, digits)
    return midpoint(context(digits + 10), found)


def _distances(found: Solution) -> tuple[arb, ...]:
    """The numbers u₂ − u₁, 1 − u₂, 1 + u₁, 1 − m and w of a motion whose tilt is not constant."""
    path = found.path
    if isinstance(path, Asymptotic):
        return path.one_minus_u1, arb(0), path.one_plus_u1, arb(0), path.w
    assert isinstance(path, Nutating)
    roots = path.roots
    return roots.delta, roots.one_minus_u2, roots.one_plus_u1, roots.mc, roots.w


def _momentum(source: MotionSource, start: Reduced, name: str) -> Fraction:
    """P₊ or P₋; exactly 0 where it is 0, and where it is less than any double."""
    middle = Interval.of(getattr(start, name)).middle
    gone = not float(middle) or vanishes(source, name, proved=False, reduced=start)
    return Fraction(0) if gone else middle


def _share(part: Array, whole: Array) -> Array:
    """The part of the whole; one at a pole that is passed, where both are zero."""
    return np.divide(part, whole, out=np.ones_like(part), where=whole > 0)
