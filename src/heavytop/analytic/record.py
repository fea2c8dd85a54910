"""Where the top is at given times, in doubles or in mpmath numbers of any digits."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from flint import arb

from heavytop.analytic.form import FORMULAS
from heavytop.exact.decimals import Context, Number, binary, context
from heavytop.scene.quantities import quantity_of, values_of

if TYPE_CHECKING:
    from heavytop.analytic.motion import ClosedForm

Read = Callable[[str], Any]

BALL_SPARE_DIGITS: Final = 2  # that a ball has beyond those asked for
SHOWN_DIGITS: Final = 10  # that a number has beyond those asked for
SHOWN_NAMES: Final = ("t", "theta", "phi", "psi")
RECORD_NAMES: Final = ("t", "energy", *FORMULAS)


class Record:
    """Where the top is and how it moves, each quantity computed when it is first read.

    Made by `Motion.at`: numbers are arrays of doubles, of the shape of the times, vectors with one
    axis more; or mpmath numbers, vectors tuples of them.

    Attributes
    ----------
    t : number
        Time since the start [s].
    theta, phi, psi : number
        Euler angles [rad]; φ and ψ continuous from the start, never reduced.
    phi_mod, psi_mod : number
        φ and ψ modulo 2π, to the digits they have even after 1e9 periods [rad].
    thetadot, phidot, psidot : number
        Their rates [rad/s].
    u, one_minus_u, one_plus_u, udot, uddot : number
        cos θ, 1 ∓ cos θ to their own digits, d cos θ/dt [s⁻¹] and d² cos θ/dt² [s⁻²].
    axis : vector of 3
        Unit vector along the symmetry axis, (sin θ sin φ, −sin θ cos φ, cos θ).
    quaternion : vector of 4
        The attitude, body to space, scalar first, continuous from the start.
    omega : vector of 3
        The angular velocity in space [rad/s].
    omega3, energy : number
        What is constant: the angular velocity about the symmetry axis [rad/s], and E [J].

    It has what follows from these too, such as `reaction` of a top with mass and distance [N].
    """

    def __init__(self, read: Read, made: tuple[Any, ...]) -> None:
        self._read, self._made = read, made

    def __reduce__(self) -> tuple[Any, ...]:
        return self._made

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={getattr(self, name)}" for name in SHOWN_NAMES)
        return f"<Record: {shown}>"

    def __dir__(self) -> tuple[str, ...]:
        return RECORD_NAMES

    def __getattr__(self, name: str) -> Any:
        if quantity_of(name).of is not None:
            motion = self._made[0].__self__  # whose method made the record
            value = values_of(self, name, motion)
        elif name in RECORD_NAMES:
            value = self._read(name)
        else:
            raise AttributeError(name)
        self.__dict__[name] = value
        return value


def read_digits(motion: ClosedForm, t: Any, digits: int) -> Read:
    """The numbers of a motion at a time, to so many digits."""
    ball = motion.reader(t, digits + BALL_SPARE_DIGITS)
    return lambda x: motion.energy(digits) if x == "energy" else to_mpf(ball(x), digits)


def to_mpf(found: Any, digits: int) -> Any:
    """A ball, a tuple of balls or None, as mpmath numbers with so many digits."""
    ctx = context(digits + SHOWN_DIGITS)
    return mapped(lambda x: midpoint(ctx, x), found)


def midpoint(ctx: Context, ball: arb) -> Number:
    """The middle of a ball; 0 where the ball cannot be separated from it."""
    return ctx.zero if ball.rel_accuracy_bits() <= 0 else binary(ctx, *ball.mid().man_exp())


def mapped(number: Callable[[arb], Any], found: Any) -> Any:
    """What was found, each of its balls in other numbers."""
    if isinstance(found, tuple):
        return tuple(mapped(number, x) for x in found)
    if isinstance(found, dict):
        return {name: mapped(number, x) for name, x in found.items()}
    return number(found) if isinstance(found, arb) else found
