"""A trajectory: the scene, the plan, what was seen, and the motion at any time between.

Beside a run in doubles there may be one in more digits, `Decimals`.
"""

from __future__ import annotations

import math
import os
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from threading import RLock
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.analytic.motion import Motion
from heavytop.equations.formulation import Formulation
from heavytop.errors import Impossible, NotANumber, Outcome
from heavytop.exact.decimals import Context, Number, context, number
from heavytop.integration import outputs
from heavytop.integration.bits import bits_of, digits_of
from heavytop.integration.compiled import Seen
from heavytop.integration.high_precision import Mark, PreciseIntegrator
from heavytop.integration.integrator import Orbit
from heavytop.integration.outputs import VECTORS, Sample, sample
from heavytop.integration.projection import GOLDEN
from heavytop.integration.turns import GRAIN_BITS, in_bits
from heavytop.run.events import Event, Events
from heavytop.run.planning import Plan, rounded_start, start_values
from heavytop.scene.quantities import ANGLES, RATES
from heavytop.scene.scene import Scene
from heavytop.text import Played

if TYPE_CHECKING:
    import pandas
    import xarray

Array = NDArray[np.float64]
ROUNDED = 4 * np.finfo(float).eps
WALK = RLock()  # an engine walks for one thread at a time
SPREAD, LATE = 64, 16  # times over the span and over the last period at which a run is compared


@dataclass(frozen=True, slots=True)
class Statistics:
    """What a run cost.

    Attributes
    ----------
    steps : int
        Natural steps of the integrator.
    order : int
        Order of its Taylor polynomials.
    derive_s, compile_s, integrate_s : float
        Wall-clock time of the parts [s].
    whole : bool
        Whether the times are of the whole run: a file does not keep those of its part.
    """

    steps: int
    order: int
    derive_s: float
    compile_s: float
    integrate_s: float
    whole: bool = True


@dataclass(frozen=True, eq=False)
class Decimals:
    """A run in more than double precision, which can be asked for the motion at any time.

    Attributes
    ----------
    digits : int
        Decimal digits wanted.
    form : Formulation
        The equations.
    engine : PreciseIntegrator
        What takes the steps.
    ctx : Context
        Of more digits than the states.
    far, longest : float, float or None
        Bounds of a step, and of the first ones [s].
    marks : tuple of Mark
        States from which it can go on.
    samples : tuple of Sample
        At the sample times of the scene, in mpmath numbers; the last one is the end.
    events : tuple of Event
        In the order of the run, each with its ``kind``, the ``sample`` there and the ``residual``.
    between : tuple of Sample
        At the times of `times_between`.
    """

    digits: int
    form: Formulation
    engine: PreciseIntegrator
    ctx: Context
    far: float
    longest: float | None
    marks: tuple[Mark, ...]
    samples: tuple[Sample, ...] = ()
    events: tuple[Event, ...] = ()
    between: tuple[Sample, ...] = ()

    @classmethod
    def of(cls, scene: Scene, chosen: Plan, orbit: Orbit) -> Decimals:
        """Return the start of the run of a scene's plan.

        Parameters
        ----------
        scene : Scene
        chosen : Plan
        orbit : Orbit
            The run in doubles.
        """
        own, bits = chosen.integrated, bits_of(chosen.precision)
        ctx = context(digits_of(bits))
        constants, state = rounded_start(chosen, start_values(scene), ctx)
        events = tuple(own.events) if chosen.watched else ()
        engine = PreciseIntegrator(own, bits, constants, events, state)
        first = orbit.checkpoints[0]
        far = 4.0 * (orbit.end - first.time[0])
        longest = orbit.integrator.for_this_thread().cautious_step(first, far)
        turns, angles = orbit.integrator.turns, tuple(first.state[len(own.states) :].tolist())
        engine.turns = turns and in_bits(turns, bits)
        start = replace(engine.start(state), turned=angles)
        return cls(scene.digits, chosen.equations, engine, ctx, far, longest, (start,))

    @cached_property
    def constants(self) -> dict[str, Any]:
        """The constants of the run as they are used, by symbol name, as reals of `ctx`."""
        return self.engine.constants(self.ctx.prec)

    @property
    def parameters(self) -> dict[str, Number]:
        """The same, as numbers of `ctx`."""
        return {name: self.ctx.mpf(str(x)) for name, x in self.constants.items()}

    @property
    def grain(self) -> Number:
        """How well a state is known, once it may have drifted."""
        return self.ctx.ldexp(1, GRAIN_BITS - self.engine.bits)

    def walk(
        self,
        wanted: Sequence[tuple[Number, str | None]],
        on_mark: Callable[[float], None] | None = None,
        first: int = 0,
    ) -> tuple[tuple[Mark | None, ...], tuple[Mark, ...]]:
        """Take natural steps from a mark until everything wanted is found.

        Parameters
        ----------
        wanted : sequence of (number, str or None)
            Times [s]; with the name of an event function, the zero of that close to the time.
        on_mark : callable, optional
            Called with the time reached [s], at every mark but the last.
        first : int
            Which of the marks; the start for one.
        """
        ctx = self.ctx
        texts = [(ctx.nstr(ctx.mpf(t), ctx.dps), event) for t, event in wanted]
        with WALK:
            return self.engine.walk(self.marks[first], texts, self.far, self.longest, on_mark)

    def at(self, times: Sequence[Number]) -> tuple[Sample, ...]:
        """Return the motion at times between start and end, to all digits.

        Parameters
        ----------
        times : sequence of number
            Times [s], of any kind of number, in any order.
        """
        known = [abs(float(mark.t)) for mark in self.marks]
        before = [max(bisect_left(known, abs(float(t))) - 1, 0) for t in times]
        found: dict[int, Any] = {}
        for first in set(before):
            here = [i for i, mark in enumerate(before) if mark == first]
            seen, _ = self.walk([(times[i], None) for i in here], first=first)
            found |= zip(here, seen, strict=True)
        return self.numbers(self.sampled([found[i] for i in range(len(times))]))

    def sampled(self, found: Sequence[Mark]) -> Sample:
        """Return the motion at states of the run, in reals.

        Parameters
        ----------
        found : sequence of Mark
            The states.
        """
        return self.engine.sample(self.form, found, self.ctx.prec)

    def numbers(self, sample: Sample) -> tuple[Sample, ...]:
        """Return a sample in reals one by one, in numbers of `ctx`.

        Parameters
        ----------
        sample : Sample
            As `sampled` returns it.
        """
        converted = np.frompyfunc(lambda x: self.ctx.mpf(str(x)), 1, 1)
        columns = (converted(getattr(sample, name)).tolist() for name in Sample.__slots__)
        return tuple(Sample(*row) for row in zip(*columns, strict=True))

    def invariants(self, sample: Sample) -> dict[str, Number]:
        """Return the invariants of the formulation at a sample, by name.

        Parameters
        ----------
        sample : Sample
            One of `samples`.
        """
        rows = np.array([[self.real(x) for x in sample.states]])
        found = outputs.invariants(self.form, rows, self.constants, rows[:, 0])
        return {name: self.ctx.mpf(str(x)) for name, (x,) in found.items()}

    def real(self, x: Any) -> Any:
        """Return the real of a number of any kind.

        Parameters
        ----------
        x : number
        """
        return self.engine.wide(self.whole(x))

    def whole(self, x: Any) -> str:
        """Return a text by which every bit comes back.

        Parameters
        ----------
        x : number
        """
        return str(self.ctx.nstr(number(self.ctx, x), self.ctx.dps + 3))

    def rounded(self, samples: Sequence[Sample]) -> Sample:
        """Return the motion at several times, every number rounded to double.

        Parameters
        ----------
        samples : sequence of Sample
            As `at` returns them.
        """
        widths = {name: len(indices) for name, indices in VECTORS.items()}
        widths["states"] = len(self.samples[0].states)

        def column(name: str) -> Any:
            values = np.array([getattr(s, name) for s in samples], dtype=np.float64)
            return values.reshape(-1, widths[name]) if name in widths else values

        return Sample(*map(column, Sample.__slots__))

    def text(self, x: Number) -> str | None:
        """Return a number with the digits that are wanted; None for nan.

        Parameters
        ----------
        x : number
            One of a Sample, in its own unit.
        """
        return None if x != x else str(self.ctx.nstr(x, self.digits))


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Played):
    """The motion of a scene, integrated.

    Call it with a time between start and end [s], or an array of them in any order, shape (k,),
    and it returns a `Sample` of as many. The block of steps that holds a time is run again, bit
    for bit, so that nothing but the start of each block is kept in memory.

    Attributes
    ----------
    scene : Scene
        What was run.
    motion : Motion
        The exact motion of the scene, which the run is held against.
    plan : Plan
        How.
    events : Events
        Turning points, reversals and cusps, as far as the scene asked for them.
    outcome : Outcome
        How it ended.
    statistics : Statistics
        Steps and times.
    orbit : Orbit
        The integration itself, in double precision: states, checkpoints, zeros.
    decimals : Decimals or None
        The same in more than double precision, where the scene's digits take it; then all else
        that is here is it, rounded.
    source : str
        ``integrated``; a `SceneMotion` has ``closed form``.

    Examples
    --------
    >>> import heavytop as ht
    >>> trajectory = ht.propagate(ht.load_scene("sicm-kicked"))
    >>> print(f"{trajectory(2.0).theta:.12f}")
    0.426943705310
    """

    scene: Scene
    motion: Motion
    plan: Plan
    orbit: Orbit
    events: Events
    outcome: Outcome
    statistics: Statistics
    decimals: Decimals | None = None
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
        low, high = sorted((0.0, self._end))
        if times.size and (times.min() < low or times.max() > high):
            rule = f"between {low} and {high}, where the trajectory was integrated"
            raise Impossible([("t", rule)])
        found = self._at(times.reshape(-1))
        return found if times.ndim else found.at(0)

    @property
    def _end(self) -> float:
        """The later of the ends in double precision and in more, which may be an ulp apart [s]."""
        more = () if self.decimals is None else self.decimals.samples[-1:]
        return max((self.orbit.end, *(float(s.t) for s in more)), key=abs)

    def _at(self, times: Array) -> Sample:
        if self.decimals is None:
            return self._sampled(self.orbit.at(times))
        return self.decimals.rounded(self.decimals.at(times.tolist()))

    def _sampled(self, seen: Seen) -> Sample:
        formulation = self.orbit.integrator.formulation
        found = sample(formulation, seen.states, self.orbit.parameters, seen.t)
        begun = seen.t == 0
        if not begun.any():
            return found
        start = {name: float(getattr(self.scene.start, name)) for name in (*ANGLES, *RATES)}
        told = {}
        for names in (ANGLES, RATES):  # what the scene says, not what its states round to
            rounding = ROUNDED * max(1.0, *(abs(start[name]) for name in names))
            for name in names:
                column, known = getattr(found, name), start[name]
                near = begun & (abs(column - known) <= rounding)
                told[name] = np.where(near, known, column)
        return replace(found, **told)

    @cached_property
    def samples(self) -> Sample:
        """The motion at the sample times of the scene."""
        if self.decimals is not None:
            return self.decimals.rounded(self.decimals.samples)
        return self._sampled(self.orbit.samples)

    @cached_property
    def between(self) -> Sample:
        """The motion at times that do not depend on the samples, as `times_between` has them."""
        if self.decimals is not None:
            return self.decimals.rounded(self.decimals.between)
        times, seen = times_between(self._end, self.motion.period), self.orbit.between
        on_the_way = seen is not None and seen.t.size == times.size  # of a run in one piece
        return self._sampled(seen) if seen is not None and on_the_way else self(times)

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
        return _known(self.samples.phi)

    @property
    def psi(self) -> Array | None:
        """Spin angle at the sample times, shape (k,) [rad]; None where it is not followed."""
        return _known(self.samples.psi)

    @property
    def axis(self) -> Array:
        """Symmetry axis in space at the sample times, shape (k, 3)."""
        return self.samples.axis

    @property
    def reaction(self) -> Array:
        """The force of the pivot on the top [N], in space, at the samples."""
        force: Array = self.scene.top.reaction(self.samples.axis, self.samples.omega)
        return force

    @cached_property
    def invariants(self) -> dict[str, Array]:
        """Invariants of the formulation at the sample times, shape (k,) each, in units A = 1.

        ``energy`` is E'/A [1/s^2], ``p_phi`` and ``p_psi`` are p_phi/A and p_psi/A [1/s], and
        ``length`` is that of a vector or quaternion of unit length. What is called E_prime, p_phi
        and p_psi elsewhere is in J and kg m^2/s: A times these.
        """
        run, formulation = self.samples, self.orbit.integrator.formulation
        return outputs.invariants(formulation, run.states, self.orbit.parameters, run.t)

    def to_xarray(self) -> xarray.Dataset:
        """Return samples and events as an xarray Dataset that holds the scene itself."""
        from heavytop.run.trajectory_file import dataset

        return dataset(self)

    def to_pandas(self, *, events: bool = False) -> pandas.DataFrame:
        """Return the samples as a pandas DataFrame with the times [s] as index.

        Columns are named as in `to_xarray`, those of vectors ``axis_x`` and so on; ``attrs`` has
        their units.

        Parameters
        ----------
        events : bool
            Whether the events instead, a row for each, with its ``kind``.

        Examples
        --------
        >>> import heavytop as ht
        >>> table = ht.propagate(ht.load_scene("sicm-kicked")).to_pandas()
        >>> print(table.index.name, table.theta[0.0], table.attrs["units"]["theta"])
        t 0.1 rad
        """
        data = self.to_xarray()
        if events:
            met = {f"{n}".removeprefix("event_"): x for n, x in data.data_vars.items()
                   if x.dims[0] == "event"}  # fmt: skip
            data = data.drop_vars([*data.data_vars, "t"]).assign(met).swap_dims(event="t")
        columns: dict[str, Any] = {"t": data["t"]}
        for name, x in data.data_vars.items():
            if x.dims == ("t",):
                columns[f"{name}"] = x
            elif x.dims[:1] == ("t",):
                parts = enumerate(data[x.dims[1]].values)
                columns |= {f"{name}_{p}": x.isel({x.dims[1]: k}, drop=True) for k, p in parts}
        table = type(data)(columns).to_dataframe()
        table.attrs = dict(data.attrs)
        for key in ("units", "long_name"):
            table.attrs[key] = {n: x.attrs[key] for n, x in columns.items() if key in x.attrs}
        return table

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the trajectory to a netCDF file, whole or not at all.

        Parameters
        ----------
        path : path
            The file; one that is there is replaced.

        Raises
        ------
        OSError
            It cannot be written.
        """
        from heavytop.run.trajectory_file import write

        write(self, path)


def times_between(end: float, period: float | None) -> Array:
    """Return times at which every run is compared: over its span, over its last period, its end.

    Samples a whole number of periods apart would see every error at one phase only; at a turning
    point that hides an error in time.
    """
    spread = np.mod(np.arange(1, SPREAD + 1) * GOLDEN, 1.0)
    late = math.copysign(min(abs(end), period or abs(end)), end)
    return np.concatenate((end * spread, end - late * spread[:LATE], [end]))


def times_of(t: ArrayLike) -> Array:
    """Return a time, or a row of them, as doubles, if they are finite [s]."""
    try:
        times = np.asarray(t, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        times = np.array(np.nan)
    if times.ndim > 1 or not np.isfinite(times).all():
        raise NotANumber("t: a finite time or a one-dimensional array of them")
    return times


def _known(values: Array) -> Array | None:
    return None if np.isnan(values).all() else values
