"""A run in more than double precision, beside one in doubles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

from heavytop.alone import Alone
from heavytop.equations.formulation import Formulation
from heavytop.equations.lambdify import exact_values
from heavytop.integration.bits import bits_of
from heavytop.integration.following import (
    NOT_TOLD,
    Following,
    FollowingAttitude,
    FollowingAxis,
    Told,
)
from heavytop.integration.orbit import Orbit
from heavytop.integration.precise import Found, Mark, PreciseIntegrator, Walk, Wanted
from heavytop.integration.turns import Turns
from heavytop.integration.winding import Winding
from heavytop.numbers import Exact
from heavytop.numbers.decimals import Context, Number, context
from heavytop.run.decimals.reader import DecimalSample, Reader
from heavytop.run.planning import Plan

GRAIN_BITS = 24  # of a state that rounding may have spoilt
SPARE_DIGITS = 12  # of the numbers that quantities are formed in
LEAST_GRAIN = 1e-140  # whose square is a double


@dataclass(frozen=True, eq=False)
class PreciseRun:
    """An integration in more than double precision, which can be asked for any state.

    Attributes
    ----------
    reader : Reader
    engine : PreciseIntegrator
    orbit : Orbit
        The run in double precision.
    far, longest : float, float or None
        Bounds of a step, and of the first ones [s].
    marks : tuple of Mark
        States from which it can go on.
    """

    reader: Reader
    engine: PreciseIntegrator
    orbit: Orbit
    far: float
    longest: float | None
    marks: tuple[Mark, ...]
    _alone: Alone = field(default_factory=Alone, repr=False)

    @classmethod
    def of(cls, chosen: Plan, named: Mapping[str, Exact], orbit: Orbit) -> PreciseRun:
        """Return the start of a run.

        Parameters
        ----------
        chosen : Plan
        named : mapping from str to Exact
            The scene's numbers, by the symbols of the Lagrangian.
        orbit : Orbit
            The run in double precision.
        """
        form, bits = chosen.equations, bits_of(chosen.precision)
        ctx = context(int(bits * 0.30103) + SPARE_DIGITS)
        constants, state = rounded_start(form, named, ctx)
        constants |= {name: ctx.nstr(ctx.mpf(rate), ctx.dps) for name, rate in chosen.frame}
        own = form.integrated or form
        events = tuple(form.events) if chosen.watched else ()
        engine = PreciseIntegrator(own, bits, constants, events, state[: len(own.states)])
        rounded = {n: ctx.mpf(text) for n, text in engine.parameter_texts().items()}
        first = orbit.checkpoints[0]
        far = 4.0 * (orbit.end - first.time[0])
        longest = orbit.integrator.for_this_thread().cautious_step(first, far)
        engine.following, turned = _following(chosen, orbit, bits)
        start = replace(engine.start(state[: len(own.states)]), turned=turned)
        reader = Reader(form, ctx, rounded, ctx.ldexp(1, GRAIN_BITS - bits))
        return cls(reader, engine, orbit, far, longest, (start,))

    def wanted(self, t: Number, event: str | None = None) -> Wanted:
        """Return what to ask for at a time, or at the zero of an event function close to it."""
        ctx = self.reader.ctx
        return Wanted(ctx.nstr(ctx.mpf(t), ctx.dps), event)

    def walk(self, wanted: Sequence[Wanted], on_mark: Callable[[float], None] | None) -> Walk:
        """Take natural steps from the start until everything wanted is found."""
        with self._alone:
            return self.engine.walk(self.marks[0], wanted, self.far, self.longest, on_mark)

    def found(self, wanted: Sequence[Wanted]) -> tuple[Found | None, ...]:
        """Return what is wanted, from the marks before it."""
        found: list[Found | None] = [None] * len(wanted)
        order = sorted(range(len(wanted)), key=lambda i: self._mark_before(wanted[i]))
        for k, group in groupby(order, key=lambda i: self._mark_before(wanted[i])):
            indices = list(group)
            each = [wanted[i] for i in indices]
            with self._alone:
                walk = self.engine.walk(self.marks[k], each, self.far, self.longest)
            for i, one in zip(indices, walk.found, strict=True):
                found[i] = one
        return tuple(found)

    def _mark_before(self, wanted: Wanted) -> int:
        t, forward = self.engine.wide(wanted.t), 1 if self.far > 0 else -1
        before = [mark for mark in self.marks if (t - mark.t) * forward >= 0]
        return max(len(before) - 1, 0)

    def at(self, times: Sequence[Number]) -> tuple[DecimalSample, ...]:
        """Return the motion at times between start and end [s], in any order."""
        found = self.found([self.wanted(t) for t in times])
        return tuple(self.reader.sample(one) for one in found if one is not None)


def _following(chosen: Plan, orbit: Orbit, bits: int) -> tuple[Following | None, Told]:
    """Return what follows the turns of a plan, if they are no states, and the angles to begin."""
    first = orbit.checkpoints[0]
    known = max(2.0 ** (GRAIN_BITS - bits), LEAST_GRAIN), max(2.0 ** (-bits // 2), LEAST_GRAIN)
    if chosen.follows_phi:
        winding = Winding.of(orbit.parameters, first.state, *known)
        return FollowingAxis(winding), (float(orbit.samples.phi[0]), NOT_TOLD[1])
    if chosen.equations.integrated is None:
        return None, NOT_TOLD
    turns = Turns.of(orbit.parameters, *known)
    phi, psi = first.state[-2:].tolist()
    return FollowingAttitude(turns, turns.decided(first.state[:-2])), (phi, psi)


def rounded_start(
    form: Formulation, named: Mapping[str, Exact], ctx: Context
) -> tuple[dict[str, str], list[str]]:
    """Return the constants and the states of a start: exact numbers, rounded once."""
    expressions = (*form.parameters.values(), *form.start)
    texts = [ctx.nstr(v.mpf(ctx), ctx.dps) for v in exact_values(expressions, named)]
    count = len(form.parameters)
    names = (p.name for p in form.parameters)
    return dict(zip(names, texts[:count], strict=True)), texts[count:]
