"""The roots u₁ ≤ u₂ ≤ u₃ of the cubic f(u), and Legendre's integrals, in balls, where g ≥ 0.

Roots that are exact, the start where θ̇₀ = 0 and ±1 where P∓ = 0, are divided out, and the rest is
found by the formulas for a quadratic or a cubic. Each small distance is found from two sides: as a
difference, and by (u₂ − u₀)(u₀ − u₁)(u₃ − u₀) = f₀/2g and 2g (1 ± u₁)(1 ± u₂)(u₃ ± 1) = P±².
"""

from __future__ import annotations

from typing import Final

from flint import acb, arb, arb_poly, ctx

from heavytop.classification.reduced import Reduced, Regime

_MOST_STEPS: Final = 40  # of a mean: its numbers are then equal to 65 536 bits, if mc > 2^-2^20


class TooFewBits(Exception):
    """Two numbers that differ could not be separated with so many bits.

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


def pair(one: arb, other: arb, product: arb) -> tuple[arb, arb]:
    """Return balls of two numbers, made narrower by their product; exact zeros stay."""
    one = one if one.is_zero() else _intersect(one, product / other)
    return one, other if other.is_zero() else _intersect(other, product / one)


def _intersect(one: arb, other: arb) -> arb:
    """The common part of two balls around one number."""
    return one.intersection(other) if one.is_finite() and other.is_finite() else one


def distances(cubic: tuple[arb, ...], upright: Reduced, regime: Regime) -> list[arb]:
    """The distances u − u₀ of the roots, increasing, two of them where g = 0."""
    found = [] if regime.misses_bottom else [-upright.one_plus_u0]
    if not regime.misses_top:
        found.append(upright.one_minus_u0)
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
        return _cubic_roots(*f.coeffs())
    if f.degree() == 2:
        q0, q1, q2 = f.coeffs()
        root = root_of(q1 * q1 - 4 * q2 * q0)
        double = root - q1 if q1.mid() < 0 else -q1 - root
        return [double / (2 * q2), 2 * q0 / double]
    return [-f[0] / f[1]] if f.degree() else []


def _cubic_roots(f0: arb, f1: arb, f2: arb, f3: arb) -> list[arb]:
    """The roots by Viète's cosine, its angle by atan2: acos would fail where roots are close."""
    p = (3 * f3 * f1 - f2 * f2) / (3 * f3 * f3)
    q = (2 * f2 * f2 * f2 - 9 * f3 * f2 * f1 + 27 * f3 * f3 * f0) / (27 * f3 * f3 * f3)
    # products: a power of a ball that contains 0 is not finite
    angle = arb.atan2(root_of(-4 * p * p * p - 27 * q * q), -q * arb(27).sqrt()) / 3
    size, shift, third = 2 * root_of(-p / 3), f2 / (3 * f3), 2 * arb.pi() / 3
    return [size * (angle - third * k).cos() - shift for k in range(3)]


def root_of(x: arb) -> arb:
    """The square root of a number that is not negative, though its ball may reach below 0."""
    return x.nonnegative_part().sqrt()


def sign_of(x: arb, names: str) -> int:
    """1 where x ≥ 0, −1 where x < 0; `TooFewBits`, with these names, where the ball has both."""
    if not (x >= 0 or x < 0):
        raise TooFewBits(names, x)
    return 1 if x >= 0 else -1


def floor(x: arb) -> int:
    """The largest whole number not above x; `TooFewBits` where the ball does not determine it."""
    low, high = x.lower().floor(), x.upper().floor()
    if low != high or not x.is_finite():
        raise TooFewBits("an event and the end of the span", x - high)
    return int(low.unique_fmpz())  # type: ignore[arg-type]  # a whole number is one


def first_kind(s2: arb, c2: arb, mc: arb) -> arb:
    """F(φ|1 − mc), where s2 and c2 are proportional to sin²φ and cos²φ."""
    return root_of(s2) * acb.elliptic_rf(acb(c2), acb(c2 + mc * s2), acb(c2 + s2)).real


def third_kind(mc: arb, p: arb) -> arb:
    """Π(1 − p|1 − mc), complete, p > 0, by Bulirsch's sequences, whose terms are all positive.

    What is left after some steps is an integral whose root lies between k and the mean.
    """
    product, mean, p = mc.sqrt(), arb(1), p.sqrt()
    k, a, b, equal = product, arb(1), 1 / p, arb(2) ** (8 - ctx.prec)
    for _ in range(_MOST_STEPS):
        if not mean - k > mean * equal:
            break
        ratio = product / p
        a, b, p = a + b / p, 2 * (b + a * ratio), p + ratio
        mean, k = mean + k, 2 * product.sqrt()
        product = k * mean
    return arb.pi() / 2 * (b + a * mean) / (mean * (mean + p)) * arb(1).union(mean / k)
