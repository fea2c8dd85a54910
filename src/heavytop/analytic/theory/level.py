"""A level of the energy–momentum map: a motion from its constants, and its period lattice.

The motions of one E', p_φ, p_ψ run on one torus. Following the axis for one nutation and turning
the frame back by Δφ, the body by Δψ, comes back to where one was: with two whole turns that gives
the lattice of periods (0, 2π, 0), (0, 0, 2π) and (T, −Δφ, −Δψ).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from heavytop.analytic.theory.closed_form import MPForm, Nodding
from heavytop.analytic.theory.reduced import Reduced
from heavytop.numbers.decimals import Context, Number, number

if TYPE_CHECKING:
    from heavytop.scene.top import Top


class Advance(NamedTuple):
    """What one nutation brings.

    Attributes
    ----------
    period : Number
        T [s].
    precession, spin : Number
        Δφ and Δψ [rad], +π and ∓π for each exact pass through the top or the bottom.
    relative_spin : Number
        Δψ − κT [rad], κ = p_ψ (1/C − 1/A): without what a fast spin brings by itself.
    """

    period: Number
    precession: Number
    spin: Number
    relative_spin: Number


def motion(
    ctx: Context, top: Top, E_prime: Any, p_phi: Any, p_psi: Any, from_poles: tuple[Any, Any]
) -> Reduced:
    """The motion with these constants that passes through a tilt, which is shrinking there.

    Parameters
    ----------
    ctx : Context
        The precision.
    top : Top
        What spins.
    E_prime, p_phi, p_psi : object
        E' [J], p_φ and p_ψ [kg m² s⁻¹], each a number of any kind `number` takes.
    from_poles : tuple of 2 object
        1 − cosθ₀ and 1 + cosθ₀ where the motion passes, of which the smaller one counts; not 0.
        Where it does not reach that by a rounding, it turns back there.
    """
    A, C, gMR = (number(ctx, value) for value in (top.A, top.C, top.gMR))
    h, a, b = (number(ctx, value) / A for value in (E_prime, p_phi, p_psi))
    minus, plus = (number(ctx, value) for value in from_poles)
    minus, plus = (minus, 2 - minus) if minus < plus else (2 - plus, plus)
    u, g = (1 - minus if minus < plus else plus - 1), gMR / A
    drift, kinetic = a - b * u, h - g * u
    square = 2 * kinetic * minus * plus - drift**2
    rebuild = partial(
        motion, top=top, E_prime=E_prime, p_phi=p_phi, p_psi=p_psi, from_poles=from_poles
    )
    return Reduced(
        ctx, g, b, u, minus, plus, ctx.sqrt(square) if square > 0 else ctx.zero, drift, kinetic,
        ctx.zero, ctx.zero, b * A / C - b, rebuild,
    )  # fmt: skip


def advance(reduced: Reduced, digits: int = 20) -> Advance | None:
    """The period of a motion and what turns in it; None where nothing nutates.

    Parameters
    ----------
    reduced : Reduced
        The motion.
    digits : int
        Decimal digits.
    """
    form = MPForm(reduced, digits)
    path = form.orbit
    if not isinstance(path, Nodding):
        return None
    over = path.turn_plus - path.turn_minus
    return Advance(path.T, form.precession, form.spin, -over if reduced.g < 0 else over)
