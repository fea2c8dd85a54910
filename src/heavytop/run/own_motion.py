"""The motion that a run's own numbers define: of its start and its constants, as it has them.

Each number of a scene is rounded once, and the run is that of the rounded ones. What a state of any
formulation stands for is said here in numbers that a closed form begins with, exactly where it can
be.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from heavytop.analytic.motion import ClosedForm, Motion
from heavytop.classification.reduced import (
    Reduced,
    ReducedMotion,
    reduced_from_axis,
    reduced_from_constants,
    reduced_from_scene,
    through_poles,
)
from heavytop.equations.registry import FORMULATIONS
from heavytop.errors import NoClosedForm
from heavytop.exact.balls import rational
from heavytop.exact.decimals import Context, context, number
from heavytop.integration.bits import DOUBLE, digits_of, precision
from heavytop.integration.engine import Seen, text
from heavytop.run.planning import Plan
from heavytop.scene.state import State
from heavytop.scene.top import Top

if TYPE_CHECKING:
    from heavytop.run.trajectory import Trajectory

DIGITS = 40  # of roots that a motion in doubles is known by
SPARE_DIGITS = 10  # beyond those of a run in more digits

Known = Mapping[str, Fraction]  # states and constants by the names of their symbols


@dataclass(frozen=True, eq=False)
class OwnMotion:
    """The exact motion of a run's own numbers, through the poles that the scene's passes.

    Rounding the start puts the axis beside them. A run turns there as the exact numbers do, and so
    must what it is compared with.
    """

    plan: Plan
    motion: Motion
    constants: Mapping[str, Any]
    start: Any

    @cached_property
    def closed_form(self) -> ClosedForm:
        """It, to any digits; a NoClosedForm where there is none."""
        constants, state = self.constants, self.start.tolist()
        digits, bits = DIGITS, precision(state[0])
        if bits > DOUBLE:
            digits = digits_of(bits) + SPARE_DIGITS
            numbers = context(digits).mpf
            constants = {name: numbers(text(x)) for name, x in constants.items()}
            state = [numbers(text(x)) for x in state]
        source = motion_of(self.plan, digits, state, constants)
        regime = self.motion.regime
        passed = not regime.misses_top, not regime.misses_bottom
        top, bottom = passed[::-1] if regime.mirrored else passed
        return ClosedForm(through_poles(source, top, bottom) if top or bottom else source)

    def at(self, seen: Seen) -> Any:
        """Return it in doubles at the times of some states, or None where there is none."""
        try:
            return self.closed_form.at(seen.t.astype(float), t_lo=seen.t_low.astype(float))
        except NoClosedForm:
            return None


def own_motion(trajectory: Trajectory) -> ClosedForm:
    """Return the motion of a run's own numbers."""
    return trajectory.own.closed_form


def motion_of(
    plan: Plan, digits: int, state: Iterable[Any], parameters: Mapping[str, Any]
) -> ReducedMotion:
    """Return the motion through a state of a plan's formulation, given as numbers of any kind.

    Where it is known by roots of them these are taken to as many digits.
    """
    names = (symbol.name for symbol in plan.equations.states)
    given = (*parameters.items(), *zip(names, state, strict=True))
    known = {name: Fraction(x) if type(x) is float else rational(x) for name, x in given}
    entry = FORMULATIONS[plan.formulation]
    return READERS[entry.written_in](known, context(digits), plan.variant)


def _from_angles(known: Known, ctx: Context, _: str | None) -> ReducedMotion:
    """The motion from Euler angles and their rates; Routh's form has momenta for two of these."""
    phi, psi = (known[name if name in known else f"{name}_0"] for name in ("phi", "psi"))
    if "p_minus" in known:
        sine, half = (ctx.sin(number(ctx, x)) for x in (known["theta"], known["theta"] / 2))
        p_minus, p_psi, A = (number(ctx, known[name]) for name in ("p_minus", "p_psi", "A"))
        phidot = rational((p_minus + 2 * p_psi * half**2) / (A * sine**2))
        rates = {"phidot": phidot, "omega3": known["p_psi"] / known["C"]}
    else:
        rates = {name: known[name] for name in ("phidot", "psidot")}
    start = State(known["theta"], phi=phi, psi=psi, thetadot=known["thetadot"], **rates)
    return reduced_from_scene(Top.of_numbers(*(known[name] for name in ("A", "C", "gMR"))), start)


def _from_axis(known: Known, *_: Any) -> ReducedMotion:
    """The motion from the axis, or a quaternion q whose |q|² is the length of it."""
    if "q_0" in known:
        w, x, y, z = (known[f"q_{i}"] for i in range(4))
        axis = 2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z
    else:
        axis = known["e_x"], known["e_y"], known["e_z"]
    momentum = [known[f"l_{x}"] for x in "xyz"]
    return reduced_from_axis(axis, momentum, *(known[x] for x in ("g", "kappa", "phi_0", "psi_0")))


def _from_height(known: Known, ctx: Context, pole: str | None) -> ReducedMotion:
    """The motion from ẅ = k₀ + k₁ w + k₂ w² through w and ẇ, as the run integrates it.

    At w = 0 and w = 2 the cubic that is ẇ² has the values −P² and −(P + 2 side n)².
    """
    w, wdot, side = known["w"], known["wdot"], 1 if pole == "top" else -1
    k = [known[f"k_{i}"] for i in range(3)]

    def momentum(pole: int, given: Fraction) -> Fraction:
        rise = sum(each * (w**i - Fraction(pole) ** i) / i for i, each in enumerate(k, 1))
        square = 2 * rise - wdot**2
        if square < 0:  # through the pole, within rounding
            return given
        root = rational(ctx.sqrt(number(ctx, square)))
        return root if given >= 0 else -root

    P = momentum(0, known["P"])
    n = side * (momentum(2, known["P"] + 2 * side * known["n"]) - P) / 2
    drift, sin2, zero = P + side * n * w, w * (2 - w), Fraction(0)
    pull = k[0] + w * (k[1] + w * k[2])  # on a pole, where ẇ vanishes, this is the square of θ̇
    kinetic = (wdot**2 + drift**2) / (2 * sin2) if sin2 else abs(pull) / 2
    above, below = (w, 2 - w)[::side]
    spin = known["omega3"] - n  # κ = ω3 − p_ψ/A
    motion = Reduced(-side * k[2] / 3, n, 1 - above, above, below, zero, drift, kinetic, spin)
    return reduced_from_constants(motion, wdot**2, falls=side * wdot > 0)


READERS: Final = {"axis": _from_axis, "angles": _from_angles, "height": _from_height}
"""By what the states of a formulation are; see `FormulationEntry`."""
