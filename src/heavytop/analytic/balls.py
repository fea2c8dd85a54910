"""The arithmetic of the closed form in balls of python-flint; `doubles` has the same functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from flint import arb

from heavytop.analytic.constants import Constants
from heavytop.analytic.roots import TooFewBits, floor, root_of, sign_of

bits: Final = None  # series take as many terms as the precision of the constants needs
atan2, sin_cos, sqrt = arb.atan2, arb.sin_cos, root_of


def number(x: arb, beside: Any = 0) -> arb:
    """A constant, unchanged."""
    return x


def scaled(size: Any, row: list[arb]) -> list[arb]:
    """Constants times a size."""
    return [size * x for x in row]


def to_number(x: arb) -> arb:
    """The result of `linear` as a number; here it is a ball already."""
    return x


def modulo_circle(x: arb) -> arb:
    """An angle less whole turns: its middle is in [0, 2π)."""
    circle = 2 * arb.pi()
    return x - circle * (x.mid() / circle).mid().floor()


def linear(start: arb, step: arb, rate: arb, slowest: Any = 0) -> Callable[..., arb]:
    """Return the function of n, t and further summands: start + n step + rate t + their sum."""
    return lambda n, t, *more: start + n * step + rate * t + sum(more, arb(0))


def half_sum(x: arb, y: arb, sign: int) -> arb:
    """Half of x ± y, which are results of `linear`."""
    return (x + sign * y) / 2


def nearest(c: Constants, z: Callable[..., arb]) -> Callable[[arb], tuple[Any, ...]]:
    """Return the function of t: the number of the nearest turning point, whether of u₂, and z."""

    def locate(t: arb) -> tuple[Any, ...]:
        if c.period is None:
            return 0, False, z(0, t)
        turning = 2 * (t / c.period) + c.x0 / c.half
        if not turning.rad() < 1e-3:  # the series are bounded half way to the next
            raise TooFewBits("the time and that of a turning point", turning)
        n = floor(turning.mid() + arb(0.5))
        return n, (n + c.first) % 2 == 1, z(n, t)

    return locate


def argument(z: arb, hyperbolic: bool) -> tuple[arb, arb, arb]:
    """The arguments of a `Series`: sin z, cos z, sin² z, or sinh z, cosh z, −sinh² z."""
    S, C = z.sinh_cosh() if hyperbolic else z.sin_cos()
    return S, C, -S * S if hyperbolic else S * S


def sides(upper: bool, z: arb, hyperbolic: bool) -> list[Any]:
    """For each side of turning points: the index of its times, whether of u₂, the arguments."""
    return [(None, upper, argument(z, hyperbolic))]


def join(upper: bool, parts: list[Any]) -> Any:
    """The values of all sides in one: here the only one."""
    return parts[0][1]


def sign(x: arb, at_zero: int) -> arb:
    """The sign of x; at x = 0, exactly at a pass through a pole, the sign just after it."""
    return arb(at_zero if x.is_zero() else sign_of(x, "the time and that of a pass through a pole"))


def length(least: arb, square: arb, leg: arb) -> arb:
    """√(least² + leg²)."""
    return root_of(square + leg * leg)


def cosine(one_minus_u: arb, one_plus_u: arb) -> arb:
    """The cosine of θ from its distances from ±1."""
    return (1 - one_minus_u).intersection(one_plus_u - 1)
