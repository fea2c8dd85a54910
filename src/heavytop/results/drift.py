"""The result of a drift study: errors of every run and over all starts, and how they grow."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, NamedTuple

import numpy as np

from heavytop.errors import Exit
from heavytop.files import write_sealed
from heavytop.results.base import Result, error_of
from heavytop.results.table import Fact, Table
from heavytop.scene.quantities import QUANTITIES, quantity_of

if TYPE_CHECKING:
    import pandas
    import xarray

DRIFT_FIELDS: Final = ("periods", "ensemble", "samples", "seed")
LAST_DECADES: Final = 3  # of the times that are fitted: earlier errors are those of the start
LEAST_POINTS: Final = 4
LEAST_ORDERS: Final = 3
SURE_POWER: Final = 0.2  # standard error of an exponent beyond which there is no power law,
EXPONENT_SHARE: Final = 0.12  # unless it is so small a part of the exponent
BOUNDED: Final = 0.25  # an exponent nearer to 0 than to that of a random walk
ORDER_ERRORS: Final = 1e-11, 0.03  # errors between which an order shows: above rounding, and small
METHOD_COLUMNS: Final = "energy", "energy_growth", "phase_s", "phase_growth", "axis"
SERIES: Final = ("energy", "phase_s", "axis", "p_phi", "p_psi")


class Growth(NamedTuple):
    """How an error grows: the exponent of a power law, or a word.

    Attributes
    ----------
    exponent : float or None
        1/2 for a random walk, 1 for a steady drift, 3/2 for the integral of a random walk; None
        where the error grows as no power.
    stderr : float or None
        Standard error of the exponent, from how far the points lie off the line. Errors at
        neighbouring times are not independent, so it is rather too small.
    points : int
        How many times were fitted.
    word : str
        Without an exponent ``bounded``, ``changes sign`` or ``lost`` (the last error is None);
        empty where none of them is sure.
    """

    exponent: float | None
    stderr: float | None
    points: int
    word: str = ""


class Drift(Result):
    """The result of a drift study; ``drift["strang"]`` is one method.

    Attributes
    ----------
    scene : mapping
        The top, and the start beside which the others are.
    periods : float
        Nutation periods to go.
    ensemble, samples, seed : int
        How many starts, times at which errors are measured, and the seed of the starts.
    spread : float
        How far the starts lie apart at most, relative [1].
    starts : tuple of mapping from str to float
        The initial conditions of every start, as doubles [rad, rad/s]; first the scene's own.
    methods : tuple of mapping
        The results of each, in the order of the arguments: ``name``, ``formulation``, ``language``,
        ``setting``, ``us_per_period`` [µs] (None in its folder), mean ``steps`` of a run, why runs
        ``ended`` early by the number of the start, why it was ``skipped``; at ``periods`` (times
        in nutation periods of each run's own start) root mean squares over the starts of
        ``energy`` (E' relative to max(|E'|, gMR)), ``p_phi``, ``p_psi``, other ``invariants``,
        ``phase_s`` [s] and ``axis``, and the errors of every run, with their signs, as
        ``members``. None where the formulation does not determine an error or cannot change it,
        and of the phase from where a run is off by a twentieth of a period.
        ``growth`` of energy and phase is an exponent of the time, "bounded", "changes sign",
        "lost" or None; ``energy_exponent``, ``phase_exponent`` and ``stderr`` are the numbers.
        Of a method of fixed steps its ``order``, published, or measured of one of your own; of
        one of your own how often it ``warned``.
    """

    schema: ClassVar = "heavytop/drift/1"
    heading: ClassVar = "Drift"
    index: ClassVar = ("scheme", "periods")
    data_file: ClassVar = "drift.nc"

    scene: Mapping[str, Any]
    periods: float
    ensemble: int
    samples: int
    seed: int
    spread: float
    starts: tuple[Mapping[str, float], ...]
    methods: tuple[Any, ...]

    def __getitem__(self, name: str) -> Any:
        """Return one method by its name; KeyError, with all names, if there is none."""
        methods = {each.name: each for each in self.methods}
        if name not in methods:
            raise KeyError(f"{name!r}: this study has {', '.join(methods)}")
        return methods[name]

    def facts(self) -> Iterator[Fact]:
        """Yield what was run, the meanings of columns, what was skipped and why."""
        several = f"{self.ensemble} starts within {self.spread:.0%} (seed {self.seed}), RMS"
        starts = "the scene's start" if self.ensemble == 1 else several
        ends = {x.name: max(x.periods, default=0) for x in self.methods if x.skipped is None}
        short = ", ".join(f"{n} {x:.7g}" for n, x in ends.items() if x < self.periods - 2)
        last = f"the last time{short and f' ({short} periods)'}"
        yield "drift", f"{self.periods:g} nutation periods, {starts}; errors at {last}"
        yield "time", f"{quantity_of('us_per_period').unit} a nutation period"
        yield "energy", error_of("energy").name
        if any(None in each.phase_s for each in self.methods):
            yield "lost", "at so many periods the phase error passes a twentieth of one"
        yield "as t^", QUANTITIES["energy_growth"].name
        for each in self.methods:
            if each.skipped is not None:
                yield each.name, f"skipped: {each.skipped}"
            if each.get("order") and ":" in each.name:
                yield each.name, f"order {each.order:.2g}, measured"
            for text, count in each.get("warned", {}).items():
                yield each.name, f"warned {count}×: {text}"
            for start, why in each.ended.items():
                which = f"start {start} " if self.ensemble > 1 else ""
                yield each.name, f"{which}ended early: {why}"

    def tables(self) -> Iterator[Table]:
        """Yield the table of the errors of every method at the last time."""
        about = {"name": quantity_of("scheme"), **{n: error_of(n) for n in ("energy", "axis")}}
        rows = [_last(each) for each in self.methods if each.skipped is None]
        timed = ["us_per_period"] * any(row["us_per_period"] for row in rows)
        yield Table(rows, ("name", *timed, *METHOD_COLUMNS), meanings=about)

    def problems(self) -> Iterator[tuple[Exit, str]]:
        """Yield users' methods that were skipped, and runs that ended early."""
        yield from super().problems()
        for each in self.methods:
            for number, why in each.ended.items():
                yield Exit.ENDED_EARLY, f"{each.name}, start {number}, ended early: {why}"

    def failures(self) -> Mapping[str, str]:
        """Return users' methods that were not run, and why."""
        return {x.name: x.skipped for x in self.methods if x.skipped and ":" in x.name}

    def without_times(self) -> Mapping[str, Any]:
        """Return the methods without the time of a period."""
        return {"methods": [{**each, "us_per_period": None} for each in self.methods]}

    def timed(self, journal: Any) -> Drift:
        """Return the result with the time of a period [µs], if a journal is that of this study.

        Parameters
        ----------
        journal : Journal
        """
        if any(journal.parameters.get(name) != getattr(self, name) for name in DRIFT_FIELDS):
            return self

        def us_per_period(method: Any) -> float | None:
            numbers = range(len(method.members))
            records = [journal.record(task_name(method.name, k)) for k in numbers]
            done = sum(each.last.checkpoint["periods"] for each in records if each.last.checkpoint)
            return sum(each.seconds for each in records) / done * 1e6 if done else None

        timed = ({**each, "us_per_period": us_per_period(each)} for each in self.methods)
        return replace(self, methods=tuple(timed))

    def save_data(self, folder: Path) -> dict[str, str]:
        """Write ``drift.nc``.

        Parameters
        ----------
        folder : Path
        """
        data = bytes(self.to_xarray().to_netcdf(engine="h5netcdf"))  # whole before it is on disk
        write_sealed(folder / self.data_file, lambda part: part.write_bytes(data))
        return {"errors": self.data_file}

    def numbers(self, *, members: bool = False) -> Table:
        """Return the errors over time, a row for each method and each time.

        Parameters
        ----------
        members : bool
            Whether those of each run, with its ``start``, instead of those over all starts.
        """
        runs = [
            ({"scheme": method.name, "start": start}, run)
            for method in self.methods
            for start, run in enumerate(method.members if members else [method])
        ]
        rows = [
            {**which, "periods": n} | {name: x[k] for name, x in errors_of(run).items() if x}
            for which, run in runs
            for k, n in enumerate(run.periods)
        ]
        errors = error_names(run for _, run in runs)
        keys = ("scheme", *["start"] * members, "periods")
        about = {name: error_of(name) for name in errors}
        return Table(rows, (*keys, *errors), meanings=about, keys=keys)

    def to_xarray(self) -> xarray.Dataset:
        """Return errors over ``scheme`` and ``periods``, nan where there are none.

        ``energy`` and the others are root mean squares over the starts, and ``member_energy``, over
        ``start`` too, the errors of each run.

        (A dimension called method could not be selected: xarray has an option of that name.)
        """
        import xarray

        members = self.numbers(members=True).to_xarray()
        every = members.rename({name: f"member_{name}" for name in members})
        found = xarray.merge([self.numbers().to_xarray(), every], join="outer")
        about = {n: getattr(self, n) for n in ("schema", "spread", "ensemble", "samples", "seed")}
        names = [method.name for method in self.methods]
        found = found.reindex(scheme=names, start=range(self.ensemble))
        return found.assign_attrs(title=self.scene["title"], **about)

    def to_pandas(self, *, members: bool = False) -> pandas.DataFrame:
        """Return the errors over time as a pandas DataFrame, units in its attributes.

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
        return self.numbers(members=members).to_pandas()


def task_name(text: str, number: int) -> str:
    """Return the name of a run: its method and the number of its start."""
    return f"{text}/{number:04d}"


def errors_of(run: Any) -> dict[str, Sequence[float | None]]:
    """Return the errors of a method, or of one of its runs, by name."""
    return {**{name: run[name] for name in SERIES}, **run["invariants"]}


def error_names(runs: Iterable[Any]) -> list[str]:
    """Return the names of the errors of methods or of runs."""
    return [*dict.fromkeys(SERIES) | {name: None for run in runs for name in errors_of(run)}]


def _last(method: Any) -> dict[str, Any]:
    """Return the row of a method: its errors at the last time, and how they grow."""
    row = {"name": method.name, "us_per_period": method.get("us_per_period")}
    row |= {name: x[-1] for name, x in errors_of(method).items() if x}
    if method.periods and row["phase_s"] is None:
        row["phase_s"] = f"lost at {method.periods[method.phase_s.index(None)]:.3g}"
    for name in ("energy", "phase"):
        grows = method.growth[name]
        if isinstance(grows, float | int):
            grows = f"{grows:.2f}({max(1, round(100 * (method.stderr[name] or 0.0)))})"
        row[f"{name}_growth"] = grows
    return row


def growth(
    periods: Sequence[float], errors: Sequence[float | None], signs: Sequence[float | None] = ()
) -> Growth:
    """Return the growth of errors over the last three decades of the time.

    Parameters
    ----------
    periods : sequence of float, shape (k,)
    errors : sequence of (float or None), shape (k,)
        RMS errors; zeros and None are left out, and the last of the others ends the decades.
    signs : sequence of (float or None), shape (k,), optional
        The errors of one run, whose sign may change.

    Examples
    --------
    >>> n = [10.0, 100.0, 1000.0, 10000.0]
    >>> found = growth(n, [1e-15 * x**1.5 for x in n])
    >>> round(found.exponent, 6), found.points
    (1.5, 4)
    >>> growth(n, [0.0, None, 1e-15, 2.0])
    Growth(exponent=None, stderr=None, points=2, word='')
    """
    points = [(n, e) for n, e in zip(periods, errors, strict=True) if e]
    from_here = max((n for n, _ in points), default=0.0) / 10**LAST_DECADES * 0.999
    fitted = [(n, e) for n, e in points if n >= from_here]
    slope, stderr = _power(fitted, LEAST_POINTS)
    if slope is not None and slope >= BOUNDED:
        return Growth(slope, stderr, len(fitted))
    known = [e for n, e in zip(periods, signs, strict=False) if e and n >= from_here]
    word = "lost" if None in [*errors[-1:]] else ""
    if slope is not None:
        word = "bounded"
    elif len(fitted) >= LEAST_POINTS and any(a * b < 0 for a, b in pairwise(known)):
        word = "changes sign"
    return Growth(None, None, len(fitted), word)


def order_of(errors: Mapping[float, float | None]) -> float | None:
    """Return the order of a method: how its error falls with the number of its steps.

    Parameters
    ----------
    errors : mapping from float to (float or None)
        By the number of steps; five of those between rounding and the size of the motion, with the
        most steps, are fitted.

    Examples
    --------
    >>> round(order_of({n: n**-4.0 for n in (1, 10, 20, 40, 80, 1e4)}), 6)
    4.0
    """
    least, most = ORDER_ERRORS
    clear = [(n, e) for n, e in sorted(errors.items()) if e and least < e < most]
    slope, _ = _power(clear[-5:], LEAST_ORDERS)
    return None if slope is None or slope >= -BOUNDED else -slope


def _power(points: Sequence[tuple[float, float]], least: int) -> tuple[float | None, float | None]:
    """Return the exponent of a power law, fitted to logarithms, and its standard error.

    None where there are fewer than `least` points, or they follow no power law.
    """
    if len(points) < least:
        return None, None
    x, y = np.log(np.array(points, float)).T
    (slope, _), covariance = np.polyfit(x, y, 1, cov=True)
    stderr = float(np.sqrt(covariance[0, 0]))
    sure = stderr < max(SURE_POWER, EXPONENT_SHARE * abs(slope))
    return (float(slope), stderr) if sure else (None, None)
