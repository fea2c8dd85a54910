"""Jacobi's elliptic functions, the argument of θ₁, and Legendre's integrals, in balls.

With τ = K'/K, the nome q = exp(−πτ) and v = sin² πz, up to one factor θ₁ … θ₄ are

    sin πz A(v),  cos πz A(1 − v),  D(1 − v),  D(v),
    A = Σ (−1)ⁿ qⁿ⁽ⁿ⁺¹⁾ sin (2n + 1)πz/sin πz,   D = 1 + 2 Σ (−1)ⁿ q^{n²} cos 2nπz,

two series of polynomials in v. Where τ < 1, Jacobi's imaginary transformation puts 1/τ for τ and
iz/τ for z, so that q is below 0.05 and a few terms do: sin and cos become i sinh and cosh, θ₂ and
θ₄ change places, and all four are multiplied by exp(−πz²/τ).

References: *NIST Digital Library of Mathematical Functions*, chapters 19, 20 and 22.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Final

from flint import acb, arb, arb_mat, arb_poly, ctx, fmpz_poly

from heavytop.analytic.cubic import TooFewBits, root_of

_MOST_STEPS: Final = 40  # of a mean: its numbers are then equal to 65 536 bits, if mc > 2^-2^20
_SMALL: Final = 0.05  # q is below exp(−π) but for what τ is not known to


class Jacobi:
    """The functions of one τ = K'/K, None where it is infinite; an argument is 2K times a number.

    What is left out of either series after the term n is less than 4 q^{n²}, for |Re z| < ¾ and
    |Im z| ≤ τ/2: there |sin (2n + 1)πz/sin πz| ≤ (2n + 1) q^{−3n/2}, and |cos 2nπz| ≤ q^{−3n/2}.
    """

    def __init__(self, tau: arb | None) -> None:
        tau = arb.pos_inf() if tau is None else tau
        self.hyperbolic = bool(tau.mid() < 1)
        self.scale = arb.pi() / tau if self.hyperbolic else arb.pi()
        decay = self.scale if self.hyperbolic else self.scale * tau  # −ln q
        q = (-decay).exp()
        if not q < _SMALL:
            raise TooFewBits("K'/K and 1", q)
        n = 1 + math.isqrt(int((ctx.prec + 2) * math.log(2) / float(decay)))
        self.rest = arb(0, (4 * q ** (n * n)).upper())
        odd, even = _multiples(n)
        A = odd * arb_mat(n + 1, 1, [q ** (k * k + k) for k in range(n + 1)])
        D = even * arb_mat(n + 1, 1, [q ** (k * k) for k in range(n + 1)])
        self.A, self.D = arb_poly(A.entries()), arb_poly(D.entries())
        _, two, three, four = self._thetas(arb(0))
        self._scales = three / two, four / two, four / three

    def functions(self, x: arb) -> tuple[arb, arb, arb]:
        """The functions sn, cn and dn of 2K x, for |x| < ¾."""
        one, two, three, four = self._thetas(x)
        sn, cn, dn = self._scales
        return sn * one / four, cn * two / four, dn * three / four

    def _thetas(self, x: arb) -> tuple[arb, arb, arb, arb]:
        """The functions θ₁ … θ₄ of a real x, each up to a constant and a common factor."""
        y = _within(x) * self.scale
        sine, cosine = y.sinh_cosh() if self.hyperbolic else y.sin_cos()
        v, w = sine * sine, cosine * cosine
        if self.hyperbolic:
            v = -v
        odd, even = sine * (self.A(v) + self.rest), cosine * (self.A(w) + self.rest)
        one, other = self.D(w) + self.rest, self.D(v) + self.rest
        return (odd, other, one, even) if self.hyperbolic else (odd, even, one, other)

    def argument(self, x: arb, beta: arb) -> arb:
        """The argument of iθ₁(x − iβ), for |x| < ¾ and β ≤ τ/2: 0 at x = 0, rising with x."""
        y = acb(_within(x), beta) * self.scale
        sine = y.sinh() if self.hyperbolic else y.sin()
        v = -sine * sine if self.hyperbolic else sine * sine
        theta = sine * (self.A(v) + acb(self.rest, self.rest))
        angle = arb.atan2(theta.real, theta.imag)
        return angle + 2 * self.scale * x * beta if self.hyperbolic else angle


@cache
def _multiples(n: int) -> tuple[arb_mat, arb_mat]:
    """Of (−1)ᵏ sin (2k + 1)y/sin y, and of 1 and (−1)ᵏ 2 cos 2ky, the columns in powers of v."""
    cosine = fmpz_poly([1, -2])  # cos 2y, where v = sin² y
    odd, even = [fmpz_poly([1])], [fmpz_poly([1])]
    for k in range(1, n + 1):
        both = fmpz_poly.chebyshev_u(k) + fmpz_poly.chebyshev_u(k - 1)
        odd.append((-1) ** k * both(cosine))
        even.append((-1) ** k * 2 * fmpz_poly.chebyshev_t(k)(cosine))
    powers = range(n + 1)
    by_columns, others = ([[f[i] for f in columns] for i in powers] for columns in (odd, even))
    return arb_mat(by_columns), arb_mat(others)


def _within(x: arb) -> arb:
    if not abs(x) < 0.75:
        raise TooFewBits("the time and a number of periods", x)
    return x


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
