"""The binary numbers from which a run starts, and their exact motion.

Every constant and state is rounded once from the exact number of the scene; a run is compared with
the motion of the rounded numbers. Here a state of any formulation is translated, exactly where that
is possible, into the numbers from which a closed form starts.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from flint import fmpq
from numpy.typing import NDArray

from heavytop.analytic.motion import ClosedForm, Motion
from heavytop.classification.reduced import (
    AxisMotion,
    ConstantMotion,
    PassingMotion,
    Reduced,
    ReducedMotion,
    StartMotion,
)
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import Rounded, exact_values, lambdify
from heavytop.errors import NoClosedForm
from heavytop.exact import Exact
from heavytop.exact.balls import exact_of, fmpq_of
from heavytop.exact.decimals import DOUBLE, Context, bits_of, context, digits_of, precision
from heavytop.exact.pairs import EPSILON, Array
from heavytop.integration.engine import TimedStates, engine, text
from heavytop.integration.orbit import Checkpoint, Integrator
from heavytop.integration.projection import GOLDEN
from heavytop.integration.system import number_of
from heavytop.run.plan import Plan
from heavytop.scene.scene import Scene
from heavytop.scene.state import State
from heavytop.scene.top import Top

ROOT_DIGITS = 40  # of square roots in the motion of a run in doubles
OWN_SPARE_DIGITS = 10  # of the exact motion, beyond those of a run in more digits than doubles
FEW_IN_DIGITS = 16  # samples and events compared in more digits, where a closed form takes long
SPREAD_TIMES, LATE_TIMES = 64, 16  # at which runs are compared: over the span, the last period


def start_values(scene: Scene) -> dict[str, Exact]:
    """The exact numbers of a scene by the names of the Lagrangian's symbols."""
    of_top = {name: getattr(scene.top, name) for name in ("A", "C", "gMR")}
    names = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")
    return of_top | {name: getattr(scene.start, name) for name in names}


def integrator_of(chosen: Plan, constants: dict[str, Any], start: Checkpoint) -> Integrator:
    """Return the integrator of a plan, set up for the constants and the start of a run."""
    bits = bits_of(chosen.precision)
    watched, tolerance = (chosen.watched, chosen.tolerance) if bits == DOUBLE else ((), EPSILON)
    compiled = engine(chosen.equations, watched, tolerance, bits)
    return Integrator(compiled, constants, start.state, projected=chosen.projected)


def binary_start(scene: Scene, chosen: Plan) -> tuple[dict[str, Any], Checkpoint]:
    """Return the constants and the start of a run, each rounded once from the exact number."""
    form, bits, numbers = chosen.equations, bits_of(chosen.precision), start_values(scene)
    number = number_of(bits)
    if bits == DOUBLE:
        values = _binary_numbers(form)(numbers)
    else:
        exact = exact_values((*form.parameters.values(), *form.start), numbers)
        ctx = context(digits_of(bits))
        values = [number(ctx.nstr(x.mpf(ctx), ctx.dps)) for x in exact]
    zero, constants = number(0), {p.name: v for p, v in zip(form.parameters, values, strict=False)}
    constants |= {name: number(rate) for name, rate in chosen.frame}
    state = np.array(values[len(form.parameters) :], type(zero))
    return constants, Checkpoint((zero, zero), state, 0)


@cache
def _binary_numbers(form: Formulation) -> Rounded:
    """Return the function from a scene's numbers to a formulation's constants and start."""
    return Rounded((*form.parameters.values(), *form.start))


# --- the exact motion of these numbers -----------------------------------------------------------


@dataclass(frozen=True, eq=False)
class BinaryMotion:
    """The exact motion of a run's binary numbers, taken through the poles that the scene passes.

    A rounded start makes the axis pass beside these poles. In the run φ and ψ turn there as for the
    exact numbers, and so they must in the motion with which it is compared.
    """

    plan: Plan
    motion: Motion
    constants: Mapping[str, Any]
    start: Any

    @cached_property
    def closed_form(self) -> ClosedForm:
        """The motion to any digits; raises NoClosedForm where there is none."""
        constants, state = self.constants, self.start.tolist()
        digits, bits = ROOT_DIGITS, precision(state[0])
        if bits > DOUBLE:
            digits = digits_of(bits) + OWN_SPARE_DIGITS
            numbers = context(digits).mpf
            constants = {name: numbers(text(x)) for name, x in constants.items()}
            state = [numbers(text(x)) for x in state]
        source = motion_of(self.plan, digits, state, constants)
        regime = self.motion.regime
        passed = not regime.misses_top, not regime.misses_bottom
        top, bottom = passed[::-1] if regime.mirrored else passed
        return ClosedForm(PassingMotion(source, top, bottom) if top or bottom else source)

    def at(self, seen: TimedStates) -> Any:
        """Return the motion in doubles at the times of some states, or None where there is none."""
        t = seen.t.astype(float)
        low = seen.t - t + seen.t_low  # of more digits: at a pole phi jumps within their rounding
        try:
            return self.closed_form.at(t, t_lo=low.astype(float))
        except NoClosedForm:
            return None


def motion_of(
    plan: Plan, digits: int, state: Iterable[Any], parameters: Mapping[str, Any]
) -> ReducedMotion:
    """Return the motion through a state of a plan's formulation, given as numbers of any kind.

    Sines, cosines, arctangents and square roots of them are computed to so many digits, the rest
    exactly.
    """
    form = plan.equations
    arguments = (*state, *(parameters[symbol.name] for symbol in form.parameters))
    values = _reader_of(form, digits)(*map(fmpq_of, arguments))
    read = SimpleNamespace(**dict(zip(form.reading, values, strict=True)))
    if "w" in form.reading:
        return _from_height(read, context(digits))
    if "e_x" in form.reading:
        axis, momentum = (read.e_x, read.e_y, read.e_z), (read.l_x, read.l_y, read.l_z)
        return AxisMotion(axis, momentum, read.g, read.kappa, read.phi_0, read.psi_0)
    angles_and_rates = {name: exact_of(x) for name, x in vars(read).items()}
    top = Top.of_numbers(*map(angles_and_rates.pop, ("A", "C", "gMR")))
    return StartMotion(top, State(**angles_and_rates))


@cache
def _reader_of(form: Formulation, digits: int) -> Any:
    """The `reading` of a formulation as a function of rational states and parameters."""
    ctx, arguments = context(digits), (*form.states, *form.parameters)

    def rounded(name: str) -> Any:
        function = getattr(ctx, name)
        return lambda *given: fmpq_of(function(*(exact_of(x).mpf(ctx) for x in given)))

    functions = {name: rounded(name) for name in ("sin", "cos", "sqrt", "atan2")}
    return lambdify((*form.reading.values(),), arguments, fmpq, functions)


def _from_height(read: Any, ctx: Context) -> ReducedMotion:
    """The motion of a run in the cubic form, ẅ = k₀ + k₁ w + k₂ w², through w and ẇ.

    ẇ² is a cubic in w, whose values at w = 0 and w = 2 are −P² and −(P + 2 side n)².
    """
    w, wdot, side, k = read.w, read.wdot, read.side, (read.k_0, read.k_1, read.k_2)

    def momentum(pole: int, given: fmpq) -> fmpq:
        rise = sum(each * (w**i - pole**i) / i for i, each in enumerate(k, 1))
        square = 2 * rise - wdot**2
        if square < 0:  # through the pole, within rounding
            return given
        root = fmpq_of(ctx.sqrt(exact_of(square).mpf(ctx)))
        return root if given >= 0 else -root

    P = momentum(0, read.P)
    n = side * (momentum(2, read.P + 2 * side * read.n) - P) / 2
    drift, sin2 = P + side * n * w, w * (2 - w)
    pull = k[0] + w * (k[1] + w * k[2])  # on a pole, where ẇ vanishes, this is the square of θ̇
    kinetic = (wdot**2 + drift**2) / (2 * sin2) if sin2 else abs(pull) / 2
    above, below = (w, 2 - w) if side > 0 else (2 - w, w)
    spin = read.omega3 - n  # κ = ω3 − p_ψ/A
    return ConstantMotion(
        Reduced(-side * k[2] / 3, n, 1 - above, above, below, -side * wdot, drift, kinetic, spin)
    )


# --- where a run is compared with it -------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SomeRows:
    """Some rows of a record; a column is cut out when it is read."""

    record: Any
    rows: Any

    def __getattr__(self, name: str) -> Any:
        return getattr(self.record, name)[self.rows]


@dataclass(frozen=True, slots=True)
class Records:
    """Records of a closed form, one for each time, read as columns of mpmath's numbers."""

    records: tuple[Any, ...]

    def __getattr__(self, name: str) -> Any:
        return np.array([getattr(record, name) for record in self.records], dtype=object)


def spread_places(count: int, most: int = FEW_IN_DIGITS) -> NDArray[np.intp]:
    """Return at most `most` evenly spaced indices out of `count`, the last among them."""
    every = max(1, -(-count // most))
    return np.arange((count - 1) % every, count, every)


def times_between(end: float, period: float | None) -> Array:
    """Return times at which every run is compared: over its span, and over its last period.

    Samples a whole number of periods apart would see every error at one phase only; at a turning
    point that hides an error in time.
    """
    spread = np.mod(np.arange(1, SPREAD_TIMES + 1) * GOLDEN, 1.0)
    late = math.copysign(min(abs(end), period or abs(end)), end)
    return np.concatenate((end * spread, end - late * spread[:LATE_TIMES]))
