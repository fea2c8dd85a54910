"""The roots u₁ ≤ u₂ ≤ u₃ of the cubic f(u), in balls, for a motion with g ≥ 0 that nutates.

Roots that are known exactly, the start where θ̇₀ = 0 and ±1 where P∓ = 0, are divided out, and the
rest is found by the formulas for a quadratic or a cubic. Then each small distance is met from two
sides: as a difference, and by

    (u₂ − u₀)(u₀ − u₁)(u₃ − u₀) = f₀/2g,
    2g (1 + u₁)(1 + u₂)(1 + u₃) = P₊²,   2g (1 − u₁)(1 − u₂)(u₃ − 1) = P₋².
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from flint import arb, arb_poly

from heavytop.classification.reduced import Reduced, Regime
from heavytop.exact.balls import Interval, above


class TooFewBits(Exception):
    """Two numbers that differ could not be told apart with so many bits.

    Parameters
    ----------
    names : str
        Which numbers.
    difference : arb
        A ball around their difference.
    """

    def __init__(self, names: str, difference: arb) -> None:
        super().__init__(names, difference)
        self.names, self.difference = names, difference

    @property
    def told(self) -> tuple[str, float]:
        """What to say of them, and an upper bound of their difference."""
        if not self.difference.is_finite():
            return f"{self.names} are not told apart", math.inf
        bound = Interval.of(abs(self.difference)).upper
        return f"{self.names} differ by less than {above(bound)}", bound


@dataclass(frozen=True, slots=True)
class Roots:
    """The roots by their distances, each a ball, which is exactly 0 where the regime says so.

    Parameters
    ----------
    down, up, delta : arb
        u₀ − u₁, u₂ − u₀ and u₂ − u₁.
    one_minus_u1, one_plus_u1, one_minus_u2, one_plus_u2 : arb
        Distances from ±1.
    u3 : arb or None
        The third root; None where g = 0 and there is none.
    m, mc : arb
        (u₂ − u₁)/(u₃ − u₁) and (u₃ − u₂)/(u₃ − u₁).
    w : arb
        √(g (u₃ − u₁)/2) [s⁻¹].
    """

    down: arb
    up: arb
    delta: arb
    one_minus_u1: arb
    one_plus_u1: arb
    one_minus_u2: arb
    one_plus_u2: arb
    u3: arb | None
    m: arb
    mc: arb
    w: arb

    @classmethod
    def of(cls, over: Reduced, regime: Regime) -> Roots:
        """The roots of a reduced motion that nutates, at the working precision.

        Raises
        ------
        TooFewBits
            Two roots could not be told apart.
        """
        cubic = f3, f2, _, f0 = over.cubic
        d1, d2, *d3 = _distances(cubic, over, regime)
        lead = f3 * d3[0] if d3 else -f2  # 2g (u₃ − u₀)
        down, up = _pair(-d1, d2, f0 / lead)
        plus2, minus1 = over.one_plus_u0 + up, over.one_minus_u0 + down
        minus2, beyond = over.one_minus_u0 - up, lead - f3 * over.one_minus_u0  # 2g (u₃ − 1)
        if not regime.misses_top:
            rises = sign_of(over.over_top, "E' and gMR")
            minus2, beyond = (arb(0), beyond) if rises > 0 else (minus2, arb(0))
        minus2, beyond = _pair(minus2, beyond, over.P_minus * over.P_minus / minus1)
        plus1 = over.one_plus_u0 - down if regime.misses_bottom else arb(0)
        plus1, _ = _pair(plus1, lead + f3 * over.one_plus_u0, over.P_plus * over.P_plus / plus2)
        delta, reach = up + down, lead + f3 * down  # 2g (u₃ − u₁)
        return cls(
            down, up, delta, minus1, plus1, minus2, plus2, 1 + beyond / f3 if d3 else None,
            f3 * delta / reach, (beyond + f3 * minus2) / reach, reach.sqrt() / 2,
        )  # fmt: skip


def _meet(one: arb, other: arb) -> arb:
    """What two balls around one number have in common."""
    return one.intersection(other) if one.is_finite() and other.is_finite() else one


def _pair(one: arb, other: arb, product: arb) -> tuple[arb, arb]:
    """Two numbers of known product, each by itself and through the other; exact zeros stay."""
    if not one.is_zero():
        one = _meet(one, product / other)
    if not other.is_zero():
        other = _meet(other, product / one)
    return one, other


def _distances(cubic: tuple[arb, ...], over: Reduced, regime: Regime) -> list[arb]:
    """Increasing distances u − u₀ of the roots, two of them where g = 0.

    Raises
    ------
    TooFewBits
        Two roots could not be told apart.
    """
    found = [] if regime.misses_bottom else [-over.one_plus_u0]
    if not regime.misses_top:
        found.append(over.one_minus_u0)
    if regime.resting and not any(root.is_zero() for root in found):
        found.append(arb(0))
    rest = arb_poly(list(reversed(cubic)))  # f₃ is exactly 0 where g is
    for root in found:
        rest //= arb_poly([-root, 1])
    found = sorted([*found, *_real_roots(rest)], key=lambda d: d.mid())
    for names, low, high in zip(("u1 and u2", "u2 and u3"), found, found[1:], strict=False):
        if not low < high:
            raise TooFewBits(names, high - low)
    return found


def _real_roots(f: arb_poly) -> list[arb]:
    """All roots, known to be real, of a polynomial of degree 0 to 3."""
    if f.degree() == 3:
        return _cubic(*f.coeffs())
    if f.degree() == 2:
        q0, q1, q2 = f.coeffs()
        root = root_of(q1 * q1 - 4 * q2 * q0)
        double = root - q1 if q1.mid() < 0 else -q1 - root
        return [double / (2 * q2), 2 * q0 / double]
    return [-f[0] / f[1]] if f.degree() else []


def _cubic(f0: arb, f1: arb, f2: arb, f3: arb) -> list[arb]:
    """By Viète's cosine, its angle from the discriminant: acos would fail where roots are close."""
    p = (3 * f3 * f1 - f2 * f2) / (3 * f3 * f3)
    q = (2 * f2 * f2 * f2 - 9 * f3 * f2 * f1 + 27 * f3 * f3 * f0) / (27 * f3 * f3 * f3)
    # products, for a power of a ball that holds 0 is not finite
    angle = arb.atan2(root_of(-4 * p * p * p - 27 * q * q), -q * arb(27).sqrt()) / 3
    size, shift, third = 2 * root_of(-p / 3), f2 / (3 * f3), 2 * arb.pi() / 3
    return [size * (angle - third * k).cos() - shift for k in range(3)]


def root_of(x: arb) -> arb:
    """The root of a number known not to be negative, whatever its ball."""
    return x.nonnegative_part().sqrt()


def sign_of(x: arb, names: str) -> int:
    """1 or −1 where x ≥ 0 or x < 0.

    Raises
    ------
    TooFewBits
        The ball does not tell: two numbers, whose names these are, differ by x.
    """
    if not (x >= 0 or x < 0):
        raise TooFewBits(names, x)
    return 1 if x >= 0 else -1
