"""A trajectory: the scene, the plan, what was seen, and the motion at any time between."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heavytop.analytic.motion import Motion
from heavytop.errors import Impossible, NotANumber, Outcome
from heavytop.integration.compiled import Seen
from heavytop.integration.integrator import Orbit
from heavytop.integration.outputs import ANGLES, RATES, Sample, invariants, sample
from heavytop.run.events import Events
from heavytop.run.planning import Plan
from heavytop.scene.scene import Scene

if TYPE_CHECKING:
    import xarray

    from heavytop.run.high_precision import Decimals

Array = NDArray[np.float64]
ROUNDED = 4 * np.finfo(float).eps


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


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
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
        times = _doubles(t)
        if times.ndim > 1 or not np.isfinite(times).all():
            raise NotANumber("t: a finite time or a one-dimensional array of them")
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

    @cached_property
    def invariants(self) -> dict[str, Array]:
        """Invariants of the formulation at the sample times, shape (k,) each, in units A = 1.

        ``energy`` is E'/A [1/s^2], ``p_phi`` and ``p_psi`` are p_phi/A and p_psi/A [1/s], and
        ``length`` is that of a vector or quaternion of unit length. What is called E_prime, p_phi
        and p_psi elsewhere is in J and kg m^2/s: A times these.
        """
        run, formulation = self.samples, self.orbit.integrator.formulation
        return invariants(formulation, run.states, self.orbit.parameters, run.t)

    def to_xarray(self) -> xarray.Dataset:
        """Return samples and events as an xarray Dataset that holds the scene itself."""
        from heavytop.run.trajectory_file import dataset

        return dataset(self)

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


def _doubles(t: ArrayLike) -> Array:
    try:
        return np.asarray(t, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise NotANumber("t: a finite time or a one-dimensional array of them") from None


def _known(values: Array) -> Array | None:
    return None if np.isnan(values).all() else values
