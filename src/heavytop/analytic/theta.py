"""Theta functions of one m near a turning point, for balls and for arrays: series in the nome.

With z = πx/2K and the nome of m, or for m > ½ by Jacobi's transformation z = πx/2K' and that of 1 −
m, θ₁ and θ₂ over 2q^¼ are Σ (∓1)ⁿ qⁿ⁽ⁿ⁺¹⁾ s₂ₙ₊₁, c₂ₙ₊₁, and θ₃, θ₄ 1 + 2 Σ (±1)ⁿ qⁿⁿ c₂ₙ, with sₖ,
cₖ = sin kz, cos kz or sinh kz, cosh kz: polynomials in S² or −S², times S = s₁, C = c₁.
Reference: *NIST Digital Library of Mathematical Functions*, chapters 20 and 22.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, cached_property
from typing import Any

from flint import arb, arb_mat, fmpz_mat, fmpz_poly

from heavytop.analytic.roots import TooFewBits

Series = Callable[[Any, Any, Any], Any]
"""A function of S, C and S²; of S, C and −S² where these are hyperbolic."""


@cache
def multiples(factors: str, count: int) -> arb_mat:
    """Coefficients in powers of S², a row for each k < count, of functions with these factors.

    Those are sin (2k+1)z/S, cos (2k+1)z/C, cos 2kz (no factor) and sin 2kz/SC.
    """
    U = [fmpz_poly([0]), *map(fmpz_poly.chebyshev_u, range(count))]
    families = {
        "S": [U[k + 1] + U[k] for k in range(count)],
        "C": [U[k + 1] - U[k] for k in range(count)],
        "": [fmpz_poly.chebyshev_t(k) for k in range(count)],
        "SC": [2 * U[k] for k in range(count)],
    }
    cos2z = fmpz_poly([1, -2])
    rows = [each(cos2z) for each in families[factors]]
    return arb_mat(fmpz_mat(count, count, [row[i] for row in rows for i in range(count)]))


class Theta:
    """The series of sn, cn, dn and of sweeps for one m, near a turning point.

    `scale` is z/x, and `half` the growth of z from one turning point to the next.
    """

    def __init__(self, m: arb, mc: arb, bits: int) -> None:
        self.hyperbolic = bool(m.mid() > mc.mid())
        means = arb(1).agm(mc.sqrt()), arb(1).agm(m.sqrt())  # π/2K and π/2K'
        self.scale, other = means[::-1] if self.hyperbolic else means
        ratio = arb(0) if other.is_zero() else self.scale / other
        self.root_q = q = arb(0) if other.is_zero() else (-arb.pi() / 2 * ratio).exp()
        if not q < 0.25:  # it is e^(−π/2) at most
            raise TooFewBits("K'/K and 1", q)
        self.half = arb.pi() / 2 * (ratio if self.hyperbolic else 1)
        self.decay = -math.log2(max(float(q), 1e-300))
        count = self.terms(bits)
        # half way to the next turning point the first omitted term is at most q^(n(2n − 1))
        self.rest = arb(0, (64 * q ** (count * (2 * count - 1))).upper())
        self.odd = [q ** (2 * k * (k + 1)) for k in range(count)]
        self.even = [q ** (2 * k * k) * (2 if k else 1) for k in range(count)]

    def terms(self, bits: int) -> int:
        """The number of terms that numbers of so many bits need."""
        count = 1
        while count * (2 * count - 1) * self.decay < bits + 10:
            count += 1
        return count

    @cached_property
    def _sizes(self) -> list[list[arb]]:
        """Sizes of the denominator θ, and of sn, cn and dn times it: of x beside u₁, of K + x."""
        sums = (sum(x, arb(0)) for x in (self.odd, self.even, alternate(self.even)))
        (second, third, fourth), far = sums, arb(1)  # θ₂, θ₃ and θ₄ at 0
        if self.hyperbolic:
            far, second, fourth = 4 * self.root_q, fourth, second
        sn, cn, dn = third / second, fourth / second, fourth / third
        return [[arb(1), sn, cn, dn], [arb(1), sn, -far * cn, far * dn]]

    @cached_property
    def _rows(self) -> tuple[tuple[tuple[str, list[arb]], ...], ...]:
        """Factors and amplitudes of the same four functions: of x beside u₁, of K + x."""
        one, two = ("S", alternate(self.odd)), ("C", self.odd)
        three, four = ("", self.even), ("", alternate(self.even))
        if self.hyperbolic:
            two, four = four, two
        return (four, one, two, three), (three, two, one, four)

    def function(self, N: Any, upper: bool, which: int) -> Series:
        """The series of the denominator θ (0), or of sn (1), cn (2) or dn (3) times it.

        They are functions of x counted from u₁, or, beside u₂, of K + x.
        """
        return self._series(N, *self._rows[upper][which], self._sizes[upper][which])

    def sweep(self, N: Any, v: arb, sign: int, beside: bool) -> Series:
        """The series of the sweep of a pole at v, near the turning point beside it or the other."""
        row, first, b = self.odd, 1, self.scale * v
        if self.hyperbolic and not beside:
            row, first = self.even, 0
        row = row[: self.terms(N.bits) if N.bits else None]
        turns = [(2 * k + first) * b for k in range(len(row))]
        if self.hyperbolic:  # −arg θ₁(b − iz), or −arg θ₄(b − iz)
            waves = [turn.sin_cos() for turn in turns]
        else:  # π/2 − arg θ₁(z + ib), or −arg θ₂(z + ib); both parts over cosh b
            deep = b.cosh()
            both = (turn.sinh_cosh() for turn in turns)
            waves = [(sinh / deep, cosh / deep) for sinh, cosh in both]
        sines, cosines = ([x * wave[i] for x, wave in zip(row, waves, strict=True)] for i in (0, 1))
        parts = ("S", alternate(cosines)), ("C", alternate(sines))
        if not beside:
            parts = ("S", sines), ("C", cosines)
            if self.hyperbolic:
                parts = ("SC", [-x for x in alternate(sines)]), ("", alternate(cosines))
        y, x = (self._series(N, *part) for part in parts)
        return lambda *at: sign * N.atan2(y(*at), x(*at))

    def step(self, v: arb, sign: int) -> arb:
        """The growth of a sweep between turning points, without a part proportional to time."""
        return sign * (arb.pi() / 2 - (self.scale * v if self.hyperbolic else 0))

    def _series(self, N: Any, factors: str, amplitudes: list[arb], size: Any = 1) -> Series:
        """The sum of the functions with these factors, times their amplitudes and a common size."""
        count = self.terms(N.bits) if N.bits else len(amplitudes)
        powers = arb_mat(1, count, amplitudes[:count]) * multiples(factors, count)
        rest = None if N.bits else size * self.rest
        first, *others = N.scaled(size, powers.entries()[::-1])

        def value(S: Any, C: Any, square: Any) -> Any:
            total = first
            for power in others:
                total = total * square
                total += power  # in place, which is faster
            total = total if rest is None else total + rest
            for name in factors:
                total = total * (S if name == "S" else C)
            return total

        return value


def alternate(amplitudes: list[arb]) -> list[arb]:
    """The amplitudes with every other sign changed."""
    return [-x if k % 2 else x for k, x in enumerate(amplitudes)]
