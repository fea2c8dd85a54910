"""Where the top is and how it moves at one time, in balls or in mpmath numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

from flint import arb

from heavytop.analytic.cubic import root_of
from heavytop.numbers.decimals import Number


@dataclass(frozen=True, slots=True)
class ExactRecord:
    """Where the top is and how it moves at one time, in mpmath numbers.

    Parameters
    ----------
    t : Number
        Time since the start [s].
    theta, phi, psi : Number
        Euler angles [rad]; φ and ψ continuous from the start, never reduced.
    thetadot, phidot, psidot : Number
        Their rates [rad/s].
    u, one_minus_u, one_plus_u, udot : Number
        cos θ, 1 ∓ cos θ to their own digits, and d cos θ/dt [s⁻¹].
    axis : tuple of 3 Number
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    n : int
        The period of the nutation, counted from the one whose u₁ is nearest the start.
    omega3, energy : Number
        What is constant: the angular velocity about the symmetry axis [rad/s], and E [J], which
        `Motion.at` knows; None where the moments are not known.
    """

    t: Number
    theta: Number
    phi: Number
    psi: Number
    thetadot: Number
    phidot: Number
    psidot: Number
    u: Number
    one_minus_u: Number
    one_plus_u: Number
    udot: Number
    axis: tuple[Number, Number, Number]
    n: int
    omega3: Number = None
    energy: Number = None

    @property
    def quaternion(self) -> tuple[Number, Number, Number, Number]:
        """The attitude, body to space, scalar first."""
        cosine, sine = _root(self.one_plus_u / 2), _root(self.one_minus_u / 2)
        sin_plus, cos_plus = _sin_cos((self.phi + self.psi) / 2)
        sin_minus, cos_minus = _sin_cos((self.phi - self.psi) / 2)
        return cosine * cos_plus, sine * cos_minus, sine * sin_minus, cosine * sin_plus

    @property
    def omega(self) -> tuple[Number, Number, Number]:
        """The angular velocity in space [rad/s]: ω₃ along the axis, and e × ė."""
        sine, (sin, cos) = _root(self.one_minus_u * self.one_plus_u), _sin_cos(self.phi)
        across = (self.omega3 - self.phidot * self.u) * sine
        upright = self.omega3 * self.u + self.phidot * sine * sine
        return self.thetadot * cos + across * sin, self.thetadot * sin - across * cos, upright


def each(kind: Callable[[arb], Any], found: Any) -> Any:
    """What was found, a ball, a tuple, a record or None, with every ball turned into `kind`."""
    if isinstance(found, arb):
        return kind(found)
    if isinstance(found, tuple):
        return tuple(each(kind, part) for part in found)
    if isinstance(found, ExactRecord):
        return ExactRecord(*(each(kind, getattr(found, field.name)) for field in fields(found)))
    return found


def _root(x: Any) -> Any:
    return root_of(x) if isinstance(x, arb) else x.sqrt()


def _sin_cos(x: Any) -> tuple[Any, Any]:
    return x.sin_cos() if isinstance(x, arb) else (x.context.sin(x), x.context.cos(x))
