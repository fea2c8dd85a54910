"""The turning points of many motions, by sums and products that lose no digits.

About the start, f(u₀ + d) = f₀ + f₁ d + f₂ d² + 2g d³ has the roots d₁ ≤ 0 ≤ d₂ ≤ d₃. As d₁ is no
neighbour of d₃, its relative error is a few times that of the coefficients; with it 1 − u₁ is
known, and the rest follows from it:

    2g (1 − u₁)(1 − u₂)(u₃ − 1) = P₋²,   2g (1 + u₁)(1 + u₂)(1 + u₃) = P₊²,
    2g [(u₃ − 1) − (1 − u₂)](1 − u₁) = −f'(1) − P₋²/(1 − u₁),   2g d₁ d₂ d₃ = −f₀.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from heavytop.analytic.theory.rows.paired import Mask
from heavytop.analytic.theory.rows.start import Start
from heavytop.numbers.pairs import Array

STEPS = 5
"""Of Laguerre's method, each of which triples the digits once a root is isolated."""

_SIGNED = 2.0**-6  # what P± may be wrong by for their signs to be known
_SETTLED = 1e-13  # what the last step may be, beside the root


@dataclass(frozen=True, slots=True)
class Roots:
    """Turning points; the fields are those of `heavytop.analytic.theory.nutation.Nutation`.

    Parameters
    ----------
    one_plus_u1, one_minus_u1, one_plus_u2, one_minus_u2 : Array
        Distances of u₁ and u₂ from ±1.
    mc, w : Array
        1 − m, and w [s⁻¹].
    vague : Array
        An estimate of the relative error that cancellation leaves in them; nan where the roots
        were not found.
    """

    one_plus_u1: Array
    one_minus_u1: Array
    one_plus_u2: Array
    one_minus_u2: Array
    mc: Array
    w: Array
    vague: Array

    @classmethod
    def of(cls, start: Start) -> Roots:
        """The roots of reduced motions, where they nod; elsewhere they mean nothing."""
        g2 = 2 * start.g
        d1, settled = _lowest(start)
        minus1 = start.one_minus_u0 - d1
        share = start.P_minus**2 / minus1
        gap = (start.surplus - share) / minus1  # 2g [(u₃ − 1) − (1 − u₂)]
        larger = (abs(gap) + np.sqrt(gap**2 + 4 * g2 * share)) / 2
        smaller = g2 * share / larger
        lead = np.where(gap >= 0, larger, smaller)  # 2g (u₃ − 1)
        minus2 = np.where(gap >= 0, share / larger, larger / g2)
        climb = lead + g2 * start.one_minus_u0  # 2g d₃
        d2 = np.where(d1 < 0, start.f0 / -d1, start.f1) / climb
        plus2 = start.one_plus_u0 + d2
        plus1 = start.P_plus**2 / (plus2 * (2 * g2 + lead))
        reach = lead + g2 * minus1  # 2g (u₃ − u₁)
        w = np.sqrt(reach) / 2
        hung = np.where(gap >= 0, np.sqrt(minus2), 0.0)  # θ at u₂, where P₋ alone sets it
        vague = (
            start.vague_f1 / (reach * np.minimum(minus1, plus2))
            + start.vague_surplus / (minus1 * larger)
            + start.vague_plus * (_felt(start.P_plus / (w * plus2)) + np.sqrt(plus1))
            + start.vague_minus * (_felt(start.P_minus / (w * minus1)) + smaller / larger + hung)
        )
        sure = settled & (np.maximum(start.vague_plus, start.vague_minus) < _SIGNED)
        mc = (lead + g2 * minus2) / reach
        return cls(plus1, minus1, plus2, minus2, mc, w, np.where(sure, vague, np.nan))


def _felt(P: Array) -> Array:
    """How much of a relative error in a small P± is felt: Φ± is ±π but for a term like P±."""
    return np.minimum(abs(P), 1.0)


def _lowest(start: Start) -> tuple[Array, Mask]:
    """d₁, and whether the last step was small and f rises there, as it does not at d₂.

    From below all roots the steps of Laguerre's method never pass the first.
    """
    f0, f1, f2, f3 = start.f0, start.f1, start.f2, 2 * start.g
    d, step, slope = _below(start), np.zeros(1), np.zeros(1)
    for _ in range(STEPS):
        value = f0 + d * (f1 + d * (f2 + d * f3))
        slope = f1 + d * (2 * f2 + d * (3 * f3))
        bend = 2 * f2 + 6 * f3 * d
        under = slope + np.sqrt(np.maximum(4 * slope**2 - 6 * value * bend, 0.0))
        step = -3 * value / np.where(under == 0, 1.0, under)
        d = np.minimum(d + step, 0.0)
    return d, (abs(step) <= _SETTLED * abs(d)) & (slope > 0)


def _below(start: Start) -> Array:
    """A number below d₁, the nearer the farther d₃ is.

    The negative root of f₀ + f₁ d + (f₂ + 2g e) d² is d₁ for e = d₁. For a lower e it is higher
    than d₁, and for a higher one lower.
    """
    g2, floor = 2 * start.g, _floor(start)
    over = _negative_root(start.f0, start.f1, start.f2 + g2 * floor)
    under = _negative_root(start.f0, start.f1, start.f2 + g2 * over)
    return np.where(under >= floor, under, floor)


def _floor(start: Start) -> Array:
    """A bound below all roots: −1 − u₀, or Fujiwara's where all of them are beside the start."""
    f0, f1, f2 = (abs(each / (2 * start.g)) for each in (start.f0, start.f1, start.f2))
    exponent = -(-np.frexp(f0)[1] // 3)
    cube = np.where(f0 == 0, 0.0, np.ldexp(1.0, exponent))  # a power of 2 above the cube root
    reach = 2 * np.maximum(np.maximum(f2, np.sqrt(f1)), cube)
    floor: Array = -np.fmin(start.one_plus_u0, reach)  # reach is infinite or nan without gravity
    return floor


def _negative_root(f0: Array, f1: Array, f2: Array) -> Array:
    """The negative root of f₀ + f₁ d + f₂ d² with f₂ < 0 ≤ f₀; nan where f₂ > 0."""
    root = np.sqrt(f1**2 - 4 * f0 * f2)
    far = abs(f1) + root
    root = np.where(f1 > 0, -2 * f0 / np.where(far == 0, 1.0, far), far / (2 * f2))
    return np.where(f2 < 0, root, np.nan)
