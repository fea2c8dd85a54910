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

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from flint import acb, arb, fmpq

from heavytop.analytic.closed_form import midpoint
from heavytop.analytic.cubic import root_of
from heavytop.analytic.rising import Rising
from heavytop.analytic.solution import Nutating, Solution
from heavytop.classification.reduced import FromConstants, Regime, Source
from heavytop.errors import NoClosedForm
from heavytop.numbers.decimals import Number, context
from heavytop.numbers.intervals import Interval, rational, working

Array: TypeAlias = npt.NDArray[np.float64]

FAMILY: Final = (0.25, 0.5, 0.75, 1.25, 1.5)
"""Amplitudes of the family of curves, beside that of the motion: the root of their energies."""

_BITS: Final = 256  # of the constants
_GRID: Final = 4097
_ZOOMS: Final = 3
_AT_REST: Final = 1e-12  # of the typical energy: what the place of the bottom is not known to


class Curve(NamedTuple):
    """One branch θ̇ ≥ 0 of a curve of constant energy; the other is its mirror image.

    `theta` grows from the smallest tilt to the largest [rad]; `speed` is |θ̇| [rad/s], zero at
    turning points, but not where the curve runs into a pole.
    """

    theta: Array
    speed: Array


@dataclass(frozen=True)
class Potential:
    """V(θ) at the momenta of one motion, given by its source, as `Motion.rising.source` is.

    Examples
    --------
    >>> from heavytop.analytic.motion import Motion
    >>> from heavytop.scene.state import State
    >>> from heavytop.scene.top import Top
    >>> motion = Motion(Top(1, 1, 3), State("pi/2", phidot=2))
    >>> float(Potential(motion.rising.source)(np.pi / 2).round(12))
    2.0
    """

    source: Source

    @cached_property
    def _constants(self) -> tuple[Fraction, Fraction, Fraction, Fraction]:
        """The constants g, P₊, P₋ and h to 256 bits, P± exactly zero where they are."""
        regime = Regime.of(self.source, proved=False)
        zeros = not regime.misses_bottom, not regime.misses_top
        no_plus, no_minus = reversed(zeros) if regime.mirrored else zeros
        with working(_BITS):
            start = self.source.reduced(_BITS)
            g, plus, minus, h = (
                Interval.of(x).middle for x in (start.g, start.P_plus, start.P_minus, start.h)
            )
        return g, Fraction(0) if no_plus else plus, Fraction(0) if no_minus else minus, h

    @property
    def g(self) -> Fraction:
        """gMR/A [1/s²]."""
        return self._constants[0]

    @property
    def h(self) -> Fraction:
        """The energy of the motion, without that of the spin, E'/A [1/s²]."""
        return self._constants[3]

    @cached_property
    def momenta(self) -> tuple[float, float]:
        """P₊ and P₋ [1/s], exactly zero where an axis passes through that pole."""
        _, plus, minus, _ = self._constants
        return float(plus), float(minus)

    def __call__(self, theta: npt.ArrayLike) -> Array:
        """V [1/s²] at the tilts θ [rad]; vast or infinite at a pole that no energy reaches."""
        tilt = np.asarray(theta, dtype=np.float64)
        s, c = np.sin(tilt / 2), np.cos(tilt / 2)
        plus, minus = self.momenta
        with np.errstate(divide="ignore"):
            rise = np.divide(s, c) * plus if plus else np.zeros_like(tilt)
            fall = np.divide(c, s) * minus if minus else np.zeros_like(tilt)
        value: Array = (rise + fall) ** 2 / 8 + float(self.g) * (c - s) * (c + s)
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
    def _poles(self) -> tuple[Fraction, Fraction]:
        """The numbers 1 − cosθ and 1 + cosθ at `bottom`, or beside it by a rounding."""
        minus, plus = (Fraction(2 * f(self.bottom / 2) ** 2) for f in (np.sin, np.cos))
        if self.bottom == np.pi:
            plus = Fraction(0)
        return (minus, 2 - minus) if minus < plus else (2 - plus, plus)

    @cached_property
    def least(self) -> Fraction:
        """V [1/s²] at `bottom`, exactly."""
        (minus, plus), (g, P, Q, _) = self._poles, self._constants
        across = P * minus + Q * plus
        return g * (1 - minus) + (across**2 / (8 * minus * plus) if across else 0)

    @cached_property
    def excess(self) -> float:
        """How far the energy h of the motion is above the least [1/s²]; not below zero."""
        return max(0.0, float(self.h - self.least))

    def raised(self, excess: float) -> Rising | None:
        """The motion so far above the least energy [1/s²]; None where nothing nutates."""
        if excess <= 0:
            return None
        g, plus, minus, _ = self._constants
        h, poles = self.least + Fraction(excess), self._poles
        constants = FromConstants.of(g, (plus + minus) / 2, (plus - minus) / 2, h, poles)
        motion = Rising(constants, proved=False)
        return motion if motion.regime.name == "nutating" else None

    def curve(self, excess: float, points: int = 301) -> Curve | None:
        """The curve of the motion so far above the least energy; None where nothing nutates."""
        motion = self.raised(excess)
        return None if motion is None else phase_curve(motion, points)

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
        saddle = float(abs(self.g) - self.least) if self.has_separatrix else 0.0
        return max(own, saddle, 0.0)

    def family(self, points: int = 301) -> tuple[Curve, ...]:
        """Curves at the momenta of the motion, their energies spaced about `spread`."""
        curves = (self.curve(amplitude**2 * self.spread, points) for amplitude in FAMILY)
        return tuple(each for each in curves if each is not None)

    @property
    def has_separatrix(self) -> bool:
        """Whether motions tend to the vertical: P₋ = 0 and p_ψ² < 4 A gMR, seen with gMR > 0."""
        return self._separatrix_b2 is not None

    @property
    def _separatrix_b2(self) -> Fraction | None:
        """b² of the motions that tend to the vertical."""
        g, plus, minus, _ = self._constants
        miss, b = (plus if g < 0 else minus), (plus - minus) / 2
        return b * b if not miss and b * b < 4 * abs(g) else None

    def separatrix(self, points: int = 301) -> Curve | None:
        """The curve of the motions that tend to the vertical; None where there are none.

        They exist at p_φ = p_ψ for p_ψ² < 4 A gMR: there the upright top is unstable. Then

            θ̇ = 2 tan(θ/2) √(g (sin²(θₘ/2) − sin²(θ/2))),   cos²(θₘ/2) = b²/4g.
        """
        if (b2 := self._separatrix_b2) is None:
            return None
        g = abs(self.g)
        c2, s2 = float(b2 / (4 * g)), float(1 - b2 / (4 * g))
        alpha = np.linspace(0.0, np.pi / 2, points)
        sine, cosine = np.sin(alpha), np.sin(np.pi / 2 - alpha)
        below = np.sqrt(cosine**2 + c2 * sine**2)  # cos(θ/2); sin(θ/2) is √s2 sine
        ratio = np.divide(cosine, below, out=np.ones_like(below), where=below > 0)
        theta = 2 * np.arctan2(np.sqrt(s2) * sine, below)
        return _seen(Curve(theta, 2 * np.sqrt(float(g)) * s2 * sine * ratio), self.g < 0)


def phase_curve(motion: Rising, points: int = 301) -> Curve:
    """The curve of a motion that nutates, with all its digits at both turning points."""
    found = motion.settled(
        "a root", lambda solution, _: _distances(solution), 20, size=lambda x: abs(x.mid())
    )
    delta, top, bottom, mc, w = (float(midpoint(context(20), x)) for x in found)
    beta = np.linspace(0.0, np.pi / 2, points)
    above, below = (delta * np.sin(x) ** 2 for x in (np.pi / 2 - beta, beta))
    # above = u − u₁ and below = u₂ − u, so that θ grows with β
    one_minus, one_plus = top + below, bottom + above
    lead = 4 * w**2 * (np.sin(beta) ** 2 + mc * np.cos(beta) ** 2)
    speed = np.sqrt(lead * _share(below, one_minus) * _share(above, one_plus))
    theta = 2 * np.arctan2(np.sqrt(one_minus), np.sqrt(one_plus))
    return _seen(Curve(theta, speed), motion.regime.mirrored)


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
        """The α of θ: tan²½α = (u − u₁)/(u₂ − u), by products of sines, which do not cancel."""
        here = arb(fmpq(tilt.numerator, tilt.denominator))
        gone, left = (
            abs(((end + here) / 2).sin() * ((end - here) / 2).sin()) for end in found.tilts
        )
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
    """The numbers u₂ − u₁, 1 − u₂, 1 + u₁, 1 − m and w of a motion that nutates."""
    path = found.path
    assert isinstance(path, Nutating)
    roots = path.roots
    return roots.delta, roots.one_minus_u2, roots.one_plus_u1, roots.mc, roots.w


def _share(part: Array, whole: Array) -> Array:
    """The part of the whole; one at a pole that is passed, where both are zero."""
    return np.divide(part, whole, out=np.ones_like(part), where=whole > 0)


def _seen(curve: Curve, mirrored: bool) -> Curve:
    theta, speed = curve
    return Curve(np.pi - theta[::-1], speed[::-1]) if mirrored else curve
