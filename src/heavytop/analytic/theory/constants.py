"""Constants of the motion: the energies E and E' and the momenta p_φ and p_ψ."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Context, Number, number

if TYPE_CHECKING:
    from heavytop.scene.state import State
    from heavytop.scene.top import Top


@dataclass(frozen=True, slots=True)
class Constants:
    """Energies E, E' = E − p_ψ²/2C and momenta p_φ, p_ψ.

    Parameters
    ----------
    E, E_prime : Number
        Energy, and energy without that of the spin [J].
    p_phi, p_psi : Number
        Momenta about the vertical and about the symmetry axis [kg m² s⁻¹].

    Notes
    -----
    They are numbers of many digits (mpmath's ``mpf``): ``float(constants.E)`` is one as a float,
    `floats` all of them, and an f-string shows as many digits as it asks for.
    """

    E: Number
    E_prime: Number
    p_phi: Number
    p_psi: Number

    def items(self) -> tuple[tuple[str, Number], ...]:
        """The four constants with their names."""
        return tuple((field.name, getattr(self, field.name)) for field in fields(self))

    @property
    def floats(self) -> dict[str, float]:
        """The four constants as floats, by name."""
        return {name: float(value) for name, value in self.items()}


def constants(ctx: Context, top: Top, start: State) -> Constants:
    """The constants E, E', p_φ, p_ψ of the motion of `top` from `start`.

    Parameters
    ----------
    ctx : Context
        The precision they are computed at.
    top : Top
        What spins.
    start : State
        How it starts.
    """
    reduced = Reduced.from_scene(ctx, top, start)
    A, C, omega3 = (number(ctx, value) for value in (top.A, top.C, start.omega3))
    E_prime, p_psi = A * reduced.h, C * omega3
    return Constants(E_prime + p_psi * omega3 / 2, E_prime, A * reduced.a, p_psi)
