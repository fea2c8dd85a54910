"""A run in more than double precision held against the closed form, at its own digits.

As in double precision, the closed form starts from the run's own binary numbers, and what their
rounding does to the motion is told apart. A closed form costs milliseconds at a hundred digits
and a second at a thousand, so a few samples and events stand for all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.rising import Rising
from heavytop.errors import NoClosedForm
from heavytop.numbers.decimals import Context, Number, context
from heavytop.run.events import Event
from heavytop.run.high_precision import Decimals
from heavytop.run.trajectory import Trajectory
from heavytop.run.witness import Errors, motion_of, passing

LOOKED_AT = 8  # samples, and as many events
SPARE_DIGITS = 10  # of the closed form
LEAST = 5e-324  # the smallest double: an error that is not zero is not shown as zero

ANGLES = ("theta", "phi", "psi")
FOR_ATTITUDE = frozenset({"phi", "psi", "axis"})

Thing = TypeVar("Thing")


@dataclass(frozen=True, slots=True)
class DecimalErrors:
    """Largest differences as mpmath numbers, None where there is nothing to hold; see `Errors`."""

    off: dict[str, Number | None]
    energy: Number
    invariants: dict[str, Number]
    event_time: Number | None = None
    input_rounding: Number | None = None
    why_not: str = ""


@lru_cache(maxsize=1)
def decimal_errors(trajectory: Trajectory) -> DecimalErrors:
    """Return how far a trajectory with decimals is off the closed form of its own numbers."""
    decimals = _decimals(trajectory)
    energy, invariants = _changes(decimals)
    ctx = context(decimals.run.ctx.dps + SPARE_DIGITS)
    try:
        truth = ClosedForm(_own(trajectory, ctx.dps), decimals.digits + SPARE_DIGITS)
        pairs = [(sample, truth(ctx.mpf(sample.t))) for sample in _some(decimals.samples)]
    except NoClosedForm as reason:
        return DecimalErrors({}, energy, invariants, why_not=str(reason))
    apart = _Apart(ctx)
    exactly = trajectory.motion.form(decimals.digits + SPARE_DIGITS)
    last = exactly(ctx.mpf(decimals.samples[-1].t))
    wants = [n for n in ANGLES if n == "theta" or n in trajectory.scene.quantities]
    off = {name: _largest(apart.angle(name, *each) for each in pairs) for name in ANGLES}
    return DecimalErrors(
        off=off | {"axis": _largest(apart.axis(*each) for each in pairs)},
        energy=energy,
        invariants=invariants,
        event_time=_largest(_late(event, truth) for event in _some(decimals.events)),
        input_rounding=_largest(apart.angle(name, last, pairs[-1][1]) for name in wants),
    )


def rounded_errors(trajectory: Trajectory) -> Errors:
    """Return the errors as doubles; one smaller than any double is the smallest there is."""
    found = decimal_errors(trajectory)
    theta, phi, psi, axis = (_shown(found.off.get(name)) for name in (*ANGLES, "axis"))
    return Errors(
        theta=theta,
        phi=phi,
        psi=psi,
        axis=axis,
        energy=_shown(found.energy) or 0.0,
        invariants={name: _shown(x) or 0.0 for name, x in found.invariants.items()},
        event_time=_shown(found.event_time),
        input_rounding=_shown(found.input_rounding),
        why_not=found.why_not,
    )


def missed_decimals(trajectory: Trajectory) -> dict[str, float]:
    """Return the wanted quantities that are farther off than the scene's digits allow.

    So near a special motion that rounding turns a start into it, the motion of the run's own
    numbers is another one. What agrees with that of the exact numbers misses nothing.
    """
    decimals, off = _decimals(trajectory), decimal_errors(trajectory).off
    wants, end = set(trajectory.scene.quantities), decimals.samples[-1]
    wanted = wants | (FOR_ATTITUDE if "attitude" in wants else set())
    bound = decimals.run.ctx.mpf(10) ** -decimals.digits
    sizes = {name: getattr(end, name) for name in ANGLES} | {"axis": 1}
    allowed = {name: bound * max(1, abs(size or 0)) for name, size in sizes.items()}
    found = {
        name: _shown(error) or 0.0
        for name, error in off.items()
        if name in wanted and error is not None and error > allowed[name]
    }
    exactly = _off_exactly(trajectory, found) if found else {}
    return {n: x for n, x in found.items() if exactly[n] is None or exactly[n] > allowed[n]}


def _off_exactly(trajectory: Trajectory, names: Iterable[str]) -> dict[str, Any]:
    """Return how far a trajectory is off the motion of the scene's exact numbers."""
    decimals, motion = _decimals(trajectory), trajectory.motion
    ctx, truth = decimals.run.ctx, motion.form(decimals.digits + SPARE_DIGITS)
    apart = _Apart(ctx)
    pairs = [(sample, truth(ctx.mpf(sample.t))) for sample in _some(decimals.samples)]
    return {
        name: _largest(
            apart.axis(*each) if name == "axis" else apart.angle(name, *each) for each in pairs
        )
        for name in names
    }


@dataclass(frozen=True, slots=True)
class _Apart:
    """Differences of two records."""

    ctx: Context

    def angle(self, name: str, one: Record, other: Record) -> Number | None:
        a, b = getattr(one, name), getattr(other, name)
        if a != a:
            return None
        return abs(self.ctx.mpf(a) - b)

    def axis(self, one: Record, other: Record) -> Number | None:
        if one.axis[0] != one.axis[0]:
            return None
        return self.ctx.hypot(
            self.ctx.hypot(*(self.ctx.mpf(one.axis[i]) - other.axis[i] for i in (0, 1))),
            self.ctx.mpf(one.axis[2]) - other.axis[2],
        )


Record = Any  # Sample or ExactRecord: both have t, theta, phi, psi and axis


def _decimals(trajectory: Trajectory) -> Decimals:
    assert trajectory.decimals is not None
    return trajectory.decimals


def _own(trajectory: Trajectory, digits: int) -> Rising:
    """Return the motion that the run's own binary numbers define."""
    decimals = _decimals(trajectory)
    start, parameters = decimals.samples[0], decimals.run.parameters
    source = motion_of(trajectory.plan, digits, list(start.states), parameters)
    return Rising(passing(trajectory, source), proved=False)


def _changes(decimals: Decimals) -> tuple[Number, dict[str, Number]]:
    """Return the largest changes of the energy and of the other invariants, relative."""
    run = decimals.run
    every = [run.invariants(sample) for sample in _some(decimals.samples)]
    first = run.invariants(decimals.samples[0])
    p = run.parameters
    g = p["g"] if "g" in p else p["gMR"] / p["A"]
    changes = {n: max(abs(each[n] - first[n]) for each in every) for n in first}
    energy = changes.pop("energy") / (max(abs(first["energy"]), abs(g)) or 1)
    sizes = {name: abs(first[name]) for name in changes}
    return energy, {n: x / (sizes[n] if sizes[n] > run.grain else 1) for n, x in changes.items()}


def _late(event: Event, truth: ClosedForm) -> Number | None:
    """Return how far an event is off the true zero, by a Newton step [s]."""
    seen, r = truth(truth.ctx.mpf(event.sample.t)), truth.reduced
    if event.kind == "reversal":
        return abs((seen.u - r.a / r.b) / seen.udot) if r.b and seen.udot else None
    f_slope = 2 * r.b * (r.a - r.b * seen.u) - 2 * r.g * seen.one_minus_u * seen.one_plus_u
    uddot = f_slope / 2 - 2 * (r.h - r.g * seen.u) * seen.u
    return abs(seen.udot / uddot) if uddot else truth.ctx.zero


def _some(things: Sequence[Thing]) -> list[Thing]:
    """Return some, evenly spaced, the last among them."""
    every = max(1, len(things) // LOOKED_AT)
    return list(things[::-1][::every][::-1])


def _largest(values: Iterable[Number | None]) -> Number | None:
    return max((x for x in values if x is not None), default=None)


def _shown(x: Number | None) -> float | None:
    return None if x is None else max(float(x), LEAST) if x else 0.0
