"""sn, cn, dn and the angle of a theta function in doubles, by series in the nome.

With z = π x/2K and the nome q of m, or for m > ½ by Jacobi's imaginary transformation with
z = π x/2K' and the nome of 1 − m, the series

    θ₁ = Σ (−1)ⁿ qⁿ⁽ⁿ⁺¹⁾ s₂ₙ₊₁,   θ₂ = Σ qⁿ⁽ⁿ⁺¹⁾ c₂ₙ₊₁,   θ₃, θ₄ = 1 + 2 Σ (±1)ⁿ qⁿⁿ c₂ₙ

(θ₁ and θ₂ without their factor 2 q^¼) are the same for sₖ, cₖ = sin kz, cos kz (m ≤ ½) and for
sinh kz, cosh kz (m > ½). Each is a polynomial in S² or −S², S = s₁, times S and C = c₁ or not.
Arguments never reach farther than half way to the next turning point, so that q ≤ e^−π makes four
terms enough for a double. Where m is 0 or 1 so is q, and one term is exact.

Beside the real line the argument of a theta function is the angle by which φ turns where the axis
passes a pole of the sphere. Reference: *NIST Digital Library of Mathematical Functions*, chapters
20 and 22.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, cosh, sin, sinh
from operator import mul
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
from flint import arb

from heavytop.exact.pairs import Array

_TINY: Final = 1e-19  # what the terms that are left out add up to, beside the first
_FARTHEST: Final = 700.0  # z whose sinh is a double; sech is nothing beyond
_BIG: Final = 1e300  # the nome has made nothing of such squares long before
_DEEP: Final = 100.0  # b whose tanh is 1, and beyond which the terms but the first are nothing

_POLYNOMIALS: Final = {
    "S": ((0, 0, 0, -64), (0, 0, 16, 112), (0, -4, -20, -56), (1, 3, 5, 7)),
    "C": ((0, 0, 0, -64), (0, 0, 16, 80), (0, -4, -12, -24), (1, 1, 1, 1)),
    "": ((0, 0, 0, -32), (0, 0, 8, 48), (0, -2, -8, -18), (1, 1, 1, 1)),
    "SC": ((0, 0, 0, 0), (0, 0, 0, 32), (0, 0, -8, -32), (0, 2, 4, 6)),
}
"""sin (2n+1)z/S, cos (2n+1)z/C, cos 2nz and sin 2nz/SC, n = 0 … 3: their coefficients of S⁶ … 1."""


class Argument(NamedTuple):
    """S, C and S², or −S² where they are hyperbolic, of many arguments z."""

    S: Array
    C: Array
    square: Array


class Series(NamedTuple):
    """A polynomial in S², the highest power first, times those of S and C that are named."""

    factors: str
    powers: list[float]

    @classmethod
    def of(cls, factors: str, amplitudes: Sequence[float]) -> Series:
        """The sum with such amplitudes of the functions that have the factors."""
        columns = _POLYNOMIALS[factors][-len(amplitudes) :]
        return cls(factors, [sum(map(mul, amplitudes, column)) for column in columns])

    def times(self, size: float) -> Series:
        """The product with a number."""
        return Series(self.factors, [size * power for power in self.powers])

    def __call__(self, at: Argument) -> Any:
        """The sum; one number where it is the same for all arguments."""
        total: Any = self.powers[0]
        for power in self.powers[1:]:
            total = total * at.square + power
        for name in self.factors:
            total = total * getattr(at, name)
        return total


Sweep: TypeAlias = Callable[[Argument], Array]
"""The angle [rad] of a theta function along a line beside the real one, zero at z = 0."""


class ThetaSeries:
    """sn, cn, dn and the sweeps of one parameter m, beside either turning point.

    Parameters
    ----------
    m, mc : arb
        The parameter and 1 − m. To be used inside ``working(bits)``.

    Attributes
    ----------
    scale, half : arb
        z over x, and the z from one turning point to the next; 0 where m = 1 and there is no next.
    """

    def __init__(self, m: arb, mc: arb) -> None:
        self._hyperbolic = bool(m > mc)
        means = arb(1).agm(mc.sqrt()), arb(1).agm(m.sqrt())  # π/2K and π/2K'
        self.scale, other = reversed(means) if self._hyperbolic else means
        ratio, root_q = arb(0), arb(0)
        if not other.is_zero():
            ratio = self.scale / other
            root_q = (-arb.pi() / 2 * ratio).exp()
        self.half = arb.pi() / 2 * (ratio if self._hyperbolic else 1)
        count = range(_terms(float(root_q)))
        odd = [root_q ** (2 * n * (n + 1)) for n in count]
        even = [root_q ** (2 * n * n) * (2 if n else 1) for n in count]
        self._odd, self._even = ([float(a) for a in each] for each in (odd, even))
        one, two = Series.of("S", _alternating(self._odd)), Series.of("C", self._odd)
        three, four = Series.of("", self._even), Series.of("", _alternating(self._even))
        far = 1.0
        at_0 = sum(odd, arb(0)), sum(even, arb(0)), sum(even[::2], arb(0)) - sum(even[1::2], arb(0))
        second, third, fourth = at_0
        if self._hyperbolic:
            two, four, far, second, fourth = four, two, 4 * float(root_q), fourth, second
        sn, cn, dn = map(float, (third / second, fourth / second, fourth / third))
        lower = four, one.times(sn), two.times(cn), three.times(dn)
        upper = three, two.times(sn), one.times(-far * cn), four.times(far * dn)
        self._functions = lower, upper

    def argument(self, z: Array, low: Array) -> Argument:
        """What the series are made of, at z + low; where a square overflows it does not count."""
        if self._hyperbolic:
            z = np.clip(z, -_FARTHEST, _FARTHEST)
            S, C = np.sinh(z), np.cosh(z)
            S, C = S + C * low, C + S * low
            return Argument(S, C, np.maximum(-S * S, -_BIG))
        S, C = np.sin(z), np.cos(z)
        S, C = S + C * low, C - S * low
        return Argument(S, C, S * S)

    def functions(self, at: Argument, upper: bool, count: int = 3) -> list[Array]:
        """sn, cn and dn, or the first of them, of x (lower point) or K + x (upper)."""
        under, *over = (series(at) for series in self._functions[upper][: count + 1])
        return [each / under for each in over]

    def sweeps(self, v: arb, sign: int) -> tuple[tuple[Sweep, ...], arb]:
        """The sweeps of a pole at the distance v from the real line of x, 0 < v ≤ K'.

        Returns
        -------
        tuple of Sweep
            π/2 − arg θ₁(z + ib) and −arg θ₂(z + ib), times the sign, up to a multiple of z, where
            b is `scale` v: about the turning point beside the pole, and about the other.
        arb
            What the angle grows by from one turning point to the next, but for that multiple.
        """
        depth, step = self.scale * v, arb.pi() / 2
        b, odd, even = min(float(depth), _DEEP), self._odd, self._even
        if self._hyperbolic:  # −arg θ₁(b − iz) and −arg θ₄(b − iz)
            step -= depth
            sines, cosines = (
                [a * of((2 * n + 1) * b) for n, a in enumerate(odd)] for of in (sin, cos)
            )
            own = ("S", _alternating(cosines)), ("C", _alternating(sines))
            sines, cosines = ([a * of(2 * n * b) for n, a in enumerate(even)] for of in (sin, cos))
            other = ("SC", [-a for a in _alternating(sines)]), ("", _alternating(cosines))
        else:
            sines, cosines = (
                [a * (of((2 * n + 1) * b) / cosh(b)) for n, a in enumerate(odd)]
                for of in (sinh, cosh)
            )
            own = ("S", _alternating(cosines)), ("C", _alternating(sines))
            other = ("S", sines), ("C", cosines)
        return (_angle(sign, *own), _angle(sign, *other)), sign * step


def _alternating(series: Sequence[float]) -> list[float]:
    return [-a if n % 2 else a for n, a in enumerate(series)]


def _angle(sign: int, *parts: tuple[str, Sequence[float]]) -> Sweep:
    sine, cosine = (Series.of(*part) for part in parts)
    return lambda at: sign * np.arctan2(sine(at), cosine(at))


def _terms(root_q: float) -> int:
    """How many terms the series need."""
    n = 1
    while root_q ** (n * (2 * n - 1)) > _TINY:
        n += 1
    return n
