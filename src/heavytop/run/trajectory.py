"""A trajectory: the integrated motion of a scene, at samples, at events and at any time between.

Samples and events of a run in more digits than doubles have are given rounded to doubles too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.analytic.motion import ClosedForm
from heavytop.errors import Impossible, Outcome
from heavytop.exact.decimals import DOUBLE, Context, Number, context, digits_of, number
from heavytop.exact.pairs import EPSILON, Array
from heavytop.integration import outputs
from heavytop.integration.engine import TimedStates, reals, text
from heavytop.integration.orbit import Orbit
from heavytop.integration.outputs import Sample, sample, times_of
from heavytop.run.binary_motion import (
    OWN_SPARE_DIGITS,
    BinaryMotion,
    Records,
    SomeRows,
    spread_places,
    times_between,
)
from heavytop.run.events import Events, events_of
from heavytop.run.exact import Run
from heavytop.run.plan import Statistics
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.text import Played

START_ROUNDING = 4 * EPSILON


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Run, Played):
    """The motion of a scene, integrated.

    Call it with a time between start and end [s], or an array of them in any order, shape (k,),
    and it returns a `Sample` of as many. Only the start of each block of steps is kept in memory:
    the block that holds a time is run again, bit for bit.

    Attributes
    ----------
    scene : Scene
        What was run.
    motion : Motion
        The exact motion of the scene, with which the run is compared.
    plan : Plan
        How it was integrated.
    statistics : Statistics
        Number of steps, and computing times.
    orbit : Orbit
        States, checkpoints and zeros of event functions, in the numbers of the integrator.
    with_events : bool
        Whether `events` are looked for; False of a part that is saved while the run goes on.
    events : Events
        Turning points, reversals and cusps, as far as the scene asked for them.
    source : str
        ``integrated``; a `SceneMotion` has ``closed form``.

    Examples
    --------
    >>> import heavytop as ht
    >>> trajectory = ht.propagate(ht.load_scene("sicm-kicked"))
    >>> print(f"{trajectory(2.0).theta:.12f}")
    0.426943705310
    """

    orbit: Orbit
    statistics: Statistics
    with_events: bool = True
    source: ClassVar[str] = "integrated"

    def __repr__(self) -> str:
        name = self.scene.title or self.scene.name
        return (
            f"<Trajectory of {name!r}: {self.plan.formulation}, 0 to {self.orbit.end:g} s, "
            f"{self.t.size} samples, {len(self.events)} events, {self.outcome}>"
        )

    def __call__(self, t: ArrayLike) -> Sample:
        """Return the motion at a time, or at times of shape (k,), between start and end [s].

        Raises
        ------
        NotANumber
            A time that is not finite; more than one dimension.
        Impossible
            A time that is not between start and end.
        """
        times = times_of(t)
        found = round_sample(self._motion_at(times.reshape(-1)))
        return found if times.ndim else found.at(0)

    def _motion_at(self, t: Array) -> Sample:
        """The motion at times, in the numbers of the run."""
        ends = (self.orbit.end, *map(float, self.orbit.samples.t[-1:]))
        # in more digits the last sample may be an ulp behind the end, which is a double
        low, high = sorted((0.0, max(ends, key=abs)))
        times = t.astype(np.float64)
        if times.size and (times.min() < low or times.max() > high):
            rule = f"between {low} and {high}, where the trajectory was integrated"
            raise Impossible([("t", rule)])
        return self.read(self.orbit.at(t))

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        return self.orbit.outcome

    @cached_property
    def binary_motion(self) -> BinaryMotion:
        """The exact motion of the binary numbers from which the run starts."""
        orbit = self.orbit
        return BinaryMotion(self.plan, self.motion, orbit.parameters, orbit.checkpoints[0].state)

    @property
    def bits(self) -> int:
        """Bits in the significand of the run's numbers."""
        return self.orbit.integrator.engine.bits

    @property
    def in_doubles(self) -> bool:
        """Whether its numbers are doubles."""
        return self.bits == DOUBLE

    @cached_property
    def end(self) -> Sample:
        """The motion at the end, in doubles or in numbers of `ctx`."""
        if self.in_doubles:
            return self(self.orbit.end)
        return self.raw_samples.at(-1).mapped(self.numbers)

    def in_mpmath(self, t: Any = None) -> Sample:
        """Return the motion in mpmath's numbers, with all the digits of the run.

        Parameters
        ----------
        t : number or sequence of numbers, of any kind, optional
            Times between start and end [s]; by default those of the samples.

        Raises
        ------
        NotANumber, Impossible
            As for a call with these times.

        Examples
        --------
        >>> import heavytop as ht
        >>> run = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=30"]))
        >>> run.ctx.nstr(run.in_mpmath("1/3").theta, 30)
        '0.481108315235354695680080734662'
        """
        if t is None:
            return self.raw_samples.mapped(self.numbers)
        one = isinstance(t, str) or not hasattr(t, "__len__")
        times = np.array([*map(self.nearest, [t] if one else t)], self.orbit.samples.t.dtype)
        found = self._motion_at(times).mapped(self.numbers)
        return found.at(0) if one else found

    def numbers(self, column: Any) -> Any:
        """Return an array of the run's numbers as one of numbers of `ctx`.

        Parameters
        ----------
        column : ndarray
        """
        with np.errstate(invalid="ignore"):  # nan
            return np.frompyfunc(self.number, 1, 1)(column)

    def read(self, seen: TimedStates) -> Sample:
        """Return the motion at states of the orbit, in the numbers of the run.

        Where states give phi and psi modulo 2 pi, whole turns are those of the closed form.

        Parameters
        ----------
        seen : TimedStates
            States and their times.
        """
        form, constants, plan = self.orbit.integrator.formulation, self.orbit.parameters, self.plan
        follows = form.phi_wraps and plan.variant is not None
        near = self._exact_at(seen) if follows else None
        found = sample(form, seen.states, constants, seen.t, near)
        if form.phi_wraps and not follows:
            unknown = np.full(seen.t.shape, np.nan)
            found = replace(found, phi=unknown, psi=unknown)
        at_start = seen.t == 0
        return self._put_start(found, at_start) if self.in_doubles and at_start.any() else found

    def _put_start(self, found: Sample, at_start: NDArray[np.bool_]) -> Sample:
        """Return a sample with the scene's own angles and rates at time 0, if within rounding."""
        columns = {}
        for names, least in ((ANGLES, 1.0), (RATES, 0.0)):  # rates have no natural size
            start = [float(getattr(self.scene.start, name)) for name in names]
            rounding = START_ROUNDING * max(least, *map(abs, start))
            for name, exact in zip(names, start, strict=True):
                column = getattr(found, name)
                equal = at_start & (abs(column - exact) <= rounding)
                columns[name] = np.where(equal, exact, column)
        return replace(found, **columns)

    def _exact_at(self, seen: TimedStates) -> Any:
        """The exact motion of the run's binary numbers, in doubles; None where there is none."""
        return self._exact if seen is self._recorded else self.binary_motion.at(seen)

    @cached_property
    def _recorded(self) -> TimedStates:
        """All recorded states of the orbit: at samples, at times between them, at zeros."""
        return TimedStates.join([self.orbit.samples, self.orbit.between, *self.orbit.hits])

    @cached_property
    def _exact(self) -> Any:
        """The exact motion at all recorded states."""
        return self.binary_motion.at(self._recorded)

    @property
    def exact_events(self) -> tuple[SomeRows, Array]:
        """The exact motion at the recorded states of the events, in doubles.

        And how much later than these the times of the events are [s].
        """
        found, there = self.events, self._recorded.where(self.events.place)
        later = (found.t - there.t) + (found.t_low - there.t_low)
        return SomeRows(self._exact, found.place), later

    @cached_property
    def readings(self) -> Sample:
        """The motion at all recorded states, those at samples, at times between them, at zeros."""
        return self.read(self._recorded)

    @cached_property
    def events(self) -> Events:
        """Turning points, reversals and cusps, as far as the scene asked for them."""
        return events_of(self)

    def exact(self, motion: ClosedForm, t: Any, t_low: Any = 0.0) -> Any:
        """Return a closed form at times, in doubles or in more digits than the scene wants.

        Parameters
        ----------
        motion : ClosedForm
            Of the run's own start, or the scene's.
        t, t_low : ndarray
            Times as the run has them, and their low words [s].
        """
        if self.in_doubles:
            return motion.at(t, t_lo=t_low)
        return Records(motion.at(t, self.scene.digits + OWN_SPARE_DIGITS))

    @cached_property
    def compared(self) -> tuple[Sample, Any, NDArray[np.intp]]:
        """The run at the times of the comparison, and the exact motion of its numbers there.

        And the indices of those times that do not depend on the samples, the end last. Of a run in
        more digits only some samples are compared.
        """
        samples, times = self.orbit.samples, times_between(self.orbit.end, self.motion.period)
        times = self.orbit.integrator.numbers(times)
        states, between, place = self._recorded, self.orbit.between, self.orbit.places_of(times)
        if place is None:
            between, place = self.orbit.at(times), np.arange(times.size)
            states = TimedStates.join([samples, between])
        run = self.readings if states is self._recorded else self.read(states)
        fixed = np.append(samples.t.size + place, samples.t.size - 1)
        if self.in_doubles:
            count = slice(samples.t.size + between.t.size)  # zeros have no angles beside a pole
            run, exact = run.at(count), self._exact_at(states)
            known = exact and SomeRows(exact, count)
        else:
            run = run.at(np.append(spread_places(samples.t.size), fixed)).mapped(self.numbers)
            known, fixed = None, np.arange(-fixed.size, 0)
        return run, known or self.exact(self.binary_motion.closed_form, run.t), fixed

    @cached_property
    def raw_samples(self) -> Sample:
        """The motion at the sample times of the scene, in the numbers of the run."""
        return self.readings.at(slice(self.orbit.samples.t.size))

    @cached_property
    def samples(self) -> Sample:
        """The motion at the sample times of the scene."""
        return round_sample(self.raw_samples)

    def text(self, x: Any) -> str | None:
        """Return a number of the run with the digits that the scene wants; None for nan.

        Parameters
        ----------
        x : number
            One of a Sample, in its own unit.
        """
        return None if x != x else str(self.ctx.nstr(self.number(x), self.scene.digits))

    @property
    def ctx(self) -> Context:
        """Mpmath's context of more digits than the run's numbers have."""
        return context(digits_of(self.bits))

    def nearest(self, x: Any) -> Any:
        """Return the number of the run that is nearest to an exact one, or one of mpmath.

        Parameters
        ----------
        x : number
        """
        engine = self.orbit.integrator.engine
        exact = number(self.ctx, x)
        return engine.number(exact if engine.bits == DOUBLE else self.ctx.nstr(exact, self.ctx.dps))

    def number(self, x: Any) -> Number:
        """Return a number of the run as one of `ctx`.

        Parameters
        ----------
        x : number
        """
        return self.ctx.mpf(x if hasattr(x, "_mpf_") else text(x))

    @property
    def t(self) -> Array:
        """Sample times, shape (k,) [s]."""
        return self.samples.t

    @property
    def theta(self) -> Array:
        """Tilt at the sample times, shape (k,) [rad]."""
        return self.samples.theta

    @property
    def phi(self) -> Array | None:
        """Precession at the sample times, shape (k,) [rad]; None where it is not followed."""
        return _column_or_none(self.samples.phi)

    @property
    def psi(self) -> Array | None:
        """Spin angle at the sample times, shape (k,) [rad]; None where it is not followed."""
        return _column_or_none(self.samples.psi)

    @property
    def axis(self) -> Array:
        """Symmetry axis in space at the sample times, shape (k, 3)."""
        return self.samples.axis

    @cached_property
    def invariants(self) -> dict[str, Array]:
        """Invariants of the formulation at the sample times, shape (k,) each, in units A = 1.

        ``energy`` is E'/A [1/s^2], ``p_phi`` and ``p_psi`` are p_phi/A and p_psi/A [1/s], and
        ``length`` is that of a vector or quaternion of unit length. What is called E_prime, p_phi
        and p_psi elsewhere is in J and kg m^2/s: A times these.
        """
        found = self.raw_invariants(self.raw_samples)
        return {name: values.astype(np.float64) for name, values in found.items()}

    def raw_invariants(self, run: Sample) -> dict[str, Array]:
        """Return the invariants at some samples, in the numbers of the run.

        Parameters
        ----------
        run : Sample
        """
        rows, constants, t = run.states, self.orbit.parameters, run.t
        if not self.in_doubles:  # else their changes would be lost in rounding
            finer = self.bits + 64
            rows, t = reals(rows, finer), reals(t, finer)
            constants = {name: reals(x, finer)[()] for name, x in constants.items()}
        return outputs.invariants(self.orbit.integrator.formulation, rows, constants, t)


def round_sample(found: Sample) -> Sample:
    """Return a sample in doubles."""
    if found.t.dtype == np.float64:
        return found
    with np.errstate(invalid="ignore"):  # nan
        return found.mapped(lambda column: column.astype(np.float64))


def _column_or_none(values: Array) -> Array | None:
    return None if np.isnan(values).all() else values
