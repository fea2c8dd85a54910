"""A drift: errors of every run, and over all starts, and how they grow."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from heavytop.display import Plotted
from heavytop.frames import frame
from heavytop.results.base import Column, Number, Part, Problem, Result, Text, Values

if TYPE_CHECKING:
    import pandas
    import xarray

LAST_DECADES: Final = 3  # of the times that are fitted: earlier errors are those of the start
LEAST_POINTS: Final = 4
COLUMNS: Final = {
    "periods": ("time in nutation periods", "1"),
    "energy": ("error of E', relative to max(|E'|, gMR)", "1"),
    "p_phi": ("error of p_phi, relative", "1"),
    "p_psi": ("error of p_psi, relative", "1"),
    "phase_s": ("phase error of the nutation", "s"),
    "axis": ("distance of the axis, a unit vector", "1"),
}
STARTS: Final = {
    **dict.fromkeys(("theta", "phi", "psi"), "rad"),
    **dict.fromkeys(("thetadot", "phidot", "psidot", "omega3"), "rad s-1"),
}
"""The initial conditions of each start, with their units."""


@dataclass(frozen=True, kw_only=True)
class ErrorSeries(Part):
    """Errors at the sample times of a study.

    Attributes
    ----------
    periods : tuple of float, shape (k,)
        Times in nutation periods of each run's own start.
    energy, p_phi, p_psi, phase_s, axis : tuple of (float or None), shape (k,)
        Of E' relative to max(|E'|, gMR), of the momenta, relative, of the phase [s], and of the
        axis; None where the formulation does not determine it, or cannot change it, and of the
        phase from where a run is off by a twentieth of a period: beyond that the phase error
        measures nothing.
    invariants : mapping from str to tuple
        The same of the formulation's other invariants, relative.
    """

    periods: tuple[Number, ...] = ()
    energy: Column = ()
    p_phi: Column = ()
    p_psi: Column = ()
    phase_s: Column = ()
    axis: Column = ()
    invariants: Mapping[Text, Column] = field(default_factory=dict)

    @property
    def columns(self) -> dict[str, Column]:
        """All of them by name."""
        return {name: getattr(self, name) for name in COLUMNS} | dict(self.invariants)


@dataclass(frozen=True, kw_only=True)
class MemberDrift(ErrorSeries):
    """The errors of one run, with their signs, at the times that it reached.

    Attributes
    ----------
    steps : int
        How many it took. What else there is: `ErrorSeries`.
    """

    steps: int


@dataclass(frozen=True, slots=True)
class Growth:
    """An error that grows as a power of the time.

    Attributes
    ----------
    exponent : float or None
        1/2 for a random walk, 1 for a steady drift, 3/2 for the integral of a random walk; None
        where there is nothing to fit.
    stderr : float or None
        Standard error of the exponent, from how far the points lie off the line. Errors at
        neighbouring times are not independent, so it is rather too small.
    points : int
        How many times were fitted.
    """

    exponent: float | None
    stderr: float | None
    points: int


@dataclass(frozen=True, kw_only=True)
class MethodDrift(ErrorSeries):
    """How the errors of one method grow.

    Its own errors are root mean squares over the starts of those that `members` have, at the times
    that all runs reached; None from where one has None.

    Attributes
    ----------
    name : str
        As it was asked for, such as ``strang=200``.
    formulation, language : str
        Of the right-hand side.
    setting : mapping from str to float
        Its tolerance, or its steps a period.
    us_per_period : float or None
        Time in the integrator, mean over the runs [µs]; None where runs were begun by another
        process.
    steps : float or None
        Mean number of steps of a run.
    ended : mapping from str to str
        Why runs ended early, by the number of the start.
    skipped : str or None
        Why the method was not run.
    spread : ErrorSeries or None
        Standard deviations over the starts, of the errors with their signs.
    members : tuple of MemberDrift
        The runs, in the order of `Drift.starts`.
    """

    name: Text
    formulation: Text
    language: Text
    setting: Values
    us_per_period: Number | None = None
    steps: Number | None = None
    ended: Mapping[Text, Text] = field(default_factory=dict)
    skipped: Text | None = None
    spread: ErrorSeries | None = None
    members: tuple[MemberDrift, ...] = ()

    @cached_property
    def energy_growth(self) -> Growth:
        """With which power of the time the energy error grows."""
        return growth(self.periods, self.energy)

    @cached_property
    def phase_growth(self) -> Growth:
        """With which power of the time the phase error grows."""
        return growth(self.periods, self.phase_s)

    def document(self) -> dict[str, Any]:
        """Return the method for JSON, with the powers of time."""
        energy, phase = self.energy_growth, self.phase_growth
        return super().document() | {
            "energy_exponent": energy.exponent,
            "phase_exponent": phase.exponent,
            "stderr": {"energy": energy.stderr, "phase": phase.stderr},
        }


@dataclass(frozen=True, kw_only=True)
class Drift(Result, Plotted):
    """The result of a drift study; ``drift["strang"]`` is one method.

    Attributes
    ----------
    scene : Problem
        The top, and the start beside which the others are.
    periods : float
        Nutation periods to go.
    ensemble, samples, seed : int
        How many starts, times at which errors are measured, and the seed of the starts.
    spread : float
        How far the starts lie apart at most, relative.
    starts : tuple of mapping from str to float
        The initial conditions of every start, as doubles [rad, rad/s]; first the scene's own.
    methods : tuple of MethodDrift
        What was found of each, in the order asked.
    """

    schema: Literal["heavytop/drift/1"] = "heavytop/drift/1"
    scene: Problem
    periods: Number
    ensemble: int
    samples: int
    seed: int
    spread: Number
    starts: tuple[Mapping[Text, Number], ...]
    methods: tuple[MethodDrift, ...]

    def __getitem__(self, name: str) -> MethodDrift:
        """Return one method by its name; KeyError, with all names, if there is none."""
        known = {each.name: each for each in self.methods}
        if name not in known:
            raise KeyError(f"{name!r}: this study has {', '.join(known)}")
        return known[name]

    def document(
        self, *, costs: bool = True, files: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        """Return the document heavytop/drift/1.

        Parameters
        ----------
        costs : bool
            Whether with what a period took; without it there are no wall-clock values.
        files : mapping, optional
            Names of the files that were written, by what they are.
        """
        found = super().document(files=files)
        for each in () if costs else found["methods"]:
            del each["us_per_period"]
        return found

    def to_xarray(self) -> xarray.Dataset:
        """Return errors over ``scheme`` and ``mark``, nan where there are none.

        ``energy`` and the others are root mean squares over the starts, ``energy_spread`` standard
        deviations, and ``member_energy``, over ``start`` too, the errors of each run; ``theta`` and
        the others over ``start`` are the initial conditions.

        (A dimension called method could not be selected: xarray has an option of that name.)
        """
        import xarray

        each = self.methods
        alone = [run for one in each for run in one.members or [ErrorSeries()] * self.ensemble]
        spread = [one.spread or ErrorSeries() for one in each]
        width = max(len(run.periods) for run in alone)
        shape = (len(each), self.ensemble, width)
        axes = ("scheme", "mark")
        others = {name: None for one in each for name in one.invariants}
        columns = COLUMNS | {name: (f"error of {name}, relative", "1") for name in others}
        table: dict[str, Any] = {
            name: ("start", [one[name] for one in self.starts], _about(f"initial {name}", unit))
            for name, unit in STARTS.items()
        }
        for name, (what, unit) in columns.items():
            table[name] = axes, _padded(each, name, width), _about(what, unit)
            members = _padded(alone, name, width).reshape(shape)
            about = _about(f"{what}, of each start", unit)
            table[f"member_{name}"] = ("scheme", "start", "mark"), members, about
            about = _about(f"{what}, standard deviation over the starts", unit)
            table[f"{name}_spread"] = axes, _padded(spread, name, width), about
        del table["periods_spread"]
        schemes = [one.name for one in each]
        return xarray.Dataset(
            table,
            coords={"scheme": ("scheme", schemes, _about("method that was followed", "1"))},
            attrs={"title": self.scene.title,
                   **{name: getattr(self, name)
                      for name in ("schema", "spread", "ensemble", "samples", "seed")}},
        )  # fmt: skip

    def to_pandas(self, *, members: bool = False) -> pandas.DataFrame:
        """Return the errors that `to_xarray` has as a pandas DataFrame, units in its attributes.

        Its index are ``scheme`` and ``periods``, the times; ``to_pandas().loc["strang"]`` is one
        method.

        Parameters
        ----------
        members : bool
            Whether the errors of each run, over ``start`` too, instead of those over all starts.

        Examples
        --------
        >>> import heavytop as ht
        >>> found = ht.drift(ht.load_scene("sicm-kicked"), methods=["strang=100"], periods=2)
        >>> found.to_pandas().loc["strang", "energy"].size == len(found["strang"].energy)
        True
        """
        over = ("scheme", "start", "mark") if members else ("scheme", "mark")
        periods = "member_periods" if members else "periods"
        table = frame(self.to_xarray(), *over).dropna(subset=periods)  # what a run did not reach
        table = table.set_index(periods, append=True).droplevel("mark")
        return table.rename_axis([*over[:-1], "periods"])


def growth(periods: Sequence[float], errors: Sequence[float | None]) -> Growth:
    """Return the growth over the last three decades.

    Parameters
    ----------
    periods : sequence of float, shape (k,)
    errors : sequence of (float or None), shape (k,)
        RMS errors; zeros and None are left out, and the last of the others ends the decades.

    Examples
    --------
    >>> n = [10.0, 100.0, 1000.0, 10000.0]
    >>> found = growth(n, [1e-15 * x**1.5 for x in n])
    >>> round(found.exponent, 6), found.points
    (1.5, 4)
    >>> growth(n, [0.0, None, 1e-15, 2.0])
    Growth(exponent=None, stderr=None, points=2)
    """
    known = [(n, e) for n, e in zip(periods, errors, strict=True) if e]
    from_here = max((n for n, _ in known), default=0.0) / 10**LAST_DECADES * 0.999
    fitted = [(float(n), float(e)) for n, e in known if n >= from_here]
    if len(fitted) < LEAST_POINTS:
        return Growth(None, None, len(fitted))
    with np.errstate(invalid="raise", divide="raise"):  # of numbers in a file, any is possible
        x, y = np.log(fitted).T
        spread = x - x.mean()
        slope = float(spread @ y / (spread @ spread))
    residual = y - y.mean() - slope * spread
    variance = float(residual @ residual) / (len(fitted) - 2) / float(spread @ spread)
    return Growth(slope, float(np.sqrt(variance)), len(fitted))


def _padded(rows: Iterable[ErrorSeries], name: str, width: int) -> Any:
    """A column of each of several runs, filled up with nan."""
    columns = [each.columns.get(name, ()) for each in rows]
    return np.array([[*column, *[None] * (width - len(column))] for column in columns], float)


def _about(what: str, units: str) -> dict[str, str]:
    return {"long_name": what, "units": units}
